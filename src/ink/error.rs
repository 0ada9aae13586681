//! What can go wrong between trace and picture.
use std::path::PathBuf;

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
    /// Pixels that don't fill the picture.
    #[error("a picture of {width} x {height} px needs {} bytes, but got {bytes}", 3 * u64::from(*width) * u64::from(*height))]
    Pixels {
        /// Width, px.
        width: u32,
        /// Height, px.
        height: u32,
        /// Bytes given.
        bytes: usize,
    },
    /// A file that can't be written or read.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A PNG that can't be encoded.
    #[error("can't encode a PNG: {0}")]
    Encode(#[from] png::EncodingError),
    /// A PNG that can't be decoded.
    #[error("can't decode a PNG: {0}")]
    Decode(#[from] png::DecodingError),
    /// A PNG too large to read.
    #[error("a PNG of {width} x {height} px is too large: each side may have up to {max_px} px")]
    TooLarge {
        /// Width, px.
        width: u32,
        /// Height, px.
        height: u32,
        /// Largest side, px.
        max_px: u32,
    },
    /// A PNG of a kind that Calamus doesn't write.
    #[error("a PNG of {color:?} in {depth:?} bits, but only 8-bit RGB is read here")]
    Format {
        /// Its colour type.
        color: png::ColorType,
        /// Its depth.
        depth: png::BitDepth,
    },
}
