//! The command line: argv to calls. The only module that prints.

mod again;
mod args;
mod commands;
mod cover;
mod experiments;
mod print;
mod progress;
mod reach;

use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;

use args::Args;
use print::Printer;

/// How a command ended: the one place where exit codes are decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ending {
    /// All is done.
    Done,
    /// It ran, and a figure is outside its bounds.
    Unmet,
    /// Bad input, or input or output failed.
    Refused,
    /// Stopped by Ctrl-C; it can go on.
    Interrupted,
}

impl Ending {
    /// Exit code of a run that was stopped by Ctrl-C: 128 and the signal's number.
    const INTERRUPTED: i32 = 130;
}

impl From<Ending> for ExitCode {
    fn from(ending: Ending) -> Self {
        ExitCode::from(match ending {
            Ending::Done => 0,
            Ending::Unmet => 1,
            Ending::Refused => 2,
            Ending::Interrupted => Ending::INTERRUPTED as u8,
        })
    }
}

/// Runs the program; the exit code is 0 for done, 1 for a failed threshold, 2 for bad input or I/O, 130 after Ctrl-C.
pub fn main() -> ExitCode {
    let args = match Args::try_parse() {
        Ok(args) => args,
        Err(e) if e.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            // nothing was asked for: no mistake, and nothing done
            print::line(e.to_string().trim_end());
            return Ending::Refused.into();
        }
        Err(e) if e.use_stderr() => {
            print::error(&usage(&e.to_string()));
            return Ending::Refused.into();
        }
        Err(help) => {
            let printed = Printer::new().text(&help.to_string());
            return if printed.is_ok() { Ending::Done } else { Ending::Refused }.into();
        }
    };
    let ending = commands::run(&args).unwrap_or_else(|e| {
        print::error(&e.to_string());
        Ending::Refused
    });
    ending.into()
}

/// The first paragraph of clap's complaint, without its own "error:".
fn usage(message: &str) -> String {
    let first: Vec<&str> = message.lines().map(str::trim).take_while(|l| !l.is_empty()).collect();
    let text = first.join(" ");
    format!("{}; see calamus --help", text.strip_prefix("error: ").unwrap_or(&text))
}
