//! Why an artwork can't be drawn.
use std::path::PathBuf;

use crate::art::ArtError;
use crate::art::depth::SemanticsError;
use crate::diagnostic::ConfigError;
use crate::drawing::DrawingError;
use crate::ink::InkError;
use crate::picture::PictureError;

/// Why an artwork can't be drawn. Each says in one line what is wrong and what would be right.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ArtworkError {
    /// The strokes can't be read or made.
    #[error(transparent)]
    Drawing(#[from] DrawingError),
    /// A picture makes no strokes.
    #[error("{}: {source}", picture.display())]
    Art {
        /// The picture.
        picture: PathBuf,
        /// Why not.
        source: ArtError,
    },
    /// Segments or depth can't be used.
    #[error(transparent)]
    Semantics(#[from] SemanticsError),
    /// A model is asked for, but the program can't run one.
    #[error("{}: this program was built without ONNX models: build it with `--features onnx`, or give images", model.display())]
    NoModels {
        /// The model.
        model: PathBuf,
    },
    /// A pen can't be used.
    #[error(transparent)]
    Pen(#[from] ConfigError),
    /// A picture can't be read or written.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The preview can't be made.
    #[error(transparent)]
    Ink(#[from] InkError),
}
