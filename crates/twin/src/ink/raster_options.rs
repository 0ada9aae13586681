//! What the picture of a trace looks like.
use crate::ink::InkError;
use crate::math::{PAPER, Rgb};
use crate::picture::MAX_SIDE;

/// What the picture of a trace looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RasterOptions {
    /// Width of the sheet, m. The picture shows all of the sheet and no more.
    pub width: f64,
    /// Height of the sheet, m.
    pub height: f64,
    /// Resolution, px/mm.
    pub px_per_mm: f64,
    /// Colour of the paper.
    pub paper: Rgb,
}

impl RasterOptions {
    /// A sheet of `width` x `height`, m, on [`PAPER`], its longer side `px` pixels long.
    pub fn with_long_side(width: f64, height: f64, px: u32) -> Self {
        Self { width, height, px_per_mm: f64::from(px) / (1000.0 * width.max(height)), paper: PAPER }
    }

    /// Columns and rows of the picture.
    ///
    /// # Errors
    /// [`InkError::Size`] when a side has no pixel, or more than 32768.
    pub fn size(&self) -> Result<(u32, u32), InkError> {
        let side = |m: f64| {
            // A hair less than a pixel too much is rounding, not sheet.
            let px = (m * 1000.0 * self.px_per_mm - 1e-6).ceil();
            (1.0..=f64::from(MAX_SIDE)).contains(&px).then_some(px as u32)
        };
        match (side(self.width), side(self.height)) {
            (Some(columns), Some(rows)) => Ok((columns, rows)),
            _ => Err(InkError::Size {
                width_mm: self.width * 1e3,
                height_mm: self.height * 1e3,
                px_per_mm: self.px_per_mm,
                max_px: MAX_SIDE,
            }),
        }
    }
}
