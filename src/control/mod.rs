//! Desired motion and measured state to joint torques: the Cartesian impedance law.

mod damping;
mod impedance;
mod options;

pub use damping::design_damping;
pub use impedance::{ImpedanceController, MeasuredState, Press, Reference, TorqueCommand};
pub use options::ImpedanceOptions;
