//! Forward dynamics of a free base and its arm: the second plant.
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use crate::control::MeasuredState;
use crate::math::Pose;
use crate::robot::{ArmModel, JointVector, Kinematics};
use crate::twin::TipForce;
use crate::twin::plant::constrain;

/// Joints of an arm on a free base, stepped by Calamus's own model.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct FloatingPlant {
    pub state: MeasuredState,
    /// Pose of link 0, world.
    pub base: Pose,
    impulses: [JointVector; 3],
    dt: f64,
}

/// What acts on base and arm in one step.
pub(super) struct Acting<'a> {
    pub torque: &'a JointVector,
    pub tip: &'a TipForce,
    /// Wrench on the base but for weight, N and N m about the world's origin.
    pub base: &'a Vector6<f64>,
    /// Momentum of the whole at the step's end, N s and N m s.
    pub momentum: &'a Vector6<f64>,
    /// The base's twist at the step's beginning.
    pub twist: &'a Vector6<f64>,
}

impl FloatingPlant {
    pub fn new(arm: &ArmModel, start: &MeasuredState, dt: f64) -> Self {
        Self { state: *start, base: arm.world_from_base, impulses: [JointVector::zeros(); 3], dt }
    }

    /// One step; false when the state stops being finite.
    pub fn step(&mut self, arm: &ArmModel, k: &Kinematics, acting: &Acting) -> bool {
        let (dt, n) = (self.dt, arm.dof());
        let d = arm.floating_dynamics(k, &self.state.qd, acting.twist);
        let Some(whole) = d.whole.cholesky() else { return false };
        // the joints' equations with the base's acceleration put in (Schur complement of the base's block)
        let yielding = whole.solve(&d.coupling);
        let mut mass = d.joints - d.coupling.transpose() * yielding;
        let mut tau = *acting.torque - d.joint_bias + k.generalized_force(&acting.tip.point, &acting.tip.force);
        let pushed = acting.base + tip_wrench(acting.tip) - d.base_bias;
        tau -= yielding.transpose() * pushed;
        for i in 0..n {
            mass[(i, i)] += dt * arm.joints[i].damping;
            tau[i] -= arm.joints[i].damping * self.state.qd[i];
        }
        let Some(factor) = mass.cholesky() else { return false };
        let inverse = factor.inverse();
        let qd = self.state.qd + inverse * tau * dt;
        self.state.qd = constrain(arm, &self.state.q, qd, &inverse, &mut self.impulses, dt);
        self.state.q += self.state.qd * dt;
        // the base moves as the momentum wants it at the pose where the speeds hold
        let twist = whole.solve(&(acting.momentum - d.coupling * self.state.qd));
        self.base = moved(&self.base, &arm.links[0].inertia.com.coords, &twist, dt);
        self.state.q.iter().chain(self.base.translation.vector.iter()).all(|x| x.is_finite())
    }
}

/// The wrench of a pen's force about the world's origin.
pub(super) fn tip_wrench(tip: &TipForce) -> Vector6<f64> {
    crate::robot::wrench(&tip.force, &tip.point.coords.cross(&tip.force))
}

/// A pose moved by a twist about the world's origin for `dt` s: its centre of mass goes straight, which no turning bends.
fn moved(pose: &Pose, com: &Vector3<f64>, twist: &Vector6<f64>, dt: f64) -> Pose {
    let (lin, ang): (Vector3<f64>, Vector3<f64>) = (twist.fixed_rows::<3>(0).into(), twist.fixed_rows::<3>(3).into());
    let at = pose.translation.vector + pose.rotation * com;
    let there = at + (lin + ang.cross(&at)) * dt;
    let rotation =
        UnitQuaternion::new_normalize((UnitQuaternion::from_scaled_axis(ang * dt) * pose.rotation).into_inner());
    Pose::from_parts((there - rotation * com).into(), rotation)
}
