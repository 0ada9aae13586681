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
    pub fn new(lightness: &Plane, radius: f64) -> Self {
        let (width, height) = (lightness.width(), lightness.height());
        let at = |x: usize, y: usize| lightness.at(x.min(width - 1), y.min(height - 1));
        let gradient = |x: usize, y: usize| {
            // Scharr's masks: the direction of their gradient is right to a tenth of a degree
            let (l, r, u, d) = (x.saturating_sub(1), x + 1, y.saturating_sub(1), y + 1);
            let gx = 3.0 * (at(r, u) - at(l, u)) + 10.0 * (at(r, y) - at(l, y)) + 3.0 * (at(r, d) - at(l, d));
            let gy = 3.0 * (at(l, d) - at(l, u)) + 10.0 * (at(x, d) - at(x, u)) + 3.0 * (at(r, d) - at(r, u));
            (gx, gy)
        };
        // -(gradient)^2 as a complex number: the double angle of the direction along the edge
        let square = |x: usize, y: usize| {
            let (gx, gy) = gradient(x, y);
            (gy * gy - gx * gx, -2.0 * gx * gy)
        };
        let square = &square;
        let row = |y| (0..width).map(move |x| square(x, y));
        let squares: Vec<(f32, f32)> = (0..height).into_par_iter().flat_map_iter(row).collect();
        let plane = |f: fn(&(f32, f32)) -> f32| {
            Plane::from_values(width, height, squares.iter().map(f).collect()).unwrap_or_default()
        };
        let (mut cos, mut sin) = (plane(|s| s.0), plane(|s| s.1));
        // Each scale leads where the finer ones say little.
        let mut sum = [Plane::filled(width, height, 0.0), Plane::filled(width, height, 0.0)];
        let (mut sigma, mut weight) = ((1.5 * radius).max(2.0), 1.0);
        for _ in 0..4 {
            cos = blur(&cos, sigma);
            sin = blur(&sin, sigma);
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

/// A plane blurred by three boxes, near to a Gaussian of this deviation, px.
pub(super) fn blur(plane: &Plane, sigma: f64) -> Plane {
    let (width, height) = (plane.width(), plane.height());
    let radius = (((12.0 * sigma * sigma / 3.0 + 1.0).sqrt() - 1.0) / 2.0).round() as usize;
    if radius == 0 || plane.values.is_empty() {
        return plane.clone();
    }
    let mut across = box_rows(&plane.values, width, radius);
    across = transposed(&across, width, height);
    across = box_rows(&across, height, radius);
    Plane::from_values(width, height, transposed(&across, height, width)).unwrap_or_default()
}

/// Each row through three boxes of `2 radius + 1` values; the border's value goes on outside.
fn box_rows(values: &[f32], width: usize, radius: usize) -> Vec<f32> {
    let mut out = values.to_vec();
    out.par_chunks_mut(width).for_each_init(
        || vec![0.0f32; width],
        |copy, row| {
            for _ in 0..3 {
                copy.copy_from_slice(row);
                let at = |i: isize| f64::from(copy[i.clamp(0, width as isize - 1) as usize]);
                let r = radius as isize;
                let mut sum: f64 = (-r..=r).map(at).sum();
                let scale = 1.0 / (2 * radius + 1) as f64;
                for (i, v) in row.iter_mut().enumerate() {
                    *v = (sum * scale) as f32;
                    let i = i as isize;
                    sum += at(i + r + 1) - at(i - r);
                }
            }
        },
    );
    out
}

fn transposed(values: &[f32], width: usize, height: usize) -> Vec<f32> {
    let mut out = vec![0.0; values.len()];
    out.par_chunks_mut(height).enumerate().for_each(|(x, column)| {
        for (y, v) in column.iter_mut().enumerate() {
            *v = values[y * width + x];
        }
    });
    out
}
