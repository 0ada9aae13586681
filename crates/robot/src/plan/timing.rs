//! From a path to a motion: how fast each place may be passed, and a jerk-limited way through.
use nalgebra::Vector3;

use crate::plan::spline::{JointSpline, SplinePoint};
use crate::plan::trajectory::MotionPeaks;
use crate::plan::{Knot, MotionLimits, Trajectory};
use crate::robot::JointVector;

/// How a path is passed at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// Where on it, m.
    pub s: f64,
    /// How fast, m/s.
    pub speed: f64,
    /// How fast that grows, m/s2.
    pub acceleration: f64,
}

/// A smooth piece of a path, from rest to rest.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Joint positions over the tip's arc length, m.
    pub spline: JointSpline,
    /// Curvature of the tip's path at the waypoints, 1/m.
    pub curvature: Vec<f64>,
    /// Speed of the tip allowed at the waypoints, m/s.
    pub speed: Vec<f64>,
}

/// Share of an acceleration limit that passing a bend may use; the rest is left to speed up and slow down.
const BEND_SHARE: f64 = 0.7;
/// Share of the jerk limit that starting and stopping may use; the rest is left to bends.
const JERK_SHARE: f64 = 0.6;
/// Bends ask for no speed below this, m/s: a path whose bends would need less is slowed as a whole.
const LEAST_SPEED: f64 = 2e-4;
/// Time between knots, s.
const KNOT_INTERVAL: f64 = 0.008;

impl Piece {
    /// A piece through `waypoints` (joints) where the tip passes `positions`; `speed` holds at every waypoint.
    pub fn new(waypoints: Vec<JointVector>, positions: &[Vector3<f64>], speed: f64) -> Self {
        let mut s = vec![0.0; waypoints.len()];
        for i in 1..s.len() {
            // a path that only turns the pen still needs a parameter that rises
            s[i] = s[i - 1] + (positions[i] - positions[i - 1]).norm().max(1e-6);
        }
        let n = positions.len();
        let curvature = (0..n)
            .map(|i| {
                let i = i.clamp(1, n.saturating_sub(2).max(1));
                if i + 1 >= n { 0.0 } else { bend(&positions[i - 1], &positions[i], &positions[i + 1]) }
            })
            .collect();
        Self { speed: vec![speed; n], curvature, spline: JointSpline::new(s, waypoints) }
    }

    /// Knots of the fastest motion along the piece, from rest at time 0 to rest, that keeps `limits`.
    ///
    /// The speed over the path is the largest below the local bounds from which the acceleration limits can be kept
    /// (a forward and a backward pass, Bobrow et al. 1985, doi:10.1177/027836498500400301). A moving average in
    /// time then rounds its corners, which bounds the jerk and keeps the length. The bounds are first widened by the
    /// distance the average reaches. What still exceeds a limit by more than 1 % is cured by slowing the whole piece.
    pub fn time(&self, limits: &MotionLimits) -> Vec<Knot> {
        self.time_along(limits).0
    }

    /// [`time`](Self::time), and how the path is passed at each knot.
    pub fn time_along(&self, limits: &MotionLimits) -> (Vec<Knot>, Vec<PathPoint>) {
        let grid = Grid::new(self, limits);
        let mut profile = grid.profile(&grid.bound, limits);
        let mut window = grid.averaging_time(&profile, limits);
        if grid.bound.iter().any(|v| *v < grid.top * 0.999) {
            profile = grid.profile(&grid.widened(window), limits);
            window = window.max(grid.averaging_time(&profile, limits));
        }
        let (mut knots, mut path) = self.average(&grid, &profile, window);
        let excess = excess(&MotionPeaks::of(&knots), limits);
        if excess > 1.0 {
            slow_down(&mut knots, &mut path, excess);
        }
        (knots, path)
    }

    /// Knots of the motion whose path speed is the moving average over `window` (s) of the profile.
    fn average(&self, grid: &Grid, profile: &[f64], window: f64) -> (Vec<Knot>, Vec<PathPoint>) {
        let walk = Walk::new(&grid.s, profile);
        let duration = walk.duration() + window;
        let count = (duration / KNOT_INTERVAL).ceil().max(1.0) as usize;
        let (mut early, mut late, mut cursor) = (0, 0, 0);
        (0..=count)
            .map(|i| {
                let time = duration * i as f64 / count as f64;
                let (now, before) = (walk.at(time, &mut late), walk.at(time - window, &mut early));
                let (speed, acceleration) = ((now.s - before.s) / window, (now.v - before.v) / window);
                let s = (now.integral - before.integral) / window;
                let p = self.spline.at(s, &mut cursor);
                if i == 0 || i == count {
                    let q = if i == 0 {
                        self.spline.waypoints()[0]
                    } else {
                        self.spline.waypoints()[self.spline.waypoints().len() - 1]
                    };
                    let s = if i == 0 { 0.0 } else { self.spline.end() };
                    let rest = PathPoint { s, speed: 0.0, acceleration: 0.0 };
                    return (Knot { time, q, qd: JointVector::zeros(), qdd: JointVector::zeros() }, rest);
                }
                let knot = Knot { time, q: p.q, qd: p.d1 * speed, qdd: p.d2 * (speed * speed) + p.d1 * acceleration };
                (knot, PathPoint { s, speed, acceleration })
            })
            .unzip()
    }
}

/// How many times slower the motion must be to keep `limits`; at most 1 when it does (within 1 %).
fn excess(peaks: &MotionPeaks, limits: &MotionLimits) -> f64 {
    let mut worst: f64 = 0.0;
    for i in 0..peaks.speed.len() {
        worst = worst
            .max(peaks.speed[i] / limits.speed[i])
            .max((peaks.acceleration[i] / limits.acceleration[i]).sqrt())
            .max((peaks.jerk[i] / limits.jerk[i]).cbrt());
    }
    if worst > 1.003 { worst } else { worst.min(1.0) }
}

/// The same motion, `factor` times slower.
fn slow_down(knots: &mut [Knot], path: &mut [PathPoint], factor: f64) {
    for p in path {
        p.speed /= factor;
        p.acceleration /= factor * factor;
    }
    for k in knots {
        k.time *= factor;
        k.qd /= factor;
        k.qdd /= factor * factor;
    }
}

/// Fine samples of a piece with the speed bound at each.
struct Grid {
    s: Vec<f64>,
    points: Vec<SplinePoint>,
    curvature: Vec<f64>,
    bound: Vec<f64>,
    /// Largest bound.
    top: f64,
}

impl Grid {
    fn new(piece: &Piece, limits: &MotionLimits) -> Self {
        let parameters = piece.spline.parameters();
        let intervals = parameters.len() - 1;
        let cells = if intervals >= 6 { 2 } else { 12_usize.div_ceil(intervals) };
        let mut grid = Self { s: vec![], points: vec![], curvature: vec![], bound: vec![], top: 0.0 };
        let mut cursor = 0;
        for i in 0..intervals {
            let last = i + 1 == intervals;
            for c in 0..cells + usize::from(last) {
                let f = c as f64 / cells as f64;
                let s = parameters[i] + f * (parameters[i + 1] - parameters[i]);
                let p = piece.spline.at(s, &mut cursor);
                let curvature = piece.curvature[i].max(piece.curvature[i + 1]);
                let asked = piece.speed[i].min(piece.speed[i + 1]);
                let mut v = asked;
                v = v.min((BEND_SHARE * limits.cartesian_acceleration / curvature.max(1e-9)).sqrt());
                for j in 0..p.q.len() {
                    v = v.min(limits.speed[j] / p.d1[j].abs().max(1e-9));
                    v = v.min((BEND_SHARE * limits.acceleration[j] / p.d2[j].abs().max(1e-9)).sqrt());
                    v = v.min(((1.0 - JERK_SHARE) * limits.jerk[j] / p.d3[j].abs().max(1e-9)).cbrt());
                }
                grid.s.push(s);
                grid.points.push(p);
                grid.curvature.push(curvature);
                grid.bound.push(v.max(LEAST_SPEED.min(asked)));
            }
        }
        grid.top = grid.bound.iter().copied().fold(0.0, f64::max);
        grid
    }

    /// Acceleration along the path that is left at sample `i` at squared speed `b`, m/s2.
    fn capacity(&self, i: usize, b: f64, limits: &MotionLimits) -> f64 {
        let across = self.curvature[i] * b;
        let mut a = (limits.cartesian_acceleration.powi(2) - across * across).max(0.0).sqrt();
        for j in 0..limits.acceleration.len() {
            let left = limits.acceleration[j] - self.points[i].d2[j].abs() * b;
            a = a.min(left.max(0.0) / self.points[i].d1[j].abs().max(1e-9));
        }
        a.max(1e-4)
    }

    /// The largest speed at every sample that starts and ends at rest, stays below `bound` and can be reached.
    fn profile(&self, bound: &[f64], limits: &MotionLimits) -> Vec<f64> {
        let n = self.s.len();
        let mut b: Vec<f64> = bound.iter().map(|v| v * v).collect();
        (b[0], b[n - 1]) = (0.0, 0.0);
        for i in 1..n {
            let ds = self.s[i] - self.s[i - 1];
            b[i] = b[i].min(b[i - 1] + 2.0 * self.capacity(i - 1, b[i - 1], limits) * ds);
        }
        for i in (0..n - 1).rev() {
            let ds = self.s[i + 1] - self.s[i];
            b[i] = b[i].min(b[i + 1] + 2.0 * self.capacity(i + 1, b[i + 1], limits) * ds);
        }
        b.iter().map(|b| b.sqrt()).collect()
    }

    /// How long the moving average must be for the jerk that the profile's changes of acceleration make, s.
    fn averaging_time(&self, profile: &[f64], limits: &MotionLimits) -> f64 {
        let mut longest: f64 = 0.0;
        let mut before = 0.0;
        for i in 0..=self.s.len() - 1 {
            let after = if i + 1 < self.s.len() {
                (profile[i + 1].powi(2) - profile[i].powi(2)) / (2.0 * (self.s[i + 1] - self.s[i]))
            } else {
                0.0
            };
            // the average may span a start and a stop, so no difference is larger than both together
            let change = (after - before).abs().max(2.0 * after.abs().min(before.abs()));
            for j in 0..limits.jerk.len() {
                longest = longest.max(self.points[i].d1[j].abs() * change / (JERK_SHARE * limits.jerk[j]));
            }
            before = after;
        }
        longest.clamp(0.01, 0.5)
    }

    /// The bounds, each spread over the distance that a moving average of `window` (s) reaches around it.
    fn widened(&self, window: f64) -> Vec<f64> {
        let mut wide = self.bound.clone();
        for i in 0..self.s.len() {
            let v = self.bound[i];
            if v >= self.top * 0.999 {
                continue;
            }
            let reach = 0.6 * window * v + 2e-4;
            let mut k = i;
            while k > 0 && self.s[i] - self.s[k - 1] <= reach {
                k -= 1;
                wide[k] = wide[k].min(v);
            }
            k = i;
            while k + 1 < self.s.len() && self.s[k + 1] - self.s[i] <= reach {
                k += 1;
                wide[k] = wide[k].min(v);
            }
        }
        wide
    }
}

/// The walk along a path with constant acceleration between samples: place, speed and the integral of the place.
struct Walk {
    time: Vec<f64>,
    s: Vec<f64>,
    v: Vec<f64>,
    integral: Vec<f64>,
}

struct WalkPoint {
    s: f64,
    v: f64,
    integral: f64,
}

impl Walk {
    fn new(s: &[f64], v: &[f64]) -> Self {
        let (mut time, mut integral) = (vec![0.0], vec![0.0]);
        for i in 1..s.len() {
            let dt = 2.0 * (s[i] - s[i - 1]) / (v[i] + v[i - 1]).max(1e-9);
            let a = (v[i] - v[i - 1]) / dt;
            time.push(time[i - 1] + dt);
            integral.push(integral[i - 1] + dt * (s[i - 1] + dt * (0.5 * v[i - 1] + dt * a / 6.0)));
        }
        Self { time, s: s.to_vec(), v: v.to_vec(), integral }
    }

    fn duration(&self) -> f64 {
        self.time[self.time.len() - 1]
    }

    /// Standing at the start before time 0, and at the end after the walk.
    fn at(&self, t: f64, cursor: &mut usize) -> WalkPoint {
        let last = self.time.len() - 1;
        if t <= 0.0 {
            return WalkPoint { s: 0.0, v: 0.0, integral: 0.0 };
        }
        if t >= self.time[last] {
            let integral = self.integral[last] + (t - self.time[last]) * self.s[last];
            return WalkPoint { s: self.s[last], v: 0.0, integral };
        }
        while *cursor + 1 < last && self.time[*cursor + 1] <= t {
            *cursor += 1;
        }
        let i = *cursor;
        let dt = t - self.time[i];
        let a = (self.v[i + 1] - self.v[i]) / (self.time[i + 1] - self.time[i]);
        WalkPoint {
            s: self.s[i] + dt * (self.v[i] + 0.5 * a * dt),
            v: self.v[i] + a * dt,
            integral: self.integral[i] + dt * (self.s[i] + dt * (0.5 * self.v[i] + dt * a / 6.0)),
        }
    }
}

/// Curvature of the circle through three points, 1/m, as turn over mean length.
fn bend(a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>) -> f64 {
    let (u, v) = (b - a, c - b);
    let turn = u.cross(&v).norm().atan2(u.dot(&v));
    let length = 0.5 * (u.norm() + v.norm());
    if length > 1e-9 { turn / length } else { 0.0 }
}

/// One trajectory of pieces that each rest at their ends: the pen stops at the corners.
pub fn join(pieces: impl IntoIterator<Item = Vec<Knot>>) -> Option<Trajectory> {
    let mut knots: Vec<Knot> = Vec::new();
    for piece in pieces {
        let offset = knots.last().map_or(0.0, |k| k.time);
        let skip = usize::from(!knots.is_empty());
        knots.extend(piece.into_iter().skip(skip).map(|k| Knot { time: k.time + offset, ..k }));
    }
    (!knots.is_empty()).then(|| Trajectory::new(knots))
}

/// The straight joint motion from `from` to `to`, from rest to rest with least jerk, as fast as `limits` let it:
/// one quintic, whose peaks are 15/8 D/T, 10/sqrt(3) D/T^2 and 60 D/T^3 for a distance D in time T (Flash and
/// Hogan 1985, doi:10.1523/JNEUROSCI.05-07-01688.1985). `slowest` (s) is the least duration.
pub fn straight(from: &JointVector, to: &JointVector, limits: &MotionLimits, slowest: f64) -> Vec<Knot> {
    let mut duration = slowest.max(1e-3);
    for i in 0..from.len() {
        let d = (to[i] - from[i]).abs();
        if d > 0.0 {
            duration = duration
                .max(1.875 * d / limits.speed[i])
                .max((10.0 / 3f64.sqrt() * d / limits.acceleration[i]).sqrt())
                .max((60.0 * d / limits.jerk[i]).cbrt());
        }
    }
    let rest = |time, q| Knot { time, q, qd: JointVector::zeros(), qdd: JointVector::zeros() };
    vec![rest(0.0, *from), rest(duration, *to)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{PlanOptions, arms};

    fn limits() -> MotionLimits {
        MotionLimits::new(&arms::iiwa(), &PlanOptions::default())
    }

    fn piece(n: usize, f: impl Fn(f64) -> (JointVector, Vector3<f64>)) -> Piece {
        let (q, p): (Vec<_>, Vec<_>) = (0..n).map(|i| f(i as f64 / (n - 1) as f64)).unzip();
        Piece::new(q, &p, 0.04)
    }

    /// Joints that swing while the tip goes along a line, a small circle, or hardly at all.
    fn pieces() -> Vec<Piece> {
        let swing = |u: f64, k: f64| {
            JointVector::from_fn(|i, _| if i < 7 { 0.1 * ((i + 1) as f64 * k * u).sin() } else { 0.0 })
        };
        vec![
            piece(100, |u| (swing(u, 0.5), Vector3::new(0.1 * u, 0.0, 0.0))),
            piece(200, |u| (swing(u, 3.0), Vector3::new(0.2 * u, 0.0, 0.0))),
            piece(40, |u| {
                let (s, c) = (6.0 * u).sin_cos();
                (swing(u, 1.0), Vector3::new(0.005 * c, 0.005 * s, 0.0))
            }),
            piece(2, |u| (swing(u, 0.01), Vector3::new(0.0005 * u, 0.0, 0.0))),
            piece(3, |u| (swing(u, 0.2), Vector3::new(0.003 * u, 0.0, 0.0))),
        ]
    }

    #[test]
    fn limits_are_kept_on_a_dense_sampling() {
        let limits = limits();
        for (n, piece) in pieces().iter().enumerate() {
            let trajectory = Trajectory::new(piece.time(&limits));
            let (mut cursor, mut before): (usize, Option<crate::plan::MotionSample>) = (0, None);
            let dt = 5e-4;
            for i in 0..=(trajectory.duration() / dt).ceil() as usize {
                let m = trajectory.sample(i as f64 * dt, &mut cursor);
                for j in 0..7 {
                    assert!(m.qd[j].abs() <= 1.01 * limits.speed[j], "piece {n} speed {}", m.qd[j]);
                    assert!(m.qdd[j].abs() <= 1.01 * limits.acceleration[j], "piece {n} acceleration {}", m.qdd[j]);
                    if let Some(b) = before {
                        let jerk = (m.qdd[j] - b.qdd[j]) / dt;
                        assert!(jerk.abs() <= 1.02 * limits.jerk[j], "piece {n} jerk {jerk} at {i}");
                    }
                }
                before = Some(m);
            }
        }
    }

    #[test]
    fn a_long_line_is_drawn_at_the_asked_speed() {
        let piece = &pieces()[0];
        let knots = piece.time(&limits());
        let ideal = piece.spline.end() / 0.04;
        let duration = knots[knots.len() - 1].time;
        assert!(duration > ideal && duration < ideal + 0.4, "{duration} for {ideal}");
        let fastest = knots.windows(2).map(|w| (w[1].q - w[0].q).norm() / (w[1].time - w[0].time)).fold(0.0, f64::max);
        assert!(fastest > 0.0);
    }

    #[test]
    fn a_speed_is_never_raised_however_slow_it_is() {
        let short = |speed| {
            Piece::new(
                vec![JointVector::zeros(), JointVector::from_fn(|i, _| if i < 7 { 0.001 } else { 0.0 })],
                &[Vector3::zeros(), Vector3::x() * 5e-4],
                speed,
            )
        };
        for speed in [1e-4, 2e-5] {
            let knots = short(speed).time(&limits());
            let (duration, ideal) = (knots[knots.len() - 1].time, 5e-4 / speed);
            assert!(duration >= ideal && duration < 1.2 * ideal, "{duration} s for {ideal}");
        }
    }

    #[test]
    fn pieces_start_and_end_at_rest_on_their_waypoints() {
        for piece in pieces() {
            let knots = piece.time(&limits());
            let (a, b) = (&knots[0], &knots[knots.len() - 1]);
            assert_eq!((a.q, a.qd.norm(), a.qdd.norm()), (piece.spline.waypoints()[0], 0.0, 0.0));
            assert_eq!((b.qd.norm(), b.qdd.norm()), (0.0, 0.0));
            assert!((b.q - piece.spline.waypoints()[piece.spline.waypoints().len() - 1]).norm() < 1e-12);
            assert!(knots.windows(2).all(|w| w[1].time > w[0].time && w[1].time - w[0].time < 0.02));
        }
    }

    #[test]
    fn straight_motion_meets_a_limit_and_exceeds_none() {
        let limits = limits();
        for d in [1e-4, 0.01, 0.3, 2.0] {
            let to = JointVector::from_fn(|i, _| if i < 7 { d * (1.0 - 0.1 * i as f64) } else { 0.0 });
            let peaks = Trajectory::new(straight(&JointVector::zeros(), &to, &limits, 0.0)).peaks();
            let most = (0..7)
                .map(|i| {
                    (peaks.speed[i] / limits.speed[i])
                        .max(peaks.acceleration[i] / limits.acceleration[i])
                        .max(peaks.jerk[i] / limits.jerk[i])
                })
                .fold(0.0, f64::max);
            assert!(most < 1.0 + 1e-9 && most > 0.97, "{most} at {d}");
        }
    }
}
