//! The plant: what answers torques and pen forces with motion.
use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::control::MeasuredState;
use crate::math::Pose;
use crate::robot::{ArmModel, JointMatrix, JointVector, Kinematics};
use crate::twin::{MobilePlant, RapierPlant};

/// The force that the canvas puts on a pen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TipForce {
    /// Point of the last link at which it acts, m, world.
    pub point: Point3<f64>,
    /// Force, N, world.
    pub force: Vector3<f64>,
}

/// Where a pen's tip is and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipState {
    /// The tip frame, world: z out of the nib.
    pub pose: Pose,
    /// Velocity of its origin, m/s, world.
    pub velocity: Vector3<f64>,
    /// Least mass that the nib may be felt to have, kg: damping that would reverse its motion within a step is held back. Infinite
    /// on an arm, whose inertia is far from that.
    pub mass: f64,
}

/// The dynamics of all arms of a cell. One step is semi-implicit Euler: speeds first, then positions by the new speeds.
pub trait Plant {
    /// True joint state of arm `arm`.
    fn state(&self, arm: usize) -> &MeasuredState;
    /// Advances by the plant's step under joint torques (N m) and pen forces, one entry an arm. `kinematics` are those
    /// of the current state.
    ///
    /// # Errors
    /// The index of the arm whose torques or state stopped being finite.
    fn step(&mut self, torques: &[JointVector], forces: &[TipForce], kinematics: &[Kinematics]) -> Result<(), usize>;
}

/// An independent plant: forward dynamics of Calamus's own model. It checks rapier's, and runs long drawings faster.
///
/// Dry joint friction and hard joint limits are impulses found by projected Gauss-Seidel on the new joint speeds;
/// viscous friction is implicit.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ArticulatedPlant {
    arms: Vec<ArmModel>,
    states: Vec<MeasuredState>,
    /// Impulses of dry friction, upper limits and lower limits in the last step, N m s: where the next one starts.
    impulses: Vec<[JointVector; 3]>,
    dt: f64,
}

/// The plant of one arm, as a value.
#[derive(Clone, Serialize, Deserialize)]
pub enum ArmPlant {
    /// rapier's multibody.
    Rapier(Box<RapierPlant>),
    /// Calamus's own forward dynamics.
    Articulated(ArticulatedPlant),
    /// The world in which the pen in the hand was grasped: it is held by contact and friction.
    Grasp,
    /// An arm on a driven base.
    Mobile(Box<MobilePlant>),
}

/// Gauss-Seidel sweeps over the friction rows of one arm.
const SWEEPS: usize = 8;

impl ArticulatedPlant {
    /// Arms at rest at `q0` (one entry an arm), stepped by `dt` s.
    pub fn new(arms: Vec<ArmModel>, q0: &[JointVector], dt: f64) -> Self {
        let rest: Vec<_> = q0.iter().map(|q| MeasuredState { q: *q, qd: JointVector::zeros() }).collect();
        Self::moving(arms, &rest, dt)
    }

    /// Arms that move as given (one entry an arm), stepped by `dt` s.
    pub fn moving(arms: Vec<ArmModel>, joints: &[MeasuredState], dt: f64) -> Self {
        let states = joints.to_vec();
        let impulses = vec![[JointVector::zeros(); 3]; arms.len()];
        Self { arms, states, impulses, dt }
    }
}

impl Plant for ArticulatedPlant {
    fn state(&self, arm: usize) -> &MeasuredState {
        &self.states[arm]
    }

    fn step(&mut self, torques: &[JointVector], forces: &[TipForce], kinematics: &[Kinematics]) -> Result<(), usize> {
        let dt = self.dt;
        for (a, arm) in self.arms.iter().enumerate() {
            let (k, state, n) = (&kinematics[a], &mut self.states[a], arm.dof());
            let (mut mass, bias) = arm.mass_and_bias(k, &state.qd);
            let mut tau = torques[a] - bias + k.generalized_force(&forces[a].point, &forces[a].force);
            for i in 0..n {
                mass[(i, i)] += dt * arm.joints[i].damping;
                tau[i] -= arm.joints[i].damping * state.qd[i];
            }
            let Some(factor) = mass.cholesky() else { return Err(a) };
            let inverse = factor.inverse();
            let qd = state.qd + inverse * tau * dt;
            state.qd = constrain(arm, &state.q, qd, &inverse, &mut self.impulses[a], dt);
            state.q += state.qd * dt;
            if !state.q.iter().all(|x| x.is_finite()) {
                return Err(a);
            }
        }
        Ok(())
    }
}

/// Speeds `qd` after dry friction and hard limits: `inverse` is that of the joints' inertia, `impulses` where the sweeps start and end.
#[inline]
pub(super) fn constrain(
    arm: &ArmModel,
    q: &JointVector,
    mut qd: JointVector,
    inverse: &JointMatrix,
    impulses: &mut [JointVector; 3],
    dt: f64,
) -> JointVector {
    let [friction, upper, lower] = impulses;
    qd += inverse * (*friction + *upper + *lower);
    for _ in 0..SWEEPS {
        for i in 0..arm.dof() {
            let joint = &arm.joints[i];
            let bound = joint.friction * dt;
            let (most, least) = ((joint.upper - q[i]) / dt, (joint.lower - q[i]) / dt);
            // friction stops the joint if it can; a limit only pushes back, and only as far as the limit
            for (impulse, target, range) in [
                (&mut friction[i], 0.0, (-bound, bound)),
                (&mut upper[i], most, (f64::NEG_INFINITY, 0.0)),
                (&mut lower[i], least, (0.0, f64::INFINITY)),
            ] {
                if !f64::is_finite(target) {
                    continue;
                }
                let new = (*impulse + (target - qd[i]) / inverse[(i, i)]).clamp(range.0, range.1);
                let change = new - *impulse;
                if change != 0.0 {
                    qd += inverse.column(i) * change;
                    *impulse = new;
                }
            }
        }
    }
    qd
}
