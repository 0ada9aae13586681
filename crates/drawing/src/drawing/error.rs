//! Why artwork can't become a drawing.
use std::path::PathBuf;

/// Artwork that can't become a drawing.
#[derive(Debug, thiserror::Error)]
pub enum DrawingError {
    /// The file can't be read at all.
    #[error("{}: {source}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Its content is wrong.
    #[error("{}:{line}: {message}", file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// 1-based line.
        line: usize,
        /// What is wrong and what would be right.
        message: String,
    },
    /// It is sound, but there is nothing to draw.
    #[error("{}: holds no strokes: {reason}", file.display())]
    Empty {
        /// The file.
        file: PathBuf,
        /// Why nothing is left.
        reason: String,
    },
    /// The extension says nothing about the format.
    #[error("{}: unknown kind of artwork: known are .svg, .jsonl (a stylus) and .txt (stroke text, one file per ink: name_k.txt)", file.display())]
    UnknownKind {
        /// The file.
        file: PathBuf,
    },
    /// An option or parameter is out of range.
    #[error("{name} = {value}: {message}")]
    BadOption {
        /// Name of the option.
        name: &'static str,
        /// The value given.
        value: f64,
        /// What would be right.
        message: String,
    },
}
