//! The command line: argv to calls. The only module that prints.
use std::process::ExitCode;

/// Runs the program; the exit code is 0 for done, 1 for a failed threshold, 2 for bad input or I/O.
pub fn main() -> ExitCode {
    ExitCode::SUCCESS
}
