//! What an arm does next, as a value: it can be compared, written down, and carried out by whoever has the arm.
use serde::{Deserialize, Serialize};

use super::{Felt, Picture};
use crate::control::DrivePath;
use crate::math::Pose;
use crate::plan::{DepthProfile, MotionSample, Segment, SegmentKind, Trajectory};
use crate::robot::{BasePose, JointVector};

/// Largest distance between where a motion begins and where the arm was last commanded to be, rad.
pub const SAME_POSTURE: f64 = 1e-6;

/// A task of one arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Task {
    /// Moves through the air, pen off the canvas.
    Travel(Move),
    /// Moves onto the canvas, or along it to where a stroke begins.
    Press(Move),
    /// Moves until the pen feels a force, N.
    Probe(Move, f64),
    /// Draws along a stroke.
    Draw(Move),
    /// Moves straight off the canvas.
    Lift(Move),
    /// Stands while a person changes the pen.
    ChangePen(Move),
    /// Takes the pen of a layer out of its dock.
    Fetch(PenPlace),
    /// Puts the pen of a layer back into its dock.
    Return(PenPlace),
    /// Stands still for a time, s.
    Wait(f64),
    /// Drives the base along a path, the arm held in its posture.
    Drive(DrivePath),
    /// Takes the base to stand at a pose, world, tilt included: the law goes on from there. Nothing moves.
    BelieveBase(Pose),
    /// Stands for a time, s, until the arm is calm, and takes a picture with the hand's camera.
    Look(f64),
}

/// A piece of motion on a timeline: moves that follow one another without rest share one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Move {
    /// The motion; its start is counted from where the timeline begins.
    pub segment: Segment,
    /// Whether the timeline begins with it.
    pub begins: bool,
    /// Whether the timeline ends with it: the arm then settles for one step.
    pub ends: bool,
    /// Its index in a plan made ahead; `None` of a motion planned on the way.
    pub planned: Option<usize>,
    /// Which of the arm's visits to the canvas it is part of, where arms share the canvas.
    pub visit: Option<usize>,
}

/// The pen of a layer and where it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PenPlace {
    /// Index of the ink's layer.
    pub layer: usize,
    /// Index of the arm's dock.
    pub dock: usize,
}

/// What must hold before a task may begin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precondition {
    /// What the hand must hold: `Some(None)` nothing, `Some(Some(layer))` the pen of a layer; `None` if it doesn't matter.
    pub holds: Option<Option<usize>>,
    /// Where the arm must last have been commanded to be, rad.
    pub at: Option<JointVector>,
}

/// What a task may change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effects {
    /// Where the arm stands.
    pub arm: bool,
    /// Ink on the canvas, and in the pen.
    pub ink: bool,
    /// What the hand holds, and what stands in a dock.
    pub hand: bool,
}

/// How a task failed, as the robot knows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[non_exhaustive]
pub enum TaskFailure {
    /// The guard of a probe never felt the canvas.
    #[error("met nothing")]
    MetNothing,
    /// The fingers tell that the pen has gone.
    #[error("lost its pen while it drew with it")]
    PenLost,
    /// The base's wheels never told that it had come to a stop of its path.
    #[error("the base didn't come to where it was to drive")]
    NotArrived,
    /// There is no plan for what comes next, after part of the drawing was drawn.
    #[error("can't go on: {why}")]
    NoPlan {
        /// What is in the way.
        why: String,
    },
    /// A tool change was given up.
    #[error("gave up {doing}{}", last.as_ref().map_or_else(String::new, |w| format!(": {w}")))]
    ChangeGivenUp {
        /// What was being done.
        doing: String,
        /// What the robot said last.
        last: Option<String>,
    },
}

/// Where a base stands, as the robot knows it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaseBelief {
    /// By the turns of its wheels since it was last told better.
    pub by_wheels: BasePose,
    /// What a sensor measures, world, tilt included; `None` without one.
    pub measured: Option<Pose>,
}

/// How a task ended, by what the robot's own sensors tell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// When, s.
    pub time: f64,
    /// How long it took, s.
    pub duration: f64,
    /// The motion that was desired last: the next one goes on from here.
    pub reference: MotionSample,
    /// Touches, in time order; empty unless the arm feels.
    pub felt: Vec<Felt>,
    /// Where the base stands, after a drive.
    pub base: Option<BaseBelief>,
    /// What the hand's camera saw, after a look.
    pub picture: Option<Picture>,
    /// Why it failed, if it did.
    pub failure: Option<TaskFailure>,
}

impl Task {
    /// A motion as the task of its segment's kind.
    pub fn of(movement: Move) -> Self {
        match movement.segment.kind {
            SegmentKind::Press => Self::Press(movement),
            SegmentKind::Draw => Self::Draw(movement),
            SegmentKind::Lift => Self::Lift(movement),
            SegmentKind::ChangePen => Self::ChangePen(movement),
            _ => Self::Travel(movement),
        }
    }

    /// One motion on a timeline of its own.
    pub fn alone(kind: SegmentKind, layer: usize, stroke: Option<usize>, trajectory: Trajectory) -> Self {
        let segment = Segment { kind, layer, stroke, start: 0.0, trajectory, depth: DepthProfile::default() };
        Self::of(Move { segment, begins: true, ends: true, planned: None, visit: None })
    }

    /// The motion, of a task that is one.
    pub fn movement(&self) -> Option<&Move> {
        match self {
            Self::Travel(m)
            | Self::Press(m)
            | Self::Probe(m, _)
            | Self::Draw(m)
            | Self::Lift(m)
            | Self::ChangePen(m) => Some(m),
            Self::Fetch(_)
            | Self::Return(_)
            | Self::Wait(_)
            | Self::Drive(_)
            | Self::BelieveBase(_)
            | Self::Look(_) => None,
        }
    }

    /// The force, N, that ends it, of a probe.
    pub fn guard(&self) -> Option<f64> {
        match self {
            Self::Probe(_, force) => Some(*force),
            _ => None,
        }
    }

    /// The visit to the canvas that it is part of.
    pub fn visit(&self) -> Option<usize> {
        self.movement().and_then(|m| m.visit)
    }

    /// The same as part of a visit to the canvas.
    pub fn in_visit(mut self, visit: Option<usize>) -> Self {
        match &mut self {
            Self::Travel(m)
            | Self::Press(m)
            | Self::Probe(m, _)
            | Self::Draw(m)
            | Self::Lift(m)
            | Self::ChangePen(m) => m.visit = visit,
            Self::Fetch(_)
            | Self::Return(_)
            | Self::Wait(_)
            | Self::Drive(_)
            | Self::BelieveBase(_)
            | Self::Look(_) => {}
        }
        self
    }

    /// What must hold before it may begin.
    pub fn precondition(&self) -> Precondition {
        let at = self.movement().and_then(|m| m.segment.trajectory.knots().first()).map(|k| k.q);
        let holds = match self {
            Self::Draw(m) | Self::Press(m) | Self::Probe(m, _) | Self::Lift(m) => Some(Some(m.segment.layer)),
            Self::Return(place) => Some(Some(place.layer)),
            Self::Fetch(_) => Some(None),
            Self::Travel(_)
            | Self::ChangePen(_)
            | Self::Wait(_)
            | Self::Drive(_)
            | Self::BelieveBase(_)
            | Self::Look(_) => None,
        };
        Precondition { holds, at }
    }

    /// What it may change.
    pub fn effects(&self) -> Effects {
        match self {
            Self::Travel(_) | Self::Drive(_) => Effects { arm: true, ..Effects::default() },
            Self::Press(_) | Self::Probe(..) | Self::Draw(_) | Self::Lift(_) => {
                Effects { arm: true, ink: true, hand: false }
            }
            Self::ChangePen(_) => Effects { arm: true, ink: false, hand: true },
            Self::Fetch(_) | Self::Return(_) => Effects { arm: true, ink: false, hand: true },
            Self::Wait(_) | Self::BelieveBase(_) | Self::Look(_) => Effects::default(),
        }
    }

    /// Whether the pen is off the canvas when it is done, so that the arm may stop here.
    pub fn ends_off_the_canvas(&self) -> bool {
        !matches!(self, Self::Press(_) | Self::Probe(..) | Self::Draw(_))
    }
}
