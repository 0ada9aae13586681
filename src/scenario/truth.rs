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
    /// Random relief: the two-sided Hausdorff distance that it makes, measured and set to within 1 %, by the canvas's
    /// longest side (twice the radius of a half-sphere). What faces the sheet is made uneven; sharp edges stay.
    #[schemars(range(min = 0, max = 50))]
    pub relief_percent: f64,
    /// Shortest wave of the relief, the longest is twice that; half the canvas's longest side when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 1e5))]
    pub relief_wavelength_mm: Option<f64>,
    /// Boards that the face is made of. Steps between them are upright faces.
    pub planks: PlankKind,
    /// From one board to the next.
    #[schemars(range(min = 5, max = 1e5))]
    pub plank_width_mm: f64,
    /// Largest step between two boards: they stand out by up to half of it either way.
    #[schemars(range(min = 0, max = 500))]
    pub plank_step_mm: f64,
    /// Gap between two boards, through which there is nothing to draw on; at most 0.9 times `plank_width_mm`.
    #[schemars(range(min = 0, max = 1e5))]
    pub plank_gap_mm: f64,
    /// Width and depth of the eased (45 degrees) edges of a board. A pen climbs an eased edge; an upright step stops
    /// it.
    #[schemars(range(min = 0, max = 500))]
    pub plank_bevel_mm: f64,
    /// Number of dents, at random places of what faces the sheet.
    #[schemars(range(min = 0, max = 10_000))]
    pub dents: u32,
    /// Their depth; below 0 they are bumps.
    #[schemars(range(min = -500, max = 500))]
    pub dent_depth_mm: f64,
    /// Their radius.
    #[schemars(range(min = 2, max = 1e4))]
    pub dent_radius_mm: f64,
    /// How far canvas and sheet stand from where the robot believes them, in the world.
    #[schemars(inner(range(min = -1000, max = 1000)))]
    pub offset_mm: [f64; 3],
    /// Standard deviation of a random part of that.
    #[schemars(inner(range(min = 0, max = 1000)))]
    pub offset_sd_mm: [f64; 3],
    /// Roll, pitch and yaw of canvas and sheet about the canvas's middle, about the world's axes.
    #[schemars(inner(range(min = -180, max = 180)))]
    pub turn_deg: [f64; 3],
    /// Standard deviation of a random part of that.
    #[schemars(inner(range(min = 0, max = 90)))]
    pub turn_sd_deg: [f64; 3],
    /// How much larger the canvas is, about its middle.
    #[schemars(range(min = -50, max = 100))]
    pub scale_percent: f64,
    /// Standard deviation of a random part of that.
    #[schemars(range(min = 0, max = 20))]
    pub scale_sd_percent: f64,
    /// How far the canvas gives way to the pen, in series with the nib.
    #[schemars(range(min = 0, max = 100))]
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

/// What no range says: how wide a gap between boards may be.
pub(super) fn check_truth(t: &TruthSettings, check: &Check) -> Result<(), ScenarioError> {
    check.within("truth.plank_gap_mm", t.plank_gap_mm, 0.0, 0.9 * t.plank_width_mm)
}
