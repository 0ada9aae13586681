//! A trial of the tool change: pick, hold, return, with a random error between the dock and what the robot believes.
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::world::Beginning;
use super::{DT, GraspError, GraspWorld};
use crate::math::{Pose, stream};
use crate::robot::{ArmModel, JointVector};
use crate::skill::{Carrier, ChangeOptions, HandCommand, HandModel, Order, Stage, ToolChange, grip_from_held};
use crate::tool::ToolSet;
use crate::truth::{DockError, ErrorRanges, TrueGripper, Variation};

/// What a trial is made with.
#[derive(Clone, Debug)]
pub struct TrialSetup {
    /// Tool and dock.
    pub set: ToolSet,
    /// The hand.
    pub hand: HandModel,
    /// What carries it.
    pub carrier: Carrier,
    /// Where the dock is believed to be (pose of the seated tool).
    pub world_from_dock: Pose,
    /// Distances, times and limits.
    pub options: ChangeOptions,
    /// What is true but not believed, beside the dock's error.
    pub variation: Variation,
    /// Seed of the sensors' noise.
    pub seed: u64,
}

impl TrialSetup {
    /// A hand on a gantry before a dock.
    pub fn gantry(set: ToolSet) -> Self {
        let hand = HandModel::robotiq_3f();
        let world_from_dock = Pose::translation(0.5, 0.0, 0.3);
        let options = ChangeOptions::default();
        let carrier = Carrier::gantry(&hand, &Pose::translation(0.3, 0.0, 0.3));
        Self { set, hand, carrier, world_from_dock, options, variation: Variation::default(), seed: 0 }
    }

    /// A hand on the flange of `arm` (its tip frame, z outwards), before a dock at `world_from_dock`, sought from the joints `home`.
    pub fn on_arm(set: ToolSet, arm: &ArmModel, home: JointVector, world_from_dock: Pose) -> Self {
        let hand = HandModel::robotiq_3f();
        let carrier = Carrier::new(arm, &hand, home);
        let options = ChangeOptions::default();
        Self { set, hand, carrier, world_from_dock, options, variation: Variation::default(), seed: 0 }
    }

    /// Where the dock truly stands.
    pub fn true_dock(&self, error: &DockError) -> Pose {
        let [roll, pitch, yaw] = error.rpy;
        let axis = Vector3::new(self.set.tool.nose.axis, 0.0, 0.0);
        let turn = Pose::from_parts(Translation3::from(axis), UnitQuaternion::from_euler_angles(roll, pitch, yaw));
        self.world_from_dock * Translation3::from(Vector3::from(error.xyz)) * turn * Translation3::from(-axis)
    }

    /// The world of a trial, hand ready before the dock, the tool at rest in it.
    ///
    /// # Errors
    /// See [`GraspWorld::new`].
    pub fn world(&self, error: &DockError) -> Result<(GraspWorld, ToolChange), GraspError> {
        let ready = self.options.ready(&self.world_from_dock);
        let v = &self.variation;
        let (carrier, hand, set) = (v.carrier(&self.carrier), v.hand(&self.hand), v.set(&self.set));
        let mut world = GraspWorld::new(&carrier, &hand, &set, &ready, &self.true_dock(error))?;
        world.set_senses(v.noise, stream(self.seed, "senses of a trial", 0));
        let change = ToolChange::new(Order::Pick, &self.hand, &self.set, &self.world_from_dock, &ready, &self.options);
        for _ in 0..SETTLE {
            world.step(&ready, &HandCommand::open())?;
        }
        Ok((world, change))
    }

    /// The tool change of an arm at one of its docks, as the robot believes it to be and as it is.
    pub(crate) fn of(gripper: &TrueGripper, dock: usize) -> Self {
        let kit = gripper.kit();
        Self {
            set: kit.set.clone(),
            hand: kit.hand.clone(),
            carrier: kit.carrier(),
            world_from_dock: kit.docks[dock],
            options: kit.change.clone(),
            variation: gripper.variation(dock),
            seed: 0,
        }
    }

    /// The world in which an arm goes on from `beginning`.
    pub(super) fn world_from(&self, beginning: &Beginning) -> Result<GraspWorld, GraspError> {
        let v = &self.variation;
        let (carrier, hand, set) = (v.carrier(&self.carrier), v.hand(&self.hand), v.set(&self.set));
        GraspWorld::begin(&carrier, &hand, &set, beginning)
    }
}

/// Steps in which the tool comes to rest in its dock.
pub(super) const SETTLE: u32 = 200;
/// Largest offset (m) and turn (rad) of a tool in the hand that is grasped well.
const GOOD_GRASP: [f64; 2] = [1e-3, 0.0175];
/// A tool farther than this from where it should be is no longer there, m.
pub const LEFT: f64 = 0.02;
/// Largest offset of a returned tool's nose from its seat that counts as seated, m.
pub const GOOD_SEAT: f64 = 1e-3;

/// The pose of the tool in the hand at the end of a stage, against the design.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StagePose {
    /// The stage.
    pub stage: Stage,
    /// x, y, z, m, grip frame: 0 where the back touches the palm and the plates lie on the fingers.
    pub xyz: [f64; 3],
    /// Roll, pitch, yaw, rad.
    pub rpy: [f64; 3],
}

impl StagePose {
    /// How the tool of `set` is in the hand now.
    pub(super) fn of(set: &ToolSet, stage: Stage, world: &GraspWorld) -> Self {
        let off = grip_from_held(set).inverse() * world.grip_from_tool();
        let (roll, pitch, yaw) = off.rotation.euler_angles();
        Self { stage, xyz: off.translation.vector.into(), rpy: [roll, pitch, yaw] }
    }

    /// Whether the tool sits well in a hand that has grasped it fully.
    pub fn is_good(&self) -> bool {
        let [far, turned] = GOOD_GRASP;
        self.xyz.iter().all(|x| x.abs() <= far) && self.rpy.iter().all(|r| r.abs() <= turned)
    }
}

/// How a trial failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FailureClass {
    /// The robot gave the pick up; the pen stands in its dock.
    PickGivenUp,
    /// The robot gave the return up; the pen stands in its dock or is still in the hand.
    ReturnGivenUp,
    /// The tool fell.
    Dropped,
    /// The robot thinks all is well, but the tool sits badly in the hand.
    BadPose,
    /// The robot thinks all is well, but the tool isn't seated in its dock.
    NotSeated,
}

/// What a trial ended with.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialOutcome {
    /// The dock's error.
    pub error: DockError,
    /// The tool in the hand at the end of each stage of the pick that was passed.
    pub stages: Vec<StagePose>,
    /// The pen tip's offset from where a perfect grasp holds it, m, grip frame; absent when it never was held.
    pub pen_tip: Option<[f64; 3]>,
    /// Attempts at the pick.
    pub attempts: u32,
    /// Why it failed; `None` of a success.
    pub failure: Option<FailureClass>,
    /// What the robot said when it gave a stage up, in order.
    pub reports: Vec<String>,
    /// The nose's distance from its seat after the return, m; absent when the pick failed.
    pub seat_gap: Option<f64>,
    /// Steps simulated.
    pub steps: u64,
}

impl TrialOutcome {
    /// Whether pick and return went well.
    pub fn success(&self) -> bool {
        self.failure.is_none()
    }
}

/// One trial: the tool is picked, held for a moment and returned, with dock errors drawn from `ranges` by `seed`. The same seed gives
/// the same outcome to the last bit.
///
/// # Errors
/// See [`GraspError`]; a grasp that fails is an outcome, not an error.
pub fn tool_change_trial(seed: u64, ranges: &ErrorRanges, setup: &TrialSetup) -> Result<TrialOutcome, GraspError> {
    setup.run(&ranges.draw(&mut stream(seed, "dock error", 0)))
}

/// A world after a pick, well or badly ended.
pub struct Picked {
    /// The world.
    pub world: GraspWorld,
    /// The order that was carried out; its last pose and hand command still stand.
    pub change: ToolChange,
    /// The tool in the hand at the end of each stage that was passed.
    pub stages: Vec<StagePose>,
    /// Where the tool stood in its dock, world.
    pub seat: Pose,
}

impl Picked {
    /// Holds hand and arm where they are for `steps` steps.
    ///
    /// # Errors
    /// A state that is no longer finite.
    pub fn hold(&mut self, steps: u32) -> Result<(), GraspError> {
        for _ in 0..steps {
            let (grip, hand) = self.change.update(&self.world.senses(), DT);
            self.world.step(&grip, &hand)?;
        }
        Ok(())
    }
}

impl TrialSetup {
    /// Picks the tool with a given error and stops there.
    ///
    /// # Errors
    /// See [`tool_change_trial`].
    pub fn pick(&self, error: &DockError) -> Result<Picked, GraspError> {
        let (mut world, mut change) = self.world(error)?;
        let seat = world.world_from_tool();
        let mut stages = Vec::new();
        drive(&mut world, &mut change, |ended, world| {
            let passed = ended.filter(|(_, failed)| !failed);
            stages.extend(passed.map(|(stage, _)| self.stage_pose(stage, world)));
        })?;
        Ok(Picked { world, change, stages, seat })
    }

    /// One trial with a given error.
    ///
    /// # Errors
    /// See [`tool_change_trial`].
    pub fn run(&self, error: &DockError) -> Result<TrialOutcome, GraspError> {
        let Picked { mut world, change: pick, stages, seat } = self.pick(error)?;
        let mut outcome = TrialOutcome {
            error: *error,
            stages,
            pen_tip: None,
            attempts: pick.attempts(),
            failure: None,
            reports: pick.failures().iter().map(ToString::to_string).collect(),
            seat_gap: None,
            steps: 0,
        };
        let nose = nalgebra::Point3::new(self.set.tool.nose.axis, 0.0, self.set.tool.nose_end());
        // neither in its dock nor in the hand
        let fallen = |world: &GraspWorld| {
            let off = (world.world_from_tool() * nose - seat * nose).norm();
            off > LEFT && Vector3::from(self.stage_pose(Stage::FullGrasp, world).xyz).norm() > LEFT
        };
        if !pick.succeeded() {
            outcome.failure = Some(if fallen(&world) { FailureClass::Dropped } else { FailureClass::PickGivenUp });
            outcome.steps = world.steps();
            return Ok(outcome);
        }
        let held = self.stage_pose(Stage::FullGrasp, &world);
        let tip = self.set.tool.pen_tip();
        let nominal = self.grip_from_held() * tip;
        outcome.pen_tip = Some((world.pen_tip() - nominal).into());
        if !held.is_good() {
            outcome.failure = Some(FailureClass::BadPose);
        }

        let grip = world.world_from_grip();
        let mut back =
            ToolChange::new(Order::Return, &self.hand, &self.set, &self.world_from_dock, &grip, &self.options);
        drive(&mut world, &mut back, |_, _| ())?;
        outcome.reports.extend(back.failures().iter().map(ToString::to_string));
        let gap = (world.world_from_tool() * nose - seat * nose).norm();
        outcome.seat_gap = Some(gap);
        if outcome.failure.is_none() {
            outcome.failure = if fallen(&world) {
                Some(FailureClass::Dropped)
            } else if !back.succeeded() {
                Some(FailureClass::ReturnGivenUp)
            } else if gap > GOOD_SEAT {
                Some(FailureClass::NotSeated)
            } else {
                None
            };
        }
        outcome.steps = world.steps();
        Ok(outcome)
    }

    /// Pose of a perfectly held tool in the grip frame: back on the palm, plates on the fingers.
    pub fn grip_from_held(&self) -> Pose {
        grip_from_held(&self.set)
    }

    pub(super) fn stage_pose(&self, stage: Stage, world: &GraspWorld) -> StagePose {
        StagePose::of(&self.set, stage, world)
    }
}

/// Runs a tool change to its end; `see` sees the world before each step, and the stage that has just ended, if one
/// has, and whether it failed.
pub(super) fn drive(
    world: &mut GraspWorld,
    change: &mut ToolChange,
    mut see: impl FnMut(Option<(Stage, bool)>, &GraspWorld),
) -> Result<(), GraspError> {
    while change.stage().is_some() {
        let (done, failed) = (change.finished().len(), change.failures().len());
        let (grip, hand) = change.update(&world.senses(), DT);
        let failure = change.failures().get(failed).map(|e| (e.stage(), true));
        see(failure.or(change.finished().get(done).map(|s| (*s, false))), world);
        world.step(&grip, &hand)?;
    }
    Ok(())
}
