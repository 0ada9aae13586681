//! From a drawing on a believed surface to everything that one arm does.
use nalgebra::Point2;
use rayon::prelude::*;

use crate::mesh::TriMesh;
use crate::plan::field::{PostureField, Workcell};
use crate::plan::motion::{TravelKind, travel};
use crate::plan::path::{Run, StrokePath, solve};
use crate::plan::reach::{Obstruction, ReachReport, Unreachable};
use crate::plan::stroke::{DrawnRun, draw};
use crate::plan::surroundings::{PenUse, Surroundings};
use crate::plan::waypoint::{Waypoint, waypoints};
use crate::plan::{
    ArmPlan, DepthProfile, IkSolver, MotionLimits, PenTarget, PlanOptions, Segment, SegmentKind, Trajectory,
};
use crate::robot::{ArmModel, JointVector};
use crate::surface::{BelievedCanvas, SurfaceDrawing};

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// An option makes no sense.
    #[error("{name} is {value}, but must be {wanted}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// What it is.
        value: f64,
        /// What would be right.
        wanted: &'static str,
    },
    /// A pose that the arm starts from or waits in passes a joint limit.
    #[error("the {pose} pose of {arm} puts joint {joint} at {value:.3}, outside its limits {lower:.3} to {upper:.3}")]
    PoseOutsideLimits {
        /// Name of the arm.
        arm: String,
        /// `home` or `service`.
        pose: &'static str,
        /// Name of the joint.
        joint: String,
        /// Position asked for, rad.
        value: f64,
        /// Lower limit, rad.
        lower: f64,
        /// Upper limit, rad.
        upper: f64,
    },
    /// A pose that the arm starts from or waits in is not free.
    #[error("the {pose} pose of {arm} is not free: {reason}; move the pose, or what stands there")]
    PoseObstructed {
        /// Name of the arm.
        arm: String,
        /// `home` or `service`.
        pose: &'static str,
        /// What is in the way.
        reason: Obstruction,
    },
    /// There is no free way between two poses that must both be taken.
    #[error("no free way for {arm} {leg} was found; move the pose, or what stands between")]
    NoWay {
        /// Name of the arm.
        arm: String,
        /// From where to where.
        leg: &'static str,
    },
    /// Some of the drawing can't be reached.
    #[error("{report}; use partial = true to draw the rest")]
    Unreachable {
        /// All that can't be reached.
        report: Box<ReachReport>,
    },
}

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

/// What an arm does, what it can't do, and figures.
#[derive(Clone, Debug)]
pub struct Planned {
    /// Segments from home to the service pose.
    pub plan: ArmPlan,
    /// What is drawn and what is not.
    pub reach: ReachReport,
    /// Figures.
    pub statistics: PlanStatistics,
}

/// Strokes (or travels) that are planned between two reports of progress.
const BATCH: usize = 64;

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
struct Solved {
    path: StrokePath,
    drawn: Vec<(Run, DrawnRun)>,
    length: f64,
    drawn_length: f64,
    way: Vec<Waypoint>,
}

/// What is to be planned: a drawing, and the arm that draws it.
#[derive(Clone, Copy)]
pub struct PlanJob<'a> {
    /// Number of the arm in the cell.
    pub arm_index: usize,
    /// The arm as it believes itself to be.
    pub arm: &'a ArmModel,
    /// Where it starts at rest, with the first ink's pen in its holder, rad.
    pub home: &'a JointVector,
    /// Where pens are changed, and where it ends, clear of the drawing, rad.
    pub service: &'a JointVector,
    /// The drawing on the believed canvas.
    pub drawing: &'a SurfaceDrawing,
    /// The believed canvas.
    pub canvas: &'a BelievedCanvas,
    /// The furniture, world.
    pub obstacles: &'a [TriMesh],
}

/// Plans all of a drawing for one arm.
///
/// `progress` hears the done share, from 0 to 1. Strokes are solved in parallel, each
/// apart from the others in postures that are common to the drawing, so the plan is the same bits at any thread count.
///
/// # Errors
/// [`PlanError::Unreachable`] when something can't be drawn and `options.partial` is false; others for poses and
/// options that can't be used.
pub fn plan(job: &PlanJob, options: &PlanOptions, progress: &mut dyn FnMut(f64)) -> Result<Planned, PlanError> {
    let PlanJob { arm_index, arm, home, service, drawing, canvas, obstacles } = *job;
    if let Some((name, value, wanted)) = options.invalid() {
        return Err(PlanError::Option { name, value, wanted });
    }
    let cell = Workcell {
        solver: IkSolver::new(arm, options.limit_margin),
        surroundings: Surroundings::new(arm, &canvas.mesh, obstacles, options),
        options,
        home: *home,
    };
    let limits = MotionLimits::new(arm, options);
    check_pose(&cell, "home", home)?;
    check_pose(&cell, "service", service)?;

    let strokes = drawing.sequence();
    let ways: Vec<Vec<Waypoint>> =
        strokes.par_iter().map(|(l, s)| waypoints(&drawing.layers[*l].strokes[*s].targets, *l, options)).collect();
    let targets: Vec<PenTarget> = ways.iter().flatten().map(|w| w.target).collect();
    let field = PostureField::new(&cell, &targets);
    drop(targets);
    progress(0.05);

    let mut statistics = PlanStatistics::default();
    let mut reach = ReachReport::default();
    let mut jobs: Vec<Job> = Vec::new();
    let mut done = 0;
    for batch in ways.chunks(BATCH) {
        let solved: Vec<Solved> = batch.par_iter().map(|way| solve_stroke(&cell, &field, way, &limits)).collect();
        for s in solved {
            let (layer, stroke) = strokes[done];
            collect(drawing, layer, stroke, s, &mut reach, &mut statistics, &mut jobs);
            done += 1;
        }
        progress(0.05 + 0.75 * done as f64 / ways.len() as f64);
    }
    if !options.partial && !reach.unreachable.is_empty() {
        return Err(PlanError::Unreachable { report: Box::new(reach) });
    }

    let segments = assemble(&cell, service, drawing, jobs, &limits, &mut reach, &mut statistics, progress)?;
    if !options.partial && !reach.unreachable.is_empty() {
        return Err(PlanError::Unreachable { report: Box::new(reach) });
    }
    progress(1.0);
    Ok(Planned { plan: ArmPlan { arm: arm_index, segments }, reach, statistics })
}

/// A pose must be within the limits and free.
fn check_pose(cell: &Workcell, pose: &'static str, q: &JointVector) -> Result<(), PlanError> {
    let arm = cell.solver.arm();
    for (i, joint) in arm.joints.iter().enumerate() {
        if !(q[i] >= joint.lower && q[i] <= joint.upper) {
            return Err(PlanError::PoseOutsideLimits {
                arm: arm.name.clone(),
                pose,
                joint: joint.name.clone(),
                value: q[i],
                lower: joint.lower,
                upper: joint.upper,
            });
        }
    }
    let clearance = cell.surroundings.clearance(&arm.kinematics(q), PenUse::Travelling);
    if clearance.is_clear() {
        return Ok(());
    }
    Err(PlanError::PoseObstructed { arm: arm.name.clone(), pose, reason: Obstruction::from_clearance(arm, &clearance) })
}

fn solve_stroke(cell: &Workcell, field: &PostureField, way: &[Waypoint], limits: &MotionLimits) -> Solved {
    let mut path = solve(cell, field, way);
    let mut drawn = Vec::new();
    for run in std::mem::take(&mut path.runs) {
        match draw(cell, way, &run, limits) {
            Ok(d) => drawn.push((run, d)),
            Err(reason) => path.gaps.push(crate::plan::path::Gap { first: run.first, last: run.last(), reason }),
        }
    }
    path.gaps.sort_by_key(|g| g.first);
    let length = length(way, 0, way.len().saturating_sub(1));
    let drawn_length = drawn.iter().map(|(r, _)| self::length(way, r.first, r.last())).sum();
    Solved { path, drawn, length, drawn_length, way: way.to_vec() }
}

/// Length of the line from waypoint `a` to waypoint `b`, m.
fn length(way: &[Waypoint], a: usize, b: usize) -> f64 {
    (a..b).map(|i| (way[i + 1].target.position - way[i].target.position).norm()).sum()
}

/// Books one stroke.
fn collect(
    drawing: &SurfaceDrawing,
    layer: usize,
    stroke: usize,
    solved: Solved,
    reach: &mut ReachReport,
    statistics: &mut PlanStatistics,
    jobs: &mut Vec<Job>,
) {
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
        reach.unreachable.push(Unreachable { layer, layer_name, stroke: of.index, first, last, sheet, length, reason });
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

/// First and last configuration of a trajectory.
fn ends(t: &Trajectory) -> (JointVector, JointVector) {
    (t.knots()[0].q, t.knots()[t.knots().len() - 1].q)
}

type Way = Option<(Trajectory, TravelKind)>;

/// Joins the runs by travels and pen changes.
#[allow(clippy::too_many_arguments)]
fn assemble(
    cell: &Workcell,
    service: &JointVector,
    drawing: &SurfaceDrawing,
    jobs: Vec<Job>,
    limits: &MotionLimits,
    reach: &mut ReachReport,
    statistics: &mut PlanStatistics,
    progress: &mut dyn FnMut(f64),
) -> Result<Vec<Segment>, PlanError> {
    let Some(first) = jobs.first() else { return Ok(Vec::new()) };
    let mut pen = first.layer;
    // the ways between neighbours, as they are when all can be travelled
    let mut ways: Vec<Way> = Vec::with_capacity(jobs.len());
    let starts: Vec<JointVector> = (0..jobs.len())
        .map(|i| match i.checked_sub(1) {
            None => cell.home,
            Some(k) if jobs[k].layer != jobs[i].layer => *service,
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
