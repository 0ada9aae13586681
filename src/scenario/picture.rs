//! How a picture becomes strokes: the sections of `[drawing]` that a `.png` or `.jpg` source heeds.
use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The ways from a picture to strokes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Style {
    /// One line an ink through points that are dense where the picture is dark.
    #[default]
    Tsp,
    /// Those points as dots.
    Stipple,
    /// Curved brush strokes from broad to fine.
    Painterly,
    /// Brush strokes object by object, contour first, from back to front.
    LayeredDepth,
    /// Cross-hatching along the forms.
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
    /// The pens in `pens`.
    Pens,
}

/// `[drawing.color]`: how a picture is taken apart into inks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ColorSettings {
    /// How colours become inks. When absent: `black` for tsp, stipple, hatching and edges, `kmeans` for painterly and
    /// layered_depth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separation: Option<Separation>,
    /// Inks of a palette by kmeans or agglomerative.
    pub count: u32,
    /// Share of the common grey of cyan, magenta and yellow that black ink replaces, 0 to 1.
    pub grey_replacement: f64,
    /// Pens that one owns: a name each, and its colour `#rrggbb`.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub pens: BTreeMap<String, String>,
    /// Mix between the nearest pens in place of taking the nearest one.
    pub dither: bool,
    /// Stretch the picture's own darkest and lightest tones to black and white.
    pub auto_levels: bool,
    /// Level (0 to 1, as in picture editors) at and below which the picture counts as black.
    pub black_point: f64,
    /// Level at and above which it counts as white.
    pub white_point: f64,
    /// Above 1 lightens middle tones, below 1 darkens them.
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
    /// Points of all inks together; when absent, as many as give the right tone with the pen on the sheet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<u32>,
    /// End the line where it began.
    pub closed: bool,
    /// Kicks of the tour solver, as a multiple of the number of points.
    pub kicks: f64,
    /// Time for the tours, s, in place of `kicks`: the drawing then depends on the computer.
    #[serde(skip_serializing_if = "Option::is_none")]
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
    /// Dots of all inks together; when absent, as many as give the right tone with the pen on the sheet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dots: Option<u32>,
}

/// `[drawing.painterly]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PainterlySettings {
    /// Most brush strokes.
    pub strokes: u32,
    /// Hand: `impressionist`, `expressionist`, `colourist_wash` or `pointillist`.
    pub hand: PainterStyle,
    /// Widths of the brushes, mm, broadest first; when absent they follow from the sheet and the pen.
    #[serde(skip_serializing_if = "Vec::is_empty")]
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
    pub strokes: u32,
    /// Image of labels, 8 or 16 bit; when absent, segments are estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub labels: Option<PathBuf>,
    /// JSON file that names the labels; only with `labels`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segments: Option<PathBuf>,
    /// Image of depth, 8 or 16 bit, near is bright; when absent, depth is estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<PathBuf>,
    /// ONNX model that gives labels; needs the feature `onnx`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segment_model: Option<PathBuf>,
    /// ONNX model that gives depth; needs the feature `onnx`.
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
    /// Directions that cross each other as the tone darkens, 1 to 4.
    pub directions: u32,
    /// How much lines follow the forms: 0 straight, 1 wholly.
    pub follow: f64,
    /// Direction of straight lines, and of the first where a picture is flat, degrees from the x axis.
    pub angle_deg: f64,
    /// Shortest line, mm.
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
    /// Size of the finest details, mm on the sheet.
    pub detail_mm: f64,
    /// Contrast of lightness at which an edge begins a line, 0 to 1.
    pub contrast: f64,
    /// Shortest line, mm.
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
