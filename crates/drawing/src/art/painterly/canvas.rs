//! The working canvas: light on paper under transparent inks, and how far it is from the desired picture.
use rayon::prelude::*;

use crate::art::wash::{Wash, washed};
use crate::math::{PAPER, Rgb, linear_from_srgb};
use crate::picture::{Oklab, Picture, oklab_difference2, oklab_from_linear};

/// A difference of hue disturbs more than [`oklab_difference2`] says, because a palette of few inks can match lightness by
/// mixing but not hue: `a` and `b` are stretched by this before they are compared.
const CHROMA: f32 = 1.5;

/// The darkest linear light of an ink that covers all of the paper, so that an absorbance stays finite.
const DARKEST: f64 = 1e-4;

/// The wash of an ink: `ink / paper` in linear light, at most 1. Inks are transparent: their absorbances add, so one over
/// another multiplies.
pub(super) fn wash(ink: Rgb) -> Wash {
    std::array::from_fn(|k| {
        let (ink, paper) = (linear_from_srgb(ink.0[k]).max(DARKEST), linear_from_srgb(PAPER.0[k]));
        (ink / paper).min(1.0) as f32
    })
}

/// Oklab of linear light, with `a` and `b` stretched by [`CHROMA`].
pub(super) fn perceived(light: [f32; 3]) -> Oklab {
    let [l, a, b] = oklab_from_linear(light);
    [l, CHROMA * a, CHROMA * b]
}

/// The canvas `C` and the desired picture `I` of equation 4.1.
#[derive(Clone)]
pub(super) struct Canvas {
    pub width: usize,
    pub height: usize,
    /// Linear light of each pixel.
    pub light: Vec<[f32; 3]>,
    /// What each pixel is desired to look like.
    target: Vec<Oklab>,
    /// `|I - C|^2` of each pixel.
    error: Vec<f32>,
    washes: Vec<Wash>,
    /// What a full coverage of an ink is worth: pixel by pixel, the inks beside each other.
    worths: Vec<f32>,
    /// How much what another ink would do better counts against an ink.
    regret: f32,
}

impl Canvas {
    /// Bare paper, of which this picture is desired, and inks to draw it with.
    pub fn new(picture: &Picture, washes: Vec<Wash>, regret: f32) -> Self {
        let paper = PAPER.0.map(|v| linear_from_srgb(v) as f32);
        // Nothing is lighter than paper: what asks for more is served by the paper.
        let desired = |p: &[f32; 3]| perceived(std::array::from_fn(|k| p[k].clamp(0.0, paper[k])));
        let target: Vec<_> = picture.pixels.par_iter().map(desired).collect();
        let light = vec![paper; target.len()];
        let error = light.iter().zip(&target).map(|(l, t)| oklab_difference2(perceived(*l), *t)).collect();
        let mut worths = vec![0.0; light.len() * washes.len()];
        let inks = washes.len().max(1);
        let (width, height) = (picture.width(), picture.height());
        let mut canvas = Self { width, height, light, target, error, washes, worths: Vec::new(), regret };
        worths.par_chunks_mut(inks).enumerate().for_each(|(at, worths)| canvas.weigh(at, worths));
        canvas.worths = worths;
        canvas
    }

    /// `||I - C||^2`, as the mean over all pixels.
    pub fn difference(&self) -> f64 {
        self.error.iter().map(|e| f64::from(*e)).sum::<f64>() / self.error.len().max(1) as f64
    }

    /// What it is worth to cover all of a pixel with an ink: the fall of `|I - C|^2`, less what the best of all inks, or bare
    /// paper, would do better there, times the regret.
    pub fn worth(&self, at: usize, ink: usize) -> f32 {
        self.worths[at * self.washes.len() + ink]
    }

    /// By how much `||I - C||^2` falls when an ink covers these shares of these pixels; summed in f64 in their order.
    pub fn exact_gain(&self, mask: impl Iterator<Item = (usize, f32)>, ink: usize) -> f64 {
        let change = |(at, coverage)| {
            let after = perceived(washed(self.light[at], self.washes[ink], coverage));
            f64::from(self.error[at] - oklab_difference2(after, self.target[at]))
        };
        mask.map(change).sum()
    }

    /// Lays an ink over these shares of these pixels.
    pub fn paint(&mut self, mask: impl Iterator<Item = (usize, f32)>, ink: usize) {
        let inks = self.washes.len();
        let mut worths = std::mem::take(&mut self.worths);
        for (at, coverage) in mask {
            self.light[at] = washed(self.light[at], self.washes[ink], coverage);
            self.error[at] = oklab_difference2(perceived(self.light[at]), self.target[at]);
            self.weigh(at, &mut worths[at * inks..(at + 1) * inks]);
        }
        self.worths = worths;
    }

    /// The canvas as a picture.
    pub fn picture(&self) -> Picture {
        Picture::from_pixels(self.width, self.height, self.light.clone()).unwrap_or_default()
    }

    /// Computes the worth of a pixel in each ink.
    fn weigh(&self, at: usize, worths: &mut [f32]) {
        let mut best = 0f32;
        for (worth, wash) in worths.iter_mut().zip(&self.washes) {
            *worth = self.error[at] - oklab_difference2(perceived(washed(self.light[at], *wash, 1.0)), self.target[at]);
            best = best.max(*worth);
        }
        worths.iter_mut().for_each(|worth| *worth -= self.regret * (best - *worth));
    }
}
