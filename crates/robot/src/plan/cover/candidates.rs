//! Places where a base can stand, and the stretches of wall that the arm reaches from each.
use std::collections::BTreeSet;

use nalgebra::{Isometry2, Point2, Vector2};
use rayon::prelude::*;

use super::floor::Floor;
use super::ink::{COLUMN, Ink};
use super::options::{BasePose, CoverOptions};
use super::pen_reach::{PenReach, in_pen_frame};
use crate::surface::Wall;

/// Nearest and farthest that the first axis is tried before the wall, m.
const STANDOFF: [f64; 2] = [0.40, 1.05];
/// Farthest wall that is asked about from a place, m.
const FAR: f64 = 1.30;
/// Cosine of the largest angle between the base's front and a pen's direction: the body is in no pen's way within it.
const FRONT: f64 = 0.5;
/// Half the wall over which it is looked at to stand square to it, m.
const SQUARE: f64 = 0.4;
/// Turns from square that are tried, degrees, in this order.
const TURNS: [f64; 13] = [0.0, 5.0, -5.0, 10.0, -10.0, 15.0, -15.0, 20.0, -20.0, 25.0, -25.0, 30.0, -30.0];

/// Ink without a gap that is reached from a place: columns, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Stretch {
    pub first: usize,
    pub last: usize,
    /// Index of the place.
    pub place: usize,
}

/// A place.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub pose: BasePose,
    /// Where the arm's first axis stands.
    pub axis: Point2<f64>,
}

/// The wall as places are asked about it.
pub(super) struct Asked<'a> {
    pub ink: &'a Ink,
    pub reach: &'a PenReach,
    pub options: &'a CoverOptions,
    /// How much higher than it lies the ink is asked about, m.
    raise: f64,
    /// Points and normals half a column apart: of column c they are 2 c, 2 c + 1 and 2 c + 2.
    samples: Vec<(Point2<f64>, Vector2<f64>)>,
    /// How deep the pen is pressed, m.
    press: f64,
}

impl<'a> Asked<'a> {
    pub fn new(wall: &Wall, ink: &'a Ink, reach: &'a PenReach, options: &'a CoverOptions, press: f64) -> Self {
        let at = |k: usize| {
            let s = (0.5 * COLUMN * k as f64).min(wall.profile.length());
            (wall.profile.at(s), wall.profile.normal(s))
        };
        let samples = (0..=2 * ink.columns.len()).map(at).collect();
        Self { ink, reach, options, raise: 0.0, samples, press }
    }

    /// The same of ink that lies `raise` m higher.
    pub fn raised(self, raise: f64) -> Self {
        Self { raise, ..self }
    }

    /// Whether all ink of a column is reached by an arm whose first axis stands at `axis`, on a base whose front is `front`.
    fn column(&self, column: usize, axis: &Point2<f64>, front: &Vector2<f64>) -> bool {
        let Some(heights) = self.ink.columns[column] else { return true };
        let (m, low) = (self.options.margin, self.options.mount[2] - self.raise);
        self.samples[2 * column..=2 * column + 2].iter().all(|(point, normal)| {
            let [across, along] = in_pen_frame(point, normal, axis);
            -normal.dot(front) >= FRONT
                && self.reach.holds(
                    [across - m, heights[0] - low, along - m],
                    [across + m, heights[1] - low, along + m + self.press],
                )
        })
    }

    /// The stretches of ink that are reached, without the columns in `blocked`.
    pub fn stretches(&self, candidate: &Candidate, place: usize, blocked: &BTreeSet<usize>) -> Vec<Stretch> {
        let front = Vector2::new(candidate.pose.heading.cos(), candidate.pose.heading.sin());
        let mut stretches: Vec<Stretch> = Vec::new();
        let mut open = false;
        for column in 0..self.ink.columns.len() {
            if self.ink.columns[column].is_none() {
                continue;
            }
            let near = (self.samples[2 * column + 1].0 - candidate.axis).norm() < FAR;
            let reached = near && !blocked.contains(&column) && self.column(column, &candidate.axis, &front);
            match (reached, open, stretches.last_mut()) {
                (true, true, Some(stretch)) => stretch.last = column,
                (true, ..) => stretches.push(Stretch { first: column, last: column, place }),
                _ => {}
            }
            open = reached;
        }
        stretches
    }

    /// By how much the ink of a column is missed from the best of `candidates`, m; `None` when none is near.
    pub fn missing(&self, column: usize, candidates: &[Candidate]) -> Option<f64> {
        let heights = self.ink.columns[column]?;
        let (point, normal) = self.samples[2 * column + 1];
        let low = self.options.mount[2] - self.raise;
        let missed = |c: &Candidate| {
            let [across, along] = in_pen_frame(&point, &normal, &c.axis);
            heights.iter().map(|z| self.reach.distance([across, z - low, along])).fold(0.0, f64::max)
        };
        let near = candidates.iter().filter(|c| (c.axis - point).norm() < FAR);
        near.map(missed).min_by(f64::total_cmp)
    }

    /// What to do about ink between `heights` (m, world) that is missed.
    pub fn too_high(&self, heights: [f64; 2]) -> String {
        let own = heights[1] - heights[0];
        let low = self.options.mount[2];
        match self.reach.tallest(self.options.margin, self.press) {
            // what ends where the map does may go on beyond it
            Some([a, b]) if b - a < own && self.reach.is_inside(a) && self.reach.is_inside(b) => format!(
                "it is {:.0} mm high, and from one place the arm holds {:.0} mm, {:.0} to {:.0} mm over the floor: draw it less high, \
                 or as several drawings",
                own * 1e3,
                (b - a) * 1e3,
                (low + a) * 1e3,
                (low + b) * 1e3
            ),
            _ => "draw lower, higher or less high".into(),
        }
    }
}

/// Where the first axis of an arm on a base stands.
pub(super) fn axis_of(pose: &BasePose, options: &CoverOptions) -> Point2<f64> {
    pose.isometry() * Point2::new(options.mount[0], options.mount[1])
}

/// All places before the inked part of the wall at which the base is clear of everything, in the squarest way.
pub(super) fn candidates(wall: &Wall, ink: &Ink, floor: &Floor, options: &CoverOptions) -> Vec<Candidate> {
    let (first, last) = ink.ends();
    let part: Vec<Point2<f64>> =
        (first..=last + 1).map(|c| wall.profile.at((c as f64 * COLUMN).min(wall.profile.length()))).collect();
    let step = options.candidate_spacing;
    let bound = |d: usize| {
        let low = part.iter().map(|p| p[d]).fold(f64::INFINITY, f64::min) - FAR;
        let high = part.iter().map(|p| p[d]).fold(f64::NEG_INFINITY, f64::max) + FAR;
        ((low / step).floor() as i64, (high / step).ceil() as i64)
    };
    let ((x0, x1), (y0, y1)) = (bound(0), bound(1));
    let all: Vec<(i64, i64)> = (x0..=x1).flat_map(|i| (y0..=y1).map(move |j| (i, j))).collect();
    all.par_iter()
        .filter_map(|(i, j)| {
            let axis = Point2::new(*i as f64 * step, *j as f64 * step);
            let (s, distance) = wall.profile.nearest(&axis);
            let before = (axis - wall.profile.at(s)).dot(&wall.profile.normal(s)) > 0.0;
            if !before || !(STANDOFF[0]..=STANDOFF[1]).contains(&distance) {
                return None;
            }
            let pose = squarest(wall, s, &axis, floor, options)?;
            Some(Candidate { pose, axis })
        })
        .collect()
}

/// The pose of the base with its arm at `axis` that is nearest to square to the wall round arc length `s`.
fn squarest(wall: &Wall, s: f64, axis: &Point2<f64>, floor: &Floor, options: &CoverOptions) -> Option<BasePose> {
    let end = |x: f64| wall.profile.at(x.clamp(0.0, wall.profile.length()));
    let chord = end(s + SQUARE) - end(s - SQUARE);
    // the wall's front is at the right of its direction, and the base looks at it
    let square = chord.y.atan2(chord.x) + std::f64::consts::FRAC_PI_2;
    TURNS.iter().find_map(|turn| {
        let heading = square + turn.to_radians();
        let mount = Isometry2::rotation(heading) * Point2::new(options.mount[0], options.mount[1]);
        let heading = (heading + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        let pose = BasePose { x: axis.x - mount.x, y: axis.y - mount.y, heading };
        floor.is_clear(&pose).then_some(pose)
    })
}
