//! How a picture becomes strokes: the sections of `[drawing]` that a picture as source heeds.
use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The ways from a picture to strokes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Style {
    /// One long line an ink, a short tour through points that lie dense where the picture is dark.
    #[default]
    Tsp,
    /// Those points as dots.
    Stipple,
    /// Curved brush strokes, broad ones first, each where it brings the drawing nearest to the picture.
    Painterly,
    /// Brush strokes object by object: contour first, then from back to front.
    LayeredDepth,
    /// Cross-hatching that follows the forms, and edge lines.
    Hatching,
    /// Edge lines alone.
    Edges,
}

/// How colours become inks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Separation {
    /// One black ink.
    Black,
    /// Cyan, magenta, yellow and black over each other.
    Cmyk,
    /// A palette by k-means.
    Kmeans,
    /// A palette by agglomerative clustering.
    Agglomerative,
    /// A palette by density: as many inks as there are clusters of colour.
    Dbscan,
    /// Those that one owns, in `pens`.
    Pens,
}

/// `[drawing.color]`: how a picture is taken apart into inks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ColorSettings {
    /// How colours become inks. When absent: `kmeans` for brush strokes (painterly and layered_depth), `black` for
    /// all else.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separation: Option<Separation>,
    /// Inks of a palette; with `dbscan` at most.
    #[schemars(range(min = 1, max = 64))]
    pub count: u32,
    /// With `cmyk`: share of the common grey of cyan, magenta and yellow that black ink replaces.
    #[schemars(range(min = 0, max = 1))]
    pub grey_replacement: f64,
    /// Pens that one owns: `[drawing.color.pens]` with a line each, as `teal = "#17697a"`.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub pens: BTreeMap<String, String>,
    /// With `pens` and lines or dots: mix between the nearest pens in place of taking the nearest one. Brush strokes
    /// take the nearest.
    pub dither: bool,
    /// Stretch the picture's own darkest and lightest tones to black and white.
    pub auto_levels: bool,
    /// Level, as in picture editors, at and below which the picture counts as black.
    #[schemars(range(min = 0, max = 0.99))]
    pub black_point: f64,
    /// Level at and above which it counts as white; at least 0.01 above `black_point`.
    #[schemars(range(min = 0.01, max = 1))]
    pub white_point: f64,
    /// Above 1 lightens middle tones, below 1 darkens them.
    #[schemars(range(min = 0.1, max = 10))]
    pub gamma: f64,
}

impl Default for ColorSettings {
    fn default() -> Self {
        Self {
            separation: None,
            count: 4,
            grey_replacement: 0.7,
            pens: BTreeMap::new(),
            dither: false,
            auto_levels: false,
            black_point: 0.0,
            white_point: 1.0,
            gamma: 1.0,
        }
    }
}

/// `[drawing.tsp]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TspSettings {
    /// Points of all inks together; when absent, as many as give the right tone with this pen on this sheet.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 3, max = 10_000_000))]
    pub points: Option<u32>,
    /// End the line where it began.
    pub closed: bool,
    /// Effort of the tour solver, kicks a point; the same tour on every computer.
    #[schemars(range(min = 0, max = 1000))]
    pub kicks: f64,
    /// Time for the tours in place of `kicks`: the tour then depends on the computer.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.01, max = 86_400))]
    pub seconds: Option<f64>,
}

impl Default for TspSettings {
    fn default() -> Self {
        Self { points: None, closed: true, kicks: 1.0, seconds: None }
    }
}

/// `[drawing.stipple]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StippleSettings {
    /// Dots of all inks together; when absent, as many as give the right tone with this pen on this sheet.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 10_000_000))]
    pub dots: Option<u32>,
}

/// `[drawing.painterly]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PainterlySettings {
    /// Most brush strokes.
    #[schemars(range(min = 1, max = 10_000_000))]
    pub strokes: u32,
    /// How long, how curved and how free strokes are.
    pub hand: PainterStyle,
    /// Widths of the brushes, broadest first; when absent they follow from the sheet and the pen. A brush broader
    /// than the pen is a bundle of pen lines.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(inner(range(min = 0.01, max = 10_000)))]
    pub brushes_mm: Vec<f64>,
}

impl Default for PainterlySettings {
    fn default() -> Self {
        Self { strokes: 1500, hand: PainterStyle::Impressionist, brushes_mm: Vec::new() }
    }
}

/// Manners of painting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PainterStyle {
    /// Curved strokes that follow the forms.
    #[default]
    Impressionist,
    /// Long strokes that keep their direction, with paper showing through.
    Expressionist,
    /// Loose strokes of half coverage.
    ColouristWash,
    /// Dots.
    Pointillist,
}

/// `[drawing.layered_depth]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LayeredDepthSettings {
    /// Most brush strokes.
    #[schemars(range(min = 1, max = 10_000_000))]
    pub strokes: u32,
    /// Image of labels, 8 or 16 bit grey or palette: a number an object; estimated when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub labels: Option<PathBuf>,
    /// JSON file that names the labels: `[{"label": 1, "name": "sheep", "kind": "thing", "confidence": 0.97},
    /// {"label": 2, "name": "grass", "kind": "stuff", "order": 1}]`; only with `labels`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segments: Option<PathBuf>,
    /// Image of depth, 8 or 16 bit grey, near is bright; estimated when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<PathBuf>,
    /// ONNX model that gives labels; the program must be built with `--features onnx`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segment_model: Option<PathBuf>,
    /// ONNX model that gives depth; the program must be built with `--features onnx`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_model: Option<PathBuf>,
}

impl LayeredDepthSettings {
    /// The files that are named.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        [&self.labels, &self.segments, &self.depth, &self.segment_model, &self.depth_model].into_iter().flatten()
    }
}

impl Default for LayeredDepthSettings {
    fn default() -> Self {
        Self { strokes: 1500, labels: None, segments: None, depth: None, segment_model: None, depth_model: None }
    }
}

/// `[drawing.hatching]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct HatchingSettings {
    /// Directions that cross each other as the tone darkens.
    #[schemars(range(min = 1, max = 4))]
    pub directions: u32,
    /// How much lines follow the forms: 0 straight, 1 wholly.
    #[schemars(range(min = 0, max = 1))]
    pub follow: f64,
    /// Direction of straight lines, and of the first where a picture is flat, from the x axis.
    #[schemars(range(min = -360, max = 360))]
    pub angle_deg: f64,
    /// Shortest line.
    #[schemars(range(min = 0, max = 1000))]
    pub min_length_mm: f64,
    /// Draw the edge lines too.
    pub edges: bool,
}

impl Default for HatchingSettings {
    fn default() -> Self {
        Self { directions: 4, follow: 1.0, angle_deg: 45.0, min_length_mm: 2.5, edges: true }
    }
}

/// `[drawing.edges]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EdgeSettings {
    /// Size of the finest details that make an edge.
    #[schemars(range(min = 0.01, max = 1000))]
    pub detail_mm: f64,
    /// Contrast of lightness at which an edge begins a line.
    #[schemars(range(min = 0.001, max = 1))]
    pub contrast: f64,
    /// Shortest edge line.
    #[schemars(range(min = 0, max = 1000))]
    pub min_length_mm: f64,
}

impl Default for EdgeSettings {
    fn default() -> Self {
        Self { detail_mm: 0.3, contrast: 0.16, min_length_mm: 4.0 }
    }
}

/// In which order strokes of several inks are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InkOrder {
    /// As the artist made them, changing pens as often as it takes.
    #[default]
    AsMade,
    /// All of one ink, then all of the next, light ones first.
    ByInk,
    /// Few changes of pen, no stroke farther from its turn than `disorder` of all strokes.
    FewestChanges,
}
