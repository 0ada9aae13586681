//! `[tools]`: pens that grippers fetch from docks.
use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a pen is held while it draws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Hold {
    /// As one body with the hand, at the pose that the grasp left it in: fast, and right as long as pen forces stay below
    /// what the grip bears.
    #[default]
    Rigid,
    /// By contact and friction all the time; about ten times slower.
    Physics,
}

/// `[tools]`: how arms with grippers fetch their pens. Errors are drawn from uniform distributions, by dock and seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ToolSettings {
    /// Which arm draws with an ink: `{ Black = "left" }`, by the ink's name. Inks that aren't named go to the arms in
    /// turn.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub arms: BTreeMap<String, String>,
    /// Distance that arms must keep from each other: a plan that doesn't is refused.
    #[schemars(range(min = 0, max = 500))]
    pub margin_mm: f64,
    /// How a pen is held while it draws. A pen that is pressed with more than 7 N (less with slippery or weak
    /// fingers) is held by friction anyway.
    pub hold: Hold,
    /// How often a pick is tried.
    #[schemars(range(min = 1, max = 10))]
    pub attempts: u32,
    /// Largest error of a dock's place across, along each axis; drawn by dock and `seed`, as the next three are.
    #[schemars(range(min = 0, max = 100))]
    pub dock_xy_mm: f64,
    /// Largest error of a dock's height.
    #[schemars(range(min = 0, max = 100))]
    pub dock_z_mm: f64,
    /// Largest roll and pitch of a dock.
    #[schemars(range(min = 0, max = 45))]
    pub dock_tilt_deg: f64,
    /// Largest yaw of a dock.
    #[schemars(range(min = 0, max = 45))]
    pub dock_yaw_deg: f64,
    /// All errors of docks times this.
    #[schemars(range(min = 0, max = 100))]
    pub error_scale: f64,
    /// Largest error of the hand's place on the flange, along each axis; no one knows of it.
    #[schemars(range(min = 0, max = 50))]
    pub hand_mm: f64,
    /// Largest error of the hand's angle on the flange, about each axis.
    #[schemars(range(min = 0, max = 20))]
    pub hand_deg: f64,
    /// Friction between fingers and tool by the design's, drawn from 1 -+ this.
    #[schemars(range(min = 0, max = 1))]
    pub friction_spread: f64,
    /// Mass of the tool by the design's, drawn from 1 -+ this.
    #[schemars(range(min = 0, max = 0.9))]
    pub mass_spread: f64,
    /// Strength of the fingers by the design's, drawn from 1 -+ this.
    #[schemars(range(min = 0, max = 0.9))]
    pub strength_spread: f64,
    /// Standard deviation of each component of the wrist's force.
    #[schemars(range(min = 0, max = 50))]
    pub force_noise_n: f64,
    /// Standard deviation of each finger angle that is read.
    #[schemars(range(min = 0, max = 20))]
    pub finger_noise_deg: f64,
    /// Pose repeatability of the arms (ISO 9283): each approach to a dock is off by a displacement of its own.
    #[schemars(range(min = 0, max = 5))]
    pub repeatability_mm: f64,
    /// A fault on purpose: so long after a pen was fetched the fingers open by mistake. Pens are then held by
    /// friction all the time.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1e6))]
    pub open_after_s: Option<f64>,
    /// Whether the tool has plates over the fingers.
    pub plates: bool,
    /// Whether the tool has bevels in front.
    pub bevels: bool,
    /// Friction between fingers and tool in place of the design's.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 2))]
    pub finger_friction: Option<f64>,
    /// Friction between tool and dock in place of the design's.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 2))]
    pub dock_friction: Option<f64>,
    /// Gap between plates and fingers in place of the design's.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 20))]
    pub plate_gap_mm: Option<f64>,
    /// Angle of the bevels in place of the design's.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 20, max = 70))]
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
