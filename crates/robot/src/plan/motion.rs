//! Motion through the air, from pose to pose without touching anything.
use crate::plan::field::Workcell;
use crate::plan::spline::JointSpline;
use crate::plan::surroundings::PenUse;
use crate::plan::timing::{Piece, join, straight};
use crate::plan::waypoint::midway;
use crate::plan::{MotionLimits, PenTarget, Posture, Trajectory};
use crate::robot::JointVector;
use nalgebra::Vector3;

/// How a way through the air was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TravelKind {
    /// Straight in joint space.
    Direct,
    /// In an arch over the canvas, or up, over and down.
    Raised,
    /// By a search in joint space.
    Searched,
}

/// Heights of arches between hover poses that are tried, m.
const ARCHES: [f64; 4] = [0.01, 0.03, 0.06, 0.1];
/// Length of the tip's way between two poses of an arch, m.
const ARCH_STEP: f64 = 0.01;
/// Heights above the hover poses that are tried when no arch is free, m.
const RAISES: [f64; 4] = [0.03, 0.06, 0.12, 0.2];
/// Step of the search trees, rad.
const TREE_STEP: f64 = 0.3;
/// Samples of the search.
const TREE_SAMPLES: usize = 1500;

/// A collision-free motion from rest at `from` to rest at `to`: straight if that is free, else over raised poses, else
/// searched for (RRT-Connect, Kuffner and LaValle 2000, doi:10.1109/ROBOT.2000.844730, on a low-discrepancy sequence, so that
/// it finds the same way every time). `None` when none is found.
pub fn travel(
    cell: &Workcell,
    from: &JointVector,
    to: &JointVector,
    limits: &MotionLimits,
) -> Option<(Trajectory, TravelKind)> {
    if clear(cell, from, to) {
        return motion(cell, &[*from, *to], limits).map(|t| (t, TravelKind::Direct));
    }
    for height in ARCHES {
        if let Some(t) = arched(cell, from, to, height, limits) {
            return Some((t, TravelKind::Raised));
        }
    }
    for raise in RAISES {
        let (Some(a), Some(b)) = (raised(cell, from, raise), raised(cell, to, raise)) else { continue };
        for via in [vec![*from, a, b, *to], vec![*from, a, *to], vec![*from, b, *to]] {
            if via.windows(2).all(|w| clear(cell, &w[0], &w[1])) {
                return motion(cell, &via, limits).map(|t| (t, TravelKind::Raised));
            }
        }
    }
    let lift = |q: &JointVector| raised(cell, q, RAISES[0]).filter(|up| clear(cell, q, up)).unwrap_or(*q);
    let (a, b) = (lift(from), lift(to));
    let mut path = vec![*from];
    path.extend(connect(cell, &a, &b)?);
    path.push(*to);
    path.dedup();
    shorten(cell, &mut path);
    motion(cell, &path, limits).map(|t| (t, TravelKind::Searched))
}

/// Whether the straight joint motion is free.
fn clear(cell: &Workcell, a: &JointVector, b: &JointVector) -> bool {
    cell.surroundings.obstruction(a, b, PenUse::Travelling).is_none()
}

/// One bow from `from` to `to` whose middle lies `height` over the middle between them, if all of it is free.
fn arched(
    cell: &Workcell,
    from: &JointVector,
    to: &JointVector,
    height: f64,
    limits: &MotionLimits,
) -> Option<Trajectory> {
    let arm = cell.solver.arm();
    let pose = |q: &JointVector| {
        let tip = *arm.kinematics(q).world_from_tip();
        PenTarget { position: tip.translation.vector.into(), axis: tip.rotation * Vector3::z() }
    };
    let mut top = midway(&pose(from), &pose(to));
    top.position -= top.axis * height;
    let middle = (from + to) * 0.5;
    let top = cell.solver.follow(&top, &middle, &Posture { reference: middle, pull: 0.0, most: 0.0 }).ok()?.q;
    let bow = JointSpline::new(vec![0.0, 0.5, 1.0], vec![*from, top, *to]);
    let length = tip_length(cell, from, &top) + tip_length(cell, &top, to);
    let count = (length / ARCH_STEP).ceil().clamp(8.0, 200.0) as usize;
    let mut cursor = 0;
    let q: Vec<JointVector> = (0..=count).map(|i| bow.at(i as f64 / count as f64, &mut cursor).q).collect();
    let (lower, upper) = cell.solver.bounds();
    if q.iter().any(|q| q != &q.sup(lower).inf(upper)) || !q.windows(2).all(|w| clear(cell, &w[0], &w[1])) {
        return None;
    }
    let positions: Vec<Vector3<f64>> =
        q.iter().map(|q| arm.kinematics(q).world_from_tip().translation.vector).collect();
    Some(Trajectory::new(Piece::new(q, &positions, cell.options.travel_speed).time(limits)))
}

/// The pose with the pen drawn back by `height` along its own axis, if the arm can.
fn raised(cell: &Workcell, q: &JointVector, height: f64) -> Option<JointVector> {
    let tip = *cell.solver.arm().kinematics(q).world_from_tip();
    let axis = tip.rotation * Vector3::z();
    let still = Posture { reference: *q, pull: 0.0, most: 0.0 };
    let mut up = *q;
    for share in [0.5, 1.0] {
        let target = PenTarget { position: (tip.translation.vector - axis * (height * share)).into(), axis };
        up = cell.solver.follow(&target, &up, &still).ok()?.q;
    }
    Some(up)
}

/// Straight legs from rest to rest through `via`.
fn motion(cell: &Workcell, via: &[JointVector], limits: &MotionLimits) -> Option<Trajectory> {
    join(via.windows(2).filter(|w| w[0] != w[1]).map(|w| {
        let length = tip_length(cell, &w[0], &w[1]);
        // the tip too keeps its limits: peaks of least-jerk motion are 15/8 D/T and 10/sqrt(3) D/T^2
        let slowest = (1.875 * length / cell.options.travel_speed)
            .max((10.0 / 3f64.sqrt() * length / cell.options.cartesian_acceleration).sqrt());
        straight(&w[0], &w[1], limits, slowest)
    }))
    .or_else(|| via.first().map(|q| Trajectory::rest(*q, 0.0)))
}

/// Length of the tip's way on the straight joint motion, m.
fn tip_length(cell: &Workcell, a: &JointVector, b: &JointVector) -> f64 {
    let at = |u: f64| cell.solver.arm().kinematics(&(a + (b - a) * u)).world_from_tip().translation.vector;
    let n = 6;
    (0..n).map(|i| (at(f64::from(i + 1) / f64::from(n)) - at(f64::from(i) / f64::from(n))).norm()).sum()
}

struct Tree {
    nodes: Vec<(JointVector, usize)>,
}

impl Tree {
    fn nearest(&self, q: &JointVector) -> usize {
        let gap = |i: &usize| (self.nodes[*i].0 - q).norm_squared();
        (0..self.nodes.len()).min_by(|a, b| gap(a).total_cmp(&gap(b))).unwrap_or(0)
    }

    /// A step from the nearest node towards `q`: the new node, and whether it is `q`.
    fn extend(&mut self, cell: &Workcell, q: &JointVector) -> Option<(usize, bool)> {
        let near = self.nearest(q);
        let from = self.nodes[near].0;
        let gap = (q - from).amax();
        let (to, arrived) = if gap <= TREE_STEP { (*q, true) } else { (from + (q - from) * (TREE_STEP / gap), false) };
        clear(cell, &from, &to).then(|| {
            self.nodes.push((to, near));
            (self.nodes.len() - 1, arrived)
        })
    }

    fn path_to(&self, mut i: usize) -> Vec<JointVector> {
        let mut path = vec![self.nodes[i].0];
        while i != 0 {
            i = self.nodes[i].1;
            path.push(self.nodes[i].0);
        }
        path.reverse();
        path
    }
}

/// Two trees that grow towards each other.
fn connect(cell: &Workcell, from: &JointVector, to: &JointVector) -> Option<Vec<JointVector>> {
    let mut trees = [Tree { nodes: vec![(*from, 0)] }, Tree { nodes: vec![(*to, 0)] }];
    for k in 0..TREE_SAMPLES {
        let (grow, meet) = (k % 2, 1 - k % 2);
        let Some((node, _)) = trees[grow].extend(cell, &cell.configuration(k + 1)) else { continue };
        let goal = trees[grow].nodes[node].0;
        while let Some((other, arrived)) = trees[meet].extend(cell, &goal) {
            if arrived {
                let (a, b) = (trees[grow].path_to(node), trees[meet].path_to(other));
                let (mut path, mut back) = if grow == 0 { (a, b) } else { (b, a) };
                back.reverse();
                path.extend(back.into_iter().skip(1));
                return Some(path);
            }
        }
    }
    None
}

/// Leaves out what can be left out.
fn shorten(cell: &Workcell, path: &mut Vec<JointVector>) {
    let mut i = 0;
    while i + 2 < path.len() {
        let far = (i + 2..path.len()).rev().find(|j| clear(cell, &path[i], &path[*j]));
        if let Some(j) = far {
            path.drain(i + 1..j);
        }
        i += 1;
    }
}
