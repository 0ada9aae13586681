//! How large a sheet is desired.
use super::DrawingError;

/// Desired size of the sheet; artwork is scaled uniformly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Size {
    /// As the file says: units as written, 96 px = 25.4 mm.
    #[default]
    Natural,
    /// This width, m.
    Width(f64),
    /// This height, m.
    Height(f64),
    /// As large as fits into this width and height, m.
    Fit(f64, f64),
}

/// Sides of a sheet beyond which a size is taken for a mistake, m.
const SIDE: std::ops::RangeInclusive<f64> = 1e-4..=1e3;

impl Size {
    /// Width and height of the sheet, m, for artwork of this natural width and height, m.
    ///
    /// # Errors
    /// `BadOption` where a desired or resulting side is not between 0.1 mm and 1 km.
    pub fn resolve(&self, width: f64, height: f64) -> Result<(f64, f64), DrawingError> {
        let check = |name, value: f64| match SIDE.contains(&value) {
            true => Ok(value),
            false => Err(DrawingError::BadOption {
                name,
                value,
                message: "a sheet's side must lie between 0.0001 and 1000 m".into(),
            }),
        };
        let factor = match *self {
            Size::Natural => 1.0,
            Size::Width(w) => check("width", w)? / width,
            Size::Height(h) => check("height", h)? / height,
            Size::Fit(w, h) => (check("width", w)? / width).min(check("height", h)? / height),
        };
        Ok((check("width", width * factor)?, check("height", height * factor)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_that_are_no_sheet_are_refused() {
        for size in [Size::Width(0.0), Size::Height(f64::NAN), Size::Fit(1.0, f64::INFINITY), Size::Width(1e4)] {
            assert!(matches!(size.resolve(0.2, 0.1), Err(DrawingError::BadOption { .. })), "{size:?}");
        }
    }
}
