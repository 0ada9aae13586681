//! `[drive]`: how a base drives.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::control::DriveOptions;

/// `[drive]`: how a base drives from place to place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DriveSettings {
    /// Largest speed; no more than the robot's.
    #[schemars(range(min = 1, max = 5000))]
    pub speed_mm_s: f64,
    /// Largest yaw rate; no more than the robot's.
    #[schemars(range(min = 0.1, max = 360))]
    pub yaw_deg_s: f64,
    /// Largest acceleration; no more than the robot's.
    #[schemars(range(min = 1, max = 1e4))]
    pub acceleration_mm_s2: f64,
    /// Length of the last stretch before a stop, which is driven slowly.
    #[schemars(range(min = 0, max = 1e4))]
    pub approach_mm: f64,
    /// Speed there.
    #[schemars(range(min = 0.1, max = 5000))]
    pub approach_speed_mm_s: f64,
    /// A base that finds itself farther than this from its place drives again; three times at most.
    #[schemars(range(min = 0.1, max = 1000))]
    pub arrival_mm: f64,
    /// Share of the sag of its springs under the moving arm that the robot foretells and corrects for; 0 leaves it as
    /// it is.
    #[schemars(range(min = 0, max = 2))]
    pub sag_known: f64,
}

impl Default for DriveSettings {
    fn default() -> Self {
        let o = DriveOptions::default();
        Self {
            speed_mm_s: 250.0,
            yaw_deg_s: 17.0,
            acceleration_mm_s2: 250.0,
            approach_mm: o.approach * 1e3,
            approach_speed_mm_s: 20.0,
            arrival_mm: 10.0,
            sag_known: 0.8,
        }
    }
}

impl DriveSettings {
    /// The same in SI units.
    pub fn options(&self) -> DriveOptions {
        DriveOptions {
            speed: self.speed_mm_s * 1e-3,
            yaw_rate: self.yaw_deg_s.to_radians(),
            acceleration: self.acceleration_mm_s2 * 1e-3,
            approach: self.approach_mm * 1e-3,
            approach_speed: self.approach_speed_mm_s * 1e-3,
            ..DriveOptions::default()
        }
    }
}
