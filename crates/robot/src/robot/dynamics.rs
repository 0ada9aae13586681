//! Equations of motion `M(q) qdd + C(q, qd) qd + g(q) = tau`: inverse dynamics (RNEA), joint-space inertia (CRBA) and
//! forward dynamics.
//!
//! Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 5 and 6, with all spatial quantities about the world's
//! origin. Armature (rotor inertia) adds to the diagonal of `M`. Friction is not part of the model.
use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::robot::kinematics::{Kinematics, Motion};
use crate::robot::{ArmModel, JointVector, MAX_DOF};

/// Standard gravity as the robot reference values use it, m/s2, along -z.
pub const GRAVITY: f64 = 9.81;

/// A matrix over a chain's joints. Entries past `dof()` are those of the identity, so that it stays invertible.
pub type JointMatrix = SMatrix<f64, MAX_DOF, MAX_DOF>;

/// Inertia of a body about the world's origin, world axes: mass, first moment, second moment.
#[derive(Clone, Copy)]
pub(super) struct BodyInertia {
    pub(super) mass: f64,
    pub(super) moment: Vector3<f64>,
    pub(super) inertia: Matrix3<f64>,
}

impl BodyInertia {
    pub(super) const ZERO: Self = Self {
        mass: 0.0,
        moment: Vector3::new(0.0, 0.0, 0.0),
        inertia: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// Momentum of the body moving with `m`: (linear, angular about the origin).
    pub(super) fn momentum(&self, m: &Motion) -> (Vector3<f64>, Vector3<f64>) {
        (m.lin * self.mass + m.ang.cross(&self.moment), self.inertia * m.ang + self.moment.cross(&m.lin))
    }

    /// Both bodies as one.
    pub(super) fn joined(&self, other: &Self) -> Self {
        Self { mass: self.mass + other.mass, moment: self.moment + other.moment, inertia: self.inertia + other.inertia }
    }
}

impl ArmModel {
    pub(super) fn link_inertia(&self, link: usize, k: &Kinematics) -> BodyInertia {
        let (pose, body) = (k.world_from_link(link), &self.links[link].inertia);
        let r = pose.rotation.to_rotation_matrix();
        let c = (pose * body.com).coords;
        let about_com = r.matrix() * body.inertia * r.matrix().transpose();
        // parallel axes: I_O = I_c + m (|c|^2 1 - c c^T)
        let shift = Matrix3::from_diagonal_element(c.norm_squared()) - c * c.transpose();
        BodyInertia { mass: body.mass, moment: c * body.mass, inertia: about_com + shift * body.mass }
    }

    /// Joint torques that give accelerations `qdd` at speeds `qd` under gravity `gravity` (m/s2, world).
    pub fn inverse_dynamics(
        &self,
        k: &Kinematics,
        qd: &JointVector,
        qdd: &JointVector,
        gravity: &Vector3<f64>,
    ) -> JointVector {
        let n = self.dof();
        let mut forces = [(Vector3::zeros(), Vector3::zeros()); MAX_DOF];
        let mut v = Motion::ZERO;
        // gravity as an upward acceleration of the base
        let mut a = Motion { ang: Vector3::zeros(), lin: -gravity };
        for i in 0..n {
            let sv = k.axes[i].scaled(qd[i]);
            v = v.plus(&sv);
            a = a.plus(&k.axes[i].scaled(qdd[i])).plus(&v.cross(&sv));
            let body = self.link_inertia(i + 1, k);
            let (p, l) = body.momentum(&v);
            let (pa, la) = body.momentum(&a);
            // f = I a + v x* (I v)
            forces[i] = (pa + v.ang.cross(&p), la + v.ang.cross(&l) + v.lin.cross(&p));
        }
        let mut tau = JointVector::zeros();
        let (mut f, mut m) = (Vector3::zeros(), Vector3::zeros());
        for i in (0..n).rev() {
            f += forces[i].0;
            m += forces[i].1;
            tau[i] = k.axes[i].ang.dot(&m) + k.axes[i].lin.dot(&f) + self.joints[i].armature * qdd[i];
        }
        tau
    }

    /// The joint-space inertia matrix `M(q)`, kg m2, armature included.
    pub fn mass_matrix(&self, k: &Kinematics) -> JointMatrix {
        self.mass_and_bias(k, &JointVector::zeros()).0
    }

    /// Both of what a model-based controller needs, in one pass over the links: `M(q)` and the bias `C qd + g` under
    /// standard gravity.
    pub fn mass_and_bias(&self, k: &Kinematics, qd: &JointVector) -> (JointMatrix, JointVector) {
        let n = self.dof();
        let mut bodies = [BodyInertia::ZERO; MAX_DOF];
        let mut forces = [(Vector3::zeros(), Vector3::zeros()); MAX_DOF];
        let mut v = Motion::ZERO;
        let mut a = Motion { ang: Vector3::zeros(), lin: Vector3::new(0.0, 0.0, GRAVITY) };
        for i in 0..n {
            let sv = k.axes[i].scaled(qd[i]);
            v = v.plus(&sv);
            a = a.plus(&v.cross(&sv));
            bodies[i] = self.link_inertia(i + 1, k);
            let (p, l) = bodies[i].momentum(&v);
            let (pa, la) = bodies[i].momentum(&a);
            forces[i] = (pa + v.ang.cross(&p), la + v.ang.cross(&l) + v.lin.cross(&p));
        }
        let (mut matrix, mut bias) = (JointMatrix::identity(), JointVector::zeros());
        let (mut f, mut m) = (Vector3::zeros(), Vector3::zeros());
        let mut composite = BodyInertia::ZERO;
        for i in (0..n).rev() {
            f += forces[i].0;
            m += forces[i].1;
            bias[i] = k.axes[i].ang.dot(&m) + k.axes[i].lin.dot(&f);
            composite.mass += bodies[i].mass;
            composite.moment += bodies[i].moment;
            composite.inertia += bodies[i].inertia;
            let (p, l) = composite.momentum(&k.axes[i]);
            for j in 0..=i {
                let mij = k.axes[j].ang.dot(&l) + k.axes[j].lin.dot(&p);
                matrix[(i, j)] = mij;
                matrix[(j, i)] = mij;
            }
            matrix[(i, i)] += self.joints[i].armature;
        }
        (matrix, bias)
    }

    /// Accelerations that torques `tau` give at `q`, `qd` under standard gravity; `None` when `M` isn't positive
    /// definite, which no valid model has.
    pub fn forward_dynamics(&self, k: &Kinematics, qd: &JointVector, tau: &JointVector) -> Option<JointVector> {
        let (m, bias) = self.mass_and_bias(k, qd);
        Some(m.cholesky()?.solve(&(tau - bias)))
    }
}
