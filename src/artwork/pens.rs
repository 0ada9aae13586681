//! Which pen draws which ink.
use std::path::Path;

use super::ArtworkError;
use crate::drawing::{Drawing, InkLayer};
use crate::math::Rgb;
use crate::pen::{LayerPen, PenModel};
use crate::scenario::PenSpec;

/// The pen of each layer.
pub(crate) fn pens(drawing: &Drawing, spec: &PenSpec) -> Result<Vec<LayerPen>, ArtworkError> {
    let pen = |l: &InkLayer| Ok(LayerPen { pen: ink_pen(&l.name, l.color, spec)?, ink: l.name.clone() });
    drawing.layers.iter().map(pen).collect()
}

/// The pen of an ink: by its name, else by its colour, else the scenario's one.
pub(super) fn ink_pen(name: &str, color: Rgb, spec: &PenSpec) -> Result<PenModel, ArtworkError> {
    let [r, g, b] = color.0;
    let file: &Path = spec
        .inks
        .get(name)
        .or_else(|| spec.inks.get(&format!("#{r:02x}{g:02x}{b:02x}")))
        .map_or(&spec.kind, |file| file);
    Ok(PenModel::read(file)?)
}
