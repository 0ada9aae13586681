//! Where everything is, and how it moves: forward kinematics, Jacobian and motion of the tip.
//!
//! Spatial vectors are written about the world's origin in world axes (Featherstone, Rigid Body Dynamics Algorithms,
//! 2008, ch. 2), so that the motion axes of all joints add without a change of frame.
use nalgebra::{Point3, SMatrix, UnitQuaternion, Vector3, Vector6};

use crate::math::Pose;
use crate::robot::{ArmModel, JointKind, JointVector, MAX_DOF};

/// The Jacobian at the tip: rows vx vy vz wx wy wz, world axes; columns past the chain's `dof()` are zero.
pub type Jacobian = SMatrix<f64, 6, MAX_DOF>;

/// A spatial motion: rotation and the linear motion of the body point that passes the world's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Motion {
    pub ang: Vector3<f64>,
    pub lin: Vector3<f64>,
}

impl Motion {
    pub(crate) const ZERO: Self = Self { ang: Vector3::new(0.0, 0.0, 0.0), lin: Vector3::new(0.0, 0.0, 0.0) };

    pub(crate) fn scaled(&self, s: f64) -> Self {
        Self { ang: self.ang * s, lin: self.lin * s }
    }

    pub(crate) fn plus(&self, o: &Self) -> Self {
        Self { ang: self.ang + o.ang, lin: self.lin + o.lin }
    }

    /// The rate of change of `o` fixed in a body that moves with `self` (the spatial cross product).
    pub(crate) fn cross(&self, o: &Self) -> Self {
        Self { ang: self.ang.cross(&o.ang), lin: self.ang.cross(&o.lin) + self.lin.cross(&o.ang) }
    }
}

/// The pose of every link of an arm at one joint position.
#[derive(Clone, Copy, Debug)]
pub struct Kinematics {
    dof: usize,
    world_from_link: [Pose; MAX_DOF + 1],
    world_from_tip: Pose,
    /// Motion of everything behind joint i per unit of its speed.
    pub(crate) axes: [Motion; MAX_DOF],
}

impl ArmModel {
    /// Forward kinematics at `q`; no allocation.
    pub fn kinematics(&self, q: &JointVector) -> Kinematics {
        let mut k = Kinematics {
            dof: self.dof(),
            world_from_link: [self.world_from_base; MAX_DOF + 1],
            world_from_tip: self.world_from_base,
            axes: [Motion::ZERO; MAX_DOF],
        };
        let mut pose = self.world_from_base;
        for (i, joint) in self.joints.iter().enumerate() {
            pose *= joint.parent_from_joint;
            let axis = pose.rotation * joint.axis;
            match joint.kind {
                JointKind::Revolute => {
                    let (s, c) = (0.5 * q[i]).sin_cos();
                    let turn = nalgebra::Quaternion::from_parts(c, joint.axis * s);
                    // unit by construction; renormalised so that rounding can't grow along the chain
                    pose.rotation = UnitQuaternion::new_normalize((pose.rotation.into_inner()) * turn);
                    k.axes[i] = Motion { ang: axis, lin: pose.translation.vector.cross(&axis) };
                }
                JointKind::Prismatic => {
                    pose.translation.vector += axis * q[i];
                    k.axes[i] = Motion { ang: Vector3::zeros(), lin: axis };
                }
            }
            k.world_from_link[i + 1] = pose;
        }
        k.world_from_tip = pose * self.last_from_tip;
        k
    }
}

impl Kinematics {
    /// Number of joints.
    pub fn dof(&self) -> usize {
        self.dof
    }

    /// Pose of link `i` (0 is the base) in the world.
    pub fn world_from_link(&self, i: usize) -> &Pose {
        &self.world_from_link[i]
    }

    /// Poses of all links, base first.
    pub fn world_from_links(&self) -> &[Pose] {
        &self.world_from_link[..=self.dof]
    }

    /// Pose of the tip in the world.
    pub fn world_from_tip(&self) -> &Pose {
        &self.world_from_tip
    }

    /// The same posture of an arm that differs in its tip alone, which is at `last_from_tip` in the last link's frame.
    pub fn with_tip(mut self, last_from_tip: &Pose) -> Self {
        self.world_from_tip = self.world_from_link[self.dof] * last_from_tip;
        self
    }

    /// Motion of a joint at unit speed, world axes: its rotation, and the linear motion of the body point that passes the world's
    /// origin.
    #[inline]
    pub fn joint_motion(&self, joint: usize) -> [&Vector3<f64>; 2] {
        let Motion { ang, lin } = &self.axes[joint];
        [ang, lin]
    }

    /// The geometric Jacobian at the tip.
    pub fn jacobian(&self) -> Jacobian {
        let p = self.world_from_tip.translation.vector;
        let mut j = Jacobian::zeros();
        for (i, s) in self.axes[..self.dof].iter().enumerate() {
            j.fixed_view_mut::<3, 1>(0, i).copy_from(&(s.lin + s.ang.cross(&p)));
            j.fixed_view_mut::<3, 1>(3, i).copy_from(&s.ang);
        }
        j
    }

    /// Linear velocity of the tip, m/s, world, for joint speeds `qd`.
    pub fn tip_velocity(&self, qd: &JointVector) -> Vector3<f64> {
        let p = self.world_from_tip.translation.vector;
        self.axes[..self.dof].iter().enumerate().map(|(i, s)| (s.lin + s.ang.cross(&p)) * qd[i]).sum()
    }

    /// Joint torques equivalent to a force `force` (N, world) acting at `point` (m, world) on the last link: `J^T F`.
    pub fn generalized_force(&self, point: &Point3<f64>, force: &Vector3<f64>) -> JointVector {
        let mut tau = JointVector::zeros();
        let moment = point.coords.cross(force);
        for (i, s) in self.axes[..self.dof].iter().enumerate() {
            tau[i] = s.lin.dot(force) + s.ang.dot(&moment);
        }
        tau
    }

    /// Velocity and acceleration of the tip (linear part first, world axes; the linear acceleration is that of the
    /// material point, `d2x/dt2`) for joint speeds `qd` and accelerations `qdd`. With `qdd = 0` the second is `Jdot qd`.
    pub fn tip_motion(&self, qd: &JointVector, qdd: &JointVector) -> (Vector6<f64>, Vector6<f64>) {
        let (mut v, mut a) = (Motion::ZERO, Motion::ZERO);
        for (i, s) in self.axes[..self.dof].iter().enumerate() {
            let sv = s.scaled(qd[i]);
            v = v.plus(&sv);
            a = a.plus(&s.scaled(qdd[i])).plus(&v.cross(&sv));
        }
        let p = self.world_from_tip.translation.vector;
        let v_tip = v.lin + v.ang.cross(&p);
        // spatial to classical acceleration: d/dt of (v_O + w x p) with dp/dt = v_tip
        let a_tip = a.lin + a.ang.cross(&p) + v.ang.cross(&v_tip);
        (stack(&v_tip, &v.ang), stack(&a_tip, &a.ang))
    }
}

fn stack(lin: &Vector3<f64>, ang: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(lin.x, lin.y, lin.z, ang.x, ang.y, ang.z)
}
