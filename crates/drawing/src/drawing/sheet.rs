//! The drawing as data: the border behind which every file format has been resolved.
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use crate::math::Rgb;

/// One pen stroke: from pen down to pen up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stroke {
    /// Polyline vertices, m, in sheet coordinates; at least two, or one for a dot. A closed stroke repeats its first
    /// point at its end.
    pub points: Vec<Point2<f64>>,
    /// Desired width of the line at each point, m; empty where the pen's own width is desired.
    #[serde(default)]
    pub widths: Vec<f64>,
}

/// The strokes of one ink, in drawing order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InkLayer {
    /// Name of the layer: an Inkscape label, a group's id, or the colour.
    pub name: String,
    /// Colour of the ink.
    pub color: Rgb,
    /// Stroke width the artwork asked for, m: a hint to choose a pen.
    pub width_hint: Option<f64>,
    /// Strokes in drawing order.
    pub strokes: Vec<Stroke>,
}

/// A stroke of a drawing, by its place in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct StrokeRef {
    /// Index of the layer.
    pub layer: usize,
    /// Index of the stroke in the layer.
    pub stroke: usize,
}

/// A drawing on a sheet. Sheet coordinates: metres, x right, y **up**, origin at the sheet's centre, so the sheet
/// covers `[-width/2, width/2] x [-height/2, height/2]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drawing {
    /// Width of the sheet, m.
    pub width: f64,
    /// Height of the sheet, m.
    pub height: f64,
    /// One layer per ink.
    pub layers: Vec<InkLayer>,
    /// The order in which strokes are drawn, where they go back and forth between inks: every stroke once. Empty: layer
    /// after layer, each stroke in its turn.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub order: Vec<StrokeRef>,
}

impl Stroke {
    /// A stroke of the pen's own width through these points, m.
    pub fn new(points: Vec<Point2<f64>>) -> Self {
        Self { points, widths: Vec::new() }
    }

    /// Turns the stroke round, its widths with it.
    pub fn reverse(&mut self) {
        self.points.reverse();
        self.widths.reverse();
    }

    /// Desired width at a point, m; `None` where the pen's own is desired.
    pub fn width_at(&self, point: usize) -> Option<f64> {
        self.widths.get(point).copied()
    }

    /// Length of the polyline, m.
    pub fn length(&self) -> f64 {
        self.points.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
    }
}

impl Drawing {
    /// A drawing of these layers, drawn one after another, on a sheet of this width and height, m.
    pub fn new(width: f64, height: f64, layers: Vec<InkLayer>) -> Self {
        Self { width, height, layers, order: Vec::new() }
    }

    /// Every stroke in the order in which it is drawn.
    pub fn sequence(&self) -> Vec<StrokeRef> {
        if !self.order.is_empty() {
            return self.order.clone();
        }
        let strokes =
            |(layer, l): (usize, &InkLayer)| (0..l.strokes.len()).map(move |stroke| StrokeRef { layer, stroke });
        self.layers.iter().enumerate().flat_map(strokes).collect()
    }

    /// How often the pen is changed from the first stroke to the last.
    pub fn ink_changes(&self) -> usize {
        self.sequence().windows(2).filter(|w| w[0].layer != w[1].layer).count()
    }

    /// Number of strokes in all layers.
    pub fn stroke_count(&self) -> usize {
        self.layers.iter().map(|l| l.strokes.len()).sum()
    }
    /// Number of points in all layers.
    pub fn point_count(&self) -> usize {
        self.layers.iter().flat_map(|l| &l.strokes).map(|s| s.points.len()).sum()
    }
    /// Length of all strokes, m.
    pub fn length(&self) -> f64 {
        self.layers.iter().flat_map(|l| &l.strokes).fold(0.0, |sum, s| sum + s.length())
    }
}
