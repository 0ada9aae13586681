//! What `image` doesn't tell of a PNG: its chunks on colour, and how it ends.
use std::io::Cursor;

use png::{Decoder, DecodingError};

use super::profile::Space;
use super::{Fault, Format, check_size};

/// CIE xy of sRGB's white, red, green and blue.
const SRGB: [[f32; 2]; 4] = [[0.3127, 0.329], [0.64, 0.33], [0.3, 0.6], [0.15, 0.06]];

impl From<DecodingError> for Fault {
    fn from(error: DecodingError) -> Self {
        match error {
            DecodingError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => Fault::cut(Format::Png),
            e => Fault::damaged(Format::Png, e),
        }
    }
}

/// What the samples mean: cICP before iCCP before sRGB before cHRM and gAMA, as the PNG standard (third edition, 4.3) ranks them.
pub(super) fn space(bytes: &[u8], notes: &mut Vec<String>) -> Result<Space, Fault> {
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_ignore_text_chunk(true);
    let (width, height) = decoder.read_header_info()?.size();
    check_size(width as usize, height as usize)?;
    let reader = decoder.read_info()?;
    let info = reader.info();
    if let Some(points) = info.coding_independent_code_points {
        match Space::of_code_points(points.color_primaries, points.transfer_function) {
            Some(space) => return Ok(space),
            None => notes.push("the colours that its cICP chunk names aren't known here: passed over".into()),
        }
    }
    if info.icc_profile.is_some() {
        return Ok(Space::of_icc(info.icc_profile.as_deref(), notes));
    }
    if info.srgb.is_some() {
        return Ok(Space::Srgb);
    }
    let gamma = info.gama_chunk.map(|g| f64::from(g.into_value())).filter(|g| (0.05..20.0).contains(g));
    let xy = info.chrm_chunk.map(|c| [c.white, c.red, c.green, c.blue].map(|(x, y)| [x.into_value(), y.into_value()]));
    let grey = matches!(info.color_type, png::ColorType::Grayscale | png::ColorType::GrayscaleAlpha);
    if let Some(xy) = xy.filter(|xy| !grey && differ(xy) && span(xy)) {
        return Ok(Space::of_primaries(xy, gamma.map(|g| 1.0 / g)));
    }
    // 1 / 2.2 has always meant sRGB.
    let power = gamma.filter(|g| (g - 0.45455).abs() > 0.005).map(|g| 1.0 / g);
    Ok(power.map_or(Space::Srgb, Space::Power))
}

/// Whether primaries are others than sRGB's.
fn differ(xy: &[[f32; 2]; 4]) -> bool {
    xy.iter().flatten().zip(SRGB.iter().flatten()).any(|(a, b)| (a - b).abs() > 0.002)
}

/// Whether primaries span colours with the white among them; others are a mistake in the file.
fn span(xy: &[[f32; 2]; 4]) -> bool {
    let [white, red, green, blue] = *xy;
    let turn = |a: [f32; 2], b: [f32; 2], c: [f32; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    xy.iter().all(|[_, y]| *y > 1e-4)
        && [turn(red, green, white), turn(green, blue, white), turn(blue, red, white)].iter().all(|t| *t > 1e-4)
}

/// The chunk that ends every PNG.
const END: &[u8] = b"\0\0\0\0IEND\xae\x42\x60\x82";

/// Puts the end chunk there where it, or a part of it, is all that is missing; `true` if so.
pub(super) fn mend(bytes: &mut Vec<u8>) -> bool {
    let mut at = 8;
    while let Some(head) = bytes.get(at..at + 8) {
        if &head[4..] == b"IEND" {
            break;
        }
        at = at.saturating_add(u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize + 12);
    }
    let cut = bytes.get(at..).is_some_and(|rest| rest.len() < END.len() && END.starts_with(rest));
    if cut {
        bytes.truncate(at);
        bytes.extend(END);
    }
    cut
}
