//! `[drive]`: how a base drives.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::control::DriveOptions;

use super::check::Check;
use super::resolve::ScenarioError;

/// `[drive]`: how a base drives from place to place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DriveSettings {
    /// Largest speed, mm/s; no more than the robot's.
    pub speed_mm_s: f64,
    /// Largest yaw rate, degrees/s.
    pub yaw_deg_s: f64,
    /// Largest acceleration, mm/s2.
    pub acceleration_mm_s2: f64,
    /// Length of the last stretch before a stop, which is driven slowly, mm.
    pub approach_mm: f64,
    /// Speed there, mm/s.
    pub approach_speed_mm_s: f64,
    /// A base that finds itself farther than this from its place drives again, mm; three times at most.
    pub arrival_mm: f64,
    /// Share of the sag of its springs that the robot foretells and corrects for; 0 to leave it as it is.
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

/// Every number in its range.
pub(super) fn check_drive(d: &DriveSettings, check: &Check) -> Result<(), ScenarioError> {
    check.above_zero("drive.speed_mm_s", d.speed_mm_s, 5000.0)?;
    check.above_zero("drive.yaw_deg_s", d.yaw_deg_s, 360.0)?;
    check.above_zero("drive.acceleration_mm_s2", d.acceleration_mm_s2, 1e4)?;
    check.within("drive.approach_mm", d.approach_mm, 0.0, 1e4)?;
    check.above_zero("drive.approach_speed_mm_s", d.approach_speed_mm_s, 5000.0)?;
    check.above_zero("drive.arrival_mm", d.arrival_mm, 1000.0)?;
    check.within("drive.sag_known", d.sag_known, 0.0, 2.0)
}
