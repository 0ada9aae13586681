//! Desired motion and measured state to joint torques: the Cartesian impedance law, and joint position control to compare it with.

mod damping;
mod impedance;
mod law;
mod limits;
mod options;
mod position;

pub use damping::design_damping;
pub use impedance::{ImpedanceController, MeasuredState, Press, Reference, TorqueCommand};
pub use law::{Controller, LawKind, LawOptions};
pub use options::ImpedanceOptions;
pub use position::{PositionController, PositionOptions};
