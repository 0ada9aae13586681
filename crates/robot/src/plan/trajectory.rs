//! Timed joint motion: knots joined by quintic polynomials.
use crate::robot::JointVector;

/// A moment of a joint motion.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Knot {
    /// Time, s from the start of the trajectory.
    pub time: f64,
    /// Joint positions, rad.
    pub q: JointVector,
    /// Joint speeds, rad/s.
    pub qd: JointVector,
    /// Joint accelerations, rad/s2.
    pub qdd: JointVector,
}

/// Position, speed and acceleration at one time.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MotionSample {
    /// Joint positions, rad.
    pub q: JointVector,
    /// Joint speeds, rad/s.
    pub qd: JointVector,
    /// Joint accelerations, rad/s2.
    pub qdd: JointVector,
}

/// Joint motion through knots of rising time, twice continuously differentiable: between two knots each joint follows
/// the quintic that meets both knots' position, speed and acceleration.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Trajectory {
    knots: Vec<Knot>,
}

impl Trajectory {
    /// A trajectory through `knots`: at least one, times rising from 0.
    ///
    /// # Panics
    /// When there is no knot or times don't rise: that is a planner's bug, not a user's.
    pub fn new(knots: Vec<Knot>) -> Self {
        assert!(!knots.is_empty(), "a trajectory needs a knot");
        assert!(knots[0].time == 0.0 && knots.windows(2).all(|w| w[1].time > w[0].time), "knot times must rise from 0");
        Self { knots }
    }

    /// Stands at `q` for `duration` s.
    pub fn rest(q: JointVector, duration: f64) -> Self {
        let knot = |time| Knot { time, q, qd: JointVector::zeros(), qdd: JointVector::zeros() };
        Self::new(if duration > 0.0 { vec![knot(0.0), knot(duration)] } else { vec![knot(0.0)] })
    }

    /// The knots.
    pub fn knots(&self) -> &[Knot] {
        &self.knots
    }

    /// Duration, s.
    pub fn duration(&self) -> f64 {
        self.knots[self.knots.len() - 1].time
    }

    /// The same way back: from its end to its start.
    pub fn reversed(&self) -> Self {
        let end = self.duration();
        let back = self.knots.iter().rev().map(|k| Knot { time: end - k.time, qd: -k.qd, ..*k });
        Self::new(back.collect())
    }

    /// The motion up to `time`, s from its start.
    pub fn until(&self, time: f64) -> Self {
        let m = self.sample(time, &mut 0);
        let mut knots: Vec<Knot> = self.knots.iter().copied().filter(|k| k.time == 0.0 || k.time < time).collect();
        if time > 0.0 && time <= self.duration() {
            knots.push(Knot { time, q: m.q, qd: m.qd, qdd: m.qdd });
        }
        Self::new(knots)
    }

    /// The motion at `time` (s, clamped to the trajectory). `cursor` remembers the last interval, so that a walk
    /// forward in time costs no search; start with 0.
    pub fn sample(&self, time: f64, cursor: &mut usize) -> MotionSample {
        let last = self.knots.len() - 1;
        if time <= 0.0 || last == 0 {
            let k = &self.knots[0];
            return MotionSample { q: k.q, qd: k.qd, qdd: k.qdd };
        }
        if time >= self.knots[last].time {
            let k = &self.knots[last];
            return MotionSample { q: k.q, qd: k.qd, qdd: k.qdd };
        }
        let mut i = (*cursor).min(last - 1);
        if self.knots[i].time > time {
            i = self.knots.partition_point(|k| k.time <= time) - 1;
        }
        while self.knots[i + 1].time < time {
            i += 1;
        }
        *cursor = i;
        Quintic::new(&self.knots[i], &self.knots[i + 1]).at(time - self.knots[i].time)
    }
}

/// The largest absolute values of a motion, joint by joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionPeaks {
    /// Joint speed, rad/s.
    pub speed: JointVector,
    /// Joint acceleration, rad/s2.
    pub acceleration: JointVector,
    /// Joint jerk, rad/s3.
    pub jerk: JointVector,
}

impl Trajectory {
    /// Peaks over the whole motion, looked at five times between every two knots.
    pub fn peaks(&self) -> MotionPeaks {
        MotionPeaks::of(&self.knots)
    }
}

impl MotionPeaks {
    pub(crate) fn of(knots: &[Knot]) -> Self {
        let zero = JointVector::zeros();
        let mut peaks = Self { speed: zero, acceleration: zero, jerk: zero };
        for w in knots.windows(2) {
            let quintic = Quintic::new(&w[0], &w[1]);
            for i in 0..5 {
                let t = f64::from(i) * 0.25 * (w[1].time - w[0].time);
                let m = quintic.at(t);
                peaks.speed = peaks.speed.sup(&m.qd.abs());
                peaks.acceleration = peaks.acceleration.sup(&m.qdd.abs());
                peaks.jerk = peaks.jerk.sup(&quintic.jerk(t).abs());
            }
        }
        peaks
    }
}

/// The quintic Hermite polynomial between two knots,
/// `p(t) = q + qd t + qdd t^2 / 2 + c3 t^3 + c4 t^4 + c5 t^5`, with `t` from the first.
struct Quintic<'a> {
    start: &'a Knot,
    c3: JointVector,
    c4: JointVector,
    c5: JointVector,
}

impl<'a> Quintic<'a> {
    fn new(a: &'a Knot, b: &Knot) -> Self {
        let h = b.time - a.time;
        let dq = b.q - a.q - a.qd * h - a.qdd * (0.5 * h * h);
        let dv = b.qd - a.qd - a.qdd * h;
        let da = b.qdd - a.qdd;
        let (h2, h3) = (h * h, h * h * h);
        Self {
            start: a,
            c3: (dq * 10.0 - dv * (4.0 * h) + da * (0.5 * h2)) / h3,
            c4: (dq * -15.0 + dv * (7.0 * h) - da * h2) / (h3 * h),
            c5: (dq * 6.0 - dv * (3.0 * h) + da * (0.5 * h2)) / (h3 * h2),
        }
    }

    fn at(&self, t: f64) -> MotionSample {
        let a = self.start;
        let (t2, t3) = (t * t, t * t * t);
        MotionSample {
            q: a.q + a.qd * t + a.qdd * (0.5 * t2) + self.c3 * t3 + self.c4 * (t3 * t) + self.c5 * (t3 * t2),
            qd: a.qd + a.qdd * t + self.c3 * (3.0 * t2) + self.c4 * (4.0 * t3) + self.c5 * (5.0 * t2 * t2),
            qdd: a.qdd + self.c3 * (6.0 * t) + self.c4 * (12.0 * t2) + self.c5 * (20.0 * t3),
        }
    }

    fn jerk(&self, t: f64) -> JointVector {
        self.c3 * 6.0 + self.c4 * (24.0 * t) + self.c5 * (60.0 * t * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn back_is_the_same_way_with_the_speeds_turned() {
        let at = |time: f64, x: f64, v: f64, a: f64| Knot {
            time,
            q: JointVector::repeat(x),
            qd: JointVector::repeat(v),
            qdd: JointVector::repeat(a),
        };
        let way = Trajectory::new(vec![at(0.0, 0.0, 0.0, 0.0), at(0.4, 0.1, 0.5, -0.2), at(1.0, 0.3, 0.0, 0.0)]);
        let back = way.reversed();
        for i in 0..=100 {
            let t = f64::from(i) * 0.01;
            let (there, here) = (way.sample(1.0 - t, &mut 0), back.sample(t, &mut 0));
            assert!((there.q - here.q).norm() < 1e-12 && (there.qd + here.qd).norm() < 1e-9);
            assert!((there.qdd - here.qdd).norm() < 1e-8);
        }
    }

    #[test]
    fn a_quintic_is_reproduced() {
        let p = |t: f64| 0.3 - t + 2.0 * t.powi(2) - t.powi(3) + 0.5 * t.powi(4) - 0.2 * t.powi(5);
        let v = |t: f64| -1.0 + 4.0 * t - 3.0 * t.powi(2) + 2.0 * t.powi(3) - t.powi(4);
        let a = |t: f64| 4.0 - 6.0 * t + 6.0 * t.powi(2) - 4.0 * t.powi(3);
        let knot = |time: f64| Knot {
            time,
            q: JointVector::repeat(p(time)),
            qd: JointVector::repeat(v(time)),
            qdd: JointVector::repeat(a(time)),
        };
        let trajectory = Trajectory::new(vec![knot(0.0), knot(0.7), knot(1.5)]);
        let mut cursor = 0;
        for i in 0..=150 {
            let t = f64::from(i) * 0.01;
            let s = trajectory.sample(t, &mut cursor);
            assert!((s.q[2] - p(t)).abs() < 1e-12 && (s.qd[2] - v(t)).abs() < 1e-11 && (s.qdd[2] - a(t)).abs() < 1e-10);
        }
    }
}
