//! The rapier plant: every arm a reduced-coordinate multibody in one world.
use nalgebra::{
    Isometry3, Point3, Quaternion, Rotation3, SymmetricEigen, Translation3, UnitQuaternion, Vector3, Vector6,
};
use rapier3d_f64::prelude as rapier;
use rapier3d_f64::prelude::{
    GenericJointBuilder, JointAxesMask, JointAxis, MassProperties, MultibodyJointHandle, PhysicsWorld,
    RigidBodyBuilder, RigidBodyHandle,
};

use serde::{Deserialize, Serialize};

use crate::control::MeasuredState;
use crate::math::Pose;
use crate::robot::{ArmModel, GRAVITY, JointKind, JointVector, Kinematics, SpatialInertia};
use crate::twin::{Plant, TipForce};

/// All arms in one rapier world.
#[derive(Serialize, Deserialize)]
pub struct RapierPlant {
    world: PhysicsWorld,
    arms: Vec<RapierArm>,
    states: Vec<MeasuredState>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct RapierArm {
    bodies: Vec<RigidBodyHandle>,
    joint: MultibodyJointHandle,
    kinds: Vec<JointKind>,
    /// Centre of mass of each moving link, m, link frame.
    coms: Vec<Point3<f64>>,
    /// Lower and upper limit of each joint.
    limits: Vec<[f64; 2]>,
    /// Centre of mass of link 0, m, its frame, where the base is free.
    root: Option<Point3<f64>>,
}

impl RapierArm {
    /// Coordinates before those of the joints.
    fn before(&self) -> usize {
        if self.root.is_some() { 6 } else { 0 }
    }
}

/// A joint's limit is among the solver's rows only when the joint is this near to it, rad or m: seven idle rows would
/// cost a tenth of the step.
const NEAR_LIMIT: f64 = 0.02;

impl Clone for RapierPlant {
    /// A copy by way of the engine's own snapshot, which is exact.
    fn clone(&self) -> Self {
        let bytes = postcard::to_stdvec(self).expect("the engine's state has a serial form");
        postcard::from_bytes(&bytes).expect("what was just written can be read")
    }
}

impl RapierPlant {
    /// Arms at rest at `q0` (one entry an arm), stepped by `dt` s. `None` when rapier refuses the chain, which it does
    /// for no serial chain of at least one joint.
    pub fn new(arms: &[ArmModel], q0: &[JointVector], dt: f64) -> Option<Self> {
        let rest: Vec<_> = q0.iter().map(|q| MeasuredState { q: *q, qd: JointVector::zeros() }).collect();
        Self::moving(arms, &rest, dt)
    }

    /// The same with arms that move as given (one entry an arm).
    pub fn moving(arms: &[ArmModel], joints: &[MeasuredState], dt: f64) -> Option<Self> {
        let mut world = PhysicsWorld { gravity: rapier::Vector::new(0.0, 0.0, -GRAVITY), ..Default::default() };
        world.integration_parameters.dt = dt;
        // each iteration is a full substep; one per millisecond is right for arms
        world.integration_parameters.num_solver_iterations = 1;
        world.integration_parameters.contact_recycling = false;
        world.integration_parameters.normalized_prediction_distance = 0.001;
        let mut plant = Self { world, arms: Vec::new(), states: Vec::new() };
        for (arm, state) in arms.iter().zip(joints) {
            plant.insert(arm, state, false)?;
        }
        Some(plant)
    }

    /// One arm whose link 0 is free to move; its first body is that.
    pub(super) fn on_base(arm: &ArmModel, joints: &MeasuredState, dt: f64) -> Option<Self> {
        let mut plant = Self::moving(&[], &[], dt)?;
        plant.insert(arm, joints, true)?;
        Some(plant)
    }

    fn insert(&mut self, arm: &ArmModel, start: &MeasuredState, free: bool) -> Option<()> {
        let w = &mut self.world;
        // the engine steps a free root's place at its origin by the speed of its centre of mass: both must be one
        let root = free.then(|| arm.links[0].inertia.com);
        let link_from_root = root.map_or_else(Pose::identity, |c| Pose::translation(c.x, c.y, c.z));
        let foot = match root {
            None => RigidBodyBuilder::fixed().pose(to_rapier(&arm.world_from_base)),
            Some(_) => {
                let centred = SpatialInertia { com: Point3::origin(), ..arm.links[0].inertia };
                RigidBodyBuilder::dynamic()
                    .pose(to_rapier(&(arm.world_from_base * link_from_root)))
                    .can_sleep(false)
                    .linear_damping(0.0)
                    .angular_damping(0.0)
                    .additional_mass_properties(mass_properties(&centred))
            }
        };
        let mut bodies = vec![w.bodies.insert(foot)];
        let mut joint = None;
        for (i, j) in arm.joints.iter().enumerate() {
            let body = RigidBodyBuilder::dynamic()
                .can_sleep(false)
                .linear_damping(0.0)
                .angular_damping(0.0)
                .additional_mass_properties(mass_properties(&arm.links[i + 1].inertia));
            let body = w.bodies.insert(body);
            // rapier's joints turn about or slide along the x axis of their frames
            let turn = UnitQuaternion::rotation_between(&Vector3::x(), &j.axis)
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI));
            let frame = Isometry3::from_parts(Translation3::identity(), turn);
            let mut parent_from_frame = j.parent_from_joint * frame;
            if free && i == 0 {
                parent_from_frame = link_from_root.inverse() * parent_from_frame;
            }
            let (axis, moves) = match j.kind {
                JointKind::Revolute => (JointAxis::AngX, JointAxesMask::ANG_X),
                JointKind::Prismatic => (JointAxis::LinX, JointAxesMask::LIN_X),
            };
            let mut data = GenericJointBuilder::new(JointAxesMask::all() & !moves)
                .local_frame1(to_rapier(&parent_from_frame))
                .local_frame2(to_rapier(&frame))
                .contacts_enabled(false);
            if j.lower.is_finite() && j.upper.is_finite() {
                data = data.limits(axis, [j.lower, j.upper]);
            }
            joint = Some(w.multibody_joints.insert(bodies[i], body, data.build(), true)?);
            bodies.push(body);
        }
        let joint = joint?;
        let (n, before) = (arm.dof(), if free { 6 } else { 0 });
        {
            let (multibody, _) = w.multibody_joints.get_mut(joint)?;
            multibody.set_self_contacts_enabled(false);
            multibody.forward_kinematics(&w.bodies, true);
            for i in 0..before {
                multibody.damping_mut()[i] = 0.0;
            }
            for (i, j) in arm.joints.iter().enumerate() {
                multibody.damping_mut()[before + i] = j.damping;
                multibody.armature_mut()[before + i] = j.armature;
                multibody.frictions_mut()[before + i] = j.friction;
            }
            let mut displacement = vec![0.0; before];
            displacement.extend(&start.q.as_slice()[..n]);
            multibody.apply_displacements(&displacement);
            multibody.forward_kinematics(&w.bodies, true);
            multibody.update_rigid_bodies(&mut w.bodies, true);
            if start.qd != JointVector::zeros() {
                for i in 0..n {
                    multibody.generalized_velocity_mut()[before + i] = start.qd[i];
                }
            }
        }
        self.arms.push(RapierArm {
            bodies,
            joint,
            kinds: arm.joints.iter().map(|j| j.kind).collect(),
            coms: arm.links[1..].iter().map(|l| l.inertia.com).collect(),
            limits: arm.joints.iter().map(|j| [j.lower, j.upper]).collect(),
            root,
        });
        self.states.push(*start);
        Some(())
    }

    /// The engine's world.
    pub(super) fn world(&self) -> &PhysicsWorld {
        &self.world
    }

    /// The engine's world, to put more into it.
    pub(super) fn world_mut(&mut self) -> &mut PhysicsWorld {
        &mut self.world
    }

    /// Puts arm `arm` where these joints are, with their speeds; what else is in the world stays.
    pub(super) fn set_arm(&mut self, arm: usize, joints: &MeasuredState) {
        let w = &mut self.world;
        let a = &self.arms[arm];
        let Some((multibody, _)) = w.multibody_joints.get_mut(a.joint) else { return };
        let mut displacement = vec![0.0; multibody.ndofs()];
        for (i, d) in displacement.iter_mut().enumerate().take(a.kinds.len()) {
            *d = joints.q[i] - self.states[arm].q[i];
        }
        multibody.apply_displacements(&displacement);
        for i in 0..a.kinds.len() {
            multibody.generalized_velocity_mut()[i] = joints.qd[i];
        }
        multibody.forward_kinematics(&w.bodies, true);
        multibody.update_rigid_bodies(&mut w.bodies, true);
        self.states[arm] = *joints;
    }

    /// The body of the last link of arm `arm`.
    pub(super) fn last_body(&self, arm: usize) -> RigidBodyHandle {
        self.arms[arm].bodies[self.arms[arm].kinds.len()]
    }

    /// Joints of the only arm.
    pub(super) fn arm_state(&self) -> &MeasuredState {
        &self.states[0]
    }

    /// Pose of the only arm's link 0, world.
    pub(super) fn base_link_pose(&self) -> Pose {
        let arm = &self.arms[0];
        let p = self.world.bodies[arm.bodies[0]].position();
        let (t, q) = (p.translation, p.rotation);
        let turn = UnitQuaternion::new_normalize(Quaternion::new(q.w, q.x, q.y, q.z));
        let root = Pose::from_parts(Translation3::new(t.x, t.y, t.z), turn);
        arm.root.map_or(root, |c| root * Pose::translation(-c.x, -c.y, -c.z))
    }

    /// Gives the free base of the only arm this motion about the world's origin, m/s and rad/s.
    pub(super) fn set_base_twist(&mut self, twist: &Vector6<f64>) {
        let com = to_vector(&self.world.bodies[self.arms[0].bodies[0]].position().translation);
        let Some((multibody, _)) = self.world.multibody_joints.get_mut(self.arms[0].joint) else { return };
        let (lin, ang): (Vector3<f64>, Vector3<f64>) =
            (twist.fixed_rows::<3>(0).into(), twist.fixed_rows::<3>(3).into());
        let at_com = lin + ang.cross(&com);
        for i in 0..3 {
            multibody.generalized_velocity_mut()[i] = at_com[i];
            multibody.generalized_velocity_mut()[3 + i] = ang[i];
        }
    }

    /// A step of the only arm, whose free base feels `wrench` (N and N m, about the world's origin) besides. False when something
    /// stops being finite.
    pub(super) fn step_on_base(
        &mut self,
        torque: &JointVector,
        force: &TipForce,
        k: &Kinematics,
        wrench: &Vector6<f64>,
    ) -> bool {
        let arm = &self.arms[0];
        let body = &mut self.world.bodies[arm.bodies[0]];
        body.reset_forces(false);
        body.reset_torques(false);
        let com = to_vector(&body.position().translation);
        let mut push: Vector3<f64> = wrench.fixed_rows::<3>(0).into();
        let about: Vector3<f64> = wrench.fixed_rows::<3>(3).into();
        let mut turn = about - com.cross(&push);
        // the first joint pushes back
        let [rotation, slide] = k.joint_motion(0);
        match arm.kinds[0] {
            JointKind::Revolute => turn -= rotation * torque[0],
            JointKind::Prismatic => {
                let f = slide * -torque[0];
                turn += (k.world_from_link(1).translation.vector - com).cross(&f);
                push += f;
            }
        }
        body.add_force(to_rapier_vector(&push), false);
        body.add_torque(to_rapier_vector(&turn), false);
        self.step(std::slice::from_ref(torque), std::slice::from_ref(force), std::slice::from_ref(k)).is_ok()
    }

    fn read(&mut self, a: usize) -> bool {
        let arm = &self.arms[a];
        let Some((multibody, _)) = self.world.multibody_joints.get_mut(arm.joint) else { return false };
        let (state, before) = (&mut self.states[a], arm.before());
        for i in 0..arm.kinds.len() {
            state.qd[i] = multibody.generalized_velocity()[before + i];
            let Some(link) = multibody.link_mut(i + 1) else { return false };
            let (coordinate, axis) = match arm.kinds[i] {
                JointKind::Revolute => (3, JointAxesMask::ANG_X),
                JointKind::Prismatic => (0, JointAxesMask::LIN_X),
            };
            let q = link.joint.coords()[coordinate];
            state.q[i] = q;
            let [lower, upper] = arm.limits[i];
            let near = q < lower + NEAR_LIMIT || q > upper - NEAR_LIMIT;
            link.joint.data.limit_axes = if near { axis } else { JointAxesMask::empty() };
        }
        state.q.iter().all(|x| x.is_finite()) && state.qd.iter().all(|x| x.is_finite())
    }
}

impl Plant for RapierPlant {
    fn state(&self, arm: usize) -> &MeasuredState {
        &self.states[arm]
    }

    fn step(&mut self, torques: &[JointVector], forces: &[TipForce], kinematics: &[Kinematics]) -> Result<(), usize> {
        for (a, arm) in self.arms.iter().enumerate() {
            let (tau, k) = (&torques[a], &kinematics[a]);
            // a torque that isn't finite would silently disable the arm
            if !tau.iter().all(|x| x.is_finite()) || !forces[a].force.iter().all(|x| x.is_finite()) {
                return Err(a);
            }
            let n = arm.kinds.len();
            for i in 0..n {
                // joint i pushes link i + 1 and pushes back on link i; so link i + 1 feels tau_i z_i - tau_(i+1) z_(i+1)
                let body = &mut self.world.bodies[arm.bodies[i + 1]];
                body.reset_forces(false);
                body.reset_torques(false);
                let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
                let com = (k.world_from_link(i + 1) * arm.coms[i]).coords;
                let mut push = |j: usize, sign: f64| {
                    let [rotation, slide] = k.joint_motion(j);
                    match arm.kinds[j] {
                        JointKind::Revolute => torque += rotation * (sign * tau[j]),
                        JointKind::Prismatic => {
                            let f = slide * (sign * tau[j]);
                            let at = k.world_from_link(j + 1).translation.vector;
                            force += f;
                            torque += (at - com).cross(&f);
                        }
                    }
                };
                push(i, 1.0);
                if i + 1 < n {
                    push(i + 1, -1.0);
                }
                if i + 1 == n {
                    force += forces[a].force;
                    torque += (forces[a].point.coords - com).cross(&forces[a].force);
                }
                body.add_force(to_rapier_vector(&force), false);
                body.add_torque(to_rapier_vector(&torque), false);
            }
        }
        self.world.step();
        for a in 0..self.arms.len() {
            if !self.read(a) {
                return Err(a);
            }
        }
        Ok(())
    }
}

pub(super) fn mass_properties(body: &SpatialInertia) -> MassProperties {
    let eigen = SymmetricEigen::new(body.inertia);
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(0).neg_mut();
    }
    let frame = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    MassProperties::with_principal_inertia_frame(
        to_rapier_vector(&body.com.coords),
        body.mass,
        to_rapier_vector(&eigen.eigenvalues),
        to_rapier(&Pose::from_parts(Translation3::identity(), frame)).rotation,
    )
}

fn to_vector(v: &rapier::Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

pub(super) fn to_rapier_vector(v: &Vector3<f64>) -> rapier::Vector {
    rapier::Vector::new(v.x, v.y, v.z)
}

pub(super) fn to_rapier(pose: &Pose) -> rapier::Pose {
    let q: &Quaternion<f64> = pose.rotation.quaternion();
    rapier::Pose::from_parts(
        to_rapier_vector(&pose.translation.vector),
        rapier::Rotation::from_xyzw(q.i, q.j, q.k, q.w),
    )
}
