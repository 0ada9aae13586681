//! A run of a stroke as motion: press, draw, lift.
use nalgebra::Vector3;

use crate::plan::field::Workcell;
use crate::plan::path::Run;
use crate::plan::reach::Obstruction;
use crate::plan::spline::JointSpline;
use crate::plan::surroundings::PenUse;
use crate::plan::timing::{Piece, join};
use crate::plan::waypoint::{Waypoint, midway};
use crate::plan::{Knot, MotionLimits, PenTarget, Posture, Trajectory};
use crate::robot::JointVector;

/// The motion of one run.
#[derive(Clone, Debug)]
pub struct DrawnRun {
    /// From the hover height down to the press depth.
    pub press: Trajectory,
    /// Along the line.
    pub draw: Trajectory,
    /// Up to the hover height.
    pub lift: Trajectory,
    /// Largest distance of the tip from the wished line half-way between two waypoints, m.
    pub deviation: f64,
    /// Poses solved.
    pub poses: usize,
}

/// How long a dot is pressed, s.
const DOT_TIME: f64 = 0.2;
/// The pen comes down at landing speed from this height over the believed canvas, m, ...
const TOUCH_ABOVE: f64 = 0.0015;
/// ... to this depth under it, m: there it touches.
const TOUCH_BELOW: f64 = 3e-4;
/// How much faster it may go on once it touches: then only the spring of the impedance law is wound up.
const PRESSING: f64 = 2.0;
/// Rest at the press depth before the line begins, s.
const SETTLING: f64 = 0.15;
/// Distance between poses on the way up and down, m.
const VERTICAL_STEP: f64 = 0.0015;
/// Passes that add poses where the joint path strays.
const REFINEMENTS: usize = 4;
/// Largest angle between pen and wished axis half-way between two waypoints, rad.
const AXIS_DEVIATION: f64 = 1e-3;

/// Times `run`: the pen comes straight down, stops at corners, and goes straight up.
pub fn draw(cell: &Workcell, way: &[Waypoint], run: &Run, limits: &MotionLimits) -> Result<DrawnRun, Obstruction> {
    let end = run.q.len() - 1;
    let up_at = |k: usize| upright(cell, &way[run.first + k].target, &run.q[k]);
    let (first, last) = (up_at(0)?, up_at(end)?);
    let mut poses = first.0.len() + last.0.len();
    let press = vertical(cell, first, true, limits);
    let lift = vertical(cell, last, false, limits);
    let mut deviation: f64 = 0.0;
    let mut pieces = Vec::new();
    let mut begin = 0;
    for k in 1..=end {
        if k == end || way[run.first + k].corner {
            let targets: Vec<PenTarget> = way[run.first + begin..=run.first + k].iter().map(|w| w.target).collect();
            let (piece, strayed) = refine(cell, targets, run.q[begin..=k].to_vec());
            deviation = deviation.max(strayed);
            poses += piece.spline.waypoints().len();
            pieces.push(piece);
            begin = k;
        }
    }
    let draw = join(pieces.iter().map(|p| p.time(limits))).unwrap_or_else(|| Trajectory::rest(run.q[0], DOT_TIME));
    Ok(DrawnRun { press, draw, lift, deviation, poses })
}

/// A smooth piece through the configurations of `targets`, with more of them where the tip would stray from the line
/// between two targets; and how far it strays half-way.
fn refine(cell: &Workcell, mut targets: Vec<PenTarget>, mut q: Vec<JointVector>) -> (Piece, f64) {
    let options = cell.options;
    let arm = cell.solver.arm();
    let mut pass = 0;
    loop {
        let positions: Vec<Vector3<f64>> = targets.iter().map(|t| t.position.coords).collect();
        let piece = Piece::new(q.clone(), &positions, options.pen_speed);
        let (worst, stray) = strays(arm, &piece.spline, &targets, options.path_tolerance);
        if stray.is_empty() || pass == REFINEMENTS {
            return (piece, worst);
        }
        pass += 1;
        let (mut more, mut more_q) = (Vec::with_capacity(targets.len()), Vec::with_capacity(q.len()));
        let mut stray = stray.into_iter().peekable();
        for i in 0..targets.len() {
            more.push(targets[i]);
            more_q.push(q[i]);
            if stray.next_if(|k| *k == i).is_some() {
                let target = midway(&targets[i], &targets[i + 1]);
                let guess = (q[i] + q[i + 1]) * 0.5;
                let still = Posture { reference: guess, pull: 0.0, most: 0.0 };
                if let Ok(s) = cell.solver.follow(&target, &guess, &still) {
                    more.push(target);
                    more_q.push(s.q);
                }
            }
        }
        if more.len() == targets.len() {
            return (piece, worst);
        }
        (targets, q) = (more, more_q);
    }
}

/// Largest deviation (m) half-way between targets, and the intervals where position or axis stray too far.
fn strays(
    arm: &crate::robot::ArmModel,
    spline: &JointSpline,
    targets: &[PenTarget],
    tolerance: f64,
) -> (f64, Vec<usize>) {
    let s = spline.parameters();
    let (mut worst, mut stray, mut cursor): (f64, Vec<usize>, usize) = (0.0, Vec::new(), 0);
    for i in 0..targets.len() - 1 {
        let wished = midway(&targets[i], &targets[i + 1]);
        let tip = *arm.kinematics(&spline.at(0.5 * (s[i] + s[i + 1]), &mut cursor).q).world_from_tip();
        // distance from the line: being early or late on it is no error
        let along = (targets[i + 1].position - targets[i].position).try_normalize(1e-12).unwrap_or_default();
        let offset = tip.translation.vector - wished.position.coords;
        let distance = (offset - along * along.dot(&offset)).norm();
        let angle = (tip.rotation * Vector3::z()).cross(&wished.axis).norm();
        worst = worst.max(distance);
        if distance > 0.7 * tolerance || angle > AXIS_DEVIATION {
            stray.push(i);
        }
    }
    (worst, stray)
}

/// Configurations and heights over the canvas (m) from the press depth up to the hover height; half of it where all is
/// too much for the arm.
type Upright = (Vec<JointVector>, Vec<f64>);

fn upright(cell: &Workcell, target: &PenTarget, q: &JointVector) -> Result<Upright, Obstruction> {
    let hover = cell.options.hover;
    rise(cell, target, q, hover).or_else(|reason| rise(cell, target, q, 0.5 * hover).map_err(|_| reason))
}

fn rise(cell: &Workcell, target: &PenTarget, start: &JointVector, hover: f64) -> Result<Upright, Obstruction> {
    let depth = cell.options.press_depth;
    let arm = cell.solver.arm();
    let steps = ((hover + depth) / VERTICAL_STEP).ceil().max(2.0) as usize;
    let (mut q, mut heights) = (vec![*start], vec![-depth]);
    for i in 1..=steps {
        let way = (hover + depth) * i as f64 / steps as f64;
        let at = PenTarget { position: target.position - target.axis * way, axis: target.axis };
        let still = Posture { reference: *start, pull: 0.0, most: 0.0 };
        let s = cell.solver.follow(&at, &q[i - 1], &still).map_err(|f| Obstruction::from_failure(arm, &f))?;
        if i == steps || i == steps / 2 {
            let use_of_pen = if i == steps { PenUse::Travelling } else { PenUse::Drawing };
            let room = cell.surroundings.room(&s.kinematics, use_of_pen);
            if !room.is_clear() {
                return Err(Obstruction::from_room(arm, &room));
            }
        }
        q.push(s.q);
        heights.push(way - depth);
    }
    Ok((q, heights))
}

/// The motion straight up, or straight `down`: fast in the air, slow where the nib may touch.
fn vertical(cell: &Workcell, (mut q, mut heights): Upright, down: bool, limits: &MotionLimits) -> Trajectory {
    let options = cell.options;
    if down {
        q.reverse();
        heights.reverse();
    }
    // the path is a straight line: its heights are coordinates enough
    let positions: Vec<Vector3<f64>> = heights.iter().map(|h| Vector3::new(0.0, 0.0, *h)).collect();
    let mut piece = Piece::new(q, &positions, options.travel_speed);
    for (speed, height) in piece.speed.iter_mut().zip(&heights) {
        let bound = match *height {
            h if h > TOUCH_ABOVE => continue,
            _ if !down => options.pen_speed,
            h if h > -TOUCH_BELOW => options.landing_speed,
            _ => options.landing_speed * PRESSING,
        };
        *speed = speed.min(bound);
    }
    let mut knots = piece.time(limits);
    if down {
        // the nib and the arm come to rest before the line begins
        let end = knots[knots.len() - 1];
        knots.push(Knot { time: end.time + SETTLING, ..end });
    }
    Trajectory::new(knots)
}
