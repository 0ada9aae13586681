//! A run of a stroke as motion: press, draw, lift.
use nalgebra::Vector3;

use crate::plan::depth::DepthSpline;
use crate::plan::field::Workcell;
use crate::plan::path::Run;
use crate::plan::reach::Obstruction;
use crate::plan::spline::JointSpline;
use crate::plan::surroundings::PenUse;
use crate::plan::timing::{PathPoint, Piece, join};
use crate::plan::waypoint::{Waypoint, midway};
use crate::plan::{DepthProfile, DepthSample, Knot, MotionLimits, PenTarget, Posture, Trajectory};
use crate::robot::JointVector;

/// The motion of one run.
#[derive(Clone, Debug)]
pub struct DrawnRun {
    /// From the hover height down to the press depth.
    pub press: Trajectory,
    /// Along the line.
    pub draw: Trajectory,
    /// Press depth on the way along the line.
    pub depth: DepthProfile,
    /// Up to the hover height.
    pub lift: Trajectory,
    /// Largest distance of the tip from the desired line half-way between two waypoints, m.
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
/// A line that begins lightly is touched at least at this share of the landing speed, ...
const GENTLEST: f64 = 0.1;
/// ... which is taken from this height on, m.
const GENTLE_ABOVE: f64 = 5e-4;
/// How much faster it may go on once it touches: then only the spring of the impedance law is wound up.
const PRESSING: f64 = 2.0;
/// Rest at the press depth before the line begins, s.
const SETTLING: f64 = 0.15;
/// Distance between poses on the way up and down, m.
const VERTICAL_STEP: f64 = 0.0015;
/// Passes that add poses where the joint path strays.
const REFINEMENTS: usize = 4;
/// Largest angle between pen and desired axis half-way between two waypoints, rad.
const AXIS_DEVIATION: f64 = 1e-3;

/// Times `run`: the pen comes straight down, stops at corners, and goes straight up.
pub fn draw(cell: &Workcell, way: &[Waypoint], run: &Run, limits: &MotionLimits) -> Result<DrawnRun, Obstruction> {
    let end = run.q.len() - 1;
    let up_at = |k: usize| upright(cell, &way[run.first + k], &run.q[k]);
    let (first, last) = (up_at(0)?, up_at(end)?);
    let mut poses = first.0.len() + last.0.len();
    let press = vertical(cell, first, true, limits);
    let lift = vertical(cell, last, false, limits);
    let mut deviation: f64 = 0.0;
    let mut pieces = Vec::new();
    let mut begin = 0;
    for k in 1..=end {
        if k == end || way[run.first + k].corner {
            let places = &way[run.first + begin..=run.first + k];
            let (targets, depths): (Vec<PenTarget>, Vec<f64>) = places.iter().map(|w| (w.target, w.depth)).unzip();
            let (piece, depths, strayed) = refine(cell, targets, depths, run.q[begin..=k].to_vec());
            deviation = deviation.max(strayed);
            poses += piece.spline.waypoints().len();
            pieces.push((piece, depths));
            begin = k;
        }
    }
    let timed: Vec<_> = pieces.iter().map(|(piece, _)| piece.time_along(limits)).collect();
    let depth = depth_over_time(&pieces, &timed).unwrap_or_else(|| DepthProfile::constant(way[run.first].depth));
    let draw = join(timed.into_iter().map(|(knots, _)| knots)).unwrap_or_else(|| Trajectory::rest(run.q[0], DOT_TIME));
    Ok(DrawnRun { press, draw, depth, lift, deviation, poses })
}

/// Press depth at the knots of all pieces, one after another; `None` where it is the same everywhere.
fn depth_over_time(pieces: &[(Piece, Vec<f64>)], timed: &[(Vec<Knot>, Vec<PathPoint>)]) -> Option<DepthProfile> {
    let first = pieces.first()?.1[0];
    if pieces.iter().flat_map(|(_, depths)| depths).all(|d| *d == first) {
        return None;
    }
    let (mut knots, mut offset): (Vec<(f64, DepthSample)>, f64) = (Vec::new(), 0.0);
    for ((piece, depths), (times, path)) in pieces.iter().zip(timed) {
        let spline = DepthSpline::new(piece.spline.parameters().to_vec(), depths);
        let mut cursor = 0;
        // a piece begins where the one before it ended
        for (knot, p) in times.iter().zip(path).skip(usize::from(!knots.is_empty())) {
            knots.push((offset + knot.time, spline.at(p.s, p.speed, p.acceleration, &mut cursor)));
        }
        offset = knots.last().map_or(0.0, |k| k.0);
    }
    Some(DepthProfile::new(knots))
}

/// A smooth piece through the configurations of `targets`, with more of them where the tip would stray from the line
/// between two targets; the press depths there; and how far it strays half-way.
fn refine(
    cell: &Workcell,
    mut targets: Vec<PenTarget>,
    mut depths: Vec<f64>,
    mut q: Vec<JointVector>,
) -> (Piece, Vec<f64>, f64) {
    let options = cell.options;
    let arm = cell.solver.arm();
    let mut pass = 0;
    loop {
        let piece = pressed_piece(cell, &targets, &depths, q.clone());
        let (worst, stray) = strays(arm, &piece.spline, &targets, options.path_tolerance);
        if stray.is_empty() || pass == REFINEMENTS {
            return (piece, depths, worst);
        }
        pass += 1;
        let (mut more, mut more_q) = (Vec::with_capacity(targets.len()), Vec::with_capacity(q.len()));
        let mut more_depths = Vec::with_capacity(depths.len());
        let mut stray = stray.into_iter().peekable();
        for i in 0..targets.len() {
            more.push(targets[i]);
            more_q.push(q[i]);
            more_depths.push(depths[i]);
            if stray.next_if(|k| *k == i).is_some() {
                let target = midway(&targets[i], &targets[i + 1]);
                let guess = (q[i] + q[i + 1]) * 0.5;
                let still = Posture { reference: guess, pull: 0.0, most: 0.0 };
                if let Ok(s) = cell.solver.follow(&target, &guess, &still) {
                    more.push(target);
                    more_q.push(s.q);
                    more_depths.push(0.5 * (depths[i] + depths[i + 1]));
                }
            }
        }
        if more.len() == targets.len() {
            return (piece, depths, worst);
        }
        (targets, depths, q) = (more, more_depths, more_q);
    }
}

/// The piece through `targets`. Its parameter and speed are those along the line, however the depth changes; where that
/// changes fast, the line is passed more slowly.
fn pressed_piece(cell: &Workcell, targets: &[PenTarget], depths: &[f64], q: Vec<JointVector>) -> Piece {
    let options = cell.options;
    let level = |(t, d): (&PenTarget, &f64)| t.position.coords - t.axis * (d - depths[0]);
    let positions: Vec<Vector3<f64>> = targets.iter().zip(depths).map(level).collect();
    let mut piece = Piece::new(q, &positions, options.pen_speed);
    let s = piece.spline.parameters();
    for i in 1..depths.len() {
        let slope = (depths[i] - depths[i - 1]).abs() / (s[i] - s[i - 1]);
        let most = options.press_rate / slope.max(1e-9);
        for speed in &mut piece.speed[i - 1..=i] {
            *speed = speed.min(most);
        }
    }
    piece
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
        let desired = midway(&targets[i], &targets[i + 1]);
        let tip = *arm.kinematics(&spline.at(0.5 * (s[i] + s[i + 1]), &mut cursor).q).world_from_tip();
        // distance from the line: being early or late on it is no error
        let along = (targets[i + 1].position - targets[i].position).try_normalize(1e-12).unwrap_or_default();
        let offset = tip.translation.vector - desired.position.coords;
        let distance = (offset - along * along.dot(&offset)).norm();
        let angle = (tip.rotation * Vector3::z()).cross(&desired.axis).norm();
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

fn upright(cell: &Workcell, at: &Waypoint, q: &JointVector) -> Result<Upright, Obstruction> {
    let hover = cell.options.hover;
    rise(cell, at, q, hover).or_else(|reason| rise(cell, at, q, 0.5 * hover).map_err(|_| reason))
}

fn rise(cell: &Workcell, place: &Waypoint, start: &JointVector, hover: f64) -> Result<Upright, Obstruction> {
    let (target, depth) = (&place.target, place.depth);
    let arm = cell.solver.arm();
    // a light touch is gentle over the last bit only, which takes poses nearer to each other
    let step = if depth < cell.options.press.default { GENTLE_ABOVE } else { VERTICAL_STEP };
    let steps = ((hover + depth) / step).ceil().max(2.0) as usize;
    let (mut q, mut heights) = (vec![*start], vec![-depth]);
    for i in 1..=steps {
        let way = (hover + depth) * i as f64 / steps as f64;
        let at = PenTarget { position: target.position - target.axis * way, axis: target.axis };
        let still = Posture { reference: *start, pull: 0.0, most: 0.0 };
        let s = cell.solver.follow(&at, &q[i - 1], &still).map_err(|f| Obstruction::from_failure(arm, &f))?;
        if i == steps || i == steps / 2 {
            let use_of_pen = if i == steps { PenUse::Travelling } else { PenUse::Drawing };
            let clearance = cell.surroundings.clearance(&s.kinematics, use_of_pen);
            if !clearance.is_clear() {
                return Err(Obstruction::from_clearance(arm, &clearance));
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
    // the nib strikes with a force in proportion to its speed: no harder than it is to press
    let deepest = -heights.iter().copied().fold(0.0, f64::min);
    let share = if deepest < options.press.default { (deepest / options.press.default).max(GENTLEST) } else { 1.0 };
    for (speed, height) in piece.speed.iter_mut().zip(&heights) {
        let bound = match *height {
            h if h > TOUCH_ABOVE => continue,
            _ if !down => options.pen_speed,
            h if h > GENTLE_ABOVE => options.landing_speed,
            h if h > -TOUCH_BELOW => options.landing_speed * share,
            _ => options.landing_speed * share * PRESSING,
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
