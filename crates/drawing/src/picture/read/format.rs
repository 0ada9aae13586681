//! What kind of file it is, by its first bytes.
use image::ImageFormat;

use super::Fault;

/// The formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Png,
    Jpeg,
    WebP,
    Tiff,
    Gif,
    Bmp,
    Qoi,
    Hdr,
}

impl Format {
    /// Tells the format by the first bytes, whatever the file is called.
    pub(super) fn of(bytes: &[u8]) -> Result<Self, Fault> {
        match image::guess_format(bytes) {
            Ok(ImageFormat::Png) => Ok(Self::Png),
            Ok(ImageFormat::Jpeg) => Ok(Self::Jpeg),
            Ok(ImageFormat::WebP) => Ok(Self::WebP),
            Ok(ImageFormat::Tiff) => Ok(Self::Tiff),
            Ok(ImageFormat::Gif) => Ok(Self::Gif),
            Ok(ImageFormat::Bmp) => Ok(Self::Bmp),
            Ok(ImageFormat::Qoi) => Ok(Self::Qoi),
            Ok(ImageFormat::Hdr) => Ok(Self::Hdr),
            Ok(other) => Err(Fault::NoPicture(format!("it is {}", article(other)))),
            Err(_) => Err(Fault::NoPicture(stranger(bytes).into())),
        }
    }

    /// What people call it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::WebP => "WebP",
            Self::Tiff => "TIFF",
            Self::Gif => "GIF",
            Self::Bmp => "BMP",
            Self::Qoi => "QOI",
            Self::Hdr => "Radiance HDR",
        }
    }

    /// How many times its decoder holds the pixels.
    pub(super) fn copies(self) -> u64 {
        match self {
            Self::Tiff | Self::WebP => 2,
            _ => 1,
        }
    }

    /// How its usual kind is called, which is read.
    pub(super) fn usual(self) -> &'static str {
        match self {
            Self::Jpeg => "as a usual one (baseline or progressive, Huffman coding)",
            Self::Tiff => "in grey, RGB or CMYK of 8 or 16 bits, or as a PNG",
            _ => "as a PNG",
        }
    }
}

fn article(format: ImageFormat) -> String {
    let name = format.extensions_str().first().copied().unwrap_or("picture").to_uppercase();
    let an = name.starts_with(['A', 'E', 'F', 'H', 'I', 'O']);
    format!("{} {name}", if an { "an" } else { "a" })
}

/// What a file seems to be that isn't read at all.
fn stranger(bytes: &[u8]) -> &'static str {
    let inner = bytes.get(4..).unwrap_or_default();
    match bytes {
        [] => "the file is empty",
        [b'%', b'P', b'D', b'F', ..] => "it is a PDF",
        [b'<', ..] => "it is XML, perhaps an SVG, which is drawn as it is",
        [b'8', b'B', b'P', b'S', ..] => "it is a Photoshop document",
        [0xff, 0x0a, ..] => "it is a JPEG XL",
        _ if inner.starts_with(b"JXL ") => "it is a JPEG XL",
        _ if inner.starts_with(b"jP  ") => "it is a JPEG 2000",
        _ if inner.starts_with(b"ftypavif") => "it is an AVIF",
        _ if inner.starts_with(b"ftyp") => "it is a HEIC or another of its family",
        _ => "by its first bytes it is none of these",
    }
}
