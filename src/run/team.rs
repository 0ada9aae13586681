//! The arms of a run as workers, each with its simulation and its policy.
use std::sync::Arc;

use super::RunError;
use super::belief::Believed;
use super::driving::{self, driver};
use super::planning::{self, kits};
use super::setup::Setup;
use crate::exec::Worker;
use crate::mesh::TriMesh;
use crate::plan::{PlanOptions, VisitOrder};
use crate::scenario::{Hold, Scenario, options};
use crate::skill::{Drawer, FetchedPens, PlannedStrokes, TouchJob, TouchStrokes};
use crate::surface::{Mapping, TouchedCanvas};
use crate::twin::{ArmSetup, Feeling, Holding, Simulation, TrueScene};

/// Steps between two touches that the robot looks at: at drawing speed about half a millimetre.
pub(super) const STRIDE: u64 = 10;
/// Share of the force that stops a probe above which the pen is taken to touch.
pub(super) const TOUCHING: f64 = 0.5;

/// All arms, ready to begin, and who waits for whom.
pub(super) struct Team {
    pub workers: Vec<Worker<Box<dyn Drawer>>>,
    pub order: VisitOrder,
    /// The dock of each layer's pen, by layer: index of the arm, index of the dock. Empty where a person changes pens.
    pub places: planning::PenPlaces,
}

/// Puts the arms of a run together; `mapping` leads from the true canvas to the sheet.
pub(super) fn team(
    scenario: &Scenario,
    setup: &Setup,
    believed: &Believed,
    mapping: Box<dyn Mapping>,
) -> Result<Team, RunError> {
    let scene = Arc::new(TrueScene::new(&setup.truth, mapping, setup.pens.clone()));
    let plan_options = Arc::new(options::plan_options(scenario, &setup.pens));
    let drawers = drawers(scenario, setup, believed, &plan_options)?;
    let places = places(scenario, setup, believed)?;
    let policies = if setup.fetches() { fetching(setup, believed, &places, drawers, &plan_options)? } else { drawers };
    let order = believed.planning.as_ref().map_or_else(|| VisitOrder::free(policies.len()), |p| p.order.clone());
    let ground = [setup.obstacles()?.as_slice(), std::slice::from_ref(setup.truth.canvas().mesh())].concat();
    let holding = holding(scenario);
    let mut workers = Vec::new();
    for (i, policy) in policies.into_iter().enumerate() {
        let simulation = simulation(scenario, setup, believed, &scene, i, &places)?;
        workers.push(Worker::new(simulation, policy, holding, ground.clone()));
    }
    Ok(Team { workers, order, places })
}

fn holding(scenario: &Scenario) -> Holding {
    match &scenario.tools {
        Some(tools) if tools.open_after_s.is_some() || tools.hold == Hold::Physics => {
            Holding::Friction(tools.open_after_s)
        }
        _ => Holding::Rigid,
    }
}

fn simulation(
    scenario: &Scenario,
    setup: &Setup,
    believed: &Believed,
    scene: &Arc<TrueScene>,
    index: usize,
    places: &planning::PenPlaces,
) -> Result<Simulation, RunError> {
    let arm = &setup.cell.arms[index];
    let gripper = setup.truth.gripper(index).cloned();
    let bare = setup.kits[index].as_ref().map(|k| k.bare.clone());
    let first = match &believed.prepared.driving {
        Some(driving) => driving.strokes.iter().flatten().next().map_or(0, |r| r.layer),
        None => believed.prepared.drawing.sequence().first().map_or(0, |r| r.layer),
    };
    let layer = if places.is_empty() { first } else { places.iter().position(|(a, _)| *a == index).unwrap_or(0) };
    let arm_setup = ArmSetup {
        index,
        model: gripper.as_ref().map_or_else(|| arm.model.clone(), |g| g.bare()),
        believed: bare.unwrap_or_else(|| arm.model.clone()),
        start: arm.home,
        layer,
        gripper,
        colors: setup.drawing.layers.iter().map(|l| l.color).collect(),
    };
    if arm.base.is_some() {
        return driving::on_base(scenario, setup, arm_setup, Arc::clone(scene));
    }
    let twin = options::twin_options(scenario);
    let mut simulation = Simulation::new(arm_setup, Arc::clone(scene), options::law(scenario), &twin)?;
    if let Some(touch) = &scenario.touch {
        let contact_force = TOUCHING * touch.contact_n;
        simulation.feel(Feeling { force_noise: touch.force_noise_n, contact_force, stride: STRIDE }, index);
    }
    Ok(simulation)
}

/// Who draws the strokes: planned ahead, or by touch. One an arm.
fn drawers(
    scenario: &Scenario,
    setup: &Setup,
    believed: &Believed,
    options: &Arc<PlanOptions>,
) -> Result<Vec<Box<dyn Drawer>>, RunError> {
    if let Some(driving) = &believed.prepared.driving {
        return Ok(vec![Box::new(driver(scenario, setup, believed, driving, options)?)]);
    }
    if scenario.touch.is_some() {
        return Ok(vec![Box::new(by_touch(scenario, setup, options)?)]);
    }
    let Some(planning) = &believed.planning else { return Ok(Vec::new()) };
    let planned = |timelines: &Vec<Vec<_>>| -> Box<dyn Drawer> {
        Box::new(PlannedStrokes::new(timelines.clone(), Arc::clone(&believed.canvas)))
    };
    Ok(planning.timelines.iter().map(planned).collect())
}

fn by_touch(scenario: &Scenario, setup: &Setup, options: &Arc<PlanOptions>) -> Result<TouchStrokes, RunError> {
    let Some(touch) = &scenario.touch else { return Err(RunError::WhileDrawing) };
    let arm = &setup.cell.arms[0];
    let half = nalgebra::Vector2::new(0.5 * setup.drawing.width, 0.5 * setup.drawing.height);
    let most = half + nalgebra::Vector2::repeat(touch.margin_mm * 1e-3);
    let extent = [nalgebra::Point2::from(-most), nalgebra::Point2::from(most)];
    let canvas = TouchedCanvas::new(setup.scene.canvas.sheet.clone(), extent, touch.spacing_mm * 1e-3);
    let mut obstacles = setup.obstacles()?;
    let fetches = setup.fetches();
    let model = match (fetches, setup.kits.first().and_then(Option::as_ref)) {
        (true, Some(kit)) => {
            obstacles.extend(kit.solids(None).map_err(RunError::Tool)?);
            planning::holding(setup, &kits(setup)?)?.remove(0)
        }
        _ => arm.model.clone(),
    };
    let job = TouchJob {
        drawing: setup.drawing.clone(),
        canvas,
        arm: Arc::new(model),
        home: arm.home,
        service: if fetches { arm.home } else { arm.service },
        obstacles: Arc::new(obstacles),
        options: Arc::clone(options),
        touch: options::touch_options(scenario, touch),
        springs: setup.pens.iter().map(|p| p.pen.spring.stiffness).collect(),
        by_hand: !fetches,
    };
    Ok(TouchStrokes::new(job)?)
}

/// Which arm draws with the ink of each layer, and which dock of it the pen stands in: as planned, if it was.
fn places(scenario: &Scenario, setup: &Setup, believed: &Believed) -> Result<planning::PenPlaces, RunError> {
    match (&believed.planning, &scenario.tools) {
        (Some(planning), _) => Ok(planning.places.clone()),
        (None, Some(tools)) if setup.fetches() => planning::assign(setup, &kits(setup)?, tools),
        _ => Ok(Vec::new()),
    }
}

/// Has the pens fetched for those who draw.
fn fetching(
    setup: &Setup,
    believed: &Believed,
    places: &planning::PenPlaces,
    drawers: Vec<Box<dyn Drawer>>,
    options: &Arc<PlanOptions>,
) -> Result<Vec<Box<dyn Drawer>>, RunError> {
    let kits = kits(setup)?;
    let models = planning::holding(setup, &kits)?;
    let obstacles: Vec<Vec<TriMesh>> = planning::obstacles(setup, believed, &kits, &models)?;
    let docks: Vec<usize> = places.iter().map(|p| p.1).collect();
    let mut policies: Vec<Box<dyn Drawer>> = Vec::new();
    for ((drawer, kit), around) in drawers.into_iter().zip(setup.kits.iter().flatten()).zip(obstacles) {
        policies.push(Box::new(FetchedPens::new(drawer, Arc::clone(kit), docks.clone(), around, Arc::clone(options))?));
    }
    Ok(policies)
}
