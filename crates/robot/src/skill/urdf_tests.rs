//! The hand's numbers and its URDF are the same hand.
use std::collections::BTreeMap;
use std::path::Path;

use super::{FINGER_NAMES, HandModel};
use crate::math::rotation_vector;
use crate::robot::{UrdfOptions, urdf};

/// Reads one finger of the URDF from the grip frame, every joint that isn't its own held open.
fn finger(name: &str) -> crate::robot::ArmModel {
    let mut freeze = BTreeMap::new();
    for other in FINGER_NAMES.iter().filter(|n| **n != name) {
        for (joint, at) in [("joint_1", 0.0495), ("joint_2", 0.0), ("joint_3", -0.0523)] {
            freeze.insert(format!("{other}_{joint}"), at);
        }
        if *other != "finger_middle" {
            freeze.insert(format!("palm_{other}_joint"), 0.0);
        }
    }
    // as a chain of its own, the distal joint follows nothing
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/robotiq_3f.urdf"));
    let text: String = std::fs::read_to_string(file)
        .unwrap()
        .lines()
        .filter(|l| !l.contains("<mimic"))
        .map(|l| format!("{l}\n"))
        .collect();
    let options = UrdfOptions { tip_link: Some(format!("{name}_link_3")), freeze, ..UrdfOptions::default() };
    urdf::parse(&text, file, &options).unwrap().model
}

#[test]
fn joints_limits_and_masses_are_those_of_the_urdf() {
    let hand = HandModel::robotiq_3f();
    // the grip frame is the palm's, turned: x of the grip is y of the palm
    let palm_from_grip =
        nalgebra::UnitQuaternion::from_axis_angle(&nalgebra::Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
    for (model, name) in hand.fingers.iter().zip(FINGER_NAMES) {
        let arm = finger(name);
        let mut joints = arm.joints.iter();
        let mut before = crate::math::Pose::from_parts(Default::default(), palm_from_grip);
        before *= model.knuckle.parent_from_joint;
        if model.spread != 0.0 {
            let scissor = joints.next().unwrap();
            assert_eq!([scissor.lower, scissor.upper], model.knuckle.limits);
            let off = before.inverse() * scissor.parent_from_joint;
            assert!(off.translation.vector.norm() < 1e-9 && rotation_vector(&off.rotation).norm() < 1e-6, "{off}");
            before = crate::math::Pose::identity();
        }
        for (i, phalanx) in model.phalanges.iter().enumerate() {
            let joint = joints.next().unwrap();
            assert_eq!([joint.lower, joint.upper], phalanx.limits);
            let off = (before * phalanx.parent_from_joint).inverse() * joint.parent_from_joint;
            assert!(off.translation.vector.norm() < 1e-9 && rotation_vector(&off.rotation).norm() < 1e-6, "{off}");
            before = crate::math::Pose::identity();
            let link = &arm.links[arm.dof() - 2 + i];
            let own = phalanx.shape.inertia(phalanx.mass);
            assert!((link.inertia.mass - own.mass).abs() < 1e-9);
            assert!((link.inertia.com - own.com).norm() < 1e-8);
            assert!((link.inertia.inertia - own.inertia).norm() < 1e-9);
        }
    }
}
