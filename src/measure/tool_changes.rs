//! Counts tool changes, who waited for whom, and how near arms came to each other.
use std::collections::BTreeSet;

use super::{ScheduleMetrics, ToolMetrics, ToolPose, ToolStages};
use crate::exec::{ArmStop, Distances, Done, Visit};
use crate::math::stats::quantile;
use crate::math::{Digest, wilson};
use crate::skill::{Order, Stage, TaskFailure};
use crate::twin::grasp::{ChangeRecord, GOOD_SEAT};

/// Length of a step, s.
const STEP: f64 = 1e-3;

/// Figures of all tool changes; `scheduled` where arms waited for each other.
pub fn tool_metrics<P>(done: &[Done<P>], near: Distances, scheduled: bool) -> ToolMetrics {
    let changes = || done.iter().flat_map(|d| &d.log.changes);
    let count = |what: &dyn Fn(&ChangeRecord) -> bool| changes().filter(|c| what(c)).count() as u64;
    let gave_up = |order: Order| count(&|c| c.order == order && !c.succeeded);
    let (picks, returns) = (gave_up(Order::Pick), gave_up(Order::Return));
    let (bad_pose, not_seated) = (count(&is_bad), count(&|c| c.seat_gap.is_some_and(|gap| gap > GOOD_SEAT)));
    let stops = |what: &dyn Fn(&ArmStop) -> bool| {
        done.iter().filter_map(|d| d.stop.as_ref()).filter(|s| what(s)).count() as u64
    };
    let lost = stops(&|s| s.failure == TaskFailure::PenLost);
    let failed = picks + returns + bad_pose + not_seated + lost;
    let errors: Vec<_> = changes().filter_map(|c| c.tip_error).collect();
    let far: Vec<f64> = errors.iter().map(|e| e.translation.vector.norm() * 1e3).collect();
    let turned: Vec<f64> = errors.iter().map(|e| e.rotation.angle().to_degrees()).collect();
    let first = changes().find(|c| c.order == Order::Pick);
    let all = changes().count() as u64;
    let cycles = cycles(done);
    let distinct: BTreeSet<&String> = cycles.iter().map(|c| &c.digest).collect();
    let succeeded = distinct.iter().filter(|d| cycles.iter().any(|c| &&c.digest == *d && c.succeeded)).count();
    let interval = wilson(succeeded as u64, distinct.len() as u64);
    let jump = changes().map(|c| c.handover.jump).reduce(f64::max);
    ToolMetrics {
        changes: all,
        fetches: cycles.len() as u64,
        fetches_distinct: distinct.len() as u64,
        success_rate: (!distinct.is_empty()).then(|| succeeded as f64 / distinct.len() as f64),
        success_rate_low: interval.map(|i| i[0]),
        success_rate_high: interval.map(|i| i[1]),
        handover_jump_rad: jump,
        settling_s: changes().map(|c| c.settling).reduce(f64::max),
        attempts: changes().map(|c| u64::from(c.attempts)).sum(),
        successes: all.saturating_sub(failed),
        failed,
        held_by_friction: done.iter().map(|d| d.held_by_friction).sum(),
        dropped: stops(&|s| s.tool.as_ref().is_some_and(|t| t.dropped)),
        pick_given_up: picks,
        return_given_up: returns,
        bad_pose,
        not_seated,
        pose_error_mm_p95: quantile(&far, 0.95),
        pose_error_mm_max: far.iter().copied().reduce(f64::max),
        pose_error_deg_p95: quantile(&turned, 0.95),
        tip: first.and_then(|c| c.tip_error).map(|e| {
            let (roll, pitch, yaw) = e.rotation.euler_angles();
            ToolPose::of(e.translation.vector.into(), [roll, pitch, yaw])
        }),
        stages: first.map(stages),
        steps: changes().map(|c| c.steps).sum(),
        schedule: scheduled.then(|| schedule(done, near)),
    }
}

fn is_bad(c: &ChangeRecord) -> bool {
    let fetched = c.order == Order::Pick && c.succeeded;
    let held = c.snapshots.iter().rfind(|s| fetched && !s.failed);
    held.is_some_and(|s| !s.in_hand.is_good())
}

/// How the tool sat in the hand after each stage of a fetch that went well, the last time that it did.
fn stages(first: &ChangeRecord) -> ToolStages {
    let mut stages = ToolStages::default();
    for s in first.snapshots.iter().filter(|s| !s.failed) {
        let pose = Some(ToolPose::of(s.in_hand.xyz, s.in_hand.rpy));
        match s.stage {
            Some(Stage::Approach) => stages.approach = pose,
            Some(Stage::HalfGrasp) => stages.half_grasp = pose,
            Some(Stage::Lift) => stages.lift = pose,
            Some(Stage::FullGrasp) => stages.full_grasp = pose,
            _ => {}
        }
    }
    stages
}

/// A fetch and what became of the pen: whether it came out of its dock well, and back into it where it was brought back.
struct Cycle {
    /// Digest of how hand and tool moved: the same for the same simulation alone.
    digest: String,
    succeeded: bool,
}

fn cycles<P>(done: &[Done<P>]) -> Vec<Cycle> {
    let mut cycles = Vec::new();
    for d in done {
        let changes = &d.log.changes;
        for (i, fetch) in changes.iter().enumerate().filter(|(_, c)| c.order == Order::Pick) {
            let back = changes.get(i + 1).filter(|c| c.order == Order::Return);
            let lost = back.is_none() && d.stop.as_ref().is_some_and(|s| s.failure == TaskFailure::PenLost);
            let seated = back.is_none_or(|b| b.succeeded && b.seat_gap.is_none_or(|gap| gap <= GOOD_SEAT));
            let mut digest = Digest::new();
            for m in &fetch.motion {
                digest.numbers(m.q.iter());
            }
            for s in &fetch.snapshots {
                digest.numbers(s.in_hand.xyz.iter()).numbers(s.in_hand.rpy.iter());
            }
            cycles
                .push(Cycle { digest: digest.hex(), succeeded: fetch.succeeded && !is_bad(fetch) && seated && !lost });
        }
    }
    cycles
}

/// Who waited for whom, and for how long.
fn schedule<P>(done: &[Done<P>], near: Distances) -> ScheduleMetrics {
    let end = done.iter().map(|d| d.ending.time).fold(0.0, f64::max);
    let seconds = |steps: u64| steps as f64 * STEP;
    let waiting: f64 = done.iter().flat_map(|d| &d.visits).map(|v| seconds(v.waited)).sum();
    let alone: f64 = done.iter().map(|d| d.ending.time).sum::<f64>() - waiting;
    let span = |v: &Visit| (v.start, v.end.unwrap_or(v.start));
    let mut together = 0;
    for (a, one) in done.iter().enumerate() {
        for other in &done[..a] {
            for (v, w) in one.visits.iter().flat_map(|v| other.visits.iter().map(move |w| (v, w))) {
                let ((s, e), (t, f)) = (span(v), span(w));
                together += e.min(f).saturating_sub(s.max(t));
            }
        }
    }
    ScheduleMetrics {
        duration_s: end,
        waiting_s: waiting,
        together_s: seconds(together),
        one_arm_s: alone,
        saved_fraction: if alone > 0.0 { 1.0 - end / alone } else { 0.0 },
        distance_planned_mm: near.planned.map(|n| n.distance * 1e3),
        distance_mm: near.simulated.map(|n| n.distance * 1e3),
    }
}
