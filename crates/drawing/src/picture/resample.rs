//! Pictures and planes at another size, blurred, and their slopes.
use rayon::prelude::*;

use crate::picture::value::Pixel;
use crate::picture::{Picture, Plane};

/// Blurs wider than this, px, are [`BOXES`] box blurs, whose cost doesn't grow with the width.
const BOX_SIGMA_PX: f32 = 12.0;

/// Box blurs that stand for a Gaussian: of four, the peak is 3.5 % lower than the bell's.
const BOXES: usize = 4;

/// One output cell of a filter along a line: the first input cell, and the weights from there on.
struct Taps {
    first: usize,
    weights: Vec<f32>,
}

/// The filter from `n` to `m` cells: the exact area where it shrinks, Catmull-Rom (doi:10.1016/B978-0-12-079050-0.50020-5)
/// where it grows.
fn taps(n: usize, m: usize) -> Vec<Taps> {
    let ratio = n as f64 / m as f64;
    (0..m)
        .map(|j| {
            if m <= n {
                let (from, to) = (j as f64 * ratio, (j + 1) as f64 * ratio);
                let last = (to.ceil() as usize).min(n);
                let first = (from as usize).min(last - 1);
                let inside = |i: usize| (to.min((i + 1) as f64) - from.max(i as f64)).max(0.0);
                return Taps { first, weights: (first..last).map(|i| (inside(i) / ratio) as f32).collect() };
            }
            let center = (j as f64 + 0.5) * ratio - 0.5;
            let base = center.floor();
            let t = center - base;
            let cubic = [
                ((-0.5 * t + 1.0) * t - 0.5) * t,
                (1.5 * t - 2.5) * t * t + 1.0,
                ((-1.5 * t + 2.0) * t + 0.5) * t,
                (0.5 * t - 0.5) * t * t,
            ];
            // Past the border the last cell is repeated: its weight is added to the border's.
            let at = |k: usize| (base + k as f64 - 1.0).clamp(0.0, (n - 1) as f64) as usize;
            let first = at(0);
            let mut weights = vec![0.0; at(3) - first + 1];
            for (k, w) in cubic.iter().enumerate() {
                weights[at(k) - first] += *w as f32;
            }
            Taps { first, weights }
        })
        .collect()
}

/// The filtered value of `value(i)`, kept within the range of its inputs so that edges don't ring.
fn filtered<T: Pixel>(taps: &Taps, value: impl Fn(usize) -> T) -> T {
    let start = value(taps.first);
    let (mut sum, mut low, mut high) = (T::default(), start, start);
    for (k, w) in taps.weights.iter().enumerate() {
        let v = value(taps.first + k);
        (sum, low, high) = (sum.plus(*w, v), low.low(v), high.high(v));
    }
    sum.high(low).low(high)
}

fn resize<T: Pixel>(pixels: &[T], (w, h): (usize, usize), (to_w, to_h): (usize, usize)) -> Vec<T> {
    if w * h * to_w * to_h == 0 {
        return vec![T::default(); to_w * to_h];
    }
    if (w, h) == (to_w, to_h) {
        return pixels.to_vec();
    }
    let (across, down) = (taps(w, to_w), taps(h, to_h));
    let mut wide = vec![T::default(); to_w * h];
    wide.par_chunks_mut(to_w).zip(pixels.par_chunks(w)).for_each(|(out, row)| {
        for (value, taps) in out.iter_mut().zip(&across) {
            *value = filtered(taps, |i| row[i]);
        }
    });
    let mut out = vec![T::default(); to_w * to_h];
    out.par_chunks_mut(to_w).zip(&down).for_each(|(out, taps)| {
        for (x, value) in out.iter_mut().enumerate() {
            *value = filtered(taps, |i| wide[i * to_w + x]);
        }
    });
    out
}

impl Picture {
    /// The picture at another size: averaged over areas where it shrinks (in linear light, so that tone is kept), cubic where
    /// it grows. Sides of 0 px give a picture without pixels.
    pub fn resized(&self, width: usize, height: usize) -> Self {
        let pixels = resize(&self.pixels, (self.width(), self.height()), (width, height));
        Self::from_pixels(width, height, pixels).unwrap_or_default()
    }

    /// The picture blurred in linear light by a Gaussian of standard deviation `sigma`, px; see [`Plane::blurred`].
    pub fn blurred(&self, sigma: f32) -> Self {
        let planes: Vec<Plane> = (0..3).map(|k| self.channel(k).blurred(sigma)).collect();
        let pixels = (0..self.pixels.len()).map(|i| [0, 1, 2].map(|k| planes[k].values[i])).collect();
        Self::from_pixels(self.width(), self.height(), pixels).unwrap_or_default()
    }

    /// Red (0), green (1) or blue (2) by itself, in linear light.
    pub fn channel(&self, channel: usize) -> Plane {
        let values = self.pixels.iter().map(|p| p[channel.min(2)]).collect();
        Plane::from_values(self.width(), self.height(), values).unwrap_or_default()
    }
}

impl Plane {
    /// The plane at another size: averaged over areas where it shrinks, cubic where it grows, never past the range of the
    /// values around. Sides of 0 px give a plane without values.
    pub fn resized(&self, width: usize, height: usize) -> Self {
        let values = resize(&self.values, (self.width(), self.height()), (width, height));
        Self::from_values(width, height, values).unwrap_or_default()
    }

    /// The plane blurred by a Gaussian of standard deviation `sigma`, px, reflected at its borders; itself at 0.
    ///
    /// Up to a sigma of 12 px by sampled weights over 3 sigma, above by four box blurs of fractional width
    /// (doi:10.1007/978-3-642-24785-9_38).
    pub fn blurred(&self, sigma: f32) -> Self {
        if sigma.is_nan() || sigma <= 0.0 || self.values.is_empty() {
            return self.clone();
        }
        if sigma > BOX_SIGMA_PX {
            let across = self.boxed(sigma).transposed();
            return across.boxed(sigma).transposed();
        }
        let radius = (3.0 * sigma).ceil() as usize;
        let bell: Vec<f32> = (0..=radius).map(|k| (-0.5 * (k as f32 / sigma).powi(2)).exp()).collect();
        let sum = bell[0] + 2.0 * bell[1..].iter().sum::<f32>();
        self.convolved(&bell.iter().map(|w| w / sum).collect::<Vec<_>>())
    }

    /// Convolved along rows and along columns by a symmetric kernel of which `half` is the middle and what follows it.
    pub(super) fn convolved(&self, half: &[f32]) -> Self {
        let (w, h) = (self.width(), self.height());
        let radius = half.len() as isize - 1;
        let mut across = vec![0.0f32; w * h];
        across.par_chunks_mut(w).zip(self.values.par_chunks(w)).for_each(|(out, row)| {
            let padded: Vec<f32> = (-radius..w as isize + radius).map(|x| row[reflected(x, w)]).collect();
            for (k, padded) in padded.windows(w).enumerate() {
                let weight = half[(k as isize - radius).unsigned_abs()];
                out.iter_mut().zip(padded).for_each(|(o, v)| *o += weight * v);
            }
        });
        let mut values = vec![0.0f32; w * h];
        values.par_chunks_mut(w).enumerate().for_each(|(y, out)| {
            for k in -radius..=radius {
                let row = reflected(y as isize + k, h) * w;
                let weight = half[k.unsigned_abs()];
                out.iter_mut().zip(&across[row..row + w]).for_each(|(o, v)| *o += weight * v);
            }
        });
        Self::from_values(w, h, values).unwrap_or_default()
    }

    /// Box blurs along rows whose variances add up to `sigma^2`.
    fn boxed(&self, sigma: f32) -> Self {
        // A box of 2 r + 1 cells and, at both ends, a share `a` of the next has the variance below; a is solved for.
        let s2 = f64::from(sigma).powi(2) / BOXES as f64;
        let r = (0.5 * (12.0 * s2 + 1.0).sqrt() - 0.5).floor();
        let a = (2.0 * r + 1.0) * (r * (r + 1.0) - 3.0 * s2) / (6.0 * (s2 - (r + 1.0).powi(2)));
        let (reach, norm) = (r as isize, 1.0 / (2.0 * (r + a) + 1.0));
        let w = self.width();
        let mut out = self.clone();
        out.values.par_chunks_mut(w).for_each(|row| {
            for _ in 0..BOXES {
                let old = row.to_vec();
                let at = |x: isize| f64::from(old[reflected(x, w)]);
                let mut sum: f64 = (-reach..=reach).map(at).sum();
                for (x, value) in row.iter_mut().enumerate() {
                    let x = x as isize;
                    *value = ((sum + a * (at(x - reach - 1) + at(x + reach + 1))) * norm) as f32;
                    sum += at(x + reach + 1) - at(x - reach);
                }
            }
        });
        out
    }

    /// Rows as columns.
    fn transposed(&self) -> Self {
        let (w, h) = (self.width(), self.height());
        let mut values = vec![0.0; w * h];
        values.par_chunks_mut(h).enumerate().for_each(|(x, out)| {
            out.iter_mut().enumerate().for_each(|(y, v)| *v = self.values[y * w + x]);
        });
        Self::from_values(h, w, values).unwrap_or_default()
    }

    /// Slopes to the right and downwards, per px, by Scharr's 3 x 3 operator, whose direction errs least.
    pub fn gradient(&self) -> (Self, Self) {
        let (w, h) = (self.width(), self.height());
        let mut slopes = vec![(0.0f32, 0.0f32); w * h];
        slopes.par_chunks_mut(w.max(1)).enumerate().for_each(|(y, out)| {
            let row = |dy: isize| &self.values[reflected(y as isize + dy, h) * w..][..w];
            let (up, mid, down) = (row(-1), row(0), row(1));
            for (x, slope) in out.iter_mut().enumerate() {
                let (l, r) = (reflected(x as isize - 1, w), reflected(x as isize + 1, w));
                let right = 3.0 * (up[r] - up[l]) + 10.0 * (mid[r] - mid[l]) + 3.0 * (down[r] - down[l]);
                let below = 3.0 * (down[l] - up[l]) + 10.0 * (down[x] - up[x]) + 3.0 * (down[r] - up[r]);
                *slope = (right / 32.0, below / 32.0);
            }
        });
        let plane =
            |f: fn(&(f32, f32)) -> f32| Self::from_values(w, h, slopes.iter().map(f).collect()).unwrap_or_default();
        (plane(|s| s.0), plane(|s| s.1))
    }
}

/// The cell that place `x` shows where `n > 0` cells are mirrored at both ends (`c b a | a b c | c b a`).
fn reflected(x: isize, n: usize) -> usize {
    if (0..n as isize).contains(&x) {
        return x as usize;
    }
    let x = x.rem_euclid(2 * n as isize) as usize;
    x.min(2 * n - 1 - x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn noise(w: usize, h: usize, seed: usize) -> Plane {
        Plane::from_fn(w, h, |x, y| ((x * 7919 + y * 104_729 + seed * 31) % 97) as f32 / 96.0)
    }

    fn mean(plane: &Plane) -> f64 {
        plane.values.iter().map(|v| f64::from(*v)).sum::<f64>() / plane.values.len() as f64
    }

    proptest! {
        #[test]
        fn shrinking_keeps_the_mean_and_growing_the_range(w in 1usize..40, h in 1usize..40, tw in 1usize..60, th in 1usize..60) {
            let plane = noise(w, h, tw);
            let to = plane.resized(tw, th);
            prop_assert_eq!((to.width(), to.height()), (tw, th));
            prop_assert!(to.values.iter().all(|v| (0.0..=1.0).contains(v)));
            if tw <= w && th <= h {
                prop_assert!((mean(&to) - mean(&plane)).abs() < 1e-5);
            }
            prop_assert!(Plane::filled(w, h, 0.3).resized(tw, th).values.iter().all(|v| (v - 0.3).abs() < 1e-6));
        }

        #[test]
        fn blurring_keeps_the_mean(w in 1usize..40, h in 1usize..40, sigma in 0.0f32..60.0) {
            let plane = noise(w, h, 1);
            let blurred = plane.blurred(sigma);
            prop_assert!((mean(&plane) - mean(&blurred)).abs() < 1e-4, "{} {}", mean(&plane), mean(&blurred));
        }
    }

    #[test]
    fn a_ramp_grows_into_a_ramp() {
        let ramp = Plane::from_fn(10, 4, |x, _| x as f32);
        let grown = ramp.resized(30, 4);
        for x in 6..24 {
            assert!((grown.at(x, 2) - ((x as f32 + 0.5) / 3.0 - 0.5)).abs() < 1e-4);
        }
    }

    #[test]
    fn a_blurred_point_is_a_bell_of_that_width() {
        for sigma in [0.7f32, 3.0, 12.0, 12.5, 20.0] {
            let n = 2 * (5.0 * sigma) as usize + 3;
            let mut point = Plane::filled(n, n, 0.0);
            point.values[n * n / 2] = 1.0;
            let bell = point.blurred(sigma);
            let c = (n / 2) as f64;
            let moment: f64 =
                bell.values.iter().enumerate().map(|(i, v)| ((i % n) as f64 - c).powi(2) * f64::from(*v)).sum();
            assert!((moment.sqrt() / f64::from(sigma) - 1.0).abs() < 0.02, "{sigma}: {}", moment.sqrt());
            let peak = 1.0 / (2.0 * std::f32::consts::PI * sigma * sigma);
            assert!((bell.at(n / 2, n / 2) / peak - 1.0).abs() < 0.1);
        }
    }

    #[test]
    fn slopes_of_a_tilted_plane() {
        let (right, down) = Plane::from_fn(6, 5, |x, y| 2.0 * x as f32 - 3.0 * y as f32).gradient();
        assert_eq!((right.at(2, 2), down.at(2, 2)), (2.0, -3.0));
        let (right, _) = Plane::filled(1, 1, 0.5).gradient();
        assert_eq!(right.values, [0.0]);
        let (right, _) = Plane::default().gradient();
        assert!(right.values.is_empty() && Plane::default().blurred(3.0).values.is_empty());
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let plane = noise(300, 200, 5);
        let at = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| (plane.blurred(2.0), plane.blurred(20.0), plane.resized(77, 401), plane.gradient()))
        };
        let (one, two) = (at(1), at(2));
        assert!(one.0 == two.0);
        assert!(one.1 == two.1);
        assert!(one.2 == two.2);
        assert!(one.3 == two.3);
    }
}
