//! Image files: PNG and JPEG, as pictures, as depth and as labels.
//!
//! A picture is averaged down to a limit while it is decoded, so that a photograph of hundreds of megapixels costs little
//! memory. Colours are taken as sRGB (or by a PNG's gamma); ICC profiles are not applied. The `png` and `zune-jpeg` crates are
//! used rather than `image`, which hides rows, raw palette indices and CMYK, and shows half a JPEG as if it were whole.
use std::io::{BufRead, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use png::ColorType;

use crate::files;
use crate::math::linear_from_srgb;
use crate::picture::{Picture, PictureError, Plane};

mod jpeg;
mod orientation;
mod png_rows;
mod shrink;

use png_rows::{PngRows, sample};
use shrink::Shrink;

/// Most pixels of a file that is read.
const MAX_PIXELS: usize = 400_000_000;

/// Most bytes that decoding one file may hold at once, where it can't be done row by row.
const MAX_BYTES: u64 = 3 << 30;

/// How a picture is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadOptions {
    /// Most pixels that are kept: a larger picture is averaged down, in linear light and in its own proportions.
    pub max_pixels: usize,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { max_pixels: 12_000_000 }
    }
}

/// A number for each pixel, such as the segment it belongs to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Labels {
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// `width * height` labels, row by row from the top.
    pub ids: Vec<u16>,
}

/// Reads a picture: PNG of any kind, or JPEG in grey, RGB, YCbCr, CMYK or YCCK; turned upright as its Exif data say, and what
/// is transparent lies on white.
///
/// # Errors
/// [`PictureError::Io`]; [`PictureError::NoPicture`] when it is something else; [`PictureError::Damaged`] when it is broken or
/// cut short: there is never half a picture; [`PictureError::Foreign`] for a kind of JPEG that isn't read; [`PictureError::Huge`] above 400 megapixels.
pub fn read(file: &Path, options: &ReadOptions) -> Result<Picture, PictureError> {
    open(file).and_then(|source| picture(source, options)).map_err(|fault| fault.of(file))
}

/// Reads a depth image, 0..=1: grey of 8 or 16 bits (or colour whose channels agree), white 1, without any gamma.
///
/// # Errors
/// Those of [`read`], and [`PictureError::NotGrey`].
pub fn read_depth(file: &Path) -> Result<Plane, PictureError> {
    open(file).and_then(depth).map_err(|fault| fault.of(file))
}

/// Reads labels: the grey values (1 to 16 bits) or palette indices of a PNG, as they are stored.
///
/// # Errors
/// Those of [`read`], and [`PictureError::NotLabels`] for a PNG in full colour and for a JPEG, whose values aren't exact.
pub fn read_labels(file: &Path) -> Result<Labels, PictureError> {
    open(file).and_then(labels).map_err(|fault| fault.of(file))
}

/// What is wrong with a file that has no name yet.
#[derive(Debug)]
enum Fault {
    Io(std::io::Error),
    NoPicture(String),
    Damaged { format: &'static str, reason: String },
    Foreign { kind: &'static str },
    Huge { width: usize, height: usize },
    Heavy { width: usize, height: usize },
    NotGrey,
    NotLabels { found: String },
}

impl Fault {
    fn damaged(format: &'static str, reason: impl std::fmt::Display) -> Self {
        Self::Damaged { format, reason: reason.to_string() }
    }

    fn of(self, file: &Path) -> PictureError {
        let file = file.to_path_buf();
        match self {
            Self::Io(source) => PictureError::Io { file, source },
            Self::NoPicture(found) => PictureError::NoPicture { file, found },
            Self::Damaged { format, reason } => PictureError::Damaged { file, format, reason },
            Self::Foreign { kind } => PictureError::Foreign { file, kind },
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

fn open(file: &Path) -> Result<Cursor<Vec<u8>>, Fault> {
    Ok(Cursor::new(files::read(file)?))
}

fn check_size(width: usize, height: usize) -> Result<(), Fault> {
    if width == 0 || height == 0 {
        return Err(Fault::NoPicture("it has no pixels".into()));
    }
    if width as u64 * height as u64 > MAX_PIXELS as u64 {
        return Err(Fault::Huge { width, height });
    }
    Ok(())
}

/// The two formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Png,
    Jpeg,
}

/// Tells the format by the first bytes, and goes back to them.
fn format(source: &mut (impl BufRead + Seek)) -> Result<Format, Fault> {
    let mut head = Vec::new();
    source.take(16).read_to_end(&mut head)?;
    source.seek(SeekFrom::Start(0))?;
    if head.starts_with(b"\x89PNG\r\n\x1a\n") {
        return Ok(Format::Png);
    }
    if head.starts_with(b"\xff\xd8\xff") {
        return Ok(Format::Jpeg);
    }
    let inner = head.get(4..).unwrap_or_default();
    let found = match &head[..] {
        [] => "the file is empty",
        [b'G', b'I', b'F', b'8', ..] => "it is a GIF",
        [b'B', b'M', ..] => "it is a BMP",
        [b'I', b'I', 42, 0, ..] | [b'M', b'M', 0, 42, ..] => "it is a TIFF or a camera's raw file",
        [b'%', b'P', b'D', b'F', ..] => "it is a PDF",
        [b'<', ..] => "it is XML, perhaps an SVG, which is drawn as it is",
        [b'R', b'I', b'F', b'F', ..] => "it is a WebP",
        _ if inner.starts_with(b"ftypavif") => "it is an AVIF",
        _ if inner.starts_with(b"ftyp") => "it is a HEIC or another of its family",
        _ => "by its first bytes it is neither",
    };
    Err(Fault::NoPicture(found.into()))
}

/// A whole file in memory.
fn bytes(mut source: impl BufRead + Seek) -> Result<Vec<u8>, Fault> {
    let length = source.seek(SeekFrom::End(0))?;
    source.seek(SeekFrom::Start(0))?;
    if length > MAX_BYTES {
        return Err(Fault::NoPicture(format!("it has {length} bytes, too many for a JPEG")));
    }
    let mut bytes = Vec::new();
    source.read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn picture(mut source: impl BufRead + Seek, options: &ReadOptions) -> Result<Picture, Fault> {
    let (orientation, (width, height, pixels)) = match format(&mut source)? {
        Format::Png => {
            let rows = PngRows::open(source, true)?;
            let mut shrink = Shrink::new(rows.width, rows.height, options.max_pixels);
            let (light, color, bits, orientation) = (rows.light(), rows.color, rows.bits, rows.orientation);
            let mut line = vec![[0.0; 3]; rows.width];
            rows.for_each(|row| {
                colors(row, color, bits, &light, &mut line);
                shrink.push(&line);
            })?;
            (orientation, shrink.finish())
        }
        Format::Jpeg => {
            let jpeg = jpeg::decode(bytes(source)?)?;
            let mut shrink = Shrink::new(jpeg.width, jpeg.height, options.max_pixels);
            let light: Vec<f32> = (0..=255).map(|v| linear_from_srgb(v) as f32).collect();
            let mut line = vec![[0.0; 3]; jpeg.width];
            let color = if jpeg.grey { ColorType::Grayscale } else { ColorType::Rgb };
            for row in jpeg.bytes.chunks_exact(jpeg.bytes.len() / jpeg.height) {
                colors(row, color, 8, &light, &mut line);
                shrink.push(&line);
            }
            (jpeg.orientation, shrink.finish())
        }
    };
    let (width, height, pixels) = orientation::upright(orientation, width, height, pixels);
    Picture::from_pixels(width, height, pixels).ok_or_else(|| Fault::damaged("picture", "rows are missing"))
}

/// Linear light of a row of samples, over white where it is transparent.
fn colors(row: &[u8], color: ColorType, bits: u8, light: &[f32], line: &mut [[f32; 3]]) {
    let channels = color.samples();
    let opaque = if bits == 16 { 65_535.0 } else { 255.0 };
    for (i, pixel) in line.iter_mut().enumerate() {
        let at = |k: usize| light[usize::from(sample(row, channels * i + k, bits))];
        *pixel = if channels < 3 { [at(0); 3] } else { [at(0), at(1), at(2)] };
        if channels.is_multiple_of(2) {
            let alpha = f32::from(sample(row, channels * i + channels - 1, bits)) / opaque;
            *pixel = pixel.map(|v| v * alpha + (1.0 - alpha));
        }
    }
}

fn depth(mut source: impl BufRead + Seek) -> Result<Plane, Fault> {
    let max_pixels = ReadOptions::default().max_pixels;
    let mut grey = true;
    let mut fill = |row: &[u8], channels: usize, bits: u8, line: &mut [f32]| {
        let last = if bits == 16 { 65_535.0 } else { 255.0 };
        for (i, value) in line.iter_mut().enumerate() {
            let at = |k: usize| sample(row, channels * i + k, bits);
            grey &= channels < 3 || (at(0) == at(1) && at(1) == at(2));
            *value = f32::from(at(0)) / last;
        }
    };
    let (orientation, (width, height, values)) = match format(&mut source)? {
        Format::Png => {
            let rows = PngRows::open(source, true)?;
            let mut shrink = Shrink::new(rows.width, rows.height, max_pixels);
            let (channels, bits, orientation) = (rows.color.samples(), rows.bits, rows.orientation);
            let mut line = vec![0.0; rows.width];
            rows.for_each(|row| {
                fill(row, channels, bits, &mut line);
                shrink.push(&line);
            })?;
            (orientation, shrink.finish())
        }
        Format::Jpeg => {
            let jpeg = jpeg::decode(bytes(source)?)?;
            let mut shrink = Shrink::new(jpeg.width, jpeg.height, max_pixels);
            let mut line = vec![0.0; jpeg.width];
            for row in jpeg.bytes.chunks_exact(jpeg.bytes.len() / jpeg.height) {
                fill(row, if jpeg.grey { 1 } else { 3 }, 8, &mut line);
                shrink.push(&line);
            }
            (jpeg.orientation, shrink.finish())
        }
    };
    if !grey {
        return Err(Fault::NotGrey);
    }
    let (width, height, values) = orientation::upright(orientation, width, height, values);
    Plane::from_values(width, height, values).ok_or_else(|| Fault::damaged("picture", "rows are missing"))
}

fn labels(mut source: impl BufRead + Seek) -> Result<Labels, Fault> {
    if format(&mut source)? == Format::Jpeg {
        return Err(Fault::NotLabels { found: "a JPEG, whose values aren't exact".into() });
    }
    let rows = PngRows::open(source, false)?;
    if !matches!(rows.color, ColorType::Grayscale | ColorType::Indexed) {
        return Err(Fault::NotLabels { found: format!("{:?} colour", rows.color) });
    }
    let (width, height, bits) = (rows.width, rows.height, rows.bits);
    let mut ids = Vec::with_capacity(width * height);
    rows.for_each(|row| ids.extend((0..width).map(|i| sample(row, i, bits))))?;
    Ok(Labels { width, height, ids })
}

#[cfg(test)]
mod tests;
