//! The simulated world: plan and true scene to record. The only room that sees rapier.

mod arm;
mod contact;
pub mod grasp;
mod joined;
mod options;
mod plant;
mod rapier_plant;
mod record;
mod sense;
mod simulation;

pub use arm::{Surroundings, TwinArm};
pub use contact::{Contact, Nib};
pub use options::{PlantKind, TwinOptions};
pub use plant::{ArticulatedPlant, Plant, TipForce, TipState};
pub use rapier_plant::RapierPlant;
pub use record::{ArmRecord, ArmSample, Event, EventKind, Record, StrokeRecord};
pub use sense::Feeling;
pub use simulation::{ArmEnd, Executed, Guard, Simulation, TwinError, simulate};
