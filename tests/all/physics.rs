//! The physics that every picture rests on: forces, contact, impedance, and rapier against the robot's own model.
use crate::support::{canvas, follow, iiwa, inverse_kinematics, pen_pose, posture, run, run_by, smooth};
use std::sync::LazyLock;

use calamus::control::{
    ImpedanceController, ImpedanceOptions, LawOptions, PositionOptions, Press, Reference, design_damping,
};
use calamus::math::Pose;
use calamus::mesh::{TriMesh, shapes};
use calamus::plan::SegmentKind;
use calamus::robot::{ArmModel, JointVector};
use calamus::twin::{ArticulatedPlant, EventKind, Plant, PlantKind, RapierPlant, Record, TipForce, TwinOptions};
use nalgebra::{Matrix6, Point3, SymmetricEigen, Vector3, Vector6};

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
        let mut plant = RapierPlant::new(std::slice::from_ref(&arm), &[q], dt).unwrap();
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
    let mut plant = RapierPlant::new(std::slice::from_ref(&arm), &[q], dt).unwrap();
    let model = arm.forward_dynamics(&k, &zero, &(torques() + k.generalized_force(&tip.point, &tip.force))).unwrap();
    plant.step(&[torques()], &[tip], &[k]).unwrap();
    let error = (plant.state(0).qd / dt - model).norm() / model.norm();
    assert!(error < 1e-9, "relative error {error:e}");
}

/// Relative difference of rapier's and the model's acceleration after 0.2 s of motion in steps of `dt`.
fn moving_error(arm: &ArmModel, q: &JointVector, dt: f64) -> f64 {
    let mut plant = RapierPlant::new(std::slice::from_ref(arm), &[*q], dt).unwrap();
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
        Box::new(RapierPlant::new(std::slice::from_ref(&arm), &[q], dt).unwrap()),
        Box::new(ArticulatedPlant::new(vec![arm.clone()], &[q], dt)),
    ];
    let ends = plants.each_mut().map(|plant| {
        let mut controller = ImpedanceController::new(arm.clone(), ImpedanceOptions::default());
        for i in 0..1000 {
            let state = *plant.state(0);
            let k = arm.kinematics(&state.q);
            let mut reference = Reference {
                q,
                qd: JointVector::zeros(),
                qdd: JointVector::zeros(),
                press: Press::default(),
                by_joint: 0.0,
            };
            reference.q[1] += 0.1 * smooth(f64::from(i) * 1e-3);
            let out = controller.torque(&state, &k, &reference, dt);
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
            let mut plant = RapierPlant::new(std::slice::from_ref(&arm), &[q], dt).unwrap();
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
                let reference = Reference {
                    q: goal,
                    qd: JointVector::zeros(),
                    qdd: JointVector::zeros(),
                    press: Press::default(),
                    by_joint: 0.0,
                };
                let out = controller.torque(&state, &now, &reference, dt);
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
    let force = record.arms[0].samples.last().unwrap().normal_force.unwrap();
    assert!((force / (m * 9.81) - 1.0).abs() < 0.01, "{force} N for {} N", m * 9.81);
}

/// Presses and draws on a surface: from 5 mm above it down to 3 mm under it within 0.6 s, a second and a half of rest, then
/// along `line(s)` (contact point and normal) for `length` m at 20 mm/s.
fn press_and_draw(
    mesh: TriMesh,
    seed: JointVector,
    length: f64,
    line: impl Fn(f64) -> (Point3<f64>, Vector3<f64>),
) -> Record {
    let (arm, _) = iiwa();
    let pose = |s: f64, height: f64| {
        let (p, n) = line(s);
        pen_pose(p + n * height, -n)
    };
    let q = inverse_kinematics(&arm, &pose(0.0, 0.005), &seed);
    let press = follow(&arm, &q, SegmentKind::Press, 0.0, 2.1, |t| pose(0.0, 0.005 - 0.008 * smooth(t / 0.6)));
    let at = inverse_kinematics(&arm, &pose(0.0, -0.003), &q);
    let time = length / 0.02;
    let draw = follow(&arm, &at, SegmentKind::Draw, press.end(), time, |t| pose(length * ramp(t / time), -0.003));
    run(&arm, &arm, ImpedanceOptions::default(), q, vec![press, draw], &canvas(mesh), &TwinOptions::default())
}

/// From 0 to 1 at constant speed but for smooth ends.
fn ramp(t: f64) -> f64 {
    let (t, e) = (t.clamp(0.0, 1.0), 0.1);
    let v = 1.0 / (1.0 - e);
    let foot = |t: f64| v * e * ((t / e).powi(3) - 0.5 * (t / e).powi(4));
    if t < e {
        foot(t)
    } else if t > 1.0 - e {
        1.0 - foot(1.0 - t)
    } else {
        v * (t - 0.5 * e)
    }
}

static PLANE: LazyLock<Record> = LazyLock::new(|| {
    let (_, seed) = iiwa();
    press_and_draw(table(), seed, 0.1, |s| (Point3::new(0.6, s - 0.05, TABLE), Vector3::z()))
});

/// A dome of 150 mm radius and 5 mm triangles, drawn on over its top.
static DOME: LazyLock<Record> = LazyLock::new(|| {
    let (_, seed) = iiwa();
    let dome = shapes::dome(0.15, 0.005).unwrap().transformed(&Pose::translation(0.6, 0.0, TABLE - 0.15));
    press_and_draw(dome, seed, 0.12, |s| {
        let a = (s - 0.06) / 0.15;
        let n = Vector3::new(0.1, a.sin(), a.cos()).normalize();
        (Point3::new(0.6, 0.0, TABLE - 0.15) + n * 0.15, n)
    })
});

/// An upright column of 250 mm radius, drawn on across its front.
static COLUMN: LazyLock<Record> = LazyLock::new(|| {
    let column = shapes::cylinder(0.25, 0.5, 0.005).unwrap().transformed(&Pose::translation(0.95, 0.0, 0.65));
    press_and_draw(column, posture([0.0, 10.0, 0.0, -100.0, 0.0, -20.0, 0.0]), 0.1, |s| {
        let a = (s - 0.05) / 0.25;
        let n = Vector3::new(-a.cos(), a.sin(), 0.0);
        (Point3::new(0.95, 0.0, 0.9) + n * 0.25, n)
    })
});

#[test]
fn pressing_by_delta_gives_k_delta() {
    for (name, record) in [("plane", &*PLANE), ("dome", &*DOME), ("column", &*COLUMN)] {
        // the last instant of the rest before drawing
        let rest = record.arms[0].samples.iter().rfind(|s| s.segment == SegmentKind::Press).unwrap();
        let desired = 350.0 * 0.003;
        assert!(
            (rest.normal_force.unwrap() / desired - 1.0).abs() < 0.03,
            "{name}: {} N for {desired} N",
            rest.normal_force.unwrap()
        );
    }
}

#[test]
fn force_is_steady_and_never_lost_while_drawing() {
    for (name, record, bound) in [("plane", &*PLANE, 0.05), ("dome", &*DOME, 0.12), ("column", &*COLUMN, 0.12)] {
        let stroke = &record.arms[0].strokes[0];
        let spread = stroke.force.sd() / stroke.force.mean;
        assert!(spread < bound, "{name}: spread {spread:.4}");
        assert_eq!((stroke.contact_steps, stroke.lost_contacts), (stroke.steps, 0), "{name}");
        assert!(stroke.steps > 4900, "{name}: {} steps", stroke.steps);
        assert_eq!(stroke.saturated_steps, 0, "{name}");
    }
}

#[test]
fn ink_lies_where_the_pen_pressed() {
    let record = &*PLANE;
    let line = record.ink.strokes.iter().max_by(|a, b| a.length().total_cmp(&b.length())).unwrap();
    assert!((line.length() - 0.1).abs() < 1e-3, "{} m of ink", line.length());
    for p in &line.points {
        assert!((p.position.x - 0.6).abs() < 2e-4 && (p.position.z - TABLE).abs() < 1e-9, "{}", p.position);
    }
    assert_eq!(record.arms[0].pen_up_contact_steps, 0);
}

/// Comes down at 100 mm/s, is still that fast at the surface, brakes within half a millimetre and presses on slowly.
#[test]
fn landing_at_100_mm_s_stays_under_15_newton() {
    let (arm, seed) = iiwa();
    let (speed, brake) = (0.1, 10.0);
    let (t_touch, t_stop) = (0.4, 0.4 + speed / brake);
    // speeds up over 0.2 s, cruises 0.2 s, brakes from the surface on
    let height = |t: f64| {
        if t < 0.2 {
            0.03 - speed * 0.2 * ((t / 0.2).powi(3) - 0.5 * (t / 0.2).powi(4))
        } else if t < t_touch {
            speed * (t_touch - t)
        } else {
            let u = t.min(t_stop) - t_touch;
            let stopped = speed * u - 0.5 * brake * u * u;
            -stopped - (0.003 - 0.5 * speed * speed / brake) * smooth((t - t_stop) / 0.5)
        }
    };
    let q = inverse_kinematics(&arm, &above(0.6, 0.0, 0.03), &seed);
    let land = follow(&arm, &q, SegmentKind::Press, 0.0, 1.4, |t| above(0.6, 0.0, height(t)));
    let record = run(&arm, &arm, ImpedanceOptions::default(), q, vec![land], &canvas(table()), &TwinOptions::default());
    let touch = record.events.iter().find(|e| e.kind == EventKind::Touch).unwrap().time;
    let samples = &record.arms[0].samples;
    let before = samples.iter().rposition(|s| s.time < touch).unwrap();
    let at = |i: usize| samples[i].tip.z;
    let landing_speed = (at(before - 1) - at(before)) / 0.01;
    assert!(landing_speed > 0.09, "landed at {landing_speed} m/s");
    assert!(record.arms[0].max_force < 15.0, "peak {} N", record.arms[0].max_force);
}

#[test]
fn a_joint_stops_at_its_limit_on_both_plants() {
    let (mut arm, q) = iiwa();
    let last = arm.joints.len() - 1;
    (arm.joints[last].lower, arm.joints[last].upper) = (-0.3, 0.3);
    let dt = 1e-3;
    let mut tau = JointVector::zeros();
    tau[last] = 1.0;
    let plants: [(&str, Box<dyn Plant>); 2] = [
        ("articulated", Box::new(ArticulatedPlant::new(vec![arm.clone()], &[q], dt))),
        ("rapier", Box::new(RapierPlant::new(&[arm.clone()], &[q], dt).unwrap())),
    ];
    for (name, mut plant) in plants {
        let mut farthest = 0.0f64;
        for _ in 0..800 {
            let state = *plant.state(0);
            let k = arm.kinematics(&state.q);
            let (_, bias) = arm.mass_and_bias(&k, &state.qd);
            // held up against gravity, the last joint pushed
            plant.step(&[bias + tau], &[TipForce::default()], &[k]).unwrap();
            farthest = farthest.max(plant.state(0).q[last]);
        }
        assert!((0.29..0.32).contains(&farthest), "{name} turned to {farthest} rad");
    }
}

const PLANTS: [PlantKind; 2] = [PlantKind::Articulated, PlantKind::Rapier];

#[test]
fn position_control_keeps_to_a_free_path_within_a_tenth_of_a_millimetre() {
    let (mut arm, seed) = iiwa();
    for j in &mut arm.joints {
        // what the drawing robot's torque loops leave of its gears' friction
        (j.damping, j.friction) = (0.5, 0.05);
    }
    // 120 mm at 40 mm/s
    let pose = |t: f64| above(0.6, 0.12 * ramp(t / 3.33) - 0.06, 0.05);
    let q = inverse_kinematics(&arm, &pose(0.0), &seed);
    let travel = follow(&arm, &q, SegmentKind::Travel, 0.0, 3.5, pose);
    for plant in PLANTS {
        let options = TwinOptions { plant, ..Default::default() };
        let record = run_by(
            [&arm, &arm],
            LawOptions::Position(PositionOptions::default()),
            q,
            vec![travel.clone()],
            &canvas(table()),
            &options,
        );
        let samples = &record.arms[0].samples;
        let off = samples.iter().map(|s| (s.tip - s.tip_desired.unwrap()).norm()).fold(0.0, f64::max);
        assert!(off < 1e-4, "{plant:?}: {off} m off");
        assert!((samples[samples.len() - 1].tip - samples[0].tip).norm() > 0.1);
    }
}

/// Presses 0.2 mm deeper than the table is: the force tells how stiff arm and nib are together.
#[test]
fn position_control_is_stiff_at_the_tip_and_knows_how_stiff() {
    let (arm, seed) = iiwa();
    let depth = 2e-4;
    let pose = |t: f64| above(0.6, 0.0, 0.002 - (0.002 + depth) * smooth(t / 0.8));
    let q = inverse_kinematics(&arm, &pose(0.0), &seed);
    let press = follow(&arm, &q, SegmentKind::Press, 0.0, 1.0, pose);
    let at = inverse_kinematics(&arm, &pose(1.0), &q);
    let stand = follow(&arm, &at, SegmentKind::Draw, press.end(), 1.0, |_| pose(1.0));
    for plant in PLANTS {
        let options = TwinOptions { plant, ..Default::default() };
        let record = run_by(
            [&arm, &arm],
            LawOptions::Position(PositionOptions::default()),
            q,
            vec![press.clone(), stand.clone()],
            &canvas(table()),
            &options,
        );
        let samples = &record.arms[0].samples;
        let (force, earlier) =
            (samples[samples.len() - 1].normal_force.unwrap(), samples[samples.len() - 40].normal_force.unwrap());
        assert!((force / earlier - 1.0).abs() < 1e-3, "{plant:?}: it hums: {force} N, {earlier} N");
        let nib = calamus::pen::PenModel::named("fineliner_08").unwrap().spring.stiffness;
        let arm_stiffness = force / (depth - force / nib);
        assert!(arm_stiffness >= 2e4, "{plant:?}: {arm_stiffness} N/m");
        // the press that is expected is the series of both
        let expected = record.arms[0].strokes[0].target.mean / 0.003 * depth;
        assert!((force / expected - 1.0).abs() < 0.03, "{plant:?}: {force} N for {expected} N");
    }
}

/// Impedance control feels a canvas 8 mm higher than believed as a little more force; position control as a wall.
#[test]
fn a_canvas_that_stands_higher_is_pressed_hard_by_position_control_alone() {
    let (arm, seed) = iiwa();
    let pose = |t: f64| above(0.6, 0.0, 0.002 - 0.010 * smooth(t / 1.0));
    let q = inverse_kinematics(&arm, &pose(0.0), &seed);
    let press = follow(&arm, &q, SegmentKind::Press, 0.0, 1.2, pose);
    let soft =
        run(&arm, &arm, ImpedanceOptions::default(), q, vec![press.clone()], &canvas(table()), &TwinOptions::default());
    let soft = &soft.arms[0];
    let rest = soft.samples[soft.samples.len() - 1].normal_force.unwrap();
    assert!((rest / (350.0 * 0.008) - 1.0).abs() < 0.2, "{rest} N");
    // it lands fast there
    assert!(soft.max_force < 10.0, "{} N", soft.max_force);
    let hard = run_by(
        [&arm, &arm],
        LawOptions::Position(PositionOptions::default()),
        q,
        vec![press],
        &canvas(table()),
        &TwinOptions::default(),
    );
    assert!(hard.arms[0].max_force > 60.0, "{} N", hard.arms[0].max_force);
}
