//! The plan of every arm, made ahead on what is believed: with pens that a person changes, or that hands fetch.
use std::time::Instant;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::RunError;
use super::belief::Believed;
use super::setup::Setup;
use crate::exec::Journal;
use crate::math::Rgb;
use crate::mesh::TriMesh;
use crate::plan::{self, ArmPlan, Plan, PlanError, PlanOptions, ReachReport, Segment, VisitOrder};
use crate::progress::Progress;
use crate::robot::ArmModel;
use crate::scenario::{Scenario, ToolSettings, options};
use crate::skill::GripperKit;
use crate::surface::{BelievedCanvas, SurfaceDrawing};

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

/// Plans the drawing for all arms that draw. What a journal has of an interrupted run isn't planned again.
pub(super) fn plan_all(
    scenario: &Scenario,
    setup: &Setup,
    believed: &Believed,
    journal: Option<&Journal>,
    progress: &dyn Progress,
) -> Result<Planning, RunError> {
    progress.stage("planning", Some(PARTS as u64));
    let started = Instant::now();
    let options = options::plan_options(scenario, &setup.pens);
    let drawing = believed.mapped.as_ref().map(|m| &m.strokes).ok_or(RunError::WhileDrawing)?;
    let planner = Planner { setup, believed, drawing, options, journal, progress };
    let planning = match &scenario.tools {
        Some(tools) => planner.fetched(tools),
        None => planner.by_hand(),
    };
    let planning = planning.map_err(|e| match e {
        RunError::Plan(source @ PlanError::Unreachable { .. }) if setup.scene.wall.is_some() => {
            RunError::WallTooWide { robot: setup.cell.name.clone(), source }
        }
        other => other,
    })?;
    Ok(Planning { seconds: started.elapsed().as_secs_f64(), ..planning })
}

/// What one arm does and can't do.
type Planned = (ArmPlan, ReachReport);

/// What plans are made of.
struct Planner<'a> {
    setup: &'a Setup,
    believed: &'a Believed,
    /// The drawing on the believed canvas.
    drawing: &'a SurfaceDrawing,
    options: PlanOptions,
    journal: Option<&'a Journal>,
    progress: &'a dyn Progress,
}

impl Planner<'_> {
    /// One arm whose pens a person changes.
    fn by_hand(&self) -> Result<Planning, RunError> {
        let arm = &self.setup.cell.arms[0];
        let mut obstacles = self.setup.obstacles()?;
        obstacles.extend(self.believed.skirt().cloned());
        let (plan, reach) = self.arm(1, |canvas| plan::PlanJob {
            arm_index: 0,
            arm: &arm.model,
            home: &arm.home,
            service: &arm.service,
            drawing: self.drawing,
            canvas,
            obstacles: &obstacles,
        })?;
        Ok(Planning {
            timelines: vec![vec![plan.segments.clone()]],
            plan: Plan { arms: vec![plan] },
            places: Vec::new(),
            order: VisitOrder::free(1),
            reach,
            seconds: 0.0,
        })
    }

    /// Arms that fetch their pens.
    fn fetched(&self, tools: &ToolSettings) -> Result<Planning, RunError> {
        let kits = kits(self.setup)?;
        let places = assign(self.setup, &kits, tools)?;
        let models = holding(self.setup, &kits)?;
        let obstacles = obstacles(self.setup, self.believed, &kits, &models)?;
        let mut reach = ReachReport::default();
        let (mut arms, mut timelines): (Vec<ArmPlan>, Vec<_>) = (Vec::new(), Vec::new());
        for kit in &kits {
            let draws = |layer: usize| places[layer].0 == kit.index;
            // a dock out of reach is known before anything moves
            for layer in (0..places.len()).filter(|l| draws(*l)) {
                kit.before(places[layer].1)?;
            }
            let around = [obstacles[kit.index].as_slice(), &kit.solids(None).map_err(RunError::Tool)?].concat();
            let own = part(self.drawing, draws);
            let (plan, reached) = self.arm(kits.len(), |canvas| plan::PlanJob {
                arm_index: kit.index,
                arm: &models[kit.index],
                home: &kit.home,
                service: &kit.home,
                drawing: &own,
                canvas,
                obstacles: &around,
            })?;
            reach.length += reached.length;
            reach.reachable_length += reached.reachable_length;
            reach.unreachable.extend(reached.unreachable);
            timelines.push(plan.visits());
            arms.push(plan);
        }
        let order =
            self.kept("order", || Ok(VisitOrder::between(&timelines, &models, tools.margin_mm * 1e-3, CHANGE_TIME)))?;
        Ok(Planning { plan: Plan { arms }, timelines, places, order, reach, seconds: 0.0 })
    }

    /// The plan of one of `arms` arms.
    fn arm<'b>(
        &'b self,
        arms: usize,
        job: impl FnOnce(&'b BelievedCanvas) -> plan::PlanJob<'b>,
    ) -> Result<Planned, RunError> {
        let job = job(&self.believed.canvas);
        let share = job.arm_index as f64;
        let mut hear = |s: f64| self.progress.advance(((share + s) / arms as f64 * PARTS) as u64);
        self.kept(&format!("plan{}", job.arm_index), || {
            let planned = plan::plan(&job, &self.options, &mut hear)?;
            Ok((planned.plan, planned.reach))
        })
    }

    /// A value from the journal, or one that is made and kept there.
    fn kept<T: Serialize + DeserializeOwned>(
        &self,
        name: &str,
        make: impl FnOnce() -> Result<T, RunError>,
    ) -> Result<T, RunError> {
        let Some(journal) = self.journal else { return make() };
        if let Some(value) = journal.kept(name)? {
            return Ok(value);
        }
        let value = make()?;
        journal.keep(name, &value)?;
        Ok(value)
    }
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
            solids.extend(models[other.index].solids_at(&other.home)?);
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
