//! Robots: URDF to model; kinematics, dynamics and collision capsules.

mod dynamics;
mod kinematics;
mod model;

pub use dynamics::{GRAVITY, JointMatrix};
pub use kinematics::{Jacobian, Kinematics};
pub use model::{
    ArmModel, Capsule, JointKind, JointModel, JointVector, LinkModel, MAX_DOF, SpatialInertia, Visual, VisualShape,
};
