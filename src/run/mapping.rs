//! The drawing on the true canvas: where the desired line lies, for who measures.
use super::RunError;
use super::setup::Setup;
use crate::canvas::mapping_onto;
use crate::scenario::{BeliefKind, Scenario};
use crate::surface::Mapping;
use crate::truth::Carried;

/// How far beyond the measured distance the true surface is looked for, m.
const CARRY_MARGIN: f64 = 0.01;

/// The scenario's mapping onto the true canvas. A robot that believes in the nominal mesh draws on the object that it knows: where that
/// has another shape, desired places are carried along its normals. What is scanned or touched is the true canvas itself.
pub(super) fn mapping_onto_truth(scenario: &Scenario, setup: &Setup) -> Result<Box<dyn Mapping>, RunError> {
    let (Some(nominal), Some((mapping, reach))) = (setup.truth.unshaped(), meant(scenario, setup)?) else {
        return Ok(mapping_onto(scenario, &setup.drawing, setup.truth.canvas().reveal())?.0);
    };
    Ok(Box::new(Carried::new(mapping, nominal, setup.truth.canvas(), reach)))
}

/// The mapping onto the object as it was meant, and how far from it the true surface lies at most, m.
type Meant = (Box<dyn Mapping>, f64);

/// The object as it was meant, where the robot believes in that and its true shape is another.
pub(super) fn meant(scenario: &Scenario, setup: &Setup) -> Result<Option<Meant>, RunError> {
    let (Some(nominal), BeliefKind::Mesh) = (setup.truth.unshaped(), scenario.canvas.belief) else { return Ok(None) };
    let apart = setup.truth_metrics.as_ref().and_then(|t| t.hausdorff_mm).unwrap_or(0.0) * 1e-3;
    Ok(Some((mapping_onto(scenario, &setup.drawing, nominal)?.0, apart + CARRY_MARGIN)))
}
