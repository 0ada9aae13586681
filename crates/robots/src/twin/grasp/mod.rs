//! Grasping: a three-finger hand on an arm takes a pen tool out of its dock and puts it back, by contact and friction alone.

mod carrier;
mod change;
mod change_options;
mod compliance;
mod hand;
mod hand_model;
mod held;
mod held_plant;
mod session;
mod stage;
mod trial;
#[cfg(test)]
mod urdf_tests;
mod variation;
mod world;

pub use carrier::Carrier;
pub use change::ToolChange;
pub use change_options::ChangeOptions;
pub use hand::{GraspMode, Hand, HandCommand, HandState, OPEN};
pub use hand_model::{BoxShape, FINGER_NAMES, FingerModel, HandModel, PALM_FACE, Phalanx};
pub use held::{grip_from_held, holding, last_from_grip, tool_from_pen, tool_visuals, with_hand};
pub use held_plant::HeldPlant;
pub use session::{ChangeRecord, Session, Snapshot};
pub use stage::{ChangeError, Order, Stage};
pub use trial::{
    DockError, ErrorRanges, FailureClass, GOOD_SEAT, LEFT, Picked, StagePose, TrialOutcome, TrialSetup,
    tool_change_trial,
};
pub use variation::{SensorNoise, Variation};
pub use world::{DT, GraspError, GraspWorld, Senses};
