//! By how much docks, tools and hands may differ from what the robot believes, and how well it senses.
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::math::{Pose, unit};
use crate::skill::{Carrier, HandModel};
use crate::tool::ToolSet;

/// How the dock stands off from where the robot believes it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DockError {
    /// m, dock frame, at the height of the gripper's middle.
    pub xyz: [f64; 3],
    /// Roll, pitch and yaw about the pen's axis there, rad.
    pub rpy: [f64; 3],
}

/// Half widths of the uniform distributions that dock errors are drawn from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorRanges {
    /// Along x and y each, m.
    pub xy: f64,
    /// Along z, m.
    pub z: f64,
    /// Of roll and pitch each, rad.
    pub tilt: f64,
    /// Of yaw, rad.
    pub yaw: f64,
}

impl ErrorRanges {
    /// +-3 mm across, +-1 mm in height, +-3 degrees of tilt, +-5 degrees of yaw.
    pub fn usual() -> Self {
        Self { xy: 3e-3, z: 1e-3, tilt: 3.0_f64.to_radians(), yaw: 5.0_f64.to_radians() }
    }

    /// No error at all.
    pub fn none() -> Self {
        Self { xy: 0.0, z: 0.0, tilt: 0.0, yaw: 0.0 }
    }

    /// All ranges `factor` times as wide.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { xy: self.xy * factor, z: self.z * factor, tilt: self.tilt * factor, yaw: self.yaw * factor }
    }

    /// An error from within these ranges.
    pub fn draw(&self, rng: &mut ChaCha8Rng) -> DockError {
        let mut within = |half: f64| half * (2.0 * unit(rng) - 1.0);
        DockError {
            xyz: [within(self.xy), within(self.xy), within(self.z)],
            rpy: [within(self.tilt), within(self.tilt), within(self.yaw)],
        }
    }
}

/// What is true of hand and tool but not known to the robot. The default changes nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation {
    /// Friction between tool and fingers, in units of the believed one.
    pub friction_fingers: f64,
    /// Friction between tool and dock, in units of the believed one.
    pub friction_dock: f64,
    /// Mass of the tool, in units of the believed one.
    pub mass: f64,
    /// Strength of all fingers, in units of the believed one.
    pub strength: f64,
    /// True pose of the grip frame in the believed one: how badly the hand is calibrated on its flange.
    pub hand_error: Pose,
    /// How well the robot senses.
    pub noise: SensorNoise,
}

/// Standard deviations of white noise on what is sensed in every step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SensorNoise {
    /// Of each component of the wrist's force, N.
    pub force: f64,
    /// Of each component of the wrist's torque, N m.
    pub torque: f64,
    /// Of each finger joint, rad.
    pub fingers: f64,
}

impl Default for Variation {
    fn default() -> Self {
        Self {
            friction_fingers: 1.0,
            friction_dock: 1.0,
            mass: 1.0,
            strength: 1.0,
            hand_error: Pose::identity(),
            noise: SensorNoise::default(),
        }
    }
}

impl Variation {
    /// The true tool and dock.
    pub(crate) fn set(&self, believed: &ToolSet) -> ToolSet {
        let mut set = believed.clone();
        set.tool.friction_fingers *= self.friction_fingers;
        set.tool.friction_dock *= self.friction_dock;
        set.tool.mass *= self.mass;
        set
    }

    /// The true hand.
    pub(crate) fn hand(&self, believed: &HandModel) -> HandModel {
        let mut hand = believed.clone();
        for finger in &mut hand.fingers {
            finger.strength *= self.strength;
        }
        hand
    }

    /// The carrier with the hand where it truly is.
    pub(crate) fn carrier(&self, believed: &Carrier) -> Carrier {
        let mut carrier = believed.clone();
        carrier.plant.last_from_tip *= self.hand_error;
        carrier
    }
}
