//! The numbers that stand in a PNG, which `image` would turn into colours.
use std::io::Cursor;

use png::{ColorType, Decoder, Transformations};

use super::{Fault, Format, Labels, check_size};

/// Reads grey values or palette indices, as they are stored.
pub(super) fn labels(bytes: &[u8]) -> Result<Labels, Fault> {
    let format = Format::of(bytes)?;
    if format != Format::Png {
        let why = if format == Format::Jpeg { ", whose values aren't exact" } else { "" };
        return Err(Fault::NotLabels { found: format!("a {}{why}", format.name()) });
    }
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_ignore_text_chunk(true);
    decoder.set_transformations(Transformations::IDENTITY);
    let (width, height) = decoder.read_header_info()?.size();
    let (width, height) = (width as usize, height as usize);
    check_size(width, height)?;
    let mut reader = decoder.read_info()?;
    let (color, depth) = reader.output_color_type();
    if !matches!(color, ColorType::Grayscale | ColorType::Indexed) {
        return Err(Fault::NotLabels { found: format!("{color:?} colour") });
    }
    // At most two bytes a pixel, and so within any limit on memory.
    let size = reader.output_buffer_size().ok_or(Fault::Heavy { width, height })?;
    let mut pixels = vec![0; size];
    reader.next_frame(&mut pixels)?;
    let rows = pixels.chunks_exact((size / height).max(1));
    let ids = rows.flat_map(|row| (0..width).map(move |i| sample(row, i, depth as u8))).collect();
    Ok(Labels { width, height, ids })
}

/// The sample `i` of a row of samples of `bits` bits.
fn sample(row: &[u8], i: usize, bits: u8) -> u16 {
    match bits {
        16 => u16::from_be_bytes([row[2 * i], row[2 * i + 1]]),
        8 => u16::from(row[i]),
        _ => {
            let first = i * usize::from(bits);
            let shift = 8 - usize::from(bits) - first % 8;
            u16::from(row[first / 8] >> shift) & ((1 << bits) - 1)
        }
    }
}
