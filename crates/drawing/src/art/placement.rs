//! Where a picture lies on a sheet.
use nalgebra::Point2;

use super::{ArtError, Sheet};
use crate::picture::Picture;

/// A picture laid on the middle of a sheet, as large as fits, upright and undistorted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    width: f64,
    height: f64,
    pixel: f64,
}

impl Placement {
    /// Lays a picture of `width x height` px on a sheet.
    pub fn new(width: usize, height: usize, sheet: Sheet) -> Self {
        let (width, height) = (width.max(1) as f64, height.max(1) as f64);
        Self { width, height, pixel: (sheet.width / width).min(sheet.height / height) }
    }

    /// Lays a picture on a sheet.
    ///
    /// # Errors
    /// [`ArtError::NothingToDraw`] of a picture without pixels, [`ArtError::BadOption`] of a sheet that isn't one.
    pub fn checked(picture: &Picture, sheet: Sheet) -> Result<Self, ArtError> {
        for (name, value) in [("sheet_width", sheet.width), ("sheet_height", sheet.height)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(ArtError::BadOption { name, value, message: "a sheet has a positive size, m".to_string() });
            }
        }
        if picture.pixels.is_empty() {
            return Err(ArtError::NothingToDraw { reason: "the picture has no pixels".to_string() });
        }
        Ok(Self::new(picture.width(), picture.height(), sheet))
    }

    /// Side of a pixel on the sheet, m.
    pub fn pixel(&self) -> f64 {
        self.pixel
    }

    /// Width and height of the picture on the sheet, m.
    pub fn size(&self) -> [f64; 2] {
        [self.width * self.pixel, self.height * self.pixel]
    }

    /// The place on the sheet, m, of a place in the picture, px from its top left corner.
    pub fn on_sheet(&self, x: f64, y: f64) -> Point2<f64> {
        Point2::new((x - 0.5 * self.width) * self.pixel, (0.5 * self.height - y) * self.pixel)
    }

    /// The place in the picture, px from its top left corner, of a place on the sheet, m.
    pub fn in_picture(&self, p: Point2<f64>) -> [f64; 2] {
        [p.x / self.pixel + 0.5 * self.width, 0.5 * self.height - p.y / self.pixel]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_fills_the_sheet_one_way_and_comes_back() {
        let sheet = Sheet { width: 0.2, height: 0.1 };
        let placement = Placement::new(300, 300, sheet);
        assert!((placement.size()[0] - 0.1).abs() < 1e-12 && (placement.size()[1] - 0.1).abs() < 1e-12);
        assert!((placement.on_sheet(0.0, 0.0) - Point2::new(-0.05, 0.05)).norm() < 1e-12);
        let [x, y] = placement.in_picture(placement.on_sheet(12.5, 280.0));
        assert!((x - 12.5).abs() < 1e-9 && (y - 280.0).abs() < 1e-9);
    }
}
