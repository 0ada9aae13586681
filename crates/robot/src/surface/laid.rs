//! How a sheet is laid on a canvas: the choice of mapping, made in one place.
use nalgebra::{Matrix2, Point2};
use serde::{Deserialize, Serialize};

use super::canvas::Canvas;
use super::conformal::{ConformalMap, FlattenError, FlattenOptions, FlattenReport};
use super::mapped::Mapping;
use super::projection::Projection;
use crate::mesh::{Distortion, Stretch, SurfacePoint};

/// Cells along the longer side of the drawing in which a mapping is measured.
const CELLS: usize = 200;
/// Half the distance over which a mapping's differential is measured, m.
const REACH: f64 = 5e-5;

/// How a drawing is laid on a canvas.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum MappingKind {
    /// Orthographic projection along the sheet's normal.
    #[default]
    Projection,
    /// Conformal map: the canvas is flattened so that angles are kept.
    Conformal,
}

/// The mapping of a sheet of size `sheet` (width, height, m) onto a canvas, and what came of flattening it if it was.
/// `options` count for conformal maps alone.
///
/// # Errors
/// A canvas that can't be flattened; see [`FlattenError`].
pub fn mapping_of(
    canvas: &Canvas,
    kind: MappingKind,
    sheet: [f64; 2],
    options: &FlattenOptions,
) -> Result<(Box<dyn Mapping>, Option<FlattenReport>), FlattenError> {
    match kind {
        MappingKind::Projection => Ok((Box::new(Projection::new(canvas)), None)),
        MappingKind::Conformal => {
            let (map, report) = ConformalMap::new(canvas, sheet, options)?;
            Ok((Box::new(map), Some(report)))
        }
    }
}

/// How a mapping stretches the drawing's rectangle, cell by cell.
#[derive(Clone, Debug)]
pub struct StretchField {
    /// Cells along x.
    pub columns: usize,
    /// Cells along y.
    pub rows: usize,
    /// Size of a cell, m.
    pub cell: [f64; 2],
    /// The stretch at each cell's centre, row by row from the lower left; `None` where there is no surface.
    pub cells: Vec<Option<Stretch>>,
}

impl StretchField {
    /// Measures any mapping over a sheet of size `sheet` (width, height, m), by central differences: so that mappings of
    /// every kind are measured alike.
    pub fn of(mapping: &dyn Mapping, sheet: [f64; 2]) -> Self {
        let longest = sheet[0].max(sheet[1]);
        let count = |side: f64| ((CELLS as f64 * side / longest).ceil() as usize).clamp(1, CELLS);
        let (columns, rows) = (count(sheet[0]), count(sheet[1]));
        let cell = [sheet[0] / columns as f64, sheet[1] / rows as f64];
        let area = cell[0] * cell[1];
        let cells = (0..rows * columns)
            .map(|i| {
                let at = |i: usize, axis: usize| (i as f64 + 0.5) * cell[axis] - 0.5 * sheet[axis];
                let center = Point2::new(at(i % columns, 0), at(i / columns, 1));
                differential(mapping, &center).map(|m| Stretch::of(&m, area))
            })
            .collect();
        Self { columns, rows, cell, cells }
    }

    /// Figures over the whole drawing; `None` where it has no surface at all.
    pub fn distortion(&self) -> Option<Distortion> {
        let pieces: Vec<Stretch> = self.cells.iter().flatten().copied().collect();
        Distortion::of(&pieces)
    }
}

/// The differential of a mapping at a sheet point, in the surface's tangent plane: its singular values are those of the
/// 3 x 2 Jacobian. `None` where there is no surface, or an edge where it jumps.
fn differential(mapping: &dyn Mapping, at: &Point2<f64>) -> Option<Matrix2<f64>> {
    let middle: SurfacePoint = mapping.to_surface(at)?;
    let along = |d: nalgebra::Vector2<f64>| {
        let (a, b) = (mapping.to_surface(&(at - d))?, mapping.to_surface(&(at + d))?);
        let near = |p: &SurfacePoint| (p.position - middle.position).norm() < 20.0 * REACH;
        (near(&a) && near(&b)).then(|| (b.position - a.position) / (2.0 * REACH))
    };
    let (u, v) = (along(nalgebra::Vector2::new(REACH, 0.0))?, along(nalgebra::Vector2::new(0.0, REACH))?);
    // the upper triangle of the QR factors of [u v], which has the same singular values
    let length = u.norm();
    let shear = u.dot(&v) / length;
    let rise = u.cross(&v).norm() / length;
    (length > 0.0 && rise.is_finite() && rise > 0.0).then(|| Matrix2::new(length, shear, 0.0, rise))
}
