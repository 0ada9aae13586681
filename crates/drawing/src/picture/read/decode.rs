//! Formats that the `image` crate decodes: all but JPEG.
use std::io::Cursor;

use image::codecs::{bmp::BmpDecoder, gif::GifDecoder, hdr::HdrDecoder, png::PngDecoder};
use image::codecs::{qoi::QoiDecoder, tiff::TiffDecoder, webp::WebPDecoder};
use image::{AnimationDecoder, ColorType, Frame, ImageDecoder, ImageError, ImageResult, Limits};

use super::profile::Space;
use super::raster::{Depth, Model, Raster};
use super::{Fault, Format, MAX_BYTES, check_size, jpeg, png_head, tiff};

/// Most bytes that a PNG's text, profile and rows may take beside its pixels.
const PNG_BYTES: u64 = 64 << 20;

/// Decodes a whole file.
pub(super) fn decode(mut bytes: Vec<u8>) -> Result<Raster, Fault> {
    let format = Format::of(&bytes)?;
    let mut notes = Vec::new();
    if format == Format::Png && png_head::mend(&mut bytes) {
        notes.push("its end chunk is missing, but none of its pixels".into());
    }
    let source = Cursor::new(&bytes[..]);
    let opened = |e| Fault::of_image(e, format, (0, 0));
    match format {
        Format::Jpeg => jpeg::decode(bytes),
        Format::Png => {
            let space = png_head::space(&bytes, &mut notes)?;
            let decoder = PngDecoder::with_limits(source, at_most(PNG_BYTES)).map_err(opened)?;
            if decoder.is_apng().is_ok_and(|is| is) {
                notes.push("it is animated: its still picture is drawn".into());
            }
            whole(decoder, format, Some(space), notes)
        }
        Format::WebP => {
            // The decoder fills up what is missing of a lossy picture.
            let length = bytes.get(4..8).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
            if (bytes.len() as u64) < u64::from(length) + 8 {
                return Err(Fault::cut(format));
            }
            let decoder = WebPDecoder::new(source).map_err(opened)?;
            if decoder.has_animation() {
                notes.push("it is animated: its first frame is drawn".into());
            }
            whole(decoder, format, None, notes)
        }
        Format::Tiff => {
            let head = tiff::head(&bytes, &mut notes)?;
            if head.inks {
                return tiff::inks(&bytes, head.space, notes);
            }
            let raster = whole(TiffDecoder::new(source).map_err(opened)?, format, Some(head.space), notes)?;
            Ok(if head.premultiplied { tiff::unmultiplied(raster) } else { raster })
        }
        Format::Gif => {
            let raster = whole(GifDecoder::new(source.clone()).map_err(opened)?, format, None, notes)?;
            let note = match second_frame(source) {
                None | Some(Err(ImageError::Limits(_))) => return Ok(raster),
                Some(Ok(_)) => "it is animated: its first frame is drawn",
                Some(Err(_)) => "what follows its first frame is damaged or missing",
            };
            Ok(noted(raster, true, note))
        }
        Format::Bmp => whole(BmpDecoder::new(source).map_err(opened)?, format, None, notes),
        // Its word on linear light is only information, and many writers get it wrong.
        Format::Qoi => whole(QoiDecoder::new(source).map_err(opened)?, format, None, notes),
        Format::Hdr => {
            let raster = whole(HdrDecoder::new(source).map_err(opened)?, format, None, notes)?;
            let values = raster.rows().flat_map(|row| (0..3 * raster.width).map(|i| raster.value(row, i)));
            let beyond = values.filter(|v| *v > 1.0).count() as f64 / (3 * raster.width * raster.height) as f64;
            let note = format!("{:.1} % of its light is brighter than white (1.0) and drawn as white", 100.0 * beyond);
            Ok(noted(raster, beyond > 0.0, &note))
        }
    }
}

/// What follows a GIF's first frame, if anything does.
fn second_frame(source: Cursor<&[u8]>) -> Option<ImageResult<Frame>> {
    let mut decoder = GifDecoder::new(source).ok()?;
    decoder.set_limits(at_most(MAX_BYTES)).ok()?;
    decoder.into_frames().nth(1)
}

fn at_most(bytes: u64) -> Limits {
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(bytes);
    limits
}

fn noted(mut raster: Raster, holds: bool, note: &str) -> Raster {
    if holds {
        raster.notes.push(note.into());
    }
    raster
}

/// All pixels of a decoder, and what it knows beside them; the space is that of its profile unless it is given.
fn whole<D: ImageDecoder>(
    mut decoder: D,
    format: Format,
    space: Option<Space>,
    mut notes: Vec<String>,
) -> Result<Raster, Fault> {
    let (width, height) = decoder.dimensions();
    let size @ (width, height) = (width as usize, height as usize);
    check_size(width, height)?;
    let fault = |e| Fault::of_image(e, format, size);
    let (model, alpha, depth) = match decoder.color_type() {
        ColorType::L8 => (Model::Grey, false, Depth::Eight),
        ColorType::La8 => (Model::Grey, true, Depth::Eight),
        ColorType::Rgb8 => (Model::Rgb, false, Depth::Eight),
        ColorType::Rgba8 => (Model::Rgb, true, Depth::Eight),
        ColorType::L16 => (Model::Grey, false, Depth::Sixteen),
        ColorType::La16 => (Model::Grey, true, Depth::Sixteen),
        ColorType::Rgb16 => (Model::Rgb, false, Depth::Sixteen),
        ColorType::Rgba16 => (Model::Rgb, true, Depth::Sixteen),
        ColorType::Rgb32F => (Model::Rgb, false, Depth::Float),
        ColorType::Rgba32F => (Model::Rgb, true, Depth::Float),
        other => return Err(Fault::foreign(format, format!("{other:?} pixels"))),
    };
    let total = decoder.total_bytes();
    if total.saturating_mul(format.copies()) > MAX_BYTES {
        return Err(Fault::Heavy { width, height });
    }
    decoder.set_limits(at_most(MAX_BYTES)).map_err(fault)?;
    // Where it is broken, the pixels count.
    let orientation = decoder.orientation().map_or(1, |o| o.to_exif());
    let space = match space {
        Some(space) => space,
        None => match decoder.icc_profile() {
            Ok(icc) => Space::of_icc(icc.as_deref(), &mut notes),
            Err(e) => Space::unread(e, &mut notes),
        },
    };
    let mut bytes = vec![0; total as usize];
    decoder.read_image(&mut bytes).map_err(fault)?;
    Ok(Raster { width, height, model, alpha, depth, bytes, space, orientation, notes })
}
