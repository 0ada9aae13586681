//! `[touch]`: the canvas as the pen finds it.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Check;
use super::resolve::ScenarioError;

/// `[touch]`: how the canvas is learned by touch, with `canvas.belief = "touch"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TouchSettings {
    /// Lowest and highest that the surface may lie over the sheet's plane, towards the artist: all that is known of
    /// it beforehand.
    #[schemars(inner(range(min = -1000, max = 1000)))]
    pub range_mm: [f64; 2],
    /// Places probed along each side of the drawing before the first stroke: 3 is nine, and the middle. They are
    /// points of the drawing, of the first ink where it has some near, so that probing leaves few marks of its own.
    #[schemars(range(min = 2, max = 20))]
    pub probes: u32,
    /// Speed of the pen while a probe seeks the surface.
    #[schemars(range(min = 0.1, max = 100))]
    pub probe_speed_mm_s: f64,
    /// Force along the pen at which a guarded motion stops.
    #[schemars(range(min = 0.05, max = 20))]
    pub contact_n: f64,
    /// Standard deviation of the force sensor's noise.
    #[schemars(range(min = 0, max = 5))]
    pub force_noise_n: f64,
    /// Touches nearer to another than this are not kept.
    #[schemars(range(min = 0.2, max = 50))]
    pub spacing_mm: f64,
    /// Longest piece of a stroke that is drawn without planning anew.
    #[schemars(range(min = 2, max = 1000))]
    pub piece_mm: f64,
    /// How much higher than believed the surface may be: travels keep as far off, landings are slow from there. Less
    /// than `plan.hover_mm` by 3 at least.
    #[schemars(range(min = 0, max = 100))]
    pub clearance_mm: f64,
    /// How far under the believed surface a stroke's beginning is sought.
    #[schemars(range(min = 1, max = 200))]
    pub seek_mm: f64,
    /// What is believed in round the drawing, on each side.
    #[schemars(range(min = 1, max = 500))]
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

/// What no range says: a range that rises, and travels above what may be higher than believed.
pub(super) fn check_touch(touch: &TouchSettings, hover_mm: f64, check: &Check) -> Result<(), ScenarioError> {
    let [low, high] = touch.range_mm;
    if low >= high {
        return Err(check.wrong("touch.range_mm", format!("must rise, as [-80, 20], not [{low}, {high}]")));
    }
    if touch.clearance_mm > hover_mm - 3.0 {
        let most = hover_mm - 3.0;
        let message = format!("must be at most {most}, 3 less than `plan.hover_mm`, not {}", touch.clearance_mm);
        return Err(check.wrong("touch.clearance_mm", message));
    }
    Ok(())
}
