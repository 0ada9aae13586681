//! `[touch]`: the canvas as the pen finds it.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Check;
use super::resolve::ScenarioError;

/// `[touch]`: how the canvas is learned by touch, with `canvas.belief = "touch"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TouchSettings {
    /// Lowest and highest that the surface may lie over the sheet's plane, mm: all that is known of it beforehand.
    pub range_mm: [f64; 2],
    /// Places probed along each side of the drawing before the first stroke: 3 is nine places.
    pub probes: u32,
    /// Speed of the pen while a probe seeks the surface, mm/s.
    pub probe_speed_mm_s: f64,
    /// Force along the pen at which a guarded motion stops, N.
    pub contact_n: f64,
    /// Standard deviation of the noise of the force sensor, N.
    pub force_noise_n: f64,
    /// Distance between two touches that are kept, mm.
    pub spacing_mm: f64,
    /// Longest piece of a stroke that is drawn without planning anew, mm.
    pub piece_mm: f64,
    /// How much higher than believed the surface may be where the pen travels, mm; less than `plan.hover_mm` by 3.
    pub clearance_mm: f64,
    /// How far under the believed surface a stroke's beginning is sought, mm.
    pub seek_mm: f64,
    /// What is believed in round the drawing, on each side, mm.
    pub margin_mm: f64,
}

impl Default for TouchSettings {
    fn default() -> Self {
        Self {
            range_mm: [-80.0, 20.0],
            probes: 3,
            probe_speed_mm_s: 10.0,
            contact_n: 0.4,
            force_noise_n: 0.02,
            spacing_mm: 1.5,
            piece_mm: 40.0,
            clearance_mm: 5.0,
            seek_mm: 15.0,
            margin_mm: 15.0,
        }
    }
}

/// Every number in its range.
pub(super) fn check_touch(touch: &TouchSettings, hover_mm: f64, check: &Check) -> Result<(), ScenarioError> {
    let [low, high] = touch.range_mm;
    check.within("touch.range_mm", low, -1000.0, 1000.0)?;
    check.within("touch.range_mm", high, -1000.0, 1000.0)?;
    if low >= high {
        return Err(check.wrong("touch.range_mm", format!("must rise, as [-80, 20], not [{low}, {high}]")));
    }
    check.within("touch.probes", f64::from(touch.probes), 2.0, 20.0)?;
    check.above_zero("touch.probe_speed_mm_s", touch.probe_speed_mm_s, 100.0)?;
    check.within("touch.contact_n", touch.contact_n, 0.05, 20.0)?;
    check.within("touch.force_noise_n", touch.force_noise_n, 0.0, 5.0)?;
    check.within("touch.spacing_mm", touch.spacing_mm, 0.2, 50.0)?;
    check.within("touch.piece_mm", touch.piece_mm, 2.0, 1000.0)?;
    check.within("touch.clearance_mm", touch.clearance_mm, 0.0, 100.0)?;
    if touch.clearance_mm > hover_mm - 3.0 {
        let most = hover_mm - 3.0;
        let message = format!("must be at most {most}, 3 less than `plan.hover_mm`, not {}", touch.clearance_mm);
        return Err(check.wrong("touch.clearance_mm", message));
    }
    check.within("touch.seek_mm", touch.seek_mm, 1.0, 200.0)?;
    check.within("touch.margin_mm", touch.margin_mm, 1.0, 500.0)
}
