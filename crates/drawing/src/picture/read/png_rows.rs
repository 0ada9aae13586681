//! PNG files, row by row.
use std::io::{BufRead, Seek};

use png::{ColorType, Decoder, DecodingError, Reader, Transformations};

use super::{Fault, MAX_BYTES, check_size, orientation};
use crate::math::linear_from_srgb;

/// A PNG whose rows are to be read: samples of 8 or 16 bits, big-endian, 1 to 4 a pixel.
pub(super) struct PngRows<R: BufRead + Seek> {
    reader: Reader<R>,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) color: ColorType,
    /// Bits of a sample.
    pub(super) bits: u8,
    /// Exif orientation, 1..=8.
    pub(super) orientation: u8,
}

impl From<DecodingError> for Fault {
    fn from(error: DecodingError) -> Self {
        match error {
            DecodingError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
                Fault::damaged("PNG", "its end is missing")
            }
            DecodingError::IoError(e) => Fault::Io(e),
            e => Fault::damaged("PNG", e),
        }
    }
}

impl<R: BufRead + Seek> PngRows<R> {
    /// Reads the header. With `expand`, palettes become colours, bits become bytes and a transparent colour becomes alpha;
    /// without it, samples stay as they are stored.
    pub(super) fn open(source: R, expand: bool) -> Result<Self, Fault> {
        let mut decoder = Decoder::new(source);
        decoder.set_ignore_text_chunk(true);
        decoder.set_transformations(if expand { Transformations::EXPAND } else { Transformations::IDENTITY });
        let (width, height) = decoder.read_header_info()?.size();
        let (width, height) = (width as usize, height as usize);
        check_size(width, height)?;
        let reader = decoder.read_info()?;
        let (color, depth) = reader.output_color_type();
        let orientation = reader.info().exif_metadata.as_ref().map_or(1, |exif| orientation::of_exif(exif));
        Ok(Self { reader, width, height, color, bits: depth as u8, orientation })
    }

    /// Hands each row to `row`, from the top.
    pub(super) fn for_each(mut self, mut row: impl FnMut(&[u8])) -> Result<(), Fault> {
        if !self.reader.info().interlaced {
            for _ in 0..self.height {
                let line = self.reader.next_row()?.ok_or_else(|| Fault::damaged("PNG", "rows are missing"))?;
                row(line.data());
            }
            return Ok(());
        }
        // An interlaced picture is complete only with its last pass.
        let heavy = Fault::Heavy { width: self.width, height: self.height };
        let size = self.reader.output_buffer_size().filter(|s| *s as u64 <= MAX_BYTES).ok_or(heavy)?;
        let mut pixels = vec![0; size];
        self.reader.next_frame(&mut pixels)?;
        pixels.chunks_exact((size / self.height).max(1)).for_each(row);
        Ok(())
    }

    /// Linear light of each sample value: sRGB, or the power law of a gAMA chunk that says otherwise.
    pub(super) fn light(&self) -> Vec<f32> {
        let info = self.reader.info();
        let stated = info.srgb.is_some() || info.icc_profile.is_some();
        // 1 / 2.2 has always meant sRGB.
        let gamma = info.gama_chunk.filter(|_| !stated).map(|g| f64::from(g.into_value()));
        let power = gamma.filter(|g| (0.05..20.0).contains(g) && (g - 0.45455).abs() > 0.005).map(|g| 1.0 / g);
        let last = if self.bits == 16 { 65_535 } else { 255 };
        let light = |i: u32| {
            let v = f64::from(i) / f64::from(last);
            match power {
                Some(power) => v.powf(power),
                None if last == 255 => linear_from_srgb(i as u8),
                None if v <= 0.04045 => v / 12.92,
                None => ((v + 0.055) / 1.055).powf(2.4),
            }
        };
        (0..=last).map(|i| light(i) as f32).collect()
    }
}

/// The sample `i` of a row of samples of `bits` bits.
pub(super) fn sample(row: &[u8], i: usize, bits: u8) -> u16 {
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
