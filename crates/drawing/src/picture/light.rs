//! A picture in linear light.
use crate::math::{SrgbTable, linear_from_srgb};
use crate::picture::{Image, PictureError, Plane};

/// A picture: linear light, red, green and blue in 0..=1, rows from the top, pixels from the left. It is opaque: what was
/// transparent shows the paper's white.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    width: usize,
    height: usize,
    /// `width * height` pixels, row by row.
    pub pixels: Vec<[f32; 3]>,
}

/// Luminance `Y` of linear light (IEC 61966-2-1 primaries).
pub(super) fn luminance(p: [f32; 3]) -> f32 {
    0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]
}

impl Picture {
    /// A picture of these pixels, row by row; `None` when they don't fill it.
    pub fn from_pixels(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Option<Self> {
        (pixels.len() == width * height).then_some(Self { width, height, pixels })
    }

    /// The picture of an 8-bit sRGB image.
    pub fn from_image(image: &Image) -> Self {
        let table: Vec<f32> = (0..=255).map(|v| linear_from_srgb(v) as f32).collect();
        let pixels = image.bytes().chunks_exact(3).map(|p| [p[0], p[1], p[2]].map(|v| table[usize::from(v)])).collect();
        Self { width: image.width() as usize, height: image.height() as usize, pixels }
    }

    /// The picture as 8-bit sRGB.
    ///
    /// # Errors
    /// [`PictureError::Pixels`], of a picture too large for an image.
    pub fn to_image(&self) -> Result<Image, PictureError> {
        let table = SrgbTable::new();
        let rgb = self.pixels.iter().flat_map(|p| p.map(|v| table.get(v))).collect();
        Image::new(self.width as u32, self.height as u32, rgb)
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The pixel in a column and row, both inside.
    pub fn at(&self, column: usize, row: usize) -> [f32; 3] {
        self.pixels[row * self.width + column]
    }

    /// Luminance of each pixel.
    pub fn luminance(&self) -> Plane {
        let values = self.pixels.iter().map(|p| luminance(*p)).collect();
        Plane::from_values(self.width, self.height, values).unwrap_or_default()
    }
}
