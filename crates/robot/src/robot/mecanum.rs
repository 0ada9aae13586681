//! Mecanum wheels: twist of the base to wheel speeds and back, and where wheel speeds say the base stands.
//!
//! A wheel holds the floor along the axis `u` of the roller that stands on it, and rolls freely across it: with the hub's velocity `v`
//! and the wheel's speed `w`, `v . u = w r u_x` (Muir and Neuman, Kinematic modeling for feedback control of an omnidirectional wheeled
//! mobile robot, ICRA 1987, doi:10.1109/ROBOT.1987.1087767).
use nalgebra::{Matrix3, SMatrix, Vector3, Vector4};
use serde::{Deserialize, Serialize};

use super::{BaseModel, BasePose, WHEELS};

/// Speeds of the wheels, rad/s, forward positive: front left, front right, rear left, rear right.
pub type WheelSpeeds = Vector4<f64>;

/// Motion of a base in its own frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// Ahead, m/s.
    pub x: f64,
    /// To the left, m/s.
    pub y: f64,
    /// Counter-clockwise, rad/s.
    pub yaw: f64,
}

impl Twist {
    fn vector(&self) -> Vector3<f64> {
        Vector3::new(self.x, self.y, self.yaw)
    }
}

/// Kinematics of a base's wheels, as the base believes them to be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mecanum {
    /// Wheel speeds per unit of twist.
    wheels_from_twist: SMatrix<f64, WHEELS, 3>,
    /// Twist by least squares over the four wheels.
    twist_from_wheels: SMatrix<f64, 3, WHEELS>,
}

impl Mecanum {
    /// Kinematics of `base`. `None` if its wheels can't drive it in all three ways, as with all rollers the same way.
    pub fn new(base: &BaseModel) -> Option<Self> {
        let mut rows = SMatrix::<f64, WHEELS, 3>::zeros();
        for (i, w) in base.wheels.iter().enumerate() {
            let slope = w.roller.y / w.roller.x;
            rows[(i, 0)] = 1.0 / base.radius;
            rows[(i, 1)] = slope / base.radius;
            rows[(i, 2)] = (w.hub.x * slope - w.hub.y) / base.radius;
        }
        let normal: Matrix3<f64> = rows.transpose() * rows;
        let inverse = normal.try_inverse()?;
        let twist_from_wheels = inverse * rows.transpose();
        let spread = rows.singular_values();
        (spread.min() > 1e-6 * spread.max()).then_some(Self { wheels_from_twist: rows, twist_from_wheels })
    }

    /// Wheel speeds that give a twist, rad/s.
    pub fn wheels(&self, twist: &Twist) -> WheelSpeeds {
        self.wheels_from_twist * twist.vector()
    }

    /// The twist that wheel speeds give where nothing slips; by least squares where they contradict each other.
    pub fn twist(&self, wheels: &WheelSpeeds) -> Twist {
        let t = self.twist_from_wheels * wheels;
        Twist { x: t.x, y: t.y, yaw: t.z }
    }
}

/// Where a base believes to stand by its wheels' turns alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    /// The believed pose.
    pub pose: BasePose,
    /// The believed motion, base frame.
    pub twist: Twist,
    /// Turns of the wheels at the last reading, rad.
    turned: Option<WheelSpeeds>,
}

impl Odometry {
    /// Begins at a pose that is believed for other reasons.
    pub fn at(pose: BasePose) -> Self {
        Self { pose, ..Self::default() }
    }

    /// Takes another belief of the pose, such as a measured one; the wheels go on from where they are.
    pub fn correct(&mut self, pose: BasePose) {
        self.pose = pose;
    }

    /// Reads how far the wheels have turned, rad, `dt` s after the last reading. The way of each reading is an arc.
    pub fn read(&mut self, wheels: &Mecanum, turned: &WheelSpeeds, dt: f64) {
        let Some(before) = self.turned.replace(*turned) else { return };
        let moved = wheels.twist(&(turned - before));
        self.twist = Twist { x: moved.x / dt, y: moved.y / dt, yaw: moved.yaw / dt };
        self.pose = along_arc(&self.pose, &moved);
    }
}

/// The pose after a motion at constant twist, given as twist times time.
pub fn along_arc(pose: &BasePose, moved: &Twist) -> BasePose {
    let half = 0.5 * moved.yaw;
    let shrink = if half.abs() < 1e-6 { 1.0 - half * half / 6.0 } else { half.sin() / half };
    let (sin, cos) = (pose.yaw + half).sin_cos();
    BasePose {
        x: pose.x + shrink * (cos * moved.x - sin * moved.y),
        y: pose.y + shrink * (sin * moved.x + cos * moved.y),
        yaw: pose.yaw + moved.yaw,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::LazyLock;

    use proptest::prelude::*;

    use super::*;
    use crate::robot::Cell;

    /// Read once: proptest asks for it hundreds of times.
    fn ridgeback() -> BaseModel {
        static BASE: LazyLock<BaseModel> = LazyLock::new(|| {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/iiwa_ridgeback.toml");
            Cell::load(&file).expect("loads").arms.remove(0).base.expect("has a base")
        });
        BASE.clone()
    }

    #[test]
    fn wheels_turn_as_the_text_book_says() {
        let base = ridgeback();
        let wheels = Mecanum::new(&base).expect("can drive");
        let (r, l) = (base.radius, 0.319 + 0.2755);
        for (x, y, yaw) in [(0.3, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.4), (0.1, -0.2, 0.3)] {
            let speeds = wheels.wheels(&Twist { x, y, yaw });
            let expected = Vector4::new(x - y - l * yaw, x + y + l * yaw, x + y - l * yaw, x - y + l * yaw) / r;
            assert!((speeds - expected).norm() < 1e-12, "{speeds} {expected}");
        }
    }

    #[test]
    fn a_base_with_all_rollers_one_way_cannot_drive() {
        let mut base = ridgeback();
        for w in &mut base.wheels {
            w.roller.y = w.roller.y.abs();
        }
        assert!(Mecanum::new(&base).is_none());
    }

    proptest! {
        #[test]
        fn twist_comes_back_from_wheel_speeds(x in -1.0..1.0f64, y in -1.0..1.0f64, yaw in -1.0..1.0f64) {
            let wheels = Mecanum::new(&ridgeback()).expect("can drive");
            let t = wheels.twist(&wheels.wheels(&Twist { x, y, yaw }));
            prop_assert!((t.x - x).abs() < 1e-12 && (t.y - y).abs() < 1e-12 && (t.yaw - yaw).abs() < 1e-12);
        }

        #[test]
        fn odometry_of_steady_turning_runs_round_a_circle(radius in 0.2..2.0f64, yaw in -9.0..9.0f64, steps in 1..200usize) {
            let wheels = Mecanum::new(&ridgeback()).expect("can drive");
            let mut odometry = Odometry::at(BasePose::default());
            let each = wheels.wheels(&Twist { x: radius * yaw, y: 0.0, yaw });
            for i in 0..=steps {
                odometry.read(&wheels, &(each * (i as f64 / steps as f64)), 1e-3);
            }
            let (sin, cos) = yaw.sin_cos();
            let p = odometry.pose;
            prop_assert!((p.x - radius * sin).abs() < 1e-9 && (p.y - radius * (1.0 - cos)).abs() < 1e-9);
            prop_assert!((p.yaw - yaw).abs() < 1e-9);
        }
    }
}
