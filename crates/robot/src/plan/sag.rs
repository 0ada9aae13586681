//! Motion corrected for a base that gives way under the arm that moves on it.
//!
//! A parked base stands on springs. Its pose is measured with the arm folded; where the arm reaches out, its weight tips the base, and
//! the pen would be a few tenths of a millimetre low. A calibrated model of the springs foretells by how much.
use nalgebra::{Matrix6, Vector3, Vector6};
use rayon::prelude::*;

use crate::math::{Pose, rotation_vector};
use crate::plan::{Knot, Segment, SegmentKind, Trajectory};
use crate::robot::{ArmModel, BaseModel, BasePose, JointVector, Kinematics, MountModel};

/// Damping of the inverse of the pen's Jacobian, m2: far below the least singular value of a posture that draws.
const DAMPING: f64 = 1e-6;
/// Time between the postures from whose corrections speed and acceleration of the correction are taken, s.
const APART: f64 = 2e-3;

/// Angle at which what an arm's joints bear of its weight is compared with the upright arm, rad.
const LEAN: f64 = 1e-3;

/// Stiffness of the hand in the pen's frame, as the law that will move the arm makes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandStiffness {
    /// Along x, y and the pen, N/m.
    pub translational: [f64; 3],
    /// About them, N m/rad.
    pub rotational: [f64; 3],
}

/// How far the pen is moved by an arm's weight on its base, seen from the posture in which the base was measured.
pub struct SagModel {
    /// The arm on a base at the origin.
    arm: ArmModel,
    mount: MountModel,
    measured: Vector6<f64>,
    /// The same leaning by [`LEAN`] about x and y.
    leaning: [ArmModel; 2],
    /// `None` of an arm that doesn't give way.
    hand: Option<HandStiffness>,
}

impl SagModel {
    /// A model that knows this `share` of the sag of `arm` on `base`, measured with the arm's joints at `measured` (rad).
    /// `hand` says how the arm itself gives way to the weight that a tilted base leaves uncompensated.
    pub fn new(
        base: &BaseModel,
        arm: &ArmModel,
        measured: &JointVector,
        share: f64,
        hand: Option<HandStiffness>,
    ) -> Self {
        let mut arm = arm.clone();
        base.stand(&mut arm, &BasePose::default());
        let momentum = arm.whole_momentum(&arm.kinematics(measured), &JointVector::zeros());
        let mount = MountModel::new(base, &momentum.whole).knowing(share);
        let leaning = [Vector3::x(), Vector3::y()].map(|axis| ArmModel {
            world_from_base: Pose::new(Vector3::zeros(), axis * LEAN) * arm.world_from_base,
            ..arm.clone()
        });
        Self { measured: momentum.weight(), leaning, arm, mount, hand }
    }

    /// How the base's frame moves when the arm goes to `q` (rad), as a pose in its frame before; `None` where the base would tip over.
    pub fn sag(&self, q: &JointVector) -> Option<Pose> {
        let weight = self.arm.whole_momentum(&self.arm.kinematics(q), &JointVector::zeros()).weight();
        let moved = self.mount.give(&(weight - self.measured))?;
        Some(Pose::new(moved.fixed_rows::<3>(0).into(), moved.fixed_rows::<3>(3).into()))
    }

    /// What to add to `q` (rad) so that the pen is where it would be on a base that doesn't give way.
    pub fn correction(&self, q: &JointVector) -> JointVector {
        let Some(sag) = self.sag(q) else { return JointVector::zeros() };
        let k = self.arm.kinematics(q);
        let tip = k.world_from_tip();
        let wanted = sag.inverse() * tip;
        let p = wanted.translation.vector - tip.translation.vector;
        let r = rotation_vector(&(wanted.rotation * tip.rotation.inverse()));
        let j = k.jacobian();
        let error = Vector6::new(p.x, p.y, p.z, r.x, r.y, r.z) + self.leaning(q, &k, &sag);
        let a = j * j.transpose() + Matrix6::identity() * DAMPING;
        a.cholesky().map_or_else(JointVector::zeros, |c| j.transpose() * c.solve(&error))
    }

    /// What to add to the pen's place against the weight of an arm that leans with its base, which its law takes to stand as measured.
    fn leaning(&self, q: &JointVector, k: &Kinematics, sag: &Pose) -> Vector6<f64> {
        let Some(hand) = self.hand else { return Vector6::zeros() };
        let still = JointVector::zeros();
        let (mut mass, upright) = self.arm.mass_and_bias(k, &still);
        let lean = rotation_vector(&sag.rotation);
        let mut more = JointVector::zeros();
        for (arm, angle) in self.leaning.iter().zip([lean.x, lean.y]) {
            more += (arm.mass_and_bias(&arm.kinematics(q), &still).1 - upright) * (angle / LEAN);
        }
        for i in self.arm.dof()..mass.nrows() {
            mass[(i, i)] = 1.0;
        }
        let Some(mass) = mass.cholesky() else { return Vector6::zeros() };
        let j = k.jacobian();
        let inertia = j * mass.solve(&j.transpose()) + Matrix6::identity() * 1e-9;
        let Some(inertia) = inertia.cholesky() else { return Vector6::zeros() };
        // what of the torques is missing at the hand
        let wrench = inertia.solve(&(j * mass.solve(&more)));
        let turn = k.world_from_tip().rotation;
        let give =
            |w: Vector3<f64>, stiffness: [f64; 3]| turn * (turn.inverse() * w).component_div(&Vector3::from(stiffness));
        let (p, r) = (
            give(wrench.fixed_rows::<3>(0).into(), hand.translational),
            give(wrench.fixed_rows::<3>(3).into(), hand.rotational),
        );
        Vector6::new(p.x, p.y, p.z, r.x, r.y, r.z)
    }

    /// The correction at a moment of a motion, as a motion of its own.
    fn correction_along(&self, knot: &Knot) -> Knot {
        let h = APART;
        let at = |t: f64| self.correction(&(knot.q + knot.qd * t + knot.qdd * (0.5 * t * t)));
        let (before, q, after) = (at(-h), self.correction(&knot.q), at(h));
        let (qd, qdd) = ((after - before) / (2.0 * h), (after - q * 2.0 + before) / (h * h));
        Knot { time: knot.time, q, qd, qdd }
    }

    /// A motion with its correction. Through the air the correction goes smoothly from that of the one end to that of the other: a travel
    /// may pass through postures in which the pen can't be moved every way, and where it is then matters less.
    fn corrected(&self, segment: Segment) -> Segment {
        let knots = segment.trajectory.knots();
        let added: Vec<Knot> = match knots {
            [first, .., last] if segment.kind == SegmentKind::Travel => {
                let between = Trajectory::new(vec![self.correction_along(first), self.correction_along(last)]);
                let mut cursor = 0;
                let at = |k: &Knot| {
                    let m = between.sample(k.time, &mut cursor);
                    Knot { time: k.time, q: m.q, qd: m.qd, qdd: m.qdd }
                };
                knots.iter().map(at).collect()
            }
            _ => knots.iter().map(|k| self.correction_along(k)).collect(),
        };
        let sum = |(k, c): (&Knot, Knot)| Knot { time: k.time, q: k.q + c.q, qd: k.qd + c.qd, qdd: k.qdd + c.qdd };
        Segment { trajectory: Trajectory::new(knots.iter().zip(added).map(sum).collect()), ..segment }
    }

    /// The same motion, corrected throughout. A rest in the measured posture stays as it is.
    pub fn correct(&self, segments: Vec<Segment>) -> Vec<Segment> {
        segments.into_par_iter().map(|s| self.corrected(s)).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::robot::Cell;

    #[test]
    fn the_pen_stays_where_a_stiff_base_would_have_it() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/iiwa_ridgeback.toml");
        let arm = Cell::load(&file).expect("loads").arms.remove(0);
        let base = arm.base.as_ref().expect("has a base");
        let sag = SagModel::new(base, &arm.model, &base.transport, 1.0, None);
        assert!(sag.correction(&base.transport).amax() < 1e-15);
        let stood = sag.arm.kinematics(&arm.home);
        let off = |q: &JointVector| {
            let tip = sag.sag(q).expect("stands") * *sag.arm.kinematics(q).world_from_tip();
            (tip.translation.vector - stood.world_from_tip().translation.vector).norm()
        };
        let (without, with) = (off(&arm.home), off(&(arm.home + sag.correction(&arm.home))));
        assert!(without > 2e-5 && with < 0.02 * without, "{without} m, {with} m");
    }

    #[test]
    fn a_travel_through_a_straight_elbow_stays_as_calm_as_it_was() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/iiwa_ridgeback.toml");
        let arm = Cell::load(&file).expect("loads").arms.remove(0);
        let base = arm.base.as_ref().expect("has a base");
        let sag = SagModel::new(base, &arm.model, &base.transport, 0.8, None);
        let mut straight = arm.home;
        straight[3] = -straight[3];
        let knot = |time: f64, q| Knot { time, q, qd: JointVector::zeros(), qdd: JointVector::zeros() };
        let whole = Trajectory::new(vec![knot(0.0, arm.home), knot(4.0, straight)]);
        let knots = (0..=400).map(|i| {
            let m = whole.sample(f64::from(i) * 0.01, &mut 0);
            Knot { time: f64::from(i) * 0.01, q: m.q, qd: m.qd, qdd: m.qdd }
        });
        let trajectory = Trajectory::new(knots.collect());
        let (kind, depth) = (SegmentKind::Travel, Default::default());
        let before = Segment { kind, layer: 0, stroke: None, start: 0.0, trajectory, depth };
        let after = sag.corrected(before.clone());
        for (a, b) in before.trajectory.knots().iter().zip(after.trajectory.knots()) {
            assert!((a.q - b.q).amax() < 0.01 && (a.qd - b.qd).amax() < 0.02, "{a:?} {b:?}");
        }
        let end = after.trajectory.knots()[400].q;
        assert!((end - straight - sag.correction(&straight)).amax() < 1e-12);
    }

    #[test]
    fn speed_and_acceleration_are_those_of_the_corrected_way() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/iiwa_ridgeback.toml");
        let arm = Cell::load(&file).expect("loads").arms.remove(0);
        let base = arm.base.as_ref().expect("has a base");
        let sag = SagModel::new(base, &arm.model, &base.transport, 0.8, None);
        let (qd, qdd) = (JointVector::repeat(0.2), JointVector::repeat(-0.3));
        let at = |t: f64| Knot { time: t, q: arm.home + qd * t + qdd * (0.5 * t * t), qd: qd + qdd * t, qdd };
        let dt = 1e-2;
        let [a, b] = [0.0, dt].map(|t| sag.correction_along(&at(t)));
        let mean = (b.q - a.q) / dt;
        assert!((mean - (a.qd + b.qd) * 0.5).amax() < 1e-5, "{}", (mean - (a.qd + b.qd) * 0.5).amax());
        assert!(((b.qd - a.qd) / dt - (a.qdd + b.qdd) * 0.5).amax() < 1e-3);
    }
}
