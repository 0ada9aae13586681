//! Separation into cyan, magenta, yellow and black inks of whatever colours they really have.
//!
//! Coverages are solved for so that by the model of [`mixed`](crate::picture::mixed) they give back the picture: per colour a
//! least-squares problem in Oklab, on a lattice of colours that is then interpolated. Three inks fix a colour; how much of
//! the grey in it is left to the fourth, black, is the grey-component replacement.
use crate::math::{PAPER, Rgb};
use crate::picture::color::{Oklab, oklab_from_linear};
use crate::picture::cube::Cube;
use crate::picture::separate::absorption;
use crate::picture::{Ink, Picture, Tone};

/// Nodes of the lattice along each channel: with more, the colours mixed back come no nearer.
const SIDE: usize = 25;

/// How much a coverage of black away from the desired one weighs against a distance in Oklab: 0.1 of black against 0.004,
/// which isn't seen.
const BLACK_WEIGHT: f32 = 0.04;

/// From this share of grey on, black takes over more and more of it whatever the replacement, so that black is black.
const DEEP: f32 = 0.85;

/// How a picture is separated.
#[derive(Clone, Debug, PartialEq)]
pub struct CmykOptions {
    /// Grey-component replacement: the share of the grey in a colour that is drawn in black, 0 (cyan, magenta and yellow make
    /// all of it, except in the deepest shadows) to 1 (black makes all of it).
    pub gcr: f64,
    /// Cyan, magenta, yellow and black.
    pub inks: [Ink; 4],
    /// The paper, which shows where the picture is white.
    pub paper: Rgb,
}

impl Default for CmykOptions {
    /// The usual colours of printers' inks, with half of the grey in black.
    fn default() -> Self {
        let ink = |name: &str, color| Ink { name: name.into(), color: Rgb(color) };
        Self {
            gcr: 0.5,
            inks: [
                ink("cyan", [0, 158, 224]),
                ink("magenta", [226, 0, 122]),
                ink("yellow", [255, 236, 0]),
                ink("black", [29, 29, 27]),
            ],
            paper: PAPER,
        }
    }
}

/// Separates a picture into the tones of four inks, in their order.
///
/// The picture's white is the paper and its black the black ink (black-point compensation: light `v` is asked for as
/// `b + (1 - b) v`, `b` being what black lets through), lest every shadow be drawn in all four inks. What the inks can't
/// reach becomes the nearest colour that they can.
pub fn cmyk(picture: &Picture, options: &CmykOptions) -> Vec<Tone> {
    let press =
        Press { takes: options.inks.each_ref().map(|ink| absorption(ink, options.paper)), gcr: options.gcr as f32 };
    let cube = Cube::new(SIDE, 4, |color, values| values.copy_from_slice(&press.coverages(color)));
    let tones = options.inks.iter().zip(cube.planes(picture));
    tones.map(|(ink, coverage)| Tone { ink: ink.clone(), coverage }).collect()
}

/// The inks as numbers.
struct Press {
    /// Light that each ink takes from each channel.
    takes: [[f32; 3]; 4],
    gcr: f32,
}

/// The difference from what is desired: three of Oklab, one of black.
type Residual = [f32; 4];

impl Press {
    fn light(&self, cover: [f32; 4]) -> [f32; 3] {
        [0, 1, 2].map(|k| (0..4).map(|i| 1.0 - cover[i] * self.takes[i][k]).product())
    }

    fn residual(&self, cover: [f32; 4], target: Oklab, black: f32) -> Residual {
        // A floor keeps the slope of the cube root finite where an ink lets nothing through.
        let lab = oklab_from_linear(self.light(cover).map(|v| v.max(1e-5)));
        [lab[0] - target[0], lab[1] - target[1], lab[2] - target[2], BLACK_WEIGHT * (cover[3] - black)]
    }

    /// The coverages, 0..=1, that come nearest to a colour: Levenberg and Marquardt's steps, inks at a bound held there while
    /// they would leave it.
    fn coverages(&self, color: [f32; 3]) -> [f32; 4] {
        let color = [0, 1, 2].map(|k| 1.0 - self.takes[3][k] * (1.0 - color[k]));
        let target = oklab_from_linear(color.map(|v| v.max(1e-5)));
        // The most black that leaves no channel too dark.
        let room = |k: usize| (1.0 - color[k]) / self.takes[3][k].max(1e-3);
        let most = room(0).min(room(1)).min(room(2)).clamp(0.0, 1.0);
        let deep = ((most - DEEP) / (1.0 - DEEP)).max(0.0);
        let share = self.gcr.clamp(0.0, 1.0);
        let black = most * (share + (1.0 - share) * deep * deep * (3.0 - 2.0 * deep));
        let mut cover = [0.0, 0.0, 0.0, black];
        for k in 0..3 {
            let rest = color[k] / (1.0 - black * self.takes[3][k]).max(1e-3);
            cover[k] = ((1.0 - rest) / self.takes[k][k].max(1e-3)).clamp(0.0, 1.0);
        }
        let square = |r: &Residual| r.iter().map(|v| v * v).sum::<f32>();
        let mut residual = self.residual(cover, target, black);
        let mut damping = 1e-3;
        for _ in 0..30 {
            let slopes = self.slopes(cover, target, black, &residual);
            let gradient = slopes.map(|s| (0..4).map(|k| s[k] * residual[k]).sum::<f32>());
            let free = [0, 1, 2, 3]
                .map(|i| !((cover[i] <= 0.0 && gradient[i] >= 0.0) || (cover[i] >= 1.0 && gradient[i] <= 0.0)));
            let step = solve(&slopes, &gradient, free, damping);
            let next = [0, 1, 2, 3].map(|i| (cover[i] + step[i]).clamp(0.0, 1.0));
            let moved: f32 = (0..4).map(|i| (next[i] - cover[i]).abs()).sum();
            let new = self.residual(next, target, black);
            if square(&new) < square(&residual) {
                (cover, residual, damping) = (next, new, (damping * 0.2).max(1e-7));
                if moved < 1e-4 {
                    break;
                }
            } else if moved < 1e-5 || damping > 1e3 {
                break;
            } else {
                damping *= 8.0;
            }
        }
        cover
    }

    /// By how much each ink's coverage changes each residual.
    fn slopes(&self, cover: [f32; 4], target: Oklab, black: f32, at: &Residual) -> [Residual; 4] {
        [0, 1, 2, 3].map(|i| {
            // Towards the inside, so that the difference never leaves 0..=1.
            let h = if cover[i] > 0.5 { -1e-3 } else { 1e-3 };
            let mut beside = cover;
            beside[i] += h;
            let there = self.residual(beside, target, black);
            [0, 1, 2, 3].map(|k| (there[k] - at[k]) / h)
        })
    }
}

/// The step `-(J^T J + damping D)^-1 J^T r` among the free inks, 0 for the others.
fn solve(slopes: &[Residual; 4], gradient: &[f32; 4], free: [bool; 4], damping: f32) -> [f32; 4] {
    let mut a = [[0.0f64; 5]; 4];
    for i in 0..4 {
        for j in 0..4 {
            let dot: f64 = (0..4).map(|k| f64::from(slopes[i][k]) * f64::from(slopes[j][k])).sum();
            a[i][j] = if free[i] && free[j] { dot } else { 0.0 };
        }
        a[i][i] = if free[i] { a[i][i] * (1.0 + f64::from(damping)) + 1e-9 } else { 1.0 };
        a[i][4] = if free[i] { -f64::from(gradient[i]) } else { 0.0 };
    }
    // The matrix is positive definite: no pivoting.
    for i in 0..4 {
        for j in i + 1..4 {
            let f = a[j][i] / a[i][i];
            let row = a[i];
            a[j].iter_mut().zip(row).for_each(|(v, r)| *v -= f * r);
        }
    }
    let mut x = [0.0; 4];
    for i in (0..4).rev() {
        x[i] = (a[i][4] - (i + 1..4).map(|j| a[i][j] * x[j]).sum::<f64>()) / a[i][i];
    }
    x.map(|v| v as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::stream;
    use crate::picture::{ciede2000, cielab_from_linear, mixed};
    use rand::RngExt;

    const WHITE: Rgb = Rgb([255; 3]);

    fn options(gcr: f64) -> CmykOptions {
        CmykOptions { gcr, paper: WHITE, ..CmykOptions::default() }
    }

    /// Pictures whose colours the inks can make, and what they are when black ink is their black.
    fn reachable(count: usize) -> (Picture, Picture) {
        let press = Press { takes: options(0.0).inks.each_ref().map(|ink| absorption(ink, WHITE)), gcr: 0.0 };
        let mut random = stream(1, "cmyk", 0);
        let colors = std::iter::repeat_with(|| press.light([0; 4].map(|_| random.random_range(0.0..0.9))));
        let above = colors.map(|c| (c, [0, 1, 2].map(|k| 1.0 - (1.0 - c[k]) / press.takes[3][k])));
        let (made, asked) = above.filter(|(_, asked)| asked.iter().all(|v| *v >= 0.0)).take(count).unzip();
        (Picture::from_pixels(count, 1, asked).unwrap(), Picture::from_pixels(count, 1, made).unwrap())
    }

    fn differences(a: &Picture, b: &Picture) -> Vec<f64> {
        let lab = |p: &[f32; 3]| cielab_from_linear(p.map(f64::from));
        a.pixels.iter().zip(&b.pixels).map(|(a, b)| ciede2000(lab(a), lab(b))).collect()
    }

    #[test]
    fn tones_mixed_again_give_back_the_picture() {
        let (asked, made) = reachable(3000);
        for gcr in [0.0, 0.5, 1.0] {
            let tones = cmyk(&asked, &options(gcr));
            assert!(tones.iter().all(|t| t.coverage.values.iter().all(|v| (0.0..=1.0).contains(v))));
            let mut off = differences(&made, &mixed(&tones, WHITE));
            off.sort_by(f64::total_cmp);
            let mean = off.iter().sum::<f64>() / off.len() as f64;
            assert!(mean < 0.5, "gcr {gcr}: mean difference {mean}");
            assert!(off[off.len() * 99 / 100] < 3.0, "gcr {gcr}: 99 % below {}", off[off.len() * 99 / 100]);
        }
    }

    #[test]
    fn grey_moves_from_three_inks_to_black() {
        let grey = Picture::from_pixels(1, 1, vec![[0.4; 3]]).unwrap();
        let at = |gcr| cmyk(&grey, &options(gcr)).iter().map(|t| t.coverage.values[0]).collect::<Vec<_>>();
        let (none, half, all) = (at(0.0), at(0.5), at(1.0));
        assert!(none[3] < 0.01 && none[..3].iter().all(|v| *v > 0.3), "{none:?}");
        assert!(half[3] > 0.2 && half[3] < 0.4, "{half:?}");
        assert!(all[3] > 0.55 && all[..3].iter().all(|v| *v < 0.05), "{all:?}");
    }

    #[test]
    fn white_is_bare_black_is_black_and_inks_are_themselves() {
        let inks = options(0.5).inks;
        let mut pixels = vec![[1.0; 3], [0.0; 3]];
        pixels.extend(inks.iter().map(|ink| crate::picture::linear_from_rgb(ink.color)));
        let count = pixels.len();
        let tones = cmyk(&Picture::from_pixels(count, 1, pixels).unwrap(), &options(0.5));
        let at = |pixel: usize| [0, 1, 2, 3].map(|i| tones[i].coverage.values[pixel]);
        assert!(at(0).iter().all(|v| *v < 1e-3), "{:?}", at(0));
        assert!(at(1)[3] > 0.95 && at(1)[..3].iter().all(|v| *v < 0.05), "{:?}", at(1));
        for i in 0..3 {
            let mine = at(2 + i);
            assert!(mine[i] > 0.95 && (0..4).all(|k| k == i || mine[k] < 0.07), "ink {i}: {mine:?}");
        }
        let none = Picture::default();
        assert!(cmyk(&none, &options(0.5)).iter().all(|t| t.coverage.values.is_empty()));
    }

    #[test]
    fn neighbouring_colours_have_neighbouring_tones() {
        let ramp: Vec<[f32; 3]> = (0..=400).map(|i| [i as f32 / 400.0, 0.3, 1.0 - i as f32 / 400.0]).collect();
        let tones = cmyk(&Picture::from_pixels(401, 1, ramp).unwrap(), &CmykOptions::default());
        for tone in tones {
            let step = tone.coverage.values.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
            assert!(step < 0.1, "{} jumps by {step}", tone.ink.name);
        }
    }
}
