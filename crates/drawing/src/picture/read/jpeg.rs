//! JPEG files, by the decoder that `image` uses too.
//!
//! `image` asks that decoder to be lenient, so that half a JPEG looks whole, and to turn four inks into RGB without their
//! profile. So it is asked here, strictly.
use image::metadata::Orientation;
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::outline::Outline;
use super::profile::Space;
use super::raster::{Depth, Model, Raster};
use super::{Fault, Format, MAX_BYTES, check_size};

/// What a file's data are followed by to see whether any are missing: their decoder reads it only then. No `ff` is in it.
const BAIT: [u8; 64] = [0x5a; 64];

/// Decodes a JPEG: grey, YCbCr, RGB, CMYK or YCCK.
pub(super) fn decode(mut bytes: Vec<u8>) -> Result<Raster, Fault> {
    let outline = Outline::of(&bytes).ok_or_else(|| Fault::damaged(Format::Jpeg, "it ends before its first scan"))?;
    if let Some(kind) = outline.foreign {
        return Err(Fault::foreign(Format::Jpeg, kind));
    }
    if let (1, Some(at)) = (outline.components, outline.adobe) {
        // Adobe's segment says CMYK of grey pictures too, which the decoder would believe.
        bytes[at] = b'a';
    }
    if outline.ended {
        return pixels(&bytes, &outline);
    }
    // Some cameras and uploads leave out the end marker alone. Then all scans are there, and it doesn't matter what follows them.
    let cut = || Fault::cut(Format::Jpeg);
    if !outline.all_scans() {
        return Err(cut());
    }
    let length = bytes.len();
    bytes.extend(BAIT);
    bytes.extend([0xff, 0xd9]);
    let baited = pixels(&bytes, &outline).map_err(|_| cut())?;
    bytes.truncate(length);
    bytes.extend([0xff, 0xd9]);
    let mut raster = pixels(&bytes, &outline).map_err(|_| cut())?;
    if raster.bytes != baited.bytes {
        return Err(cut());
    }
    raster.notes.push("its end marker is missing, but none of its pixels".into());
    Ok(raster)
}

/// Decodes a file with an end marker.
fn pixels(bytes: &[u8], outline: &Outline) -> Result<Raster, Fault> {
    let damaged = |e: DecodeErrors| Fault::damaged(Format::Jpeg, e);
    let options = DecoderOptions::default().set_strict_mode(true).set_max_width(usize::MAX).set_max_height(usize::MAX);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(damaged)?;
    let (width, height) = decoder.dimensions().unwrap_or_default();
    check_size(width, height)?;
    let stored = decoder.input_colorspace().unwrap_or(ColorSpace::Unknown);
    let (out, model) = match stored {
        ColorSpace::Luma => (ColorSpace::Luma, Model::Grey),
        ColorSpace::CMYK | ColorSpace::YCCK => (stored, Model::Cmyk),
        _ => (ColorSpace::RGB, Model::Rgb),
    };
    let held = if outline.held { 2 } else { 0 };
    if (width * height) as u64 * model.samples() as u64 * (1 + held) > MAX_BYTES {
        return Err(Fault::Heavy { width, height });
    }
    decoder.set_options(options.jpeg_set_out_colorspace(out));
    let mut pixels = vec![0; width * height * model.samples()];
    decoder.decode_into(&mut pixels).map_err(damaged)?;
    let turned = decoder.exif().and_then(|exif| Orientation::from_exif_chunk(exif));
    if model == Model::Cmyk {
        inks(&mut pixels, stored == ColorSpace::YCCK, outline.adobe.is_some());
    }
    let mut notes = Vec::new();
    let space = Space::of_icc(decoder.icc_profile().as_deref(), &mut notes);
    let orientation = turned.map_or(1, |o| o.to_exif());
    Ok(Raster { width, height, model, alpha: false, depth: Depth::Eight, bytes: pixels, space, orientation, notes })
}

/// Makes 255 full ink of what is stored.
///
/// Adobe stores CMYK inverted and says so by its segment; without it 255 is full ink (as in ITU-T T.872).
fn inks(pixels: &mut [u8], ycck: bool, inverted: bool) {
    for p in pixels.chunks_exact_mut(4) {
        if ycck {
            // ITU-T T.871, and then the complement
            let [y, cb, cr] = [p[0], p[1], p[2]].map(f32::from);
            let rgb = [
                y + 1.402 * (cr - 128.0),
                y - 0.344_136 * (cb - 128.0) - 0.714_136 * (cr - 128.0),
                y + 1.772 * (cb - 128.0),
            ];
            p[..3].copy_from_slice(&rgb.map(|v| 255 - v.round().clamp(0.0, 255.0) as u8));
        }
        if inverted {
            p.iter_mut().for_each(|v| *v = 255 - *v);
        }
    }
}
