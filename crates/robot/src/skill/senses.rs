//! What a robot senses while it changes tools.
use nalgebra::Vector3;

use crate::math::Pose;

/// Where the fingers are, rad.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct HandState {
    /// Proximal, medial and distal joint of the upper finger, the lower finger and the thumb.
    pub q: [[f64; 3]; 3],
    /// Their speeds, rad/s.
    pub qd: [[f64; 3]; 3],
    /// Scissor joints of the two fingers.
    pub scissor: [f64; 2],
}

/// What a robot can sense while it changes tools.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Senses {
    /// Pose of the grip frame by the arm's joints, world.
    pub world_from_grip: Pose,
    /// Finger joints.
    pub hand: HandState,
    /// Whether the fingers' motors have been driven as far as commanded.
    pub hand_arrived: bool,
    /// Force on the hand, N, world, without the hand's weight.
    pub force: Vector3<f64>,
    /// Torque on the hand about the origin of the grip frame, N m, world.
    pub torque: Vector3<f64>,
}
