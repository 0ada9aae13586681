//! A world in which a hand on an arm meets a pen tool and its dock: contact and friction, nothing glued.
use nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion, Vector3, Vector6};
use rand_chacha::ChaCha8Rng;
use rapier3d_f64::dynamics::FrictionModel;
use rapier3d_f64::prelude::{
    CoefficientCombineRule, ColliderBuilder, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle, SpringCoefficients,
};

use super::Hand;
use super::noise::NoiseSource;
use serde::{Deserialize, Serialize};

use crate::control::{ImpedanceController, MeasuredState, Reference};
use crate::math::{Pose, stream};
use crate::mesh::TriMesh;
use crate::robot::{ArmModel, GRAVITY, JointVector, Kinematics};
use crate::skill::{Carrier, HandCommand, HandModel, HandState, Senses, tool_from_pen, toward};
use crate::tool::{ConvexPart, ToolSet};
use crate::truth::SensorNoise;
use crate::twin::rapier_plant::{to_rapier, to_rapier_vector};
use crate::twin::{Plant, RapierPlant, TipForce};

/// Length of a step, s.
pub const DT: f64 = 1e-3;
/// A tool slower than this (m/s) for so long (s) is at rest: 0.1 mm/s, a tenth of what gravity adds in a step.
const REST_SPEED: f64 = 1e-4;
const REST_TIME: f64 = 0.1;
/// Smoothing time of the wrist's force and torque, s.
const SMOOTHING: f64 = 0.02;

/// Substeps once the fingers are wrapped round a tool. With one, a tool that is pulled at with 7 N jumps by up to 0.13 mm every few
/// seconds and comes back, the solver's sweeps not having settled; with two it jumps seldom and by at most 0.035 mm, and ends a minute
/// within 0.01 mm. Two while the fingers still wrap clamped 3 tools of 300 0.15 to 0.32 mm too high.
const SUBSTEPS: usize = 2;

/// Why a step failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum GraspError {
    /// The arm can't reach.
    #[error("no joints put the hand where it should stand")]
    Unreachable,
    /// The engine refused a shape or a joint.
    #[error("the physics engine refused a part of hand, tool or dock")]
    Refused,
    /// A state stopped being finite.
    #[error("the state of the arm is no longer finite after {steps} steps")]
    NotFinite {
        /// Steps made before.
        steps: u64,
    },
}

/// How a hand, a tool and its dock stand when a tool change begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beginning {
    /// True joints of the arm.
    pub joints: MeasuredState,
    /// Joints that were desired last, rad.
    pub desired: JointVector,
    /// The dock: pose of the tool seated in it, world.
    pub dock: Pose,
    /// The tool, world.
    pub tool: Pose,
}

/// Arm, hand, tool and dock.
#[derive(Clone, Serialize, Deserialize)]
pub struct GraspWorld {
    plant: RapierPlant,
    model: ArmModel,
    believed: ArmModel,
    controller: ImpedanceController,
    hand: Hand,
    tool: RigidBodyHandle,
    dock: Option<RigidBodyHandle>,
    desired: JointVector,
    desired_qd: JointVector,
    wrench: Vector6<f64>,
    pull: Vector3<f64>,
    /// Joint torques of the last step, N m.
    torque: JointVector,
    noise: NoiseSource,
    /// How far the hand is from where its joints tell, m, world.
    approach_error: Vector3<f64>,
    steps: u64,
    set: ToolSet,
}

impl GraspWorld {
    /// An arm whose open hand stands at `grip`, and a tool in a dock at `world_from_dock` (the pose of the seated tool).
    ///
    /// # Errors
    /// The arm can't reach, or the engine refuses a shape.
    pub fn new(
        carrier: &Carrier,
        hand: &HandModel,
        set: &ToolSet,
        grip: &Pose,
        world_from_dock: &Pose,
    ) -> Result<Self, GraspError> {
        let q = carrier.joints_for(grip).ok_or(GraspError::Unreachable)?;
        let rest = MeasuredState { q, qd: JointVector::zeros() };
        Self::begin(
            carrier,
            hand,
            set,
            &Beginning { joints: rest, desired: q, dock: *world_from_dock, tool: *world_from_dock },
        )
    }

    /// An arm that goes on from where it is, its hand open, and a tool at rest in or over a dock.
    ///
    /// # Errors
    /// The engine refuses a shape.
    pub fn begin(
        carrier: &Carrier,
        hand: &HandModel,
        set: &ToolSet,
        beginning: &Beginning,
    ) -> Result<Self, GraspError> {
        let Beginning { joints, desired, dock: world_from_dock, tool: world_from_tool } = beginning;
        let arm = std::slice::from_ref(&carrier.plant);
        let mut plant = RapierPlant::moving(arm, std::slice::from_ref(joints), DT).ok_or(GraspError::Refused)?;
        let last = plant.last_body(0);
        let w = plant.world_mut();
        tune(w);
        let friction = set.tool.friction_fingers;
        let hand = Hand::insert(w, last, &carrier.plant.last_from_tip, hand, friction).ok_or(GraspError::Refused)?;

        let tool =
            RigidBodyBuilder::dynamic().pose(to_rapier(world_from_tool)).linear_damping(0.0).angular_damping(0.0);
        let tool = w.bodies.insert(tool);
        // at rest in its dock the tool costs more than the whole hand; what a finger touches is awake
        let rest = w.bodies[tool].activation_mut();
        rest.normalized_linear_threshold = REST_SPEED;
        rest.time_until_sleep = REST_TIME;
        let most = set.tool.friction_fingers.max(set.tool.friction_dock);
        for part in set.tool.parts() {
            let hull = hull(&part).ok_or(GraspError::Refused)?.density(set.tool.density()).friction(most);
            w.colliders.insert_with_parent(hull, tool, &mut w.bodies);
        }
        let dock = w.bodies.insert(RigidBodyBuilder::fixed().pose(to_rapier(world_from_dock)));
        for part in set.dock_parts() {
            let hull = hull(&part).ok_or(GraspError::Refused)?.friction(set.tool.friction_dock);
            w.colliders.insert_with_parent(hull, dock, &mut w.bodies);
        }
        Ok(Self {
            plant,
            model: carrier.plant.clone(),
            believed: carrier.believed.clone(),
            controller: ImpedanceController::new(carrier.believed.clone(), carrier.gains.clone()),
            hand,
            tool,
            dock: Some(dock),
            desired: *desired,
            desired_qd: JointVector::zeros(),
            wrench: Vector6::zeros(),
            pull: Vector3::zeros(),
            torque: JointVector::zeros(),
            noise: NoiseSource::new(SensorNoise::default(), stream(0, "no noise", 0)),
            approach_error: Vector3::zeros(),
            steps: 0,
            set: set.clone(),
        })
    }

    /// One step of [`DT`]: the arm follows `grip`, the hand its command.
    ///
    /// # Errors
    /// A state that is no longer finite.
    pub fn step(&mut self, grip: &Pose, command: &HandCommand) -> Result<(), GraspError> {
        let grip = Translation3::from(self.approach_error) * grip;
        let (step, _) = toward(&self.believed, &self.desired, &grip);
        // a goal that jumps is followed within the joints' speed limits
        let mut next = self.desired;
        for i in 0..self.believed.dof() {
            let most = self.believed.joints[i].velocity * DT;
            next[i] += step[i].clamp(-most, most);
        }
        let qd = (next - self.desired) / DT;
        let reference = Reference { qd, qdd: (qd - self.desired_qd) / DT, ..Reference::rest(next) };
        (self.desired, self.desired_qd) = (next, qd);

        let before = *self.plant.state(0);
        let k = self.believed.kinematics(&before.q);
        let torque = self.controller.torque(&before, &k, &reference, DT).torque;
        self.command(command);
        self.drive(&torque, &TipForce::default(), &k)
    }

    /// Gives the hand something to do from the next step on.
    pub fn command(&mut self, command: &HandCommand) {
        self.hand.command(*command);
    }

    /// What the hand was commanded last.
    pub fn commanded(&self) -> HandCommand {
        self.hand.commanded()
    }

    /// One step of [`DT`] under joint torques (N m) and a force on the tool, the hand as last commanded; `k` are the arm's
    /// kinematics now.
    ///
    /// # Errors
    /// A state that is no longer finite.
    pub fn drive(&mut self, torque: &JointVector, pen: &TipForce, k: &Kinematics) -> Result<(), GraspError> {
        let broken = GraspError::NotFinite { steps: self.steps };
        let before = *self.plant.state(0);
        let w = self.plant.world_mut();
        self.hand.drive(w, DT).ok_or(broken)?;
        w.integration_parameters.num_solver_iterations = if self.hand.is_wrapped() { SUBSTEPS } else { 1 };
        let tool = &mut w.bodies[self.tool];
        tool.reset_forces(false);
        tool.reset_torques(false);
        if self.pull != Vector3::zeros() {
            let tip = self.set.tool.pen_tip();
            let at = tool.position().transform_point(to_rapier_vector(&tip.coords));
            tool.add_force_at_point(to_rapier_vector(&self.pull), at, false);
        }
        if pen.force != Vector3::zeros() {
            let at = to_rapier_vector(&pen.point.coords);
            tool.add_force_at_point(to_rapier_vector(&pen.force), at, true);
        }
        self.plant.step(&[*torque], &[TipForce::default()], &[*k]).map_err(|_| broken)?;
        self.steps += 1;
        self.torque = *torque;

        // what moved the hand beyond the joint torques: J^T w = M qdd + C qd + g - tau
        let after = self.plant.state(0);
        let gravity = Vector3::new(0.0, 0.0, -GRAVITY);
        let k = self.believed.kinematics(&before.q);
        let excess = self.believed.inverse_dynamics(&k, &before.qd, &((after.qd - before.qd) / DT), &gravity) - torque;
        let j = k.jacobian();
        if let Some(factor) = (j * j.transpose()).cholesky() {
            let felt = factor.solve(&(j * excess));
            self.wrench += (felt - self.wrench) * (DT / SMOOTHING);
        }
        self.noise.draw();
        Ok(())
    }

    /// What the robot senses now.
    pub fn senses(&self) -> Senses {
        Senses {
            world_from_grip: Translation3::from(-self.approach_error)
                * self.believed.kinematics(&self.plant.state(0).q).world_from_tip(),
            hand: self.sensed_hand(),
            hand_arrived: self.hand.targets_reached(),
            force: self.wrench.fixed_rows::<3>(0) + self.noise.wrench[0],
            torque: self.wrench.fixed_rows::<3>(3) + self.noise.wrench[1],
        }
    }

    fn sensed_hand(&self) -> HandState {
        self.noise.read(self.hand.state(self.plant.world()).unwrap_or_default())
    }

    /// Finger joints as the robot senses them, rad.
    pub fn sensed_fingers(&self) -> [[f64; 3]; 3] {
        self.sensed_hand().q
    }

    /// True joint state of the arm.
    pub fn state(&self) -> &MeasuredState {
        self.plant.state(0)
    }

    /// Takes it that these joints (rad), at rest, were desired last: something else has led the arm there.
    pub fn restart_at(&mut self, desired: JointVector) {
        (self.desired, self.desired_qd) = (desired, JointVector::zeros());
    }

    /// The arm goes on from these joints, moved there by something else, and the tool in the hand with it.
    pub fn carry_to(&mut self, joints: &MeasuredState) {
        let before = self.world_from_grip();
        let tool = self.world_from_tool();
        self.plant.set_arm(0, joints);
        let k = self.model.kinematics(&joints.q);
        let (grip, twist) = (*k.world_from_tip(), k.jacobian() * joints.qd);
        let moved = grip * before.inverse() * tool;
        let (linear, angular) = (twist.fixed_rows::<3>(0).into_owned(), twist.fixed_rows::<3>(3).into_owned());
        let body = &mut self.plant.world_mut().bodies[self.tool];
        body.set_position(to_rapier(&moved), true);
        let com = body.center_of_mass();
        let arm = Vector3::new(com.x, com.y, com.z) - grip.translation.vector;
        body.set_linvel(to_rapier_vector(&(linear + angular.cross(&arm))), true);
        body.set_angvel(to_rapier_vector(&angular), true);
    }

    /// Joint torques that acted in the last step, N m.
    pub fn torque(&self) -> JointVector {
        self.torque
    }

    /// The true tool.
    pub fn tool_set(&self) -> &ToolSet {
        &self.set
    }

    /// True mass of the tool, kg.
    pub fn tool_mass(&self) -> f64 {
        self.set.tool.mass
    }

    /// True pose of the pen's tip frame, world.
    pub fn world_from_pen(&self) -> Pose {
        self.world_from_tool() * tool_from_pen(&self.set)
    }

    /// Velocity of the pen's tip, m/s, world.
    pub fn tool_tip_velocity(&self) -> Vector3<f64> {
        let body = &self.plant.world().bodies[self.tool];
        let v = body.velocity_at_point(to_rapier_vector(&self.world_from_pen().translation.vector));
        Vector3::new(v.x, v.y, v.z)
    }

    /// Joints that were desired last, rad.
    pub fn desired(&self) -> JointVector {
        self.desired
    }

    /// True joints of the fingers, rad.
    pub fn fingers(&self) -> [[f64; 3]; 3] {
        self.hand.state(self.plant.world()).unwrap_or_default().q
    }

    /// True pose of the grip frame, world.
    pub fn world_from_grip(&self) -> Pose {
        *self.model.kinematics(&self.plant.state(0).q).world_from_tip()
    }

    /// True pose of the tool, world.
    pub fn world_from_tool(&self) -> Pose {
        from_rapier(self.plant.world().bodies[self.tool].position())
    }

    /// True pose of the tool in the frame of the arm's last link.
    pub fn last_from_tool(&self) -> Pose {
        let k = self.model.kinematics(&self.plant.state(0).q);
        k.world_from_link(self.model.dof()).inverse() * self.world_from_tool()
    }

    /// True pose of the tool in the grip frame.
    pub fn grip_from_tool(&self) -> Pose {
        self.world_from_grip().inverse() * self.world_from_tool()
    }

    /// True pen tip, m, grip frame.
    pub fn pen_tip(&self) -> Point3<f64> {
        self.grip_from_tool() * self.set.tool.pen_tip()
    }

    /// Pulls at the pen tip with `force` (N, world) from the next step on.
    pub fn pull(&mut self, force: Vector3<f64>) {
        self.pull = force;
    }

    /// Makes the senses noisy from the next step on, by numbers from this stream.
    pub fn set_senses(&mut self, noise: SensorNoise, stream: ChaCha8Rng) {
        self.noise = NoiseSource::new(noise, stream);
    }

    /// From now on the hand is off by this from where the arm's joints tell, m, world.
    pub fn set_approach_error(&mut self, error: Vector3<f64>) {
        self.approach_error = error;
    }

    /// Takes the dock away, as when the hand has left it far behind.
    pub fn remove_dock(&mut self) {
        if let Some(dock) = self.dock.take() {
            self.plant.world_mut().remove_body(dock);
        }
    }

    /// Puts a solid into the world that the tool may fall on.
    ///
    /// # Errors
    /// The engine refuses the mesh.
    pub fn put_ground(&mut self, mesh: &TriMesh) -> Result<(), GraspError> {
        let vertices = mesh.vertices().iter().map(|p| to_rapier_vector(&p.coords)).collect();
        let ground = ColliderBuilder::trimesh(vertices, mesh.triangles().to_vec()).map_err(|_| GraspError::Refused)?;
        let friction = self.set.tool.friction_dock;
        self.plant.world_mut().colliders.insert(ground.friction(friction));
        Ok(())
    }

    /// Sets friction between hand and tool from now on.
    pub fn set_grip_friction(&mut self, friction: f64) {
        let bodies = self.hand.bodies().to_vec();
        let w = self.plant.world_mut();
        for body in bodies {
            for collider in w.bodies[body].colliders().to_vec() {
                w.colliders[collider].set_friction(friction);
            }
        }
    }

    /// Steps made.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Puts the tool at a pose at rest: to set a trial up, never while it runs.
    pub fn place_tool(&mut self, world_from_tool: &Pose) {
        self.plant.world_mut().bodies[self.tool].set_position(to_rapier(world_from_tool), true);
    }
}

/// Settings that hold a grasp still. The engine's own let bodies sink into each other by millimetres, and its reuse of old
/// contacts flings a held tool away.
fn tune(w: &mut PhysicsWorld) {
    let p = &mut w.integration_parameters;
    // sweeps within a substep are what stops creep, and are nearly free
    p.num_internal_pgs_iterations = 16;
    p.num_internal_stabilization_iterations = 1;
    p.contact_softness = SpringCoefficients::new(500.0, 1.0);
    p.static_contact_softness = SpringCoefficients::new(500.0, 1.0);
    p.contact_recycling = false;
    p.normalized_prediction_distance = 0.0005;
    p.normalized_max_corrective_velocity = 0.5;
    p.normalized_allowed_linear_error = 1e-4;
    p.friction_in_bias_pass = false;
    p.friction_model = FrictionModel::Coulomb;
    p.max_ccd_substeps = 0;
}

fn hull(part: &ConvexPart) -> Option<ColliderBuilder> {
    let points: Vec<_> = part.points().iter().map(|p| to_rapier_vector(&p.coords)).collect();
    Some(ColliderBuilder::convex_hull(&points)?.density(0.0).friction_combine_rule(CoefficientCombineRule::Min))
}

fn from_rapier(pose: &rapier3d_f64::prelude::Pose) -> Pose {
    let (t, r) = (pose.translation, pose.rotation);
    Pose::from_parts(
        Vector3::new(t.x, t.y, t.z).into(),
        UnitQuaternion::new_normalize(Quaternion::new(r.w, r.x, r.y, r.z)),
    )
}
