//! The loop of one arm: control, contact, ink and physics at 1 kHz. It owns all that it needs, and goes on from task to task.
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::camera::HandCamera;
use crate::control::LawOptions;
use crate::control::{MeasuredState, Reference};
use crate::math::{Rgb, stream};
use crate::plan::{DepthProfile, MotionSample, Segment, SegmentKind, Trajectory};
use crate::robot::{ArmModel, JointVector, Kinematics};
use crate::skill::{Felt, Move};
use crate::truth::TrueGripper;
use crate::twin::arm::{ArmState, Disturbance, Moment, TwinArm};
use crate::twin::base::DriveState;
use crate::twin::grasp::{DockState, Held};
use crate::twin::log::{ArmEnding, ArmLog};
use crate::twin::sense::TipSensor;
use crate::twin::{
    ArmPlant, ArticulatedPlant, BaseSample, Event, EventKind, Feeling, Plant, PlantKind, RapierPlant, TipForce,
    TipState, TrueScene, TwinOptions, WheelCommand,
};

/// Why a simulation ended early.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TwinError {
    /// The physics blew up.
    #[error("arm {arm} stopped being finite at {time:.3} s: its controller is unstable (stiffness or delay too high?)")]
    NotFinite {
        /// Name of the arm.
        arm: String,
        /// Simulated time, s.
        time: f64,
    },
    /// rapier takes no such chain.
    #[error("rapier refused the robot's chain of joints")]
    Refused,
    /// Wheels that can't drive a base in all three ways.
    #[error("the base's wheels can't drive it ahead, sideways and round: give left and right rollers mirrored angles")]
    NoWheels,
    /// A drive of an arm that stands on no base.
    #[error("arm {arm} can't drive: it stands on no driven base")]
    NoBase {
        /// Name of the arm.
        arm: String,
    },
    /// A picture of an arm that has no camera.
    #[error("arm {arm} can't look: it has no camera on its hand")]
    NoCamera {
        /// Name of the arm.
        arm: String,
    },
    /// The physics of a grasp broke.
    #[error("a tool change of arm {arm}: {source}")]
    Grasp {
        /// Name of the arm.
        arm: String,
        /// Why.
        source: crate::twin::grasp::GraspError,
    },
    /// A tool makes no solid.
    #[error("the pen tool: {0}")]
    Tool(crate::mesh::MeshError),
    /// A tool change without a gripper, or without a pen in the hand.
    #[error("arm {arm} can't change tools here: it has no gripper, or not the pen that is asked for")]
    NoTool {
        /// Name of the arm.
        arm: String,
    },
}

/// How a motion ended.
#[derive(Clone, Debug)]
pub struct Ended {
    /// Time, s.
    pub time: f64,
    /// Whether its guard stopped it.
    pub stopped: bool,
    /// Whether the arm has lost its pen.
    pub lost: bool,
    /// Whether a pen that was taken to be held as one body with the hand was loaded with more than its grasp withstands.
    pub overloaded: bool,
    /// What was desired last: the next motion should go on from here.
    pub reference: Reference,
    /// Touches, in time order; empty unless the arm is asked to feel.
    pub felt: Vec<Felt>,
}

/// One arm as a simulation begins with it.
pub struct ArmSetup {
    /// Index of the arm among those that draw.
    pub index: usize,
    /// The true arm.
    pub model: ArmModel,
    /// The arm as it believes itself to be.
    pub believed: ArmModel,
    /// Joints at the start, at rest, rad.
    pub start: JointVector,
    /// The layer whose pen it holds, or will hold first.
    pub layer: usize,
    /// Its hand, docks and tools, if it has a gripper.
    pub gripper: Option<Arc<TrueGripper>>,
    /// Colours of the layers' inks.
    pub colors: Vec<Rgb>,
}

/// All that changes in the simulation of one arm.
#[derive(Clone, Serialize, Deserialize)]
pub struct SimulationState {
    pub(super) step: u64,
    pub(super) arm: ArmState,
    pub(super) plant: ArmPlant,
    /// The pen in the hand, with the world in which it was grasped.
    pub(super) held: Option<Held>,
    pub(super) docks: Vec<DockState>,
    /// What drives the base, of an arm on one.
    pub(super) base: Option<DriveState>,
    /// The camera on the hand, if there is one.
    pub(super) eye: Option<HandCamera>,
}

/// A simulation of one arm that goes on from task to task, so that later tasks can follow from what earlier ones met.
pub struct Simulation {
    pub(super) scene: Arc<TrueScene>,
    pub(super) gripper: Option<Arc<TrueGripper>>,
    pub(super) colors: Vec<Rgb>,
    pub(super) law: LawOptions,
    pub(super) options: TwinOptions,
    pub(super) state: SimulationState,
    kinematics: Kinematics,
    pub(super) log: ArmLog,
    stride: u64,
}

impl Simulation {
    /// An arm at rest.
    ///
    /// # Errors
    /// rapier refuses the chain.
    pub fn new(
        setup: ArmSetup,
        scene: Arc<TrueScene>,
        law: LawOptions,
        options: &TwinOptions,
    ) -> Result<Self, TwinError> {
        let ArmSetup { index, model, believed, start, layer, gripper, colors } = setup;
        let rest = MeasuredState { q: start, qd: JointVector::zeros() };
        let plant = plant(&model, &rest, options)?;
        let noise = (options.torque_noise > 0.0).then(|| {
            (stream(options.seed, &format!("torque noise of {}", model.name), index as u64), options.torque_noise)
        });
        let delay_steps = (options.delay / options.dt).round().max(0.0) as usize;
        let disturbance = Disturbance { delay_steps, noise };
        let docks = gripper.as_ref().map_or_else(Vec::new, |g| DockState::all(g));
        let kinematics = model.kinematics(&start);
        let twin = TwinArm { model, controller: law.controller(believed) };
        let arm = ArmState::new(index, twin, start, layer, &scene.pens, disturbance);
        let state = SimulationState { step: 0, arm, plant, held: None, docks, base: None, eye: None };
        let stride = ((options.sample_period / options.dt).round() as u64).max(1);
        let options = options.clone();
        Ok(Self { scene, gripper, colors, law, options, state, kinematics, log: ArmLog::default(), stride })
    }

    /// All that changes in it.
    pub fn state(&self) -> &SimulationState {
        &self.state
    }

    /// Goes on from a state of this simulation, with an empty log.
    pub fn restore(&mut self, state: SimulationState) {
        self.state = state;
        self.log = ArmLog::default();
        self.refresh();
    }

    /// Lets the arm feel what its pen touches, with a stream of noise of its own.
    pub fn feel(&mut self, feeling: Feeling, index: usize) {
        let name = format!("force noise of {}", self.state.arm.model.name);
        self.state.arm.feel(TipSensor::new(feeling, stream(self.options.seed, &name, index as u64)));
    }

    /// Time, s.
    pub fn time(&self) -> f64 {
        self.state.step as f64 * self.options.dt
    }

    /// Steps since the run began.
    pub fn step(&self) -> u64 {
        self.state.step
    }

    /// Name of the arm.
    pub fn name(&self) -> &str {
        &self.state.arm.model.name
    }

    /// Length of a step, s.
    pub fn step_length(&self) -> f64 {
        self.options.dt
    }

    /// Whether a motion is under way.
    pub fn is_under_way(&self) -> bool {
        self.state.arm.is_entered()
    }

    /// When the timeline under way began, s.
    pub fn timeline_began(&self) -> f64 {
        self.time() - self.state.arm.since(self.time())
    }

    /// Whether the arm fetches its pens.
    pub fn fetches(&self) -> bool {
        self.gripper.is_some()
    }

    /// Moves lines that have ended to the log.
    pub fn drain(&mut self) {
        self.state.arm.drain(&mut self.log);
    }

    /// From now on the pen in the hand is held by contact and friction alone; with a time (s) after which the fingers open by mistake.
    pub fn hold_by_friction(&mut self, opens_after: Option<f64>) {
        let (joints, desired) = (self.joints(), self.desired().q);
        if let Some(held) = &mut self.state.held {
            held.meet(&joints, &desired, false);
            held.hold_by_friction(opens_after);
            self.state.plant = ArmPlant::Grasp;
        }
        self.refresh();
    }

    /// The layer whose pen the hand holds; `None` of a hand that fetches its pens and is empty.
    pub fn holds(&self) -> Option<usize> {
        match (&self.gripper, &self.state.held) {
            (Some(_), None) => None,
            _ => Some(self.state.arm.layer()),
        }
    }

    /// What was desired last.
    pub fn desired(&self) -> MotionSample {
        let d = self.state.arm.desired();
        MotionSample { q: d.q, qd: d.qd, qdd: d.qdd }
    }

    /// True joint state.
    pub fn measured(&self) -> MeasuredState {
        self.joints()
    }

    /// What happened since this was last called.
    pub fn take_log(&mut self) -> ArmLog {
        std::mem::take(&mut self.log)
    }

    /// How the arm stands now.
    pub fn ending(&self) -> ArmEnding {
        let base = self.true_base().map(|b| *b.reveal());
        ArmEnding { base, ..self.state.arm.ending(self.time(), &self.joints()) }
    }

    /// The arm stands with its brakes on until `step`: only its pen dries.
    pub fn stand_until(&mut self, step: u64) {
        let Some(steps) = step.checked_sub(self.state.step).filter(|s| *s > 0) else { return };
        let time = self.time();
        let kind = EventKind::Segment { kind: SegmentKind::Wait };
        self.log.events.push(Event { time, arm: self.index(), stroke: None, kind });
        self.state.arm.advance_drying(steps as f64 * self.options.dt);
        self.state.step = step;
    }

    /// Index of the arm among those that draw.
    pub fn index(&self) -> usize {
        self.state.arm.index()
    }

    /// Goes on with a motion for at most `most` steps: how it ended, or `None` while it is under way. With a `guard` (N) it ends at the
    /// step after the arm felt that force; and always when the arm loses its pen. `adjust` hears the reference and the felt force (N)
    /// once every so many steps, and gives the reference that is to hold.
    ///
    /// # Errors
    /// The physics blew up.
    pub fn execute(
        &mut self,
        movement: &Move,
        guard: Option<f64>,
        most: u64,
        mut adjust: Option<Adjust>,
    ) -> Result<Option<Ended>, TwinError> {
        let time = self.time();
        if movement.begins && !self.state.arm.is_entered() {
            self.state.arm.begin_timeline(time, self.state.step);
        }
        self.state.arm.enter(&movement.segment, time, &self.scene, &mut self.log);
        for _ in 0..most {
            if self.is_over(movement) {
                return Ok(Some(self.leave(Stop::default())));
            }
            let overloaded = self.advance(movement)?;
            self.state.step += 1;
            if let Some(adjust) = &mut adjust
                && self.state.step.is_multiple_of(adjust.period)
            {
                let reference = *self.state.arm.desired();
                let corrected = (adjust.correct)(reference, self.state.arm.felt_force());
                self.state.arm.correct(corrected.q - reference.q);
            }
            let stopped = guard.is_some_and(|force| self.state.arm.felt_force() > force);
            let lost = self.state.held.as_ref().is_some_and(Held::is_lost);
            if stopped || lost || overloaded {
                return Ok(Some(self.leave(Stop { stopped, lost, overloaded })));
            }
        }
        Ok(None)
    }

    /// Ends a segment in which the arm only stood.
    pub(super) fn end_standing(&mut self) {
        if self.state.arm.is_entered() {
            self.leave(Stop::default());
        }
    }

    /// Whether a motion has come to its end: the last of a timeline settles for one step.
    fn is_over(&self, movement: &Move) -> bool {
        let end = movement.segment.end();
        if movement.ends {
            let steps = (end / self.options.dt).ceil() as u64 + 1;
            self.state.step - self.state.arm.began_step >= steps
        } else {
            self.state.arm.since(self.time()) >= end
        }
    }

    fn leave(&mut self, stop: Stop) -> Ended {
        let felt = self.state.arm.leave(&mut self.log);
        let Stop { stopped, lost, overloaded } = stop;
        Ended { time: self.time(), stopped, lost, overloaded, reference: *self.state.arm.desired(), felt }
    }

    /// One step. Whether what the hand holds was loaded with more than its grasp withstands.
    fn advance(&mut self, movement: &Move) -> Result<bool, TwinError> {
        let (time, dt) = (self.time(), self.options.dt);
        let measured = self.joints();
        let tip = self.tip(&measured);
        let sample = self.state.step.is_multiple_of(self.stride);
        let now = Moment {
            segment: &movement.segment,
            time,
            dt,
            state: &measured,
            kinematics: &self.kinematics,
            tip: &tip,
            scene: &self.scene,
            sample,
        };
        let out = self.state.arm.step(&now, &mut self.log);
        let s = &mut self.state;
        let finite = match (&mut s.plant, &mut s.held) {
            (ArmPlant::Rapier(p), _) => p.step(&[out.torque], &[out.force], &[self.kinematics]).is_ok(),
            (ArmPlant::Articulated(p), _) => p.step(&[out.torque], &[out.force], &[self.kinematics]).is_ok(),
            (ArmPlant::Grasp, Some(held)) => held.drive(&out.torque, &out.force, &self.kinematics).is_ok(),
            (ArmPlant::Grasp, None) => false,
            (ArmPlant::Mobile(p), _) => {
                p.step(&out.torque, &out.force, &s.base.as_ref().map_or(WheelCommand::Hold, |b| b.command))
            }
        };
        if !finite {
            return Err(TwinError::NotFinite { arm: self.state.arm.model.name.clone(), time });
        }
        self.refresh();
        if let (ArmPlant::Mobile(p), Some(base)) = (&self.state.plant, &mut self.state.base) {
            base.read(p, dt);
            if sample {
                let (segment, driving) = (movement.segment.kind, base.is_driving());
                self.log.base.push(BaseSample { time, segment, driving, pose: p.base_pose() });
            }
        }
        Ok(self.overloaded(&out.force, &measured))
    }

    /// Whether the pen, taken to be one body with the hand, is loaded with more than its grasp withstands.
    fn overloaded(&self, force: &TipForce, before: &MeasuredState) -> bool {
        let Some(held) = self.state.held.as_ref().filter(|_| !matches!(self.state.plant, ArmPlant::Grasp)) else {
            return false;
        };
        held.is_overloaded(&self.kinematics, force, [before, &self.joints()], self.options.dt)
    }

    /// Where everything is now.
    pub(super) fn kinematics(&self) -> &Kinematics {
        &self.kinematics
    }

    /// The kinematics of the present joints.
    pub(super) fn refresh(&mut self) {
        if let ArmPlant::Mobile(p) = &self.state.plant {
            self.kinematics = p.kinematics();
            self.state.arm.model.world_from_base = p.arm().world_from_base;
            return;
        }
        self.kinematics = self.state.arm.model.kinematics(&self.joints().q);
    }

    pub(super) fn joints(&self) -> MeasuredState {
        match (&self.state.plant, &self.state.held) {
            (ArmPlant::Rapier(p), _) => *p.state(0),
            (ArmPlant::Articulated(p), _) => *p.state(0),
            (ArmPlant::Grasp, Some(held)) => *held.world().state(),
            (ArmPlant::Mobile(p), _) => *p.state(),
            (ArmPlant::Grasp, None) => MeasuredState { q: self.state.arm.desired().q, qd: JointVector::zeros() },
        }
    }

    fn tip(&self, measured: &MeasuredState) -> TipState {
        match (&self.state.plant, &self.state.held) {
            (ArmPlant::Grasp, Some(held)) => held.tip(),
            _ => {
                let k = &self.kinematics;
                let (pose, mut velocity) = (*k.world_from_tip(), k.tip_velocity(&measured.qd));
                if let ArmPlant::Mobile(p) = &self.state.plant {
                    velocity += p.carried_velocity(&pose.translation.vector);
                }
                TipState { pose, velocity, mass: f64::INFINITY }
            }
        }
    }

    /// The plant of the present model, its joints as they are.
    pub(super) fn plant_of(&self, model: &ArmModel, joints: &MeasuredState) -> Result<ArmPlant, TwinError> {
        plant(model, joints, &self.options)
    }
}

/// Standing still in a posture (rad) for a time, s, with the pen of a layer.
pub(super) fn standing(posture: JointVector, layer: usize, time: f64) -> Move {
    let (kind, trajectory, depth) = (SegmentKind::Wait, Trajectory::rest(posture, time), DepthProfile::default());
    let segment = Segment { kind, layer, stroke: None, start: 0.0, trajectory, depth };
    Move { segment, begins: true, ends: true, planned: None, visit: None }
}

/// A correction of the reference within a motion.
pub struct Adjust<'a> {
    /// Steps between two corrections.
    pub period: u64,
    /// The reference that is to hold, from the present one and the felt force, N.
    pub correct: &'a mut dyn FnMut(Reference, f64) -> Reference,
}

/// Why a motion ended before its time.
#[derive(Clone, Copy, Debug, Default)]
struct Stop {
    stopped: bool,
    lost: bool,
    overloaded: bool,
}

fn plant(model: &ArmModel, joints: &MeasuredState, options: &TwinOptions) -> Result<ArmPlant, TwinError> {
    Ok(match options.plant {
        PlantKind::Rapier => {
            let plant = RapierPlant::moving(std::slice::from_ref(model), std::slice::from_ref(joints), options.dt);
            ArmPlant::Rapier(Box::new(plant.ok_or(TwinError::Refused)?))
        }
        PlantKind::Articulated => ArmPlant::Articulated(ArticulatedPlant::moving(
            vec![model.clone()],
            std::slice::from_ref(joints),
            options.dt,
        )),
    })
}
