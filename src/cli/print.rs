//! Text to the terminal.
use std::io::{self, IsTerminal, Write};

use crate::math::{plain, sensible};

/// Prints to standard output. A reader that has gone (`calamus ... | head`) is no error.
pub(super) struct Printer {
    out: io::StdoutLock<'static>,
}

impl Printer {
    pub fn new() -> Self {
        Self { out: io::stdout().lock() }
    }

    /// Prints text, without what would move a terminal's cursor.
    pub fn text(&mut self, text: &str) -> io::Result<()> {
        match self.out.write_all(plain(text).as_bytes()).and_then(|()| self.out.flush()) {
            Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
            other => other,
        }
    }
}

/// Prints a line to standard error, plain and with sensible digits; a reader that has gone is no error.
pub(super) fn line(text: &str) {
    let _ = writeln!(io::stderr(), "{}", sensible(&plain(text)));
}

/// Prints `error: ` and the message, on one line whatever the message holds.
pub(super) fn error(message: &str) {
    let parts: Vec<&str> = message.lines().map(str::trim).filter(|l| !l.is_empty()).collect();
    line(&format!("error: {}", parts.join(" ")));
}

/// Whether a person watches standard error.
pub(super) fn on_terminal() -> bool {
    io::stderr().is_terminal()
}
