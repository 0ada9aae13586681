//! The simulated world: tasks and the true scene to what happened. The only room that sees rapier.

mod arm;
mod base;
mod contact;
pub mod grasp;
mod log;
mod look;
mod options;
mod plant;
mod rapier_plant;
mod record;
mod scene;
mod sense;
mod simulate;
mod simulation;
mod tool_change;

pub use arm::TwinArm;
pub use base::{
    BaseSetup, DriveState, Driven, Localiser, LocaliserKind, LocaliserOptions, MobilePlant, Undercarriage, Wheel,
    WheelCommand,
};
pub use contact::{Contact, Nib, Touching};
pub use log::{ArmEnding, ArmLog, ArmStory, Totals};
pub use options::{PlantKind, TwinOptions};
pub use plant::{ArmPlant, ArticulatedPlant, Plant, TipForce, TipState};
pub use rapier_plant::RapierPlant;
pub use record::{ArmRecord, ArmSample, BaseSample, BaseStand, Event, EventKind, Record, StrokeRecord};
pub use scene::TrueScene;
pub use sense::Feeling;
pub use simulate::simulate;
pub use simulation::{Adjust, ArmSetup, Ended, Simulation, SimulationState, TwinError};
pub use tool_change::{Holding, ToolEnding};
