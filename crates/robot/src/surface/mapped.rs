//! A drawing laid on a surface.
use nalgebra::{Point2, Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::drawing::StrokeRef;
use crate::math::Rgb;
use crate::mesh::SurfacePoint;

/// A map between the sheet and a surface. Projection is one; conformal maps are another.
pub trait Mapping: Send + Sync {
    /// The surface point under a sheet point (m, sheet coordinates), or `None` where the surface has none.
    fn to_surface(&self, sheet: &Point2<f64>) -> Option<SurfacePoint>;
    /// The sheet point (m) over a point on, or very near, the surface (world, m), or `None` outside the chart.
    fn to_sheet(&self, world: &Point3<f64>) -> Option<Point2<f64>>;
    /// `"projection"`, `"conformal"`: the name in scenarios and metrics.
    fn kind(&self) -> &'static str;
}

/// A desired pen-tip contact point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceTarget {
    /// World position on the surface, m.
    pub position: Point3<f64>,
    /// Smooth outward unit normal there; the pen axis is its opposite.
    pub normal: Vector3<f64>,
    /// The same point on the sheet, m.
    pub sheet: Point2<f64>,
    /// Desired width of the line there, m; `None` where the pen's own is desired.
    #[serde(default)]
    pub width: Option<f64>,
}

/// One stroke on the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceStroke {
    /// Index of the stroke within its layer of the [`crate::drawing::Drawing`].
    pub index: usize,
    /// Targets in drawing order, at most the mapping's step apart; corners of the artwork are kept as points.
    pub targets: Vec<SurfaceTarget>,
}

/// The strokes of one ink on the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceLayer {
    /// Name of the layer.
    pub name: String,
    /// Colour of its ink.
    pub color: Rgb,
    /// Strokes in drawing order.
    pub strokes: Vec<SurfaceStroke>,
}

/// A drawing laid on a surface: the desired line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceDrawing {
    /// One layer per ink.
    pub layers: Vec<SurfaceLayer>,
    /// The order of drawing, by the places of strokes in the flat drawing; empty: layer after layer.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub order: Vec<StrokeRef>,
}

impl SurfaceDrawing {
    /// Layer, and position in the layer's list, of every stroke in the order in which it is drawn.
    pub fn sequence(&self) -> Vec<(usize, usize)> {
        if self.order.is_empty() {
            return (0..self.layers.len())
                .flat_map(|l| (0..self.layers[l].strokes.len()).map(move |s| (l, s)))
                .collect();
        }
        // strokes that have no points on the canvas are left out of the lists, so places differ
        let place = |r: &StrokeRef| {
            let strokes = &self.layers.get(r.layer)?.strokes;
            Some((r.layer, strokes.binary_search_by_key(&r.stroke, |s| s.index).ok()?))
        };
        self.order.iter().filter_map(place).collect()
    }
}
