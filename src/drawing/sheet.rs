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

/// A drawing on a sheet. Sheet coordinates: metres, x right, y **up**, origin at the sheet's centre, so the sheet
/// covers `[-width/2, width/2] x [-height/2, height/2]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drawing {
    /// Width of the sheet, m.
    pub width: f64,
    /// Height of the sheet, m.
    pub height: f64,
    /// One layer per ink, in drawing order.
    pub layers: Vec<InkLayer>,
}

impl Stroke {
    /// Length of the polyline, m.
    pub fn length(&self) -> f64 {
        self.points.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
    }
}

impl Drawing {
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
        self.layers.iter().flat_map(|l| &l.strokes).map(Stroke::length).sum()
    }
}
