//! What stands between base and floor: wheels, and the springs that they are.
use nalgebra::{Matrix3, Point3, Vector2, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use super::wheel::{Footing, Wheel, WheelCommand};
use crate::math::Pose;
use crate::robot::{BaseModel, MountModel, WHEELS, wrench};

/// A place at which the base stands on a spring: a wheel, or the pivot of an axle that turns freely.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Foot {
    /// Where, m, base frame.
    place: Point3<f64>,
    /// N/m and N s/m.
    stiffness: f64,
    damping: f64,
    /// Force with which it holds the base up when that stands level at its height, N.
    preload: f64,
    /// Force in the last step, N.
    load: f64,
    /// The wheels that carry it.
    wheels: [bool; WHEELS],
}

/// Wheels and springs of a base, and what of them changes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Undercarriage {
    base: BaseModel,
    feet: Vec<Foot>,
    wheels: [Wheel; WHEELS],
}

impl Undercarriage {
    /// Springs loaded so that a base stands level and still under `weight` (wrench of the whole's weight, N and N m, about the origin of
    /// the base's frame, in its axes); `beta` is damping by stiffness, s.
    pub fn new(base: &BaseModel, weight: &Vector6<f64>, beta: f64) -> Self {
        let mut feet: Vec<Foot> = MountModel::feet(base)
            .into_iter()
            .map(|f| Foot {
                place: f.place,
                stiffness: f.stiffness,
                damping: beta * f.stiffness,
                preload: 0.0,
                load: 0.0,
                wheels: f.wheels,
            })
            .collect();
        // forces that go with a plane of deflections hold the weight and its moments about x and y
        let mut normal = Matrix3::zeros();
        for f in &feet {
            let row = Vector3::new(1.0, f.place.x, f.place.y);
            normal += row * row.transpose() * f.stiffness;
        }
        let held = Vector3::new(-weight[2], weight[4], -weight[3]);
        let plane = normal.lu().solve(&held).unwrap_or_else(Vector3::zeros);
        for f in &mut feet {
            f.preload = f.stiffness * plane.dot(&Vector3::new(1.0, f.place.x, f.place.y));
            f.load = f.preload.max(0.0);
        }
        Self { base: base.clone(), feet, wheels: [Wheel::default(); WHEELS] }
    }

    /// The base that it carries.
    pub fn base(&self) -> &BaseModel {
        &self.base
    }

    /// The wheels: front left, front right, rear left, rear right.
    pub fn wheels(&self) -> &[Wheel; WHEELS] {
        &self.wheels
    }

    /// Loads of the wheels, N.
    pub fn loads(&self) -> [f64; WHEELS] {
        let mut loads = [0.0; WHEELS];
        for f in &self.feet {
            let share = f.load / f.wheels.iter().filter(|w| **w).count().max(1) as f64;
            for (load, _) in loads.iter_mut().zip(f.wheels).filter(|(_, w)| *w) {
                *load += share;
            }
        }
        loads
    }

    /// One step of `dt` s: the wrench of floor and wheels on the base (N and N m, about the world's origin), which stands at `pose` and
    /// moves with `twist` (m/s and rad/s, about the world's origin). The floor is level, at height 0.
    pub fn step(&mut self, pose: &Pose, twist: &Vector6<f64>, command: &WheelCommand, dt: f64) -> Vector6<f64> {
        let (lin, ang): (Vector3<f64>, Vector3<f64>) =
            (twist.fixed_rows::<3>(0).into(), twist.fixed_rows::<3>(3).into());
        let velocity = |p: &Vector3<f64>| lin + ang.cross(p);
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for f in &mut self.feet {
            let at = (pose * f.place).coords;
            let sunk = f.place.z - at.z;
            f.load = (f.preload + f.stiffness * sunk - f.damping * velocity(&at).z).max(0.0);
            let up = Vector3::new(0.0, 0.0, f.load);
            force += up;
            moment += at.cross(&up);
        }
        // the base's axes seen from above
        let ahead = pose.rotation * Vector3::x();
        let ahead = Vector2::new(ahead.x, ahead.y).normalize();
        let left = Vector2::new(-ahead.y, ahead.x);
        let loads = self.loads();
        let axle = Vector3::new(left.x, left.y, 0.0);
        for (i, wheel) in self.wheels.iter_mut().enumerate() {
            let hub = (pose * self.base.wheels[i].hub).coords;
            let contact = Vector3::new(hub.x, hub.y, 0.0);
            let v = velocity(&contact).xy();
            let footing = Footing { velocity: Vector2::new(v.dot(&ahead), v.dot(&left)), load: loads[i] };
            let out = wheel.step(&self.base, i, command, &footing, dt);
            let f = ahead * out.force.x + left * out.force.y;
            let f = Vector3::new(f.x, f.y, 0.0);
            force += f;
            moment += contact.cross(&f) + axle * out.reaction;
        }
        wrench(&force, &moment)
    }
}
