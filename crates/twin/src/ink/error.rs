//! What can go wrong between trace and picture.
use crate::picture::PictureError;

/// A picture that can't be made, written or read.
#[derive(Debug, thiserror::Error)]
pub enum InkError {
    /// The sheet at this resolution makes no picture, or one too large.
    #[error(
        "a sheet of {width_mm} mm x {height_mm} mm at {px_per_mm} px/mm makes no picture: each side must have 1 to {max_px} px"
    )]
    Size {
        /// Width of the sheet, mm.
        width_mm: f64,
        /// Height of the sheet, mm.
        height_mm: f64,
        /// Resolution, px/mm.
        px_per_mm: f64,
        /// Largest side, px.
        max_px: u32,
    },
    /// A stroke names an ink that the trace doesn't have.
    #[error("stroke {stroke} of the trace is drawn in ink {ink}, but the trace has {inks} inks")]
    UnknownInk {
        /// Index of the stroke.
        stroke: usize,
        /// Index of the ink.
        ink: u32,
        /// Inks in the trace.
        inks: usize,
    },
    /// A point of a stroke is not a number, or its width or density is negative.
    #[error("point {point} of stroke {stroke} of the trace has no finite place, or a negative width or density")]
    BadPoint {
        /// Index of the stroke.
        stroke: usize,
        /// Index of the point.
        point: usize,
    },
    /// The pixels make no picture.
    #[error(transparent)]
    Picture(#[from] PictureError),
}
