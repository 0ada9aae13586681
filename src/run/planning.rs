//! The plan of every arm, made ahead on what is believed: with pens that a person changes, or that hands fetch.
use std::time::Instant;

use rayon::prelude::*;

use super::belief::Believed;
use super::setup::Setup;
use super::{RunError, options, parked_arms};
use crate::math::Rgb;
use crate::mesh::TriMesh;
use crate::plan::{
    self, ArmPlan, Plan, PlanOptions, ReachReport, Segment, SegmentKind, Space, Sweep, Turn, VisitOrder, Zone,
};
use crate::progress::Progress;
use crate::robot::ArmModel;
use crate::scenario::{Scenario, ToolSettings};
use crate::skill::GripperKit;
use crate::surface::SurfaceDrawing;

/// Parts of planning that progress counts.
const PARTS: f64 = 1000.0;
/// How long an arm is expected to be away from the canvas to change its pen, s: the order of arms is made with it, and kept whatever
/// changes really take.
const CHANGE_TIME: f64 = 50.0;

/// Which arm draws with the ink of each layer, and which dock of it the pen stands in.
pub(super) type PenPlaces = Vec<(usize, usize)>;

/// What all arms do, planned ahead.
pub(super) struct Planning {
    /// Every arm's segments, in its own time.
    pub plan: Plan,
    /// The same in pieces, each of which begins and ends at rest: an entry an arm. One piece where pens are changed by hand.
    pub timelines: Vec<Vec<Vec<Segment>>>,
    /// Whose pens are where; empty where a person changes them.
    pub places: PenPlaces,
    /// Who waits for whom.
    pub order: VisitOrder,
    pub reach: ReachReport,
    /// Wall-clock time, s.
    pub seconds: f64,
}

/// Plans the drawing for all arms that draw.
pub(super) fn plan_all(
    scenario: &Scenario,
    setup: &Setup,
    believed: &Believed,
    progress: &dyn Progress,
) -> Result<Planning, RunError> {
    progress.stage("planning", Some(PARTS as u64));
    let started = Instant::now();
    let options = options::plan_options(scenario, &setup.pens);
    let mut planning = match &scenario.tools {
        Some(tools) => fetched(tools, setup, believed, &options, progress)?,
        None => by_hand(setup, believed, &options, progress)?,
    };
    planning.seconds = started.elapsed().as_secs_f64();
    Ok(planning)
}

/// The drawing on the believed canvas.
fn strokes(believed: &Believed) -> Result<&SurfaceDrawing, RunError> {
    believed.mapped.as_ref().map(|m| &m.strokes).ok_or(RunError::WhileDrawing)
}

fn by_hand(
    setup: &Setup,
    believed: &Believed,
    options: &PlanOptions,
    progress: &dyn Progress,
) -> Result<Planning, RunError> {
    let arm = &setup.cell.arms[0];
    let mut obstacles = setup.obstacles()?;
    obstacles.extend(believed.skirt().cloned());
    let mut hear = |share: f64| progress.advance((share * PARTS) as u64);
    let job = plan::PlanJob {
        arm_index: 0,
        arm: &arm.model,
        home: &arm.home,
        service: &arm.service,
        drawing: strokes(believed)?,
        canvas: &believed.canvas,
        obstacles: &obstacles,
    };
    let planned = plan::plan(&job, options, &mut hear)?;
    Ok(Planning {
        timelines: vec![vec![planned.plan.segments.clone()]],
        plan: Plan { arms: vec![planned.plan] },
        places: Vec::new(),
        order: VisitOrder::free(1),
        reach: planned.reach,
        seconds: 0.0,
    })
}

fn fetched(
    tools: &ToolSettings,
    setup: &Setup,
    believed: &Believed,
    options: &PlanOptions,
    progress: &dyn Progress,
) -> Result<Planning, RunError> {
    let kits = kits(setup)?;
    let places = assign(setup, &kits, tools)?;
    let models = holding(setup, &kits)?;
    let obstacles = obstacles(setup, believed, &kits, &models)?;
    let all = strokes(believed)?;
    let mut reach = ReachReport::default();
    let (mut arms, mut timelines): (Vec<ArmPlan>, Vec<_>) = (Vec::new(), Vec::new());
    for kit in &kits {
        let draws = |layer: usize| places[layer].0 == kit.index;
        // a dock out of reach is known before anything moves
        for layer in (0..places.len()).filter(|l| draws(*l)) {
            kit.before(places[layer].1)?;
        }
        let around = [obstacles[kit.index].as_slice(), &kit.solids(None).map_err(RunError::Tool)?].concat();
        let share = kit.index as f64;
        let mut hear = |s: f64| progress.advance(((share + s) / kits.len() as f64 * PARTS) as u64);
        let job = plan::PlanJob {
            arm_index: kit.index,
            arm: &models[kit.index],
            home: &kit.home,
            service: &kit.home,
            drawing: &part(all, draws),
            canvas: &believed.canvas,
            obstacles: &around,
        };
        let planned = plan::plan(&job, options, &mut hear)?;
        reach.length += planned.reach.length;
        reach.reachable_length += planned.reach.reachable_length;
        reach.unreachable.extend(planned.reach.unreachable);
        timelines.push(cut(planned.plan.segments.clone()));
        arms.push(planned.plan);
    }
    let order = order(&timelines, &models, tools.margin_mm * 1e-3);
    Ok(Planning { plan: Plan { arms }, timelines, places, order, reach, seconds: 0.0 })
}

/// The kits of all arms that draw.
pub(super) fn kits(setup: &Setup) -> Result<Vec<&GripperKit>, RunError> {
    let kits: Vec<&GripperKit> = setup.kits.iter().flatten().map(AsRef::as_ref).collect();
    if kits.len() != setup.cell.arms.len() || kits.is_empty() {
        return Err(RunError::NoGripper { robot: setup.cell.name.clone() });
    }
    Ok(kits)
}

/// Every arm with a pen in its hand, as it believes itself to be. With whichever pen: only its colour differs.
pub(super) fn holding(setup: &Setup, kits: &[&GripperKit]) -> Result<Vec<ArmModel>, RunError> {
    let pen = setup.drawing.layers.first().map_or(Rgb([0; 3]), |l| l.color);
    kits.iter().map(|k| k.holding(pen).map_err(RunError::Tool)).collect()
}

/// What each arm keeps clear of besides its own docks: furniture, and the others where they wait, with their docks.
pub(super) fn obstacles(
    setup: &Setup,
    believed: &Believed,
    kits: &[&GripperKit],
    models: &[ArmModel],
) -> Result<Vec<Vec<TriMesh>>, RunError> {
    let mut furniture = setup.obstacles()?;
    furniture.extend(believed.skirt().cloned());
    let around = |kit: &&GripperKit| {
        let mut solids = furniture.clone();
        for other in kits.iter().filter(|o| o.index != kit.index) {
            solids.extend(parked_arms::at_rest(&models[other.index], &other.home)?);
            solids.extend(other.solids(None).map_err(RunError::Tool)?);
        }
        Ok(solids)
    };
    kits.iter().map(around).collect()
}

/// Which arm draws with the ink of each layer, and which dock of it the pen stands in.
pub(super) fn assign(setup: &Setup, kits: &[&GripperKit], tools: &ToolSettings) -> Result<PenPlaces, RunError> {
    let names: Vec<&str> = kits.iter().map(|k| k.arm.name.as_str()).collect();
    let mut taken = vec![0; kits.len()];
    let (inks, pens) = (setup.drawing.layers.len(), kits.iter().map(|k| k.pens.len()).sum());
    let mut turn = 0;
    let mut places = Vec::with_capacity(inks);
    for layer in &setup.drawing.layers {
        let arm = match tools.arms.get(&layer.name) {
            Some(arm) => names.iter().position(|n| n == arm).ok_or_else(|| RunError::ArmOfInk {
                ink: layer.name.clone(),
                arm: arm.clone(),
                arms: names.join(", "),
            })?,
            None => {
                let free = (0..kits.len()).map(|i| (turn + i) % kits.len()).find(|a| taken[*a] < kits[*a].pens.len());
                let arm = free.ok_or(RunError::TooManyInks { inks, pens })?;
                turn = (arm + 1) % kits.len();
                arm
            }
        };
        if taken[arm] >= kits[arm].pens.len() {
            return Err(RunError::TooManyInks { inks, pens });
        }
        places.push((arm, kits[arm].pens[taken[arm]]));
        taken[arm] += 1;
    }
    Ok(places)
}

/// The part of a drawing whose layers `draws` picks.
fn part(mapped: &SurfaceDrawing, draws: impl Fn(usize) -> bool) -> SurfaceDrawing {
    let mut part = mapped.clone();
    for (i, layer) in part.layers.iter_mut().enumerate() {
        if !draws(i) {
            layer.strokes.clear();
        }
    }
    part
}

/// Segments cut where the pen is changed: each piece begins and ends at rest in the waiting pose, its time at 0.
fn cut(segments: Vec<Segment>) -> Vec<Vec<Segment>> {
    let mut pieces: Vec<Vec<Segment>> = vec![Vec::new()];
    for segment in segments {
        match (segment.kind, pieces.last_mut()) {
            (SegmentKind::ChangePen, _) => pieces.push(Vec::new()),
            (_, Some(piece)) => piece.push(segment),
            _ => {}
        }
    }
    pieces.retain(|p| !p.is_empty());
    for piece in &mut pieces {
        // the way to the next pen is still made with this one
        let (began, layer) = (piece[0].start, piece[0].layer);
        for segment in piece {
            segment.start -= began;
            segment.layer = layer;
        }
    }
    pieces
}

/// Who waits for whom: arms are over the canvas together where the cells that they sweep with a margin around them are not the same.
fn order(timelines: &[Vec<Vec<Segment>>], models: &[ArmModel], margin: f64) -> VisitOrder {
    if timelines.len() < 2 {
        return VisitOrder::free(timelines.len());
    }
    let swept = |(visits, arm): (&Vec<Vec<Segment>>, &ArmModel)| -> Vec<Sweep> {
        visits.par_iter().map(|v| Sweep::new(arm, &v.iter().collect::<Vec<_>>())).collect()
    };
    let sweeps: Vec<Vec<Sweep>> = timelines.iter().zip(models).map(swept).collect();
    // for each pair of arms the zones of either in the space that both reach
    let mut zones: Vec<Vec<[Vec<Zone>; 2]>> = Vec::new();
    for a in 0..sweeps.len() {
        zones.push(Vec::new());
        for b in 0..a {
            let [one, other] = [a, b].map(|i| sweeps[i].iter().collect::<Vec<_>>());
            let space = Space::between(&one, &other, margin);
            zones[a].push([a, b].map(|i| sweeps[i].par_iter().map(|s| space.zone(s)).collect()));
        }
    }
    let clash = |(a, i): Turn, (b, j): Turn| {
        let (a, i, b, j) = if a > b { (a, i, b, j) } else { (b, j, a, i) };
        let [one, other] = &zones[a][b];
        one[i].meets(&other[j])
    };
    let durations: Vec<Vec<f64>> =
        timelines.iter().map(|visits| visits.iter().map(|v| v.last().map_or(0.0, Segment::end)).collect()).collect();
    VisitOrder::of(&durations, CHANGE_TIME, &clash)
}
