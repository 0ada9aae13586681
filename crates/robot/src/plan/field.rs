//! Postures that a whole drawing is drawn in, so that strokes solved apart from each other fit together.
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::plan::reach::Obstruction;
use crate::plan::surroundings::{PenUse, Surroundings};
use crate::plan::waypoint::{between, separation};
use crate::plan::{IkSolution, IkSolver, PenTarget, PlanOptions, Posture, dexterity};
use crate::robot::JointVector;

/// One posture, and how the arm stands in it at places spread over the drawing.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Posture that redundancy is drawn to everywhere.
    pub posture: JointVector,
    /// Solved places.
    anchors: Vec<(PenTarget, JointVector)>,
}

/// Postures for a drawing, best first.
///
/// Redundancy is resolved by place, not by history: at every target the arm takes the solution nearest to the
/// reference posture, so that strokes can be solved in any order, neighbours get like postures, and closed strokes
/// close in joint space too.
#[derive(Clone, Debug, Default)]
pub struct PostureField {
    references: Vec<Reference>,
}

/// What every part of path-wise inverse kinematics needs.
pub struct Workcell<'a> {
    /// Inverse kinematics.
    pub solver: IkSolver<'a>,
    /// What must not be touched.
    pub surroundings: Surroundings<'a>,
    /// Speeds and margins.
    pub options: &'a PlanOptions,
    /// Where the arm waits: postures near it are preferred.
    pub home: JointVector,
}

/// Places at which candidate postures are compared.
const ANCHORS: usize = 40;
/// Configurations from which a first pose is sought.
pub const SEEDS: usize = 96;
/// Candidates that are compared over all anchors.
const CANDIDATES: usize = 12;
/// References that are kept.
const REFERENCES: usize = 6;
/// Share of the way to the reference per step of a slide from place to place.
const SLIDE_PULL: f64 = 0.3;
/// Longest step of a slide (distance in m plus 0.2 m per rad).
const SLIDE_STEP: f64 = 0.025;

impl Workcell<'_> {
    /// Whether the arm may draw at a solution: far enough from singularities, with room around it.
    pub fn check(&self, solution: &IkSolution) -> Result<f64, Obstruction> {
        let dexterity = dexterity(&solution.kinematics);
        if dexterity < self.options.singularity_margin {
            return Err(Obstruction::Singular { dexterity });
        }
        let clearance = self.surroundings.clearance(&solution.kinematics, PenUse::Drawing);
        if !clearance.is_clear() {
            return Err(Obstruction::from_clearance(self.surroundings.arm(), &clearance));
        }
        Ok(clearance.excess)
    }

    /// How uncomfortable a solution is: near limits, near a singularity, far from home. `None` where it may not be.
    pub fn discomfort(&self, solution: &IkSolution) -> Option<f64> {
        let clearance = self.check(solution).ok()?;
        let (lower, upper) = self.solver.bounds();
        let mut cost = 0.1 / dexterity(&solution.kinematics) + 0.002 / (clearance + 0.005);
        for i in 0..self.surroundings.arm().dof() {
            let gap = (solution.q[i] - lower[i]).min(upper[i] - solution.q[i]);
            cost += 0.05 / (gap + 0.05);
        }
        Some(cost + 0.1 * self.solver.distance_squared(&solution.q, &self.home))
    }

    /// Configuration `k` of a deterministic sequence spread evenly over the joints' ranges (an additive recurrence in
    /// the generalised golden ratio, Roberts 2018). Unbounded joints range over a turn.
    pub fn configuration(&self, k: usize) -> JointVector {
        let arm = self.surroundings.arm();
        let (lower, upper) = self.solver.bounds();
        // root of x^(d + 1) = x + 1
        let mut ratio: f64 = 1.5;
        for _ in 0..30 {
            ratio = (1.0 + ratio).powf(1.0 / (arm.dof() as f64 + 1.0));
        }
        JointVector::from_fn(|i, _| {
            if i >= arm.dof() {
                return 0.0;
            }
            let u = (0.5 + k as f64 * ratio.powi(-(i as i32 + 1))).fract();
            let (low, high) = (lower[i].max(-std::f64::consts::PI), upper[i].min(std::f64::consts::PI));
            low + u * (high - low)
        })
    }

    /// Configurations from which a first pose is sought, home first.
    fn seeds(&self, count: usize) -> impl Iterator<Item = JointVector> + '_ {
        std::iter::once(self.solver.clamp(&self.home)).chain((1..count).map(|k| self.configuration(k)))
    }

    /// Solutions of one target from the first `seeds` seeds that the arm may take, and the best reason why not when there are none.
    pub fn solutions(&self, target: &PenTarget, seeds: usize) -> Result<Vec<IkSolution>, Obstruction> {
        let arm = self.surroundings.arm();
        let mut found: Vec<IkSolution> = Vec::new();
        // the reason worth telling is that of the attempt that came nearest
        let mut reason: Option<(Obstruction, f64)> = None;
        for seed in self.seeds(seeds) {
            let (failed, near) = match self.solver.reach(target, &seed) {
                Ok(s) => match self.check(&s) {
                    Ok(_) => {
                        if found.iter().all(|o| (o.q - s.q).amax() > 0.05) {
                            found.push(s);
                        }
                        continue;
                    }
                    Err(r) => (r, 0.0),
                },
                Err(f) => (Obstruction::from_failure(arm, &f), f.position_error + 0.2 * f.axis_error),
            };
            let key = |r: &Obstruction| std::cmp::Reverse(r.rank());
            if reason.as_ref().is_none_or(|(r, n)| key(&failed).cmp(&key(r)).then(near.total_cmp(n)).is_lt()) {
                reason = Some((failed, near));
            }
        }
        let reason = reason.map(|r| r.0);
        if found.is_empty() { Err(self.settle_reason(target, reason)) } else { Ok(found) }
    }

    /// A joint limit is only to blame when the arm could get there without it.
    fn settle_reason(&self, target: &PenTarget, reason: Option<Obstruction>) -> Obstruction {
        let free = self.solver.unlimited();
        match reason {
            Some(Obstruction::JointLimit { .. } | Obstruction::OutOfReach { .. }) | None => {
                let mut nearest = f64::INFINITY;
                for seed in self.seeds(12) {
                    match free.reach(target, &seed) {
                        Ok(_) => return reason.unwrap_or(Obstruction::NoApproach),
                        Err(f) => nearest = nearest.min(f.position_error),
                    }
                }
                Obstruction::OutOfReach { distance: nearest }
            }
            Some(r) => r,
        }
    }

    /// Slides the arm from a solved place to another, drawn to `reference` all the way.
    fn slide(
        &self,
        from: &PenTarget,
        q: &JointVector,
        to: &PenTarget,
        reference: &JointVector,
    ) -> Result<IkSolution, Obstruction> {
        let arm = self.surroundings.arm();
        let posture = Posture { reference: *reference, pull: SLIDE_PULL, most: 0.1 };
        let steps = (separation(from, to) / SLIDE_STEP).ceil().max(1.0) as usize;
        let mut q = *q;
        for i in 1..steps {
            let target = between(from, to, i as f64 / steps as f64);
            q = self.solver.follow(&target, &q, &posture).map_err(|f| Obstruction::from_failure(arm, &f))?.q;
        }
        self.solver.settle(to, &q, &posture).map_err(|f| Obstruction::from_failure(arm, &f))
    }
}

impl Reference {
    /// The arm's solution at `target` in this posture, or why there is none.
    pub fn start(&self, cell: &Workcell, target: &PenTarget) -> Result<IkSolution, Obstruction> {
        let nearest = self
            .anchors
            .iter()
            .min_by(|a, b| separation(&a.0, target).total_cmp(&separation(&b.0, target)))
            .ok_or(Obstruction::NoApproach)?;
        let solution = cell.slide(&nearest.0, &nearest.1, target, &self.posture)?;
        cell.check(&solution).map(|_| solution)
    }
}

impl PostureField {
    /// Compares postures over places spread across `targets` (all set points of a drawing) and keeps the best: those
    /// that reach most places, then the most comfortable.
    pub fn new(cell: &Workcell, targets: &[PenTarget]) -> Self {
        let anchors = spread(targets);
        // parent of each anchor: the nearest one before it
        let parents: Vec<usize> = (0..anchors.len())
            .map(|i| {
                (0..i)
                    .min_by(|a, b| {
                        separation(&anchors[*a], &anchors[i]).total_cmp(&separation(&anchors[*b], &anchors[i]))
                    })
                    .unwrap_or(0)
            })
            .collect();
        for root in 0..anchors.len().min(10) {
            let candidates = candidates(cell, &anchors[root]);
            if candidates.is_empty() {
                continue;
            }
            let mut judged: Vec<(usize, f64, usize, Reference)> = candidates
                .par_iter()
                .enumerate()
                .map(|(rank, q)| {
                    let (missed, cost, reference) = judge(cell, &anchors, &parents, root, q);
                    (missed, cost, rank, reference)
                })
                .collect();
            judged.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
            return Self { references: judged.into_iter().take(REFERENCES).map(|j| j.3).collect() };
        }
        Self { references: Vec::new() }
    }

    /// A field of one posture, known at one place.
    #[cfg(test)]
    pub(crate) fn alone(posture: JointVector, place: PenTarget) -> Self {
        Self { references: vec![Reference { posture, anchors: vec![(place, posture)] }] }
    }

    /// References, best first.
    pub fn references(&self) -> &[Reference] {
        &self.references
    }
}

/// Solves every anchor in the posture of `q` at anchor `root`: how many fail, mean discomfort, and the reference.
fn judge(
    cell: &Workcell,
    anchors: &[PenTarget],
    parents: &[usize],
    root: usize,
    q: &JointVector,
) -> (usize, f64, Reference) {
    let mut solved: Vec<Option<JointVector>> = vec![None; anchors.len()];
    solved[root] = Some(*q);
    let mut kept = vec![(anchors[root], *q)];
    let (mut missed, mut cost) = (0, 0.0);
    for i in 0..anchors.len() {
        if i == root {
            continue;
        }
        let from = if solved[parents[i]].is_some() { parents[i] } else { root };
        let start = solved[from].unwrap_or(*q);
        let solution = cell.slide(&anchors[from], &start, &anchors[i], q).ok();
        match solution.and_then(|s| cell.discomfort(&s).map(|d| (s, d))) {
            Some((s, d)) => {
                cost += d + 0.2 * cell.solver.distance_squared(&s.q, q);
                solved[i] = Some(s.q);
                kept.push((anchors[i], s.q));
            }
            None => missed += 1,
        }
    }
    (missed, cost / kept.len() as f64, Reference { posture: *q, anchors: kept })
}

/// Comfortable, different configurations at one target, best first.
fn candidates(cell: &Workcell, target: &PenTarget) -> Vec<JointVector> {
    let Ok(solutions) = cell.solutions(target, SEEDS) else { return Vec::new() };
    let mut improved: Vec<(f64, usize, JointVector)> = solutions
        .par_iter()
        .enumerate()
        .filter_map(|(k, s)| improve(cell, target, s).map(|(cost, q)| (cost, k, q)))
        .collect();
    improved.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut kept: Vec<JointVector> = Vec::new();
    for (_, _, q) in improved {
        if kept.len() < CANDIDATES && kept.iter().all(|k| (k - q).amax() > 0.3) {
            kept.push(q);
        }
    }
    kept
}

/// Walks along the self-motion of the arm at `target` while that lowers the discomfort (pattern search).
fn improve(cell: &Workcell, target: &PenTarget, start: &IkSolution) -> Option<(f64, JointVector)> {
    let mut q = start.q;
    let mut cost = cell.discomfort(start)?;
    let mut step = 0.3;
    while step > 0.04 {
        let mut better = false;
        for i in 0..cell.surroundings.arm().dof() {
            for sign in [-1.0, 1.0] {
                let mut posture = Posture { reference: q, pull: 1.0, most: step };
                posture.reference[i] += sign * step;
                let Ok(s) = cell.solver.follow(target, &q, &posture) else { continue };
                if let Some(c) = cell.discomfort(&s)
                    && c < cost - 1e-6
                {
                    (q, cost, better) = (s.q, c, true);
                }
            }
        }
        if !better {
            step *= 0.5;
        }
    }
    Some((cost, q))
}

/// Places spread over `targets`: the one nearest to their middle, then again and again the one farthest from all taken.
fn spread(targets: &[PenTarget]) -> Vec<PenTarget> {
    let stride = targets.len().div_ceil(4000).max(1);
    let pool: Vec<PenTarget> = targets.iter().step_by(stride).copied().collect();
    if pool.is_empty() {
        return Vec::new();
    }
    let middle: Vector3<f64> = pool.iter().map(|t| t.position.coords).sum::<Vector3<f64>>() / pool.len() as f64;
    let by_middle = |t: &PenTarget| (t.position.coords - middle).norm();
    let first = pool.iter().min_by(|a, b| by_middle(a).total_cmp(&by_middle(b))).copied().unwrap_or(pool[0]);
    let mut taken = vec![first];
    let mut gap: Vec<f64> = pool.iter().map(|t| separation(t, &first)).collect();
    while taken.len() < ANCHORS {
        let Some(k) = (0..gap.len()).max_by(|a, b| gap[*a].total_cmp(&gap[*b])) else { break };
        if gap[k] < 0.01 {
            break;
        }
        taken.push(pool[k]);
        for (g, t) in gap.iter_mut().zip(&pool) {
            *g = g.min(separation(t, &pool[k]));
        }
    }
    taken
}
