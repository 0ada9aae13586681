//! The physics that every picture rests on: forces, contact, impedance, and rapier against the robot's own model.
mod support;

use calamus::control::{ImpedanceController, ImpedanceOptions, MeasuredState, Reference, design_damping};
use calamus::math::Pose;
use calamus::mesh::TriMesh;
use calamus::plan::SegmentKind;
use calamus::robot::{ArmModel, JointVector};
use calamus::twin::{ArticulatedPlant, Plant, PlantKind, RapierPlant, TipForce, TwinOptions};
use nalgebra::{Matrix6, Point3, SymmetricEigen, Vector3, Vector6};
use support::{FromAbove, canvas, follow, iiwa, inverse_kinematics, pen_pose, run, smooth};

/// Surface height of the test plane, m.
const TABLE: f64 = 0.45;

fn table() -> TriMesh {
    let corner = |x: f64, y: f64| Point3::new(x, y, TABLE);
    let corners = vec![corner(0.2, -0.4), corner(1.0, -0.4), corner(1.0, 0.4), corner(0.2, 0.4)];
    TriMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

/// The pen pointing down at `(x, y)`, `height` above the table.
fn above(x: f64, y: f64, height: f64) -> Pose {
    pen_pose(Point3::new(x, y, TABLE + height), -Vector3::z())
}

fn torques() -> JointVector {
    JointVector::from_fn(|i, _| if i < 7 { (i as f64 * 1.3).sin() * 5.0 } else { 0.0 })
}

#[test]
fn rapier_accelerates_at_rest_as_the_model_says() {
    let (arm, q) = iiwa();
    let (k, zero, dt) = (arm.kinematics(&q), JointVector::zeros(), 1e-3);
    for tau in [torques(), zero] {
        let mut plant = RapierPlant::new(&[arm.clone()], &[q], dt).unwrap();
        let model = arm.forward_dynamics(&k, &zero, &tau).unwrap();
        plant.step(&[tau], &[TipForce::default()], &[k]).unwrap();
        let error = (plant.state(0).qd / dt - model).norm() / model.norm();
        assert!(error < 1e-9, "relative error {error:e}");
    }
}

#[test]
fn rapier_feels_a_force_at_the_tip_as_the_model_does() {
    let (arm, q) = iiwa();
    let (k, zero, dt) = (arm.kinematics(&q), JointVector::zeros(), 1e-3);
    let tip =
        TipForce { point: Point3::from(k.world_from_tip().translation.vector), force: Vector3::new(3.0, -2.0, 9.0) };
    let mut plant = RapierPlant::new(&[arm.clone()], &[q], dt).unwrap();
    let model = arm.forward_dynamics(&k, &zero, &(torques() + k.generalized_force(&tip.point, &tip.force))).unwrap();
    plant.step(&[torques()], &[tip], &[k]).unwrap();
    let error = (plant.state(0).qd / dt - model).norm() / model.norm();
    assert!(error < 1e-9, "relative error {error:e}");
}

/// Relative difference of rapier's and the model's acceleration after 0.2 s of motion in steps of `dt`.
fn moving_error(arm: &ArmModel, q: &JointVector, dt: f64) -> f64 {
    let mut plant = RapierPlant::new(&[arm.clone()], &[*q], dt).unwrap();
    let tau = torques();
    for _ in 0..(0.2 / dt).round() as usize {
        let k = arm.kinematics(&plant.state(0).q);
        plant.step(&[tau], &[TipForce::default()], &[k]).unwrap();
    }
    let state = *plant.state(0);
    let k = arm.kinematics(&state.q);
    let model = arm.forward_dynamics(&k, &state.qd, &tau).unwrap();
    plant.step(&[tau], &[TipForce::default()], &[k]).unwrap();
    ((plant.state(0).qd - state.qd) / dt - model).norm() / model.norm()
}

#[test]
fn rapier_converges_to_the_model_linearly_in_the_step() {
    let (arm, q) = iiwa();
    let errors = [1e-3, 1e-4, 1e-5].map(|dt| moving_error(&arm, &q, dt));
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log10();
        assert!((0.9..1.1).contains(&order), "errors {errors:?}");
    }
    assert!(errors[2] < 1e-4, "errors {errors:?}");
}

#[test]
fn both_plants_draw_the_same_motion() {
    let (arm, q) = iiwa();
    let mut arm = arm;
    for j in &mut arm.joints {
        (j.damping, j.friction) = (0.2, 0.05);
    }
    let dt = 1e-3;
    let mut plants: [Box<dyn Plant>; 2] = [
        Box::new(RapierPlant::new(&[arm.clone()], &[q], dt).unwrap()),
        Box::new(ArticulatedPlant::new(vec![arm.clone()], &[q], dt)),
    ];
    let ends = plants.each_mut().map(|plant| {
        let mut controller = ImpedanceController::new(arm.clone(), ImpedanceOptions::default());
        for i in 0..1000 {
            let state = *plant.state(0);
            let k = arm.kinematics(&state.q);
            let mut wish = Reference { q, qd: JointVector::zeros(), qdd: JointVector::zeros(), expected_force: 0.0 };
            wish.q[1] += 0.1 * smooth(f64::from(i) * 1e-3);
            let out = controller.torque(&state, &k, &wish, dt);
            plant.step(&[out.torque], &[TipForce::default()], &[k]).unwrap();
        }
        *plant.state(0)
    });
    let difference = (ends[0].q - ends[1].q).amax();
    assert!(difference < 2e-4, "{difference} rad apart after 1 s");
    assert!((ends[0].q - q).amax() > 0.05, "the arm moved");
}

/// Steps the set point along each mode of the hand's inertia and stiffness, and reads the damping ratio off the answer.
#[test]
fn a_step_is_answered_with_the_designed_damping() {
    let (arm, q) = iiwa();
    let options = ImpedanceOptions::default();
    let (k, dt) = (arm.kinematics(&q), 1e-3);
    let j = k.jacobian();
    let (mass, _) = arm.mass_and_bias(&k, &JointVector::zeros());
    let lambda = (j * mass.try_inverse().unwrap() * j.transpose()).try_inverse().unwrap();
    let r = *k.world_from_tip().rotation.to_rotation_matrix().matrix();
    let mut stiffness = Matrix6::zeros();
    let block = |g: &[f64; 3]| r * nalgebra::Matrix3::from_diagonal(&Vector3::from(*g)) * r.transpose();
    stiffness.fixed_view_mut::<3, 3>(0, 0).copy_from(&block(&options.stiffness));
    stiffness.fixed_view_mut::<3, 3>(3, 3).copy_from(&block(&options.rotational_stiffness));
    assert!(design_damping(&lambda, &stiffness, options.damping_ratio).is_some());
    let l = lambda.cholesky().unwrap().unpack();
    let li = l.try_inverse().unwrap();
    let modes = SymmetricEigen::new(li * stiffness * li.transpose());
    for ratio in [0.5, 0.7] {
        for mode in 0..6 {
            let shape = li.transpose() * modes.eigenvectors.column(mode);
            let shape = shape / shape.norm() * 1e-3;
            let mut target = *k.world_from_tip();
            target.translation.vector += shape.fixed_rows::<3>(0);
            let turn = Vector3::new(shape[3], shape[4], shape[5]);
            target.rotation = nalgebra::UnitQuaternion::from_scaled_axis(turn) * target.rotation;
            let goal = inverse_kinematics(&arm, &target, &q);
            let mut controller = ImpedanceController::new(
                arm.clone(),
                ImpedanceOptions { damping_ratio: ratio, torque_rate: f64::INFINITY, ..options.clone() },
            );
            let mut plant = RapierPlant::new(&[arm.clone()], &[q], dt).unwrap();
            let (mut overshoot, dual) = (0.0f64, lambda * shape);
            for _ in 0..1500 {
                let state = *plant.state(0);
                let now = arm.kinematics(&state.q);
                let p = now.world_from_tip().translation.vector - k.world_from_tip().translation.vector;
                let w = calamus::math::rotation_vector(
                    &(now.world_from_tip().rotation * k.world_from_tip().rotation.inverse()),
                );
                let moved = Vector6::new(p.x, p.y, p.z, w.x, w.y, w.z).dot(&dual) / shape.dot(&dual);
                overshoot = overshoot.max(moved - 1.0);
                let wish =
                    Reference { q: goal, qd: JointVector::zeros(), qdd: JointVector::zeros(), expected_force: 0.0 };
                let out = controller.torque(&state, &now, &wish, dt);
                plant.step(&[out.torque], &[TipForce::default()], &[now]).unwrap();
            }
            let log = overshoot.ln();
            let seen = -log / (log * log + std::f64::consts::PI.powi(2)).sqrt();
            assert!((seen / ratio - 1.0).abs() < 0.1, "mode {mode}: {seen:.3} for {ratio}");
        }
    }
}

#[test]
fn a_known_weight_on_the_tip_presses_with_its_weight() {
    let (belief, q0) = iiwa();
    let mut truth = belief.clone();
    let last = truth.links.last_mut().unwrap();
    // 100 g at the tip that the robot knows nothing of, on a hand that is free along the pen
    let (m, tip) = (0.1, Point3::from(truth.last_from_tip.translation.vector));
    let body = &mut last.inertia;
    let total = body.mass + m;
    let com = Point3::from((body.com.coords * body.mass + tip.coords * m) / total);
    let shift = |p: Point3<f64>, mass: f64| {
        let d = p - com;
        (nalgebra::Matrix3::identity() * d.norm_squared() - d * d.transpose()) * mass
    };
    body.inertia += shift(body.com, body.mass) + shift(tip, m);
    (body.com, body.mass) = (com, total);
    let free = ImpedanceOptions { stiffness: [1500.0, 1500.0, 0.0], ..Default::default() };
    let q = inverse_kinematics(&belief, &above(0.6, 0.0, 1e-4), &q0);
    let stand = follow(&belief, &q, SegmentKind::Draw, 0.0, 4.0, |_| above(0.6, 0.0, 0.0));
    let record = run(&truth, &belief, free, q, vec![stand], &canvas(table()), &TwinOptions::default());
    for s in record.arms[0].samples.iter().step_by(20) {
    }
    let force = record.arms[0].samples.last().unwrap().normal_force;
    assert!((force / (m * 9.81) - 1.0).abs() < 0.01, "{force} N for {} N", m * 9.81);
}
