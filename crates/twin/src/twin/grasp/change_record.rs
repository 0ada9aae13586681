//! What happened in a tool change: joints over time, and how hand and tool stood at the end of each stage.
use serde::{Deserialize, Serialize};

use super::trial::{StagePose, drive};
use super::{DT, GraspError, GraspWorld, TrialSetup};
use crate::control::MeasuredState;
use crate::math::Pose;
use crate::robot::JointVector;
use crate::skill::{Order, PenPlace, Stage, ToolChange};

/// Steps between recorded instants.
const STRIDE: u64 = 10;

/// How hand and tool stood at an instant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    pub(super) fn of(stage: Option<Stage>, failed: bool, time: f64, setup: &TrialSetup, world: &GraspWorld) -> Self {
        Self {
            stage,
            failed,
            time,
            q: world.state().q,
            fingers: world.fingers(),
            world_from_tool: world.world_from_tool(),
            in_hand: StagePose::of(&setup.set, stage.unwrap_or(Stage::Approach), world),
        }
    }

    /// Whether it is of a pen that was lost between its changes.
    pub fn is_lost(&self) -> bool {
        self.stage.is_none() && self.failed
    }
}

/// The arm at an instant of a tool change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChangeMotion {
    /// True joints, rad.
    pub q: JointVector,
    /// True joint speeds, rad/s.
    pub qd: JointVector,
    /// Joint torques that acted, N m.
    pub torque: JointVector,
}

/// How far the joints jump where one plant takes over from another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Handover {
    /// Largest jump of a joint, rad.
    pub jump: f64,
    /// Largest jump of a joint's speed, rad/s.
    pub speed_jump: f64,
}

impl Handover {
    /// From one state to the one that is gone on with.
    pub fn between(before: &MeasuredState, after: &MeasuredState) -> Self {
        Self { jump: (before.q - after.q).amax(), speed_jump: (before.qd - after.qd).amax() }
    }

    /// The worse of two.
    pub fn worst(&self, other: &Self) -> Self {
        Self { jump: self.jump.max(other.jump), speed_jump: self.speed_jump.max(other.speed_jump) }
    }
}

/// How a tool change went.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChangeRecord {
    /// What was wanted.
    pub order: Order,
    /// The pen and its dock.
    pub place: PenPlace,
    /// How often the dock's pen had been come for before.
    pub count: u64,
    /// When it began, s from the start of the run.
    pub start: f64,
    /// Whether the robot thinks that it went well.
    pub succeeded: bool,
    /// Attempts.
    pub attempts: u32,
    /// What the robot said when it gave a stage up, in order.
    pub reports: Vec<String>,
    /// Steps simulated.
    pub steps: u64,
    /// Time in which all came to rest before the robot began, s; part of the steps.
    pub settling: f64,
    /// The arm every 10 ms.
    pub motion: Vec<ChangeMotion>,
    /// Before the first stage, and at the end of each, passed or failed.
    pub snapshots: Vec<Snapshot>,
    /// How far the arm jumped where plants took over from each other.
    pub handover: Handover,
    /// Where the pen's tip is in the hand, seen from where a perfect grasp holds it; of a fetch that succeeded.
    pub tip_error: Option<Pose>,
    /// How far the tool is from where it stood in its dock, m; of a return that succeeded.
    pub seat_gap: Option<f64>,
}

impl ChangeRecord {
    /// Seconds between entries of [`motion`](Self::motion).
    pub const PERIOD: f64 = STRIDE as f64 * DT;

    /// How long it took, s.
    pub fn duration(&self) -> f64 {
        self.steps as f64 * DT
    }
}

/// Records a tool change while it is carried out.
pub(super) struct Recorder<'a> {
    setup: &'a TrialSetup,
    began: u64,
    settling: u64,
    motion: Vec<ChangeMotion>,
    snapshots: Vec<Snapshot>,
}

impl<'a> Recorder<'a> {
    /// Begins to record.
    pub(super) fn new(setup: &'a TrialSetup, world: &GraspWorld) -> Self {
        let first = Snapshot::of(None, false, 0.0, setup, world);
        Self { setup, began: world.steps(), settling: 0, motion: Vec::new(), snapshots: vec![first] }
    }

    fn sample(&mut self, world: &GraspWorld) {
        if (world.steps() - self.began).is_multiple_of(STRIDE) {
            let MeasuredState { q, qd } = *world.state();
            self.motion.push(ChangeMotion { q, qd, torque: world.torque() });
        }
    }

    /// A step in which all comes to rest is about to be made.
    pub(super) fn settle(&mut self, world: &GraspWorld) {
        self.sample(world);
        self.settling += 1;
    }

    /// Carries a change out to its end.
    pub(super) fn carry_out(
        mut self,
        order: Order,
        mut change: ToolChange,
        world: &mut GraspWorld,
    ) -> Result<ChangeRecord, GraspError> {
        let began = self.began;
        drive(world, &mut change, |ended, world| {
            self.sample(world);
            if let Some((stage, failed)) = ended {
                let time = (world.steps() - began) as f64 * DT;
                self.snapshots.push(Snapshot::of(Some(stage), failed, time, self.setup, world));
            }
        })?;
        Ok(ChangeRecord {
            order,
            place: PenPlace { layer: 0, dock: 0 },
            count: 0,
            start: 0.0,
            succeeded: change.succeeded(),
            attempts: change.attempts(),
            reports: change.failures().iter().map(ToString::to_string).collect(),
            steps: world.steps() - began,
            settling: self.settling as f64 * DT,
            motion: self.motion,
            snapshots: self.snapshots,
            handover: Handover::default(),
            tip_error: None,
            seat_gap: None,
        })
    }
}
