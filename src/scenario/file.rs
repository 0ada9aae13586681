//! The scenario as typed.
use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::math::Rgb;
use crate::surface::{FlattenOptions, MappingKind};

use super::coverage::CoverageSettings;
use super::drive::DriveSettings;
use super::localisation::LocalisationSettings;
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
    /// Seed of every random number of the run.
    #[serde(default = "ScenarioFile::default_seed")]
    pub seed: u64,
    /// A robot by name (`robots/NAME.toml` of an asset folder) or by path.
    #[serde(default = "ScenarioFile::default_robot")]
    pub robot: String,
    /// Which arm draws, by its name in the robot's file, of a robot of several. The others stand still in their
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

    /// The JSON schema of scenario files, for editors.
    pub fn schema() -> serde_json::Value {
        schemars::schema_for!(ScenarioFile).to_value()
    }
}

/// `[drawing]`: a file or a pattern, and how large.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DrawingFile {
    /// An `.svg`, the recording of a stylus `.jsonl`, one of the stroke text files `NAME_k.txt`, `NAME_c.txt`, ..., or a
    /// picture, `.png` or `.jpg`; relative to the scenario's folder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Height of the drawing, mm. With both height and width the drawing is fitted into them; with neither it keeps
    /// its own size.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_mm: Option<f64>,
    /// Width of the drawing, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width_mm: Option<f64>,
    /// Turns the drawing counter-clockwise on the sheet, degrees.
    pub rotate_deg: f64,
    /// What becomes of filled areas.
    pub fill: Fill,
    /// Distance between hatch lines, mm, when `fill = "hatch"`.
    pub hatch_spacing_mm: f64,
    /// Direction of hatch lines, degrees from the x axis, when `fill = "hatch"`.
    pub hatch_angle_deg: f64,
    /// Width of a stylus's line at no and at full pressure, mm; what the pen can draw when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stylus_width_mm: Option<[f64; 2]>,
    /// Exponent of the pressure in that: above 1, light strokes are finer.
    pub stylus_gamma: f64,
    /// Merge strokes that meet, and order them for short ways with the pen up.
    pub tidy: bool,
    /// Ends of strokes nearer than this are joined, mm.
    pub merge_mm: f64,
    /// Points are left out while the line moves less than this, mm.
    pub simplify_mm: f64,
    /// In which order strokes of several inks are drawn.
    pub ink_order: InkOrder,
    /// With `ink_order = "fewest_changes"`: how far from its turn a stroke may be drawn, as a share of all strokes.
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
    /// Squares a side of a `grid`, 1 to 200; 7 when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n: Option<u32>,
    /// Order of a curve: `hilbert` 1 to 8 (5 when absent), `arrowhead` 1 to 9 (6), `snowflake` 0 to 7 (4).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<u32>,
}

/// `[canvas]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CanvasFile {
    /// A scene by name (`scenes/NAME.toml` of an asset folder) or by path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// How the sheet is laid on the canvas.
    pub mapping: MappingKind,
    /// What the robot knows of the canvas.
    pub belief: BeliefKind,
    /// Moves the drawing right and up on the sheet, mm.
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
    /// Its ink.
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
    /// A pen by name (`pens/NAME.toml` of an asset folder) or by path.
    pub kind: String,
    /// How far the set point lies under the surface, mm: `delta` of eq. 6.1.
    pub press_depth_mm: f64,
    /// Time that a person takes to change the pen between two inks, s.
    pub change_s: f64,
    /// Other pens for some layers: a layer's name or a colour `#rrggbb`, to a pen.
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
