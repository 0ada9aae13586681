//! How alike two pictures are.
//!
//! [`ssim`] is the structural similarity of Wang, Bovik, Sheikh and Simoncelli (2004), doi:10.1109/TIP.2003.819861, with the
//! paper's window (a Gaussian of sigma 1.5 px, 11 x 11 px) and constants (`K1` 0.01, `K2` 0.03, range 1).
use rayon::prelude::*;

use crate::picture::{Picture, Plane};

/// Half of SSIM's window, px.
const RADIUS: usize = 5;
/// Standard deviation of SSIM's window, px.
const SIGMA_PX: f32 = 1.5;
const C1: f32 = 0.01 * 0.01;
const C2: f32 = 0.03 * 0.03;

/// Reported in place of the infinite ratio of equal pictures, dB.
pub const PSNR_MAX_DB: f64 = 100.0;

/// How alike two pictures are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Likeness {
    /// Structural similarity of the sRGB-encoded luma, at most 1.
    pub ssim: f64,
    /// Peak signal-to-noise ratio, dB, of the sRGB-encoded red, green and blue together, at most [`PSNR_MAX_DB`].
    pub psnr_db: f64,
}

/// The sum of `f(row)` over the rows, the same at any number of threads.
fn sum_rows(rows: std::ops::Range<usize>, f: impl Fn(usize) -> f64 + Send + Sync) -> f64 {
    rows.into_par_iter().map(f).collect::<Vec<_>>().iter().sum()
}

/// Mean squared difference; `None` when the sizes differ or there is nothing.
fn mean_square(a: &Plane, b: &Plane) -> Option<f64> {
    let (w, h) = (a.width(), a.height());
    if (w, h) != (b.width(), b.height()) || w * h == 0 {
        return None;
    }
    let sum = sum_rows(0..h, |y| {
        let rows = a.values[y * w..(y + 1) * w].iter().zip(&b.values[y * w..(y + 1) * w]);
        rows.map(|(a, b)| f64::from(a - b).powi(2)).sum()
    });
    Some(sum / (w * h) as f64)
}

fn decibels(mean_square: f64) -> f64 {
    (-10.0 * mean_square.log10()).min(PSNR_MAX_DB)
}

/// Peak signal-to-noise ratio, dB, of planes whose range is 1: `-10 lg(mean((a - b)^2))`, at most [`PSNR_MAX_DB`]. `None` when
/// the sizes differ or there are no pixels.
pub fn psnr(a: &Plane, b: &Plane) -> Option<f64> {
    mean_square(a, b).map(decibels)
}

/// Mean structural similarity of planes whose range is 1; 1 is equal. As in the authors' program, the mean leaves out a border
/// of half a window, except in pictures too small to have more than that. `None` when the sizes differ or there are no pixels.
pub fn ssim(a: &Plane, b: &Plane) -> Option<f64> {
    let (w, h) = (a.width(), a.height());
    if (w, h) != (b.width(), b.height()) || w * h == 0 {
        return None;
    }
    let bell: Vec<f32> = (0..=RADIUS).map(|k| (-0.5 * (k as f32 / SIGMA_PX).powi(2)).exp()).collect();
    let sum = bell[0] + 2.0 * bell[1..].iter().sum::<f32>();
    let bell: Vec<f32> = bell.iter().map(|v| v / sum).collect();
    let product = |a: &Plane, b: &Plane| {
        let values = a.values.par_iter().zip(&b.values).map(|(a, b)| a * b).collect();
        Plane::from_values(w, h, values).unwrap_or_default()
    };
    let (mean_a, mean_b) = (a.convolved(&bell), b.convolved(&bell));
    let [aa, bb, ab] = [(a, a), (b, b), (a, b)].map(|(a, b)| product(a, b).convolved(&bell));
    let border = if w.min(h) > 2 * RADIUS { RADIUS } else { 0 };
    let total = sum_rows(border..h - border, |y| {
        let pixels = y * w + border..(y + 1) * w - border;
        pixels
            .map(|i| {
                let (ma, mb) = (mean_a.values[i], mean_b.values[i]);
                let (va, vb, cov) = (aa.values[i] - ma * ma, bb.values[i] - mb * mb, ab.values[i] - ma * mb);
                let light = (2.0 * ma * mb + C1) / (ma * ma + mb * mb + C1);
                f64::from(light * (2.0 * cov + C2) / (va + vb + C2))
            })
            .sum()
    });
    Some(total / ((w - 2 * border) * (h - 2 * border)) as f64)
}

/// How alike two pictures of the same size are to an eye that doesn't see single lines or dots: both are blurred in linear
/// light by a Gaussian of `sigma_px`, px, and then encoded as sRGB. PSNR takes the mean squared difference over all pixels
/// and the three channels; SSIM is that of the luma `0.2126 R' + 0.7152 G' + 0.0722 B'` of the encoded values.
///
/// `None` when the sizes differ or there are no pixels.
pub fn likeness(a: &Picture, b: &Picture, sigma_px: f32) -> Option<Likeness> {
    let [a, b] = [a, b].map(|p| encoded(&p.blurred(sigma_px)));
    let mut square = 0.0;
    for channel in 0..3 {
        square += mean_square(&a.channel(channel), &b.channel(channel))? / 3.0;
    }
    // The luminance of a picture whose values are sRGB-encoded is its luma.
    Some(Likeness { ssim: ssim(&a.luminance(), &b.luminance())?, psnr_db: decibels(square) })
}

/// The picture with sRGB-encoded values in place of linear light.
fn encoded(picture: &Picture) -> Picture {
    let pixels = picture.pixels.par_iter().map(|p| p.map(srgb_encoded)).collect();
    Picture::from_pixels(picture.width(), picture.height(), pixels).unwrap_or_default()
}

/// The sRGB value, 0..=1, of a linear light.
pub(super) fn srgb_encoded(light: f32) -> f32 {
    let l = light.clamp(0.0, 1.0);
    if l <= 0.003_130_8 { 12.92 * l } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waves(w: usize, h: usize) -> Plane {
        Plane::from_fn(w, h, |x, y| 0.5 + 0.3 * (x as f32 * 0.37).sin() * (y as f32 * 0.23).cos())
    }

    fn shifted(plane: &Plane, by: f32) -> Plane {
        Plane::from_values(plane.width(), plane.height(), plane.values.iter().map(|v| v + by).collect()).unwrap()
    }

    #[test]
    fn a_picture_is_like_itself_and_a_constant_error_has_its_ratio() {
        let a = waves(50, 40);
        assert!((ssim(&a, &a).unwrap() - 1.0).abs() < 1e-6);
        assert_eq!(psnr(&a, &a), Some(PSNR_MAX_DB));
        assert!((psnr(&a, &shifted(&a, 0.1)).unwrap() - 20.0).abs() < 1e-4);
        assert_eq!((psnr(&a, &waves(40, 50)), ssim(&Plane::default(), &Plane::default())), (None, None));
        for side in [1, 7] {
            let one = Plane::filled(side, side, 0.0);
            assert!((ssim(&one, &one).unwrap() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn ssim_of_constants_is_the_formulas() {
        let (a, b) = (Plane::filled(30, 30, 0.2), Plane::filled(30, 30, 0.6));
        let formula = (2.0 * 0.2 * 0.6 + 1e-4) / (0.04 + 0.36 + 1e-4);
        assert!((ssim(&a, &b).unwrap() - formula).abs() < 1e-4);
    }

    #[test]
    fn ssim_is_that_of_its_definition_summed_pixel_by_pixel() {
        let (w, h) = (24, 19);
        let a = waves(w, h);
        let b = Plane::from_fn(w, h, |x, y| 0.4 + 0.5 * (((x * 31 + y * 17) % 13) as f32 / 13.0 - 0.5));
        let bell = |k: i32| (-0.5 * (f64::from(k) / 1.5).powi(2)).exp();
        let norm: f64 = (-5..=5).map(bell).sum::<f64>().powi(2);
        let mut total = 0.0;
        for y in 5..h - 5 {
            for x in 5..w - 5 {
                let mean = |f: &dyn Fn(f64, f64) -> f64| {
                    let mut sum = 0.0;
                    for (dy, dx) in (-5..=5).flat_map(|dy| (-5..=5).map(move |dx| (dy, dx))) {
                        let (x, y) = ((x as i32 + dx) as usize, (y as i32 + dy) as usize);
                        sum += bell(dx) * bell(dy) / norm * f(f64::from(a.at(x, y)), f64::from(b.at(x, y)));
                    }
                    sum
                };
                let (ma, mb) = (mean(&|a, _| a), mean(&|_, b| b));
                let (va, vb) = (mean(&|a, _| (a - ma).powi(2)), mean(&|_, b| (b - mb).powi(2)));
                let cov = mean(&|a, b| (a - ma) * (b - mb));
                total += (2.0 * ma * mb + 1e-4) * (2.0 * cov + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
            }
        }
        assert!((ssim(&a, &b).unwrap() - total / ((w - 10) * (h - 10)) as f64).abs() < 1e-4);
    }

    #[test]
    fn dots_become_like_their_tone_when_blurred() {
        let dots: Vec<[f32; 3]> =
            (0..64 * 64).map(|i| if (i + i / 64) % 2 == 0 { [1.0; 3] } else { [0.0; 3] }).collect();
        let dots = Picture::from_pixels(64, 64, dots).unwrap();
        let grey = Picture::from_pixels(64, 64, vec![[0.5; 3]; 64 * 64]).unwrap();
        let (near, far) = (likeness(&dots, &grey, 0.0).unwrap(), likeness(&dots, &grey, 4.0).unwrap());
        assert!(near.psnr_db < 8.0 && near.ssim < 0.1, "{near:?}");
        assert!(far.psnr_db > 60.0 && far.ssim > 0.999, "{far:?}");
        assert_eq!(likeness(&grey, &grey, 2.0).unwrap().psnr_db, PSNR_MAX_DB);
    }
}
