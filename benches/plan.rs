//! How many poses a second the planner finds for the iiwa; items are poses.
use std::path::{Path, PathBuf};

use calamus::drawing::pattern::Pattern;
use calamus::math::Rgb;
use calamus::plan::{self, IkSolver, PenTarget, PlanOptions, Posture};
use calamus::robot::Cell;
use calamus::surface::{BelievedCanvas, Projection, Scene, map_drawing};
use divan::Bencher;
use divan::counter::ItemsCount;
use nalgebra::{Point3, Vector3};

fn main() {
    divan::main();
}

fn asset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// Inverse kinematics alone: the pen down along a line of 200 mm in 2,000 poses, each from the one before.
#[divan::bench]
fn inverse_kinematics(bencher: Bencher) {
    const POSES: usize = 2000;
    let arm = Cell::load(&asset("robots/iiwa_fixed.toml")).expect("the robot loads").arms.remove(0);
    let solver = IkSolver::new(&arm.model, 0.03);
    let target = |i: usize| PenTarget {
        position: Point3::new(0.55, -0.1 + 0.2 * i as f64 / (POSES - 1) as f64, 0.45),
        axis: -Vector3::z(),
    };
    let start = solver.reach(&target(0), &arm.home).expect("the line can be reached").q;
    let posture = Posture { reference: arm.home, pull: 0.01, most: 0.01 };
    bencher.counter(ItemsCount::new(POSES)).bench_local(|| {
        (0..POSES).fold(start, |q, i| solver.follow(&target(i), &q, &posture).expect("the line can be reached").q)
    });
}

/// A whole plan: Koch's snowflake of 160 mm on the hemisphere, in steps of 1 mm, with room checks, timing and travels.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn snowflake_on_a_dome(bencher: Bencher) {
    let arm = Cell::load(&asset("robots/iiwa_fixed.toml")).expect("the robot loads").arms.remove(0);
    let scene = Scene::read(&asset("scenes/hemisphere.toml")).expect("the scene loads");
    let drawing = Pattern::Snowflake { order: 4, color: Rgb([0, 0, 0]) }.draw(0.16).expect("there is such a pattern");
    let belief = BelievedCanvas(scene.canvas);
    let mapped = map_drawing(&drawing, &Projection::new(&belief), 1e-3).expect("it lies on the dome");
    let furniture: Vec<_> = scene.furniture.into_iter().map(|f| f.mesh).collect();
    let options = PlanOptions::default();
    let plan = || {
        plan::plan(
            &plan::PlanJob {
                arm_index: 0,
                arm: &arm.model,
                home: &arm.home,
                service: &arm.service,
                drawing: &mapped,
                canvas: &belief,
                obstacles: &furniture,
            },
            &options,
            &mut |_| (),
        )
        .expect("it can be reached")
    };
    let poses = plan().statistics.poses;
    bencher.counter(ItemsCount::new(poses)).bench_local(plan);
}
