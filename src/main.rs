//! The command line of Calamus: see [`calamus::cli`].
use std::process::ExitCode;

fn main() -> ExitCode {
    calamus::cli::main()
}
