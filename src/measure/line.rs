//! The drawn line against the desired line, on the true surface, from the ink alone.
use nalgebra::Point3;

use crate::ink::InkTrace;
use crate::math::stats;
use crate::measure::Touchable;
use crate::measure::segments::SegmentGrid;
use crate::surface::{SurfaceDrawing, SurfaceStroke};
use crate::twin::Record;

/// Spacing at which the desired line is asked whether ink covers it, m.
const PROBE: f64 = 1e-4;
/// An error larger than this is not looked for, m; such ink counts with this error and as excess.
const REACH: f64 = 0.02;

/// How well the drawn line follows the desired one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineFit {
    /// Mean distance of the inked line from the desired line of its own stroke, m, weighted by inked length.
    pub error_mean: f64,
    /// 95th percentile of that distance, m.
    pub error_p95: f64,
    /// Largest distance, m.
    pub error_max: f64,
    /// Largest distance of ink that a stroke left, m; ink of no stroke, as a probe leaves it, isn't in it.
    pub stroke_error_max: Option<f64>,
    /// Share of the desired length, of what a nib can touch, that has ink of its layer within one line width.
    pub coverage: f64,
    /// Share of the desired length that a nib can touch.
    pub touchable: f64,
    /// Share of the inked length farther than one line width from every desired line of its layer.
    pub excess: f64,
}

/// Compares an ink trace with the desired drawing, both on the true surface. `line_width` is the pen's nominal width of
/// each layer, m. Where `touchable` is given, what no nib can touch isn't asked for. `None` without ink or without desired strokes.
pub fn line_fit(
    desired: &SurfaceDrawing,
    trace: &InkTrace,
    line_width: &[f64],
    touchable: Option<&Touchable>,
) -> Option<LineFit> {
    let near = desired_grid(desired);
    let mut ink = SegmentGrid::new(1e-3);
    let (mut errors, mut inked, mut weighted, mut stray) = (Vec::new(), 0.0, 0.0, 0.0);
    let mut stroke_error_max: Option<f64> = None;
    for stroke in &trace.strokes {
        let layer = stroke.ink as usize;
        let width = *line_width.get(layer)?;
        let own = stroke.stroke.map(|id| label(id.layer as usize, id.index as usize));
        for (i, p) in stroke.points.iter().enumerate() {
            let next = stroke.points.get(i + 1).unwrap_or(p);
            let previous = if i > 0 { &stroke.points[i - 1] } else { p };
            // a point stands for half the way to each neighbour; a lone dot for its own width
            let mut share = ((next.position - p.position).norm() + (p.position - previous.position).norm()) * 0.5;
            if stroke.points.len() == 1 {
                share = p.width;
            }
            let error = own.and_then(|o| near.distance(&p.position, REACH, |l| l == o)).unwrap_or(REACH);
            let any = near.distance(&p.position, width, |l| l >> 32 == layer as u64);
            inked += share;
            weighted += share * error;
            stray += if any.is_none() { share } else { 0.0 };
            errors.push((error, share));
            if own.is_some() {
                stroke_error_max = Some(stroke_error_max.unwrap_or(0.0).max(error));
            }
            ink.insert(p.position, next.position, layer as u64);
        }
    }
    let (mut length, mut asked, mut covered) = (0.0, 0.0, 0.0);
    for (layer, l) in desired.layers.iter().enumerate() {
        let width = *line_width.get(layer)?;
        for stroke in &l.strokes {
            for (p, share) in probes(stroke, width) {
                length += share;
                if touchable.is_some_and(|t| !t.holds(layer, &p)) {
                    continue;
                }
                asked += share;
                if ink.distance(&p, width, |l| l == layer as u64).is_some() {
                    covered += share;
                }
            }
        }
    }
    if inked <= 0.0 || asked <= 0.0 {
        return None;
    }
    Some(LineFit {
        error_mean: weighted / inked,
        error_p95: stats::weighted_quantile(&mut errors, 0.95)?,
        error_max: errors.iter().map(|e| e.0).fold(0.0, f64::max),
        stroke_error_max,
        coverage: covered / asked,
        touchable: asked / length,
        excess: stray / inked,
    })
}

/// Largest distance of the tip from the law's set point, across the pen, in any step of any drawn stroke, m; `None` without strokes.
pub fn tip_error(record: &Record) -> Option<f64> {
    let strokes = record.arms.iter().flat_map(|a| &a.strokes).filter(|s| s.steps > 0);
    strokes.map(|s| s.lateral_error.max).reduce(f64::max)
}

fn label(layer: usize, stroke: usize) -> u64 {
    (layer as u64) << 32 | stroke as u64
}

fn desired_grid(desired: &SurfaceDrawing) -> SegmentGrid {
    let mut grid = SegmentGrid::new(2e-3);
    for (layer, l) in desired.layers.iter().enumerate() {
        for stroke in &l.strokes {
            let own = label(layer, stroke.index);
            if let [dot] = stroke.targets.as_slice() {
                grid.insert(dot.position, dot.position, own);
            }
            for w in stroke.targets.windows(2) {
                grid.insert(w[0].position, w[1].position, own);
            }
        }
    }
    grid
}

/// Points along a desired stroke, each with the length it stands for, m. A dot stands for its width.
fn probes(stroke: &SurfaceStroke, width: f64) -> Vec<(Point3<f64>, f64)> {
    if let [dot] = stroke.targets.as_slice() {
        return vec![(dot.position, width)];
    }
    let mut out = Vec::new();
    for w in stroke.targets.windows(2) {
        let d = w[1].position - w[0].position;
        let length = d.norm();
        let n = (length / PROBE).ceil().max(1.0);
        for i in 0..n as usize {
            out.push((w[0].position + d * ((i as f64 + 0.5) / n), length / n));
        }
    }
    out
}
