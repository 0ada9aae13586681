//! Seams: where a stroke is drawn from two places, how its two ends meet in true ink.
use nalgebra::{Point2, Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::drawing::StrokeId;
use crate::ink::{InkPoint, InkStroke, InkTrace};
use crate::math::stats;

/// Length of line from which its direction at an end is taken, m.
const STRETCH: f64 = 3e-3;

/// Where strokes are drawn from two places, by true ink.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct SeamMetrics {
    /// Cuts of which both ends were drawn.
    pub cuts: usize,
    /// Cuts of which an end has no ink: they are in none of the other figures.
    pub missing: usize,
    /// Step across the line between its two ends at a cut; half of the cuts are below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_p50_mm: Option<f64>,
    /// Step across the line between its two ends at a cut; 95 % of the cuts are below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_p95_mm: Option<f64>,
    /// Step across the line between its two ends at a cut, at most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_max_mm: Option<f64>,
    /// Widest gap along the line at a cut.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap_mm: Option<f64>,
    /// Longest overlap along the line at a cut.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overlap_mm: Option<f64>,
    /// What gaps leave out beyond the width of the line, over all cuts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost_mm: Option<f64>,
    /// What overlaps draw twice beyond the width of the line, over all cuts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub doubled_mm: Option<f64>,
}

/// How the two ends of a line meet at a cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// Number of the cut.
    pub cut: usize,
    /// Where the first end is on the sheet, m.
    pub sheet: Point2<f64>,
    /// Step across the line, m.
    pub step: f64,
    /// How far the second end is ahead of the first along the line, m: a gap; below 0 an overlap.
    pub ahead: f64,
    /// Width of the line there, m.
    pub width: f64,
}

/// The seams of a trace: for each cut, by its number, the stroke that ends at it and the one that begins there. Cuts of which an end has
/// no ink are left out.
pub fn seams(trace: &InkTrace, cuts: &[[StrokeId; 2]]) -> Vec<Seam> {
    let of = |id: StrokeId| trace.strokes.iter().filter(move |s| s.stroke == Some(id) && !s.points.is_empty());
    let seam = |(cut, [one, other]): (usize, &[StrokeId; 2])| {
        let last = of(*one).next_back()?;
        let (end, begin) = (last.points.last()?, of(*other).next()?.points.first()?);
        let apart = begin.position - end.position;
        let (along, up) = (direction(last, end), end.normal);
        let across = apart - along * apart.dot(&along) - up * apart.dot(&up);
        Some(Seam {
            cut,
            sheet: end.sheet,
            step: across.norm(),
            ahead: apart.dot(&along),
            width: 0.5 * (end.width + begin.width),
        })
    };
    cuts.iter().enumerate().filter_map(seam).collect()
}

/// Direction in which a line ends on its surface; of a dot none.
fn direction(line: &InkStroke, end: &InkPoint) -> Vector3<f64> {
    let far = |p: &Point3<f64>| (end.position - p).norm() >= STRETCH;
    let from = line.points.iter().rev().map(|p| p.position).find(far).unwrap_or(line.points[0].position);
    let way = end.position - from;
    (way - end.normal * way.dot(&end.normal)).try_normalize(1e-9).unwrap_or_else(Vector3::zeros)
}

impl SeamMetrics {
    /// Figures of the seams found of so many cuts; `None` where nothing was cut.
    pub fn of(seams: &[Seam], cuts: usize) -> Option<Self> {
        if cuts == 0 {
            return None;
        }
        let steps: Vec<f64> = seams.iter().map(|s| s.step * 1e3).collect();
        let quantile = |q: f64| stats::quantile(&steps, q);
        let most = |of: fn(&Seam) -> f64| {
            (!seams.is_empty()).then(|| seams.iter().map(|s| of(s).max(0.0) * 1e3).fold(0.0, f64::max))
        };
        let sum = |of: fn(&Seam) -> f64| {
            (!seams.is_empty()).then(|| seams.iter().map(|s| of(s).max(0.0) * 1e3).fold(0.0, |a, b| a + b))
        };
        Some(Self {
            cuts: seams.len(),
            missing: cuts - seams.len(),
            step_p50_mm: quantile(0.5),
            step_p95_mm: quantile(0.95),
            step_max_mm: most(|s| s.step),
            gap_mm: most(|s| s.ahead),
            overlap_mm: most(|s| -s.ahead),
            lost_mm: sum(|s| s.ahead - s.width),
            doubled_mm: sum(|s| -s.ahead - s.width),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(index: u32, points: &[[f64; 2]]) -> InkStroke {
        let point = |p: &[f64; 2]| InkPoint {
            position: Point3::new(p[0] * 1e-3, p[1] * 1e-3, 0.0),
            normal: Vector3::z(),
            sheet: Point2::new(p[0] * 1e-3, p[1] * 1e-3),
            width: 0.5e-3,
            density: 1.0,
            time: 0.0,
        };
        let stroke = Some(StrokeId { layer: 0, index });
        InkStroke { ink: 0, stroke, arm: 0, points: points.iter().map(point).collect() }
    }

    #[test]
    fn a_step_a_gap_and_an_overlap_are_found_as_they_are() {
        let along = |from: f64, to: f64, y: f64| -> Vec<[f64; 2]> {
            (0..=20).map(|i| [from + (to - from) * f64::from(i) / 20.0, y]).collect()
        };
        let lines = vec![
            line(0, &along(0.0, 10.0, 0.0)),
            // 0.2 mm aside and 0.8 mm on
            line(1, &along(10.8, 20.0, 0.2)),
            // 0.1 mm aside and 2 mm back
            line(2, &along(18.0, 30.0, 0.1)),
        ];
        let trace = InkTrace { inks: Vec::new(), strokes: lines };
        let id = |index| StrokeId { layer: 0, index };
        let found = seams(&trace, &[[id(0), id(1)], [id(1), id(2)], [id(2), id(9)]]);
        let m = SeamMetrics::of(&found, 3).unwrap();
        let near = |a: Option<f64>, b: f64| assert!((a.unwrap() - b).abs() < 1e-9, "{a:?} {b}");
        assert_eq!((m.cuts, m.missing), (2, 1));
        near(m.step_max_mm, 0.2);
        near(m.gap_mm, 0.8);
        near(m.overlap_mm, 2.0);
        near(m.lost_mm, 0.3);
        near(m.doubled_mm, 1.5);
        assert!(SeamMetrics::of(&[], 0).is_none());
        assert_eq!(SeamMetrics::of(&[], 2).unwrap().step_max_mm, None);
    }
}
