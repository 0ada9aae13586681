//! What drives a base: the wheels' command, and what their turns tell.
use serde::{Deserialize, Serialize};

use super::WheelCommand;
use crate::robot::{Mecanum, Odometry};

/// All that changes in the driving of a base, but for the wheels.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DriveState {
    /// What the wheels are asked to do.
    pub command: WheelCommand,
    /// The wheels as the base knows them.
    pub wheels: Mecanum,
    /// Where it believes to stand by them.
    pub odometry: Odometry,
}
