//! Tones become points on a sheet, so many that what is drawn through them covers as much paper as was desired.
use nalgebra::Point2;
use rand_chacha::rand_core::Rng;

use super::stipple::{DotCount, MAX_DOTS, StippleOptions, stipple};
use super::{ArtError, Placement, Sheet};
use crate::math::stream;
use crate::picture::{Plane, Tone};

/// What is drawn through the points of an ink.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    /// One line, from point to point.
    Line,
    /// A dot as wide as the line at each.
    Dot,
}

/// Coverage of a tour through stippled points, at `u = w sqrt(rho)` for a line of width `w` and `rho` points per unit of
/// area. Measured on tours of 10,000 points over even grey, drawn at 20 samples a point spacing, border left out. Its first
/// slope is the length constant of such tours: 0.979, the 0.7124 of points at random (Johnson, McGeoch, Rothberg 1996)
/// being shorter because these cluster. What bends it are the tour's corners, where the line covers itself.
const LINE: [(f64, f64); 15] = [
    (0.0, 0.0),
    (0.1, 0.0978),
    (0.2, 0.1944),
    (0.3, 0.2907),
    (0.4, 0.3857),
    (0.5, 0.4804),
    (0.6, 0.5739),
    (0.7, 0.6667),
    (0.8, 0.7590),
    (0.9, 0.8498),
    (0.95, 0.8925),
    (1.0, 0.9299),
    (1.1, 0.9768),
    (1.2, 0.9948),
    (1.4, 1.0),
];

/// Coverage of stippled discs at `u = rho pi w^2 / 4`, measured in the same way: they touch from 0.7 on.
const DOT: [(f64, f64); 13] = [
    (0.0, 0.0),
    (0.5, 0.4994),
    (0.6, 0.5994),
    (0.7, 0.6969),
    (0.8, 0.7846),
    (0.9, 0.8575),
    (1.0, 0.9117),
    (1.1, 0.9511),
    (1.2, 0.9757),
    (1.3, 0.9888),
    (1.5, 0.9983),
    (1.8, 0.9999),
    (2.2, 1.0),
];

/// Coverage that is drawn where full ink is desired: the last gaps cost as many points as a tenth of the tone.
const FULL: f64 = 0.98;

impl Mark {
    fn curve(self) -> &'static [(f64, f64)] {
        match self {
            Self::Line => &LINE,
            Self::Dot => &DOT,
        }
    }

    /// Points per area of a line width squared that give a coverage.
    pub(super) fn density(self, coverage: f64) -> f64 {
        let u = between(self.curve().iter().map(|(u, f)| (*f, *u)), coverage);
        match self {
            Self::Line => u * u,
            Self::Dot => u * 4.0 / std::f64::consts::PI,
        }
    }

    /// Coverage of so many points per area of a line width squared.
    pub(super) fn coverage(self, density: f64) -> f64 {
        let u = match self {
            Self::Line => density.sqrt(),
            Self::Dot => density * std::f64::consts::FRAC_PI_4,
        };
        between(self.curve().iter().copied(), u)
    }
}

/// The value at `x` of the line through these points of rising `x`; at its ends, that of the end.
fn between(points: impl Iterator<Item = (f64, f64)>, x: f64) -> f64 {
    let mut last = (f64::NEG_INFINITY, 0.0);
    for (px, py) in points {
        if x < px {
            return if last.0.is_finite() { last.1 + (py - last.1) * (x - last.0) / (px - last.0) } else { py };
        }
        last = (px, py);
    }
    last.1
}

/// How a picture is turned into points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Screen {
    pub(super) mark: Mark,
    /// Desired number over all inks; `None` for as many as the tone needs.
    pub(super) points: Option<usize>,
    /// Factor on the desired coverage.
    pub(super) gain: f64,
    /// Coverage under which paper stays white.
    pub(super) white: f64,
}

/// The points of each ink, and what a user should know of their tone.
#[derive(Clone, Debug)]
pub(super) struct Screened {
    /// For each tone, points on the sheet, m.
    pub(super) inks: Vec<Vec<Point2<f64>>>,
    pub(super) notes: Vec<String>,
}

impl Screen {
    /// The points of each tone, which is drawn by a line of the width beside it, m.
    pub(super) fn points(&self, tones: &[(Tone, f64)], sheet: Sheet, seed: u64) -> Result<Screened, ArtError> {
        let placement = self.check(tones, sheet)?;
        let densities: Vec<Plane> =
            tones.iter().map(|(tone, width)| self.density(&tone.coverage, width / placement.pixel())).collect();
        let needed: Vec<f64> = densities.iter().map(|d| d.values.iter().map(|v| f64::from(*v)).sum::<f64>()).collect();
        let total: f64 = needed.iter().sum();
        if total <= 0.0 {
            let reason = "no ink is desired anywhere: the picture is white".to_string();
            return Err(ArtError::NothingToDraw { reason });
        }
        let factor = self.points.map_or(1.0, |points| points as f64 / total);
        if total * factor > MAX_DOTS as f64 {
            let message = format!(
                "the picture's tone needs {:.0} points on this sheet, but up to {MAX_DOTS} can be placed: ask for fewer, or \
                 draw with a wider line",
                total * factor
            );
            return Err(ArtError::BadOption { name: "points", value: total * factor, message });
        }
        let mut notes = Vec::new();
        let mut inks = Vec::new();
        let shares = shares(&needed, factor);
        for (i, (((tone, width), density), count)) in tones.iter().zip(&densities).zip(&shares).enumerate() {
            let options = StippleOptions::new(DotCount::Points(*count));
            let dots = stipple(density, &options, stream(seed, "stipple", i as u64).next_u64());
            inks.push(dots.iter().map(|d| placement.on_sheet(d.x, d.y)).collect());
            notes.extend(self.note(tone, *width, density, width / placement.pixel(), factor));
        }
        if inks.iter().all(Vec::is_empty) {
            let reason = format!("{total:.2} points are needed for so little ink: less than one");
            return Err(ArtError::NothingToDraw { reason });
        }
        Ok(Screened { inks, notes })
    }

    fn check(&self, tones: &[(Tone, f64)], sheet: Sheet) -> Result<Placement, ArtError> {
        let bad = |name, value: f64, message: &str| ArtError::BadOption { name, value, message: message.to_string() };
        for (name, value) in [("sheet_width", sheet.width), ("sheet_height", sheet.height)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(bad(name, value, "a sheet has a positive size, m"));
            }
        }
        if !(self.gain > 0.0 && self.gain.is_finite()) {
            return Err(bad("gain", self.gain, "the factor on the tone is above 0; 1 keeps the picture's tone"));
        }
        if !(0.0..1.0).contains(&self.white) {
            return Err(bad("white", self.white, "a coverage from 0 to less than 1"));
        }
        if self.points == Some(0) {
            return Err(bad("points", 0.0, "at least one point"));
        }
        let Some((first, _)) = tones.first() else {
            return Err(ArtError::NothingToDraw { reason: "there are no inks".to_string() });
        };
        let (width, height) = (first.coverage.width(), first.coverage.height());
        if width == 0 || height == 0 {
            return Err(ArtError::NothingToDraw { reason: "the picture has no pixels".to_string() });
        }
        for (tone, line) in tones {
            if !(*line > 0.0 && line.is_finite()) {
                return Err(bad("line_width", *line, "a line has a positive width, m"));
            }
            let other = tone.coverage.width();
            if (other, tone.coverage.height()) != (width, height) {
                let message =
                    format!("the tone of {} is as wide as those of the other inks: {width} px", tone.ink.name);
                return Err(ArtError::BadOption { name: "tone_width", value: other as f64, message });
            }
        }
        Ok(Placement::new(width, height, sheet))
    }

    /// Coverage to draw where this is desired.
    fn desired(&self, coverage: f32) -> f64 {
        let f = self.gain * f64::from(coverage);
        if f.is_finite() && f > self.white { f.min(FULL) } else { 0.0 }
    }

    /// Points per pixel, for a line so many pixels wide.
    fn density(&self, coverage: &Plane, line: f64) -> Plane {
        Plane::from_fn(coverage.width(), coverage.height(), |x, y| {
            (self.mark.density(self.desired(coverage.at(x, y))) / (line * line)) as f32
        })
    }

    /// What the desired number of points does to the tone of an ink.
    fn note(&self, tone: &Tone, width: f64, density: &Plane, line: f64, factor: f64) -> Option<String> {
        let (mut desired, mut drawn, mut error) = (0.0, 0.0, 0.0);
        for (f, rho) in tone.coverage.values.iter().zip(&density.values) {
            let f = f64::from(f.clamp(0.0, 1.0));
            let got = self.mark.coverage(f64::from(*rho) * factor * line * line);
            desired += f;
            drawn += got;
            error += (got - f).abs();
        }
        let count = density.values.len() as f64;
        ((drawn - desired).abs() > 0.05 * desired).then(|| {
            let fits = match self.points {
                Some(_) => format!("; a line of {:.2} mm would fit this number of points", 1e3 * width / factor.sqrt()),
                None => String::new(),
            };
            format!(
                "{}: the lines cover {:.1} % of the paper instead of {:.1} % (mean tone error {:.3}){fits}",
                tone.ink.name,
                100.0 * drawn / count,
                100.0 * desired / count,
                error / count
            )
        })
    }
}

/// Whole numbers of points for what each ink needs, whose sum is that of all, rounded.
fn shares(needed: &[f64], factor: f64) -> Vec<usize> {
    let (mut sum, mut placed) = (0.0, 0);
    let next = |n: &f64| {
        sum += n * factor;
        let count = (sum.round() as usize) - placed;
        placed += count;
        count
    };
    needed.iter().map(next).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use crate::picture::Ink;

    fn tone(coverage: Plane) -> Tone {
        Tone { ink: Ink { name: "black".into(), color: Rgb([0, 0, 0]) }, coverage }
    }

    #[test]
    fn density_undoes_coverage() {
        for mark in [Mark::Line, Mark::Dot] {
            let mut last = -1.0;
            for i in 0..=98 {
                let f = f64::from(i) / 100.0;
                let density = mark.density(f);
                assert!((mark.coverage(density) - f).abs() < 1e-9 && density > last, "{mark:?} {f}");
                last = density;
            }
            assert_eq!(mark.coverage(1e9), 1.0);
        }
    }

    #[test]
    fn shares_are_whole_and_complete() {
        assert_eq!(shares(&[1.2, 0.0, 2.2, 6.6], 1.0), [1, 0, 2, 7]);
        assert_eq!(shares(&[1.0, 1.0, 1.0], 100.0 / 3.0).iter().sum::<usize>(), 100);
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        let screen = Screen { mark: Mark::Line, points: None, gain: 1.0, white: 0.0 };
        let sheet = Sheet { width: 0.2, height: 0.1 };
        let grey = vec![(tone(Plane::filled(20, 10, 0.5)), 1e-3)];
        let message =
            |screen: Screen, tones: &[(Tone, f64)], sheet| screen.points(tones, sheet, 1).unwrap_err().to_string();
        let white = message(screen, &[(tone(Plane::filled(20, 10, 0.0)), 1e-3)], sheet);
        assert!(white.starts_with("there is nothing to draw"), "{white}");
        assert!(message(screen, &[], sheet).starts_with("there is nothing to draw"));
        assert!(message(screen, &[(tone(Plane::default()), 1e-3)], sheet).contains("no pixels"));
        assert!(message(screen, &[(tone(Plane::filled(20, 10, 0.5)), -1.0)], sheet).contains("line_width = -1"));
        assert!(message(screen, &grey, Sheet { width: 0.0, height: 0.1 }).contains("sheet_width = 0"));
        assert!(message(Screen { gain: f64::NAN, ..screen }, &grey, sheet).contains("gain"));
        assert!(message(Screen { white: 1.0, ..screen }, &grey, sheet).contains("white"));
        assert!(message(Screen { points: Some(0), ..screen }, &grey, sheet).contains("points"));
        assert!(message(screen, &[(tone(Plane::filled(20, 10, 0.5)), 1e-6)], sheet).contains("wider line"));
        let two = vec![grey[0].clone(), (tone(Plane::filled(10, 10, 0.5)), 1e-3)];
        assert!(message(screen, &two, sheet).contains("tone_width = 10"));
    }

    #[test]
    fn a_desired_number_of_points_tells_what_it_does_to_the_tone() {
        let grey = vec![(tone(Plane::filled(60, 30, 0.4)), 1e-3)];
        let sheet = Sheet { width: 0.2, height: 0.1 };
        let screen = Screen { mark: Mark::Line, points: None, gain: 1.0, white: 0.0 };
        let natural = screen.points(&grey, sheet, 1).unwrap();
        assert!(natural.notes.is_empty(), "{:?}", natural.notes);
        let quarter = natural.inks[0].len() / 4;
        let fewer = Screen { points: Some(quarter), ..screen }.points(&grey, sheet, 1).unwrap();
        assert_eq!(fewer.inks[0].len(), quarter);
        assert!(
            fewer.notes[0].contains("instead of 40.0 %") && fewer.notes[0].contains("2.00 mm"),
            "{:?}",
            fewer.notes
        );
    }
}
