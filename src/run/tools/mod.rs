//! Drawings by arms with grippers: pens are fetched from docks, drawn with and brought back, by two arms on one canvas.
//!
//! Each arm's work is simulated by itself in its own time, tool changes by contact and friction, drawing with the pen as the
//! grasp left it. What then has to be known is who waits for whom: arms are over the canvas at the same time only where the space
//! that one sweeps with a pen keeps clear of the other's, else one changes its pen while the other draws. The physics of an arm doesn't depend on when it moves, so records are shifted in time and joined.
mod apart;
mod kit;
mod scenery;
mod schedule;
mod snapshots;
mod work;
mod zone;

use std::time::Instant;

use rayon::prelude::*;

use crate::math::Rgb;
use crate::math::stats::quantile;
use crate::measure::{ScheduleMetrics, ToolMetrics, ToolPose};
use crate::plan::{self, ArmPlan, Plan, ReachReport, Segment, SegmentKind, Trajectory};
use crate::report::OutputDir;
use crate::robot::{ArmModel, JointVector};
use crate::run::cast::Cast;
use crate::run::pictures::{self, Extra};
use crate::run::{Progress, RunError, Written, options, standing};
use crate::scenario::{Scenario, ToolSettings};
use crate::surface::{Mapping, SurfaceDrawing};
use crate::twin::Record;
use crate::twin::grasp::{ChangeRecord, GOOD_SEAT, Order};

use apart::{Motion, Nearest, nearest};
use kit::Kit;
use scenery::StageView;
use schedule::{Schedule, Turn, schedule};
use work::{Change, Site, Stop, Task, Worked, work};
use zone::{Space, Sweep};

use snapshots::stages_csv;

/// Time between looks at how near arms are, s.
const LOOK: f64 = 0.01;

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
        let csv = stages_csv(&self.changes, &arms, &inks);
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
    let ground = [furniture.as_slice(), &[cast.truth.mesh.clone()]].concat();
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

/// When something in an arm's own time is in the time of the run.
fn when(worked: &Worked, starts: &[f64], time: f64) -> f64 {
    let i = worked.starts.partition_point(|s| *s <= time).saturating_sub(1);
    match (worked.starts.get(i), starts.get(i)) {
        (Some(own), Some(whole)) => whole + (time - own),
        _ => time,
    }
}

/// The longest time for which a pen is away from its dock, waits included, s.
fn longest_out(worked: &[Worked], turns: &Schedule) -> f64 {
    let out = worked.iter().zip(&turns.starts).flat_map(|(w, starts)| {
        let begins = w.changes.iter().map(|c| when(w, starts, c.start + 1e-9)).chain([turns.end]);
        begins.collect::<Vec<_>>().windows(2).map(|t| t[1] - t[0]).collect::<Vec<_>>()
    });
    out.fold(0.0, f64::max)
}

/// The arms' segments in the time of the run, with their waits.
fn timed(arm: usize, worked: &Worked, starts: &[f64], home: &JointVector) -> ArmPlan {
    let mut segments: Vec<Segment> = Vec::new();
    let mut end = 0.0;
    for segment in &worked.segments {
        // the middle of a segment tells surely which piece it is in
        let shift = when(worked, starts, segment.start + 0.5 * segment.trajectory.duration())
            - (segment.start + 0.5 * segment.trajectory.duration());
        let start = segment.start + shift;
        if start - end > 1e-6 {
            let at = segments.last().and_then(|s| s.trajectory.knots().last()).map_or(*home, |k| k.q);
            let trajectory = Trajectory::rest(at, start - end);
            let (kind, depth) = (SegmentKind::Wait, Default::default());
            segments.push(Segment { kind, layer: segment.layer, stroke: None, start: end, trajectory, depth });
        }
        let segment = Segment { start, ..segment.clone() };
        end = segment.end();
        segments.push(segment);
    }
    ArmPlan { arm, segments }
}

/// Whose turn it is when: arms are over the canvas together where their zones share no cell.
fn turns(tools: &ToolSettings, models: &[ArmModel], worked: &[Worked]) -> Schedule {
    let pieces: Vec<_> = worked.iter().map(|w| w.pieces.clone()).collect();
    let swept = |w: &Worked, arm: &ArmModel| -> Vec<Option<Sweep>> {
        let sweep = |i: usize| {
            let (from, to) = (w.starts[i] - 1e-9, w.starts[i] + w.pieces[i].duration - 1e-9);
            let segments: Vec<&Segment> = w.segments.iter().filter(|s| s.start >= from && s.start < to).collect();
            w.pieces[i].over_canvas.then(|| Sweep::new(arm, &segments))
        };
        (0..w.pieces.len()).into_par_iter().map(sweep).collect()
    };
    let [left, right] = worked else { return schedule(&pieces, &|_, _| true) };
    let sweeps = [swept(left, &models[0]), swept(right, &models[1])];
    let [one, other] = [0, 1].map(|a| sweeps[a].iter().flatten().collect::<Vec<_>>());
    let space = Space::between(&one, &other, tools.margin_mm * 1e-3);
    let zones = sweeps.map(|s| s.par_iter().map(|s| s.as_ref().map(|s| space.zone(s))).collect::<Vec<_>>());
    let clash = |(a, i): Turn, (b, j): Turn| match (&zones[a][i], &zones[b][j]) {
        (Some(one), Some(other)) => one.meets(other),
        _ => true,
    };
    schedule(&pieces, &clash)
}

fn join(
    tools: &ToolSettings,
    kits: &[Kit],
    models: &[ArmModel],
    worked: Vec<Worked>,
    turns: Schedule,
    reach: ReachReport,
    planning: f64,
) -> Result<Drawn, RunError> {
    let pieces: Vec<_> = worked.iter().map(|w| w.pieces.clone()).collect();
    // an arm that stops calls the whole off
    let ends = worked.iter().zip(&turns.starts).filter(|(w, _)| w.stopped.is_some());
    let stop = ends
        .map(|(w, starts)| starts.last().copied().unwrap_or(0.0) + w.pieces.last().map_or(0.0, |p| p.duration))
        .fold(f64::INFINITY, f64::min);
    let arms: Vec<ArmPlan> = worked
        .iter()
        .zip(&turns.starts)
        .zip(kits)
        .map(|((w, starts), kit)| timed(kit.index, w, starts, &kit.arm.home))
        .collect();
    let plan = Plan { arms };
    let planned_ways: Vec<Vec<(f64, JointVector)>> =
        worked.iter().zip(&plan.arms).zip(&turns.starts).map(|((w, arm), starts)| wished_way(w, arm, starts)).collect();

    let (mut parts, mut changes, mut stopped, mut own) = (Vec::new(), Vec::new(), None, Vec::new());
    for mut w in worked {
        parts.push(std::mem::take(&mut w.record));
        changes.push(std::mem::take(&mut w.changes));
        if let Some(stop) = &w.stopped {
            stopped.get_or_insert_with(|| stop.reason.clone());
        }
        own.push(w);
    }
    let stops =
        |what: &dyn Fn(&Stop) -> bool| own.iter().filter(|w| w.stopped.as_ref().is_some_and(what)).count() as u64;
    let held: u64 = own.iter().map(|w| w.held_by_friction).sum();
    let (dropped, lost) = (stops(&|s| s.dropped), stops(&|s| s.lost));
    let record = Record::joined(parts, &|arm, time| when(&own[arm], &turns.starts[arm], time), stop);
    for (arm, list) in changes.iter_mut().enumerate() {
        list.iter_mut().for_each(|c| c.start = when(&own[arm], &turns.starts[arm], c.start + 1e-9));
        list.retain(|c| c.start < stop);
    }
    let real: Vec<Vec<(f64, JointVector)>> = record
        .arms
        .iter()
        .map(|a| {
            a.samples
                .iter()
                .map(|s| (s.time, JointVector::from_fn(|i, _| s.q.get(i).copied().unwrap_or(0.0))))
                .collect()
        })
        .collect();
    let near = |ways: &[Vec<(f64, JointVector)>]| {
        let [a, b] = [ways.first()?, ways.get(1)?];
        let [a, b] = [Motion { arm: &models[0], way: a.clone() }, Motion { arm: &models[1], way: b.clone() }];
        nearest(&a, &b, LOOK)
    };
    let (in_plan, in_truth) = (near(&planned_ways), near(&real));
    keep_apart(in_plan, tools.margin_mm)?;
    let tool = figures(
        &changes,
        &turns,
        &pieces,
        [held, dropped, lost],
        in_plan.map(|n| n.distance),
        in_truth.map(|n| n.distance),
    );
    let stops = own.into_iter().map(|w| w.stopped).collect();
    let (extra, stages) = (Extra::default(), Vec::new());
    Ok(Drawn { plan, reach, record, tool, changes, stops, extra, stages, planning, stopped })
}

/// Refuses a plan in which arms come nearer than they may.
fn keep_apart(nearest: Option<Nearest>, margin_mm: f64) -> Result<(), RunError> {
    match nearest.filter(|n| n.distance < margin_mm * 1e-3) {
        Some(n) => Err(RunError::TooNear { distance_mm: n.distance * 1e3, time: n.time, margin_mm }),
        None => Ok(()),
    }
}

/// An arm's joints over the time of the run: as wished where it travels and draws, as they were in tool changes.
fn wished_way(worked: &Worked, arm: &ArmPlan, starts: &[f64]) -> Vec<(f64, JointVector)> {
    let mut way = Vec::new();
    for segment in &arm.segments {
        if segment.kind == SegmentKind::ChangeTool {
            let own =
                worked.changes.iter().find(|c| (when(worked, starts, c.start + 1e-9) - segment.start).abs() < 1e-6);
            let joints = own.map_or(&[][..], |c| &c.record.joints);
            let period = ChangeRecord::PERIOD;
            way.extend(joints.iter().enumerate().map(|(i, q)| (segment.start + i as f64 * period, *q)));
            continue;
        }
        let (mut cursor, count) = (0, (segment.trajectory.duration() / LOOK).ceil() as usize);
        for i in 0..=count {
            let t = (i as f64 * LOOK).min(segment.trajectory.duration());
            way.push((segment.start + t, segment.trajectory.sample(t, &mut cursor).q));
        }
    }
    way
}

fn figures(
    changes: &[Vec<Change>],
    turns: &Schedule,
    pieces: &[Vec<schedule::Piece>],
    [held_by_friction, dropped, lost]: [u64; 3],
    in_plan: Option<f64>,
    in_truth: Option<f64>,
) -> ToolMetrics {
    let all = || changes.iter().flatten();
    let count = |what: &dyn Fn(&Change) -> bool| all().filter(|c| what(c)).count() as u64;
    let errors: Vec<_> = all().filter_map(|c| c.tip_error).collect();
    let far: Vec<f64> = errors.iter().map(|e| e.translation.vector.norm() * 1e3).collect();
    let turned: Vec<f64> = errors.iter().map(|e| e.rotation.angle().to_degrees()).collect();
    let alone: f64 = pieces.iter().flatten().map(|p| p.duration).sum();
    let gave_up = |order: Order| count(&|c| c.record.order == order && !c.record.succeeded);
    let bad = |c: &Change| {
        let fetched = c.record.order == Order::Pick && c.record.succeeded;
        let held = c.record.snapshots.iter().rfind(|s| fetched && !s.failed);
        held.is_some_and(|s| !s.in_hand.is_good())
    };
    let (bad_pose, not_seated) = (count(&bad), count(&|c| c.seat_gap.is_some_and(|gap| gap > GOOD_SEAT)));
    let first = all().find(|c| c.record.order == Order::Pick);
    let stages = first.iter().flat_map(|c| &c.record.snapshots).filter(|s| !s.failed).filter_map(|s| {
        let pose = ToolPose::of(s.in_hand.xyz, s.in_hand.rpy);
        s.stage.map(|stage| (snapshots::stage_name(stage).to_string(), pose))
    });
    let tip = first.and_then(|c| c.tip_error).map(|e| {
        let (roll, pitch, yaw) = e.rotation.euler_angles();
        ToolPose::of(e.translation.vector.into(), [roll, pitch, yaw])
    });
    let (picks, returns) = (gave_up(Order::Pick), gave_up(Order::Return));
    let failed = picks + returns + bad_pose + not_seated + lost;
    ToolMetrics {
        changes: all().count() as u64,
        attempts: all().map(|c| u64::from(c.record.attempts)).sum(),
        successes: (all().count() as u64).saturating_sub(failed),
        failed,
        held_by_friction,
        dropped,
        pick_given_up: picks,
        return_given_up: returns,
        bad_pose,
        not_seated,
        pose_error_mm_p95: quantile(&far, 0.95),
        pose_error_mm_max: far.iter().copied().reduce(f64::max),
        pose_error_deg_p95: quantile(&turned, 0.95),
        tip,
        stages: stages.collect(),
        steps: all().map(|c| c.record.steps).sum(),
        schedule: Some(ScheduleMetrics {
            duration_s: turns.end,
            waiting_s: turns.waiting(),
            together_s: turns.together,
            one_arm_s: alone,
            saved_fraction: if alone > 0.0 { 1.0 - turns.end / alone } else { 0.0 },
            distance_planned_mm: in_plan.map(|d| d * 1e3),
            distance_mm: in_truth.map(|d| d * 1e3),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_margin_that_is_not_kept_is_refused() {
        let near = |distance| Some(Nearest { distance, time: 12.5 });
        assert!(keep_apart(near(0.0301), 30.0).is_ok() && keep_apart(None, 30.0).is_ok());
        let refused = keep_apart(near(0.0299), 30.0).unwrap_err().to_string();
        assert!(
            refused.contains("29.9 mm") && refused.contains("12.5 s") && refused.contains("margin_mm = 30"),
            "{refused}"
        );
    }
}
