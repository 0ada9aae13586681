//! What a robot does with its hand, from what it senses alone: it changes tools and probes a canvas.

mod carrier;
mod change_options;
mod compliance;
mod felt;
mod hand_command;
mod hand_model;
mod held;
mod probing;
mod senses;
mod stage;
mod tool_change;
#[cfg(test)]
mod urdf_tests;

pub use carrier::{Carrier, toward};
pub use change_options::ChangeOptions;
pub use felt::Felt;
pub use hand_command::{GraspMode, HandCommand, OPEN};
pub use hand_model::{BoxShape, FINGER_NAMES, FingerModel, HandModel, PALM_FACE, Phalanx};
pub use held::{grip_from_held, holding, last_from_grip, tool_from_pen, tool_visuals, with_hand};
pub use probing::{pieces, probe_places};
pub use senses::{HandState, Senses};
pub use stage::{ChangeError, Order, Stage};
pub use tool_change::ToolChange;
