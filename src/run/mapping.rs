//! The drawing mapped onto a canvas, as the scenario asks: by one mapping, or by two over each other.
use super::RunError;
use super::setup::Setup;
use crate::drawing::{Drawing, InkLayer, StrokeRef};
use crate::scenario::{BeliefKind, Scenario};
use crate::surface::{Canvas, FlattenReport, MapError, Mapping, MappingKind, SurfaceDrawing, mapping_of};
use crate::truth::Carried;

/// Adds the layers that are laid by the other mapping, if the scenario asks for them: the drawing once more, in the other
/// colour, drawn after it.
pub(super) fn overlaid(drawing: &mut Drawing, scenario: &Scenario) {
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
pub(super) fn own_layers(drawing: &Drawing, scenario: &Scenario) -> Drawing {
    part(drawing, 0, drawing.layers.len() / if scenario.canvas.overlay.is_some() { 2 } else { 1 })
}

fn part(drawing: &Drawing, from: usize, to: usize) -> Drawing {
    Drawing { layers: drawing.layers[from..to].to_vec(), order: Vec::new(), ..*drawing }
}

/// The scenario's mapping of a drawing's sheet onto a canvas, and what came of flattening it.
pub(crate) fn mapping_onto(
    scenario: &Scenario,
    drawing: &Drawing,
    canvas: &Canvas,
) -> Result<(Box<dyn Mapping>, Option<FlattenReport>), RunError> {
    let sheet = [drawing.width, drawing.height];
    Ok(mapping_of(canvas, scenario.canvas.mapping, sheet, &scenario.canvas.conformal)?)
}

/// How strokes are mapped onto a surface at a step: all or an error, or what fits.
type MapStrokes = fn(&Drawing, &dyn Mapping, f64) -> Result<SurfaceDrawing, MapError>;

/// How far beyond the measured distance the true surface is looked for, m.
const CARRY_MARGIN: f64 = 0.01;

/// The scenario's mapping onto the true canvas. A robot that believes in the nominal mesh draws on the object that it knows: where that
/// has another shape, desired places are carried along its normals. What is scanned or touched is the true canvas itself.
pub(super) fn mapping_onto_truth(scenario: &Scenario, setup: &Setup) -> Result<Box<dyn Mapping>, RunError> {
    let (Some(nominal), BeliefKind::Mesh) = (setup.truth.unshaped(), scenario.canvas.belief) else {
        return Ok(mapping_onto(scenario, &setup.drawing, setup.truth.canvas().reveal())?.0);
    };
    let apart = setup.truth_metrics.as_ref().and_then(|t| t.hausdorff_mm).unwrap_or(0.0) * 1e-3;
    let (mapping, _) = mapping_onto(scenario, &setup.drawing, nominal)?;
    Ok(Box::new(Carried::new(mapping, nominal, setup.truth.canvas(), apart + CARRY_MARGIN)))
}

/// The drawing on a canvas: its own layers by `mapping`, those laid over it by the other one.
pub(super) fn mapped(
    scenario: &Scenario,
    drawing: &Drawing,
    canvas: &Canvas,
    mapping: &dyn Mapping,
    step: f64,
    map: MapStrokes,
) -> Result<SurfaceDrawing, RunError> {
    let Some(overlay) = &scenario.canvas.overlay else { return Ok(map(drawing, mapping, step)?) };
    let sheet = [drawing.width, drawing.height];
    let (other, _) = mapping_of(canvas, overlay.mapping, sheet, &scenario.canvas.conformal)?;
    let n = drawing.layers.len();
    let mut laid = map(&part(drawing, 0, n / 2), mapping, step)?;
    laid.layers.extend(map(&part(drawing, n / 2, n), other.as_ref(), step)?.layers);
    laid.order.clone_from(&drawing.order);
    Ok(laid)
}
