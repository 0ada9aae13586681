//! metrics.json as data: the contract that other programs read.
//!
//! A figure of a stage that did not run, or that can't be computed, is absent; it is never invented.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ToolMetrics;

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
    /// Drawn line against wished line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<LineMetrics>,
    /// Shape of drawn patterns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<ShapeMetrics>,
    /// Tool changes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool: Option<ToolMetrics>,
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
    /// Strokes.
    pub strokes: usize,
    /// Points of all strokes.
    pub points: usize,
    /// Length of all strokes on the sheet, m.
    pub length_m: f64,
    /// Inks.
    pub inks: usize,
    /// How often the pen changes, in the order of drawing.
    pub ink_changes: usize,
    /// How long a robot takes to draw it, by a rule of thumb, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimated_s: Option<f64>,
    /// Each ink's share.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<LayerMetrics>,
    /// Wall-clock time of reading and tidying, s.
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
    /// Length of those strokes on the sheet, m.
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
    /// Points that the surface was made of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<usize>,
    /// Probes that met the canvas before the first stroke.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probes: Option<usize>,
    /// Mean difference of met and predicted height over the first quarter of what was drawn, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_error_first_mm: Option<f64>,
    /// The same over the last quarter, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_error_last_mm: Option<f64>,
    /// Vertices of the believed surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertices: Option<usize>,
    /// Triangles of the believed surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub triangles: Option<usize>,
    /// Spread of the points about the believed surface, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_mm: Option<f64>,
    /// Mean distance of the believed surface from the true one, over the sheet, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_mean_mm: Option<f64>,
    /// 95th percentile of it, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_p95_mm: Option<f64>,
    /// Largest, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_max_mm: Option<f64>,
    /// Of the six motions of a rigid canvas, those that the scanned shape shows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shown_motions: Option<usize>,
    /// Marks that a camera found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub marks: Option<usize>,
    /// Distance of the believed sheet's centre from the true one, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sheet_offset_mm: Option<f64>,
    /// Angle between the believed and the true sheet, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sheet_turn_deg: Option<f64>,
    /// Wall-clock time of scanning and meshing, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
}

/// The map from sheet to canvas.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct MappingMetrics {
    /// `projection` or `conformal`.
    pub kind: String,
    /// Mean over the drawing's area of the most that a right angle can change, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_error_mean: Option<f64>,
    /// 95th percentile of the same, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_error_p95: Option<f64>,
    /// 5th percentile of area on the canvas by area on the sheet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_ratio_p05: Option<f64>,
    /// 95th percentile of the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_ratio_p95: Option<f64>,
    /// Mean over the drawing's area of the larger by the smaller stretch at a place; 1 where angles are kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quasi_conformal_mean: Option<f64>,
    /// Largest value of the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quasi_conformal_max: Option<f64>,
    /// Triangles of the flattened canvas that lie turned over; absent where nothing was flattened.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flips: Option<usize>,
    /// Largest relative error of a stroke's length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_error_max: Option<f64>,
    /// Wall-clock time of mapping, s.
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
    /// Share of the wished length that the robot can draw.
    pub reachable_fraction: f64,
    /// Largest change of a joint in one control step (1 ms), rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_joint_step_rad: Option<f64>,
    /// Poses of the mobile base.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_poses: Option<usize>,
    /// Pen changes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool_changes: Option<usize>,
    /// Duration of the planned motion, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimated_s: Option<f64>,
    /// Places that can't be drawn.
    pub failures: Vec<PlanFailure>,
    /// Wall-clock time of planning, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
}

/// The simulation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct SimMetrics {
    /// `rapier` or `articulated`.
    pub plant: String,
    /// Physics steps.
    pub steps: u64,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Wall-clock time, s.
    pub wall_s: f64,
    /// Simulated by wall-clock time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub real_time_factor: Option<f64>,
    /// Share of the drawing steps in which a torque or torque-rate limit cut the command.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saturated_fraction: Option<f64>,
    /// Largest change of a joint in one step, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_joint_step_rad: Option<f64>,
}

/// The true canvas against the nominal one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct TruthMetrics {
    /// Two-sided Hausdorff distance of their shapes, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hausdorff_mm: Option<f64>,
    /// The same in per cent of the canvas's longest side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hausdorff_percent: Option<f64>,
    /// How far the canvas stands from where it is believed, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset_mm: Option<f64>,
    /// By how much it is turned, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turn_deg: Option<f64>,
    /// How much larger it is, per cent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale_percent: Option<f64>,
}

/// Pen against canvas, over every physics step of every drawn stroke.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ContactMetrics {
    /// Mean normal force that stiffness and press depth ask for, N.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_target_n: Option<f64>,
    /// Mean normal force, N.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_mean_n: Option<f64>,
    /// Standard deviation of the normal force from the one asked for, N.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_sd_n: Option<f64>,
    /// Largest normal force, N.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_max_n: Option<f64>,
    /// Share of drawing steps with contact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_fraction: Option<f64>,
    /// Times that contact was lost within a stroke.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost_contacts: Option<u64>,
    /// Steps with contact while the pen should have been up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pen_up_contact_steps: Option<u64>,
}

/// Drawn line against wished line, on the true surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct LineMetrics {
    /// Mean distance of the ink from the wished line, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_mean_mm: Option<f64>,
    /// 95th percentile of it, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_p95_mm: Option<f64>,
    /// Largest, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_max_mm: Option<f64>,
    /// Share of the wished length with ink within one line width.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
    /// Share of the inked length farther than one line width from any wished line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excess: Option<f64>,
    /// Mean width of the inked line, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width_mean_mm: Option<f64>,
    /// 90 % of the length of lines of wished width is nearer to that width than this, relatively.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width_error_p90: Option<f64>,
    /// Length of the inked lines, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inked_length_m: Option<f64>,
}

/// Shape of drawn patterns.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ShapeMetrics {
    /// Mean relative deviation of the ratio of two adjacent sides of a cell from that of the wished grid on the nominal surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aspect_deviation: Option<f64>,
    /// Mean deviation of the cells' angles from those of the wished grid on the nominal surface, as a share of a right angle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deviation: Option<f64>,
    /// The same, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deviation_deg: Option<f64>,
    /// Crossings of the wished grid that the drawn one hasn't.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing_crossings: Option<usize>,
    /// Mean relative error of a pattern's drawn sides against their wished flat lengths.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side_error_mean: Option<f64>,
    /// 95th percentile of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side_error_p95: Option<f64>,
    /// Largest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side_error_max: Option<f64>,
}

/// Picture against artwork, both blurred by three widths of the pen's line. The artwork is the picture that the strokes
/// were made from, or else the lines as wished.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ImageMetrics {
    /// Structural similarity; 1 is equal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ssim: Option<f64>,
    /// Peak signal-to-noise ratio, dB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub psnr_db: Option<f64>,
    /// Structural similarity of the preview: the lines as wished, without robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preview_ssim: Option<f64>,
    /// Peak signal-to-noise ratio of the preview, dB.
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
    /// Resolution of drawing.png, pixels a millimetre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub px_per_mm: Option<f64>,
    /// Names of the views that were rendered.
    pub views: Vec<String>,
    /// Why there are no views, when there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub views_absent: Option<String>,
    /// Name of the graphics adapter that rendered the views.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adapter: Option<String>,
    /// Wall-clock time of rendering, s.
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
        let json = serde_json::to_value(self).ok()?;
        json.pointer(&format!("/{}", path.replace('.', "/")))?.as_f64()
    }
}

/// A numeric figure of metrics.json, by its dotted path, and what it says in plain words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MetricPath {
    /// As `line.error_mean_mm`.
    pub path: &'static str,
    /// Unit for people; empty for plain numbers.
    pub unit: &'static str,
    /// What it says.
    pub meaning: &'static str,
}

const fn metric(path: &'static str, unit: &'static str, meaning: &'static str) -> MetricPath {
    MetricPath { path, unit, meaning }
}

impl MetricPath {
    /// Every numeric figure, in the order of metrics.json.
    pub const ALL: &[MetricPath] = &[
        metric("drawing.strokes", "", "pen strokes in the artwork"),
        metric("drawing.points", "", "points of those strokes"),
        metric("drawing.length_m", "m", "length of the artwork's lines on the flat sheet"),
        metric("drawing.inks", "", "inks, each drawn with its own pen"),
        metric("drawing.ink_changes", "", "changes of pen that the order of strokes asks for"),
        metric("drawing.estimated_s", "s", "how long a robot takes to draw it, by a rule of thumb"),
        metric("drawing.duration_s", "s", "time the computer took to read or make the strokes"),
        metric("belief.measured", "", "points that the camera measured"),
        metric("belief.points", "", "points that the believed surface was made of"),
        metric("belief.probes", "", "probes that met the canvas before the first stroke"),
        metric(
            "belief.height_error_first_mm",
            "mm",
            "how far the pen met the canvas from where it expected it, in the first quarter of the drawing",
        ),
        metric("belief.height_error_last_mm", "mm", "the same in the last quarter"),
        metric("belief.vertices", "", "vertices of the believed surface"),
        metric("belief.triangles", "", "triangles of the believed surface"),
        metric("belief.noise_mm", "mm", "spread of the measured points about the believed surface"),
        metric("belief.error_mean_mm", "mm", "mean distance of the believed surface from the true one"),
        metric("belief.error_p95_mm", "mm", "the same; 95 % of the sheet is better than this"),
        metric("belief.error_max_mm", "mm", "the same at the worst place"),
        metric("belief.shown_motions", "", "of the six motions of a rigid canvas, those that the scanned shape shows"),
        metric("belief.marks", "", "marks on the canvas that a camera found"),
        metric("belief.sheet_offset_mm", "mm", "how far the believed sheet's centre is from the true one"),
        metric("belief.sheet_turn_deg", "deg", "how far the believed sheet is turned against the true one"),
        metric("belief.duration_s", "s", "time the computer took to scan and to make the surface"),
        metric(
            "mapping.angle_error_mean",
            "deg",
            "the most that a right angle of the sheet changes on the canvas, mean of all places",
        ),
        metric("mapping.angle_error_p95", "deg", "the same; 95 % of the drawing is better than this"),
        metric(
            "mapping.area_ratio_p05",
            "",
            "area on the canvas by area on the sheet; 5 % of the drawing is below this",
        ),
        metric("mapping.area_ratio_p95", "", "the same; 95 % of the drawing is below this"),
        metric(
            "mapping.quasi_conformal_mean",
            "",
            "larger by smaller stretch at a place, mean of all places; 1 where angles are kept",
        ),
        metric("mapping.quasi_conformal_max", "", "the same at the worst place"),
        metric("mapping.flips", "", "triangles of the flattened canvas that lie turned over"),
        metric("mapping.length_error_max", "", "largest relative change of a stroke's length"),
        metric("mapping.duration_s", "s", "time the computer took to lay the drawing on the canvas"),
        metric("plan.reachable_fraction", "", "share of the wished line that the robot can draw"),
        metric("plan.max_joint_step_rad", "rad", "largest planned turn of a joint in one millisecond"),
        metric("plan.base_poses", "", "places that the mobile base drives to"),
        metric("plan.tool_changes", "", "pen changes"),
        metric("plan.estimated_s", "s", "how long the drawing should take"),
        metric("plan.duration_s", "s", "time the computer took to plan"),
        metric("sim.steps", "", "physics steps of one millisecond"),
        metric("sim.simulated_s", "s", "how long the robot was at work"),
        metric("sim.wall_s", "s", "time the computer took to simulate it"),
        metric("sim.real_time_factor", "", "robot's time by computer's time"),
        metric("sim.saturated_fraction", "", "share of drawing steps in which a torque limit cut in"),
        metric("sim.max_joint_step_rad", "rad", "largest turn of a joint in one millisecond, as simulated"),
        metric("truth.hausdorff_mm", "mm", "how far the true canvas's shape is from the nominal one, at most"),
        metric("truth.hausdorff_percent", "%", "the same, of the canvas's longest side"),
        metric("truth.offset_mm", "mm", "how far the canvas stands from where the robot believes it"),
        metric("truth.turn_deg", "deg", "how far it is turned"),
        metric("truth.scale_percent", "%", "how much larger it is"),
        metric("contact.force_target_n", "N", "force that stiffness and press depth ask for, on average"),
        metric("contact.force_mean_n", "N", "mean force of the pen on the canvas while drawing"),
        metric(
            "contact.force_sd_n",
            "N",
            "how much that force varies, where line widths vary against the force asked for (standard deviation)",
        ),
        metric("contact.force_max_n", "N", "largest force of the pen on the canvas"),
        metric("contact.contact_fraction", "", "share of the drawing time in which the pen touches"),
        metric("contact.lost_contacts", "", "times the pen came off within a stroke"),
        metric("contact.pen_up_contact_steps", "", "milliseconds in which the pen touched though it should be up"),
        metric("line.error_mean_mm", "mm", "mean distance of the ink from the wished line"),
        metric("line.error_p95_mm", "mm", "95 % of the ink is nearer to the wished line than this"),
        metric("line.error_max_mm", "mm", "largest distance of ink from the wished line"),
        metric("line.coverage", "", "share of the wished line that got ink within one line width"),
        metric("line.excess", "", "share of the ink farther than one line width from any wished line"),
        metric("line.width_mean_mm", "mm", "mean width of the drawn line"),
        metric(
            "line.width_error_p90",
            "",
            "relative error of the width; 90 % of the line of wished width is better than this",
        ),
        metric("line.inked_length_m", "m", "length of the drawn lines"),
        metric(
            "shape.aspect_deviation",
            "",
            "relative change of the ratio of two adjacent sides of a grid's cell, on average",
        ),
        metric(
            "shape.angle_deviation",
            "",
            "change of the angle at its corners as a share of a right angle, on average",
        ),
        metric("shape.angle_deviation_deg", "deg", "the same in degrees"),
        metric("shape.missing_crossings", "", "crossings of the wished grid that the drawn one hasn't"),
        metric(
            "shape.side_error_mean",
            "",
            "relative error of a pattern's sides against their flat length, on average",
        ),
        metric("shape.side_error_p95", "", "the same; 95 % of the sides are better"),
        metric("shape.side_error_max", "", "the same; the worst side"),
        metric("tool.changes", "", "pens fetched or brought back by the robot"),
        metric("tool.fetches", "", "fetches of pens"),
        metric("tool.fetches_distinct", "", "fetches that were simulated each by itself"),
        metric("tool.success_rate", "", "share of the distinct fetches that worked, until the pen was back"),
        metric("tool.success_rate_low", "", "lower end of its 95 % interval"),
        metric("tool.success_rate_high", "", "upper end of its 95 % interval"),
        metric("tool.handover_jump_rad", "rad", "largest jump of a joint where plants take over from each other"),
        metric("tool.settling_s", "s", "longest time in which all came to rest before a fetch"),
        metric("tool.attempts", "", "attempts at that"),
        metric("tool.successes", "", "pen changes that worked"),
        metric("tool.failed", "", "pen changes that didn't, of whatever kind"),
        metric("tool.held_by_friction", "", "times that a pen was drawn with which friction held all the while"),
        metric("tool.dropped", "", "pens dropped"),
        metric("tool.pick_given_up", "", "fetches given up, the pen left in its dock"),
        metric("tool.return_given_up", "", "returns given up"),
        metric("tool.bad_pose", "", "pens more than 1 mm or 1 degree off in the hand, unnoticed"),
        metric("tool.not_seated", "", "pens more than 1 mm off their seat, unnoticed"),
        metric("tool.pose_error_mm_p95", "mm", "how far a fetched pen's tip is off; 95 % are better"),
        metric("tool.pose_error_mm_max", "mm", "the largest of it"),
        metric("tool.pose_error_deg_p95", "deg", "how far a fetched pen leans; 95 % are better"),
        metric(
            "tool.tip.x_mm",
            "mm",
            "the first fetched pen's tip in the hand, against a perfect grasp, out of the palm",
        ),
        metric("tool.tip.y_mm", "mm", "the same across"),
        metric("tool.tip.z_mm", "mm", "the same up"),
        metric("tool.steps", "", "physics steps of all pen changes"),
        metric("tool.stages.approach.x_mm", "mm", "x of the tool in the hand after the approach"),
        metric("tool.stages.approach.y_mm", "mm", "y of the tool in the hand after the approach"),
        metric("tool.stages.approach.z_mm", "mm", "z of the tool in the hand after the approach"),
        metric("tool.stages.approach.roll_deg", "deg", "roll of the tool in the hand after the approach"),
        metric("tool.stages.approach.pitch_deg", "deg", "pitch of the tool in the hand after the approach"),
        metric("tool.stages.approach.yaw_deg", "deg", "yaw of the tool in the hand after the approach"),
        metric("tool.stages.half_grasp.x_mm", "mm", "x of the tool in the hand after the half-grasp"),
        metric("tool.stages.half_grasp.y_mm", "mm", "y of the tool in the hand after the half-grasp"),
        metric("tool.stages.half_grasp.z_mm", "mm", "z of the tool in the hand after the half-grasp"),
        metric("tool.stages.half_grasp.roll_deg", "deg", "roll of the tool in the hand after the half-grasp"),
        metric("tool.stages.half_grasp.pitch_deg", "deg", "pitch of the tool in the hand after the half-grasp"),
        metric("tool.stages.half_grasp.yaw_deg", "deg", "yaw of the tool in the hand after the half-grasp"),
        metric("tool.stages.lift.x_mm", "mm", "x of the tool in the hand after the lift"),
        metric("tool.stages.lift.y_mm", "mm", "y of the tool in the hand after the lift"),
        metric("tool.stages.lift.z_mm", "mm", "z of the tool in the hand after the lift"),
        metric("tool.stages.lift.roll_deg", "deg", "roll of the tool in the hand after the lift"),
        metric("tool.stages.lift.pitch_deg", "deg", "pitch of the tool in the hand after the lift"),
        metric("tool.stages.lift.yaw_deg", "deg", "yaw of the tool in the hand after the lift"),
        metric("tool.stages.full_grasp.x_mm", "mm", "x of the tool in the hand after the full grasp"),
        metric("tool.stages.full_grasp.y_mm", "mm", "y of the tool in the hand after the full grasp"),
        metric("tool.stages.full_grasp.z_mm", "mm", "z of the tool in the hand after the full grasp"),
        metric("tool.stages.full_grasp.roll_deg", "deg", "roll of the tool in the hand after the full grasp"),
        metric("tool.stages.full_grasp.pitch_deg", "deg", "pitch of the tool in the hand after the full grasp"),
        metric("tool.stages.full_grasp.yaw_deg", "deg", "yaw of the tool in the hand after the full grasp"),
        metric("tool.schedule.duration_s", "s", "the whole run"),
        metric("tool.schedule.waiting_s", "s", "how long arms waited for the canvas"),
        metric("tool.schedule.together_s", "s", "time in which two arms are over the canvas"),
        metric("tool.schedule.one_arm_s", "s", "what one arm would take for the same work"),
        metric("tool.schedule.saved_fraction", "", "share of that time saved"),
        metric("tool.schedule.distance_planned_mm", "mm", "the arms are never nearer in the plan"),
        metric("tool.schedule.distance_mm", "mm", "the arms never were nearer"),
        metric("image.ssim", "", "likeness of picture and artwork; 1 is equal"),
        metric("image.psnr_db", "dB", "peak signal-to-noise ratio of picture against artwork"),
        metric("image.preview_ssim", "", "likeness of preview and artwork; 1 is equal"),
        metric("image.preview_psnr_db", "dB", "peak signal-to-noise ratio of preview against artwork"),
        metric("image.preview_tone_error", "", "mean difference of light between preview and artwork, of 0 to 1"),
        metric("render.px_per_mm", "px/mm", "resolution of drawing.png"),
        metric("render.duration_s", "s", "time the computer took to make the pictures"),
    ];

    /// The figure with that path.
    pub fn find(path: &str) -> Option<&'static MetricPath> {
        Self::ALL.iter().find(|m| m.path == path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Keys of `tool.stages`.
    const STAGES: [&str; 4] = ["approach", "half_grasp", "lift", "full_grasp"];

    /// Dotted paths of every number in the schema of [`Metrics`] but for the angles of the first pen's tip, which are those of its tool.
    fn numbers(schema: &serde_json::Value) -> Vec<String> {
        let is_number = |p: &serde_json::Value| {
            let text = p["type"].to_string();
            text.contains("\"number\"") || text.contains("\"integer\"")
        };
        let mut paths = Vec::new();
        let mut open = vec![(String::new(), schema)];
        while let Some((path, object)) = open.pop() {
            for (key, property) in object["properties"].as_object().unwrap() {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                if is_number(property) && path.contains('.') {
                    paths.push(path);
                    continue;
                }
                let text = property.to_string();
                // lists aren't figures
                if text.contains("\"items\"") {
                    continue;
                }
                let Some(name) = text.split("#/$defs/").nth(1).and_then(|t| t.split('"').next()) else { continue };
                let inner = &schema["$defs"][name];
                match text.contains("additionalProperties") {
                    true => open.extend(STAGES.iter().map(|stage| (format!("{path}.{stage}"), inner))),
                    false => open.push((path, inner)),
                }
            }
        }
        paths.retain(|p| !p.starts_with("tool.tip.") || p.ends_with("_mm"));
        paths.sort();
        paths
    }

    #[test]
    fn every_number_is_explained_and_nothing_else() {
        let schema = schemars::schema_for!(Metrics).to_value();
        let mut explained: Vec<String> = MetricPath::ALL.iter().map(|m| m.path.to_string()).collect();
        explained.sort();
        assert_eq!(explained, numbers(&schema));
    }

    #[test]
    fn what_did_not_run_is_absent() {
        let json = serde_json::to_string(&Metrics::new("x", 1)).unwrap();
        assert!(!json.contains("null") && !json.contains("line"), "{json}");
        let line = LineMetrics { error_mean_mm: Some(0.1), ..LineMetrics::default() };
        let metrics = Metrics { line: Some(line), ..Metrics::new("x", 1) };
        assert_eq!(metrics.value("line.error_mean_mm"), Some(0.1));
        assert_eq!(metrics.value("line.coverage"), None);
        assert_eq!(serde_json::from_str::<Metrics>(&serde_json::to_string(&metrics).unwrap()).unwrap(), metrics);
    }
}
