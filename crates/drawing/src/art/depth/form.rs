//! Along which way strokes follow the form of what is painted.
use nalgebra::{Point2, Vector2};
use rayon::prelude::*;

use crate::picture::Plane;

/// Standard deviations over which directions are averaged, px, and the weight of each: what is near counts, what is far
/// decides where near nothing has a direction.
const SCALES: [(f32, f32); 3] = [(2.0, 1.0), (6.0, 0.25), (18.0, 0.08)];
/// A step between two segments counts as one of this lightness.
const BORDER: f32 = 0.6;
/// A step of the whole range of depth counts as one of this lightness.
const DEPTH: f32 = 3.0;

/// A field of directions without a sign, as (cos 2a, sin 2a) times its strength, so that it can be averaged.
pub(super) struct Form {
    width: usize,
    height: usize,
    double: Vec<[f32; 2]>,
}

impl Form {
    /// Directions along isophotes of `lightness`, along the borders of `segments` and along the contours of `depth`.
    pub fn new(lightness: &Plane, segments: &[u16], depth: &Plane) -> Self {
        let (width, height) = (lightness.width(), lightness.height());
        let raw: Vec<[f32; 2]> = (0..width * height)
            .into_par_iter()
            .map(|i| {
                let (x, y) = (i % width, i / width);
                let (l, r) = (i - usize::from(x > 0), i + usize::from(x + 1 < width));
                let (u, d) = (i - if y > 0 { width } else { 0 }, i + if y + 1 < height { width } else { 0 });
                let slope = |p: &Plane| [p.values[r] - p.values[l], p.values[d] - p.values[u]];
                let border = |a: usize, b: usize| if segments[a] == segments[b] { 0.0 } else { BORDER };
                let deep = slope(depth).map(|v| DEPTH * v);
                let mut sum = [0.0; 2];
                for [gx, gy] in [slope(lightness), deep, [border(l, i) + border(i, r), border(u, i) + border(i, d)]] {
                    let square = gx * gx + gy * gy;
                    if square > 1e-12 {
                        // a quarter turn from the gradient; strengths are evened out, so that one hard edge doesn't
                        // outshout the form around it
                        let even = square.powf(-0.7);
                        sum[0] -= (gx * gx - gy * gy) * even;
                        sum[1] -= 2.0 * gx * gy * even;
                    }
                }
                sum
            })
            .collect();
        let plane =
            |k: usize| Plane::from_values(width, height, raw.iter().map(|d| d[k]).collect()).unwrap_or_default();
        let mut double = vec![[0.0; 2]; raw.len()];
        for (k, raw) in [plane(0), plane(1)].iter().enumerate() {
            for (sigma, weight) in SCALES {
                let soft = raw.blurred(sigma);
                double.iter_mut().zip(&soft.values).for_each(|(d, s)| d[k] += weight * s);
            }
        }
        Self { width, height, double }
    }

    /// The unit direction at a place, px, of the two signs the one nearer to `along`; `None` where there is none.
    pub fn direction(&self, p: &Point2<f64>, along: &Vector2<f64>) -> Option<Vector2<f64>> {
        let x = (p.x.max(0.0) as usize).min(self.width.checked_sub(1)?);
        let y = (p.y.max(0.0) as usize).min(self.height.checked_sub(1)?);
        let [c, s] = self.double[y * self.width + x].map(f64::from);
        if c.hypot(s) < 1e-9 {
            return None;
        }
        let angle = 0.5 * s.atan2(c);
        let way = Vector2::new(angle.cos(), angle.sin());
        Some(if way.dot(along) < 0.0 { -way } else { way })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_run_along_an_edge_and_reach_into_the_flat() {
        let slanted = Plane::from_fn(60, 60, |x, y| if x + y < 60 { 0.2 } else { 0.8 });
        let flat = Plane::filled(60, 60, 0.5);
        let form = Form::new(&slanted, &[0; 3600], &flat);
        let along = Vector2::new(1.0, -1.0).normalize();
        for p in [Point2::new(30.0, 30.0), Point2::new(12.0, 12.0)] {
            let found = form.direction(&p, &Vector2::new(0.0, -1.0)).unwrap();
            assert!((found - along).norm() < 0.1, "{found:?}");
        }
        assert!(Form::new(&flat, &[0; 3600], &flat).direction(&Point2::new(3.0, 3.0), &along).is_none());
    }
}
