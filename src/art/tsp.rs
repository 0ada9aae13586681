//! TSP art: each ink is one line that visits stippled points on a short tour.
//!
//! The picture's inks are stippled and joined as in section IV.C of the dissertation that Calamus reproduces. The points
//! stand as densely as a line of the pen's real width needs to cover the wished share of the paper: their density goes
//! with the square of the tone, because the length of a tour through `n` points of an area `A` goes with `sqrt(n A)`.
use nalgebra::Point2;
use rand_chacha::rand_core::Rng;

use super::screen::{Mark, Screen};
use super::{ArtError, Artwork, Sheet};
use crate::drawing::{Drawing, InkLayer, Stroke};
use crate::math::stream;
use crate::picture::Tone;
use crate::tour::{self, Effort, TourOptions};

/// How a picture becomes tours.
#[derive(Clone, Debug, PartialEq)]
pub struct TspOptions {
    /// Wished number of points over all inks, each ink having its share; `None` for as many as the tone needs.
    pub points: Option<usize>,
    /// How long to shorten the tour of each ink.
    pub effort: Effort,
    /// Whether each line returns to its start.
    pub closed: bool,
    /// Factor on the wished coverage.
    pub gain: f64,
    /// Coverage up to which paper stays white, 0..1.
    pub white: f64,
}

impl Default for TspOptions {
    fn default() -> Self {
        Self { points: None, effort: Effort::Kicks(0.2), closed: true, gain: 1.0, white: 0.02 }
    }
}

/// Draws each tone as one line, whose width in m stands beside it.
///
/// An ink that nothing is wished of has a layer without strokes. Where a number of points is wished, the drawing is lighter
/// or darker than the picture; notes say by how much, and which line width would fit.
///
/// # Errors
/// [`ArtError::NothingToDraw`] of a white picture, [`ArtError::BadOption`] of a size, width or number that makes no sense
/// or of more points than can be placed.
pub fn tsp_art(tones: &[(Tone, f64)], sheet: Sheet, options: &TspOptions, seed: u64) -> Result<Artwork, ArtError> {
    let screen = Screen { mark: Mark::Line, points: options.points, gain: options.gain, white: options.white };
    let screened = screen.points(tones, sheet, seed)?;
    let mut layers = Vec::with_capacity(tones.len());
    for (i, ((tone, width), points)) in tones.iter().zip(screened.inks).enumerate() {
        let seed = stream(seed, "tsp art", i as u64).next_u64();
        let mut line = visited(&points, options.closed, options.effort, seed)?;
        if options.closed && line.len() > 2 {
            line.push(line[0]);
        }
        let strokes = if line.is_empty() { Vec::new() } else { vec![Stroke::new(line)] };
        layers.push(InkLayer { name: tone.ink.name.clone(), color: tone.ink.color, width_hint: Some(*width), strokes });
    }
    let drawing = Drawing::new(sheet.width, sheet.height, layers);
    Ok(Artwork { drawing, plates: Vec::new(), notes: screened.notes })
}

/// The points in the order of a short tour.
pub(super) fn visited(
    points: &[Point2<f64>],
    closed: bool,
    effort: Effort,
    seed: u64,
) -> Result<Vec<Point2<f64>>, ArtError> {
    let options = TourOptions { closed, effort, seed, ..TourOptions::default() };
    let order = tour::solve(points, &options).map_err(|e| {
        let value = if let Effort::Kicks(kicks) = effort { kicks } else { points.len() as f64 };
        ArtError::BadOption { name: "effort", value, message: e.to_string() }
    })?;
    Ok(order.iter().map(|p| points[*p as usize]).collect())
}
