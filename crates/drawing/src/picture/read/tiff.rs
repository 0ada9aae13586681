//! What `image` doesn't tell of a TIFF: its other pages, whether it is a camera's raw file, and its inks.
use std::io::Cursor;

use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;
use tiff::{ColorType, TiffError};

use super::profile::Space;
use super::raster::{Depth, Model, Raster};
use super::{Fault, Format, MAX_BYTES, check_size};

/// `DNGVersion` (Adobe DNG 1.6, chapter 4).
const DNG_VERSION: Tag = Tag::Unknown(50_706);
/// Most bytes of a tag's values and of one strip or tile.
const STRIP_BYTES: usize = 512 << 20;

/// What a TIFF says before its pixels.
pub(super) struct Head {
    /// Its pixels are cyan, magenta, yellow and black.
    pub(super) inks: bool,
    /// What its samples mean.
    pub(super) space: Space,
    /// Its colours are stored times their alpha.
    pub(super) premultiplied: bool,
}

fn fault(error: TiffError) -> Fault {
    match error {
        TiffError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => Fault::cut(Format::Tiff),
        TiffError::UnsupportedError(e) => Fault::foreign(Format::Tiff, format!("unusual data (\"{e}\")")),
        e => Fault::damaged(Format::Tiff, e),
    }
}

/// Looks at the first page, and notes that there are more.
pub(super) fn head(bytes: &[u8], notes: &mut Vec<String>) -> Result<Head, Fault> {
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(fault)?;
    let (width, height) = decoder.dimensions().map_err(fault)?;
    check_size(width as usize, height as usize)?;
    let mut tag = |tag| decoder.find_tag_unsigned_vec::<u32>(tag).ok().flatten().unwrap_or_default();
    let thumbnail = tag(Tag::NewSubfileType).first().is_some_and(|kind| kind & 1 == 1);
    if thumbnail || !tag(DNG_VERSION).is_empty() {
        let what = "it is a camera's raw file, or one that begins with a thumbnail";
        return Err(Fault::NoPicture(what.into()));
    }
    // TIFF 6.0, sections 5 and 23
    match tag(Tag::PhotometricInterpretation).first() {
        Some(3) => return Err(Fault::foreign(Format::Tiff, "a palette")),
        Some(8..=10) => return Err(Fault::foreign(Format::Tiff, "CIELAB colours")),
        _ => {}
    }
    let premultiplied = tag(Tag::ExtraSamples).contains(&1);
    if decoder.more_images() {
        notes.push("it has more pages: the first is drawn".into());
    }
    // `image` keeps silent of one that is cut off.
    let space = match decoder.find_tag(Tag::IccProfile).and_then(|tag| tag.map(|t| t.into_u8_vec()).transpose()) {
        Ok(icc) => Space::of_icc(icc.as_deref(), notes),
        Err(e) => Space::unread(e, notes),
    };
    let inks = match decoder.colortype().map_err(fault)? {
        ColorType::CMYK(8 | 16) => true,
        ColorType::YCbCr(_) => return Err(Fault::foreign(Format::Tiff, "YCbCr colours")),
        _ => false,
    };
    Ok(Head { inks, space, premultiplied })
}

/// Decodes a TIFF in four inks, which `image` would turn into RGB without its profile.
pub(super) fn inks(bytes: &[u8], space: Space, notes: Vec<String>) -> Result<Raster, Fault> {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MAX_BYTES as usize;
    limits.intermediate_buffer_size = STRIP_BYTES;
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(fault)?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(fault)?;
    let (width, height) = (width as usize, height as usize);
    check_size(width, height)?;
    let sixteen = matches!(decoder.colortype().map_err(fault)?, ColorType::CMYK(16));
    let depth = if sixteen { Depth::Sixteen } else { Depth::Eight };
    if (width * height * 4 * depth.bytes()) as u64 > MAX_BYTES {
        return Err(Fault::Heavy { width, height });
    }
    if decoder.find_tag_unsigned::<u16>(Tag::PlanarConfiguration).ok().flatten() == Some(2) {
        return Err(Fault::foreign(Format::Tiff, "inks in planes one after another"));
    }
    let turned = decoder.find_tag_unsigned::<u8>(Tag::Orientation).ok().flatten();
    let orientation = turned.filter(|o| (1..=8).contains(o)).unwrap_or(1);
    let samples = match decoder.read_image().map_err(fault)? {
        DecodingResult::U8(samples) => samples,
        DecodingResult::U16(samples) => samples.iter().flat_map(|v| v.to_ne_bytes()).collect(),
        _ => return Err(Fault::foreign(Format::Tiff, "inks that aren't whole numbers")),
    };
    if samples.len() != width * height * 4 * depth.bytes() {
        return Err(Fault::damaged(Format::Tiff, "pixels are missing"));
    }
    Ok(Raster { width, height, model: Model::Cmyk, alpha: false, depth, bytes: samples, space, orientation, notes })
}

/// Colours that were stored times their alpha, without it.
pub(super) fn unmultiplied(mut raster: Raster) -> Raster {
    if !raster.alpha || raster.depth == Depth::Float {
        return raster;
    }
    let (samples, last) = (raster.samples(), raster.depth.last() as usize);
    let mut bytes = Vec::with_capacity(raster.bytes.len());
    for row in raster.rows() {
        for x in 0..raster.width {
            let alpha = raster.step(row, samples * x + samples - 1);
            for k in 0..samples {
                let v = raster.step(row, samples * x + k);
                let bare = if k + 1 == samples { v } else { ((v * last + alpha / 2) / alpha.max(1)).min(last) };
                match raster.depth {
                    Depth::Eight => bytes.push(bare as u8),
                    _ => bytes.extend_from_slice(&(bare as u16).to_ne_bytes()),
                }
            }
        }
    }
    raster.bytes = bytes;
    raster
}
