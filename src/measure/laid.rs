//! How a mapping lays a drawing on a canvas, stroke by stroke: the content of distortion.json.
use serde::Serialize;

use crate::drawing::Drawing;
use crate::mesh::Distortion;
use crate::surface::{FlattenReport, StretchField, SurfaceDrawing};

/// The lengths of one stroke.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LaidStroke {
    /// Name of its layer.
    pub layer: String,
    /// Its index in the layer.
    pub stroke: usize,
    /// Length on the sheet, m.
    pub desired_m: f64,
    /// Length on the canvas, m, along its targets.
    pub laid_m: f64,
}

/// How a mapping lays a drawing on a canvas.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Laid {
    /// `projection` or `conformal`.
    pub kind: String,
    /// How the canvas stretches the drawing's rectangle; absent where it has no surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drawing: Option<Distortion>,
    /// What came of flattening the canvas, where it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flattened: Option<FlattenReport>,
    /// The strokes, in the order of the drawing.
    pub strokes: Vec<LaidStroke>,
}

impl Laid {
    /// Puts together what is known of a mapping.
    pub fn new(
        kind: &str,
        drawing: &Drawing,
        mapped: &SurfaceDrawing,
        field: &StretchField,
        flattened: Option<&FlattenReport>,
    ) -> Self {
        Self {
            kind: kind.into(),
            drawing: field.distortion(),
            flattened: flattened.cloned(),
            strokes: laid_strokes(drawing, mapped),
        }
    }
}

/// The lengths of all strokes that lie on the canvas.
pub fn laid_strokes(drawing: &Drawing, mapped: &SurfaceDrawing) -> Vec<LaidStroke> {
    let mut strokes = Vec::new();
    for (flat, laid) in drawing.layers.iter().zip(&mapped.layers) {
        for stroke in &laid.strokes {
            let Some(desired) = flat.strokes.get(stroke.index) else { continue };
            let laid_m = stroke.targets.windows(2).map(|w| (w[1].position - w[0].position).norm()).sum();
            strokes.push(LaidStroke {
                layer: flat.name.clone(),
                stroke: stroke.index,
                desired_m: desired.length(),
                laid_m,
            });
        }
    }
    strokes
}
