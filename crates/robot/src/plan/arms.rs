//! Arms that the tests of this room plan with.
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::math::Pose;
use crate::robot::{ArmModel, Capsule, JointKind, JointModel, JointVector, LinkModel, SpatialInertia};

fn joint(xyz: [f64; 3], rpy: [f64; 3], axis: [f64; 3], limit_deg: f64, velocity_deg: f64) -> JointModel {
    JointModel {
        name: String::new(),
        kind: JointKind::Revolute,
        axis: Vector3::from(axis),
        parent_from_joint: Isometry3::from_parts(
            Translation3::from(Vector3::from(xyz)),
            UnitQuaternion::from_euler_angles(rpy[0], rpy[1], rpy[2]),
        ),
        lower: -limit_deg.to_radians(),
        upper: limit_deg.to_radians(),
        velocity: velocity_deg.to_radians(),
        effort: 100.0,
        damping: 0.0,
        friction: 0.0,
        armature: 0.0,
    }
}

fn arm(
    name: &str,
    base: Vector3<f64>,
    mut joints: Vec<JointModel>,
    capsules: &[([f64; 3], [f64; 3], f64)],
    pen: Capsule,
    last_from_tip: Pose,
) -> ArmModel {
    for (i, j) in joints.iter_mut().enumerate() {
        j.name = format!("joint_{}", i + 1);
    }
    let mut links: Vec<LinkModel> = capsules
        .iter()
        .enumerate()
        .map(|(i, (a, b, radius))| LinkModel {
            name: format!("link_{i}"),
            inertia: SpatialInertia { mass: 1.0, com: Point3::origin(), inertia: Matrix3::identity() },
            capsules: vec![Capsule { a: Point3::from(*a), b: Point3::from(*b), radius: *radius }],
            visuals: Vec::new(),
        })
        .collect();
    if let Some(last) = links.last_mut() {
        last.capsules.push(pen);
    }
    ArmModel {
        name: name.into(),
        world_from_base: Isometry3::translation(base.x, base.y, base.z),
        joints,
        links,
        last_from_tip,
    }
}

/// A KUKA LBR iiwa 7 R800 on a pedestal 0.30 m high, pen 0.1275 m beyond its flange (frames and limits:
/// lbr_fri_ros2_stack, Apache-2.0).
pub(crate) fn iiwa() -> ArmModel {
    let joints = vec![
        joint([0.0, 0.0, 0.1475], [0.0; 3], [0.0, 0.0, 1.0], 170.0, 98.0),
        joint([0.0, -0.0105, 0.1925], [0.0; 3], [0.0, 1.0, 0.0], 120.0, 98.0),
        joint([0.0, 0.0105, 0.2075], [0.0; 3], [0.0, 0.0, 1.0], 170.0, 100.0),
        joint([0.0, 0.0105, 0.1925], [0.0; 3], [0.0, -1.0, 0.0], 120.0, 130.0),
        joint([0.0, -0.0105, 0.2075], [0.0; 3], [0.0, 0.0, 1.0], 170.0, 140.0),
        joint([0.0, -0.0707, 0.1925], [0.0; 3], [0.0, 1.0, 0.0], 120.0, 180.0),
        joint([0.0, 0.0707, 0.091], [0.0; 3], [0.0, 0.0, 1.0], 175.0, 180.0),
    ];
    let capsules = [
        ([0.0, 0.0, 0.0593], [-0.0331, 0.0, 0.0672], 0.12),
        ([0.0, -0.001, 0.0495], [0.0, -0.0416, 0.1943], 0.0795),
        ([0.0, 0.0111, 0.1446], [0.0, 0.0519, -0.0008], 0.0795),
        ([0.0, 0.0403, 0.1942], [0.0, 0.0006, 0.016], 0.079),
        ([0.0, -0.0108, 0.144], [0.0, -0.0519, -0.0007], 0.0795),
        ([0.002, -0.0394, 0.1831], [0.0, 0.0, -0.0019], 0.0715),
        ([0.0, 0.0697, 0.0219], [0.0, 0.0711, -0.0149], 0.0795),
        ([0.0, 0.0, -0.003], [0.0, 0.0, -0.003], 0.0525),
    ];
    let pen = Capsule { a: Point3::new(0.0, 0.0, 0.035), b: Point3::new(0.0, 0.0, 0.1575), radius: 0.005 };
    arm("iiwa", Vector3::new(0.0, 0.0, 0.30), joints, &capsules, pen, Isometry3::translation(0.0, 0.0, 0.1625))
}

/// The same arm holding its pen across the flange, so that the turn of joint 7 is not free.
pub(crate) fn iiwa_with_bent_pen() -> ArmModel {
    let mut arm = iiwa();
    arm.name = "iiwa_bent".into();
    arm.last_from_tip = Isometry3::from_parts(
        Translation3::new(0.12, 0.0, 0.085),
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 70f64.to_radians()),
    );
    if let Some(last) = arm.links.last_mut() {
        last.capsules[1] =
            Capsule { a: Point3::new(0.0, 0.0, 0.045), b: Point3::new(0.115, 0.0, 0.084), radius: 0.005 };
    }
    arm
}

/// A posture with the elbow up and the wrist over the table in front.
pub(crate) fn iiwa_home() -> JointVector {
    JointVector::from_column_slice(&[0.0, 0.435332, 0.0, -1.91986, 0.0, -0.785399, 0.0, 0.0, 0.0, 0.0])
}

/// A UR5e on the floor (frames: Universal_Robots_ROS2_Description, BSD-3-Clause), pen 0.15 m beyond the flange.
pub(crate) fn ur5e() -> ArmModel {
    use std::f64::consts::{FRAC_PI_2, PI};
    let z = [0.0, 0.0, 1.0];
    let joints = vec![
        joint([0.0, 0.0, 0.1625], [0.0; 3], z, 360.0, 180.0),
        joint([0.0; 3], [FRAC_PI_2, 0.0, 0.0], z, 360.0, 180.0),
        joint([-0.425, 0.0, 0.0], [0.0; 3], z, 180.0, 180.0),
        joint([-0.3922, 0.0, 0.1333], [0.0; 3], z, 360.0, 180.0),
        joint([0.0, -0.0997, 0.0], [FRAC_PI_2, 0.0, 0.0], z, 360.0, 180.0),
        joint([0.0, 0.0996, 0.0], [FRAC_PI_2, PI, PI], z, 360.0, 180.0),
    ];
    let capsules = [
        ([0.0, 0.0, 0.027], [0.0, 0.0, 0.0436], 0.0805),
        ([0.0, -0.0032, -0.0069], [0.0, -0.0143, -0.0007], 0.084),
        ([-0.0125, 0.0, 0.1292], [-0.4245, 0.0, 0.1288], 0.09),
        ([0.0011, 0.0, 0.0279], [-0.3873, 0.0017, 0.0091], 0.0665),
        ([0.0, 0.0, -0.0214], [0.0, -0.0016, -0.0013], 0.0645),
        ([0.0, -0.009, -0.005], [0.0, 0.0095, 0.0], 0.0575),
        ([0.0, 0.0006, -0.0272], [0.0, -0.0019, -0.0277], 0.0425),
    ];
    let pen = Capsule { a: Point3::origin(), b: Point3::new(0.0, 0.0, 0.145), radius: 0.005 };
    arm("ur5e", Vector3::zeros(), joints, &capsules, pen, Isometry3::translation(0.0, 0.0, 0.15))
}

/// The UR5e's elbow up, pen down in front of it.
pub(crate) fn ur5e_home() -> JointVector {
    JointVector::from_column_slice(&[0.0, -1.6, -1.7, -1.4, 1.57, 0.0, 0.0, 0.0, 0.0, 0.0])
}
