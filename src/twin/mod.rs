//! The simulated world: plan and true scene to record. The only room that sees rapier.

mod record;

pub use record::{ArmRecord, ArmSample, Event, EventKind, Record, StrokeRecord};
