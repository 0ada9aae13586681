//! Grasping: a three-finger hand on an arm takes a pen tool out of its dock and puts it back, by contact and friction alone.

mod hand;
mod held_plant;
mod session;
mod trial;
mod variation;
mod world;

pub use hand::Hand;
pub use held_plant::HeldPlant;
pub use session::{ChangeRecord, Session, Snapshot};
pub use trial::{
    DockError, ErrorRanges, FailureClass, GOOD_SEAT, LEFT, Picked, StagePose, TrialOutcome, TrialSetup,
    tool_change_trial,
};
pub use variation::{SensorNoise, Variation};
pub use world::{DT, GraspError, GraspWorld};
