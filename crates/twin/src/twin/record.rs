//! What happened: append-only series and events of a run.
use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::drawing::StrokeId;
use crate::ink::InkTrace;
use crate::math::Pose;
use crate::math::stats::Running;
use crate::plan::SegmentKind;

/// The state of an arm at one recorded instant (recorded every [`ArmRecord::sample_period`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArmSample {
    /// Time, s.
    pub time: f64,
    /// What the plan was doing.
    pub segment: SegmentKind,
    /// Joint positions, rad, one a joint.
    pub q: Vec<f64>,
    /// Joint speeds, rad/s, one a joint.
    pub qd: Vec<f64>,
    /// Joint torques that act: what was commanded a delay ago, with the torque sensors' noise, N m. Absent where no torque was simulated.
    pub torque: Option<Vec<f64>>,
    /// True pen-tip position, m, world.
    pub tip: Point3<f64>,
    /// Desired pen-tip position (the law's set point), m, world; absent where the hand changes tools.
    pub tip_desired: Option<Point3<f64>>,
    /// Force of the canvas on the pen, N, world; absent where contact with the canvas isn't simulated.
    pub force: Option<Vector3<f64>>,
    /// Normal force, N; 0 without contact, absent as the force is.
    pub normal_force: Option<f64>,
}

/// What one stroke's `Draw` segment felt, over every physics step of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrokeRecord {
    /// The stroke.
    pub stroke: StrokeId,
    /// Start and end of the segment, s.
    pub start: f64,
    /// End, s.
    pub end: f64,
    /// Steps in the segment.
    pub steps: u64,
    /// Steps with pen contact.
    pub contact_steps: u64,
    /// Times contact was lost while drawing.
    pub lost_contacts: u64,
    /// Normal force, N, over all steps of the segment.
    pub force: Running,
    /// Normal force that press depth and stiffness ask for, N, over the same steps.
    pub target: Running,
    /// Normal force less the one asked for, N.
    pub force_error: Running,
    /// Steps in which a torque or torque-rate limit cut the commanded torque.
    pub saturated_steps: u64,
    /// Distance of the tip from the set point across the pen axis, m.
    pub lateral_error: Running,
}

/// What happened at an instant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EventKind {
    /// A segment of the plan began.
    Segment {
        /// Its kind.
        kind: SegmentKind,
    },
    /// The pen touched the canvas.
    Touch,
    /// The pen left the canvas.
    Leave,
    /// A person put in the pen for this ink.
    PenChanged {
        /// Name of the ink.
        ink: String,
    },
    /// The hand has taken the pen of this ink out of its dock.
    PenFetched {
        /// Name of the ink.
        ink: String,
    },
    /// The hand has put the pen of this ink back into its dock.
    PenReturned {
        /// Name of the ink.
        ink: String,
    },
    /// The hand's camera took a picture.
    Picture,
    /// The hand has lost the pen of this ink.
    PenLost {
        /// Name of the ink.
        ink: String,
    },
}

/// An event of an arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Time, s.
    pub time: f64,
    /// Index of the arm.
    pub arm: usize,
    /// Stroke at the time.
    pub stroke: Option<StrokeId>,
    /// What happened.
    pub kind: EventKind,
}

/// All that is recorded of one arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArmRecord {
    /// Name of the arm.
    pub name: String,
    /// Names of its joints.
    pub joints: Vec<String>,
    /// Seconds between samples.
    pub sample_period: f64,
    /// Samples in time order.
    pub samples: Vec<ArmSample>,
    /// One entry a drawn stroke, in the order drawn.
    pub strokes: Vec<StrokeRecord>,
    /// Largest change of a joint position in one step, rad.
    pub max_joint_step: f64,
    /// Largest normal force in any step, drawing or not, N.
    pub max_force: f64,
    /// Steps with ink while the plan had the pen up (travel or pen change): must be 0.
    pub pen_up_contact_steps: u64,
    /// Joint positions at the end, rad.
    pub final_q: Vec<f64>,
    /// Joint speeds at the end, rad/s.
    pub final_qd: Vec<f64>,
    /// Where the base stood, of an arm on one, in time order; sampled as the arm is.
    pub base: Vec<BaseSample>,
    /// Places at which the base came to believe that it stands, in time order.
    pub stands: Vec<BaseStand>,
    /// Where the base stood at the end, world.
    pub final_base: Option<Pose>,
}

/// Where a base truly was at one recorded instant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaseSample {
    /// Time, s.
    pub time: f64,
    /// What the arm was doing.
    pub segment: SegmentKind,
    /// Whether the base was driving.
    pub driving: bool,
    /// Its frame, m, world.
    pub pose: Pose,
}

/// A place at which a base came to believe that it stands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaseStand {
    /// Time, s.
    pub time: f64,
    /// Where it was, m, world.
    pub pose: Pose,
    /// Where it believes to be.
    pub believed: Pose,
}

/// The record of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// One entry an arm.
    pub arms: Vec<ArmRecord>,
    /// Events in time order.
    pub events: Vec<Event>,
    /// What was drawn.
    pub ink: InkTrace,
    /// Physics steps.
    pub steps: u64,
    /// Simulated time, s.
    pub simulated: f64,
    /// Wall-clock time of the simulation, s. Not part of the digest.
    pub wall: f64,
    /// Digest of the final state and of the drawing.
    pub digest: String,
}
