//! `[tools]`: pens that grippers fetch from docks.
use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Check;
use super::resolve::ScenarioError;

/// How a pen is held while it draws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Hold {
    /// As one body with the hand, at the pose that the grasp left it in: fast, and right as long as pen forces stay below
    /// what the grip bears.
    #[default]
    Rigid,
    /// By contact and friction all the time.
    Physics,
}

/// `[tools]`: how arms with grippers fetch their pens. Errors are drawn from uniform distributions, by dock and seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ToolSettings {
    /// Which arm draws with an ink: arm by ink. Inks that aren't named go to the arms in turn.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub arms: BTreeMap<String, String>,
    /// Distance that arms keep from each other, mm.
    pub margin_mm: f64,
    /// How a pen is held while it draws.
    pub hold: Hold,
    /// How often a pick is tried.
    pub attempts: u32,
    /// Largest error of a dock's place across, along each axis, mm.
    pub dock_xy_mm: f64,
    /// Largest error of a dock's height, mm.
    pub dock_z_mm: f64,
    /// Largest roll and pitch of a dock, degrees.
    pub dock_tilt_deg: f64,
    /// Largest yaw of a dock, degrees.
    pub dock_yaw_deg: f64,
    /// All errors of docks times this.
    pub error_scale: f64,
    /// Largest error of the hand's place on the flange, along each axis, mm.
    pub hand_mm: f64,
    /// Largest error of the hand's angle on the flange, about each axis, degrees.
    pub hand_deg: f64,
    /// Friction between fingers and tool by the design's, drawn from 1 -+ this.
    pub friction_spread: f64,
    /// Mass of the tool by the design's, drawn from 1 -+ this.
    pub mass_spread: f64,
    /// Strength of the fingers by the design's, drawn from 1 -+ this.
    pub strength_spread: f64,
    /// Standard deviation of each component of the wrist's force, N.
    pub force_noise_n: f64,
    /// Standard deviation of each finger angle that is read, degrees.
    pub finger_noise_deg: f64,
    /// Pose repeatability of the arms (ISO 9283), mm: each approach to a dock is off by a displacement of its own.
    pub repeatability_mm: f64,
    /// A fault on purpose: so long after a pen was fetched the fingers open by mistake, s. Pens are then held by friction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub open_after_s: Option<f64>,
    /// Whether the tool has plates over the fingers.
    pub plates: bool,
    /// Whether the tool has bevels in front.
    pub bevels: bool,
    /// Friction between fingers and tool in place of the design's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub finger_friction: Option<f64>,
    /// Friction between tool and dock in place of the design's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dock_friction: Option<f64>,
    /// Between plates and fingers in place of the design's, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plate_gap_mm: Option<f64>,
    /// Angle of the bevels in place of the design's, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bevel_deg: Option<f64>,
}

impl Default for ToolSettings {
    fn default() -> Self {
        Self {
            arms: BTreeMap::new(),
            margin_mm: 30.0,
            hold: Hold::Rigid,
            attempts: 3,
            dock_xy_mm: 0.0,
            dock_z_mm: 0.0,
            dock_tilt_deg: 0.0,
            dock_yaw_deg: 0.0,
            error_scale: 1.0,
            hand_mm: 0.0,
            hand_deg: 0.0,
            friction_spread: 0.0,
            mass_spread: 0.0,
            strength_spread: 0.0,
            force_noise_n: 0.0,
            finger_noise_deg: 0.0,
            repeatability_mm: 0.03,
            open_after_s: None,
            plates: true,
            bevels: true,
            finger_friction: None,
            dock_friction: None,
            plate_gap_mm: None,
            bevel_deg: None,
        }
    }
}

/// Every number in its range.
pub(super) fn check_tools(tools: &ToolSettings, check: &Check) -> Result<(), ScenarioError> {
    let ranges = [
        ("tools.margin_mm", tools.margin_mm, 0.0, 500.0),
        ("tools.attempts", f64::from(tools.attempts), 1.0, 10.0),
        ("tools.dock_xy_mm", tools.dock_xy_mm, 0.0, 100.0),
        ("tools.dock_z_mm", tools.dock_z_mm, 0.0, 100.0),
        ("tools.dock_tilt_deg", tools.dock_tilt_deg, 0.0, 45.0),
        ("tools.dock_yaw_deg", tools.dock_yaw_deg, 0.0, 45.0),
        ("tools.error_scale", tools.error_scale, 0.0, 100.0),
        ("tools.hand_mm", tools.hand_mm, 0.0, 50.0),
        ("tools.hand_deg", tools.hand_deg, 0.0, 20.0),
        ("tools.friction_spread", tools.friction_spread, 0.0, 1.0),
        ("tools.mass_spread", tools.mass_spread, 0.0, 0.9),
        ("tools.strength_spread", tools.strength_spread, 0.0, 0.9),
        ("tools.force_noise_n", tools.force_noise_n, 0.0, 50.0),
        ("tools.finger_noise_deg", tools.finger_noise_deg, 0.0, 20.0),
        ("tools.repeatability_mm", tools.repeatability_mm, 0.0, 5.0),
        ("tools.open_after_s", tools.open_after_s.unwrap_or(0.0), 0.0, 1e6),
        ("tools.finger_friction", tools.finger_friction.unwrap_or(0.0), 0.0, 2.0),
        ("tools.dock_friction", tools.dock_friction.unwrap_or(0.0), 0.0, 2.0),
        ("tools.plate_gap_mm", tools.plate_gap_mm.unwrap_or(0.0), 0.0, 20.0),
        ("tools.bevel_deg", tools.bevel_deg.unwrap_or(45.0), 20.0, 70.0),
    ];
    ranges.iter().try_for_each(|(key, x, low, high)| check.within(key, *x, *low, *high))
}
