//! Robots: URDF to model; kinematics, dynamics and collision capsules.

mod base;
mod cell;
mod clearance;
mod dynamics;
mod enclose;
mod error;
mod floating;
mod gripper;
mod inertia;
mod kinematics;
mod mecanum;
mod model;
mod mount;
mod solids;
pub mod urdf;

pub use base::{BaseLimits, BaseModel, BasePose, Rocker, Tyre, WHEELS, WheelModel, WheelMotor, WheelSprings};
pub use cell::{Arm, Cell};
pub use clearance::{LinkPairs, SelfClearance, segment_distance};
pub use dynamics::{GRAVITY, JointMatrix};
pub use error::RobotError;
pub use floating::{Coupling, FloatingDynamics, WholeMomentum, wrench};
pub use gripper::Gripper;
pub use kinematics::{Jacobian, Kinematics};
pub use mecanum::{Mecanum, Odometry, Twist, WheelSpeeds, along_arc};
pub use model::{
    ArmModel, Capsule, JointKind, JointModel, JointVector, LinkModel, MAX_DOF, SpatialInertia, Visual, VisualShape,
};
pub use mount::{Foot, MountModel};
pub use urdf::{UrdfArm, UrdfOptions};
