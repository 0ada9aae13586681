//! The nominal canvas of a scenario: its scene, and the drawing laid on it by one mapping, or by two over each other.
use nalgebra::{Translation3, UnitQuaternion, Vector3};

use crate::drawing::{Drawing, InkLayer, StrokeRef};
use crate::math::Pose;
use crate::scenario::Scenario;
use crate::surface::{
    Canvas, FlattenError, FlattenReport, MapError, Mapping, MappingKind, Scene, SceneError, SurfaceDrawing, mapping_of,
};

/// Why there is no canvas to draw on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CanvasError {
    /// The scene can't be used.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The canvas can't be flattened for the drawing.
    #[error(transparent)]
    Flatten(#[from] FlattenError),
    /// The drawing doesn't fit on the canvas.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The drawing is larger than all of the canvas.
    #[error(
        "{source}; the whole canvas is {:.1} mm across, the drawing {:.1} x {:.1} mm: is the `scale` of its mesh right?",
        1e3 * across, 1e3 * sheet[0], 1e3 * sheet[1]
    )]
    Small {
        /// What doesn't fit.
        source: MapError,
        /// Diagonal of the box round the canvas, m.
        across: f64,
        /// Width and height of the drawing, m.
        sheet: [f64; 2],
    },
}

/// The scenario's nominal scene. The drawing lies on the sheet as it is; the sheet is moved and turned.
pub fn scene_of(scenario: &Scenario) -> Result<Scene, CanvasError> {
    let mut scene = Scene::read_changed(&scenario.canvas.scene, &scenario.change.scene)?;
    let [x, y] = scenario.canvas.offset_mm.map(|mm| mm * 1e-3);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), scenario.drawing.rotate_deg.to_radians());
    scene.canvas.sheet.world_from_sheet *= Pose::from_parts(Translation3::new(x, y, 0.0), turn);
    Ok(scene)
}

/// The scenario's mapping of a drawing's sheet onto a canvas, and what came of flattening it.
pub fn mapping_onto(
    scenario: &Scenario,
    drawing: &Drawing,
    canvas: &Canvas,
) -> Result<(Box<dyn Mapping>, Option<FlattenReport>), CanvasError> {
    let sheet = [drawing.width, drawing.height];
    Ok(mapping_of(canvas, scenario.canvas.mapping, sheet, &scenario.canvas.conformal)?)
}

/// Adds the layers that are laid by the other mapping, if the scenario asks for them: the drawing once more, in the other
/// colour, drawn after it.
pub fn overlaid(drawing: &mut Drawing, scenario: &Scenario) {
    let Some(overlay) = &scenario.canvas.overlay else { return };
    let n = drawing.layers.len();
    let again = |l: &InkLayer| InkLayer {
        name: format!("{} by {}", l.name, name_of(overlay.mapping)),
        color: overlay.color,
        ..l.clone()
    };
    drawing.layers.extend(drawing.layers.iter().map(again).collect::<Vec<_>>());
    let order = drawing.order.iter().map(|r| StrokeRef { layer: r.layer + n, ..*r });
    drawing.order.extend(order.collect::<Vec<_>>());
}

fn name_of(kind: MappingKind) -> &'static str {
    match kind {
        MappingKind::Conformal => "conformal",
        _ => "projection",
    }
}

/// The layers that are laid by the scenario's own mapping.
pub fn own_layers(drawing: &Drawing, scenario: &Scenario) -> Drawing {
    part(drawing, 0, drawing.layers.len() / if scenario.canvas.overlay.is_some() { 2 } else { 1 })
}

fn part(drawing: &Drawing, from: usize, to: usize) -> Drawing {
    Drawing { layers: drawing.layers[from..to].to_vec(), order: Vec::new(), ..*drawing }
}

/// How strokes are mapped onto a surface at a step: all or an error, or what fits.
pub type MapStrokes = fn(&Drawing, &dyn Mapping, f64) -> Result<SurfaceDrawing, MapError>;

/// The drawing on a canvas: its own layers by `mapping`, those laid over it by the other one.
pub fn mapped(
    scenario: &Scenario,
    drawing: &Drawing,
    canvas: &Canvas,
    mapping: &dyn Mapping,
    step: f64,
    map: MapStrokes,
) -> Result<SurfaceDrawing, CanvasError> {
    let sheet = [drawing.width, drawing.height];
    let (low, high) = canvas.mesh.bounds();
    let across = (high - low).norm();
    let unfit = |source: MapError| match source {
        MapError::OffSurface { .. } if across < sheet[0].max(sheet[1]) => CanvasError::Small { source, across, sheet },
        source => source.into(),
    };
    let Some(overlay) = &scenario.canvas.overlay else { return map(drawing, mapping, step).map_err(unfit) };
    let (other, _) = mapping_of(canvas, overlay.mapping, sheet, &scenario.canvas.conformal)?;
    let n = drawing.layers.len();
    let mut laid = map(&part(drawing, 0, n / 2), mapping, step)?;
    laid.layers.extend(map(&part(drawing, n / 2, n), other.as_ref(), step)?.layers);
    laid.order.clone_from(&drawing.order);
    Ok(laid)
}
