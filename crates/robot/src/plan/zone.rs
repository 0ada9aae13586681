//! The space that arms sweep in pieces of their work, as cells: arms whose cells differ may move at the same time.
use nalgebra::{Point3, Vector3};

use crate::plan::Segment;
use crate::robot::{ArmModel, Capsule, JointVector, segment_distance};

/// Edge of a cell, m.
const CELL: f64 = 0.012;
/// Any point of a cell is no farther from its middle than this, m.
const HALF_DIAGONAL: f64 = 0.5 * CELL * 1.7321;
/// How far a point of the arm may move between looks, m.
const STRIDE: f64 = 0.006;
/// Time between looks, s, which see whether it has.
const LOOK: f64 = 0.005;

/// How an arm stands in a piece of its work, closely enough that no point moves by more than 6 mm in between.
pub struct Sweep {
    capsules: Vec<Capsule>,
    low: Point3<f64>,
    high: Point3<f64>,
}

impl Sweep {
    /// All links of `arm` but its base in the motion of `segments`.
    pub fn new(arm: &ArmModel, segments: &[&Segment]) -> Self {
        let reach = arm.reach();
        let mut capsules = Vec::new();
        let mut last: Option<JointVector> = None;
        for segment in segments {
            let duration = segment.trajectory.duration();
            let mut cursor = 0;
            for i in 0..=(duration / LOOK).ceil() as usize {
                let q = segment.trajectory.sample((i as f64 * LOOK).min(duration), &mut cursor).q;
                // half of it: as much again may follow until the next look
                if last.is_none_or(|was| (q - was).abs().dot(&reach) > 0.5 * STRIDE) {
                    capsules.extend(arm.capsules(&arm.kinematics(&q), 1));
                    last = Some(q);
                }
            }
        }
        let mut sweep = Self { capsules, low: Point3::origin(), high: Point3::origin() };
        let ends = |c: &Capsule| [(c.a, c.radius), (c.b, c.radius)];
        let far = sweep.capsules.iter().flat_map(ends).fold(None, |box_, (p, r)| {
            let r = Vector3::repeat(r);
            let (low, high) = box_.unwrap_or((p - r, p + r));
            Some((low.inf(&(p - r)), high.sup(&(p + r))))
        });
        (sweep.low, sweep.high) = far.unwrap_or((Point3::origin(), Point3::origin()));
        sweep
    }
}

/// The box in which two arms may meet, in cells.
pub struct Space {
    low: Point3<f64>,
    count: [usize; 3],
    /// How far round an arm cells are its own, m.
    wider: f64,
}

impl Space {
    /// Where any of `one` may come nearer than `margin` (m) to any of `other`.
    pub fn between(one: &[&Sweep], other: &[&Sweep], margin: f64) -> Self {
        let wider = 0.5 * margin + STRIDE + HALF_DIAGONAL;
        let bounds = |sweeps: &[&Sweep]| {
            let boxes = sweeps.iter().filter(|s| !s.capsules.is_empty()).map(|s| (s.low, s.high));
            boxes.reduce(|(a, b), (c, d)| (a.inf(&c), b.sup(&d)))
        };
        let (Some((a, b)), Some((c, d))) = (bounds(one), bounds(other)) else {
            return Self { low: Point3::origin(), count: [0; 3], wider };
        };
        let more = Vector3::repeat(wider);
        let (low, high) = (a.sup(&c) - more, b.inf(&d) + more);
        let count = [0, 1, 2].map(|i| ((high[i] - low[i]) / CELL).ceil().max(0.0) as usize);
        Self { low, count, wider }
    }

    /// Cells near to what is swept.
    pub fn zone(&self, sweep: &Sweep) -> Zone {
        let [nx, ny, nz] = self.count;
        let mut cells = vec![0u64; (nx * ny * nz).div_ceil(64)];
        for c in &sweep.capsules {
            let near = c.radius + self.wider;
            let range = |i: usize| {
                let (low, high) = (c.a[i].min(c.b[i]) - near, c.a[i].max(c.b[i]) + near);
                let index = |x: f64| ((x - self.low[i]) / CELL).clamp(0.0, self.count[i] as f64) as usize;
                index(low)..(index(high) + 1).min(self.count[i])
            };
            let [xs, ys, zs] = [0, 1, 2].map(range);
            for x in xs {
                for y in ys.clone() {
                    for z in zs.clone() {
                        let at = (x * ny + y) * nz + z;
                        let bit = 1 << (at % 64);
                        if cells[at / 64] & bit == 0 {
                            let middle = self.low + Vector3::from([x, y, z].map(|k| (k as f64 + 0.5) * CELL));
                            if segment_distance(&c.a, &c.b, &middle, &middle) <= near {
                                cells[at / 64] |= bit;
                            }
                        }
                    }
                }
            }
        }
        Zone { cells }
    }
}

/// Cells of a [`Space`] that a moving arm comes near to. Arms whose zones share no cell are never nearer than the space's margin.
pub struct Zone {
    cells: Vec<u64>,
}

impl Zone {
    /// Whether another zone of the same space has a cell of this one.
    pub fn meets(&self, other: &Self) -> bool {
        self.cells.iter().zip(&other.cells).any(|(a, b)| a & b != 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::separation::{Motion, nearest};
    use crate::plan::{Knot, SegmentKind, Trajectory};
    use crate::robot::Cell;
    use std::path::Path;

    #[test]
    fn zones_that_share_no_cell_keep_arms_apart() {
        let cell = Cell::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/dual_ur5e.toml")).unwrap();
        let [a, b] = [&cell.arms[0], &cell.arms[1]];
        let swing = |home: &JointVector, by: f64| {
            let mut q = *home;
            q[0] += by;
            let knot = |time, q| Knot { time, q, qd: JointVector::zeros(), qdd: JointVector::zeros() };
            let trajectory = Trajectory::new(vec![knot(0.0, *home), knot(3.0, q)]);
            Segment {
                kind: SegmentKind::Travel,
                layer: 0,
                stroke: None,
                start: 0.0,
                trajectory,
                depth: Default::default(),
            }
        };
        let mut seen = [0, 0];
        for k in 0..6 {
            let by = 0.35 * f64::from(k);
            for (s, t) in [(by, -by), (-by, by), (by, by)] {
                let (one, two) = (swing(&a.home, s), swing(&b.home, t));
                let margin = 0.05;
                let (p, q) = (Sweep::new(&a.model, &[&one]), Sweep::new(&b.model, &[&two]));
                let space = Space::between(&[&p], &[&q], margin);
                let apart = !space.zone(&p).meets(&space.zone(&q));
                let way = |s: &Segment| {
                    let mut cursor = 0;
                    let end = s.trajectory.duration();
                    (0..=200)
                        .map(|i| end * f64::from(i) / 200.0)
                        .map(|t| (t, s.trajectory.sample(t, &mut cursor).q))
                        .collect()
                };
                let (m, n) = (Motion { arm: &a.model, way: way(&one) }, Motion { arm: &b.model, way: way(&two) });
                let least = nearest(&m, &n, 0.005).unwrap().distance;
                seen[usize::from(apart)] += 1;
                assert!(!apart || least >= margin - 0.01, "{s} {t}: {least} m");
            }
        }
        assert!(seen[0] > 0 && seen[1] > 0, "{seen:?}");
    }
}
