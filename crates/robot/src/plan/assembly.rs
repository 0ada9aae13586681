//! Runs joined to a plan: travels between them, pen changes, and what became of each stroke.
use nalgebra::Point2;
use rayon::prelude::*;

use super::field::Workcell;
use super::motion::{TravelKind, travel};
use super::path::{Run, StrokePath};
use super::stroke::DrawnRun;
use super::waypoint::Waypoint;
use super::{
    DepthProfile, MotionLimits, Obstruction, PlanError, ReachReport, Segment, SegmentKind, Trajectory, Unreachable,
};
use crate::robot::JointVector;
use crate::surface::SurfaceDrawing;

/// Strokes (or travels) that are planned between two reports of progress.
pub(super) const BATCH: usize = 64;

/// Figures of a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlanStatistics {
    /// Poses along strokes, presses and lifts that were solved.
    pub poses: usize,
    /// Pieces of strokes drawn without lifting the pen.
    pub runs: usize,
    /// Lifts in the middle of a stroke, for a change of posture.
    pub extra_lifts: usize,
    /// Global searches over redundancy.
    pub searches: usize,
    /// Pen changes.
    pub pen_changes: usize,
    /// Largest turn of a joint between two neighbouring poses of a stroke, rad.
    pub max_joint_step: f64,
    /// Largest distance of the planned tip path from the desired line, half-way between two poses, m.
    pub max_deviation: f64,
    /// Travels straight in joint space.
    pub travels_direct: usize,
    /// Travels over raised poses.
    pub travels_raised: usize,
    /// Travels found by a search.
    pub travels_searched: usize,
}

/// A run ready to be drawn.
struct Job {
    layer: usize,
    stroke: usize,
    drawn: DrawnRun,
    length: f64,
    /// What to report if it can't be approached.
    span: (usize, usize, Point2<f64>),
}

/// One stroke's share of the plan.
pub(super) struct Solved {
    pub path: StrokePath,
    pub drawn: Vec<(Run, DrawnRun)>,
    pub length: f64,
    pub drawn_length: f64,
    pub way: Vec<Waypoint>,
}

/// Length of the line from waypoint `a` to waypoint `b`, m.
pub(super) fn length(way: &[Waypoint], a: usize, b: usize) -> f64 {
    (a..b).map(|i| (way[i + 1].target.position - way[i].target.position).norm()).sum()
}

/// A plan in the making.
pub(super) struct Assembly<'a> {
    cell: &'a Workcell<'a>,
    service: &'a JointVector,
    limits: &'a MotionLimits,
    drawing: &'a SurfaceDrawing,
    jobs: Vec<Job>,
    /// What is drawn and what is not.
    pub reach: ReachReport,
    /// Figures.
    pub statistics: PlanStatistics,
}

impl<'a> Assembly<'a> {
    /// Nothing so far; pens are changed at `service`.
    pub fn new(
        cell: &'a Workcell<'a>,
        service: &'a JointVector,
        limits: &'a MotionLimits,
        drawing: &'a SurfaceDrawing,
    ) -> Self {
        let (reach, statistics) = (ReachReport::default(), PlanStatistics::default());
        Self { cell, service, limits, drawing, jobs: Vec::new(), reach, statistics }
    }

    /// Books one stroke.
    pub fn collect(&mut self, layer: usize, stroke: usize, solved: Solved) {
        let Self { drawing, reach, statistics, jobs, .. } = self;
        let of = &drawing.layers[layer].strokes[stroke];
        let span = |first: usize, last: usize| {
            let first = solved.way[first].source.floor() as usize;
            (first, solved.way[last].source.ceil() as usize, of.targets[first].sheet)
        };
        reach.length += solved.length;
        reach.reachable_length += solved.drawn_length;
        for gap in &solved.path.gaps {
            let (first, last, sheet) = span(gap.first, gap.last);
            let reason = gap.reason.clone();
            let end = (gap.last + 1).min(solved.way.len() - 1);
            let length = length(&solved.way, gap.first.saturating_sub(1), end);
            let layer_name = drawing.layers[layer].name.clone();
            reach.unreachable.push(Unreachable {
                layer,
                layer_name,
                stroke: of.index,
                first,
                last,
                sheet,
                length,
                reason,
            });
        }
        statistics.searches += solved.path.searches;
        statistics.extra_lifts += solved.drawn.len().saturating_sub(1);
        for (run, drawn) in solved.drawn {
            statistics.runs += 1;
            statistics.poses += drawn.poses;
            statistics.max_deviation = statistics.max_deviation.max(drawn.deviation);
            for w in run.q.windows(2) {
                statistics.max_joint_step = statistics.max_joint_step.max((w[1] - w[0]).amax());
            }
            let length = length(&solved.way, run.first, run.last());
            jobs.push(Job { layer, stroke: of.index, drawn, length, span: span(run.first, run.last()) });
        }
    }

    /// Joins the runs by travels and pen changes. `progress` hears the done share of the whole plan.
    ///
    /// # Errors
    /// There is no way to the service pose.
    pub fn join(&mut self, progress: &mut dyn FnMut(f64)) -> Result<Vec<Segment>, PlanError> {
        let jobs = std::mem::take(&mut self.jobs);
        let Some(first) = jobs.first() else { return Ok(Vec::new()) };
        let mut pen = first.layer;
        let (starts, ways) = self.ways(&jobs, progress);
        let Self { cell, service, limits, drawing, reach, statistics, .. } = self;
        let service = *service;
        let mut list = Segments { segments: Vec::new(), time: 0.0, at: cell.home };
        let no_way = |leg| PlanError::NoWay { arm: cell.solver.arm().name.clone(), leg };
        for ((job, way), start) in jobs.into_iter().zip(ways).zip(starts) {
            let changes = job.layer != pen;
            let from = if changes { *service } else { list.at };
            let way = if from == start { way } else { travel(cell, &from, &ends(&job.drawn.press).0, limits) };
            let Some(way) = way else {
                let (first, last, sheet) = job.span;
                reach.reachable_length -= job.length;
                reach.unreachable.push(Unreachable {
                    layer: job.layer,
                    layer_name: drawing.layers[job.layer].name.clone(),
                    stroke: job.stroke,
                    first,
                    last,
                    sheet,
                    length: job.length,
                    reason: Obstruction::NoApproach,
                });
                continue;
            };
            if changes {
                let to = travel(cell, &list.at, service, limits).ok_or_else(|| no_way("to the service pose"))?;
                list.travel(to, job.layer, statistics);
                list.push(SegmentKind::ChangePen, job.layer, None, Trajectory::rest(*service, cell.options.pen_change));
                statistics.pen_changes += 1;
                pen = job.layer;
            }
            list.travel(way, job.layer, statistics);
            list.push(SegmentKind::Press, job.layer, Some(job.stroke), job.drawn.press);
            list.press(SegmentKind::Draw, job.layer, Some(job.stroke), job.drawn.draw, job.drawn.depth);
            list.push(SegmentKind::Lift, job.layer, Some(job.stroke), job.drawn.lift);
        }
        reach.unreachable.sort_by_key(|u| (u.layer, u.stroke, u.first));
        if !list.segments.is_empty() {
            let away = travel(cell, &list.at, service, limits).ok_or_else(|| no_way("to the service pose"))?;
            list.travel(away, pen, statistics);
        }
        Ok(list.segments)
    }

    /// Where the way to each run starts and the way, as they are when all can be travelled.
    fn ways(&self, jobs: &[Job], progress: &mut dyn FnMut(f64)) -> (Vec<JointVector>, Vec<Way>) {
        let Self { cell, service, limits, .. } = self;
        let mut ways: Vec<Way> = Vec::with_capacity(jobs.len());
        let starts: Vec<JointVector> = (0..jobs.len())
            .map(|i| match i.checked_sub(1) {
                None => cell.home,
                Some(k) if jobs[k].layer != jobs[i].layer => **service,
                Some(k) => ends(&jobs[k].drawn.lift).1,
            })
            .collect();
        for begin in (0..jobs.len()).step_by(BATCH) {
            let end = (begin + BATCH).min(jobs.len());
            let batch: Vec<Way> = (begin..end)
                .into_par_iter()
                .map(|i| travel(cell, &starts[i], &ends(&jobs[i].drawn.press).0, limits))
                .collect();
            ways.extend(batch);
            progress(0.8 + 0.19 * end as f64 / jobs.len() as f64);
        }
        (starts, ways)
    }
}

/// First and last configuration of a trajectory.
fn ends(t: &Trajectory) -> (JointVector, JointVector) {
    (t.knots()[0].q, t.knots()[t.knots().len() - 1].q)
}

type Way = Option<(Trajectory, TravelKind)>;

/// Segments in time.
struct Segments {
    segments: Vec<Segment>,
    time: f64,
    at: JointVector,
}

impl Segments {
    fn push(&mut self, kind: SegmentKind, layer: usize, stroke: Option<usize>, trajectory: Trajectory) {
        self.press(kind, layer, stroke, trajectory, DepthProfile::default());
    }

    fn press(
        &mut self,
        kind: SegmentKind,
        layer: usize,
        stroke: Option<usize>,
        trajectory: Trajectory,
        depth: DepthProfile,
    ) {
        self.at = ends(&trajectory).1;
        let start = self.time;
        self.time += trajectory.duration();
        self.segments.push(Segment { kind, layer, stroke, start, trajectory, depth });
    }

    fn travel(&mut self, (trajectory, kind): (Trajectory, TravelKind), layer: usize, statistics: &mut PlanStatistics) {
        match kind {
            TravelKind::Direct => statistics.travels_direct += 1,
            TravelKind::Raised => statistics.travels_raised += 1,
            TravelKind::Searched => statistics.travels_searched += 1,
        }
        self.push(SegmentKind::Travel, layer, None, trajectory);
    }
}
