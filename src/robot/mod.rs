//! Robots: URDF to model; kinematics, dynamics and collision capsules.

mod model;

pub use model::{
    ArmModel, Capsule, JointKind, JointModel, JointVector, LinkModel, MAX_DOF, SpatialInertia, Visual, VisualShape,
};
