//! What can go wrong between a file and pixels.
use std::path::PathBuf;

/// A picture that can't be read, made or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
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
