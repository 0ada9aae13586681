//! The hand in rapier: links of the arm's multibody, moved by torque-limited motors.
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rapier3d_f64::dynamics::MultibodyDofCoupling;
use rapier3d_f64::prelude::{
    CoefficientCombineRule, ColliderBuilder, GenericJointBuilder, JointAxesMask, JointAxis, MotorModel,
    MultibodyJointHandle, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle,
};

use crate::math::Pose;
use crate::skill::{BoxShape, GraspMode, HandCommand, HandModel, HandState, OPEN, Phalanx};
use crate::twin::rapier_plant::{mass_properties, to_rapier};

/// Largest scissor angle, rad (11 degrees).
const SPREAD: f64 = 0.19;
/// Angular frequency of a finger's position loop, rad/s, critically damped.
const BANDWIDTH: f64 = 60.0;
/// Torque of a proximal joint per grip force, N m/N: 6 N m give 70 N at the tip, measured against a spring.
const TORQUE_PER_FORCE: f64 = 6.0 / 70.0;
/// Share of it at the medial joint: the differential's ratio.
const MEDIAL_SHARE: f64 = 0.4;
/// Reflected inertia of the gears, kg m2, and viscous friction, N m s/rad. Both are large against a phalanx, as worm gears are; with
/// a tenth of them the solver's sweeps don't settle and a held tool shivers by 0.02 mm.
const ARMATURE: f64 = 0.005;
const DAMPING: f64 = 0.2;
/// Torque of the scissor's self-locking drive, N m.
const SCISSOR_TORQUE: f64 = 10.0;
/// Its stiffness in units of a finger's: a worm drive can't be pushed back, but its housing gives a little.
const SCISSOR_STIFFNESS: f64 = 50.0;
/// From the first joint to the fingertip's middle, m: speed of the tip over speed of the joint.
const LEVER: f64 = 0.0963;

#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct Joint {
    /// Index of the link in the multibody.
    link: usize,
    /// Index of its speed in the multibody.
    dof: usize,
    target: f64,
}

/// A hand in a world.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Hand {
    joint: MultibodyJointHandle,
    /// Bodies that belong to the hand, the palm's first.
    bodies: Vec<RigidBodyHandle>,
    scissors: [Joint; 2],
    fingers: [[Joint; 3]; 3],
    strength: [f64; 3],
    spread: [f64; 3],
    command: HandCommand,
}

impl Hand {
    /// A hand whose palm is part of the body `carrier` (the palm's mass is that body's already), with friction `friction`.
    /// `None` when rapier refuses a joint, which it does for none of a tree.
    pub(crate) fn insert(
        w: &mut PhysicsWorld,
        carrier: RigidBodyHandle,
        carrier_from_grip: &Pose,
        model: &HandModel,
        friction: f64,
    ) -> Option<Self> {
        let collider = |shape: &BoxShape, before: &Pose| {
            ColliderBuilder::cuboid(shape.half.x, shape.half.y, shape.half.z)
                .position(to_rapier(&(before * shape.link_from_box)))
                .density(0.0)
                .friction(friction)
                .friction_combine_rule(CoefficientCombineRule::Min)
        };
        w.colliders.insert_with_parent(collider(&model.palm, carrier_from_grip), carrier, &mut w.bodies);
        let mut bodies = vec![carrier];
        let mut last = None;
        let mut attach = |w: &mut PhysicsWorld, parent, before: &Pose, phalanx: &Phalanx, axis: Vector3<f64>| {
            let body = RigidBodyBuilder::dynamic()
                .can_sleep(false)
                .linear_damping(0.0)
                .angular_damping(0.0)
                .additional_mass_properties(mass_properties(&phalanx.shape.inertia(phalanx.mass)));
            let body = w.bodies.insert(body);
            let turn = UnitQuaternion::rotation_between(&Vector3::x(), &axis)?;
            let frame = Isometry3::from_parts(Translation3::identity(), turn);
            let mut data = GenericJointBuilder::new(JointAxesMask::all() & !JointAxesMask::ANG_X)
                .local_frame1(to_rapier(&(before * phalanx.parent_from_joint * frame)))
                .local_frame2(to_rapier(&frame))
                .limits(JointAxis::AngX, phalanx.limits)
                .motor_model(JointAxis::AngX, MotorModel::AccelerationBased)
                .contacts_enabled(false)
                .build();
            data.set_motor(JointAxis::AngX, 0.0, 0.0, BANDWIDTH * BANDWIDTH, 2.0 * BANDWIDTH);
            let handle = w.multibody_joints.insert(parent, body, data, true)?;
            last = Some(handle);
            bodies.push(body);
            Some((body, handle))
        };
        let mut handles = Vec::new();
        for finger in &model.fingers {
            let mut chain = Vec::new();
            let thumb = finger.spread == 0.0;
            let (mut parent, mut before) = (carrier, *carrier_from_grip);
            if thumb {
                before *= finger.knuckle.parent_from_joint;
            } else {
                let (body, handle) = attach(w, parent, &before, &finger.knuckle, Vector3::y())?;
                chain.push(handle);
                (parent, before) = (body, Pose::identity());
            }
            for phalanx in &finger.phalanges {
                let (body, handle) = attach(w, parent, &before, phalanx, Vector3::z())?;
                w.colliders.insert_with_parent(collider(&phalanx.shape, &Pose::identity()), body, &mut w.bodies);
                chain.push(handle);
                (parent, before) = (body, Pose::identity());
            }
            handles.push(chain);
        }
        let joint = last?;
        {
            let (multibody, _) = w.multibody_joints.get_mut(joint)?;
            multibody.set_self_contacts_enabled(false);
            multibody.forward_kinematics(&w.bodies, true);
        }
        let found = |w: &PhysicsWorld, handle: MultibodyJointHandle, target: f64| {
            let (multibody, link) = w.multibody_joints.get(handle)?;
            Some(Joint { link, dof: multibody.link(link)?.assembly_id(), target })
        };
        let mut scissors = Vec::new();
        let mut fingers = Vec::new();
        for chain in &handles {
            if chain.len() == 4 {
                scissors.push(found(w, chain[0], 0.0)?);
            }
            let at = chain.len() - 3;
            fingers.push([found(w, chain[at], OPEN)?, found(w, chain[at + 1], 0.0)?, found(w, chain[at + 2], -OPEN)?]);
        }
        let mut hand = Self {
            joint,
            bodies,
            scissors: scissors.try_into().ok()?,
            fingers: fingers.try_into().ok()?,
            strength: model.fingers.map(|f| f.strength),
            spread: model.fingers.map(|f| f.spread),
            command: HandCommand::open(),
        };
        hand.settle(w)?;
        Some(hand)
    }

    /// Inertia and friction of the gears, the coupling of distal to proximal joint, and the fingers at their open position.
    fn settle(&mut self, w: &mut PhysicsWorld) -> Option<()> {
        let (multibody, _) = w.multibody_joints.get_mut(self.joint)?;
        let mut displacement = vec![0.0; multibody.ndofs()];
        for joint in self.scissors.iter().chain(self.fingers.iter().flatten()) {
            multibody.armature_mut()[joint.dof] = ARMATURE;
            multibody.damping_mut()[joint.dof] = DAMPING;
            displacement[joint.dof] = joint.target;
        }
        let axis = JointAxis::AngX as usize;
        for [proximal, _, distal] in &self.fingers {
            multibody.add_dof_coupling(MultibodyDofCoupling {
                link1: proximal.link,
                dof1: 0,
                axis1: axis,
                link2: distal.link,
                dof2: 0,
                axis2: axis,
                coeff: -1.0,
                offset: 0.0,
            });
        }
        multibody.apply_displacements(&displacement);
        multibody.forward_kinematics(&w.bodies, true);
        multibody.update_rigid_bodies(&mut w.bodies, true);
        Some(())
    }

    /// Gives the hand something to do; its motors go there at the command's speed.
    pub fn command(&mut self, command: HandCommand) {
        self.command = command;
    }

    /// What it was commanded last.
    pub fn commanded(&self) -> HandCommand {
        self.command
    }

    /// Whether the motors' targets have arrived where the command wants them (the fingers may be held up).
    pub fn targets_reached(&self) -> bool {
        let (close, wrap, spread) = self.targets();
        let near = |joint: &Joint, at: f64| (joint.target - at).abs() < 1e-9;
        self.fingers.iter().all(|[p, m, _]| near(p, close) && near(m, wrap))
            && self.scissors.iter().zip(&self.spread).all(|(joint, sign)| near(joint, sign * spread))
    }

    /// Angles of first joints, second joints and (outwards) scissors that the command means.
    fn targets(&self) -> (f64, f64, f64) {
        let c = &self.command;
        match c.mode {
            GraspMode::Basic => (c.close, c.wrap, 0.0),
            GraspMode::Pinch => (c.close, c.wrap, -SPREAD),
            GraspMode::Wide => (c.close, c.wrap, SPREAD),
            GraspMode::Scissor => (OPEN, 0.0, SPREAD * (1.0 - 2.0 * (c.close / 1.2217).clamp(0.0, 1.0))),
        }
    }

    /// Moves the motors' targets on by `dt` s and sets torques. `None` when the multibody is gone.
    pub(crate) fn drive(&mut self, w: &mut PhysicsWorld, dt: f64) -> Option<()> {
        let (close, wrap, spread) = self.targets();
        let step = self.command.speed / LEVER * dt;
        let torque = self.command.force * TORQUE_PER_FORCE;
        let (multibody, _) = w.multibody_joints.get_mut(self.joint)?;
        let mut drive = |joint: &mut Joint, target: f64, most: f64, strength: f64| {
            joint.target += (target - joint.target).clamp(-step, step);
            let data = &mut multibody.link_mut(joint.link)?.joint.data;
            // as much stiffer as it is stronger, so that thumb and fingers meet in the middle
            let (k, d) = (strength * BANDWIDTH * BANDWIDTH, strength * 2.0 * BANDWIDTH);
            data.set_motor(JointAxis::AngX, joint.target, 0.0, k, d);
            data.set_motor_max_force(JointAxis::AngX, most);
            Some(())
        };
        for (joint, sign) in self.scissors.iter_mut().zip(&self.spread) {
            drive(joint, sign * spread, SCISSOR_TORQUE, SCISSOR_STIFFNESS)?;
        }
        for ([proximal, medial, distal], strength) in self.fingers.iter_mut().zip(&self.strength) {
            drive(proximal, close, torque * strength, *strength)?;
            drive(medial, wrap, torque * MEDIAL_SHARE * strength, *strength)?;
            // the coupling moves it; its own motor stays out of the way
            drive(distal, -close, 0.0, 1.0)?;
        }
        Some(())
    }

    /// Where the fingers are.
    pub(crate) fn state(&self, w: &PhysicsWorld) -> Option<HandState> {
        let (multibody, _) = w.multibody_joints.get(self.joint)?;
        let angle = |joint: &Joint| Some(multibody.link(joint.link)?.joint().coords()[JointAxis::AngX as usize]);
        let mut state = HandState::default();
        for (f, finger) in self.fingers.iter().enumerate() {
            for (i, joint) in finger.iter().enumerate() {
                state.q[f][i] = angle(joint)?;
                state.qd[f][i] = multibody.generalized_velocity()[joint.dof];
            }
        }
        for (s, joint) in self.scissors.iter().enumerate() {
            state.scissor[s] = angle(joint)?;
        }
        Some(state)
    }

    /// Whether the fingers are wrapped round something, their motors at rest.
    pub(crate) fn is_wrapped(&self) -> bool {
        self.command.wrap > 0.0 && self.targets_reached()
    }

    /// Bodies of the hand, the one that carries the palm first.
    pub(crate) fn bodies(&self) -> &[RigidBodyHandle] {
        &self.bodies
    }
}
