//! Equations of motion of an arm whose base is free: link 0 is then a body with six coordinates of its own.
//!
//! Spatial vectors are pairs (linear, angular) about the world's origin in world axes, so the base's twist is its own coordinate and
//! adds no velocity product (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 9.4).
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector6};

use super::dynamics::BodyInertia;
use super::kinematics::{Kinematics, Motion};
use super::{ArmModel, GRAVITY, JointMatrix, JointVector, MAX_DOF};

/// Momentum of the whole per unit of joint speed: linear part first, N s and N m s about the world's origin.
pub type Coupling = SMatrix<f64, 6, MAX_DOF>;

/// The parts of the equations of motion
///
/// `[B H; H^T M] [a; qdd] + [c; b] = [w; tau]`
///
/// with the base's spatial acceleration `a` and the wrench `w` on the base, both about the world's origin.
#[derive(Clone, Debug)]
pub struct FloatingDynamics {
    /// `B`: inertia of the whole.
    pub whole: Matrix6<f64>,
    /// `H`: what of its momentum the joints' motion is.
    pub coupling: Coupling,
    /// `M`: inertia of the joints while the base stands still; armature included.
    pub joints: JointMatrix,
    /// `c`: velocity products and standard gravity.
    pub base_bias: Vector6<f64>,
    /// `b`: the same at the joints.
    pub joint_bias: JointVector,
}

/// What is needed to know the base's twist from the momentum of the whole.
#[derive(Clone, Copy, Debug)]
pub struct WholeMomentum {
    /// Inertia of the whole about the world's origin.
    pub whole: Matrix6<f64>,
    /// Momentum that the joints' motion has while the base stands still, N s and N m s.
    pub of_joints: Vector6<f64>,
}

impl WholeMomentum {
    /// The base's twist about the world's origin, m/s and rad/s, with which the whole has this momentum; `None` where the inertia
    /// isn't positive definite.
    pub fn base_twist(&self, momentum: &Vector6<f64>) -> Option<Vector6<f64>> {
        Some(self.whole.cholesky()?.solve(&(momentum - self.of_joints)))
    }

    /// The weight of the whole, N and N m about the world's origin.
    pub fn weight(&self) -> Vector6<f64> {
        let mass = self.whole[(0, 0)];
        // the lower left block is the cross product with the first moment
        let moment = Vector3::new(self.whole[(5, 1)], self.whole[(3, 2)], self.whole[(4, 0)]);
        let force = Vector3::new(0.0, 0.0, -mass * GRAVITY);
        wrench(&force, &(moment.cross(&force) / mass))
    }
}

/// Linear and angular part as one vector.
pub fn wrench(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// The matrix of a body's inertia about the world's origin.
fn matrix(body: &BodyInertia) -> Matrix6<f64> {
    let cross = body.moment.cross_matrix();
    let mut m = Matrix6::zeros();
    m.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::from_diagonal_element(body.mass));
    m.fixed_view_mut::<3, 3>(0, 3).copy_from(&-cross);
    m.fixed_view_mut::<3, 3>(3, 0).copy_from(&cross);
    m.fixed_view_mut::<3, 3>(3, 3).copy_from(&body.inertia);
    m
}

impl ArmModel {
    /// Momentum of base and arm as their motion gives it: link 0 is the base.
    pub fn whole_momentum(&self, k: &Kinematics, qd: &JointVector) -> WholeMomentum {
        let mut composite = self.link_inertia(0, k);
        let (mut p, mut l) = (Vector3::zeros(), Vector3::zeros());
        let mut v = Motion::ZERO;
        for i in 0..self.dof() {
            v = v.plus(&k.axes[i].scaled(qd[i]));
            let body = self.link_inertia(i + 1, k);
            let (linear, angular) = body.momentum(&v);
            p += linear;
            l += angular;
            composite = composite.joined(&body);
        }
        WholeMomentum { whole: matrix(&composite), of_joints: wrench(&p, &l) }
    }

    /// The equations of motion with the base (link 0) free, moving with `twist` (m/s and rad/s, about the world's origin), under
    /// standard gravity.
    pub fn floating_dynamics(&self, k: &Kinematics, qd: &JointVector, twist: &Vector6<f64>) -> FloatingDynamics {
        let n = self.dof();
        let mut bodies = [BodyInertia::ZERO; MAX_DOF + 1];
        let mut forces = [(Vector3::zeros(), Vector3::zeros()); MAX_DOF + 1];
        let mut v = Motion { lin: twist.fixed_rows::<3>(0).into(), ang: twist.fixed_rows::<3>(3).into() };
        let mut a = Motion { ang: Vector3::zeros(), lin: Vector3::new(0.0, 0.0, GRAVITY) };
        for i in 0..=n {
            if i > 0 {
                let sv = k.axes[i - 1].scaled(qd[i - 1]);
                a = a.plus(&v.cross(&sv));
                v = v.plus(&sv);
            }
            bodies[i] = self.link_inertia(i, k);
            let (p, l) = bodies[i].momentum(&v);
            let (pa, la) = bodies[i].momentum(&a);
            forces[i] = (pa + v.ang.cross(&p), la + v.ang.cross(&l) + v.lin.cross(&p));
        }
        let (mut joints, mut joint_bias) = (JointMatrix::identity(), JointVector::zeros());
        let mut coupling = Coupling::zeros();
        let (mut f, mut m) = (Vector3::zeros(), Vector3::zeros());
        let mut composite = BodyInertia::ZERO;
        for i in (0..n).rev() {
            f += forces[i + 1].0;
            m += forces[i + 1].1;
            joint_bias[i] = k.axes[i].ang.dot(&m) + k.axes[i].lin.dot(&f);
            composite = composite.joined(&bodies[i + 1]);
            let (p, l) = composite.momentum(&k.axes[i]);
            coupling.set_column(i, &wrench(&p, &l));
            for j in 0..=i {
                let mij = k.axes[j].ang.dot(&l) + k.axes[j].lin.dot(&p);
                joints[(i, j)] = mij;
                joints[(j, i)] = mij;
            }
            joints[(i, i)] += self.joints[i].armature;
        }
        let base_bias = wrench(&(f + forces[0].0), &(m + forces[0].1));
        FloatingDynamics { whole: matrix(&composite.joined(&bodies[0])), coupling, joints, base_bias, joint_bias }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::robot::Cell;

    fn model() -> (ArmModel, JointVector) {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/iiwa_ridgeback.toml");
        let arm = Cell::load(&file).expect("loads").arms.remove(0);
        (arm.model, arm.home)
    }

    #[test]
    fn a_base_that_stands_still_gives_the_fixed_arms_equations() {
        let (arm, q) = model();
        let qd = JointVector::from_fn(|i, _| if i < 7 { 0.3 - 0.1 * i as f64 } else { 0.0 });
        let k = arm.kinematics(&q);
        let (mass, bias) = arm.mass_and_bias(&k, &qd);
        let free = arm.floating_dynamics(&k, &qd, &Vector6::zeros());
        assert!((free.joints - mass).norm() < 1e-10 && (free.joint_bias - bias).norm() < 1e-10);
        let whole = arm.whole_momentum(&k, &qd);
        assert!((whole.whole - free.whole).norm() < 1e-9);
        assert!((free.coupling * qd - whole.of_joints).norm() < 1e-9);
        assert!(free.whole.cholesky().is_some());
    }

    #[test]
    fn weight_is_the_bias_of_what_stands_still() {
        let (arm, q) = model();
        let k = arm.kinematics(&q);
        let free = arm.floating_dynamics(&k, &JointVector::zeros(), &Vector6::zeros());
        let weight = arm.whole_momentum(&k, &JointVector::zeros()).weight();
        assert!((free.base_bias + weight).norm() < 1e-8, "{} {}", free.base_bias, weight);
    }

    #[test]
    fn momentum_of_base_and_joints_is_that_of_all_bodies() {
        let (arm, q) = model();
        let qd = JointVector::from_fn(|i, _| if i < 7 { 0.5 - 0.2 * i as f64 } else { 0.0 });
        let k = arm.kinematics(&q);
        let twist = Vector6::new(0.3, -0.2, 0.05, 0.1, -0.1, 0.4);
        let whole = arm.whole_momentum(&k, &qd);
        let momentum = whole.whole * twist + whole.of_joints;
        assert!((whole.base_twist(&momentum).expect("is definite") - twist).norm() < 1e-12);
        // linear momentum by moving every centre of mass
        let h = 1e-6;
        let mut moved = arm.clone();
        let (lin, ang): (Vector3<f64>, Vector3<f64>) =
            (twist.fixed_rows::<3>(0).into(), twist.fixed_rows::<3>(3).into());
        moved.world_from_base = crate::math::Pose::new(lin * h, ang * h) * arm.world_from_base;
        let later = moved.kinematics(&(q + qd * h));
        let mut p = Vector3::zeros();
        for (i, link) in arm.links.iter().enumerate() {
            let (a, b) = (k.world_from_link(i) * link.inertia.com, later.world_from_link(i) * link.inertia.com);
            p += (b - a) * (link.inertia.mass / h);
        }
        assert!((p - momentum.fixed_rows::<3>(0)).norm() < 1e-3, "{p} {momentum}");
    }
}
