//! Stippled dots as artwork: the pen is pressed once at each.
use rand_chacha::rand_core::Rng;

use super::screen::{Mark, Screen};
use super::tsp::visited;
use super::{ArtError, Artwork, Sheet};
use crate::drawing::{Drawing, InkLayer, Stroke};
use crate::math::stream;
use crate::picture::Tone;
use crate::tour::Effort;

/// How a picture becomes dots.
#[derive(Clone, Debug, PartialEq)]
pub struct DotOptions {
    /// Desired number of dots over all inks, each ink having its share; `None` for as many as the tone needs.
    pub points: Option<usize>,
    /// How long to shorten the way from dot to dot, for each ink.
    pub effort: Effort,
    /// Factor on the desired coverage.
    pub gain: f64,
    /// Coverage up to which paper stays white, 0..1.
    pub white: f64,
}

impl Default for DotOptions {
    fn default() -> Self {
        Self { points: None, effort: Effort::Kicks(0.0), gain: 1.0, white: 0.0 }
    }
}

/// Draws each tone as dots, discs of the line width in m that stands beside it, on a short way from one to the next.
///
/// # Errors
/// [`ArtError::NothingToDraw`] of a white picture, [`ArtError::BadOption`] of a size, width or number that makes no sense
/// or of more dots than can be placed.
pub fn dot_art(tones: &[(Tone, f64)], sheet: Sheet, options: &DotOptions, seed: u64) -> Result<Artwork, ArtError> {
    let screen = Screen { mark: Mark::Dot, points: options.points, gain: options.gain, white: options.white };
    let screened = screen.points(tones, sheet, seed)?;
    let mut layers = Vec::with_capacity(tones.len());
    for (i, ((tone, width), points)) in tones.iter().zip(&screened.inks).enumerate() {
        let way = visited(points, false, options.effort, stream(seed, "dots", i as u64).next_u64())?;
        let strokes = way.into_iter().map(|p| Stroke::new(vec![p])).collect();
        layers.push(InkLayer { name: tone.ink.name.clone(), color: tone.ink.color, width_hint: Some(*width), strokes });
    }
    Ok(Artwork { drawing: Drawing::new(sheet.width, sheet.height, layers), plates: Vec::new(), notes: screened.notes })
}
