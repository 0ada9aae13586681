//! The lines of one direction of hatching: which of them are drawn, and from where to where.
use nalgebra::Point2;

use super::stripes::Stripes;
use crate::drawing::Stroke;
use crate::drawing::tidy::{resample, simplify};

/// Tones at which lines begin: as many steps between none and all.
const STEPS: usize = 16;
/// Share of the lines below which none is drawn: stray lines look like mistakes.
const FEWEST: f32 = 0.15;
/// Standard deviation of the means along a line, line widths, by which small changes of tone don't break it.
const MEAN: f64 = 1.5;
/// Shortest gap in a line, as a share of the shortest line.
const GAP: f64 = 0.8;
/// Farthest that leaving out points moves a line, line widths.
const TOLERANCE: f64 = 0.02;

/// One direction of lines on a grid of points. Lengths are in grid steps.
pub(super) struct Layer<'a> {
    pub columns: usize,
    pub rows: usize,
    /// Unit normals to the lines.
    pub normal: Vec<[f32; 2]>,
    /// Coverage that the lines is to draw.
    pub share: &'a [f32],
    /// Coverage of the lines if all are drawn.
    pub base: &'a [f32],
    /// The whole tone of all directions, and the one under which nothing is drawn.
    pub tone: &'a [f32],
    pub white: f32,
    /// Line width.
    pub width: f64,
    pub min_length: f64,
}

impl Layer<'_> {
    fn at(&self, p: &Point2<f64>) -> usize {
        let clamp = |v: f64, n: usize| (v.round().max(0.0) as usize).min(n - 1);
        clamp(p.y, self.rows) * self.columns + clamp(p.x, self.columns)
    }
}

/// The lines, in grid steps from the first point.
pub(super) fn lines(layer: &Layer, seed: u64, name: u64) -> Vec<Vec<Point2<f64>>> {
    if layer.share.iter().all(|s| *s <= 0.0) {
        return Vec::new();
    }
    let stripes = Stripes {
        columns: layer.columns,
        rows: layer.rows,
        cell: 1.0,
        normal: layer.normal.clone(),
        density: layer.base.iter().map(|b| b / layer.width as f32).collect(),
    };
    let whole: Vec<Vec<Point2<f64>>> = stripes.lines(seed, name).into_iter().map(|l| smoothed(&l)).collect();
    let mut order = Order::new(layer.columns, layer.rows);
    let mut out = Vec::new();
    for line in whole {
        let step = order.place(layer, &line);
        let begins = ((step as f32 + 0.5) / STEPS as f32).max(FEWEST);
        for run in runs(layer, &line, begins) {
            let piece = trimmed(&line[run.0..run.1], std::f64::consts::PI / 8.0 * layer.width);
            if length(&piece) >= layer.min_length.max(1e-9) {
                out.push(simplify(&Stroke::new(piece), TOLERANCE * layer.width).points);
            }
        }
    }
    out
}

fn length(line: &[Point2<f64>]) -> f64 {
    line.windows(2).map(|p| (p[1] - p[0]).norm()).sum()
}

/// A line of even, half-cell steps, freed of the grid's small waves. Its ends stay.
fn smoothed(line: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let fine = resample(&Stroke::new(line.to_vec()), 0.7).points;
    let mut points = fine.clone();
    for _ in 0..6 {
        let before = points.clone();
        for i in 1..points.len().saturating_sub(1) {
            points[i] = Point2::from((before[i - 1].coords + 2.0 * before[i].coords + before[i + 1].coords) / 4.0);
        }
    }
    points
}

/// A line shortened at both ends, for the round end of a pen's line covers more than the line's length.
fn trimmed(line: &[Point2<f64>], by: f64) -> Vec<Point2<f64>> {
    let cut = |line: Vec<Point2<f64>>| {
        let mut left = by;
        for i in 1..line.len() {
            let step = (line[i] - line[i - 1]).norm();
            if step > left {
                let mut rest = vec![line[i - 1] + (line[i] - line[i - 1]) * (left / step)];
                rest.extend_from_slice(&line[i..]);
                rest.reverse();
                return rest;
            }
            left -= step;
        }
        Vec::new()
    };
    cut(cut(line.to_vec()))
}

/// The stretches of a line that are drawn, as ranges of its points.
fn runs(layer: &Layer, line: &[Point2<f64>], begins: f32) -> Vec<(usize, usize)> {
    let step = length(line) / (line.len().max(2) - 1) as f64;
    let at: Vec<usize> = line.iter().map(|p| layer.at(p)).collect();
    let part: Vec<f64> = at.iter().map(|i| f64::from(layer.share[*i] / layer.base[*i])).collect();
    let sigma = MEAN * layer.width / step.max(1e-9);
    let part = along(&part, sigma);
    let bare = |i: usize| layer.tone[at[i]] < layer.white;
    let mut found: Vec<(usize, usize)> = Vec::new();
    let mut from = None;
    for i in 0..=line.len() {
        let on = part.get(i).is_some_and(|p| *p > f64::from(begins)) && !bare(i);
        match from {
            None if on => from = Some(i),
            Some(start) if !on => {
                found.push((start, i));
                from = None;
            }
            _ => {}
        }
    }
    // Short gaps are closed unless they are white.
    let shortest = layer.min_length / step.max(1e-9);
    let mut joined: Vec<(usize, usize)> = Vec::new();
    for run in found {
        match joined.last_mut() {
            Some(last) if ((run.0 - last.1) as f64) < GAP * shortest && !(last.1..run.0).any(bare) => last.1 = run.1,
            _ => joined.push(run),
        }
    }
    joined.retain(|r| (r.1 - r.0) as f64 >= shortest && r.1 - r.0 > 1);
    joined
}

/// Gaussian means along a line; its ends repeat.
fn along(values: &[f64], sigma: f64) -> Vec<f64> {
    let reach = (2.5 * sigma).ceil() as isize;
    let weights: Vec<f64> = (-reach..=reach).map(|i| (-0.5 * (i as f64 / sigma.max(1e-9)).powi(2)).exp()).collect();
    let sum: f64 = weights.iter().sum();
    let last = values.len() as isize - 1;
    let mean = |i: isize| {
        let terms = weights.iter().enumerate();
        terms.map(|(k, w)| w * values[(i + k as isize - reach).clamp(0, last) as usize]).sum::<f64>() / sum
    };
    (0..values.len() as isize).map(mean).collect()
}

/// Gives each line the step of tone at which it begins, unlike those of the lines beside it, so that a light tone
/// is drawn by every second, fourth or eighth line and not by a random few.
struct Order {
    /// Step of the line that runs through each grid point.
    step: Vec<u8>,
    /// Length of lines given each step.
    used: [f64; STEPS],
}

/// No line.
const FREE: u8 = u8::MAX;

impl Order {
    fn new(columns: usize, rows: usize) -> Self {
        Self { step: vec![FREE; columns * rows], used: [0.0; STEPS] }
    }

    fn place(&mut self, layer: &Layer, line: &[Point2<f64>]) -> usize {
        let mut near = [0.0f64; STEPS];
        let mut looks = 0.0;
        for p in line.iter().step_by(4) {
            let at = layer.at(p);
            let n = layer.normal[at];
            let spacing = layer.width / f64::from(layer.base[at]);
            for (lines_off, weight) in [(1.0, 1.0), (2.0, 0.5), (3.0, 0.25), (4.0, 0.125)] {
                for side in [-1.0, 1.0] {
                    let q = |r: f64| Point2::new(p.x + side * r * f64::from(n[0]), p.y + side * r * f64::from(n[1]));
                    // The neighbour is not exactly where it is expected.
                    let found = [0.0, -1.0, 1.0].map(|off| self.step[layer.at(&q(lines_off * spacing + off))]);
                    if let Some(step) = found.into_iter().find(|s| *s != FREE) {
                        for (s, v) in near.iter_mut().enumerate() {
                            let apart = (s as f64 - f64::from(step)) / STEPS as f64;
                            *v += weight * (-(apart / 0.3).powi(2)).exp();
                        }
                    }
                }
            }
            looks += 1.0;
        }
        let all: f64 = self.used.iter().sum::<f64>().max(1e-9);
        let cost = |s: usize| near[s] / f64::max(looks, 1.0) + 2.0 * self.used[s] / all;
        let best = (0..STEPS).min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap_or(0);
        self.used[best] += length(line);
        for p in line {
            self.step[layer.at(p)] = best as u8;
        }
        best
    }
}
