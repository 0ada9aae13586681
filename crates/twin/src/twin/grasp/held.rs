//! A tool and the hand that has to do with it, from dock to dock, as a value.
use nalgebra::{Point3, Translation3, Vector3};
use serde::{Deserialize, Serialize};

use super::change_record::Recorder;
use super::trial::{SETTLE, StagePose};
use super::world::Beginning;
use super::{ChangeRecord, DT, GraspError, GraspWorld, GripLimit, Handover, Snapshot, TrialSetup};
use crate::control::MeasuredState;
use crate::math::Pose;
use crate::mesh::TriMesh;
use crate::robot::{JointVector, Kinematics};
use crate::skill::{HandCommand, Order, PenPlace, Stage, ToolChange, tool_from_pen};
use crate::truth::TrueGripper;
use crate::twin::{TipForce, TipState};

/// Fingers that have moved by more than this since the pen was fetched, rad, hold it no longer: 10 mm at the second joint. A pen that
/// draws moves them by a hundredth of it.
const MOVED: f64 = 0.2;

/// What is in a dock, and how often it was come for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DockState {
    /// Where the last return left the tool, world; `None` where it stands as it was first put.
    pub world_from_tool: Option<Pose>,
    /// How often its pen was come for.
    pub fetches: u64,
}

impl DockState {
    /// The docks of an arm before anything is fetched.
    pub(crate) fn all(gripper: &TrueGripper) -> Vec<Self> {
        vec![Self::default(); gripper.kit().docks.len()]
    }
}

/// A tool that a hand has to do with, and the world in which it was grasped.
#[derive(Clone, Serialize, Deserialize)]
pub struct Held {
    world: GraspWorld,
    place: PenPlace,
    /// Which fetch of the dock's pen this is.
    count: u64,
    /// Where the tool stood in its dock.
    seat: Pose,
    limit: GripLimit,
    /// The tool seen from the pen's tip frame.
    pen_from_tool: Pose,
    lost: bool,
    /// Finger joints when the pen began to be led, rad, as sensed.
    fingers: [[f64; 3]; 3],
    /// Steps until the fingers open by mistake.
    opens_in: Option<u64>,
    /// When the fetch began, s.
    fetched_at: f64,
}

impl Held {
    /// A hand that comes for a tool: the arm goes on from `joints`, commanded to stand at `desired`. Also how far the world of the grasp
    /// begins from there.
    pub(crate) fn begin(
        gripper: &TrueGripper,
        place: PenPlace,
        dock: &DockState,
        joints: &MeasuredState,
        desired: &JointVector,
        time: f64,
    ) -> Result<(Self, Handover), GraspError> {
        let setup = TrialSetup::of(gripper, place.dock);
        let limit = GripLimit::of(&setup.variation.set(&setup.set), setup.variation.strength);
        let true_dock = setup.true_dock(&gripper.dock_error(place.dock));
        let tool = dock.world_from_tool.unwrap_or(true_dock);
        let beginning = Beginning { joints: *joints, desired: *desired, dock: true_dock, tool };
        let mut world = setup.world_from(&beginning)?;
        let handover = Handover::between(joints, world.state());
        let (what, count) = ("fetching", dock.fetches);
        world.set_senses(setup.variation.noise, gripper.senses(what, place.dock, count));
        world.set_approach_error(gripper.approach_error(what, place.dock, count));
        let held = Self {
            seat: world.world_from_tool(),
            world,
            place,
            count,
            limit,
            pen_from_tool: tool_from_pen(&setup.set).inverse(),
            lost: false,
            fingers: [[0.0; 3]; 3],
            opens_in: None,
            fetched_at: time,
        };
        Ok((held, handover))
    }

    /// Takes the tool out of its dock, once all has come to rest.
    pub(crate) fn fetch(&mut self, gripper: &TrueGripper) -> Result<ChangeRecord, GraspError> {
        let setup = TrialSetup::of(gripper, self.place.dock);
        let ready = setup.options.ready(&setup.world_from_dock);
        let change =
            ToolChange::new(Order::Pick, &setup.hand, &setup.set, &setup.world_from_dock, &ready, &setup.options);
        let mut recorder = Recorder::new(&setup, &self.world);
        for _ in 0..SETTLE {
            recorder.settle(&self.world);
            self.world.step(&ready, &HandCommand::open())?;
        }
        self.seat = self.world.world_from_tool();
        let record = recorder.carry_out(Order::Pick, change, &mut self.world)?;
        self.fingers = self.world.sensed_fingers();
        Ok(ChangeRecord { place: self.place, count: self.count, ..record })
    }

    /// Puts the tool back into its dock, from where the hand is over it.
    pub(crate) fn bring_back(&mut self, gripper: &TrueGripper) -> Result<ChangeRecord, GraspError> {
        let setup = TrialSetup::of(gripper, self.place.dock);
        let what = "bringing back";
        self.world.set_senses(setup.variation.noise, gripper.senses(what, self.place.dock, self.count));
        self.world.set_approach_error(gripper.approach_error(what, self.place.dock, self.count));
        let grip = self.world.senses().world_from_grip;
        let change =
            ToolChange::new(Order::Return, &setup.hand, &setup.set, &setup.world_from_dock, &grip, &setup.options);
        let record = Recorder::new(&setup, &self.world).carry_out(Order::Return, change, &mut self.world)?;
        Ok(ChangeRecord { place: self.place, count: self.count, ..record })
    }

    /// The arm comes back with the tool, moved meanwhile by another plant or by this world itself: it goes on from `joints`, commanded to
    /// stand at `desired`, with the tool in the hand as it was.
    pub(crate) fn meet(&mut self, joints: &MeasuredState, desired: &JointVector, led: bool) -> Handover {
        if !led {
            self.world.carry_to(joints);
        }
        self.world.restart_at(*desired);
        Handover::between(joints, self.world.state())
    }

    /// From now on the tool is held by contact and friction alone while it draws. After `opens_after` s the fingers open by mistake.
    pub(crate) fn hold_by_friction(&mut self, opens_after: Option<f64>) {
        self.opens_in = opens_after.map(|s| (s / DT).round() as u64);
    }

    /// One step in which the arm is driven by the drawing law.
    pub(crate) fn drive(&mut self, torque: &JointVector, pen: &TipForce, k: &Kinematics) -> Result<(), GraspError> {
        self.opens_in = match self.opens_in {
            Some(0) => {
                self.world.command(&HandCommand::open());
                None
            }
            other => other.map(|steps| steps - 1),
        };
        self.world.drive(torque, pen, k)?;
        let now = self.world.sensed_fingers();
        let moved = now.iter().flatten().zip(self.fingers.iter().flatten()).map(|(a, b)| (a - b).abs());
        self.lost |= moved.fold(0.0, f64::max) > MOVED;
        Ok(())
    }

    /// Whether the tool, moved as one body with the hand, is loaded with more than its grasp withstands: by the pen's force, its own
    /// weight and its inertia. `k` are the arm's kinematics with the pen's tip as its tip, at the joints `after` a step of `dt` s.
    pub(crate) fn is_overloaded(
        &self,
        k: &Kinematics,
        force: &TipForce,
        [before, after]: [&MeasuredState; 2],
        dt: f64,
    ) -> bool {
        // all of the tool is taken to accelerate as its tip does
        let acceleration = k.tip_velocity(&(after.qd - before.qd)) / dt;
        let world_from_tool = k.world_from_tip() * self.pen_from_tool;
        let (force, moment) = self.limit.wrench(&world_from_tool, &force.force, &acceleration);
        self.limit.used(&force, &moment) > 1.0
    }

    /// The pen's tip, where the tool is.
    pub(crate) fn tip(&self) -> TipState {
        let w = &self.world;
        TipState { pose: w.world_from_pen(), velocity: w.tool_tip_velocity(), mass: w.tool_mass() }
    }

    /// Whether the fingers tell that the tool has gone.
    pub(crate) fn is_lost(&self) -> bool {
        self.lost
    }

    /// The tool falls on `ground` for `duration` s; the arm stands, and the hand does what it was last commanded.
    pub(crate) fn fall(&mut self, ground: &[TriMesh], duration: f64) -> Result<(), GraspError> {
        ground.iter().try_for_each(|mesh| self.world.put_ground(mesh))?;
        let grip = self.world.world_from_grip();
        for _ in 0..(duration / DT).round() as u64 {
            let command = self.world.commanded();
            self.world.step(&grip, &command)?;
        }
        Ok(())
    }

    /// The pen and its dock.
    pub fn place(&self) -> PenPlace {
        self.place
    }

    /// The world.
    pub(crate) fn world(&self) -> &GraspWorld {
        &self.world
    }

    /// The world, to lead it.
    pub(crate) fn world_mut(&mut self) -> &mut GraspWorld {
        &mut self.world
    }

    /// Where the pen's tip is in the hand, seen from where a perfect grasp holds it.
    pub(crate) fn tip_error(&self, grip_from_held: &Pose) -> Pose {
        let tip = Translation3::from(self.world.tool_set().tool.pen_tip().coords);
        (grip_from_held * tip).inverse() * self.world.grip_from_tool() * tip
    }

    /// How far the tool's nose is from where it stood in its dock, m.
    pub(crate) fn distance_from_seat(&self, gripper: &TrueGripper) -> f64 {
        let tool = &gripper.kit().set.tool;
        let nose = Point3::new(tool.nose.axis, 0.0, tool.nose_end());
        (self.world.world_from_tool() * nose - self.seat * nose).norm()
    }

    /// How far the tool is from where the hand should hold it, m.
    pub(crate) fn in_hand(&self, gripper: &TrueGripper) -> f64 {
        Vector3::from(StagePose::of(&gripper.kit().set, Stage::FullGrasp, &self.world).xyz).norm()
    }

    /// How all stands `time` s after the fetch began, when the pen has been lost.
    pub(crate) fn lost(&self, gripper: &TrueGripper, time: f64) -> Snapshot {
        let setup = TrialSetup::of(gripper, self.place.dock);
        Snapshot::of(None, true, time, &setup, &self.world)
    }

    /// Time since the fetch began, s.
    pub(crate) fn since_fetch(&self, now: f64) -> f64 {
        now - self.fetched_at
    }
}
