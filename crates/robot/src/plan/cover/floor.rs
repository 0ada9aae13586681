//! The floor: where a base can stand.
use nalgebra::{Point2, Vector2};

use super::options::{BasePose, CoverOptions};
use crate::mesh::TriMesh;
use crate::surface::Wall;

/// What stands on the floor higher than this is driven round, m.
const FLAT: f64 = 0.02;
/// What begins above this is driven under, m: above the base, below the folded arm.
const OVERHEAD: f64 = 1.9;

/// What a base must not meet.
pub(super) struct Floor {
    barriers: Vec<[Point2<f64>; 2]>,
    /// Convex outlines, counter-clockwise.
    obstacles: Vec<Vec<Point2<f64>>>,
    /// Half length and half width of the base, its margin included, m.
    half: [f64; 2],
}

/// Convex outlines of what stands on the floor before a wall, m.
pub fn outlines(wall: &Wall, obstacles: &[TriMesh], options: &CoverOptions) -> Vec<Vec<Point2<f64>>> {
    Floor::new(wall, obstacles, options).obstacles
}

/// What a base meets and how deep, m.
pub(super) struct Meeting {
    pub what: String,
    pub missing: f64,
}

impl Floor {
    pub fn new(wall: &Wall, obstacles: &[TriMesh], options: &CoverOptions) -> Self {
        let outline = |mesh: &TriMesh| {
            let (low, high) = mesh.bounds();
            let stands = high.z > wall.bottom + FLAT && low.z < wall.bottom + OVERHEAD;
            stands.then(|| hull(mesh.vertices().iter().map(|v| v.xy()).collect()))
        };
        Self {
            barriers: wall.barriers(),
            obstacles: obstacles.iter().filter_map(outline).collect(),
            half: options.footprint.map(|s| 0.5 * s + options.margin),
        }
    }

    /// A floor with these alone.
    #[cfg(test)]
    pub fn bare(barriers: Vec<[Point2<f64>; 2]>, half: [f64; 2]) -> Self {
        Self { barriers, obstacles: Vec::new(), half }
    }

    /// Width of the base with its margins, m.
    pub fn width(&self) -> f64 {
        2.0 * self.half[0].min(self.half[1])
    }

    /// Whether the base with its margin meets nothing.
    pub fn is_clear(&self, pose: &BasePose) -> bool {
        self.depth(pose).is_none()
    }

    /// What the base with its margin meets deepest.
    pub fn meeting(&self, pose: &BasePose) -> Option<Meeting> {
        let (missing, obstacle) = self.depth(pose)?;
        let what = obstacle.map_or_else(|| "the wall".to_string(), |i| format!("what stands on the floor ({})", i + 1));
        Some(Meeting { what, missing })
    }

    fn depth(&self, pose: &BasePose) -> Option<(f64, Option<usize>)> {
        let world = pose.isometry().inverse();
        let reach = self.half[0].hypot(self.half[1]);
        let mut worst: Option<(f64, Option<usize>)> = None;
        let mut take = |depth: Option<f64>, what| {
            if let Some(d) = depth
                && worst.is_none_or(|w| d > w.0)
            {
                worst = Some((d, what));
            }
        };
        for [a, b] in &self.barriers {
            let (p, q) = (world * a, world * b);
            if p.x.min(q.x) < reach && p.x.max(q.x) > -reach && p.y.min(q.y) < reach && p.y.max(q.y) > -reach {
                take(self.overlap(&[p, q]), None);
            }
        }
        for (i, outline) in self.obstacles.iter().enumerate() {
            let seen: Vec<Point2<f64>> = outline.iter().map(|p| world * p).collect();
            take(self.overlap(&seen), Some(i));
        }
        worst
    }

    /// How far a convex outline (in the base's frame) reaches into the base's rectangle, by separating axes; `None` when apart.
    fn overlap(&self, outline: &[Point2<f64>]) -> Option<f64> {
        let mut least = f64::INFINITY;
        let mut axes = vec![Vector2::x(), Vector2::y()];
        for k in 0..outline.len() {
            let d = outline[(k + 1) % outline.len()] - outline[k];
            if let Some(n) = Vector2::new(d.y, -d.x).try_normalize(1e-9) {
                axes.push(n);
            }
        }
        for axis in axes {
            let own = self.half[0] * axis.x.abs() + self.half[1] * axis.y.abs();
            let along = outline.iter().map(|p| p.coords.dot(&axis));
            let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |b, x| (b.0.min(x), b.1.max(x)));
            let depth = (own - low).min(high + own);
            if depth <= 0.0 {
                return None;
            }
            least = least.min(depth);
        }
        Some(least)
    }
}

/// The convex hull, counter-clockwise (Andrew's monotone chain).
fn hull(mut points: Vec<Point2<f64>>) -> Vec<Point2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup_by(|a, b| (*a - *b).norm() < 1e-6);
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = Point2<f64>>| {
        let mut chain: Vec<Point2<f64>> = Vec::new();
        for p in points {
            while chain.len() >= 2 && {
                let n = chain.len();
                (chain[n - 1] - chain[n - 2]).perp(&(p - chain[n - 2])) <= 1e-12
            } {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut lower = half(&mut points.iter().copied());
    lower.extend(half(&mut points.iter().rev().copied()));
    lower
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_square_is_its_corners() {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.5, 0.5), (0.5, 0.0)];
        assert_eq!(hull(corners.iter().map(|(x, y)| Point2::new(*x, *y)).collect()).len(), 4);
    }

    #[test]
    fn a_rectangle_meets_what_it_meets() {
        let floor = Floor {
            barriers: vec![[Point2::new(1.0, -5.0), Point2::new(1.0, 5.0)]],
            obstacles: vec![vec![Point2::new(-2.0, -0.1), Point2::new(-1.0, -0.1), Point2::new(-1.5, 0.4)]],
            half: [0.5, 0.4],
        };
        let pose = |x: f64, deg: f64| BasePose { x, y: 0.0, heading: deg.to_radians() };
        assert!(floor.is_clear(&pose(0.45, 0.0)) && !floor.is_clear(&pose(0.55, 0.0)));
        // turned by a quarter it is narrower, turned by an eighth wider
        assert!(floor.is_clear(&pose(0.55, 90.0)) && !floor.is_clear(&pose(0.45, 45.0)));
        let meeting = floor.meeting(&pose(-0.6, 0.0)).unwrap();
        assert!(meeting.what.contains("(1)") && (meeting.missing - 0.1).abs() < 1e-9, "{}", meeting.missing);
    }
}
