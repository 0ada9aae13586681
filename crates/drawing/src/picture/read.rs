//! Image files, as pictures, as depth and as labels.
//!
//! The `image` crate decodes PNG, WebP, TIFF, GIF, BMP, QOI and Radiance HDR. What it hides is asked of the decoders that it
//! uses itself: strictness and inks of JPEGs, palette indices and colour chunks of PNGs, inks and pages of TIFFs. Colours go
//! through the file's profile to sRGB. What is larger than wanted is averaged down row by row, in linear light.
use std::path::Path;

use crate::files;
use crate::picture::{Picture, PictureError, Plane};

mod decode;
mod fault;
mod format;
mod indices;
mod jpeg;
mod orientation;
mod outline;
mod png_head;
mod profile;
mod raster;
mod shrink;
mod tiff;

use fault::Fault;
use format::Format;
use profile::Light;
use shrink::Shrink;

/// Most pixels of a file that is read.
const MAX_PIXELS: usize = 400_000_000;

/// Most bytes that the pixels of one file may take.
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

/// What a file holds, and what its reader should tell of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Noted<T> {
    /// What it holds.
    pub content: T,
    /// What else a user should know: other frames, a profile that isn't used, an end that is missing.
    pub notes: Vec<String>,
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

/// Reads a picture: PNG, JPEG, WebP, TIFF, GIF, BMP, QOI or Radiance HDR, told by its content; turned upright as its Exif data
/// say, in the colours that its profile means, and what is transparent lies on white.
///
/// # Errors
/// [`PictureError::Io`]; [`PictureError::NoPicture`] when it is something else; [`PictureError::Damaged`] when it is broken or
/// cut short: there is never half a picture; [`PictureError::Foreign`] for a kind that isn't read; [`PictureError::Huge`]
/// above 400 megapixels and [`PictureError::Heavy`] above 3 GiB, both before the memory is asked for.
pub fn read(file: &Path, options: &ReadOptions) -> Result<Noted<Picture>, PictureError> {
    open(file).and_then(|bytes| picture(bytes, options)).map_err(|fault| fault.of(file))
}

/// Reads a depth image, 0..=1: grey of 8 or 16 bits (or colour whose channels agree), white 1, without any gamma or profile.
///
/// # Errors
/// Those of [`read`], and [`PictureError::NotGrey`].
pub fn read_depth(file: &Path) -> Result<Noted<Plane>, PictureError> {
    open(file).and_then(depth).map_err(|fault| fault.of(file))
}

/// Reads labels: the grey values (1 to 16 bits) or palette indices of a PNG, as they are stored.
///
/// # Errors
/// Those of [`read`], and [`PictureError::NotLabels`] for a PNG in full colour and for other formats.
pub fn read_labels(file: &Path) -> Result<Labels, PictureError> {
    open(file).and_then(|bytes| indices::labels(&bytes)).map_err(|fault| fault.of(file))
}

/// Whether a file is a picture that [`read`] knows, by its first bytes.
pub fn is_picture(file: &Path) -> bool {
    files::read(file).is_ok_and(|bytes| Format::of(&bytes).is_ok())
}

fn open(file: &Path) -> Result<Vec<u8>, Fault> {
    Ok(files::read(file)?)
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

fn picture(bytes: Vec<u8>, options: &ReadOptions) -> Result<Noted<Picture>, Fault> {
    let (mut light, raster) = Light::of(decode::decode(bytes)?);
    let mut shrink = Shrink::new(raster.width, raster.height, options.max_pixels);
    let mut line = vec![[0.0; 3]; raster.width];
    for row in raster.rows() {
        light.row(&raster, row, &mut line);
        shrink.push(&line);
    }
    let (width, height, pixels) = shrink.finish();
    let (width, height, pixels) = orientation::upright(raster.orientation, width, height, pixels);
    let picture = Picture::from_pixels(width, height, pixels);
    // A decoder that returns has filled its rows.
    let content = picture.ok_or_else(|| Fault::NoPicture("rows are missing".into()))?;
    Ok(Noted { content, notes: raster.notes })
}

fn depth(bytes: Vec<u8>) -> Result<Noted<Plane>, Fault> {
    let raster = decode::decode(bytes)?.without_inks();
    let mut shrink = Shrink::new(raster.width, raster.height, ReadOptions::default().max_pixels);
    let (samples, colors) = (raster.samples(), raster.model.samples());
    let mut line = vec![0.0; raster.width];
    for row in raster.rows() {
        for (x, value) in line.iter_mut().enumerate() {
            let at = |k: usize| raster.value(row, samples * x + k);
            if (1..colors).any(|k| at(k) != at(0)) {
                return Err(Fault::NotGrey);
            }
            *value = at(0).min(1.0);
        }
        shrink.push(&line);
    }
    let (width, height, values) = shrink.finish();
    let (width, height, values) = orientation::upright(raster.orientation, width, height, values);
    let plane = Plane::from_values(width, height, values);
    let content = plane.ok_or_else(|| Fault::NoPicture("rows are missing".into()))?;
    Ok(Noted { content, notes: raster.notes })
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod format_tests;
