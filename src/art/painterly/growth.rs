//! A brush stroke grown from a seed, and what it is worth.
use nalgebra::{Point2, Vector2};

use super::canvas::Canvas;
use super::flow::Flow;
use super::mask::Mask;
use crate::art::brush::spline;

/// The brushes of one radius.
pub(super) struct Layer {
    /// Radius of the brush, px.
    pub radius: f64,
    /// Radius of what the pen of each ink makes of the brush, px.
    pub drawn: Vec<f64>,
    /// Distance between seeds, px.
    pub grid: f64,
    /// Distance between control points, px.
    pub step: f64,
    /// Fewest and most steps.
    pub steps: [usize; 2],
    pub flow: Flow,
}

/// What growth is asked for, in the terms of Hertzmann 1998.
#[derive(Clone, Copy)]
pub(super) struct Habits {
    /// f_c: share of the flow against the direction that the stroke already has.
    pub curvature: f64,
    /// Least mean fall of the difference under a stroke.
    pub threshold: f64,
    /// How much more a rise of the difference counts than a fall.
    pub harm: f64,
}

/// A brush stroke that could be painted.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub ink: usize,
    pub layer: usize,
    /// Control points of a B-spline, px.
    pub controls: Vec<Point2<f64>>,
    /// The fall of the difference that it promises, where rises count more.
    pub worth: f64,
    /// Columns and rows that it can touch: first and one past the last.
    pub bounds: [usize; 4],
}

impl Candidate {
    /// Covers what the stroke covers.
    pub fn sweep(&self, layers: &[Layer], mask: &mut Mask) {
        let radius = layers[self.layer].drawn[self.ink];
        mask.sweep(&spline(&self.controls, (0.5 * radius).max(1.0)), radius);
    }
}

/// Where strokes may start: a cell of a layer's grid.
#[derive(Clone, Copy)]
pub(super) struct Seed {
    pub layer: u16,
    /// First column and row of the cell.
    pub corner: [u32; 2],
    /// By how much the stroke turns from the flow, rad.
    pub turn: f32,
}

/// Points of a disc of radius 1 by which inks are compared.
const DISC: [(f64, f64); 9] = [
    (0.0, 0.0),
    (0.5, 0.0),
    (-0.5, 0.0),
    (0.0, 0.5),
    (0.0, -0.5),
    (0.6, 0.6),
    (-0.6, 0.6),
    (0.6, -0.6),
    (-0.6, -0.6),
];

/// Grows the best stroke from a seed.
pub(super) fn grow(
    seed: Seed,
    layers: &[Layer],
    habits: &Habits,
    canvas: &Canvas,
    inks: usize,
    mask: &mut Mask,
) -> Option<Candidate> {
    let layer = &layers[usize::from(seed.layer)];
    let weigh = |gain: f32| if gain < 0.0 { habits.harm as f32 * gain } else { gain };
    let place = |ink: usize| Place { canvas, radius: layer.drawn[ink] };
    let mut starts: Vec<(f32, usize, Point2<f64>)> = (0..inks)
        .filter_map(|ink| {
            let place = place(ink);
            let at = place.best_in_cell(seed.corner, layer.grid, ink)?;
            let sum: f32 = DISC
                .iter()
                .map(|d| weigh(canvas.gain(place.pixel(at + place.radius * Vector2::new(d.0, d.1)), ink)))
                .sum();
            (sum > 0.0).then_some((sum, ink, at))
        })
        .collect();
    starts.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    starts.truncate(2);
    let grown = starts.into_iter().filter_map(|(_, ink, start)| {
        let (place, radius) = (place(ink), layer.drawn[ink]);
        let path = place.follow(layer, habits, start, f64::from(seed.turn), ink);
        let controls = best_part(&path, layer, canvas, ink, &weigh, mask)?;
        mask.sweep(&spline(&controls, (0.5 * radius).max(1.0)), radius);
        let (mut worth, mut area) = (0.0, 0.0);
        for (at, share) in mask.pixels() {
            worth += f64::from(share * weigh(canvas.gain(at, ink)));
            area += f64::from(share);
        }
        (worth > habits.threshold * area).then(|| {
            let bounds = place.bounds(&controls);
            Candidate { ink, layer: usize::from(seed.layer), controls, worth, bounds }
        })
    });
    grown.reduce(|a, b| if b.worth > a.worth { b } else { a })
}

/// The contiguous part of a path whose pieces are worth most together, at least the layer's fewest steps long.
fn best_part(
    path: &[Point2<f64>],
    layer: &Layer,
    canvas: &Canvas,
    ink: usize,
    weigh: &impl Fn(f32) -> f32,
    mask: &mut Mask,
) -> Option<Vec<Point2<f64>>> {
    let pieces = path.len() - 1;
    if pieces == 0 {
        return (layer.steps[0] == 0).then(|| path.to_vec());
    }
    let least = layer.steps[0].max(1);
    if pieces < least {
        return None;
    }
    mask.sweep(path, layer.drawn[ink]);
    let mut sums = vec![0.0f64; pieces + 1];
    for (at, share, piece) in mask.pieces() {
        sums[piece + 1] += f64::from(share * weigh(canvas.gain(at, ink)));
    }
    for i in 0..pieces {
        sums[i + 1] += sums[i];
    }
    let (mut lowest, mut best) = (0, (f64::NEG_INFINITY, 0, 0));
    for end in least..=pieces {
        if sums[end - least] < sums[lowest] {
            lowest = end - least;
        }
        let worth = sums[end] - sums[lowest];
        if worth > best.0 {
            best = (worth, lowest, end);
        }
    }
    (best.0 > 0.0).then(|| path[best.1..=best.2].to_vec())
}

/// A canvas as a brush of one radius sees it.
struct Place<'a> {
    canvas: &'a Canvas,
    radius: f64,
}

impl Place<'_> {
    /// The nearest place where the brush stays on the canvas.
    fn inside(&self, p: Point2<f64>) -> Point2<f64> {
        let clamp = |v: f64, n: usize| {
            let n = n as f64;
            if n <= 2.0 * self.radius { 0.5 * n } else { v.clamp(self.radius, n - self.radius) }
        };
        Point2::new(clamp(p.x, self.canvas.width), clamp(p.y, self.canvas.height))
    }

    /// The pixel at a place.
    fn pixel(&self, p: Point2<f64>) -> usize {
        let index = |v: f64, n: usize| (v.max(0.0) as usize).min(n - 1);
        index(p.y, self.canvas.height) * self.canvas.width + index(p.x, self.canvas.width)
    }

    /// Where in a cell an ink gains most.
    fn best_in_cell(&self, corner: [u32; 2], grid: f64, ink: usize) -> Option<Point2<f64>> {
        let side = grid.ceil() as usize;
        let stride = (side / 4).max(1);
        let (x0, y0) = (corner[0] as usize, corner[1] as usize);
        let mut best: Option<(f32, usize, usize)> = None;
        for y in (y0..(y0 + side).min(self.canvas.height)).step_by(stride) {
            for x in (x0..(x0 + side).min(self.canvas.width)).step_by(stride) {
                let gain = self.canvas.gain(y * self.canvas.width + x, ink);
                if best.is_none_or(|b| gain > b.0) {
                    best = Some((gain, x, y));
                }
            }
        }
        best.filter(|b| b.0 > 0.0).map(|(_, x, y)| self.inside(Point2::new(x as f64 + 0.5, y as f64 + 0.5)))
    }

    /// The control points of a stroke that follows the flow both ways from its start, turned by an angle, as far as its ink
    /// does good.
    fn follow(&self, layer: &Layer, habits: &Habits, start: Point2<f64>, turn: f64, ink: usize) -> Vec<Point2<f64>> {
        let most = layer.steps[1];
        let first = layer.flow.direction(start).unwrap_or(Vector2::x());
        let rotation = nalgebra::Rotation2::new(turn);
        // The offset lines of a bundle stay sound while the curve is no tighter than the brush.
        let sharpest = 0.8 * layer.step / self.radius;
        let walk = |heading: Vector2<f64>| {
            let (mut p, mut heading, mut bad) = (start, heading, 0);
            let mut points = Vec::with_capacity(most);
            while points.len() < most {
                let next = p + layer.step * heading;
                if (self.inside(next) - next).norm() > 0.5 {
                    break;
                }
                let good = self.canvas.gain(self.pixel(next), ink) > 0.0;
                bad = if good { 0 } else { bad + 1 };
                if bad > 2 {
                    break;
                }
                p = self.inside(next);
                points.push(p);
                if let Some(flow) = layer.flow.direction(p).map(|d| rotation * d) {
                    let along = if flow.dot(&heading) < 0.0 { -flow } else { flow };
                    let wish = habits.curvature * along + (1.0 - habits.curvature) * heading;
                    let angle = heading.perp(&wish).atan2(heading.dot(&wish)).clamp(-sharpest, sharpest);
                    heading = nalgebra::Rotation2::new(angle) * heading;
                }
            }
            points
        };
        let mut path = walk(-(rotation * first));
        let before = path.len();
        path.reverse();
        path.push(start);
        path.extend(walk(rotation * first));
        // Both ways together may be too long: keep what is around the start.
        let extra = path.len().saturating_sub(most + 1);
        let cut = extra.min(before.saturating_sub(most / 2));
        path.drain(..cut);
        path.truncate(most + 1);
        path
    }

    /// Columns and rows that a brush along these control points can touch.
    fn bounds(&self, controls: &[Point2<f64>]) -> [usize; 4] {
        let reach = self.radius + 1.0;
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in controls {
            low = [low[0].min(p.x), low[1].min(p.y)];
            high = [high[0].max(p.x), high[1].max(p.y)];
        }
        let index = |v: f64, n: usize| (v.max(0.0) as usize).min(n);
        let (w, h) = (self.canvas.width, self.canvas.height);
        [
            index(low[0] - reach, w),
            index(low[1] - reach, h),
            index(high[0] + reach + 1.0, w),
            index(high[1] + reach + 1.0, h),
        ]
    }
}
