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
    /// A file that is no picture that can be read.
    #[error("{}: {found}: a picture has to be a PNG, JPEG, WebP, TIFF, GIF, BMP, QOI or HDR: convert it first", file.display())]
    NoPicture {
        /// The file.
        file: PathBuf,
        /// What it seems to be.
        found: String,
    },
    /// A file that is broken or cut short.
    #[error("{}: the {format} is damaged or cut short ({reason}): copy or export it again", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// Its format.
        format: &'static str,
        /// What the decoder found.
        reason: String,
    },
    /// A whole file of a kind that isn't read.
    #[error("{}: a {format} with {kind} isn't read: save it {instead}", file.display())]
    Foreign {
        /// The file.
        file: PathBuf,
        /// Its format.
        format: &'static str,
        /// What is unusual in it.
        kind: String,
        /// How it would be read.
        instead: &'static str,
    },
    /// A picture with too many pixels.
    #[error("{}: {width} x {height} px are too many: scale it to {max} megapixels or fewer", file.display())]
    Huge {
        /// The file.
        file: PathBuf,
        /// Width, px.
        width: usize,
        /// Height, px.
        height: usize,
        /// Most pixels, millions.
        max: usize,
    },
    /// A picture that has to be decoded whole and then doesn't fit.
    #[error(
        "{}: {width} x {height} px take more than 3 GiB to decode: scale it down, and save it neither progressive nor \
         with 16 bits",
        file.display()
    )]
    Heavy {
        /// The file.
        file: PathBuf,
        /// Width, px.
        width: usize,
        /// Height, px.
        height: usize,
    },
    /// A depth image in colours.
    #[error("{}: a depth image has to be grey, 8 or 16 bits, but this one is in colours", file.display())]
    NotGrey {
        /// The file.
        file: PathBuf,
    },
    /// A label image whose values aren't labels.
    #[error("{}: labels have to be a PNG in grey or with a palette, but this is {found}", file.display())]
    NotLabels {
        /// The file.
        file: PathBuf,
        /// What it is.
        found: String,
    },
}
