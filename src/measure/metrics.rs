//! metrics.json as data: the contract that other programs read.
//!
//! A figure of a stage that did not run, or that can't be computed, is absent; it is never invented. The comment of a field
//! is all that says what it means: GUIDE.md, reports and experiments quote it, by [`MetricPath`].
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BaseMetrics, LookMetrics, MetricPath, SeamMetrics, ToolMetrics};

/// Everything measured in one run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(title = "Calamus metrics")]
pub struct Metrics {
    /// Version of this format: [`Metrics::SCHEMA`].
    pub schema: u32,
    /// Version of the program.
    pub calamus_version: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Its seed.
    pub seed: u64,
    /// Digest of the final state and of the drawing: equal digests, equal runs to the last bit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
    /// The artwork.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drawing: Option<DrawingMetrics>,
    /// The canvas as the robot believes it to be.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub belief: Option<BeliefMetrics>,
    /// The map from sheet to canvas.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mapping: Option<MappingMetrics>,
    /// Where a mobile base stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage: Option<CoverageMetrics>,
    /// The plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plan: Option<PlanMetrics>,
    /// The simulation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sim: Option<SimMetrics>,
    /// The true canvas against the nominal one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthMetrics>,
    /// Pen against canvas.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<ContactMetrics>,
    /// Drawn line against desired line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<LineMetrics>,
    /// Shape of drawn patterns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<ShapeMetrics>,
    /// Tool changes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool: Option<ToolMetrics>,
    /// A base that drives from place to place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base: Option<BaseMetrics>,
    /// What a base found out by looking and feeling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub look: Option<LookMetrics>,
    /// Where strokes are drawn from two places.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seam: Option<SeamMetrics>,
    /// Picture against artwork.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub image: Option<ImageMetrics>,
    /// The pictures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub render: Option<RenderMetrics>,
}

/// The artwork.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct DrawingMetrics {
    /// The part of the drawing that was asked for, as `inks=red`; absent of a whole drawing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// Pen strokes in the artwork.
    pub strokes: usize,
    /// Points of the artwork's strokes.
    pub points: usize,
    /// Length of the artwork's lines on the flat sheet.
    pub length_m: f64,
    /// Inks, each drawn with its own pen.
    pub inks: usize,
    /// Changes of pen that the order of strokes asks for.
    pub ink_changes: usize,
    /// How long a robot takes to draw it, by a rule of thumb.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimated_s: Option<f64>,
    /// Each ink's share.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<LayerMetrics>,
    /// Time the computer took to read or make the strokes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
}

/// The strokes of one ink.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct LayerMetrics {
    /// Name of the ink.
    pub name: String,
    /// Its colour, `#rrggbb`.
    pub color: String,
    /// Strokes.
    pub strokes: usize,
    /// Points of those strokes.
    pub points: usize,
    /// Length of those strokes on the sheet.
    pub length_m: f64,
}

/// The canvas as the robot believes it to be, against the true one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct BeliefMetrics {
    /// `scan` or `touch`.
    pub kind: String,
    /// Points that were measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<usize>,
    /// Points that the believed surface was made of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<usize>,
    /// Probes that met the canvas before the first stroke.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probes: Option<usize>,
    /// How far the pen met the canvas from where it expected it, mean over the first quarter of what was drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_error_first_mm: Option<f64>,
    /// How far the pen met the canvas from where it expected it, mean over the last quarter of what was drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_error_last_mm: Option<f64>,
    /// Vertices of the believed surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertices: Option<usize>,
    /// Triangles of the believed surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub triangles: Option<usize>,
    /// Spread of the measured points about the believed surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_mm: Option<f64>,
    /// Mean distance of the believed surface from the true one, over the sheet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_mean_mm: Option<f64>,
    /// Distance of the believed surface from the true one; 95 % of the sheet is below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_p95_mm: Option<f64>,
    /// Largest distance of the believed surface from the true one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_max_mm: Option<f64>,
    /// Motions of a rigid canvas, of six, that the scanned shape shows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shown_motions: Option<usize>,
    /// Marks on the canvas that a camera found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub marks: Option<usize>,
    /// How far the believed sheet's centre is from the true one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sheet_offset_mm: Option<f64>,
    /// How far the believed sheet is turned against the true one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sheet_turn_deg: Option<f64>,
    /// Time the computer took to measure the canvas and to make the believed surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
}

/// The map from sheet to canvas.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct MappingMetrics {
    /// `projection` or `conformal`.
    pub kind: String,
    /// The most that a right angle of the sheet changes on the canvas, mean over the drawing's area.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "deg"))]
    pub angle_error_mean: Option<f64>,
    /// The most that a right angle of the sheet changes on the canvas; 95 % of the drawing is below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "deg"))]
    pub angle_error_p95: Option<f64>,
    /// Area on the canvas by area on the sheet; 5 % of the drawing is below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_ratio_p05: Option<f64>,
    /// Area on the canvas by area on the sheet; 95 % of the drawing is below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_ratio_p95: Option<f64>,
    /// Larger by smaller stretch at a place, mean over the drawing's area; 1 where angles are kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quasi_conformal_mean: Option<f64>,
    /// Larger by smaller stretch at a place, where it is largest; 1 where angles are kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quasi_conformal_max: Option<f64>,
    /// Triangles of the flattened canvas that lie turned over; absent where nothing was flattened.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flips: Option<usize>,
    /// Largest relative change of a stroke's length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_error_max: Option<f64>,
    /// Time the computer took to lay the drawing on the canvas.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
}

/// A place that the robot can't draw.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct PlanFailure {
    /// Index of the layer.
    pub layer: usize,
    /// Index of the stroke in the layer.
    pub stroke: usize,
    /// Index of the target in the stroke, when one target is to blame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point: Option<usize>,
    /// Why.
    pub reason: String,
}

/// The plan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct PlanMetrics {
    /// Share of the desired line that the robot can draw.
    pub reachable_fraction: f64,
    /// Largest planned turn of a joint in one millisecond, a control step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_joint_step_rad: Option<f64>,
    /// Pen changes in the plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool_changes: Option<usize>,
    /// How long the planned motion takes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimated_s: Option<f64>,
    /// Places that can't be drawn.
    pub failures: Vec<PlanFailure>,
    /// Time the computer took to plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
}

/// Where a mobile base stands to draw a wall.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct CoverageMetrics {
    /// `map`, `circles` or `poses`.
    pub method: String,
    /// Places that the base stands at.
    pub places: usize,
    /// Strokes that no place draws whole.
    pub cuts: usize,
    /// Passes of a stroke from one place to another.
    pub crossings: usize,
    /// How far the drawing is moved up its wall.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub raise_mm: Option<f64>,
    /// Length of the ways between places.
    pub drive_m: f64,
    /// How long the base drives to its first place and between places, roughly.
    pub drive_s: f64,
    /// How long a robot takes for all of it, roughly.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimated_s: Option<f64>,
    /// 1 where no choice among the places tried has fewer of them, else 0.
    pub optimal: usize,
    /// No choice among the places tried has fewer of them; absent where that wasn't asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bound: Option<usize>,
    /// Time the computer took to choose among them.
    pub solver_s: f64,
    /// Time the computer took to find the places, with the map of reach and planning.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
}

/// The simulation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct SimMetrics {
    /// `rapier` or `articulated`.
    pub plant: String,
    /// Physics steps, each of a millisecond.
    pub steps: u64,
    /// How long the robot was at work.
    pub simulated_s: f64,
    /// Time the computer took to simulate it.
    pub wall_s: f64,
    /// The robot's time by the computer's time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub real_time_factor: Option<f64>,
    /// Share of the drawing steps in which a limit on torque, or on its change, cut the command.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saturated_fraction: Option<f64>,
    /// Largest turn of a joint in one millisecond, as simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_joint_step_rad: Option<f64>,
}

/// The true canvas against the nominal one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct TruthMetrics {
    /// How far the true canvas's shape is from the nominal one at most: their two-sided Hausdorff distance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hausdorff_mm: Option<f64>,
    /// The two-sided Hausdorff distance of the shapes by the canvas's longest side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hausdorff_percent: Option<f64>,
    /// How far the canvas stands from where the robot believes it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset_mm: Option<f64>,
    /// How far the canvas is turned from where the robot believes it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turn_deg: Option<f64>,
    /// How much larger the canvas is than the robot believes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale_percent: Option<f64>,
}

/// Pen against canvas, over every physics step of every drawn stroke.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ContactMetrics {
    /// Mean normal force that stiffness and press depth ask for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_target_n: Option<f64>,
    /// Mean normal force of the pen on the canvas while drawing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_mean_n: Option<f64>,
    /// Standard deviation of the normal force; where line widths vary, of its distance from the one asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_sd_n: Option<f64>,
    /// Largest normal force of the pen on the canvas.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_max_n: Option<f64>,
    /// Share of the drawing steps in which the pen touches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_fraction: Option<f64>,
    /// Times that the pen came off the canvas within a stroke.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost_contacts: Option<u64>,
    /// Steps of a millisecond in which the pen touched though it should be up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pen_up_contact_steps: Option<u64>,
}

/// Drawn line against desired line, on the true surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct LineMetrics {
    /// Mean distance of the ink from the desired line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_mean_mm: Option<f64>,
    /// Distance of the ink from the desired line; 95 % of the ink is below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_p95_mm: Option<f64>,
    /// Largest distance of the ink from the desired line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_max_mm: Option<f64>,
    /// Largest distance of the ink that a stroke left from that stroke's desired line, 20 mm where it is more; dots of probes aren't in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stroke_error_max_mm: Option<f64>,
    /// Largest distance of the tip, across the pen, from where the robot wanted it, while it drew.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tip_error_max_mm: Option<f64>,
    /// Share of the desired line that got ink within one line width; of what a round nib can touch, where `touchable` is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
    /// Share of the desired line that a round nib can touch on a true surface with gaps and corners.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touchable: Option<f64>,
    /// Share of the ink farther than one line width from any desired line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excess: Option<f64>,
    /// Mean width of the drawn line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width_mean_mm: Option<f64>,
    /// Relative error of the drawn width, where one was desired; 90 % of that length is below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width_error_p90: Option<f64>,
    /// Length of the drawn lines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inked_length_m: Option<f64>,
}

/// Shape of drawn patterns.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ShapeMetrics {
    /// Relative deviation of the ratio of two adjacent sides of a grid's cell from the desired one, mean over the cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aspect_deviation: Option<f64>,
    /// Deviation of the angles of a grid's cells from the desired ones, as a share of a right angle, mean over the cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deviation: Option<f64>,
    /// Deviation of the angles of a grid's cells from the desired ones, mean over the cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deviation_deg: Option<f64>,
    /// Crossings of the desired grid that the drawn one hasn't.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing_crossings: Option<usize>,
    /// Relative error of a pattern's drawn sides against their desired flat length, mean over the sides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side_error_mean: Option<f64>,
    /// Relative error of a pattern's drawn sides against their desired flat length; 95 % are below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side_error_p95: Option<f64>,
    /// Relative error of a pattern's drawn sides against their desired flat length, of the worst side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side_error_max: Option<f64>,
}

/// Picture against artwork, both blurred by three widths of the pen's line. The artwork is the picture that the strokes
/// were made from, or else the desired lines.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ImageMetrics {
    /// Structural similarity of picture and artwork; 1 is equal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ssim: Option<f64>,
    /// Peak signal-to-noise ratio of picture against artwork.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub psnr_db: Option<f64>,
    /// Structural similarity of preview (the desired lines, without robot) and artwork; 1 is equal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preview_ssim: Option<f64>,
    /// Peak signal-to-noise ratio of preview against artwork.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preview_psnr_db: Option<f64>,
    /// Mean difference of light between preview and artwork, of 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preview_tone_error: Option<f64>,
}

/// The pictures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct RenderMetrics {
    /// Resolution of drawing.png.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "px/mm"))]
    pub px_per_mm: Option<f64>,
    /// Names of the views that were rendered.
    pub views: Vec<String>,
    /// Why there are no views, when there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub views_absent: Option<String>,
    /// Name of the graphics adapter that rendered the views.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adapter: Option<String>,
    /// Time the computer took to make the pictures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
}

impl Metrics {
    /// Version of the format. It rises when a figure changes its meaning or goes; new figures don't raise it.
    pub const SCHEMA: u32 = 1;

    /// Figures of a run of which nothing is known yet.
    pub fn new(scenario: &str, seed: u64) -> Self {
        Self {
            schema: Self::SCHEMA,
            calamus_version: env!("CARGO_PKG_VERSION").into(),
            scenario: scenario.into(),
            seed,
            ..Self::default()
        }
    }

    /// The figure with a dotted path such as `line.error_mean_mm`; `None` where it is absent or isn't a number.
    pub fn value(&self, path: &str) -> Option<f64> {
        number_at(&serde_json::to_value(self).ok()?, path)
    }

    /// Every numeric figure that there is, in the order of metrics.json.
    pub fn values(&self) -> Vec<(&'static MetricPath, f64)> {
        let json = serde_json::to_value(self).unwrap_or_default();
        MetricPath::all().iter().filter_map(|m| Some((m, number_at(&json, &m.path)?))).collect()
    }
}

fn number_at(json: &serde_json::Value, path: &str) -> Option<f64> {
    json.pointer(&format!("/{}", path.replace('.', "/")))?.as_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_did_not_run_is_absent() {
        let json = serde_json::to_string(&Metrics::new("x", 1)).unwrap();
        assert!(!json.contains("null") && !json.contains("line"), "{json}");
        let line = LineMetrics { error_mean_mm: Some(0.1), ..LineMetrics::default() };
        let metrics = Metrics { line: Some(line), ..Metrics::new("x", 1) };
        assert_eq!(metrics.value("line.error_mean_mm"), Some(0.1));
        assert_eq!(metrics.value("line.coverage"), None);
        assert_eq!(metrics.values(), [(MetricPath::find("line.error_mean_mm").unwrap(), 0.1)]);
        assert_eq!(serde_json::from_str::<Metrics>(&serde_json::to_string(&metrics).unwrap()).unwrap(), metrics);
    }
}
