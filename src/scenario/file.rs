//! The scenario as typed.
use std::collections::BTreeMap;
use std::sync::LazyLock;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::math::Rgb;
use crate::surface::{FlattenOptions, MappingKind};

use super::change::ChangeSettings;
use super::coverage::CoverageSettings;
use super::drive::DriveSettings;
use super::localisation::LocalisationSettings;
use super::looking::LookingSettings;
use super::picture::{
    ColorSettings, EdgeSettings, HatchingSettings, InkOrder, LayeredDepthSettings, PainterlySettings, StippleSettings,
    Style, TspSettings,
};
use super::scan::ScanSettings;
use super::settings::{BeliefKind, ControlSettings, Fill, PlanSettings, RenderSettings, SimSettings};
use super::tools::ToolSettings;
use super::touch::TouchSettings;
use super::truth::TruthSettings;

/// A scenario file: TOML, unknown keys refused, everything but the drawing and the canvas optional.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Calamus scenario")]
pub struct ScenarioFile {
    /// Name of the run, as it stands in metrics and reports; the file's name when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// What the run shows.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub description: String,
    /// Seed of every random number of the run. Same seed, same bits.
    #[serde(default = "ScenarioFile::default_seed")]
    pub seed: u64,
    /// A robot, by name or path.
    #[serde(default = "ScenarioFile::default_robot")]
    pub robot: String,
    /// Which arm draws, by its name in the robot's file, where there are several. The others stand still in their
    /// service poses. Of arms with grippers all draw when it is absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arm: Option<String>,
    /// What is drawn.
    #[serde(default)]
    pub drawing: DrawingFile,
    /// What it is drawn on.
    #[serde(default)]
    pub canvas: CanvasFile,
    /// How what it is drawn on differs from what the robot believes.
    #[serde(default)]
    pub truth: TruthSettings,
    /// How the canvas is scanned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scan: Option<ScanSettings>,
    /// How the canvas is learned by touch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub touch: Option<TouchSettings>,
    /// How arms with grippers fetch their pens.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tools: Option<ToolSettings>,
    /// Where a mobile base stands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<CoverageSettings>,
    /// How a mobile base drives.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive: Option<DriveSettings>,
    /// How a mobile base finds out where it stands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub localisation: Option<LocalisationSettings>,
    /// Values of the robot's and of the scene's file that are changed.
    #[serde(default, skip_serializing_if = "ChangeSettings::is_empty")]
    pub change: ChangeSettings,
    /// How it finds out better by looking and feeling.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub looking: Option<LookingSettings>,
    /// What it is drawn with.
    #[serde(default)]
    pub pen: PenFile,
    /// How strokes become joint motion.
    #[serde(default)]
    pub plan: PlanSettings,
    /// The impedance law and the speed of the pen.
    #[serde(default)]
    pub control: ControlSettings,
    /// The plant and what is kept of it.
    #[serde(default)]
    pub sim: SimSettings,
    /// Pictures.
    #[serde(default)]
    pub render: RenderSettings,
    /// Bounds that figures of metrics.json must keep, by dotted name; `calamus run` ends with exit code 1 when one
    /// doesn't.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub accept: BTreeMap<String, Threshold>,
}

impl ScenarioFile {
    fn default_seed() -> u64 {
        1
    }
    fn default_robot() -> String {
        "iiwa_fixed".into()
    }

    /// The JSON schema of scenario files: what editors check, and where the ranges of all numbers come from.
    pub fn schema() -> &'static serde_json::Value {
        static SCHEMA: LazyLock<serde_json::Value> = LazyLock::new(|| schemars::schema_for!(ScenarioFile).to_value());
        &SCHEMA
    }
}

/// `[drawing]`: a file or a pattern, and how large.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DrawingFile {
    /// An `.svg`, the recording of a stylus `.jsonl`, one of the stroke text files `NAME_k.txt`, `NAME_c.txt`, ...,
    /// or a picture, `.png`, `.jpg`, `.webp`, `.tif`, `.gif`, `.bmp`, `.qoi` or `.hdr`; relative to the scenario's folder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Height of the drawing. One of height and width keeps the proportions; with both the drawing is fitted into
    /// them; with neither it keeps its own size, a pattern is 150 mm square, and a picture's longer side 200 mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 1e5))]
    pub height_mm: Option<f64>,
    /// Width of the drawing.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 1e5))]
    pub width_mm: Option<f64>,
    /// Turns the drawing counter-clockwise on the sheet.
    #[schemars(range(min = -360, max = 360))]
    pub rotate_deg: f64,
    /// What becomes of filled areas.
    pub fill: Fill,
    /// Distance between hatch lines, with `fill = "hatch"`.
    #[schemars(range(min = 0.01, max = 1000))]
    pub hatch_spacing_mm: f64,
    /// Direction of hatch lines, from the x axis, with `fill = "hatch"`.
    #[schemars(range(min = -360, max = 360))]
    pub hatch_angle_deg: f64,
    /// Width of a stylus's line at no and at full pressure; what the pen can draw when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 0.01, max = 100)))]
    pub stylus_width_mm: Option<[f64; 2]>,
    /// Exponent of the pressure in that: above 1, light strokes are finer.
    #[schemars(range(min = 0.1, max = 10))]
    pub stylus_gamma: f64,
    /// Join strokes that meet, and order them for short ways with the pen up.
    pub tidy: bool,
    /// Ends of strokes nearer than this are joined; 0 joins none.
    #[schemars(range(min = 0, max = 10))]
    pub merge_mm: f64,
    /// Points are left out while the line moves less than this; 0 keeps all.
    #[schemars(range(min = 0, max = 10))]
    pub simplify_mm: f64,
    /// In which order strokes of several inks are drawn.
    pub ink_order: InkOrder,
    /// With `ink_order = "fewest_changes"`: how far from its turn a stroke may be drawn, as a share of all strokes.
    #[schemars(range(min = 0, max = 1))]
    pub disorder: f64,
    /// A generated pattern in place of a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pattern: Option<PatternFile>,
    /// What is made of a picture; when absent, what the one section for pictures below says, or else `tsp`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub style: Option<Style>,
    /// How a picture is taken apart into inks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub color: Option<ColorSettings>,
    /// One line an ink through the points of a picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tsp: Option<TspSettings>,
    /// Dots.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stipple: Option<StippleSettings>,
    /// Brush strokes from broad to fine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub painterly: Option<PainterlySettings>,
    /// Brush strokes object by object, from back to front.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layered_depth: Option<LayeredDepthSettings>,
    /// Cross-hatching.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hatching: Option<HatchingSettings>,
    /// Edge lines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edges: Option<EdgeSettings>,
}

impl Default for DrawingFile {
    fn default() -> Self {
        Self {
            source: None,
            height_mm: None,
            width_mm: None,
            rotate_deg: 0.0,
            fill: Fill::Outline,
            hatch_spacing_mm: 1.0,
            hatch_angle_deg: 45.0,
            stylus_width_mm: None,
            stylus_gamma: 1.0,
            tidy: true,
            merge_mm: 0.05,
            simplify_mm: 0.005,
            ink_order: InkOrder::AsMade,
            disorder: 0.1,
            pattern: None,
            style: None,
            color: None,
            tsp: None,
            stipple: None,
            painterly: None,
            layered_depth: None,
            hatching: None,
            edges: None,
        }
    }
}

/// The patterns that can be generated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PatternKind {
    /// n x n squares.
    Grid,
    /// Hilbert's space-filling curve.
    Hilbert,
    /// Sierpinski's arrowhead curve.
    Arrowhead,
    /// Koch's snowflake.
    Snowflake,
    /// A test target: circles, crosses and rulers.
    Target,
}

/// `[drawing.pattern]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatternFile {
    /// Which pattern.
    pub kind: PatternKind,
    /// Squares a side: of a `grid`, 7 when absent, and of a grid under a `hilbert` curve, none when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 200))]
    pub n: Option<u32>,
    /// Order of a curve: `hilbert` 1 to 8 (5 when absent), `arrowhead` 1 to 9 (6), `snowflake` 0 to 7 (4).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 9))]
    pub order: Option<u32>,
}

/// `[canvas]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CanvasFile {
    /// A scene, by name or path. It is needed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// How the sheet is laid on the canvas.
    pub mapping: MappingKind,
    /// What the robot knows of the canvas.
    pub belief: BeliefKind,
    /// Moves the drawing right and up on the sheet.
    #[schemars(inner(range(min = -1e4, max = 1e4)))]
    pub offset_mm: [f64; 2],
    /// How a conformal map is made.
    pub conformal: FlattenOptions,
    /// The drawing once more over the first, laid by another mapping: to compare the two on one canvas.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overlay: Option<Overlay>,
}

/// `[canvas.overlay]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Overlay {
    /// How the second drawing is laid on the canvas.
    pub mapping: MappingKind,
    /// Its ink, red, green and blue; orange by default.
    #[serde(default = "Overlay::orange")]
    #[schemars(with = "[u8; 3]")]
    pub color: Rgb,
}

impl Overlay {
    fn orange() -> Rgb {
        Rgb([236, 112, 24])
    }
}

/// `[pen]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PenFile {
    /// A pen, by name or path.
    pub kind: String,
    /// How far the set point lies under the surface. The pen presses with this times the stiffness along it: 3 mm at
    /// 350 N/m is 1.05 N (`delta` of eq. 6.1).
    #[schemars(range(min = 0, max = 100))]
    pub press_depth_mm: f64,
    /// Time that a person takes to change the pen between two inks.
    #[schemars(range(min = 0, max = 3600))]
    pub change_s: f64,
    /// Other pens for some layers: `[pen.inks]` with a line each, a layer's name or a colour, as `sky = "marker"` or
    /// `"#17697a" = "fineliner_04"`.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub inks: BTreeMap<String, String>,
}

impl Default for PenFile {
    fn default() -> Self {
        Self { kind: "fineliner_08".into(), press_depth_mm: 3.0, change_s: 20.0, inks: BTreeMap::new() }
    }
}

/// Bounds of one figure of metrics.json.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Threshold {
    /// The figure may not be below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// The figure may not be above this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
}
