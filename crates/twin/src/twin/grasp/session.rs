//! A tool in a hand from its dock to its dock: what happened at both ends, for records, figures and pictures.
use std::cell::{Ref, RefCell};
use std::rc::Rc;

use nalgebra::{Point3, Vector3};

use super::trial::{StagePose, drive};
use super::{DT, DockError, GraspError, GraspWorld, HeldPlant, TrialSetup};
use crate::math::Pose;
use crate::mesh::TriMesh;
use crate::robot::JointVector;
use crate::skill::{Order, Stage, ToolChange};

/// Steps between recorded joint positions.
const STRIDE: u64 = 10;

/// How hand and tool stood at an instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// The stage that ended then; `None` before the first, and of a pen that was lost later.
    pub stage: Option<Stage>,
    /// Whether it failed, or the pen was lost.
    pub failed: bool,
    /// Time from the start of the change, s.
    pub time: f64,
    /// The arm's joints, rad.
    pub q: JointVector,
    /// The fingers' joints, rad.
    pub fingers: [[f64; 3]; 3],
    /// The tool, world.
    pub world_from_tool: Pose,
    /// The tool in the hand, against the design.
    pub in_hand: StagePose,
}

impl Snapshot {
    /// Whether it is of a pen that was lost between its changes.
    pub fn is_lost(&self) -> bool {
        self.stage.is_none() && self.failed
    }
}

/// How a tool change went.
#[derive(Clone, Debug, PartialEq)]
pub struct ChangeRecord {
    /// What was wished.
    pub order: Order,
    /// Whether the robot thinks that it went well.
    pub succeeded: bool,
    /// Attempts.
    pub attempts: u32,
    /// What the robot said when it gave a stage up, in order.
    pub reports: Vec<String>,
    /// Steps simulated.
    pub steps: u64,
    /// True joints of the arm every 10 ms, rad.
    pub joints: Vec<JointVector>,
    /// Before the first stage, and at the end of each, passed or failed.
    pub snapshots: Vec<Snapshot>,
}

impl ChangeRecord {
    /// Seconds between entries of [`joints`](Self::joints).
    pub const PERIOD: f64 = STRIDE as f64 * DT;

    /// How long it took, s.
    pub fn duration(&self) -> f64 {
        self.steps as f64 * DT
    }
}

/// A hand that fetches a tool from its dock and brings it back.
pub struct Session<'a> {
    setup: &'a TrialSetup,
    world: Rc<RefCell<GraspWorld>>,
    seat: Pose,
}

impl<'a> Session<'a> {
    /// Fetches the tool from a dock that stands off by `error`. The arm begins at rest, its hand ready before the dock.
    ///
    /// # Errors
    /// See [`GraspError`]; a change that fails is told by its record.
    pub fn fetch(setup: &'a TrialSetup, error: &DockError) -> Result<(Self, ChangeRecord), GraspError> {
        let (world, pick) = setup.world(error)?;
        let seat = world.world_from_tool();
        let session = Self { setup, world: Rc::new(RefCell::new(world)), seat };
        let record = session.carry_out(Order::Pick, pick)?;
        Ok((session, record))
    }

    /// Brings the tool back to its dock, from where the hand is over it.
    ///
    /// # Errors
    /// As of [`fetch`](Self::fetch).
    pub fn bring_back(&self) -> Result<ChangeRecord, GraspError> {
        let s = self.setup;
        let grip = self.world().senses().world_from_grip;
        let change = ToolChange::new(Order::Return, &s.hand, &s.set, &s.world_from_dock, &grip, &s.options);
        self.carry_out(Order::Return, change)
    }

    fn carry_out(&self, order: Order, mut change: ToolChange) -> Result<ChangeRecord, GraspError> {
        let began = self.world().steps();
        let (mut joints, mut snapshots) = (Vec::new(), vec![self.snapshot(None, false, 0.0, &self.world())]);
        drive(&mut self.world.borrow_mut(), &mut change, |ended, world| {
            let passed = world.steps() - began;
            if passed.is_multiple_of(STRIDE) {
                joints.push(world.state().q);
            }
            if let Some((stage, failed)) = ended {
                snapshots.push(self.snapshot(Some(stage), failed, passed as f64 * DT, world));
            }
        })?;
        Ok(ChangeRecord {
            order,
            succeeded: change.succeeded(),
            attempts: change.attempts(),
            reports: change.failures().iter().map(ToString::to_string).collect(),
            steps: self.world().steps() - began,
            joints,
            snapshots,
        })
    }

    fn snapshot(&self, stage: Option<Stage>, failed: bool, time: f64, world: &GraspWorld) -> Snapshot {
        Snapshot {
            stage,
            failed,
            time,
            q: world.state().q,
            fingers: world.fingers(),
            world_from_tool: world.world_from_tool(),
            in_hand: self.setup.stage_pose(stage.unwrap_or(Stage::Approach), world),
        }
    }

    /// True pose of the tool in the frame of the arm's last link.
    pub fn last_from_tool(&self) -> Pose {
        self.world().last_from_tool()
    }

    /// True joints of the arm, and those that were wished last, rad.
    pub fn joints(&self) -> [JointVector; 2] {
        let world = self.world();
        [world.state().q, world.wish()]
    }

    /// True joints of the fingers, rad.
    pub fn fingers(&self) -> [[f64; 3]; 3] {
        self.world().fingers()
    }

    /// How far the tool's nose is from where it stood in its dock, m.
    pub fn from_seat(&self) -> f64 {
        let tool = &self.setup.set.tool;
        let nose = Point3::new(tool.nose.axis, 0.0, tool.nose_end());
        (self.world().world_from_tool() * nose - self.seat * nose).norm()
    }

    /// How far the tool is from where the hand should hold it, m.
    pub fn in_hand(&self) -> f64 {
        Vector3::from(self.setup.stage_pose(Stage::FullGrasp, &self.world()).xyz).norm()
    }

    /// The world.
    pub fn world(&self) -> Ref<'_, GraspWorld> {
        self.world.borrow()
    }

    /// The world as the plant of one arm: what it draws with is held by contact and friction. With `opens_after` (s) the fingers open
    /// by mistake so long from now.
    pub fn plant(&self, opens_after: Option<f64>) -> HeldPlant {
        HeldPlant::new(Rc::clone(&self.world), opens_after)
    }

    /// How all stands `time` s after the change began, when the pen has been lost.
    pub fn lost(&self, time: f64) -> Snapshot {
        self.snapshot(None, true, time, &self.world())
    }

    /// Puts solids into the world that a pen may fall on.
    ///
    /// # Errors
    /// The engine refuses a mesh.
    pub fn put_ground(&self, solids: &[TriMesh]) -> Result<(), GraspError> {
        solids.iter().try_for_each(|mesh| self.world.borrow_mut().put_ground(mesh))
    }

    /// Lets `duration` s pass, the arm where it is and the hand doing what it last was told.
    ///
    /// # Errors
    /// As of [`fetch`](Self::fetch).
    pub fn stand(&self, duration: f64) -> Result<(), GraspError> {
        let mut world = self.world.borrow_mut();
        let grip = world.world_from_grip();
        for _ in 0..(duration / DT).round() as u64 {
            let command = world.commanded();
            world.step(&grip, &command)?;
        }
        Ok(())
    }

    /// Tells the world that the plant has been led to these wished joints, rad.
    pub fn led_to(&self, wish: JointVector) {
        self.world.borrow_mut().led_to(wish);
    }
}
