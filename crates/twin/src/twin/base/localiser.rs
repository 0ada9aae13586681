//! What measures where a base stands: a tracker, a lidar, a board of marks in the hand's camera, or nothing that errs.
//!
//! Errors of a measured pose are white noise, a slow wander (first-order Gauss-Markov), a smooth warp of the measured volume, jumps
//! when it is found again after a drive, and how the sensor is mounted. Sizes of a tracker follow Borges et al., HTC Vive: analysis and
//! accuracy improvement, IROS 2018, doi:10.1109/IROS.2018.8593707, and a drawing robot's saved calibration; nobody publishes all.
use nalgebra::{Translation3, UnitQuaternion, Vector2, Vector3, Vector6};
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::math::{Pose, standard_normal, stream};

/// How a measured pose errs; standard deviations but where said.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LocaliserOptions {
    /// White noise of one reading, m and rad.
    pub noise: [f64; 2],
    /// Readings that are averaged.
    pub readings: u32,
    /// What averaging leaves at least, m.
    pub floor: f64,
    /// Slow wander, m and rad.
    pub wander: [f64; 2],
    /// Time in which the wander is forgotten, s.
    pub wander_time: f64,
    /// Bend of the measured volume at 1.5 m from its middle, m; drawn once a set-up.
    pub warp: f64,
    /// Error of its scale; drawn once a set-up.
    pub scale: f64,
    /// Largest jump when the base is found again after a drive, m: the least is a fifth of it.
    pub jump: f64,
    /// Share of drives after which it jumps.
    pub jump_rate: f64,
    /// How far off the sensor is mounted, m and rad; drawn once a set-up.
    pub mounting: [f64; 2],
    /// Age of a reading, s.
    pub latency: f64,
}

/// A known kind of sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LocaliserKind {
    /// No error.
    #[default]
    Perfect,
    /// Tracked by base stations that sweep light.
    Tracker,
    /// A lidar that is matched to a map.
    Lidar,
    /// A board of marks, or drawn lines, in the hand's camera.
    Board,
}

impl LocaliserKind {
    /// How such a sensor errs.
    pub fn options(self) -> LocaliserOptions {
        let mm = |v: f64| v * 1e-3;
        let none = LocaliserOptions {
            noise: [0.0; 2],
            readings: 100,
            floor: 0.0,
            wander: [0.0; 2],
            wander_time: 200.0,
            warp: 0.0,
            scale: 0.0,
            jump: 0.0,
            jump_rate: 0.0,
            mounting: [0.0; 2],
            latency: 0.0,
        };
        match self {
            Self::Perfect => none,
            Self::Tracker => LocaliserOptions {
                noise: [mm(0.3), 0.02f64.to_radians()],
                floor: mm(0.1),
                wander: [mm(0.5), 0.03f64.to_radians()],
                warp: mm(5.0),
                scale: 0.005,
                jump: mm(10.0),
                jump_rate: 0.2,
                mounting: [mm(3.0), 0.2f64.to_radians()],
                latency: 0.022,
                ..none
            },
            Self::Lidar => LocaliserOptions {
                noise: [mm(3.0), 0.1f64.to_radians()],
                floor: mm(0.1),
                wander: [mm(2.0), 0.0],
                warp: mm(5.0),
                mounting: [mm(3.0), 0.2f64.to_radians()],
                latency: 0.1,
                ..none
            },
            Self::Board => LocaliserOptions {
                noise: [mm(0.2), 0.02f64.to_radians()],
                floor: mm(0.05),
                mounting: [mm(0.3), 0.05f64.to_radians()],
                latency: 0.05,
                ..none
            },
        }
    }
}

/// A sensor of a base's pose, and what of it changes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Localiser {
    options: LocaliserOptions,
    /// Middle of the measured volume, m, world: there its bends and its scale are right.
    middle: [f64; 2],
    rng: ChaCha8Rng,
    /// Where and how it is mounted, m and rad, base frame.
    mounting: [f64; 3],
    /// Scale, and bends of x and y by the squares and the product of the place, 1/m.
    scale: f64,
    bends: [[f64; 3]; 2],
    wander: [f64; 3],
    /// Sum of the jumps so far, m.
    jumped: [f64; 2],
    measured_at: f64,
}

impl Localiser {
    /// A sensor set up anew about `middle` (m, world: what is drawn on, whose own mark it measures from); `seed` and the arm's `index` say
    /// which.
    pub fn new(options: LocaliserOptions, middle: [f64; 2], seed: u64, index: u64) -> Self {
        let mut rng = stream(seed, "localisation", index);
        let mut normal = |sd: f64| sd * standard_normal(&mut rng);
        let [far, turned] = options.mounting;
        let mounting = [normal(far), normal(far), normal(turned)];
        let scale = normal(options.scale);
        // three bends of the same size together bend by `warp` at 1.5 m
        let bend = options.warp / (1.5 * 1.5 * 3f64.sqrt());
        let bends = [(); 2].map(|()| [normal(bend), normal(bend), normal(bend)]);
        let [sway, turn] = options.wander;
        let wander = [normal(sway), normal(sway), normal(turn)];
        Self { options, middle, rng, mounting, scale, bends, wander, jumped: [0.0; 2], measured_at: 0.0 }
    }

    /// How it errs.
    pub fn options(&self) -> &LocaliserOptions {
        &self.options
    }

    /// The base has driven: the sensor may have lost it meanwhile.
    pub fn moved(&mut self) {
        let o = &self.options;
        // both numbers are drawn each time, so that a rate changes no other error
        let (chance, size) = (crate::math::unit(&mut self.rng), crate::math::unit(&mut self.rng));
        let way = std::f64::consts::TAU * crate::math::unit(&mut self.rng);
        if chance < o.jump_rate {
            let far = o.jump * (0.2 + 0.8 * size);
            self.jumped[0] += far * way.cos();
            self.jumped[1] += far * way.sin();
        }
    }

    /// The measured pose at `time` (s) of a base at `pose` that moves with `twist` (m/s and rad/s, about the world's origin). Height and
    /// tilt are those of the base.
    pub fn measure(&mut self, time: f64, pose: &Pose, twist: &Vector6<f64>) -> Pose {
        let o = &self.options;
        let (lin, ang): (Vector3<f64>, Vector3<f64>) =
            (twist.fixed_rows::<3>(0).into(), twist.fixed_rows::<3>(3).into());
        let past = Pose::new(-lin * o.latency, -ang * o.latency) * pose;
        let keeps = (-(time - self.measured_at).max(0.0) / o.wander_time).exp();
        self.measured_at = time;
        let renewed = (1.0 - keeps * keeps).max(0.0).sqrt();
        for (w, sd) in self.wander.iter_mut().zip([o.wander[0], o.wander[0], o.wander[1]]) {
            *w = *w * keeps + sd * renewed * standard_normal(&mut self.rng);
        }
        let averaged = 1.0 / f64::from(o.readings.max(1)).sqrt();
        let [far, turned] = [(o.noise[0] * averaged).max(o.floor), o.noise[1] * averaged];
        let noise = [far, far, turned].map(|sd| sd * standard_normal(&mut self.rng));
        let p = Vector2::new(past.translation.x - self.middle[0], past.translation.y - self.middle[1]);
        let bent = self.bends.map(|[a, b, c]| a * p.x * p.x + b * p.y * p.y + c * p.x * p.y);
        let mut off = [0.0; 3];
        for i in 0..2 {
            off[i] = self.scale * p[i] + bent[i] + self.wander[i] + self.jumped[i] + noise[i];
        }
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.wander[2] + noise[2]);
        let [x, y, yaw] = self.mounting;
        let mounted =
            Pose::from_parts(Translation3::new(x, y, 0.0), UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw));
        let seen = Pose::from_parts(
            (past.translation.vector + Vector3::new(off[0], off[1], 0.0)).into(),
            turn * past.rotation,
        );
        seen * mounted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn off(l: &mut Localiser, time: f64, pose: &Pose) -> Vector3<f64> {
        let seen = pose.inverse() * l.measure(time, pose, &Vector6::zeros());
        Vector3::new(seen.translation.x, seen.translation.y, seen.rotation.scaled_axis().z)
    }

    #[test]
    fn a_perfect_one_measures_what_is() {
        let pose = Pose::new(Vector3::new(2.0, -1.0, 0.001), Vector3::new(0.001, 0.0, 1.2));
        let mut l = Localiser::new(LocaliserKind::Perfect.options(), [0.0; 2], 3, 0);
        l.moved();
        assert!(off(&mut l, 5.0, &pose).norm() < 1e-12);
    }

    #[test]
    fn noise_is_as_large_as_said_and_set_ups_differ() {
        let options = LocaliserOptions {
            noise: [1e-3, 1e-3],
            readings: 4,
            mounting: [3e-3, 2e-3],
            ..LocaliserKind::Perfect.options()
        };
        let (mut within, mut between) = ([0.0; 2], [0.0; 2]);
        for seed in 0..200 {
            let mut l = Localiser::new(options.clone(), [0.0; 2], seed, 0);
            let (a, b) = (off(&mut l, 0.0, &Pose::identity()), off(&mut l, 1.0, &Pose::identity()));
            for (sum, i) in within.iter_mut().zip([0, 2]) {
                *sum += (a[i] - b[i]).powi(2) / 2.0 / 200.0;
            }
            for (sum, i) in between.iter_mut().zip([0, 2]) {
                *sum += a[i] * a[i] / 200.0;
            }
        }
        let near = |variance: f64, sd: f64| (variance.sqrt() / sd - 1.0).abs() < 0.2;
        assert!(near(within[0], 5e-4) && near(within[1], 5e-4), "{within:?}");
        assert!(near(between[0], 3e-3f64.hypot(5e-4)) && near(between[1], 2e-3f64.hypot(5e-4)), "{between:?}");
    }

    #[test]
    fn the_same_seed_measures_the_same_and_a_saved_one_goes_on() {
        let mut a = Localiser::new(LocaliserKind::Tracker.options(), [0.0; 2], 7, 0);
        a.moved();
        let bytes = postcard::to_stdvec(&a).expect("has a serial form");
        let mut b: Localiser = postcard::from_bytes(&bytes).expect("can be read");
        assert_eq!(off(&mut a, 9.0, &Pose::identity()), off(&mut b, 9.0, &Pose::identity()));
    }

    #[test]
    fn a_moving_base_is_seen_where_it_was() {
        let mut l =
            Localiser::new(LocaliserOptions { latency: 0.1, ..LocaliserKind::Perfect.options() }, [0.0; 2], 1, 0);
        let seen = l.measure(0.0, &Pose::identity(), &Vector6::new(0.2, 0.0, 0.0, 0.0, 0.0, 0.0));
        assert!((seen.translation.x + 0.02).abs() < 1e-12);
    }
}
