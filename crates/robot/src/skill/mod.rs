//! What a robot does with its hand, from what it senses alone: it changes tools and probes a canvas.

mod carrier;
mod change_options;
mod compliance;
mod driven;
mod felt;
mod fetched;
mod gripper_kit;
mod hand_command;
mod hand_model;
mod held;
mod looking;
mod planned;
mod policy;
mod probing;
mod senses;
mod stage;
mod task;
mod tool_change;
mod touch;
#[cfg(test)]
mod urdf_tests;

pub use carrier::{Carrier, toward};
pub use change_options::ChangeOptions;
pub use driven::{DriveJob, DrivenPlace, DrivenStrokes};
pub use felt::Felt;
pub use fetched::FetchedPens;
pub use gripper_kit::{GripperKit, GripperOptions, KitError, open_fingers};
pub use hand_command::{GraspMode, HandCommand, OPEN};
pub use hand_model::{BoxShape, FINGER_NAMES, FingerModel, HandModel, PALM_FACE, Phalanx};
pub use held::{
    grip_from_held, holding, holding_at, last_from_grip, tool_from_pen, tool_visuals, with_hand, with_hand_at,
};
pub use looking::{Aligned, CameraModel, FeelOptions, LookOptions, LookRefused, Picture};
pub use planned::PlannedStrokes;
pub use policy::{Drawer, Policy, PolicyError};
pub use probing::{pieces, probe_places};
pub use senses::{HandState, Senses};
pub use stage::{ChangeError, Order, Stage};
pub use task::{BaseBelief, Effects, Move, Outcome, PenPlace, Precondition, SAME_POSTURE, Task, TaskFailure};
pub use tool_change::ToolChange;
pub use touch::{StrokeTouches, TouchJob, TouchOptions, TouchStrokes};
