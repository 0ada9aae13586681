//! The arms' work as one run: whose turn it is, all in one time, how near they come, and figures of tool changes.
use rayon::prelude::*;

use super::Drawn;
use super::kit::Kit;
use super::work::{Change, Stop, Worked};
use crate::math::stats::quantile;
use crate::measure::{ScheduleMetrics, ToolMetrics, ToolPose};
use crate::plan::schedule::{Piece, Schedule, Turn, schedule};
use crate::plan::separation::{Motion, Nearest, nearest};
use crate::plan::zone::{Space, Sweep};
use crate::plan::{ArmPlan, Plan, ReachReport, Segment, SegmentKind, Trajectory};
use crate::report::stage_name;
use crate::robot::{ArmModel, JointVector};
use crate::run::RunError;
use crate::run::pictures::Extra;
use crate::scenario::ToolSettings;
use crate::skill::Order;
use crate::twin::Record;
use crate::twin::grasp::{ChangeRecord, GOOD_SEAT};

/// Time between looks at how near arms are, s.
const LOOK: f64 = 0.01;

/// When something in an arm's own time is in the time of the run.
fn when(worked: &Worked, starts: &[f64], time: f64) -> f64 {
    let i = worked.starts.partition_point(|s| *s <= time).saturating_sub(1);
    match (worked.starts.get(i), starts.get(i)) {
        (Some(own), Some(whole)) => whole + (time - own),
        _ => time,
    }
}

/// The longest time for which a pen is away from its dock, waits included, s.
pub(super) fn longest_out(worked: &[Worked], turns: &Schedule) -> f64 {
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
pub(super) fn turns(tools: &ToolSettings, models: &[ArmModel], worked: &[Worked]) -> Schedule {
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

/// One run of what all arms did: plan, record, figures, and where they are never nearer.
///
/// # Errors
/// The plan brings arms nearer than they may.
pub(super) fn join(
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
    pieces: &[Vec<Piece>],
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
        s.stage.map(|stage| (stage_name(stage).to_string(), pose))
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
