//! Grasping: a three-finger hand on an arm takes a pen tool out of its dock and puts it back, by contact and friction alone.

mod change_record;
mod grip_limit;
mod hand;
mod held;
mod noise;
mod trial;
mod world;

pub use change_record::{ChangeMotion, ChangeRecord, Handover, Snapshot};
pub use grip_limit::GripLimit;
pub use hand::Hand;
pub use held::{DockState, Held};
pub use trial::{FailureClass, GOOD_SEAT, LEFT, Picked, StagePose, TrialOutcome, TrialSetup, tool_change_trial};
pub use world::{DT, GraspError, GraspWorld};

pub use crate::truth::{DockError, ErrorRanges, SensorNoise, Variation};
