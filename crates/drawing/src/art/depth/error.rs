//! What can be wrong with segments and depth.
use std::path::PathBuf;

/// Segments, a depth map or a model that can't be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SemanticsError {
    /// A file that can't be read.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A table of segments with a mistake in it.
    #[error("{}:{line}: {message}", file.display())]
    Table {
        /// The file.
        file: PathBuf,
        /// 1-based line.
        line: usize,
        /// What is wrong and what would be right.
        message: String,
    },
    /// Maps whose shapes differ.
    #[error(
        "the {what} is {width} x {height} px, but the picture {picture_width} x {picture_height} px: the sides must be in the same proportion, within 1 %"
    )]
    Shape {
        /// Which map.
        what: &'static str,
        /// Its width, px.
        width: usize,
        /// Its height, px.
        height: usize,
        /// Width of the picture, px.
        picture_width: usize,
        /// Height of the picture, px.
        picture_height: usize,
    },
    /// A map without pixels, or one that isn't filled.
    #[error("the {what} of {width} x {height} px has {values} values")]
    Size {
        /// Which map.
        what: &'static str,
        /// Its width, px.
        width: usize,
        /// Its height, px.
        height: usize,
        /// Values given.
        values: usize,
    },
    /// A label image with more labels than there can be segments.
    #[error(
        "{labels} different labels, but there can be at most {max} segments: is it a label image, one grey value a segment?"
    )]
    TooManyLabels {
        /// Labels found.
        labels: usize,
        /// How many there may be.
        max: usize,
    },
    /// A label that names no segment.
    #[error("label {label} names no segment: there are {segments}")]
    UnknownSegment {
        /// The label.
        label: u16,
        /// Number of segments.
        segments: usize,
    },
    /// Depths that aren't numbers in 0..=1.
    #[error("depth {value} at pixel {pixel}: depths run from 0 (far) to 1 (near)")]
    Depth {
        /// The value.
        value: f32,
        /// Index of the pixel, row by row.
        pixel: usize,
    },
    /// A model that can't be loaded or run, or gives something else.
    #[error("{}: {message}", file.display())]
    Model {
        /// The model's file.
        file: PathBuf,
        /// What is wrong and what would be right.
        message: String,
    },
}
