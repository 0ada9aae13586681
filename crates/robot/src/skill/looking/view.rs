//! Where a camera looks for lines that were drawn, and where the pen feels for the wall.
use nalgebra::{Point3, Vector3};

use super::register::{DrawnPoint, WallFrame};
use crate::surface::{SurfaceDrawing, SurfaceTarget};

/// Views that are tried.
const VIEWS: usize = 16;
/// Places that are compared as middles of a view.
const MIDDLES: usize = 120;
/// Points that are compared with each of them.
const COMPARED: usize = 3000;
/// A view this far from what is to be drawn counts half, m.
const NEAR: f64 = 0.08;
/// Cosine of the angle between normals up to which a wall is flat, 5 degrees.
const FLAT: f64 = 0.996;
/// What a level line counts, against an upright one: it doesn't tell where along the wall it is, but how far and how high.
const LEVEL: f64 = 0.1;

/// A place on the canvas to look at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    /// Middle of the view, m, world.
    pub middle: Point3<f64>,
    /// Outward normal round it, unit, world.
    pub normal: Vector3<f64>,
}

/// The points of a drawing's strokes, whose lines are as wide as `widths` (m, a layer each) say.
pub(super) fn drawn_points(drawing: &SurfaceDrawing, widths: &[f64], own: bool) -> Vec<DrawnPoint> {
    let mut points = Vec::new();
    for (layer, l) in drawing.layers.iter().enumerate() {
        let nominal = widths.get(layer).copied().unwrap_or(5e-4);
        for targets in l.strokes.iter().map(|s| s.targets.as_slice()) {
            for (i, t) in targets.iter().enumerate() {
                let (from, to) = (i.saturating_sub(1), (i + 1).min(targets.len() - 1));
                let way = targets[to].position - targets[from].position;
                // at a corner and at an end a line isn't across anything
                let (before, after) = (t.position - targets[from].position, targets[to].position - t.position);
                let straight = before.dot(&after) > 0.98 * before.norm() * after.norm();
                let Some(along) = way.try_normalize(1e-9).filter(|_| straight && from != i && to != i) else {
                    continue;
                };
                let width = t.width.unwrap_or(nominal);
                points.push(DrawnPoint { position: t.position, along, normal: t.normal, width, own });
            }
        }
    }
    points
}

/// Views of drawn lines near what is to be drawn, the most telling first; `half` is half of what the camera sees, m.
pub(super) fn views(drawn: &[DrawnPoint], near: &[Point3<f64>], half: f64) -> Vec<View> {
    let some = |n: usize, most: usize| n.div_ceil(most).max(1);
    let few: Vec<&DrawnPoint> = drawn.iter().step_by(some(drawn.len(), COMPARED)).collect();
    let there: Vec<&Point3<f64>> = near.iter().step_by(some(near.len(), COMPARED)).collect();
    let score = |m: &DrawnPoint| {
        let told: f64 = few
            .iter()
            .filter(|p| (p.position - m.position).norm() < 0.9 * half && p.normal.dot(&m.normal) > 0.5)
            .map(|p| p.along.z.powi(2) + LEVEL)
            .sum();
        let gap = there.iter().map(|p| (**p - m.position).norm()).fold(f64::INFINITY, f64::min);
        told / (1.0 + (gap / NEAR).powi(2))
    };
    let middles =
        drawn.iter().step_by(some(drawn.len(), MIDDLES)).filter(|m| WallFrame::at(m.position, &m.normal).is_some());
    let mut scored: Vec<(f64, &DrawnPoint)> = middles.map(|m| (score(m), m)).collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut views: Vec<View> = Vec::new();
    for (score, m) in scored {
        let known = views.iter().any(|v| (v.middle - m.position).norm() < 0.3 * half);
        if score > 0.0 && !known && views.len() < VIEWS {
            // along the mean normal, so that of a wave both flanks are seen
            let around = few.iter().filter(|p| (p.position - m.position).norm() < 0.9 * half);
            let normal = around.map(|p| p.normal).sum::<Vector3<f64>>() + m.normal;
            views.push(View { middle: m.position, normal: normal.try_normalize(1e-9).unwrap_or(m.normal) });
        }
    }
    views
}

/// Where the wall is felt: on strokes, at both ends along the wall and in the middle, each with places to go to instead. A wall that isn't
/// flat is felt at two places more: there what is felt depends on where along the wall it is.
pub(super) fn probes(targets: &[SurfaceTarget]) -> Vec<Vec<SurfaceTarget>> {
    let Some(wall) = targets.iter().find_map(|t| WallFrame::at(t.position, &t.normal)) else { return Vec::new() };
    let along = |t: &SurfaceTarget| (t.position - wall.middle).dot(&wall.along);
    let mut sorted: Vec<SurfaceTarget> = targets.to_vec();
    sorted.sort_by(|a, b| along(a).total_cmp(&along(b)));
    let (low, high) = (along(&sorted[0]), along(&sorted[sorted.len() - 1]));
    let near = |share: f64| {
        let at = low + share * (high - low);
        sorted.iter().min_by(|a, b| (along(a) - at).abs().total_cmp(&(along(b) - at).abs())).copied()
    };
    let flat = targets.iter().all(|t| t.normal.dot(&targets[0].normal) > FLAT);
    let shares = [[0.0, 0.1, 0.2], [1.0, 0.9, 0.8], [0.5, 0.4, 0.6], [0.25, 0.2, 0.3], [0.75, 0.7, 0.8]];
    let count = if flat { 3 } else { 5 };
    shares.into_iter().take(count).map(|shares| shares.into_iter().filter_map(near).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    fn target(y: f64, z: f64) -> SurfaceTarget {
        SurfaceTarget {
            position: Point3::new(3.0, y, z),
            normal: -Vector3::x(),
            sheet: Point2::new(-y, z),
            width: None,
        }
    }

    #[test]
    fn the_wall_is_felt_at_both_ends_and_in_the_middle() {
        let targets: Vec<SurfaceTarget> = (0..=100).map(|i| target(-0.3 + 0.006 * f64::from(i), 1.2)).collect();
        let found: Vec<f64> = probes(&targets).iter().map(|p| p[0].position.y).collect();
        assert_eq!(found.len(), 3);
        assert!((found[0] - found[1]).abs() > 0.59 && found[2].abs() < 0.01, "{found:?}");
        assert!(probes(&[]).is_empty());
    }

    #[test]
    fn a_view_has_upright_lines_near_what_comes_next() {
        let line = |y: f64, way: Vector3<f64>| {
            (0..100).map(move |i| DrawnPoint {
                position: Point3::new(3.0, y, 1.1) + way * (0.002 * f64::from(i)),
                along: way,
                normal: -Vector3::x(),
                width: 8e-4,
                own: false,
            })
        };
        let drawn: Vec<DrawnPoint> =
            line(0.5, Vector3::z()).chain(line(0.1, Vector3::z())).chain(line(-0.1, Vector3::y())).collect();
        let views = views(&drawn, &[Point3::new(3.0, 0.0, 1.2)], 0.1);
        assert!((views[0].middle.y - 0.1).abs() < 0.11 && views[0].middle.y > 0.0, "{views:?}");
    }
}
