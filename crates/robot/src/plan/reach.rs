//! What an arm can't draw, and why.
use std::fmt;

use nalgebra::Point2;

use crate::plan::ik::IkFailure;
use crate::plan::surroundings::{Clearance, CollisionPair};
use crate::robot::ArmModel;

/// Why a point can't be drawn.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum Obstruction {
    /// The tip can't get there, whatever the joint limits.
    OutOfReach {
        /// How far it stays away, m.
        distance: f64,
    },
    /// A joint would have to pass its limit.
    JointLimit {
        /// Name of the joint.
        joint: String,
        /// The limit it stands at, rad (m for sliding joints).
        limit: f64,
    },
    /// The arm is too near to a singularity to follow the path.
    Singular {
        /// Smallest singular value of the task Jacobian.
        dexterity: f64,
    },
    /// A link would come too near to something.
    Collision {
        /// Name of the link.
        link: String,
        /// What it meets: `canvas`, `obstacle 2` or another link's name.
        other: String,
        /// Room that is missing, m.
        missing: f64,
    },
    /// Joints would have to jump between two neighbouring points.
    Jump {
        /// Name of the joint that would move most.
        joint: String,
        /// By how much, rad.
        step: f64,
    },
    /// No collision-free way to the point was found.
    NoApproach,
    /// The pen met nothing where the canvas was sought.
    NothingMet,
}

impl Obstruction {
    pub(crate) fn from_failure(arm: &ArmModel, failure: &IkFailure) -> Self {
        match failure.at_limit {
            Some(j) => Self::JointLimit {
                joint: arm.joints[j].name.clone(),
                limit: if failure.q[j] > 0.5 * (arm.joints[j].lower + arm.joints[j].upper) {
                    arm.joints[j].upper
                } else {
                    arm.joints[j].lower
                },
            },
            None => Self::OutOfReach { distance: failure.position_error },
        }
    }

    pub(crate) fn from_clearance(arm: &ArmModel, clearance: &Clearance) -> Self {
        let name = |i: usize| arm.links[i].name.clone();
        let (link, other) = match clearance.contact {
            Some(CollisionPair::Canvas { link }) => (name(link), "canvas".into()),
            Some(CollisionPair::Obstacle { link, obstacle }) => (name(link), format!("obstacle {obstacle}")),
            Some(CollisionPair::Links { first, second }) => (name(second), name(first)),
            None => (arm.name.clone(), "nothing".into()),
        };
        Self::Collision { link, other, missing: (-clearance.excess).max(0.0) }
    }

    /// How far an attempt got before it failed: the reason worth telling is that of the best attempt.
    pub(crate) fn rank(&self) -> u8 {
        match self {
            Self::OutOfReach { .. } => 0,
            Self::JointLimit { .. } => 1,
            Self::Jump { .. } => 2,
            Self::Singular { .. } => 3,
            Self::Collision { .. } => 4,
            Self::NoApproach => 5,
            Self::NothingMet => 6,
        }
    }
}

impl fmt::Display for Obstruction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfReach { distance } => write!(f, "out of reach by {:.1} mm", distance * 1e3),
            Self::JointLimit { joint, limit } => {
                write!(f, "joint {joint} at its limit of {:.1} deg", limit.to_degrees())
            }
            Self::Singular { dexterity } => write!(f, "singular (smallest singular value {dexterity:.3})"),
            Self::Collision { link, other, missing } => {
                write!(f, "{link} too near to {other}: {:.1} mm of room missing", missing * 1e3)
            }
            Self::Jump { joint, step } => write!(f, "joint {joint} would jump by {:.1} deg", step.to_degrees()),
            Self::NoApproach => write!(f, "no free way to it was found"),
            Self::NothingMet => write!(f, "the pen met no canvas there"),
        }
    }
}

/// A part of a stroke that can't be drawn.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Unreachable {
    /// Index of the layer.
    pub layer: usize,
    /// Name of the layer.
    pub layer_name: String,
    /// Index of the stroke within its layer of the drawing.
    pub stroke: usize,
    /// Index of the first target that is not drawn.
    pub first: usize,
    /// Index of the last target that is not drawn.
    pub last: usize,
    /// Sheet position of the first, m.
    pub sheet: Point2<f64>,
    /// Length that is not drawn, m.
    pub length: f64,
    /// Why.
    pub reason: Obstruction,
}

impl fmt::Display for Unreachable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "layer {} stroke {} points {} to {} (x {:.1} mm, y {:.1} mm): {}",
            self.layer_name,
            self.stroke,
            self.first,
            self.last,
            self.sheet.x * 1e3,
            self.sheet.y * 1e3,
            self.reason
        )
    }
}

/// How much of a drawing an arm can draw, and every part that it can't.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ReachReport {
    /// Length of all strokes, m.
    pub length: f64,
    /// Length that is drawn, m.
    pub reachable_length: f64,
    /// Strokes (in part or whole) that are not drawn, in drawing order.
    pub unreachable: Vec<Unreachable>,
}

impl ReachReport {
    /// Share of the length that is drawn, in [0, 1]; 1 of an empty drawing, and less than 1 when a dot is missing.
    pub fn fraction(&self) -> f64 {
        if self.length > 0.0 {
            self.reachable_length / self.length
        } else if self.unreachable.is_empty() {
            1.0
        } else {
            0.0
        }
    }
}

impl fmt::Display for ReachReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1} % of the drawing can't be reached", 100.0 * (1.0 - self.fraction()))?;
        for (i, u) in self.unreachable.iter().take(3).enumerate() {
            write!(f, "{} {u}", if i == 0 { ":" } else { ";" })?;
        }
        match self.unreachable.len().saturating_sub(3) {
            0 => Ok(()),
            more => write!(f, "; and {more} more"),
        }
    }
}
