//! One number a pixel.

/// A field of numbers over a picture: tone, density, depth. Rows from the top, values from the left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plane {
    width: usize,
    height: usize,
    /// `width * height` values, row by row.
    pub values: Vec<f32>,
}

impl Plane {
    /// A plane of one value.
    pub fn filled(width: usize, height: usize, value: f32) -> Self {
        Self { width, height, values: vec![value; width * height] }
    }

    /// The plane whose value in a column and row is `f(column, row)`.
    pub fn from_fn(width: usize, height: usize, mut f: impl FnMut(usize, usize) -> f32) -> Self {
        let mut values = Vec::with_capacity(width * height);
        for row in 0..height {
            values.extend((0..width).map(|column| f(column, row)));
        }
        Self { width, height, values }
    }

    /// A plane of these values, row by row; `None` when they don't fill it.
    pub fn from_values(width: usize, height: usize, values: Vec<f32>) -> Option<Self> {
        (values.len() == width * height).then_some(Self { width, height, values })
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The value in a column and row, both inside.
    pub fn at(&self, column: usize, row: usize) -> f32 {
        self.values[row * self.width + column]
    }

    /// The value at a place in pixels (pixel centres at halves), bilinear between centres and clamped at the border.
    pub fn sample(&self, x: f64, y: f64) -> f32 {
        let clamp = |v: f64, n: usize| (v - 0.5).clamp(0.0, n.saturating_sub(1) as f64);
        let (x, y) = (clamp(x, self.width), clamp(y, self.height));
        let (i, j) = (x as usize, y as usize);
        let (fx, fy) = ((x - i as f64) as f32, (y - j as f64) as f32);
        let (i1, j1) = ((i + 1).min(self.width - 1), (j + 1).min(self.height - 1));
        let top = self.at(i, j) * (1.0 - fx) + self.at(i1, j) * fx;
        let bottom = self.at(i, j1) * (1.0 - fx) + self.at(i1, j1) * fx;
        top * (1.0 - fy) + bottom * fy
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_lie_on_the_bilinear_patch() {
        let plane = Plane::from_fn(4, 3, |x, y| x as f32 + 10.0 * y as f32);
        assert_eq!(plane.sample(2.5, 1.5), 12.0);
        assert!((plane.sample(2.0, 1.25) - 9.0).abs() < 1e-6);
        assert_eq!(plane.sample(-5.0, 99.0), 20.0);
        assert_eq!(Plane::from_values(2, 2, vec![0.0; 3]), None);
    }
}
