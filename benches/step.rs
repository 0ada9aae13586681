//! Where the time of a physics step goes: the iiwa presses and draws on the bumpy column at 1 kHz.
use std::path::{Path, PathBuf};
use std::sync::Arc;

use calamus::control::{ImpedanceController, ImpedanceOptions, LawOptions, MeasuredState, Press, Reference};
use calamus::drawing::{Drawing, InkLayer, Stroke};
use calamus::ink::{InkRecorder, NibContact};
use calamus::math::Rgb;
use calamus::pen::LayerPen;
use calamus::pen::PenModel;
use calamus::plan::{self, Plan, PlanOptions, SegmentKind};
use calamus::robot::{Arm, Cell, Kinematics};
use calamus::surface::{BelievedCanvas, Mapping, Projection, Scene, map_drawing};
use calamus::truth::TrueCanvas;
use calamus::twin::{
    ArmSetup, ArticulatedPlant, Contact, Nib, Plant, PlantKind, RapierPlant, TipForce, Touching, TrueScene,
    TwinOptions, simulate,
};
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use nalgebra::{Point2, Point3, Vector3};

fn main() {
    divan::main();
}

/// Physics and control step, s.
const DT: f64 = 1e-3;
/// Speed of the nib along the line, m/s.
const SPEED: f64 = 0.04;

fn asset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// The arm in the middle of a line of 60 mm on the column.
struct Bench {
    arm: Arm,
    plan: Plan,
    canvas: TrueCanvas,
    canvas_friction: f64,
    mapping: Projection,
    pen: PenModel,
    state: MeasuredState,
    kinematics: Kinematics,
    reference: Reference,
    /// Where the nib rests on the canvas at half a newton or so.
    tip: Point3<f64>,
    axis: Vector3<f64>,
    velocity: Vector3<f64>,
}

impl Bench {
    fn new() -> Self {
        let arm = Cell::load(&asset("robots/iiwa_fixed.toml")).expect("the robot loads").arms.remove(0);
        let scene = Scene::read(&asset("scenes/column.toml")).expect("the scene loads");
        let (truth, belief) = (TrueCanvas::nominal(scene.canvas.clone()), BelievedCanvas(scene.canvas.clone()));
        let points = (0..=60).map(|i| Point2::new((f64::from(i) - 30.0) * 1e-3, 0.0)).collect();
        let layer = InkLayer {
            name: "black".into(),
            color: Rgb([0, 0, 0]),
            width_hint: None,
            strokes: vec![Stroke::new(points)],
        };
        let drawing = Drawing::new(0.1, 0.1, vec![layer]);
        let mapping = Projection::new(truth.reveal());
        let mapped = map_drawing(&drawing, &mapping, 1e-3).expect("the line lies on the column");
        let options = PlanOptions { pen_speed: SPEED, ..Default::default() };
        let planned = plan::plan(
            &plan::PlanJob {
                arm_index: 0,
                arm: &arm.model,
                home: &arm.home,
                service: &arm.service,
                drawing: &mapped,
                canvas: &belief,
                obstacles: &[],
            },
            &options,
            &mut |_| (),
        )
        .expect("the line can be reached");
        let line = planned.plan.segments.iter().find(|s| s.kind == SegmentKind::Draw).expect("there is a stroke");
        let m = line.trajectory.sample(0.5 * line.trajectory.duration(), &mut 0);
        let reference = Reference { q: m.q, qd: m.qd, qdd: m.qdd, press: Press::steady(1.05), by_joint: 0.0 };
        let kinematics = arm.model.kinematics(&m.q);
        let set_point = Point3::from(kinematics.world_from_tip().translation.vector);
        let foot = truth.mesh().closest_point(&set_point);
        Self {
            canvas_friction: scene.friction,
            pen: PenModel::named("fineliner_08").expect("a known pen"),
            state: MeasuredState { q: m.q, qd: m.qd },
            velocity: kinematics.tip_velocity(&m.qd),
            axis: -foot.normal,
            tip: foot.position - foot.normal * 1e-4,
            plan: Plan { arms: vec![planned.plan] },
            canvas: truth,
            mapping,
            arm,
            kinematics,
            reference,
        }
    }

    fn contact(&self, nib: &mut Nib) -> Contact {
        let friction = (self.pen.spring.friction * self.canvas_friction).sqrt();
        let touching =
            Touching { tip: self.tip, axis: self.axis, velocity: self.velocity, mass: f64::INFINITY, dt: DT };
        nib.touch(&self.pen.spring, friction, self.canvas.mesh(), &touching).expect("it touches")
    }

    fn controller(&self) -> ImpedanceController {
        ImpedanceController::new(self.arm.model.clone(), ImpedanceOptions::default())
    }
}

/// The law of motion, with its own mass matrix and bias.
#[divan::bench(sample_size = 100)]
fn control(bencher: Bencher) {
    let b = Bench::new();
    let mut controller = b.controller();
    bencher.bench_local(|| controller.torque(black_box(&b.state), &b.kinematics, &b.reference, DT));
}

/// Poses of all links and the joints' axes.
#[divan::bench(sample_size = 100)]
fn kinematics(bencher: Bencher) {
    let b = Bench::new();
    bencher.bench_local(|| b.arm.model.kinematics(black_box(&b.state.q)));
}

/// The nib on the column's mesh.
#[divan::bench(sample_size = 100)]
fn contact(bencher: Bencher) {
    let b = Bench::new();
    let mut nib = Nib::default();
    bencher.bench_local(|| b.contact(black_box(&mut nib)));
}

/// Steps a plant under the torques of the controller, so that the arm stays where it is desired.
fn physics(bencher: Bencher, make: impl Fn(&Bench) -> Box<dyn Plant>) {
    let b = Bench::new();
    let mut plant = make(&b);
    let torque = b.controller().torque(&b.state, &b.kinematics, &b.reference, DT).torque;
    let force = b.contact(&mut Nib::default()).force;
    let forces = [TipForce { point: b.tip, force }];
    let mut steps = 0;
    bencher.bench_local(|| {
        // a free run under constant torques would leave the working range after a while; a new plant costs many steps
        steps += 1;
        if steps % 1000 == 0 {
            plant = make(&b);
        }
        plant.step(black_box(&[torque]), &forces, std::slice::from_ref(&b.kinematics)).expect("it stays finite");
    });
}

/// rapier's multibody.
#[divan::bench(sample_size = 100)]
fn physics_rapier(bencher: Bencher) {
    physics(bencher, |b| {
        let plant = RapierPlant::new(std::slice::from_ref(&b.arm.model), &[b.state.q], DT);
        Box::new(plant.expect("rapier takes the arm"))
    });
}

/// Calamus's own integrator.
#[divan::bench(sample_size = 100)]
fn physics_articulated(bencher: Bencher) {
    physics(bencher, |b| Box::new(ArticulatedPlant::new(vec![b.arm.model.clone()], &[b.state.q], DT)));
}

/// The pen's state and the points of its line, at 40 um a step round a circle of 20 mm.
#[divan::bench(sample_size = 100)]
fn ink(bencher: Bencher) {
    let b = Bench::new();
    let c = b.contact(&mut Nib::default());
    let (u, r) = (c.at.normal.cross(&Vector3::z()).normalize(), 0.02);
    let v = c.at.normal.cross(&u);
    let mut recorder = InkRecorder::new(b.pen.clone(), 0, 0);
    let mut time = 0.0;
    bencher.bench_local(|| {
        time += DT;
        let (sin, cos) = (time * SPEED / r).sin_cos();
        let nib = NibContact {
            position: c.at.position + (u * cos + v * sin) * r,
            normal: c.at.normal,
            normal_force: c.normal_force,
            slip_speed: SPEED,
        };
        recorder.step(DT, time, Some(&nib), None, |p| b.mapping.to_sheet(p));
    });
}

/// Everything, over the whole plan of the line; items are steps.
#[divan::bench(args = [PlantKind::Rapier, PlantKind::Articulated], sample_count = 5, sample_size = 1)]
fn whole(bencher: Bencher, plant: PlantKind) {
    let b = Bench::new();
    let pens = vec![LayerPen { pen: b.pen.clone(), ink: "black".into() }];
    let mapping = Box::new(Projection::new(b.canvas.reveal()));
    let (canvas, friction) = (b.canvas.clone(), b.canvas_friction);
    let scene = Arc::new(TrueScene { canvas, friction, compliance: 0.0, mapping, pens });
    let options = TwinOptions { plant, ..Default::default() };
    let steps = (b.plan.duration() / options.dt).ceil() as usize + 1;
    bencher.counter(ItemsCount::new(steps)).bench_local(|| {
        let (model, believed) = (b.arm.model.clone(), b.arm.model.clone());
        let colors = vec![Rgb([0, 0, 0])];
        let setup = ArmSetup { index: 0, model, believed, start: b.arm.home, layer: 0, gripper: None, colors };
        let law = LawOptions::Impedance(ImpedanceOptions::default());
        simulate(setup, &b.plan.arms[0].segments, &scene, law, &options).expect("the simulation runs")
    });
}
