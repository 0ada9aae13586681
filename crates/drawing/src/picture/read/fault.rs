//! What is wrong with a file that has no name yet.
use std::path::Path;

use image::error::UnsupportedErrorKind;
use image::{ExtendedColorType, ImageError};

use super::{Format, MAX_PIXELS};
use crate::picture::PictureError;

/// A [`PictureError`] without its file.
#[derive(Debug)]
pub(super) enum Fault {
    Io(std::io::Error),
    NoPicture(String),
    Damaged { format: Format, reason: String },
    Foreign { format: Format, kind: String },
    Huge { width: usize, height: usize },
    Heavy { width: usize, height: usize },
    NotGrey,
    NotLabels { found: String },
}

impl Fault {
    pub(super) fn damaged(format: Format, reason: impl std::fmt::Display) -> Self {
        Self::Damaged { format, reason: sentence(&reason.to_string()) }
    }

    pub(super) fn foreign(format: Format, kind: impl std::fmt::Display) -> Self {
        Self::Foreign { format, kind: sentence(&kind.to_string()) }
    }

    pub(super) fn cut(format: Format) -> Self {
        Self::damaged(format, "its end is missing")
    }

    /// What `image` says of a file of this format and size.
    pub(super) fn of_image(error: ImageError, format: Format, (width, height): (usize, usize)) -> Self {
        match error {
            // The file is in memory: what can't be read is not there.
            ImageError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => Self::cut(format),
            ImageError::Limits(_) => Self::Heavy { width, height },
            ImageError::Unsupported(e) => Self::foreign(format, unknown(&e.kind())),
            ImageError::Decoding(e) => Self::damaged(format, inner(&e)),
            e => Self::damaged(format, e),
        }
    }

    pub(super) fn of(self, file: &Path) -> PictureError {
        let file = file.to_path_buf();
        match self {
            Self::Io(source) => PictureError::Io { file, source },
            Self::NoPicture(found) => PictureError::NoPicture { file, found },
            Self::Damaged { format, reason } => PictureError::Damaged { file, format: format.name(), reason },
            Self::Foreign { format, kind } => {
                PictureError::Foreign { file, format: format.name(), kind, instead: format.usual() }
            }
            Self::Huge { width, height } => PictureError::Huge { file, width, height, max: MAX_PIXELS / 1_000_000 },
            Self::Heavy { width, height } => PictureError::Heavy { file, width, height },
            Self::NotGrey => PictureError::NotGrey { file },
            Self::NotLabels { found } => PictureError::NotLabels { file, found },
        }
    }
}

impl From<std::io::Error> for Fault {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

/// The decoder's own words, where there are any: `image` puts a sentence about the format before them.
fn inner(error: &(dyn std::error::Error + 'static)) -> String {
    error.source().unwrap_or(error).to_string()
}

/// What a decoder doesn't know, without `image`'s sentence round it.
fn unknown(kind: &UnsupportedErrorKind) -> String {
    match kind {
        UnsupportedErrorKind::Color(ExtendedColorType::Unknown(bits)) => format!("pixels of {bits} bits"),
        UnsupportedErrorKind::Color(color) => format!("pixels of kind {color:?}"),
        UnsupportedErrorKind::GenericFeature(feature) => format!("unusual data (\"{feature}\")"),
        _ => "an unknown kind of data".into(),
    }
}

/// One line without what could upset a terminal: decoders quote what stands in the file.
pub(super) fn sentence(text: &str) -> String {
    let line = text.lines().next().unwrap_or_default();
    line.chars().map(|c| if c.is_control() { '?' } else { c }).take(160).collect()
}
