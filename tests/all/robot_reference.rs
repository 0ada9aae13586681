//! Kinematics and dynamics against independently computed values of the iiwa 7 and the UR5e.
use std::path::Path;

use calamus::robot::{ArmModel, GRAVITY, JointVector, UrdfOptions, urdf};
use nalgebra::Vector3;
use serde_json::Value;

fn reference() -> Value {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/robot-reference-values.json");
    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

fn robots() -> Vec<(ArmModel, Value)> {
    let all = reference();
    ["iiwa7", "ur5e"]
        .into_iter()
        .map(|name| {
            let values = all[name].clone();
            let link = |key: &str| values[key].as_str().map(str::to_string);
            let options = UrdfOptions { base_link: link("root"), tip_link: link("tip"), ..Default::default() };
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("robots/{name}.urdf"));
            (urdf::load(&file, &options).unwrap(), values)
        })
        .collect()
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn joints(v: &Value) -> JointVector {
    let q = numbers(v);
    JointVector::from_fn(|i, _| q.get(i).copied().unwrap_or(0.0))
}

/// Runs `check` on every reference case and demands at least three of each robot.
fn each_case(check: impl Fn(&ArmModel, &Value, &JointVector)) {
    for (arm, values) in robots() {
        let cases = values["cases"].as_array().unwrap();
        assert!(cases.len() >= 3);
        for case in cases {
            check(&arm, case, &joints(&case["q"]));
        }
    }
}

fn near(a: f64, b: f64, tolerance: f64, what: &str) {
    assert!((a - b).abs() <= tolerance, "{what}: {a} is not {b}");
}

#[test]
fn poses_agree_to_a_nanometre() {
    each_case(|arm, case, q| {
        let pose = arm.kinematics(q).world_from_tip().to_homogeneous();
        for (i, row) in case["pose"].as_array().unwrap().iter().enumerate() {
            for (j, value) in numbers(row).into_iter().enumerate() {
                near(pose[(i, j)], value, 1e-9, "pose");
            }
        }
    });
}

#[test]
fn jacobians_agree() {
    each_case(|arm, case, q| {
        let jacobian = arm.kinematics(q).jacobian();
        for (i, row) in case["jacobian"].as_array().unwrap().iter().enumerate() {
            for (j, value) in numbers(row).into_iter().enumerate() {
                near(jacobian[(i, j)], value, 1e-9, "jacobian");
            }
        }
    });
}

#[test]
fn gravity_torques_agree() {
    near(reference()["gravity_m_s2"].as_f64().unwrap(), GRAVITY, 0.0, "gravity");
    each_case(|arm, case, q| {
        let (k, zero) = (arm.kinematics(q), JointVector::zeros());
        let down = Vector3::new(0.0, 0.0, -GRAVITY);
        let tau = arm.inverse_dynamics(&k, &zero, &zero, &down);
        let (_, bias) = arm.mass_and_bias(&k, &zero);
        for (j, value) in numbers(&case["gravity"]).into_iter().enumerate() {
            near(tau[j], value, 1e-6, "gravity torque");
            near(bias[j], value, 1e-6, "bias at rest");
        }
    });
}

#[test]
fn mass_matrices_agree() {
    each_case(|arm, case, q| {
        let k = arm.kinematics(q);
        let mass = arm.mass_matrix(&k);
        for (i, row) in case["mass_matrix"].as_array().unwrap().iter().enumerate() {
            for (j, value) in numbers(row).into_iter().enumerate() {
                near(mass[(i, j)], value, 1e-6, "mass matrix");
            }
        }
    });
}

/// Inverse dynamics, mass matrix and bias are computed by three routes and must tell one story, moving too.
#[test]
fn inverse_and_forward_dynamics_are_inverse() {
    each_case(|arm, _, q| {
        let n = arm.dof();
        let wave = |a: f64| JointVector::from_fn(|i, _| if i < n { (a + i as f64 * 1.7).sin() } else { 0.0 });
        let (qd, qdd, k) = (wave(0.3), wave(1.1), arm.kinematics(q));
        let down = Vector3::new(0.0, 0.0, -GRAVITY);
        let tau = arm.inverse_dynamics(&k, &qd, &qdd, &down);
        let (mass, bias) = arm.mass_and_bias(&k, &qd);
        let back = arm.forward_dynamics(&k, &qd, &tau).unwrap();
        for i in 0..n {
            near(back[i], qdd[i], 1e-9, "acceleration");
            near((mass * qdd + bias)[i], tau[i], 1e-9, "torque");
        }
    });
}

/// Against central differences along a parabola in joint space.
#[test]
fn velocities_and_accelerations_of_the_tip_are_derivatives() {
    each_case(|arm, _, q| {
        let n = arm.dof();
        let wave = |a: f64| JointVector::from_fn(|i, _| if i < n { (a + i as f64 * 1.7).sin() } else { 0.0 });
        let (qd, qdd, h) = (wave(0.3), wave(1.1), 1e-4);
        let at = |t: f64| arm.kinematics(&(q + qd * t + qdd * (0.5 * t * t)));
        let p = |t: f64| at(t).world_from_tip().translation.vector;
        let (v, a) = at(0.0).tip_motion(&qd, &qdd);
        let (velocity, acceleration) = ((p(h) - p(-h)) / (2.0 * h), (p(h) + p(-h) - p(0.0) * 2.0) / (h * h));
        for i in 0..3 {
            near(v[i], velocity[i], 1e-6, "velocity");
            near(a[i], acceleration[i], 1e-5, "acceleration");
            near(at(0.0).tip_velocity(&qd)[i], v[i], 1e-12, "tip velocity");
        }
    });
}
