//! The direction in which strokes flow: along edges, and where there are none, as edges farther away lead.
use nalgebra::{Point2, Vector2};
use rayon::prelude::*;

use crate::picture::Plane;

/// A field of directions without sign, from the structure tensor of a picture. Its eigenvector of the smaller eigenvalue is
/// normal to the mean gradient (Hertzmann 1998 takes the gradient of single pixels; averages flow better).
pub(super) struct Flow {
    width: usize,
    height: usize,
    /// Unit directions of either sign, pixel by pixel.
    directions: Vec<[f32; 2]>,
}

impl Flow {
    /// The flow of a plane of lightness at the scale of a brush of this radius, px.
    pub fn new(lightness: &Plane, radius: f32) -> Self {
        let (width, height) = (lightness.width(), lightness.height());
        let (right, down) = lightness.gradient();
        let square = |f: fn(f32, f32) -> f32| {
            let values = right.values.par_iter().zip(&down.values).map(|(x, y)| f(*x, *y)).collect();
            Plane::from_values(width, height, values).unwrap_or_default()
        };
        // -(gradient)^2 as a complex number: the double angle of the direction along the edge
        let (mut cos, mut sin) = (square(|x, y| y * y - x * x), square(|x, y| -2.0 * x * y));
        // Each scale leads where the finer ones say little.
        let mut sum = [Plane::filled(width, height, 0.0), Plane::filled(width, height, 0.0)];
        let (mut sigma, mut weight) = ((1.5 * radius).max(2.0), 1.0);
        for _ in 0..4 {
            cos = cos.blurred(sigma);
            sin = sin.blurred(sigma);
            for (sum, part) in sum.iter_mut().zip([&cos, &sin]) {
                sum.values.iter_mut().zip(&part.values).for_each(|(s, p)| *s += weight * p);
            }
            sigma *= 2.5;
            weight *= 0.3;
        }
        let [cos, sin] = sum;
        let directions = cos.values.par_iter().zip(&sin.values).map(|(c, s)| half(*c, *s)).collect();
        Self { width, height, directions }
    }

    /// The unit direction in the pixel at a place, of either sign.
    pub fn direction(&self, p: Point2<f64>) -> Vector2<f64> {
        let index = |v: f64, n: usize| (v.max(0.0) as usize).min(n - 1);
        let [x, y] = self.directions[index(p.y, self.height) * self.width + index(p.x, self.width)];
        Vector2::new(f64::from(x), f64::from(y))
    }
}

/// The unit vector at half the angle of another; to the right where nothing leads.
fn half(c: f32, s: f32) -> [f32; 2] {
    let norm = c.hypot(s);
    if norm < 1e-12 {
        return [1.0, 0.0];
    }
    let (cos, sin) = ((0.5 * (1.0 + c / norm)).max(0.0).sqrt(), (0.5 * (1.0 - c / norm)).max(0.0).sqrt());
    [cos, if s < 0.0 { -sin } else { sin }]
}
