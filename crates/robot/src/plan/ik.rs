//! Differential inverse kinematics of the pen: three rows of position, two of direction, the turn about the pen free.
use nalgebra::{Matrix5, Point3, SMatrix, Vector3, Vector5};

use crate::robot::{ArmModel, JointVector, Kinematics, MAX_DOF};

/// Where the tip is to be and which way the pen shall point. The turn about the pen's axis is free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PenTarget {
    /// Position of the tip, m, world.
    pub position: Point3<f64>,
    /// Unit direction of the tip's z axis, world: `-n` on a canvas.
    pub axis: Vector3<f64>,
}

/// A posture that redundancy is drawn to.
#[derive(Clone, Copy, Debug)]
pub struct Posture {
    /// Joint positions to be near.
    pub reference: JointVector,
    /// Share of the way to it taken by a step within the null space, in [0, 1].
    pub pull: f64,
    /// Longest way a joint may be sent by that, rad.
    pub most: f64,
}

/// A configuration that reaches a target.
#[derive(Clone, Copy, Debug)]
pub struct IkSolution {
    /// Joint positions.
    pub q: JointVector,
    /// Where everything is there.
    pub kinematics: Kinematics,
    /// Newton steps taken.
    pub iterations: usize,
}

/// How near a failed solution came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IkFailure {
    /// Joint positions at the end.
    pub q: JointVector,
    /// Distance of the tip from the target, m.
    pub position_error: f64,
    /// Angle between the pen and the desired axis, rad.
    pub axis_error: f64,
    /// The joint that stood at its limit, if one did.
    pub at_limit: Option<usize>,
}

/// Jacobian of the pen task: rows 0..3 position (world axes), 3..5 turn about two axes normal to the desired axis.
pub type TaskJacobian = SMatrix<f64, 5, MAX_DOF>;

/// Solves for an arm's joints. Nothing in it allocates.
///
/// A step minimises the weighted distance from `q + g`, where `g` pulls to the posture and away from the limits:
/// `dq = g + V J' (J V J' + lambda^2 I)^-1 (e - J g)`, `V = W^-1`. Joints that a step would carry past a limit are put
/// on it and the rest solved again. Damping `lambda` is only felt near singularities (Nakamura and Hanafusa 1986,
/// doi:10.1115/1.3143764). Joints are weighted by their speed limits, so that "least motion" means least time.
#[derive(Clone, Copy, Debug)]
pub struct IkSolver<'a> {
    arm: &'a ArmModel,
    lower: JointVector,
    upper: JointVector,
    mobility: JointVector,
}

/// Position error at which a solution counts as converged, m.
pub const POSITION_TOLERANCE: f64 = 1e-6;
/// Direction error at which a solution counts as converged, rad.
pub const AXIS_TOLERANCE: f64 = 1e-5;

/// Smallest pivot of `J V J'` that goes undamped.
const UNDAMPED_PIVOT: f64 = 1e-4;
/// Damping (squared) where the pivot vanishes.
const DAMPING: f64 = 1e-4;
/// Longest step of a joint in one iteration, rad.
const STEP_LIMIT: f64 = 0.4;
/// Distance from a joint limit where it starts to push back, rad.
const LIMIT_ZONE: f64 = 0.2;

impl<'a> IkSolver<'a> {
    /// A solver that stays `limit_margin` (rad or m) inside the joint limits of `arm`.
    pub fn new(arm: &'a ArmModel, limit_margin: f64) -> Self {
        let bound = |f: &dyn Fn(usize) -> f64| JointVector::from_fn(|i, _| if i < arm.dof() { f(i) } else { 0.0 });
        let margin = |i: usize| limit_margin.min(0.5 * (arm.joints[i].upper - arm.joints[i].lower)).max(0.0);
        let fastest = arm.joints.iter().map(|j| j.velocity).fold(0.0, f64::max);
        Self {
            arm,
            lower: bound(&|i| arm.joints[i].lower + margin(i)),
            upper: bound(&|i| arm.joints[i].upper - margin(i)),
            mobility: bound(&|i| (arm.joints[i].velocity / fastest).powi(2).max(1e-3)),
        }
    }

    /// The arm.
    pub fn arm(&self) -> &'a ArmModel {
        self.arm
    }

    /// The same solver with no joint limits, to tell a limit from the end of the reach.
    pub fn unlimited(&self) -> Self {
        let wide = JointVector::from_fn(|i, _| if i < self.arm.dof() { f64::INFINITY } else { 0.0 });
        Self { lower: -wide, upper: wide, ..*self }
    }

    /// Lower and upper joint positions that the solver keeps.
    pub fn bounds(&self) -> (&JointVector, &JointVector) {
        (&self.lower, &self.upper)
    }

    /// `q` put inside the limits.
    pub fn clamp(&self, q: &JointVector) -> JointVector {
        JointVector::from_fn(|i, _| q[i].clamp(self.lower[i], self.upper[i]))
    }

    /// Weighted squared distance between two configurations: the motion that is minimised.
    pub fn distance_squared(&self, a: &JointVector, b: &JointVector) -> f64 {
        (0..self.arm.dof()).map(|i| (a[i] - b[i]).powi(2) / self.mobility[i]).sum()
    }

    /// One step along a path: from `seed`, the solution of the point before, to `target` with the least motion, and a
    /// `pull` of the way towards the posture.
    pub fn follow(&self, target: &PenTarget, seed: &JointVector, posture: &Posture) -> Result<IkSolution, IkFailure> {
        self.iterate(target, seed, Some(posture), 1, 12)
    }

    /// The nearest solution to `seed`, from anywhere.
    pub fn reach(&self, target: &PenTarget, seed: &JointVector) -> Result<IkSolution, IkFailure> {
        self.iterate(target, seed, None, 0, 60)
    }

    /// The same in at most `most` Newton steps: enough from nearby, and sooner given up.
    pub fn reach_within(&self, target: &PenTarget, seed: &JointVector, most: usize) -> Result<IkSolution, IkFailure> {
        self.iterate(target, seed, None, 0, most)
    }

    /// The solution of `target` that is nearest to the posture's reference among those that can be slid to from `seed`.
    pub fn settle(&self, target: &PenTarget, seed: &JointVector, posture: &Posture) -> Result<IkSolution, IkFailure> {
        self.iterate(target, seed, Some(posture), 40, 80)
    }

    /// Newton steps until the tolerances hold; the first `pulled` of them also pull towards the posture.
    fn iterate(
        &self,
        target: &PenTarget,
        seed: &JointVector,
        posture: Option<&Posture>,
        pulled: usize,
        most: usize,
    ) -> Result<IkSolution, IkFailure> {
        let mut q = self.clamp(seed);
        let mut at_limit = None;
        let mut moved = f64::INFINITY;
        for iteration in 0..=most {
            let kinematics = self.arm.kinematics(&q);
            let (error, position_error, axis_error) = task_error(&kinematics, target);
            let reached = position_error < POSITION_TOLERANCE && axis_error < AXIS_TOLERANCE;
            if reached && (iteration >= pulled || moved < 1e-5) {
                return Ok(IkSolution { q, kinematics, iterations: iteration });
            }
            if iteration == most || !(position_error + axis_error).is_finite() {
                return Err(IkFailure { q, position_error, axis_error, at_limit });
            }
            let j = task_jacobian(&kinematics, target);
            let pull = match posture {
                Some(p) if iteration < pulled => self.pull(&q, p),
                _ => JointVector::zeros(),
            };
            let (mut dq, limit) = self.step(&j, &error, &q, &pull);
            at_limit = limit;
            let longest = dq.amax();
            if longest > STEP_LIMIT {
                dq *= STEP_LIMIT / longest;
            }
            moved = dq.amax();
            q += dq;
        }
        unreachable!("the loop returns in its last turn")
    }

    /// Where the null space would like to go: to the posture, and off the limits.
    fn pull(&self, q: &JointVector, posture: &Posture) -> JointVector {
        let mut g = (posture.reference - q) * posture.pull;
        for i in 0..self.arm.dof() {
            let zone = LIMIT_ZONE.min(0.25 * (self.upper[i] - self.lower[i]));
            let (low, high) = (zone - (q[i] - self.lower[i]), zone - (self.upper[i] - q[i]));
            g[i] += posture.pull * (low.max(0.0) - high.max(0.0));
        }
        let longest = g.amax();
        if longest > posture.most { g * (posture.most / longest) } else { g }
    }

    /// One damped, weighted, limited least-squares step, and a joint that it put on its limit.
    fn step(
        &self,
        j: &TaskJacobian,
        error: &Vector5<f64>,
        q: &JointVector,
        pull: &JointVector,
    ) -> (JointVector, Option<usize>) {
        let n = self.arm.dof();
        let mut free = [true; MAX_DOF];
        let mut fixed = JointVector::zeros();
        let mut at_limit = None;
        for _ in 0..=n {
            // e - J g, with g the pull of the free joints and the given step of the fixed ones
            let mut rest = *error;
            let mut a = Matrix5::zeros();
            for i in 0..n {
                let column = j.column(i);
                rest -= column * if free[i] { pull[i] } else { fixed[i] };
                if free[i] {
                    for r in 0..5 {
                        let scaled = column[r] * self.mobility[i];
                        for c in 0..=r {
                            a[(r, c)] += scaled * column[c];
                        }
                    }
                }
            }
            let y = solve_damped(&a, &rest);
            let mut dq = fixed;
            let mut hit = false;
            for i in 0..n {
                if free[i] {
                    dq[i] = pull[i] + self.mobility[i] * j.column(i).dot(&y);
                }
            }
            for i in 0..n {
                let to = q[i] + dq[i];
                if free[i] && (to < self.lower[i] || to > self.upper[i]) {
                    free[i] = false;
                    fixed[i] = to.clamp(self.lower[i], self.upper[i]) - q[i];
                    at_limit = Some(i);
                    hit = true;
                }
            }
            if !hit {
                return (dq, at_limit);
            }
        }
        (fixed, at_limit)
    }
}

/// The five rows of the task Jacobian.
pub fn task_jacobian(kinematics: &Kinematics, target: &PenTarget) -> TaskJacobian {
    let full = kinematics.jacobian();
    let (t1, t2) = normal_axes(&target.axis);
    let mut j = TaskJacobian::zeros();
    for i in 0..kinematics.dof() {
        let w = full.fixed_view::<3, 1>(3, i);
        for r in 0..3 {
            j[(r, i)] = full[(r, i)];
        }
        j[(3, i)] = t1.dot(&w);
        j[(4, i)] = t2.dot(&w);
    }
    j
}

/// Smallest singular value of the pen task's Jacobian at `kinematics` (rows in m and rad, per rad): 0 at a singularity.
pub fn dexterity(kinematics: &Kinematics) -> f64 {
    let axis = kinematics.world_from_tip().rotation * Vector3::z();
    let target = PenTarget { position: kinematics.world_from_tip().translation.vector.into(), axis };
    let j = task_jacobian(kinematics, &target);
    (j * j.transpose()).symmetric_eigenvalues().min().max(0.0).sqrt()
}

/// Two unit axes that are normal to unit `axis` and to each other.
fn normal_axes(axis: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let hint = if axis.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    let t1 = (hint - axis * axis.dot(&hint)).normalize();
    (t1, axis.cross(&t1))
}

/// Task error (as rows of the task Jacobian), distance (m) and angle (rad).
fn task_error(kinematics: &Kinematics, target: &PenTarget) -> (Vector5<f64>, f64, f64) {
    let tip = kinematics.world_from_tip();
    let offset = target.position.coords - tip.translation.vector;
    let z = tip.rotation * Vector3::z();
    let cross = z.cross(&target.axis);
    let (sine, cosine) = (cross.norm(), z.dot(&target.axis));
    let angle = sine.atan2(cosine);
    let (t1, t2) = normal_axes(&target.axis);
    // when the pen points the other way every normal axis will do
    let turn = if sine > 1e-12 { cross * (angle / sine) } else { t1 * angle };
    // far away, Newton's direction is all that matters
    let reach = offset.norm();
    let go = if reach > 0.2 { offset * (0.2 / reach) } else { offset };
    let turn = if angle > 0.5 { turn * (0.5 / angle) } else { turn };
    (Vector5::new(go.x, go.y, go.z, t1.dot(&turn), t2.dot(&turn)), reach, angle)
}

/// Solves `(A + lambda^2 I) y = b` by Cholesky on the lower triangle of `a`, with `lambda` raised from nothing where the smallest pivot is small.
fn solve_damped(a: &Matrix5<f64>, b: &Vector5<f64>) -> Vector5<f64> {
    let mut damping = 0.0;
    loop {
        let mut l = *a;
        let mut least = f64::INFINITY;
        for c in 0..5 {
            let mut pivot = l[(c, c)] + damping;
            for k in 0..c {
                pivot -= l[(c, k)] * l[(c, k)];
            }
            least = least.min(pivot);
            let root = pivot.max(1e-12).sqrt();
            l[(c, c)] = root;
            for r in c + 1..5 {
                let mut x = l[(r, c)];
                for k in 0..c {
                    x -= l[(r, k)] * l[(c, k)];
                }
                l[(r, c)] = x / root;
            }
        }
        if damping == 0.0 && least < UNDAMPED_PIVOT {
            damping = DAMPING * (1.0 - least.max(0.0) / UNDAMPED_PIVOT).powi(2) + 1e-9;
            continue;
        }
        let mut y = *b;
        for r in 0..5 {
            for k in 0..r {
                let known = y[k];
                y[r] -= l[(r, k)] * known;
            }
            y[r] /= l[(r, r)];
        }
        for r in (0..5).rev() {
            for k in r + 1..5 {
                let known = y[k];
                y[r] -= l[(k, r)] * known;
            }
            y[r] /= l[(r, r)];
        }
        return y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::arms;

    fn target_at(arm: &ArmModel, q: &JointVector) -> PenTarget {
        let tip = *arm.kinematics(q).world_from_tip();
        PenTarget { position: tip.translation.vector.into(), axis: tip.rotation * Vector3::z() }
    }

    #[test]
    fn a_straight_stroke_is_followed_with_small_steps_inside_the_limits() {
        for (arm, home) in [(arms::iiwa(), arms::iiwa_home()), (arms::ur5e(), arms::ur5e_home())] {
            let solver = IkSolver::new(&arm, 0.03);
            let posture = Posture { reference: home, pull: 0.1, most: 0.01 };
            let start = target_at(&arm, &home);
            let mut q = home;
            let mut most = 0;
            for i in 0..=200 {
                let mut t = start;
                t.position.y += 0.001 * f64::from(i) - 0.0;
                let next = solver.follow(&t, &q, &posture).unwrap_or_else(|e| panic!("{} at {i}: {e:?}", arm.name));
                most = most.max(next.iterations);
                assert!((next.q - q).amax() < 0.01, "{} jumps at {i}", arm.name);
                let tip = arm.kinematics(&next.q).world_from_tip().to_owned();
                assert!((tip.translation.vector - t.position.coords).norm() < 1e-6);
                assert!((tip.rotation * Vector3::z()).cross(&t.axis).norm() < 1e-5);
                q = next.q;
            }
            assert!(most <= 4, "{most} iterations");
        }
    }

    #[test]
    fn solutions_keep_the_limits_and_failures_name_the_joint() {
        let mut arm = arms::iiwa();
        arm.joints[3].lower = -1.5;
        let solver = IkSolver::new(&arm, 0.03);
        // home bends joint 4 by 1.92: not allowed now, and the pen can't be there otherwise
        let target = target_at(&arms::iiwa(), &arms::iiwa_home());
        let failure = solver.reach(&target, &arms::iiwa_home()).err();
        assert_eq!(failure.and_then(|f| f.at_limit), Some(3));
        assert!(solver.unlimited().reach(&target, &arms::iiwa_home()).is_ok());
    }

    #[test]
    fn settling_finds_the_solution_nearest_to_the_posture() {
        let arm = arms::iiwa();
        let solver = IkSolver::new(&arm, 0.03);
        let home = arms::iiwa_home();
        let target = target_at(&arm, &home);
        let mut away = home;
        away[2] += 0.5;
        away[6] += 1.0;
        let seed = solver.reach(&target, &away).map(|s| s.q).unwrap_or(away);
        assert!((seed - home).norm() > 0.2);
        let back = solver.settle(&target, &seed, &Posture { reference: home, pull: 0.3, most: 0.1 }).map(|s| s.q);
        assert!(back.is_ok_and(|q| (q - home).norm() < 1e-2));
    }

    #[test]
    fn dexterity_vanishes_with_a_stretched_arm() {
        let arm = arms::iiwa();
        assert!(dexterity(&arm.kinematics(&JointVector::zeros())) < 1e-9);
        assert!(dexterity(&arm.kinematics(&arms::iiwa_home())) > 0.1);
    }
}
