//! What a driven base adds to a step: the iiwa on the Ridgeback against the iiwa on its pedestal, in the same run.
use std::path::{Path, PathBuf};
use std::sync::Arc;

use calamus::control::{ImpedanceOptions, LawOptions};
use calamus::math::Rgb;
use calamus::pen::{LayerPen, PenModel};
use calamus::plan::{SegmentKind, Trajectory};
use calamus::robot::{BasePose, Cell, JointVector};
use calamus::skill::Task;
use calamus::surface::{Projection, Scene};
use calamus::truth::TrueCanvas;
use calamus::twin::{
    ArmSetup, BaseSetup, MobilePlant, PlantKind, Simulation, TipForce, TrueScene, TwinOptions, WheelCommand,
};
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};

fn main() {
    divan::main();
}

/// Steps of a sample, of 1 ms each.
const STEPS: u64 = 2000;
/// Both plants.
const PLANTS: [PlantKind; 2] = [PlantKind::Rapier, PlantKind::Articulated];

fn asset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// An arm before the column, on its base or on its pedestal.
fn simulation(plant: PlantKind, on_base: bool) -> Simulation {
    let robot = if on_base { "robots/iiwa_ridgeback.toml" } else { "robots/iiwa_fixed.toml" };
    let arm = Cell::load(&asset(robot)).expect("the robot loads").arms.remove(0);
    let scene = Scene::read(&asset("scenes/column.toml")).expect("the scene loads");
    let canvas = TrueCanvas::nominal(scene.canvas);
    let mapping = Box::new(Projection::new(canvas.reveal()));
    let pen = PenModel::named("fineliner_08").expect("a known pen");
    let pens = vec![LayerPen { pen, ink: "black".into() }];
    let scene = Arc::new(TrueScene { canvas, friction: 0.3, compliance: 0.0, mapping, pens });
    let (model, believed) = (arm.model.clone(), arm.model);
    let colors = vec![Rgb([0, 0, 0])];
    let setup = ArmSetup { index: 0, model, believed, start: arm.home, layer: 0, gripper: None, colors };
    let law = LawOptions::Impedance(ImpedanceOptions::default());
    let options = TwinOptions { plant, ..TwinOptions::default() };
    match arm.base {
        Some(base) => {
            let pose = BasePose { x: -1.0, y: 0.0, yaw: 0.0 };
            let mobile = BaseSetup { believed: base.clone(), base, pose, believed_pose: pose, localiser: None };
            Simulation::on_base(setup, mobile, scene, law, &options)
        }
        None => Simulation::new(setup, scene, law, &options),
    }
    .expect("the simulation begins")
}

/// Kinematics, law, contact and plant, the pen in the air; items are steps.
fn whole(bencher: Bencher, plant: PlantKind, on_base: bool) {
    let mut simulation = simulation(plant, on_base);
    let stand = Trajectory::rest(simulation.desired().q, 1e5);
    let task = Task::alone(SegmentKind::Travel, 0, None, stand);
    let movement = task.movement().expect("is a motion");
    bencher.counter(ItemsCount::new(STEPS as usize)).bench_local(|| {
        simulation.execute(movement, None, STEPS, None).expect("it stays finite");
        simulation.take_log()
    });
}

/// The arm on its pedestal.
#[divan::bench(args = PLANTS, sample_count = 40, sample_size = 1)]
fn fixed(bencher: Bencher, plant: PlantKind) {
    whole(bencher, plant, false);
}

/// The same arm on its base, wheels held.
#[divan::bench(args = PLANTS, sample_count = 40, sample_size = 1)]
fn on_base(bencher: Bencher, plant: PlantKind) {
    whole(bencher, plant, true);
}

/// The plant of base and arm alone, wheels, springs and momentum with it.
#[divan::bench(args = PLANTS, sample_count = 20, sample_size = 100)]
fn base_plant(bencher: Bencher, kind: PlantKind) {
    let arm = Cell::load(&asset("robots/iiwa_ridgeback.toml")).expect("the robot loads").arms.remove(0);
    let base = arm.base.expect("it has a base");
    let mut plant = MobilePlant::new(&arm.model, &base, &base.start, &arm.home, kind, 1e-3).expect("is taken");
    let weight = arm.model.mass_and_bias(&arm.model.kinematics(&arm.home), &JointVector::zeros()).1;
    let command = WheelCommand::Hold;
    bencher.bench_local(|| assert!(plant.step(black_box(&weight), &TipForce::default(), &command)));
}
