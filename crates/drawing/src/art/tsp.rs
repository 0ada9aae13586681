//! TSP art: each ink is one line that visits stippled points on a short tour.
//!
//! The picture's inks are stippled and joined as in section IV.C of the dissertation that Calamus reproduces. The points
//! stand as densely as a line of the pen's real width needs to cover the desired share of the paper: their density goes
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
    /// Desired number of points over all inks, each ink having its share; `None` for as many as the tone needs.
    pub points: Option<usize>,
    /// How long to shorten the tour of each ink.
    pub effort: Effort,
    /// Whether each line returns to its start.
    pub closed: bool,
    /// Factor on the desired coverage.
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
/// An ink that nothing is desired of has a layer without strokes. Where a number of points is desired, the drawing is lighter
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::art::{DotOptions, dot_art};
    use crate::math::Rgb;
    use crate::picture::{Ink, Plane};

    const SHEET: Sheet = Sheet { width: 0.12, height: 0.08 };
    const WIDTH: f64 = 1e-3;

    fn tone(name: &str, coverage: Plane) -> (Tone, f64) {
        (Tone { ink: Ink { name: name.into(), color: Rgb([0, 0, 0]) }, coverage }, WIDTH)
    }

    /// Steps of grey from left to right: 0.15, 0.3, ... 0.9.
    fn steps() -> Plane {
        Plane::from_fn(120, 80, |x, _| 0.15 * (1 + x / 20) as f32)
    }

    /// Share of each sixth of the sheet that strokes of the line width cover, off the edges of the sixth.
    fn covered(artwork: &Artwork) -> Vec<f64> {
        const PX: f64 = 1.0 / 6.0 * 1e-3;
        let (columns, rows) = (720usize, 480usize);
        let mut ink = vec![false; columns * rows];
        for stroke in &artwork.drawing.layers[0].strokes {
            let place = |p: &Point2<f64>| ((p.x + 0.06) / PX, (0.04 - p.y) / PX);
            let radius = 0.5 * WIDTH / PX;
            for i in 0..stroke.points.len().max(2) - 1 {
                let (a, b) = (place(&stroke.points[i]), place(&stroke.points[(i + 1).min(stroke.points.len() - 1)]));
                let (dx, dy) = (b.0 - a.0, b.1 - a.1);
                let span = |a: f64, b: f64, n: usize| {
                    (a.min(b) - radius).max(0.0) as usize..((a.max(b) + radius + 1.0) as usize).min(n)
                };
                for y in span(a.1, b.1, rows) {
                    for x in span(a.0, b.0, columns) {
                        let (u, v) = (x as f64 + 0.5 - a.0, y as f64 + 0.5 - a.1);
                        let t = ((u * dx + v * dy) / (dx * dx + dy * dy).max(1e-12)).clamp(0.0, 1.0);
                        ink[y * columns + x] |= (u - t * dx).hypot(v - t * dy) <= radius;
                    }
                }
            }
        }
        let share = |band: usize| {
            let cells = (20..rows - 20).flat_map(|y| (120 * band + 20..120 * band + 100).map(move |x| y * columns + x));
            cells.filter(|c| ink[*c]).count() as f64 / (80 * (rows - 40)) as f64
        };
        (0..6).map(share).collect()
    }

    #[test]
    fn the_drawn_tone_is_the_desired_tone() {
        let tones = [tone("black", steps())];
        let line = tsp_art(&tones, SHEET, &TspOptions::default(), 1).unwrap();
        let dots = dot_art(&tones, SHEET, &DotOptions::default(), 1).unwrap();
        for artwork in [line, dots] {
            for (band, f) in covered(&artwork).into_iter().enumerate() {
                let desired = 0.15 * (1 + band) as f64;
                assert!((f - desired).abs() < 0.035, "step {band}: {f} instead of {desired}");
            }
        }
    }

    #[test]
    fn each_ink_is_one_line_through_its_share_of_the_points() {
        let half = Plane::from_fn(60, 40, |x, _| if x < 30 { 0.5 } else { 0.0 });
        let tones =
            [tone("cyan", half), tone("none", Plane::filled(60, 40, 0.0)), tone("black", Plane::filled(60, 40, 1.0))];
        for closed in [true, false] {
            let options = TspOptions { points: Some(500), closed, ..TspOptions::default() };
            let artwork = tsp_art(&tones, SHEET, &options, 1).unwrap();
            let layers = &artwork.drawing.layers;
            assert_eq!(layers.iter().map(|l| l.strokes.len()).collect::<Vec<_>>(), [1, 0, 1]);
            assert_eq!(artwork.drawing.point_count(), if closed { 502 } else { 500 });
            let cyan = &layers[0].strokes[0].points;
            assert_eq!(cyan[0] == cyan[cyan.len() - 1], closed);
            assert!(cyan.iter().all(|p| p.x > -0.06 && p.x < 0.0 && p.y.abs() < 0.04));
            assert!(artwork.notes.iter().any(|n| n.starts_with("black: ")), "{:?}", artwork.notes);
        }
    }

    #[test]
    fn any_number_of_threads_gives_the_same_drawing() {
        let tones = [tone("black", steps())];
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| tsp_art(&tones, SHEET, &TspOptions::default(), 5).unwrap().drawing)
        };
        assert_eq!(run(1), run(2));
    }

    #[test]
    fn tiny_pictures_are_drawn_or_refused() {
        let with = |points| TspOptions { points: Some(points), ..TspOptions::default() };
        let pixel = [tone("black", Plane::filled(1, 1, 1.0))];
        for n in 1..6 {
            let drawing = tsp_art(&pixel, SHEET, &with(n), 1).unwrap().drawing;
            assert_eq!(drawing.point_count(), if n > 2 { n + 1 } else { n });
        }
        let faint = [tone("black", Plane::filled(1, 1, 0.03))];
        let tiny = Sheet { width: 1e-3, height: 1e-3 };
        assert!(tsp_art(&faint, tiny, &TspOptions::default(), 1).unwrap_err().to_string().contains("less than one"));
        let bad = TspOptions { effort: Effort::Kicks(-1.0), ..TspOptions::default() };
        assert!(tsp_art(&pixel, SHEET, &bad, 1).unwrap_err().to_string().starts_with("effort = -1"));
        let black = dot_art(&pixel, SHEET, &DotOptions::default(), 1).unwrap().drawing;
        assert!(black.stroke_count() > 9000 && black.layers[0].strokes.iter().all(|s| s.points.len() == 1));
    }
}
