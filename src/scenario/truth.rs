//! `[truth]`: how the canvas that is drawn on differs from the scene's.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::truth::{PlankKind, TruthOptions};

use super::check::Check;
use super::resolve::ScenarioError;

/// `[truth]`: how the true canvas differs from the one in the scene's file, which the robot believes in. Nothing differs by default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TruthSettings {
    /// Random relief: its Hausdorff distance in per cent of the canvas's longest side.
    pub relief_percent: f64,
    /// Shortest wave of the relief, mm; half the canvas's longest side when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relief_wavelength_mm: Option<f64>,
    /// Boards that the canvas is made of: `none`, `vertical`, `horizontal` or `both`.
    pub planks: PlankKind,
    /// From one board to the next, mm.
    pub plank_width_mm: f64,
    /// Largest step between two boards, mm.
    pub plank_step_mm: f64,
    /// Gap between two boards, mm.
    pub plank_gap_mm: f64,
    /// Width and depth of the eased (45 degrees) edges of a board, mm.
    pub plank_bevel_mm: f64,
    /// Number of dents.
    pub dents: u32,
    /// Their depth, mm; below 0 they are bumps.
    pub dent_depth_mm: f64,
    /// Their radius, mm.
    pub dent_radius_mm: f64,
    /// How far canvas and sheet stand from where the robot believes them, mm, world.
    pub offset_mm: [f64; 3],
    /// Standard deviation of a random part of that, mm.
    pub offset_sd_mm: [f64; 3],
    /// Roll, pitch and yaw of canvas and sheet about the canvas's middle, degrees, about the world's axes.
    pub turn_deg: [f64; 3],
    /// Standard deviation of a random part of that, degrees.
    pub turn_sd_deg: [f64; 3],
    /// How much larger the canvas is, per cent.
    pub scale_percent: f64,
    /// Standard deviation of a random part of that, per cent.
    pub scale_sd_percent: f64,
    /// How far the canvas gives way to the pen, mm a newton.
    pub compliance_mm_n: f64,
}

impl Default for TruthSettings {
    fn default() -> Self {
        let o = TruthOptions::default();
        Self {
            relief_percent: 0.0,
            relief_wavelength_mm: None,
            planks: o.planks,
            plank_width_mm: 100.0,
            plank_step_mm: 2.0,
            plank_gap_mm: 0.0,
            plank_bevel_mm: 2.0,
            dents: 0,
            dent_depth_mm: 3.0,
            dent_radius_mm: 30.0,
            offset_mm: [0.0; 3],
            offset_sd_mm: [0.0; 3],
            turn_deg: [0.0; 3],
            turn_sd_deg: [0.0; 3],
            scale_percent: 0.0,
            scale_sd_percent: 0.0,
            compliance_mm_n: 0.0,
        }
    }
}

impl TruthSettings {
    /// The settings in SI units. Compliance isn't among them: it is a matter of contact.
    pub fn options(&self) -> TruthOptions {
        let metres = |mm: f64| mm * 1e-3;
        TruthOptions {
            relief: self.relief_percent * 1e-2,
            relief_wavelength: self.relief_wavelength_mm.map(metres),
            planks: self.planks,
            plank_width: metres(self.plank_width_mm),
            plank_step: metres(self.plank_step_mm),
            plank_gap: metres(self.plank_gap_mm),
            plank_bevel: metres(self.plank_bevel_mm),
            dents: self.dents,
            dent_depth: metres(self.dent_depth_mm),
            dent_radius: metres(self.dent_radius_mm),
            offset: self.offset_mm.map(metres),
            offset_sd: self.offset_sd_mm.map(metres),
            turn: self.turn_deg.map(f64::to_radians),
            turn_sd: self.turn_sd_deg.map(f64::to_radians),
            scale: self.scale_percent * 1e-2,
            scale_sd: self.scale_sd_percent * 1e-2,
        }
    }

    /// Whether the canvas that is drawn on is the scene's.
    pub fn is_nominal(&self) -> bool {
        self.planks == PlankKind::None
            && self.relief_percent == 0.0
            && (self.dents == 0 || self.dent_depth_mm == 0.0)
            && [self.offset_mm, self.offset_sd_mm, self.turn_deg, self.turn_sd_deg].iter().flatten().all(|x| *x == 0.0)
            && self.scale_percent == 0.0
            && self.scale_sd_percent == 0.0
    }
}

/// Checks the ranges.
pub(super) fn check_truth(t: &TruthSettings, check: &Check) -> Result<(), ScenarioError> {
    check.within("truth.relief_percent", t.relief_percent, 0.0, 50.0)?;
    if let Some(wavelength) = t.relief_wavelength_mm {
        check.within("truth.relief_wavelength_mm", wavelength, 1.0, 1e5)?;
    }
    check.within("truth.plank_width_mm", t.plank_width_mm, 5.0, 1e5)?;
    check.within("truth.plank_step_mm", t.plank_step_mm, 0.0, 500.0)?;
    check.within("truth.plank_gap_mm", t.plank_gap_mm, 0.0, 0.9 * t.plank_width_mm)?;
    check.within("truth.plank_bevel_mm", t.plank_bevel_mm, 0.0, 500.0)?;
    check.within("truth.dents", f64::from(t.dents), 0.0, 10_000.0)?;
    check.within("truth.dent_depth_mm", t.dent_depth_mm, -500.0, 500.0)?;
    check.within("truth.dent_radius_mm", t.dent_radius_mm, 2.0, 1e4)?;
    for x in t.offset_mm {
        check.within("truth.offset_mm", x, -1000.0, 1000.0)?;
    }
    for x in t.offset_sd_mm {
        check.within("truth.offset_sd_mm", x, 0.0, 1000.0)?;
    }
    for x in t.turn_deg {
        check.within("truth.turn_deg", x, -180.0, 180.0)?;
    }
    for x in t.turn_sd_deg {
        check.within("truth.turn_sd_deg", x, 0.0, 90.0)?;
    }
    check.within("truth.scale_percent", t.scale_percent, -50.0, 100.0)?;
    check.within("truth.scale_sd_percent", t.scale_sd_percent, 0.0, 20.0)?;
    check.within("truth.compliance_mm_n", t.compliance_mm_n, 0.0, 100.0)
}
