//! A brush stroke grown from a seed, and what it is worth.
use std::f64::consts::{FRAC_PI_4, PI};

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
    /// Least mean fall of the difference under a stroke,
    pub threshold: f64,
    /// as if it were larger by this area, px2: what short strokes have to make up for.
    pub extra: f64,
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
        mask.sweep(&spline(&self.controls, (0.5 * radius).max(1.0)), radius, SOFT * radius);
    }
}

/// Half the width of a stroke's soft edge, in radii. Seen from where the picture is looked at, slivers of paper between two
/// strokes and the narrow overlaps of two others make up for each other; hard edges would call for dashes that fill slivers.
const SOFT: f64 = 0.12;

/// Most samples across a brush.
const SAMPLES: f64 = 9.0;

/// Where strokes may start: a cell of a layer's grid.
#[derive(Clone, Copy)]
pub(super) struct Seed {
    pub layer: u16,
    /// First column and row of the cell.
    pub corner: [u32; 2],
    /// By how much the stroke turns from the flow, rad.
    pub turn: f32,
    /// Share of the longest stroke that this one may have: ends in a row would make seams.
    pub length: f32,
}

/// Grows the best stroke from a seed.
pub(super) fn grow(seed: Seed, layers: &[Layer], habits: &Habits, canvas: &Canvas, inks: usize) -> Option<Candidate> {
    let layer = &layers[usize::from(seed.layer)];
    let mut starts: Vec<(f64, usize, Point2<f64>)> = (0..inks)
        .filter_map(|ink| {
            let brush = Brush { canvas, radius: layer.drawn[ink], ink };
            let at = brush.best_in_cell(seed.corner, layer.grid)?;
            let worth = brush.dot(at);
            (worth > 0.0).then_some((worth, ink, at))
        })
        .collect();
    starts.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    starts.truncate(2);
    let grown = starts.into_iter().filter_map(|(dot, ink, start)| {
        let brush = Brush { canvas, radius: layer.drawn[ink], ink };
        let (controls, worth) = if layer.steps[1] == 0 {
            (vec![start], dot)
        } else {
            brush.best_part(&brush.follow(layer, habits, start, seed), layer)?
        };
        let length = (controls.len() - 1) as f64 * layer.step;
        let area = brush.radius * (2.0 * length + PI * brush.radius);
        (worth > habits.threshold * (area + habits.extra)).then(|| {
            let bounds = brush.bounds(&controls);
            Candidate { ink, layer: usize::from(seed.layer), controls, worth, bounds }
        })
    });
    grown.reduce(|a, b| if b.worth > a.worth { b } else { a })
}

/// A brush of one radius in one ink over a canvas.
struct Brush<'a> {
    canvas: &'a Canvas,
    radius: f64,
    ink: usize,
}

impl Brush<'_> {
    /// The pixel at a place; `None` beyond the canvas.
    fn pixel(&self, p: Point2<f64>) -> Option<usize> {
        let inside = p.x >= 0.0 && p.y >= 0.0 && p.x < self.canvas.width as f64 && p.y < self.canvas.height as f64;
        inside.then(|| p.y as usize * self.canvas.width + p.x as usize)
    }

    /// What it is worth to cover the pixel at a place: nothing beyond the canvas.
    fn worth(&self, p: Point2<f64>) -> f64 {
        self.pixel(p).map_or(0.0, |at| f64::from(self.canvas.worth(at, self.ink)))
    }

    /// Where in a cell the ink is worth most.
    fn best_in_cell(&self, corner: [u32; 2], grid: f64) -> Option<Point2<f64>> {
        let side = grid.ceil() as usize;
        let stride = (side / 4).max(1);
        let (x0, y0) = (corner[0] as usize, corner[1] as usize);
        let mut best: Option<(f32, usize, usize)> = None;
        for y in (y0..(y0 + side).min(self.canvas.height)).step_by(stride) {
            for x in (x0..(x0 + side).min(self.canvas.width)).step_by(stride) {
                let worth = self.canvas.worth(y * self.canvas.width + x, self.ink);
                if best.is_none_or(|b| worth > b.0) {
                    best = Some((worth, x, y));
                }
            }
        }
        best.filter(|b| b.0 > 0.0).map(|(_, x, y)| Point2::new(x as f64 + 0.5, y as f64 + 0.5))
    }

    /// Distance between the samples by which the brush sees what it covers, and their number across it.
    fn samples(&self) -> (f64, usize) {
        let across = (2.0 * self.radius).ceil().clamp(3.0, SAMPLES);
        (2.0 * self.radius / across, across as usize)
    }

    /// What a dot is worth.
    fn dot(&self, at: Point2<f64>) -> f64 {
        let (spacing, across) = self.samples();
        let offset = |i: usize| (i as f64 + 0.5) * spacing - self.radius;
        let mut sum = 0.0;
        for y in (0..across).map(offset) {
            for x in (0..across).map(offset).filter(|x| x * x + y * y < self.radius * self.radius) {
                sum += self.worth(at + Vector2::new(x, y));
            }
        }
        sum * spacing * spacing
    }

    /// The contiguous part of a path that is worth most with its round ends, at least the layer's fewest steps long, and its
    /// worth.
    fn best_part(&self, path: &[Point2<f64>], layer: &Layer) -> Option<(Vec<Point2<f64>>, f64)> {
        let (pieces, least) = (path.len() - 1, layer.steps[0].max(1));
        if pieces < least {
            return None;
        }
        // What a round end covers is the share of a disc in its square of the next so many pieces.
        let cap = (self.radius / layer.step).ceil() as usize;
        let share = FRAC_PI_4 * self.radius / (cap as f64 * layer.step);
        let (head, tail) = (path[0] - path[1], path[pieces] - path[pieces - 1]);
        let before = (1..=cap).rev().map(|i| path[0] + i as f64 * head);
        let after = (1..=cap).map(|i| path[pieces] + i as f64 * tail);
        let mut sums = Vec::with_capacity(path.len() + 2 * cap);
        let mut last: Option<Point2<f64>> = None;
        let mut sum = 0.0;
        for p in before.chain(path.iter().copied()).chain(after) {
            sum += last.map_or(0.0, |last| self.piece(last, p, layer.step));
            sums.push(sum);
            last = Some(p);
        }
        let start = |i: usize| sums[i + cap] - share * (sums[i + cap] - sums[i]);
        let end = |i: usize| sums[i + cap] + share * (sums[i + 2 * cap] - sums[i + cap]);
        let (mut lowest, mut best) = (0, (f64::NEG_INFINITY, 0, 0));
        for last in least..=pieces {
            if start(last - least) < start(lowest) {
                lowest = last - least;
            }
            let worth = end(last) - start(lowest);
            if worth > best.0 {
                best = (worth, lowest, last);
            }
        }
        let (worth, first, last) = best;
        (worth > 0.0).then(|| (path[first..=last].to_vec(), worth))
    }

    /// What the brush is worth between two control points.
    fn piece(&self, a: Point2<f64>, b: Point2<f64>, step: f64) -> f64 {
        let (spacing, across) = self.samples();
        let along = (step / spacing).ceil();
        let d = b - a;
        let side = Vector2::new(-d.y, d.x) / step;
        let mut sum = 0.0;
        for k in 0..along as usize {
            let middle = a + (k as f64 + 0.5) / along * d;
            for j in 0..across {
                sum += self.worth(middle + ((j as f64 + 0.5) * spacing - self.radius) * side);
            }
        }
        sum * spacing * step / along
    }

    /// The control points of a stroke that follows the flow both ways from its start, turned by an angle, as far as its ink
    /// does good.
    fn follow(&self, layer: &Layer, habits: &Habits, start: Point2<f64>, seed: Seed) -> Vec<Point2<f64>> {
        let most = ((layer.steps[1] as f64 * f64::from(seed.length)) as usize).max(layer.steps[0]);
        let rotation = nalgebra::Rotation2::new(f64::from(seed.turn));
        let first = rotation * layer.flow.direction(start);
        // The offset lines of a bundle stay sound while the curve is no tighter than the brush.
        let (sin, cos) = (0.8 * layer.step / self.radius).min(1.5).sin_cos();
        let walk = |heading: Vector2<f64>| {
            let (mut p, mut heading, mut bad) = (start, heading, 0);
            let mut points = Vec::with_capacity(most);
            while points.len() < most {
                p += layer.step * heading;
                bad = if self.worth(p) > 0.0 { 0 } else { bad + 1 };
                if bad > 2 {
                    break;
                }
                points.push(p);
                let flow = rotation * layer.flow.direction(p);
                let along = if flow.dot(&heading) < 0.0 { -flow } else { flow };
                let turned = (habits.curvature * along + (1.0 - habits.curvature) * heading).normalize();
                heading = if heading.dot(&turned) >= cos {
                    turned
                } else {
                    cos * heading + sin.copysign(heading.perp(&turned)) * Vector2::new(-heading.y, heading.x)
                };
            }
            points
        };
        let mut path = walk(-first);
        let before = path.len();
        path.reverse();
        path.push(start);
        path.extend(walk(first));
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
