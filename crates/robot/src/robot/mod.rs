//! Robots: URDF to model; kinematics, dynamics and collision capsules.

mod cell;
mod clearance;
mod dynamics;
mod enclose;
mod error;
mod gripper;
mod inertia;
mod kinematics;
mod model;
mod solids;
pub mod urdf;

pub use cell::{Arm, Cell};
pub use clearance::{LinkPairs, SelfClearance, segment_distance};
pub use dynamics::{GRAVITY, JointMatrix};
pub use error::RobotError;
pub use gripper::Gripper;
pub use kinematics::{Jacobian, Kinematics};
pub use model::{
    ArmModel, Capsule, JointKind, JointModel, JointVector, LinkModel, MAX_DOF, SpatialInertia, Visual, VisualShape,
};
pub use urdf::{UrdfArm, UrdfOptions};
