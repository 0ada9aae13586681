//! The camera on the hand of an arm that drives, and what its robot knows of it.
use nalgebra::Point2;

use super::RunError;
use super::belief::Believed;
use super::setup::Setup;
use super::team::{STRIDE, TOUCHING};
use crate::camera::HandCamera;
use crate::canvas::mapping_onto;
use crate::drawing::Stroke;
use crate::ink::{InkPoint, InkStroke};
use crate::scenario::{LookingSettings, Scenario};
use crate::skill::LookOptions;
use crate::surface::map_drawing;
use crate::twin::{Feeling, Simulation, TrueScene};

/// Spacing of the points of a printed line, m.
const MARK_STEP: f64 = 1e-3;

/// Gives an arm its camera, and what it feels with.
pub(super) fn equip(simulation: &mut Simulation, scenario: &Scenario, setup: &Setup, scene: &TrueScene) {
    let Some(looking) = &scenario.looking else { return };
    let index = simulation.index();
    let built = looking.built(&setup.cell.arms[index].last_from_flange);
    let printed = printed(looking, setup, scene);
    simulation.see_with(HandCamera::new(built, printed, scenario.seed, index as u64));
    if looking.feel {
        let contact_force = TOUCHING * looking.feel_n;
        simulation.feel(Feeling { force_noise: looking.force_noise_n, contact_force, stride: STRIDE }, index);
    }
}

/// How the base aligns itself, as the robot knows it.
pub(super) fn options(
    scenario: &Scenario,
    setup: &Setup,
    believed: &Believed,
) -> Result<Option<LookOptions>, RunError> {
    let Some(settings) = &scenario.looking else { return Ok(None) };
    let marks = match settings.marks([setup.drawing.width, setup.drawing.height]) {
        Some(crosses) => {
            let (mapping, _) = mapping_onto(scenario, &crosses, &believed.canvas)?;
            Some(map_drawing(&crosses, mapping.as_ref(), MARK_STEP)?)
        }
        None => None,
    };
    let (widths, springs) = setup.pens.iter().map(|p| (p.pen.width_nominal, p.pen.spring.stiffness)).unzip();
    Ok(Some(settings.options(&setup.cell.arms[0].last_from_flange, widths, springs, marks)))
}

/// The printed crosses as ink on the true canvas.
fn printed(settings: &LookingSettings, setup: &Setup, scene: &TrueScene) -> Vec<InkStroke> {
    let Some(crosses) = settings.marks([setup.drawing.width, setup.drawing.height]) else { return Vec::new() };
    let width = setup.pens.first().map_or(5e-4, |p| p.pen.width_nominal);
    let line = |s: &Stroke| {
        let count = (s.length() / MARK_STEP).ceil().max(1.0) as usize;
        let at = |i: usize| s.points[0] + (s.points[1] - s.points[0]) * (i as f64 / count as f64);
        let point = |sheet: Point2<f64>| {
            let p = scene.mapping.to_surface(&sheet)?;
            Some(InkPoint { position: p.position, normal: p.normal, sheet, width, density: 1.0, time: 0.0 })
        };
        InkStroke { ink: 0, stroke: None, arm: 0, points: (0..=count).filter_map(|i| point(at(i))).collect() }
    };
    crosses.layers[0].strokes.iter().map(line).collect()
}
