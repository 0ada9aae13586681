//! Desired motion and measured state to joint torques: the Cartesian impedance law, and joint position control to compare it with; and what a base's wheels tell to
//! the motion that follows a path.

mod damping;
mod drive;
mod impedance;
mod law;
mod limits;
mod options;
mod position;

pub use damping::design_damping;
pub use drive::{DriveFollower, DriveOptions, DrivePath, DriveStep, RestToRest};
pub use impedance::{ImpedanceController, MeasuredState, Press, Reference, TorqueCommand};
pub use law::{Controller, LawKind, LawOptions};
pub use options::ImpedanceOptions;
pub use position::{PositionController, PositionOptions};
