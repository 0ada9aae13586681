//! What wrench on the grip a checked grasp withstands as if hand and tool were one body.
use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::math::Pose;
use crate::robot::GRAVITY;
use crate::tool::ToolSet;

/// Friction of fingers with which the grasp was loaded.
const FRICTION: f64 = 0.25;
/// Forces (N) along x, y and z of the tool up to which it moves by less than 0.05 mm in the hand: upwards first, then downwards. Loads
/// that rise by a tenth every half second, along one axis at a time, at the middle of the grip: the tool slips at 245 and beyond 350 N
/// along x (out of the palm, into it), 115 and 105 N along y, 62 and beyond 190 N along z (against the fingers' friction, onto the
/// plates).
const FORCE: [[f64; 2]; 3] = [[200.0, 300.0], [95.0, 95.0], [55.0, 150.0]];
/// The same for moments (N m): the tool slips at 9.8 and 5.5 N m about x, 15 and 16 about y, 10 and 9.8 about z.
const MOMENT: [[f64; 2]; 3] = [[5.0, 5.0], [12.0, 12.0], [8.0, 8.0]];
/// Share of these that a wrench of several components may use: friction that holds along one axis is missing along another.
const SAFE: f64 = 0.5;
/// Share of the force out of the palm that is left without bevels: the fingers' friction on square corners.
const WITHOUT_BEVELS: f64 = 0.25;

/// What wrench on the grip a checked grasp withstands as if hand and tool were one body: an ellipsoid in the space of wrenches, whose
/// half axes are the loads along each of them (Howe and Cutkosky 1996, doi:10.1177/027836499601500603).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GripLimit {
    force: [[f64; 2]; 3],
    moment: [[f64; 2]; 3],
    mass: f64,
    /// Middle of the grip, tool frame, m: forces and moments are about it.
    grip: Point3<f64>,
    /// Centre of mass, tool frame, m.
    com: Point3<f64>,
    tip: Point3<f64>,
}

impl GripLimit {
    /// The limit of a tool with its true friction, plates and bevels, in fingers of this true strength (1 is the design's).
    pub fn of(set: &ToolSet, strength: f64) -> Self {
        // more friction or strength than was loaded is not counted on
        let held = (set.tool.friction_fingers / FRICTION * strength).min(1.0);
        let scaled = |c: [[f64; 2]; 3]| c.map(|both| both.map(|x| x * held * SAFE));
        let (mut force, moment) = (scaled(FORCE), scaled(MOMENT));
        if set.tool.plates.is_none() {
            force[2][1] = force[2][0];
        }
        if set.tool.bevel.is_none() {
            force[0][0] *= WITHOUT_BEVELS;
        }
        let (mut mass, mut first) = (0.0, Vector3::zeros());
        for part in set.tool.parts() {
            let (volume, moment, _) = part.moments();
            mass += set.tool.density() * volume;
            first += set.tool.density() * moment;
        }
        let com = Point3::from(first / f64::max(mass, f64::MIN_POSITIVE));
        let grip = Point3::new(0.5 * set.tool.flat, 0.0, 0.0);
        Self { force, moment, mass, grip, com, tip: set.tool.pen_tip() }
    }

    /// Share of the limit that a wrench uses: force (N) and moment about the middle of the grip (N m), tool frame. 1 is the limit.
    pub fn used(&self, force: &Vector3<f64>, moment: &Vector3<f64>) -> f64 {
        let share = |x: f64, [up, down]: [f64; 2]| x / if x > 0.0 { up } else { down }.max(1e-9);
        let sum: f64 =
            (0..3).map(|i| share(force[i], self.force[i]).powi(2) + share(moment[i], self.moment[i]).powi(2)).sum();
        sum.sqrt()
    }

    /// The wrench on the grip, force and moment in the tool frame, of a tool whose tip is pushed by `force` (N, world) while the hand
    /// accelerates by `acceleration` (m/s2, world).
    pub fn wrench(
        &self,
        world_from_tool: &Pose,
        force: &Vector3<f64>,
        acceleration: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let to_tool = world_from_tool.rotation.inverse();
        let pen = to_tool * force;
        let body = to_tool * ((Vector3::new(0.0, 0.0, -GRAVITY) - acceleration) * self.mass);
        (pen + body, (self.tip - self.grip).cross(&pen) + (self.com - self.grip).cross(&body))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set() -> ToolSet {
        ToolSet::pen_tool().unwrap()
    }

    #[test]
    fn a_light_press_is_far_inside_and_a_hard_one_outside() {
        let limit = GripLimit::of(&set(), 1.0);
        let used = |push: Vector3<f64>| {
            let (force, moment) = limit.wrench(&Pose::identity(), &push, &Vector3::zeros());
            limit.used(&force, &moment)
        };
        assert!(used(Vector3::zeros()) > 0.0 && used(Vector3::zeros()) < 0.1, "its own weight");
        assert!(used(Vector3::new(0.3, 0.0, 1.05)) < 0.2);
        assert!(used(Vector3::new(5.0, 0.0, 5.0)) < 1.0 && used(Vector3::new(0.0, 30.0, 0.0)) > 1.0);
        // a push across at the tip turns the tool: its moment counts, not its size alone
        assert!(used(Vector3::new(0.0, 20.0, 0.0)) > used(Vector3::new(0.0, 0.0, 20.0)));
    }

    #[test]
    fn slippery_weak_and_plain_grips_hold_less() {
        let push = (Vector3::new(0.0, 0.0, -20.0), Vector3::zeros());
        let used = |set: &ToolSet, strength: f64| GripLimit::of(set, strength).used(&push.0, &push.1);
        let whole = used(&set(), 1.0);
        let mut slippery = set();
        slippery.tool.friction_fingers *= 0.5;
        assert!((used(&slippery, 1.0) / whole - 2.0).abs() < 1e-9 && (used(&set(), 0.8) / whole - 1.25).abs() < 1e-9);
        assert!(
            used(&set().without_plates(), 1.0) > 2.0 * whole,
            "without plates friction alone bears a push from above"
        );
        let out = |set: &ToolSet| GripLimit::of(set, 1.0).used(&Vector3::new(20.0, 0.0, 0.0), &Vector3::zeros());
        assert!(out(&set().without_bevels()) > 3.0 * out(&set()));
    }

    #[test]
    fn acceleration_loads_the_grip_as_weight_does() {
        let limit = GripLimit::of(&set(), 1.0);
        let still = limit.wrench(&Pose::identity(), &Vector3::zeros(), &Vector3::zeros());
        let falling = limit.wrench(&Pose::identity(), &Vector3::zeros(), &Vector3::new(0.0, 0.0, -GRAVITY));
        assert!(falling.0.norm() < 1e-9 && (still.0.z + set().tool.mass * GRAVITY).abs() < 0.02, "{still:?}");
    }
}
