//! JPEG files.
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::{Fault, MAX_BYTES, check_size, orientation};

/// A decoded JPEG: rows of one (grey) or three (sRGB) bytes a pixel, as stored.
pub(super) struct Jpeg {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) grey: bool,
    pub(super) bytes: Vec<u8>,
    /// Exif orientation, 1..=8.
    pub(super) orientation: u8,
}

/// What the decoder doesn't tell of a file.
#[derive(Default)]
struct Outline {
    components: u8,
    /// Where the `A` of Adobe's segment stands.
    adobe: Option<usize>,
    /// All coefficients have to be held until the last scan.
    held: bool,
    /// The end marker is there.
    ended: bool,
    /// Of a kind that the decoder doesn't know: which.
    foreign: Option<&'static str>,
}

/// Walks the segments up to the first scan, then looks for the end.
fn outline(bytes: &[u8]) -> Option<Outline> {
    let mut found = Outline::default();
    let mut at = 2;
    loop {
        at += bytes.get(at..)?.iter().position(|b| *b == 0xff)?;
        at += bytes.get(at..)?.iter().position(|b| *b != 0xff)?;
        let marker = bytes[at];
        at += 1;
        if marker == 0 || marker == 1 || (0xd0..=0xd9).contains(&marker) {
            continue;
        }
        let length = usize::from(u16::from_be_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]));
        let body = bytes.get(at + 2..at + length.max(2))?;
        if let Some(kind) = foreign(marker, body) {
            return Some(Outline { foreign: Some(kind), ..found });
        }
        match marker {
            0xc0..=0xc2 => {
                found.components = *body.get(5)?;
                found.held |= marker == 0xc2;
            }
            0xee if body.starts_with(b"Adobe") => found.adobe = Some(at + 2),
            0xda => {
                found.held |= *body.first()? < found.components;
                // Entropy-coded data stuffs a zero after each 0xff, so that this pair is a marker.
                found.ended = bytes[at + length..].windows(2).any(|w| w == [0xff, 0xd9]);
                return Some(found);
            }
            _ => {}
        }
        at += length.max(2);
    }
}

/// The kind of a JPEG that the decoder doesn't know, by a frame's marker (ITU-T T.81, table B.1) and body.
fn foreign(marker: u8, body: &[u8]) -> Option<&'static str> {
    match marker {
        0xc9..=0xcf => Some("arithmetic coding"),
        0xc3 => Some("lossless coding"),
        0xc5..=0xc7 => Some("hierarchical coding"),
        0xc0..=0xc2 if body.first().is_some_and(|bits| *bits != 8) => Some("more than 8 bits a colour"),
        _ => None,
    }
}

/// Decodes a JPEG: grey, YCbCr, RGB, CMYK or YCCK.
///
/// Adobe stores CMYK inverted and says so by its segment; without it 255 is full ink (as in ITU-T T.872). Ink becomes
/// sRGB by `(1 - ink)(1 - black)`, as browsers do without the press's profile.
pub(super) fn decode(mut bytes: Vec<u8>) -> Result<Jpeg, Fault> {
    let outline = outline(&bytes).ok_or_else(|| Fault::damaged("JPEG", "it ends before its first scan"))?;
    if let Some(kind) = outline.foreign {
        return Err(Fault::Foreign { kind });
    }
    if !outline.ended {
        return Err(Fault::damaged("JPEG", "its end is missing"));
    }
    if let (1, Some(at)) = (outline.components, outline.adobe) {
        // Adobe's segment says CMYK of grey pictures too, which the decoder would believe.
        bytes[at] = b'a';
    }
    let damaged = |e: zune_jpeg::errors::DecodeErrors| Fault::damaged("JPEG", e);
    let options = DecoderOptions::default().set_strict_mode(true).set_max_width(usize::MAX).set_max_height(usize::MAX);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes.as_slice()), options);
    decoder.decode_headers().map_err(damaged)?;
    let (width, height) = decoder.dimensions().unwrap_or_default();
    check_size(width, height)?;
    let space = decoder.input_colorspace().unwrap_or(ColorSpace::Unknown);
    let (out, components) = match space {
        ColorSpace::Luma => (ColorSpace::Luma, 1),
        ColorSpace::CMYK | ColorSpace::YCCK => (space, 4),
        _ => (ColorSpace::RGB, 3),
    };
    let held = if outline.held { 2 } else { 0 };
    if (width * height) as u64 * components as u64 * (1 + held) > MAX_BYTES {
        return Err(Fault::Heavy { width, height });
    }
    decoder.set_options(options.jpeg_set_out_colorspace(out));
    let mut pixels = vec![0; width * height * components];
    decoder.decode_into(&mut pixels).map_err(damaged)?;
    let orientation = decoder.exif().map_or(1, |exif| orientation::of_exif(exif));
    if components == 4 {
        pixels = rgb_from_cmyk(pixels, space == ColorSpace::YCCK, outline.adobe.is_some());
    }
    Ok(Jpeg { width, height, grey: components == 1, bytes: pixels, orientation })
}

/// Three bytes a pixel from four.
fn rgb_from_cmyk(mut pixels: Vec<u8>, ycck: bool, inverted: bool) -> Vec<u8> {
    let count = pixels.len() / 4;
    for i in 0..count {
        let p = &pixels[4 * i..4 * i + 4];
        let mut inks = [p[0], p[1], p[2]];
        if ycck {
            // ITU-T T.871, and then the complement
            let [y, cb, cr] = inks.map(f32::from);
            let rgb = [
                y + 1.402 * (cr - 128.0),
                y - 0.344_136 * (cb - 128.0) - 0.714_136 * (cr - 128.0),
                y + 1.772 * (cb - 128.0),
            ];
            inks = rgb.map(|v| 255 - v.round().clamp(0.0, 255.0) as u8);
        }
        let bare = |v: u8| u32::from(if inverted { v } else { 255 - v });
        let black = bare(p[3]);
        let rgb = inks.map(|v| ((bare(v) * black + 127) / 255) as u8);
        pixels[3 * i..3 * i + 3].copy_from_slice(&rgb);
    }
    pixels.truncate(3 * count);
    pixels
}
