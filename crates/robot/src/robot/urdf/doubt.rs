//! Numbers of a URDF that are well formed and can hardly be meant: most are in a wrong unit.
use nalgebra::Point3;
use urdf_rs::{Joint, JointType};

use crate::robot::{Capsule, SpatialInertia, Visual, VisualShape};

/// Largest angle, rad, that a limit of a turning joint is believed to mean, a little more than two turns.
const LARGEST_TURN: f64 = 13.0;
/// Largest speed of a turning joint that is believed, rad/s.
const LARGEST_SPEED: f64 = 50.0;
/// Farthest that a joint or a shape is believed to lie from its link's frame, m.
const FAR: f64 = 3.0;
/// Farthest that is accepted at all, m.
const ABSURD: f64 = 20.0;
/// Most that the mass may lie farther from its centre than any shape does.
const SPREAD: f64 = 1.5;
/// Least share of that distance.
const DENSE: f64 = 0.02;
/// Distance that is believed of a link without shapes, m.
const SHAPELESS: f64 = 1.0;

/// How sure it is that a number is wrong.
#[derive(Debug, PartialEq)]
pub(super) enum Doubt {
    /// It may be meant.
    Odd(String),
    /// It can't be.
    Absurd(String),
}

/// What is odd about a link's inertia, against its mass and its shapes: `body` and `shapes` in the link's frame.
///
/// The mass is the square root of `tr(I) / 2m` away from its centre (root mean square), which no shape that holds it allows to be
/// more than its own farthest point is.
pub(super) fn of_inertia(body: &SpatialInertia, capsules: &[Capsule], visuals: &[Visual]) -> Option<Doubt> {
    let away = (body.inertia.trace() / (2.0 * body.mass)).sqrt();
    let largest = body.inertia.diagonal().max();
    let shapes = reach(&body.com, capsules, visuals);
    let says = |size: &str| {
        format!(
            "an inertia of up to {largest:.6} kg m2 on {:.3} kg puts its mass {:.1} mm from its centre on average, but {size}; \
             give kg m2 (1 kg m2 is 1e6 kg mm2)",
            body.mass,
            1e3 * away
        )
    };
    let reaches = |r: f64| format!("its shapes reach {:.1} mm from there", 1e3 * r);
    if away > ABSURD {
        return Some(Doubt::Absurd(says("no link is so large")));
    }
    match shapes {
        Some(r) if away > SPREAD * r || away < DENSE * r => Some(Doubt::Odd(says(&reaches(r)))),
        None if away > SHAPELESS => Some(Doubt::Odd(says("it has no shape"))),
        _ => None,
    }
}

/// How far the farthest point of some shapes is from a point, m, at most; `None` without shapes.
fn reach(from: &Point3<f64>, capsules: &[Capsule], visuals: &[Visual]) -> Option<f64> {
    let of_capsules = capsules.iter().map(|c| (c.a - from).norm().max((c.b - from).norm()) + c.radius);
    let of_visuals = visuals.iter().map(|v| {
        let half = match &v.shape {
            VisualShape::Cuboid { size } => size.norm() / 2.0,
            VisualShape::Sphere { radius } => *radius,
            VisualShape::Cylinder { radius, length } => radius.hypot(length / 2.0),
            VisualShape::Mesh { vertices, .. } => {
                let far = |p: &Point3<f64>| (v.link_from_visual * p - from).norm();
                return vertices.iter().map(far).fold(0.0, f64::max);
            }
        };
        (v.link_from_visual.translation.vector - from.coords).norm() + half
    });
    of_capsules.chain(of_visuals).reduce(f64::max)
}

/// What is odd about where a link's collision shapes lie.
pub(super) fn of_shapes(capsules: &[Capsule]) -> Option<Doubt> {
    let away = reach(&Point3::origin(), capsules, &[])?;
    let says = format!("a collision shape reaches {away:.2} m from the link's frame; sizes and `origin xyz` are in m");
    too_far(away, says)
}

fn too_far(away: f64, says: String) -> Option<Doubt> {
    (away > FAR).then_some(if away > ABSURD { Doubt::Absurd(says) } else { Doubt::Odd(says) })
}

/// What is odd about a joint's limits and its origin.
pub(super) fn of_joint(joint: &Joint) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    let (lower, upper, speed) = (joint.limit.lower, joint.limit.upper, joint.limit.velocity);
    let turns = matches!(joint.joint_type, JointType::Revolute | JointType::Continuous);
    let largest = lower.abs().max(upper.abs());
    if joint.joint_type == JointType::Revolute && largest > LARGEST_TURN {
        doubts.push(Doubt::Odd(format!(
            "its limits {lower} to {upper} rad are {:.1} turns; limits are in rad: if degrees were meant, give {:.4} to {:.4}, \
             and for a joint without end type=\"continuous\"",
            (upper - lower) / std::f64::consts::TAU,
            lower.to_radians(),
            upper.to_radians()
        )));
    }
    if joint.joint_type == JointType::Prismatic && largest > ABSURD {
        doubts.push(Doubt::Odd(format!("its limits {lower} to {upper} m are longer than any slide; limits are in m")));
    }
    if turns && speed > LARGEST_SPEED {
        let meant = speed.to_radians();
        doubts.push(Doubt::Odd(format!(
            "its velocity limit of {speed} rad/s is faster than any arm; it is in rad/s: if degrees were meant, give {meant:.4}"
        )));
    }
    let [x, y, z] = *joint.origin.xyz;
    let away = x.hypot(y).hypot(z);
    let says = format!("it lies {away:.2} m from its parent link's frame; `origin xyz` is in m");
    doubts.extend(too_far(away, says));
    if let Some(angle) = joint.origin.rpy.iter().find(|a| a.abs() > std::f64::consts::TAU + 1e-3) {
        let meant = angle.to_radians();
        doubts.push(Doubt::Odd(format!(
            "its origin turns by {angle} rad; `rpy` is in rad: {angle} degrees are {meant:.4}"
        )));
    }
    doubts
}
