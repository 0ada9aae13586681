//! Pixels into PNG files.
use std::fs::File;
use std::io::{BufWriter, Error, Result};
use std::path::Path;

use png::{BitDepth, ColorType, Compression, Encoder, Filter};

use crate::field::V3;
use crate::march::Picture;

/// sRGB value 0..1 of a linear one, with a shoulder that keeps highlights from clipping.
pub fn developed(linear: f64) -> f64 {
    let x = linear.max(0.0);
    let x = if x < 0.6 { x } else { 0.6 + 0.4 * (1.0 - (-(x - 0.6) / 0.4).exp()) };
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// 8 bits in steps of `step`, so that smooth tones pack well.
fn level(value: f64, step: f64) -> u8 {
    ((value * 255.0 / step).round() * step).clamp(0.0, 255.0) as u8
}

pub fn write(path: &Path, width: usize, height: usize, colour: ColorType, depth: BitDepth, data: &[u8]) -> Result<()> {
    let mut encoder = Encoder::new(BufWriter::new(File::create(path)?), width as u32, height as u32);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.set_compression(Compression::High);
    encoder.set_filter(Filter::Adaptive);
    let mut writer = encoder.write_header().map_err(Error::other)?;
    writer.write_image_data(data).map_err(Error::other)?;
    writer.finish().map_err(Error::other)
}

/// Colour picture, 8 bits, sRGB.
pub fn colour(path: &Path, picture: &Picture, step: f64) -> Result<()> {
    let bytes: Vec<u8> =
        picture.colour.iter().flat_map(|c| [c.x, c.y, c.z].map(|c| level(developed(c), step))).collect();
    write(path, picture.width, picture.height, ColorType::Rgb, BitDepth::Eight, &bytes)
}

/// Grey picture, 8 bits, of the luminance.
pub fn grey(path: &Path, picture: &Picture, step: f64) -> Result<()> {
    let weights = V3::new(0.2126, 0.7152, 0.0722);
    let bytes: Vec<u8> = picture.colour.iter().map(|c| level(developed(c.dot(&weights)), step)).collect();
    write(path, picture.width, picture.height, ColorType::Grayscale, BitDepth::Eight, &bytes)
}

/// 16-bit grey values 0..1.
pub fn grey16(path: &Path, width: usize, height: usize, values: impl Iterator<Item = f64>) -> Result<()> {
    let bytes: Vec<u8> = values.flat_map(|v| ((v.clamp(0.0, 1.0) * 65535.0).round() as u16).to_be_bytes()).collect();
    write(path, width, height, ColorType::Grayscale, BitDepth::Sixteen, &bytes)
}

/// 16-bit depth: white is nearest, black is the backdrop, between them the inverse of the distance, as the networks
/// that estimate depth from one picture give it.
pub fn depth(path: &Path, picture: &Picture) -> Result<()> {
    let inverse: Vec<f64> = picture.depth.iter().map(|d| 1.0 / d).collect();
    let nearest = inverse.iter().copied().fold(1e-12, f64::max);
    grey16(path, picture.width, picture.height, inverse.iter().map(|i| i / nearest))
}

/// 8-bit grey labels: the value of a pixel is the number of its segment.
pub fn labels(path: &Path, picture: &Picture) -> Result<()> {
    write(path, picture.width, picture.height, ColorType::Grayscale, BitDepth::Eight, &picture.label)
}
