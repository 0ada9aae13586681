//! The plant: what answers torques and pen forces with motion.
use nalgebra::{Point3, Vector3};

use crate::control::MeasuredState;
use crate::robot::{ArmModel, JointVector, Kinematics};

/// The force that the canvas puts on a pen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TipForce {
    /// Point of the last link at which it acts, m, world.
    pub point: Point3<f64>,
    /// Force, N, world.
    pub force: Vector3<f64>,
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
pub struct ArticulatedPlant {
    arms: Vec<ArmModel>,
    states: Vec<MeasuredState>,
    impulses: Vec<JointVector>,
    dt: f64,
}

/// Gauss-Seidel sweeps over the friction rows of one arm.
const SWEEPS: usize = 8;

impl ArticulatedPlant {
    /// Arms at rest at `q0` (one entry an arm), stepped by `dt` s.
    pub fn new(arms: Vec<ArmModel>, q0: &[JointVector], dt: f64) -> Self {
        let states = q0.iter().map(|q| MeasuredState { q: *q, qd: JointVector::zeros() }).collect();
        let impulses = vec![JointVector::zeros(); arms.len()];
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
            let mut qd = state.qd + inverse * tau * dt;
            let p = &mut self.impulses[a];
            qd += inverse * *p;
            for _ in 0..SWEEPS {
                for i in 0..n {
                    let joint = &arm.joints[i];
                    let (bound, q_next) = (joint.friction * dt, state.q[i] + qd[i] * dt);
                    // friction stops the joint if it can; a limit keeps it from passing
                    let (low, high, target) = if q_next > joint.upper {
                        (f64::NEG_INFINITY, bound, (joint.upper - state.q[i]) / dt)
                    } else if q_next < joint.lower {
                        (-bound, f64::INFINITY, (joint.lower - state.q[i]) / dt)
                    } else {
                        (-bound, bound, 0.0)
                    };
                    let new = (p[i] + (target - qd[i]) / inverse[(i, i)]).clamp(low, high);
                    let change = new - p[i];
                    if change != 0.0 {
                        qd += inverse.column(i) * change;
                        p[i] = new;
                    }
                }
            }
            state.qd = qd;
            state.q += qd * dt;
            if !state.q.iter().all(|x| x.is_finite()) {
                return Err(a);
            }
        }
        Ok(())
    }
}
