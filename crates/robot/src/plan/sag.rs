//! Motion corrected for a base that gives way under the arm that moves on it.
//!
//! A parked base stands on springs. Its pose is measured with the arm folded; where the arm reaches out, its weight tips the base, and
//! the pen would be a few tenths of a millimetre low. A calibrated model of the springs foretells by how much.
use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

use crate::math::{Pose, rotation_vector};
use crate::plan::{Knot, Segment, SegmentKind, Trajectory};
use crate::robot::{ArmModel, BaseModel, BasePose, JointVector, MountModel};

/// Damping of the inverse of the pen's Jacobian, m2: far below the least singular value of a posture that draws.
const DAMPING: f64 = 1e-6;
/// Time between the postures from whose corrections speed and acceleration of the correction are taken, s.
const APART: f64 = 2e-3;

/// How far the pen is moved by an arm's weight on its base, seen from the posture in which the base was measured.
pub struct SagModel {
    /// The arm on a base at the origin.
    arm: ArmModel,
    mount: MountModel,
    measured: Vector6<f64>,
}

impl SagModel {
    /// A model that knows this `share` of the sag of `arm` on `base`, measured with the arm's joints at `measured` (rad).
    pub fn new(base: &BaseModel, arm: &ArmModel, measured: &JointVector, share: f64) -> Self {
        let mut arm = arm.clone();
        base.stand(&mut arm, &BasePose::default());
        let momentum = arm.whole_momentum(&arm.kinematics(measured), &JointVector::zeros());
        let mount = MountModel::new(base, &momentum.whole).knowing(share);
        Self { measured: momentum.weight(), arm, mount }
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
        let error = Vector6::new(p.x, p.y, p.z, r.x, r.y, r.z);
        let j = k.jacobian();
        let a = j * j.transpose() + Matrix6::identity() * DAMPING;
        a.cholesky().map_or_else(JointVector::zeros, |c| j.transpose() * c.solve(&error))
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
        let sag = SagModel::new(base, &arm.model, &base.transport, 1.0);
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
        let sag = SagModel::new(base, &arm.model, &base.transport, 0.8);
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
        let sag = SagModel::new(base, &arm.model, &base.transport, 0.8);
        let (qd, qdd) = (JointVector::repeat(0.2), JointVector::repeat(-0.3));
        let at = |t: f64| Knot { time: t, q: arm.home + qd * t + qdd * (0.5 * t * t), qd: qd + qdd * t, qdd };
        let dt = 1e-2;
        let [a, b] = [0.0, dt].map(|t| sag.correction_along(&at(t)));
        let mean = (b.q - a.q) / dt;
        assert!((mean - (a.qd + b.qd) * 0.5).amax() < 1e-5, "{}", (mean - (a.qd + b.qd) * 0.5).amax());
        assert!(((b.qd - a.qd) / dt - (a.qdd + b.qdd) * 0.5).amax() < 1e-3);
    }
}
