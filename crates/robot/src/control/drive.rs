//! Drives a base along a path by what its wheels tell: straight ways and turns, each from rest to rest.
use nalgebra::{Rotation2, Vector2};
use serde::{Deserialize, Serialize};

use crate::robot::{BaseLimits, BasePose, Twist};

/// How a base drives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriveOptions {
    /// Largest speed, m/s.
    pub speed: f64,
    /// Largest yaw rate, rad/s.
    pub yaw_rate: f64,
    /// Largest acceleration, m/s2.
    pub acceleration: f64,
    /// Largest yaw acceleration, rad/s2.
    pub yaw_acceleration: f64,
    /// How fast the acceleration may change, in units of it, 1/s.
    pub jerk: f64,
    /// Length of the last stretch, m, which is gone slowly.
    pub approach: f64,
    /// Speed there, m/s.
    pub approach_speed: f64,
    /// Distance at which a way counts as gone, m.
    pub tolerance: f64,
    /// Angle at which a turn counts as made, rad.
    pub yaw_tolerance: f64,
    /// Pull towards the desired pose, 1/s.
    pub gain: f64,
    /// Time after which a stop that isn't reached is given up, beyond the planned time, s.
    pub patience: f64,
}

impl Default for DriveOptions {
    /// A careful walk that ends within 1 mm and 0.05 deg of where the wheels tell; a robot that draws on walls was driven ten times
    /// slower.
    fn default() -> Self {
        Self {
            speed: 0.25,
            yaw_rate: 0.3,
            acceleration: 0.25,
            yaw_acceleration: 0.3,
            jerk: 4.0,
            approach: 0.05,
            approach_speed: 0.02,
            tolerance: 1e-3,
            yaw_tolerance: 0.05f64.to_radians(),
            gain: 3.0,
            patience: 10.0,
        }
    }
}

impl DriveOptions {
    /// The same within what a base can do.
    pub fn within(&self, limits: &BaseLimits) -> Self {
        Self {
            speed: self.speed.min(limits.speed),
            yaw_rate: self.yaw_rate.min(limits.yaw_rate),
            acceleration: self.acceleration.min(limits.acceleration),
            yaw_acceleration: self.yaw_acceleration.min(limits.yaw_acceleration),
            ..self.clone()
        }
    }

    /// Time that a base which goes as told takes along `stops`, s, from where it stands.
    pub fn duration(&self, from: &BasePose, stops: &[BasePose]) -> f64 {
        let mut at = *from;
        let mut time = 0.0;
        for stop in stops {
            for turns in [false, true] {
                let piece = Piece::new(&at, stop, turns, self);
                time += piece.duration();
                at = piece.to;
            }
        }
        time
    }
}

/// Where a base is to drive: to each pose in turn, first there, then round.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DrivePath {
    /// The poses, world.
    pub stops: Vec<BasePose>,
    /// How it drives.
    pub options: DriveOptions,
}

/// What comes of a step of driving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveStep {
    /// The motion to command, base frame.
    Go(Twist),
    /// The path's end is reached.
    Arrived,
    /// A stop wasn't reached in time.
    GaveUp,
}

/// A distance gone from rest to rest, limited in speed, acceleration and jerk: seven pieces of constant jerk at most
/// (Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, section 3.4,
/// doi:10.1007/978-3-540-85629-0).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestToRest {
    /// Distance, m or rad, not negative.
    distance: f64,
    /// Speed in the middle, and the acceleration and jerk towards it.
    speed: f64,
    jerk: f64,
    /// Time in which the acceleration grows, time of speeding up, and time at full speed, s.
    rise: f64,
    ramp: f64,
    cruise: f64,
}

impl RestToRest {
    /// The fastest way over `distance` (m or rad) with these limits, all positive.
    pub fn new(distance: f64, speed: f64, acceleration: f64, jerk: f64) -> Self {
        let ramp = |v: f64| {
            if v * jerk >= acceleration * acceleration {
                v / acceleration + acceleration / jerk
            } else {
                2.0 * (v / jerk).sqrt()
            }
        };
        let mut top = speed;
        if top * ramp(top) > distance {
            // speeding up and slowing down take `v ramp(v)`, which grows with v
            let (mut low, mut high) = (0.0, speed);
            for _ in 0..60 {
                top = 0.5 * (low + high);
                if top * ramp(top) > distance { high = top } else { low = top }
            }
            top = low;
        }
        let time = ramp(top);
        let rise = (acceleration / jerk).min(0.5 * time);
        let cruise = if top > 0.0 { (distance / top - time).max(0.0) } else { 0.0 };
        // of a way too short for the jerk's limit, the jerk that is left
        let jerk = if time > rise && rise > 0.0 { top / (rise * (time - rise)) } else { 0.0 };
        Self { distance, speed: top, jerk, rise, ramp: time, cruise }
    }

    /// Time from rest to rest, s.
    pub fn duration(&self) -> f64 {
        2.0 * self.ramp + self.cruise
    }

    /// Way gone and speed at `time`, s, clamped to the motion.
    pub fn at(&self, time: f64) -> [f64; 2] {
        let t = time.clamp(0.0, self.duration());
        if t < self.ramp {
            self.speeding(t)
        } else if t <= self.ramp + self.cruise {
            [0.5 * self.speed * self.ramp + self.speed * (t - self.ramp), self.speed]
        } else {
            let [left, speed] = self.speeding(self.duration() - t);
            [self.distance - left, speed]
        }
    }

    fn speeding(&self, t: f64) -> [f64; 2] {
        let (j, rise) = (self.jerk, self.rise);
        if t < rise {
            [j * t.powi(3) / 6.0, 0.5 * j * t * t]
        } else if t < self.ramp - rise {
            let (u, v) = (t - rise, 0.5 * j * rise * rise);
            [j * rise.powi(3) / 6.0 + v * u + 0.5 * j * rise * u * u, v + j * rise * u]
        } else {
            let u = self.ramp - t;
            let lag = j * u.powi(3) / 6.0;
            [0.5 * self.speed * self.ramp - self.speed * u + lag, self.speed - 0.5 * j * u * u]
        }
    }
}

/// A straight way or a turn under way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Piece {
    from: BasePose,
    to: BasePose,
    fast: RestToRest,
    slow: RestToRest,
    /// Whether it is a turn.
    turns: bool,
    time: f64,
}

/// Follows a path by a believed pose alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriveFollower {
    path: DrivePath,
    /// Which stop is next, and whether the way there has been gone.
    stop: usize,
    there: bool,
    piece: Option<Piece>,
}

impl DriveFollower {
    /// A follower that stands still before `path`.
    pub fn new(path: DrivePath) -> Self {
        Self { path, stop: 0, there: false, piece: None }
    }

    /// One step of `dt` s: what to command where the base believes to be at `pose`.
    pub fn step(&mut self, pose: &BasePose, dt: f64) -> DriveStep {
        // what is reached already takes no time
        for _ in 0..=2 * self.path.stops.len() {
            let Some(stop) = self.path.stops.get(self.stop).copied() else { return DriveStep::Arrived };
            let o = &self.path.options;
            let piece = *self.piece.get_or_insert_with(|| Piece::new(pose, &stop, self.there, o));
            let reached = if piece.turns {
                (piece.to.yaw - pose.yaw).abs() <= o.yaw_tolerance
            } else {
                Vector2::new(stop.x - pose.x, stop.y - pose.y).norm() <= o.tolerance
            };
            if piece.time >= piece.duration() && reached || piece.duration() == 0.0 {
                self.piece = None;
                (self.stop, self.there) = if self.there { (self.stop + 1, false) } else { (self.stop, true) };
                continue;
            }
            if piece.time > piece.duration() + o.patience {
                return DriveStep::GaveUp;
            }
            let command = piece.command(pose, o);
            if let Some(p) = &mut self.piece {
                p.time += dt;
            }
            return DriveStep::Go(command);
        }
        DriveStep::Arrived
    }
}

impl Piece {
    fn new(pose: &BasePose, stop: &BasePose, turns: bool, o: &DriveOptions) -> Self {
        // the shorter way round
        let round =
            (stop.yaw - pose.yaw + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        let (to, distance) = if turns {
            (BasePose { yaw: pose.yaw + round, ..*stop }, round.abs())
        } else {
            (BasePose { yaw: pose.yaw, ..*stop }, (stop.x - pose.x).hypot(stop.y - pose.y))
        };
        // within its tolerance there is nothing to do
        let distance = if distance <= if turns { o.yaw_tolerance } else { o.tolerance } { 0.0 } else { distance };
        let last = if turns { 0.0 } else { o.approach.min(distance) };
        let (v, a) = if turns { (o.yaw_rate, o.yaw_acceleration) } else { (o.speed, o.acceleration) };
        let fast = RestToRest::new(distance - last, v, a, a * o.jerk);
        let slow = RestToRest::new(last, o.approach_speed.min(v), a, a * o.jerk);
        Self { from: *pose, to, fast, slow, turns, time: 0.0 }
    }

    fn duration(&self) -> f64 {
        self.fast.duration() + self.slow.duration()
    }

    fn command(&self, pose: &BasePose, o: &DriveOptions) -> Twist {
        let [mut way, mut speed] = self.fast.at(self.time);
        if self.time > self.fast.duration() {
            let [more, v] = self.slow.at(self.time - self.fast.duration());
            (way, speed) = (way + more, v);
        }
        let whole = self.fast.distance + self.slow.distance;
        let share = if whole > 0.0 { way / whole } else { 1.0 };
        let between = |a: f64, b: f64| a + (b - a) * share;
        let at = BasePose {
            x: between(self.from.x, self.to.x),
            y: between(self.from.y, self.to.y),
            yaw: between(self.from.yaw, self.to.yaw),
        };
        let mut v = Vector2::new(at.x - pose.x, at.y - pose.y) * o.gain;
        let mut yaw = (at.yaw - pose.yaw) * o.gain;
        if self.turns {
            yaw += speed * (self.to.yaw - self.from.yaw).signum();
        } else if whole > 0.0 {
            v += Vector2::new(self.to.x - self.from.x, self.to.y - self.from.y) * (speed / whole);
        }
        // seen from the base
        let v = Rotation2::new(-pose.yaw) * v.cap_magnitude(o.speed);
        Twist { x: v.x, y: v.y, yaw: yaw.clamp(-o.yaw_rate, o.yaw_rate) }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::robot::along_arc;

    proptest! {
        #[test]
        fn rest_to_rest_keeps_its_limits_and_ends_there(
            d in 1e-4..5.0f64, v in 0.01..1.0f64, a in 0.05..2.0f64, j in 0.1..10.0f64,
        ) {
            let m = RestToRest::new(d, v, a, j);
            let (n, end) = (2000, m.duration());
            let dt = end / f64::from(n);
            let mut last = [0.0; 3];
            for i in 1..=n {
                let [s, speed] = m.at(f64::from(i) * dt);
                let gain = (speed - last[1]) / dt;
                prop_assert!(speed <= v * (1.0 + 1e-9) && speed >= -1e-9);
                prop_assert!((s - last[0] - 0.5 * (speed + last[1]) * dt).abs() < j * dt.powi(3) + 1e-12);
                prop_assert!(gain.abs() <= a * 1.001 + 1e-9, "{gain} of {a}");
                prop_assert!((gain - last[2]).abs() <= j * dt * 1.01 + 1e-6);
                last = [s, speed, gain];
            }
            prop_assert!((last[0] - d).abs() < 1e-9 && last[1].abs() < 1e-9);
        }
    }

    #[test]
    fn a_base_that_goes_as_told_arrives_at_every_stop() {
        let stops = vec![
            BasePose { x: 1.0, y: 0.5, yaw: 0.3 },
            BasePose { x: 1.0, y: 0.5, yaw: -3.0 },
            BasePose { x: -0.2, y: 0.1, yaw: 3.0 },
        ];
        let options = DriveOptions::default();
        let mut follower = DriveFollower::new(DrivePath { stops: stops.clone(), options: options.clone() });
        let (mut pose, mut time, dt) = (BasePose::default(), 0.0, 1e-3);
        let mut fastest: f64 = 0.0;
        let mut near = vec![f64::INFINITY; stops.len()];
        while let DriveStep::Go(t) = follower.step(&pose, dt) {
            pose = along_arc(&pose, &Twist { x: t.x * dt, y: t.y * dt, yaw: t.yaw * dt });
            fastest = fastest.max(t.x.hypot(t.y));
            time += dt;
            assert!(time < 120.0, "never arrives");
            for (near, stop) in near.iter_mut().zip(&stops) {
                *near = near.min((stop.x - pose.x).hypot(stop.y - pose.y));
            }
        }
        assert_eq!(follower.step(&pose, dt), DriveStep::Arrived);
        assert!(near.iter().all(|d| *d <= options.tolerance), "{near:?}");
        let turned = (pose.yaw - 3.0).rem_euclid(std::f64::consts::TAU);
        assert!(turned.min(std::f64::consts::TAU - turned) <= options.yaw_tolerance);
        assert!(fastest <= options.speed + 1e-12 && fastest > 0.9 * options.speed);
        let foretold = options.duration(&BasePose::default(), &stops);
        assert!((time - foretold).abs() < 0.02 * foretold, "{time} {foretold}");
    }

    #[test]
    fn a_base_that_is_stuck_gives_up() {
        let stops = vec![BasePose { x: 1.0, ..BasePose::default() }];
        let mut follower = DriveFollower::new(DrivePath { stops, ..DrivePath::default() });
        let mut steps = 0;
        while let DriveStep::Go(_) = follower.step(&BasePose::default(), 1e-2) {
            steps += 1;
            assert!(steps < 100_000);
        }
        assert_eq!(follower.step(&BasePose::default(), 1e-2), DriveStep::GaveUp);
    }
}
