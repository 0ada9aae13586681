//! Drawings by arms with grippers: pens are fetched from docks, drawn with and brought back, by two arms on one canvas.
//!
//! Each arm's work is simulated by itself in its own time, tool changes by contact and friction, drawing with the pen as the
//! grasp left it. What then has to be known is who waits for whom: arms are over the canvas at the same time only where the space
//! that one sweeps with a pen keeps clear of the other's, else one changes its pen while the other draws. The physics of an arm
//! doesn't depend on when it moves, so records are shifted in time and joined.
mod kit;
mod scenery;
mod whole;
mod work;

use std::time::Instant;

use rayon::prelude::*;

use crate::math::Rgb;
use crate::measure::ToolMetrics;
use crate::plan::{self, Plan, ReachReport, Segment, SegmentKind};
use crate::progress::Progress;
use crate::report::{OutputDir, StagesOf, stages_csv};
use crate::robot::ArmModel;
use crate::run::cast::Cast;
use crate::run::pictures::{self, Extra};
use crate::run::{RunError, Written, options, standing};
use crate::scenario::{Scenario, ToolSettings};
use crate::skill::Order;
use crate::surface::{Mapping, SurfaceDrawing};
use crate::twin::Record;

use kit::Kit;
use scenery::StageView;
use whole::{join, longest_out, turns};
use work::{Change, Site, Stop, Task, Worked, work};

/// What a run with fetched pens leaves.
pub(super) struct Drawn {
    /// All motion, as it was wished, in the time of the run.
    pub plan: Plan,
    pub reach: ReachReport,
    pub record: Record,
    pub tool: ToolMetrics,
    /// Tool changes of each arm.
    changes: Vec<Vec<Change>>,
    /// Arms that stopped before all was drawn.
    stops: Vec<Option<Stop>>,
    /// Hands, docks and tools, to be seen.
    pub extra: Extra,
    /// Pictures of the first fetch and the first return.
    stages: Vec<StageView>,
    /// Wall-clock time of planning, s.
    pub planning: f64,
    /// Why the run stopped before all was drawn.
    pub stopped: Option<String>,
}

impl Drawn {
    /// Writes how the tools sat.
    pub fn write(
        &self,
        scenario: &Scenario,
        cast: &Cast,
        out: &OutputDir,
        written: &mut Written,
        progress: &dyn Progress,
    ) -> Result<(), RunError> {
        let arms: Vec<&str> = cast.cell.arms.iter().map(|a| a.model.name.as_str()).collect();
        let inks: Vec<&str> = cast.drawing.layers.iter().map(|l| l.name.as_str()).collect();
        let changes = self.changes.iter().zip(&arms).flat_map(|(list, arm)| list.iter().map(move |c| (*arm, c)));
        let csv = stages_csv(changes.map(|(arm, c)| StagesOf {
            arm,
            ink: inks[c.layer],
            dock: c.dock,
            start: c.start,
            record: &c.record,
        }));
        written.other(out.write("tools.csv", csv.as_bytes())?, "The tool in the hand, stage by stage of every change");
        if scenario.render.tool_stages && !self.stages.is_empty() {
            progress.stage("pictures of tool changes", None);
            let views = self.stages.iter().map(|s| (s.name.as_str(), s.caption.as_str(), &s.items, &s.view));
            pictures::stages(cast, views, out, written)?;
        }
        Ok(())
    }
}

/// Which arm (index among `kits`) draws with the ink of each layer, and which dock of it the pen stands in.
fn assign(cast: &Cast, kits: &[Kit], tools: &ToolSettings) -> Result<Vec<(usize, usize)>, RunError> {
    let names: Vec<&str> = kits.iter().map(|k| k.arm.model.name.as_str()).collect();
    let mut taken = vec![0; kits.len()];
    let (inks, pens) = (cast.drawing.layers.len(), kits.iter().map(|k| k.pens.len()).sum());
    let mut turn = 0;
    let mut places = Vec::with_capacity(inks);
    for layer in &cast.drawing.layers {
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
        let began = piece[0].start;
        piece.iter_mut().for_each(|s| s.start -= began);
    }
    pieces
}

/// Draws what is laid on the canvas in `mapped` with pens that the arms fetch.
pub(super) fn draw(
    scenario: &Scenario,
    tools: &ToolSettings,
    cast: &Cast,
    mapped: &SurfaceDrawing,
    mapping: &dyn Mapping,
    progress: &dyn Progress,
) -> Result<Drawn, RunError> {
    let mut kits = Vec::new();
    for (i, arm) in cast.cell.arms.iter().enumerate() {
        kits.extend(Kit::new(i, arm, tools)?);
    }
    if kits.len() != cast.cell.arms.len() || kits.is_empty() {
        return Err(RunError::NoGripper { robot: cast.cell.name.clone() });
    }
    let places = assign(cast, &kits, tools)?;
    let colors: Vec<_> = cast.drawing.layers.iter().map(|l| l.color).collect();
    let plan_options = options::plan_options(scenario, &cast.pens);
    let furniture = cast.obstacles()?;
    // with whichever pen: only its colour differs
    let pen = colors.first().copied().unwrap_or(Rgb([0; 3]));
    let models: Vec<ArmModel> = kits.iter().map(|k| k.believed(pen)).collect::<Result<_, RunError>>()?;
    // every arm keeps clear of the others where they wait, and of their docks
    let mut obstacles = Vec::new();
    for kit in &kits {
        let mut solids = furniture.clone();
        for other in kits.iter().filter(|o| o.index != kit.index) {
            solids.extend(standing::at_rest(&models[other.index], &other.arm.home)?);
            solids.extend(other.solids(None)?);
        }
        obstacles.push(solids);
    }

    const PARTS: f64 = 1000.0;
    progress.stage("planning", Some(PARTS as u64));
    let started = Instant::now();
    let mut reach = ReachReport::default();
    let mut tasks: Vec<Vec<Task>> = Vec::new();
    for kit in &kits {
        let draws = |layer: usize| places[layer].0 == kit.index;
        let mine = part(mapped, draws);
        // a dock out of reach is known before anything moves
        for layer in (0..places.len()).filter(|l| draws(*l)) {
            kit.setup(places[layer].1, tools, scenario.seed)?;
        }
        let model = &models[kit.index];
        let around = [obstacles[kit.index].as_slice(), &kit.solids(None)?].concat();
        let home = &kit.arm.home;
        let share = kit.index as f64;
        let mut hear = |s: f64| progress.advance(((share + s) / kits.len() as f64 * PARTS) as u64);
        let planned = plan::plan(kit.index, model, home, home, &mine, &cast.belief, &around, &plan_options, &mut hear)?;
        reach.length += planned.reach.length;
        reach.reachable_length += planned.reach.reachable_length;
        reach.unreachable.extend(planned.reach.unreachable);
        let pieces = cut(planned.plan.segments).into_iter().map(|segments| {
            let layer = segments[0].layer;
            Task { layer, dock: places[layer].1, segments }
        });
        tasks.push(pieces.collect());
    }
    let planning = started.elapsed().as_secs_f64();

    let count: usize = tasks.iter().map(Vec::len).sum();
    progress.stage("drawing and changing pens", Some(count as u64));
    let world = cast.surroundings(scenario, mapping);
    let twin = options::twin_options(scenario);
    let done = std::sync::atomic::AtomicUsize::new(0);
    let ground = [furniture.as_slice(), std::slice::from_ref(&cast.truth.mesh)].concat();
    let go = |waits: &[Vec<f64>]| -> Result<Vec<Worked>, RunError> {
        let arms = kits.par_iter().zip(&tasks).zip(&obstacles);
        arms.map(|((kit, tasks), obstacles)| {
            let site = Site {
                scenario,
                tools,
                world: &world,
                canvas: &cast.belief,
                obstacles,
                ground: &ground,
                plan: &plan_options,
                twin: &twin,
                colors: &colors,
            };
            work(&site, kit, tasks, waits.get(kit.index).map_or(&[], Vec::as_slice), &mut || {
                let done = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                progress.advance(done.min(count) as u64);
            })
        })
        .collect()
    };
    let mut worked = go(&[])?;
    let turns = turns(tools, &models, &worked);
    let dry = cast.pens.iter().filter_map(|p| p.pen.drying).map(|d| d.open).fold(f64::INFINITY, f64::min);
    if turns.waiting() > 0.0 && longest_out(&worked, &turns) > dry {
        // a nib dries while its arm waits; nothing but its ink depends on that
        worked = go(&turns.waits)?;
    }
    let mut drawn = join(tools, &kits, &models, worked, turns, reach, planning)?;
    for kit in &kits {
        let own = places.iter().zip(&colors).filter(|((arm, _), _)| *arm == kit.index);
        let inks: Vec<(usize, Rgb)> = own.map(|((_, dock), color)| (*dock, *color)).collect();
        let stop = drawn.stops[kit.index].as_ref();
        drawn.extra.items.extend(scenery::docks(kit, &inks, stop.map(|s| s.dock))?);
        if let Some(stop) = stop {
            drawn.extra.items.extend(scenery::tool(kit, colors[stop.layer], &stop.world_from_tool)?);
        }
        drawn.extra.models.push(kit.bare.clone());
        let first = |order| drawn.changes[kit.index].iter().find(|c| c.record.order == order);
        if scenario.render.tool_stages && drawn.stages.is_empty() {
            let failed = drawn.changes[kit.index].iter().find(|c| c.record.snapshots.iter().any(|s| s.failed));
            let mut shown: Vec<(&Change, &str)> =
                [Order::Pick, Order::Return].into_iter().filter_map(first).map(|c| (c, "stage")).collect();
            if let Some(failed) = failed.filter(|f| shown.iter().all(|(s, _)| !std::ptr::eq(*s, *f))) {
                shown.push((failed, "stage-failed"));
            }
            for (change, prefix) in shown {
                let views = scenery::stage_views(kit, change, &inks, &colors, scenario.render.view_px, prefix)?;
                drawn.stages.extend(views);
            }
        }
    }
    Ok(drawn)
}
