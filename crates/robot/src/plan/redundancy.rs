//! Global resolution of redundancy along a stretch of a stroke, where following it step by step runs into a wall.
use std::collections::BTreeSet;

use crate::plan::field::{SEEDS, Workcell};
use crate::plan::spline::JointSpline;
use crate::plan::waypoint::{Waypoint, separation};
use crate::plan::{PenTarget, Posture};
use crate::robot::{JointVector, MAX_DOF};

/// Distance between layers of the search (m plus 0.2 m per rad).
const LAYER: f64 = 0.008;
/// Edge of the joint-space cells of which each holds one configuration, rad.
const CELL: f64 = 0.15;
/// Step by which self-motion is explored, rad.
const EXPLORE: f64 = 0.2;
/// Configurations per layer.
const POPULATION: usize = 400;
/// Layers between two explorations of self-motion.
const EXPLORE_EVERY: usize = 3;
/// Largest step of a joint from layer to layer, rad.
const EDGE: f64 = 0.35;
/// Weight of a node's discomfort per metre against squared joint motion per metre.
const DISCOMFORT: f64 = 2.0;
/// Passes of smoothing over the found path.
const SMOOTHING: usize = 40;

/// A joint path over some of a stroke's waypoints.
pub struct Ladder {
    /// Indices of the waypoints, rising.
    pub rungs: Vec<usize>,
    /// Configurations at them.
    pub q: Vec<JointVector>,
}

struct Node {
    q: JointVector,
    cost: f64,
    parent: usize,
}

/// The joint path of least motion and discomfort from waypoint `from` towards waypoint `to`, over all ways to resolve
/// the redundancy, in all branches. It ends early where no configuration can go on. It begins at `start`, or anywhere.
///
/// Dynamic programming over layers of configurations: each layer holds those of the layer before carried on, and
/// their neighbours by self-motion, one per cell of joint space; an edge joins what is near in joint space.
pub fn search(cell: &Workcell, way: &[Waypoint], from: usize, to: usize, start: Option<&JointVector>) -> Ladder {
    let mut rungs = vec![from];
    for i in from + 1..=to {
        let last = rungs[rungs.len() - 1];
        if separation(&way[last].target, &way[i].target) >= LAYER || i == to {
            rungs.push(i);
        }
    }
    let first: Vec<JointVector> = match start {
        Some(q) => vec![*q],
        None => {
            let seeds =
                cell.solutions(&way[from].target, SEEDS).map(|s| s.iter().map(|s| s.q).collect()).unwrap_or_default();
            spread(cell, &way[from].target, seeds, usize::MAX).into_iter().map(|n| n.0).collect()
        }
    };
    let mut layers = vec![first.into_iter().map(|q| Node { q, cost: 0.0, parent: 0 }).collect::<Vec<_>>()];
    for l in 1..rungs.len() {
        let target = &way[rungs[l]].target;
        let gap = separation(&way[rungs[l - 1]].target, target).max(1e-4);
        let before = &layers[l - 1];
        let carried = before
            .iter()
            .filter_map(|n| cell.solver.follow(target, &n.q, &Posture { reference: n.q, pull: 0.0, most: 0.0 }).ok())
            .map(|s| s.q)
            .collect();
        let rings = if l % EXPLORE_EVERY == 1 { 2 } else { 0 };
        let layer: Vec<Node> = spread(cell, target, carried, rings)
            .into_iter()
            .filter_map(|(q, discomfort)| {
                let mut best: Option<(f64, usize)> = None;
                for (i, n) in before.iter().enumerate() {
                    if (n.q - q).amax() > EDGE {
                        continue;
                    }
                    let cost = n.cost + cell.solver.distance_squared(&n.q, &q) / gap;
                    if best.is_none_or(|b| cost < b.0) {
                        best = Some((cost, i));
                    }
                }
                best.map(|(cost, parent)| Node { q, cost: cost + DISCOMFORT * gap * discomfort, parent })
            })
            .collect();
        if layer.is_empty() {
            break;
        }
        layers.push(layer);
    }
    rungs.truncate(layers.len());
    let mut q = Vec::with_capacity(layers.len());
    let mut at = (0..layers[layers.len() - 1].len())
        .min_by(|a, b| layers[layers.len() - 1][*a].cost.total_cmp(&layers[layers.len() - 1][*b].cost));
    for layer in layers.iter().rev() {
        if let Some(node) = at.map(|i| &layer[i]) {
            q.push(node.q);
            at = Some(node.parent);
        }
    }
    q.reverse();
    rungs.truncate(q.len());
    let mut ladder = Ladder { rungs, q };
    ladder.smooth(cell, way, start.is_some());
    ladder
}

impl Ladder {
    /// Pulls each configuration to the middle of its neighbours, within its self-motion and where it is allowed.
    fn smooth(&mut self, cell: &Workcell, way: &[Waypoint], keep_start: bool) {
        for _ in 0..SMOOTHING {
            for i in usize::from(keep_start)..self.q.len() {
                let target = &way[self.rungs[i]].target;
                let reference = match (i, self.q.len()) {
                    (_, 1) => self.q[i],
                    (0, _) => self.q[1],
                    (i, n) if i + 1 == n => self.q[n - 2],
                    _ => (self.q[i - 1] + self.q[i + 1]) * 0.5,
                };
                let posture = Posture { reference, pull: 0.7, most: 0.1 };
                if let Ok(s) = cell.solver.follow(target, &self.q[i], &posture)
                    && cell.check(&s).is_ok()
                {
                    self.q[i] = s.q;
                }
            }
        }
    }

    /// A guide through the rungs: a posture for every waypoint from the first rung to the last.
    pub fn guide(&self, way: &[Waypoint]) -> Vec<JointVector> {
        let (Some(first), Some(last)) = (self.rungs.first(), self.rungs.last()) else { return Vec::new() };
        if first == last {
            return self.q.clone();
        }
        let mut s = vec![0.0];
        for i in *first..*last {
            s.push(s[s.len() - 1] + separation(&way[i].target, &way[i + 1].target).max(1e-6));
        }
        let spline = JointSpline::new(self.rungs.iter().map(|r| s[r - first]).collect(), self.q.clone());
        let mut cursor = 0;
        s.iter().map(|s| spline.at(*s, &mut cursor).q).collect()
    }
}

/// Configurations at `target` with their discomfort, one per cell of joint space: `seeds`, and what self-motion
/// reaches from them within `rings` steps.
fn spread(cell: &Workcell, target: &PenTarget, seeds: Vec<JointVector>, rings: usize) -> Vec<(JointVector, f64)> {
    let mut seen: BTreeSet<[i32; MAX_DOF]> = BTreeSet::new();
    let mut found: Vec<(JointVector, f64)> = Vec::new();
    let mut frontier = seeds;
    let still = |q: &JointVector| Posture { reference: *q, pull: 0.0, most: 0.0 };
    for ring in 0.. {
        let begin = found.len();
        for q in &frontier {
            if found.len() >= POPULATION || !seen.insert(std::array::from_fn(|i| (q[i] / CELL).round() as i32)) {
                continue;
            }
            if let Ok(s) = cell.solver.follow(target, q, &still(q))
                && let Some(d) = cell.discomfort(&s)
            {
                found.push((s.q, d));
            }
        }
        if ring >= rings || begin == found.len() || found.len() >= POPULATION {
            return found;
        }
        frontier = found[begin..].iter().flat_map(|(q, _)| neighbours(cell, target, q)).collect();
    }
    found
}

/// Configurations one step of self-motion away from `q`.
fn neighbours(cell: &Workcell, target: &PenTarget, q: &JointVector) -> Vec<JointVector> {
    let arm = cell.surroundings.arm();
    let j = crate::plan::ik::task_jacobian(&arm.kinematics(q), target);
    let mut out = Vec::new();
    for i in 0..arm.dof() {
        // a joint that doesn't move the pen at all is no redundancy worth exploring
        if j.column(i).norm() < 1e-6 {
            continue;
        }
        for sign in [-1.0, 1.0] {
            let mut posture = Posture { reference: *q, pull: 1.0, most: EXPLORE };
            posture.reference[i] += 2.0 * sign * EXPLORE;
            if let Ok(s) = cell.solver.follow(target, q, &posture) {
                out.push(s.q);
            }
        }
    }
    out
}
