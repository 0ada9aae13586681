//! Distances, times and limits of a tool change.
use nalgebra::Translation3;

use super::PALM_FACE;
use crate::math::Pose;

/// Distances, times and limits of a tool change.
#[derive(Clone, Debug, PartialEq)]
pub struct ChangeOptions {
    /// How far before the tool the approach starts, m.
    pub approach: f64,
    /// Between palm and tool at the end of the approach, m: more than the error that must be swallowed.
    pub standoff: f64,
    /// How far below the plates the fingers reach round the tool, m: more than the tilt that must be swallowed.
    pub below: f64,
    /// Between each flat side and its pads in the half-grasp, m: the tool must be able to sink onto the fingers.
    pub slack: f64,
    /// The same while the tool is lifted, m: less than the plates reach over the fingers.
    pub looseness: f64,
    /// How far above its dock the tool is grasped fully, m.
    pub clearance: f64,
    /// How far above its seat the tool is let go of, m.
    pub drop: f64,
    /// Grip force of half and full grasp, N.
    pub grip: [f64; 2],
    /// How far beyond contact first and second joints are driven in the full grasp, rad.
    pub squeeze: [f64; 2],
    /// Speed of the fingertips, m/s.
    pub finger_speed: f64,
    /// Mean speed of the hand, m/s.
    pub speed: f64,
    /// Rest before each check, s.
    pub settle: f64,
    /// Largest force (N) and torque (N m) at the wrist, beyond those at the start.
    pub limits: [f64; 2],
    /// How often the whole is tried.
    pub attempts: u32,
}

impl Default for ChangeOptions {
    fn default() -> Self {
        Self {
            approach: 0.13,
            standoff: 0.008,
            below: 0.007,
            slack: 0.0004,
            looseness: 0.003,
            clearance: 0.006,
            drop: 0.003,
            grip: [20.0, 35.0],
            squeeze: [0.25, 0.3],
            finger_speed: 0.11,
            speed: 0.15,
            settle: 0.1,
            limits: [50.0, 8.0],
            attempts: 3,
        }
    }
}

impl ChangeOptions {
    /// Where the grip frame stands before the approach to a dock, world.
    pub fn ready(&self, world_from_dock: &Pose) -> Pose {
        grip_at(world_from_dock, self.approach, -self.below)
    }
}

/// The grip frame's pose when the palm is `back` m behind the tool seated at `world_from_dock` and `up` m above where it is designed to
/// grip.
pub(super) fn grip_at(world_from_dock: &Pose, back: f64, up: f64) -> Pose {
    world_from_dock * Pose::from_parts(Translation3::new(-PALM_FACE - back, 0.0, up), Default::default())
}
