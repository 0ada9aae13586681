//! The true base against closed forms.
use std::path::Path;
use std::sync::Arc;

use nalgebra::{Point3, Vector3, Vector6};

use super::{BaseSetup, Localiser, LocaliserKind, MobilePlant, WheelCommand};
use crate::control::{
    DriveOptions, DrivePath, ImpedanceOptions, LawOptions, PositionController, PositionOptions, Reference,
};
use crate::pen::{LayerPen, PenModel};
use crate::plan::SagModel;
use crate::robot::{Arm, BaseModel, BasePose, Cell, GRAVITY, JointVector, Mecanum, MountModel, Odometry, Twist};
use crate::surface::{Projection, Scene};
use crate::truth::TrueCanvas;
use crate::twin::{ArmSetup, PlantKind, Simulation, TipForce, TrueScene, TwinOptions};

const DT: f64 = 1e-3;
const PLANTS: [PlantKind; 2] = [PlantKind::Rapier, PlantKind::Articulated];

fn robot() -> (Arm, BaseModel) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/iiwa_ridgeback.toml");
    let arm = Cell::load(&file).expect("loads").arms.remove(0);
    let base = arm.base.clone().expect("has a base");
    (arm, base)
}

/// A base with its arm held by a stiff law.
struct Held {
    plant: MobilePlant,
    law: PositionController,
    q: JointVector,
    qd: JointVector,
    tip: TipForce,
}

impl Held {
    fn new(arm: &Arm, base: &BaseModel, q: JointVector, hertz: f64, kind: PlantKind) -> Self {
        let plant = MobilePlant::new(&arm.model, base, &base.start, &q, kind, DT).expect("is taken");
        let frequency = hertz * std::f64::consts::TAU;
        let options = PositionOptions { frequency, torque_rate: 1e6, ..PositionOptions::default() };
        let law = PositionController::new(arm.model.clone(), options);
        Self { plant, law, q, qd: JointVector::zeros(), tip: TipForce::default() }
    }

    fn step(&mut self, command: &WheelCommand) {
        let state = *self.plant.state();
        let k = self.law.model().kinematics(&state.q);
        let reference = Reference { qd: self.qd, ..Reference::rest(self.q) };
        let torque = self.law.torque(&state, &k, &reference, DT).torque;
        assert!(self.plant.step(&torque, &self.tip, command), "stays finite");
    }

    fn run(&mut self, time: f64, command: &WheelCommand) {
        for _ in 0..(time / DT).round() as usize {
            self.step(command);
        }
    }

    /// Motion of the base's frame since the start, m and rad.
    fn moved(&self, base: &BaseModel) -> Vector6<f64> {
        let at = base.start.pose().inverse() * self.plant.base_pose();
        crate::robot::wrench(&at.translation.vector, &at.rotation.scaled_axis())
    }
}

fn turn(base: &BaseModel, x: f64, y: f64, yaw: f64) -> WheelCommand {
    let w = Mecanum::new(base).expect("can drive").wheels(&Twist { x, y, yaw });
    WheelCommand::Turn([w[0], w[1], w[2], w[3]])
}

#[test]
fn a_base_at_rest_stays_at_rest_wherever_it_stands() {
    let (arm, mut base) = robot();
    for kind in PLANTS {
        for start in [BasePose::default(), BasePose { x: 5.0, y: -3.0, yaw: 9.0 }] {
            base.start = start;
            let mut held = Held::new(&arm, &base, arm.home, 60.0, kind);
            held.run(0.3, &WheelCommand::Hold);
            let moved = held.moved(&base);
            assert!(moved.norm() < 1e-7, "{kind:?} {start:?}: {moved}");
        }
    }
}

#[test]
fn momentum_is_kept_on_ice() {
    let (arm, mut base) = robot();
    base.tyre.friction = 0.0;
    base.tyre.rolling_resistance = 0.0;
    for kind in PLANTS {
        let mut held = Held::new(&arm, &base, arm.home, 10.0, kind);
        let mut most: f64 = 0.0;
        for i in 0..1500 {
            let t = f64::from(i) * DT;
            held.q[0] = 0.6 * (1.0 - (5.0 * t).cos());
            held.q[3] = arm.home[3] + 0.3 * (7.0 * t).sin();
            held.step(&WheelCommand::Hold);
            let (p, l) = momentum(&held.plant);
            assert!(p.xy().norm() < 1e-9 && l < 1e-9, "{kind:?} at {t:.3} s: {p} {l}");
            most = most.max(held.plant.twist().norm());
        }
        assert!(most > 0.02, "{kind:?}: the arm moves the base");
    }
}

/// Linear momentum, and angular momentum about the vertical through the world's origin, link by link.
fn momentum(plant: &MobilePlant) -> (Vector3<f64>, f64) {
    let (k, qd, arm) = (plant.kinematics(), plant.state().qd, plant.arm());
    let (mut p, mut l) = (Vector3::zeros(), Vector3::zeros());
    let mut lin: Vector3<f64> = plant.twist().fixed_rows::<3>(0).into();
    let mut ang: Vector3<f64> = plant.twist().fixed_rows::<3>(3).into();
    for i in 0..=arm.dof() {
        if i > 0 {
            let [rotation, slide] = k.joint_motion(i - 1);
            ang += rotation * qd[i - 1];
            lin += slide * qd[i - 1];
        }
        let (pose, body) = (k.world_from_link(i), &arm.links[i].inertia);
        let at = (pose * body.com).coords;
        let linear = (lin + ang.cross(&at)) * body.mass;
        let turn = pose.rotation.to_rotation_matrix();
        p += linear;
        l += at.cross(&linear) + turn * (body.inertia * (turn.inverse() * ang));
    }
    (p, l.z.abs())
}

#[test]
fn acceleration_ends_where_all_wheels_slip() {
    let (arm, mut base) = robot();
    base.tyre.friction = 0.1;
    base.tyre.rolling_resistance = 0.0;
    for kind in PLANTS {
        for (x, y) in [(1.0, 0.0), (0.0, 1.0)] {
            let mut held = Held::new(&arm, &base, base.transport, 60.0, kind);
            let command = turn(&base, 5.0 * x, 5.0 * y, 0.0);
            held.run(0.2, &command);
            let before = momentum(&held.plant).0;
            held.run(0.3, &command);
            // unequal loads turn the base, so that its middle goes another way than the whole's centre of mass
            let gained = momentum(&held.plant).0 - before;
            let mass: f64 = held.plant.arm().links.iter().map(|l| l.inertia.mass).sum();
            let found = gained.dot(&Vector3::new(x, y, 0.0)) / (0.3 * mass);
            let expected = 0.1 * GRAVITY / 2f64.sqrt();
            assert!((found / expected - 1.0).abs() < 0.02, "{kind:?} {x} {y}: {found} of {expected} m/s2");
        }
    }
}

#[test]
fn a_base_falls_short_sideways_by_its_rollers_friction() {
    let (arm, base) = robot();
    let whole = arm.model.links.iter().map(|l| l.inertia.mass).sum::<f64>();
    let load = whole * GRAVITY / 4.0;
    let expected = 2f64.sqrt() * base.tyre.rolling_resistance * load / (base.tyre.stiffness * base.tyre.half_length);
    for (x, y) in [(0.1, 0.0), (0.0, 0.1)] {
        let mut held = Held::new(&arm, &base, base.transport, 60.0, PlantKind::Articulated);
        let wheels = Mecanum::new(&base).expect("can drive");
        let mut odometry = Odometry::at(base.start);
        let (mut from, mut believed) = (Vector3::zeros(), BasePose::default());
        for i in 0..4000 {
            let now = f64::from(i + 1) * 1e-3;
            let share = now.min(1.0);
            held.step(&turn(&base, x * share, y * share, 0.0));
            odometry.read(&wheels, &held.plant.wheels().map(|w| w.angle).into(), DT);
            if i == 1500 {
                (from, believed) = (held.plant.base_pose().translation.vector, odometry.pose);
            }
        }
        let way = held.plant.base_pose().translation.vector - from;
        let told = Vector3::new(odometry.pose.x - believed.x, odometry.pose.y - believed.y, 0.0);
        let short = 1.0 - way.xy().norm() / told.xy().norm();
        if x > 0.0 {
            assert!(short.abs() < 1e-3, "ahead: {short}");
        } else {
            assert!((short / expected - 1.0).abs() < 0.08, "sideways: {short} of {expected}");
        }
    }
}

/// How far the base goes per second while 5 N push at the pen, with the arm's sway on top, m/s.
fn creep(arm: &Arm, base: &BaseModel) -> f64 {
    let mut held = Held::new(arm, base, arm.home, 20.0, PlantKind::Articulated);
    let mean = |held: &mut Held, from: f64| {
        let mut sum = Vector3::zeros();
        // whole periods of the sway
        let steps = 10_000;
        for i in 0..steps {
            let t = from + f64::from(i) * DT;
            let sway = 2.0 * (std::f64::consts::TAU * 1.7 * t).sin();
            let point = Point3::from(held.plant.kinematics().world_from_tip().translation.vector);
            held.tip = TipForce { point, force: Vector3::new(-5.0, 1.5 + sway, 0.3 * sway) };
            held.step(&WheelCommand::Hold);
            sum += held.plant.base_pose().translation.vector;
        }
        sum / f64::from(steps)
    };
    mean(&mut held, 0.0);
    let first = mean(&mut held, 10.0);
    let second = mean(&mut held, 20.0);
    (second - first).xy().norm() / 10.0
}

#[test]
fn a_parked_base_stays_and_one_on_a_proportional_loop_creeps() {
    let (arm, mut base) = robot();
    let hundred_minutes = 6000.0;
    let held = creep(&arm, &base) * hundred_minutes;
    assert!(held < 2e-5, "held: {held} m in 100 min");
    base.motor.hold_gain = 0.0;
    let slips = creep(&arm, &base) * hundred_minutes;
    assert!(slips > 0.5, "a proportional loop: {slips} m in 100 min");
}

/// The robot before a wall, all as it believes.
fn simulation(kind: PlantKind, localiser: Option<Localiser>) -> (Simulation, BaseModel) {
    let (arm, base) = robot();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let scene = Scene::read(&scenes.join("column.toml")).expect("the scene loads");
    let canvas = TrueCanvas::nominal(scene.canvas);
    let mapping = Box::new(Projection::new(canvas.reveal()));
    let pen = PenModel::named("fineliner_08").expect("a known pen");
    let pens = vec![LayerPen { pen, ink: "black".into() }];
    let scene = Arc::new(TrueScene { canvas, friction: 0.3, compliance: 0.0, mapping, pens });
    let (model, believed) = (arm.model.clone(), arm.model);
    let start = base.transport;
    let setup =
        ArmSetup { index: 0, model, believed, start, layer: 0, gripper: None, colors: vec![crate::math::Rgb([0; 3])] };
    // far from the column
    let pose = BasePose { x: -3.0, y: 2.0, yaw: 0.5 };
    let mobile = BaseSetup { base: base.clone(), believed: base.clone(), pose, believed_pose: pose, localiser };
    let options = TwinOptions { plant: kind, ..TwinOptions::default() };
    let law = LawOptions::Impedance(ImpedanceOptions::default());
    (Simulation::on_base(setup, mobile, scene, law, &options).expect("begins"), base)
}

#[test]
fn a_drive_ends_where_the_wheels_tell_and_short_of_it_sideways() {
    let localiser = Localiser::new(LocaliserKind::Perfect.options(), [0.0; 2], 1, 0);
    let (mut simulation, base) = simulation(PlantKind::Articulated, Some(localiser));
    let (sin, cos) = 0.5f64.sin_cos();
    // half a metre to the left
    let stop = BasePose { x: -3.0 - 0.5 * sin, y: 2.0 + 0.5 * cos, yaw: 0.5 };
    let path = DrivePath { stops: vec![stop], options: DriveOptions::default() };
    // slices make no difference
    let mut halfway = None;
    let driven = loop {
        if let Some(driven) = simulation.drive(&path, 700).expect("drives") {
            break driven;
        }
        halfway.get_or_insert_with(|| simulation.state().clone());
    };
    assert!(driven.arrived);
    let far = |a: &BasePose, b: &BasePose| (a.x - b.x).hypot(a.y - b.y);
    assert!(far(&driven.belief.by_wheels, &stop) < 1.1e-3, "{driven:?}");
    let truth = *simulation.true_base().expect("has a base").reveal();
    let short = far(&BasePose::of(&truth), &stop) / 0.5;
    assert!((0.02..0.04).contains(&short), "{short}");
    // the perfect sensor tells, and the law believes it
    let measured = driven.belief.measured.expect("has a sensor");
    assert!((measured.translation.vector - truth.translation.vector).norm() < 1e-4);
    simulation.believe_base(&measured);
    let believed = simulation.locate().expect("has a base").by_wheels;
    assert!(far(&believed, &BasePose::of(&truth)) < 1e-4);
    let tip = truth * base.base_from_arm;
    let told = simulation.state().arm.controller.model().world_from_base;
    assert!((told.translation.vector - tip.translation.vector).norm() < 1e-4);
    // a saved state drives on to the same end
    let (mut again, _) = self::simulation(
        PlantKind::Articulated,
        Some(Localiser::new(LocaliserKind::Perfect.options(), [0.0; 2], 1, 0)),
    );
    let bytes = postcard::to_stdvec(&halfway.expect("took a while")).expect("has a serial form");
    again.restore(postcard::from_bytes(&bytes).expect("can be read"));
    let second = loop {
        if let Some(driven) = again.drive(&path, 10_000).expect("drives") {
            break driven;
        }
    };
    assert_eq!(second, driven);
}

#[test]
fn a_fixed_arm_cannot_drive() {
    let (arm, _) = robot();
    let (mobile, _) = simulation(PlantKind::Articulated, None);
    let setup = ArmSetup {
        index: 0,
        model: arm.model.clone(),
        believed: arm.model,
        start: arm.home,
        layer: 0,
        gripper: None,
        colors: vec![crate::math::Rgb([0; 3])],
    };
    let law = LawOptions::Impedance(ImpedanceOptions::default());
    let mut fixed = Simulation::new(setup, Arc::clone(&mobile.scene), law, &TwinOptions::default()).expect("begins");
    let error = fixed.drive(&DrivePath::default(), 10).expect_err("stands on the floor");
    assert!(error.to_string().contains("stands on no driven base"), "{error}");
}

#[test]
fn a_base_sags_as_its_springs_foretell() {
    let (arm, base) = robot();
    let mut to = arm.home;
    to[0] = 1.2;
    to[1] += 0.3;
    let expected = SagModel::new(&base, &arm.model, &arm.home, 1.0, None).sag(&to).expect("stands");
    for kind in PLANTS {
        let mut held = Held::new(&arm, &base, arm.home, 30.0, kind);
        let steps = 3000;
        for i in 0..steps {
            let s = f64::from(i) / f64::from(steps);
            let share = s * s * (3.0 - 2.0 * s);
            held.q = arm.home + (to - arm.home) * share;
            held.qd = (to - arm.home) * (6.0 * s * (1.0 - s) / (f64::from(steps) * DT));
            held.step(&WheelCommand::Hold);
        }
        held.qd = JointVector::zeros();
        held.run(3.0, &WheelCommand::Hold);
        let mut at_rest = arm.model.clone();
        base.stand(&mut at_rest, &base.start);
        let tip = |base_moved: &crate::math::Pose| {
            let still = at_rest.kinematics(&to).world_from_tip().translation.vector;
            (base_moved * Point3::from(still)).coords - still
        };
        let found = tip(&(base.start.pose().inverse() * held.plant.base_pose()));
        let told = tip(&expected);
        assert!(told.norm() > 2e-4, "{told}");
        assert!((found - told).norm() < 0.01 * told.norm(), "{kind:?}: {found} where {told} was foretold");
    }
}

#[test]
fn a_parked_base_sways_at_its_springs_frequencies() {
    let (arm, mut base) = robot();
    base.springs.damping_ratio = 0.005;
    // as stiff in motion as at rest
    base.motor.velocity_gain = 3.0;
    let whole = arm.model.whole_momentum(&arm.model.kinematics(&arm.home), &JointVector::zeros()).whole;
    let expected = MountModel::new(&base, &whole).frequencies(&whole);
    for kind in PLANTS {
        let mut held = Held::new(&arm, &base, arm.home, 60.0, kind);
        let mut seen: Vec<Vector6<f64>> = Vec::new();
        for i in 0..8000 {
            let point = Point3::from(held.plant.kinematics().world_from_tip().translation.vector);
            let force = if i < 30 { Vector3::new(-20.0, 15.0, 10.0) } else { Vector3::zeros() };
            held.tip = TipForce { point, force };
            held.step(&WheelCommand::Hold);
            seen.push(held.moved(&base));
        }
        for f in &expected[..3] {
            let found = peak(&seen, *f);
            assert!((found / f - 1.0).abs() < 0.02, "{kind:?}: {found} Hz of {expected:?}");
        }
    }
}

/// The frequency near `guess` at which the signals are strongest, Hz.
fn peak(seen: &[Vector6<f64>], guess: f64) -> f64 {
    let n = seen.len() as f64;
    let power = |hertz: f64| {
        let (mut re, mut im) = (Vector6::zeros(), Vector6::zeros());
        for (i, x) in seen.iter().enumerate() {
            let window = 1.0 - (std::f64::consts::TAU * i as f64 / n).cos();
            let (sin, cos) = (std::f64::consts::TAU * hertz * i as f64 * DT).sin_cos();
            re += x * (window * cos);
            im += x * (window * sin);
        }
        re.norm_squared() + im.norm_squared()
    };
    let tries = (-60..=60).map(|i| guess * (1.0 + f64::from(i) * 1e-3));
    tries.map(|f| (power(f), f)).max_by(|a, b| a.0.total_cmp(&b.0)).expect("some").1
}

#[test]
fn both_plants_agree_and_repeat_to_the_last_bit() {
    let (arm, base) = robot();
    let torque_at = |t: f64| JointVector::from_fn(|i, _| if i < 7 { 3.0 * (5.0 * t + i as f64).sin() } else { 0.0 });
    let run = |kind| {
        let mut plant = MobilePlant::new(&arm.model, &base, &base.start, &arm.home, kind, DT).expect("is taken");
        let weight = arm.model.mass_and_bias(&arm.model.kinematics(&arm.home), &JointVector::zeros()).1;
        let command = turn(&base, 0.2, 0.1, 0.1);
        for i in 0..250 {
            assert!(plant.step(&(weight + torque_at(f64::from(i) * DT)), &TipForce::default(), &command));
            if i == 100 {
                // a saved state goes on as the plant itself
                let bytes = postcard::to_stdvec(&plant).expect("has a serial form");
                plant = postcard::from_bytes(&bytes).expect("can be read");
            }
        }
        (plant.state().q, plant.base_pose())
    };
    let [rapier, ours] = PLANTS.map(run);
    assert_eq!(run(PlantKind::Rapier), rapier);
    assert_eq!(run(PlantKind::Articulated), ours);
    assert!((rapier.0 - ours.0).amax() < 1e-3, "{} {}", rapier.0, ours.0);
    let apart = (rapier.1.translation.vector - ours.1.translation.vector).norm();
    assert!(apart < 1e-4 && rapier.1.translation.x > 0.01, "{apart} m apart");
}
