//! Carrying out what is planned, and measuring what was drawn.
use std::time::Instant;

use super::RunError;
use super::belief::Believed;
use super::mapping::{mapping_onto_truth, meant};
use super::planning::{PenPlaces, holding, kits};
use super::setup::Setup;
use super::team::{Team, team};
use crate::canvas::{mapped, mapping_onto, own_layers};
use crate::exec::{self, ArmStop, Both, Counter, Distances, Done, Journal, Listener};
use crate::ink::{InkTrace, TraceInk};
use crate::measure::{
    BeliefMetrics, ContactMetrics, LineMetrics, LookMetrics, MappingMetrics, Metrics, PlanMetrics, ShapeMetrics,
    SimMetrics, StrokeHeights, Touchable, grid_shape, line_fit, side_errors, tip_error, tool_metrics, width_error,
};
use crate::plan::{Plan, ReachReport};
use crate::progress::Progress;
use crate::scenario::{Artwork, Pattern, Scenario};
use crate::skill::{Aligned, Drawer, TouchStrokes};
use crate::surface::{BelievedCanvas, Mapping, Projection, SurfaceDrawing, map_drawing, map_what_fits};
use crate::twin::grasp::{ChangeRecord, Snapshot};
use crate::twin::{ArmStory, Record};

/// Spacing at which the desired line is known when the drawn one is measured, m.
const MEASURE_STEP: f64 = 2.5e-4;

/// What was done, and its figures.
pub(super) struct Performance {
    pub metrics: Metrics,
    /// All motion, as it was desired, in the time of the run.
    pub plan: Plan,
    pub record: Record,
    /// Tool changes of each arm.
    pub changes: Vec<Vec<ChangeRecord>>,
    /// How hand and tool stood when a lost pen had fallen, by arm.
    pub lost: Vec<Vec<Snapshot>>,
    /// The dock of each layer's pen: index of the arm, index of the dock.
    pub places: PenPlaces,
    /// Arms that gave up before all was drawn.
    pub stops: Vec<Option<ArmStop>>,
    /// What was learned by touch.
    pub touched: Option<Touched>,
    /// What a base found out of its places.
    pub aligned: Vec<Aligned>,
    /// Why the run ended before all was drawn.
    pub stopped: Option<String>,
    /// Whether a listener stopped it.
    pub interrupted: bool,
}

/// What a robot has learned by touch.
pub(super) struct Touched {
    pub belief: BelievedCanvas,
    /// How well heights were predicted, stroke by stroke.
    pub heights: Vec<StrokeHeights>,
}

/// Carries out a scenario of which all is known that is known beforehand. The one way from plan to figures: with or without files
/// afterwards.
pub(super) fn perform(
    scenario: &Scenario,
    setup: &Setup,
    believed: &Believed,
    journal: Option<&Journal>,
    listener: &dyn Listener,
    progress: &dyn Progress,
) -> Result<Performance, RunError> {
    let Team { mut workers, order, places } = team(scenario, setup, believed, mapping_onto_truth(scenario, setup)?)?;
    if let Some(journal) = journal {
        workers.iter_mut().try_for_each(|w| w.resume(journal))?;
    }
    let started = Instant::now();
    let counter = counter(scenario, setup, believed, progress);
    let done = exec::execute(workers, &order, &Both([&counter, listener]), journal)?;
    let seconds = started.elapsed().as_secs_f64();
    let performance = conclude(scenario, setup, believed, done, seconds, progress)?;
    Ok(Performance { places, ..performance })
}

/// The least distances of all pairs of arms; refused where the plan brings two arms nearer than they may.
fn distances<P>(scenario: &Scenario, setup: &Setup, plan: &Plan, done: &[Done<P>]) -> Result<Distances, RunError> {
    let distances = Distances::of(&holding(setup, &kits(setup)?)?, plan, done);
    let margin_mm = scenario.tools.as_ref().map_or(0.0, |t| t.margin_mm);
    match distances.planned_within(margin_mm * 1e-3) {
        Some(n) => Err(RunError::TooNear { distance_mm: n.distance * 1e3, time: n.time, margin_mm }),
        None => Ok(distances),
    }
}

/// Puts together what all arms did.
fn conclude(
    scenario: &Scenario,
    setup: &Setup,
    believed: &Believed,
    done: Vec<Done<Box<dyn Drawer>>>,
    seconds: f64,
    progress: &dyn Progress,
) -> Result<Performance, RunError> {
    let mut metrics = Metrics::new(&scenario.name, scenario.seed);
    metrics.drawing = Some(believed.prepared.metrics.clone());
    metrics.belief = believed.belief_metrics();
    metrics.coverage = believed.prepared.driving.as_ref().map(|d| d.found.metrics());
    metrics.mapping = believed.mapped.as_ref().map(|m| m.metrics.clone());
    let arms = done.iter().zip(&setup.cell.arms).enumerate().map(|(i, (d, arm))| {
        let planned: Vec<_> = believed.planning.iter().flat_map(|p| &p.timelines[i]).flatten().collect();
        d.plan(i, &planned, arm.base.as_ref().map_or(&arm.home, |b| &b.transport))
    });
    let plan = Plan { arms: arms.collect() };
    let near = if setup.fetches() { Some(distances(scenario, setup, &plan, &done)?) } else { None };
    let touched = match done.first().and_then(|d| d.policy.touched()) {
        Some(touch) => Some(learned(scenario, setup, touch, &plan, &mut metrics)?),
        None => {
            let (planning, driven) = (believed.planning.as_ref(), done.first().and_then(|d| d.policy.driven()));
            let none = ReachReport::default();
            let on_the_way = driven.map_or((&none, 0.0), |d| (d.reach(), d.planning()));
            let (reach, seconds) = planning.map_or(on_the_way, |p| (&p.reach, p.seconds));
            metrics.plan = Some(PlanMetrics::of(&plan, reach, seconds));
            None
        }
    };
    if let Some(near) = near {
        metrics.tool = Some(tool_metrics(&done, near, scenario.tools.is_some()));
    }
    let aligned = done.first().and_then(|d| d.policy.driven()).map_or_else(Vec::new, |d| d.aligned().to_vec());
    metrics.look = scenario.looking.as_ref().map(|_| LookMetrics::of(&aligned));
    let stops: Vec<Option<ArmStop>> = done.iter().map(|d| d.stop.clone()).collect();
    let stopped = stops.iter().flatten().map(ToString::to_string).next();
    let interrupted = done.iter().any(|d| d.interrupted);
    let (mut stories, mut changes, mut lost) = (Vec::new(), Vec::new(), Vec::new());
    let period = 1.0 / scenario.sim.record_hz;
    for (d, arm) in done.into_iter().zip(&setup.cell.arms) {
        changes.push(d.log.changes.clone());
        lost.push(d.log.lost.clone());
        stories.push(ArmStory {
            name: arm.model.name.clone(),
            joints: arm.model.joints.iter().map(|j| j.name.clone()).collect(),
            sample_period: period,
            log: d.log,
            ending: d.ending,
        });
    }
    let inks = setup.drawing.layers.iter().zip(&setup.pens);
    let inks = inks.map(|(l, p)| TraceInk { name: p.ink.clone(), color: l.color }).collect();
    let record = Record::of(stories, inks, seconds);
    progress.stage("measuring", None);
    measure(scenario, setup, &record, &mut metrics)?;
    if let Some(driving) = &believed.prepared.driving {
        driving.measure(setup, &record, &mut metrics);
    }
    let places = Vec::new();
    Ok(Performance { metrics, plan, record, changes, lost, places, stops, touched, aligned, stopped, interrupted })
}

/// Figures of what was learned by touch.
fn learned(
    scenario: &Scenario,
    setup: &Setup,
    touch: &TouchStrokes,
    plan: &Plan,
    metrics: &mut Metrics,
) -> Result<Touched, RunError> {
    let belief = touch.believed()?;
    let heights: Vec<StrokeHeights> = touch
        .touches()
        .iter()
        .filter_map(|t| StrokeHeights::of(t.layer, t.stroke, t.time, t.known, t.errors.iter().copied()))
        .collect();
    let size = [setup.drawing.width, setup.drawing.height];
    let figures = BeliefMetrics {
        points: Some(touch.known()),
        probes: Some(touch.met_probes()),
        ..BeliefMetrics::of("touch", setup.truth.canvas(), &belief, size)
    };
    metrics.belief = Some(figures.with_heights(&heights));
    let started = Instant::now();
    let mapping = Projection::new(&belief);
    let mapped = map_drawing(&setup.drawing, &mapping, scenario.plan.step_mm * 1e-3)?;
    let seconds = started.elapsed().as_secs_f64();
    metrics.mapping = Some(MappingMetrics::of(mapping.kind(), &setup.drawing, &mapped, seconds));
    metrics.plan = Some(PlanMetrics::of(plan, touch.reach(), touch.planning()));
    Ok(Touched { belief, heights })
}

/// The figures of what was drawn, but for pictures.
fn measure(scenario: &Scenario, setup: &Setup, record: &Record, metrics: &mut Metrics) -> Result<(), RunError> {
    metrics.digest = Some(record.digest.clone());
    metrics.sim = Some(SimMetrics::of(record, scenario.sim.plant));
    metrics.contact = Some(ContactMetrics::of(record));
    metrics.truth = setup.truth_metrics.clone();
    // the desired line lies where the drawing falls on the true canvas, which may have gaps and steps
    let mapping = mapping_onto_truth(scenario, setup)?;
    let truth = setup.truth.canvas().reveal();
    let desired = mapped(scenario, &setup.drawing, truth, mapping.as_ref(), MEASURE_STEP, map_what_fits)?;
    let widths: Vec<f64> = setup.pens.iter().map(|p| p.pen.width_nominal).collect();
    let touchable = touchable(scenario, setup, &desired, &widths)?;
    let fit = line_fit(&desired, &record.ink, &widths, touchable.as_ref()).map(|fit| LineMetrics {
        touchable: touchable.is_some().then_some(fit.touchable),
        width_error_p90: width_error(&desired, &record.ink, 0.9),
        ..LineMetrics::of(&fit, &record.ink)
    });
    // ink that was asked for and isn't there is none of the line, not a line that wasn't looked at
    let asked = desired.layers.iter().any(|l| !l.strokes.is_empty());
    let line = fit.or_else(|| asked.then(LineMetrics::nothing_drawn));
    metrics.line = line.map(|l| LineMetrics { tip_error_max_mm: tip_error(record).map(|m| m * 1e3), ..l });
    metrics.shape = shape(scenario, setup, &record.ink)?;
    Ok(())
}

/// What round nibs can touch of the desired line, where the robot draws on an object whose true shape it doesn't know.
fn touchable(
    scenario: &Scenario,
    setup: &Setup,
    desired: &SurfaceDrawing,
    widths: &[f64],
) -> Result<Option<Touchable>, RunError> {
    let balls: Vec<f64> = setup.pens.iter().map(|p| p.pen.spring.radius).collect();
    if balls.iter().all(|r| *r <= 0.0) {
        return Ok(None);
    }
    let Some((meant, reach)) = meant(scenario, setup)? else { return Ok(None) };
    Ok(Some(Touchable::of(desired, setup.truth.canvas().mesh(), [&balls, widths], meant.as_ref(), reach)))
}

/// The shape of a drawn pattern against the one desired on the nominal canvas.
fn shape(scenario: &Scenario, setup: &Setup, ink: &InkTrace) -> Result<Option<ShapeMetrics>, RunError> {
    let Artwork::Pattern(pattern) = &scenario.drawing.artwork else { return Ok(None) };
    let own = own_layers(&setup.drawing, scenario);
    let sides = side_errors(&own, ink);
    let grid = match pattern {
        Pattern::Grid { .. } => {
            let (mapping, _) = mapping_onto(scenario, &setup.drawing, &setup.scene.canvas)?;
            grid_shape(&own, &map_what_fits(&own, mapping.as_ref(), MEASURE_STEP)?, ink)
        }
        _ => None,
    };
    Ok(ShapeMetrics::of(grid.as_ref(), sides.as_ref()))
}

/// Counts how far the run has come: by planned time, or by strokes where nothing is planned ahead.
fn counter<'a>(scenario: &Scenario, setup: &Setup, believed: &Believed, progress: &'a dyn Progress) -> Counter<'a> {
    let planned = believed.planning.as_ref().map(|p| p.timelines.iter().flatten().flatten());
    let name = match (scenario.touch.is_some(), setup.fetches()) {
        (true, _) => "drawing by touch",
        (_, true) => "drawing and changing pens",
        _ => "simulating",
    };
    match planned {
        Some(segments) => Counter::of_time(name, segments.map(|s| s.trajectory.duration()).sum(), progress),
        None => Counter::of_strokes(name, setup.drawing.sequence().len() as u64, progress),
    }
}
