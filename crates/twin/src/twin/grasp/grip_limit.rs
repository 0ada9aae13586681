//! What wrench on the grip a measured grasp withstands as if it were rigid.
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::tool::ToolSet;

/// What wrench on the grip a measured grasp withstands as if it were rigid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GripLimit {
    force: f64,
}

impl GripLimit {
    /// The limit of a tool with its true friction in fingers of this strength.
    pub fn of(set: &ToolSet, strength: f64) -> Self {
        Self { force: 7.0 * (set.tool.friction_fingers / 0.25 * strength).min(1.0) }
    }

    /// Share of the limit that a wrench uses.
    pub fn used(&self, force: &Vector3<f64>, _moment: &Vector3<f64>) -> f64 {
        force.norm() / self.force
    }
}

/// Placeholder.
pub fn grip_wrench() {}
