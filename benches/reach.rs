//! Maps of reach, 50 mm between points, and points solved one by one; items are points within the arm's span.
use std::path::{Path, PathBuf};

use calamus::math::{stream, unit};
use calamus::plan::{PlanOptions, Reach, ReachGrid, ReachProbe};
use calamus::robot::Cell;
use divan::Bencher;
use divan::counter::ItemsCount;
use nalgebra::Vector3;

fn main() {
    divan::main();
}

const ROBOTS: [&str; 2] = ["iiwa_fixed", "ur5e_fixed"];

fn cell(robot: &str) -> Cell {
    let file: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("robots").join(format!("{robot}.toml"));
    Cell::load(&file).expect("the robot loads")
}

fn points(cell: &Cell, grid: &ReachGrid) -> Vec<usize> {
    (0..grid.len()).filter(|i| grid.is_within(&cell.arms[0].model, *i)).collect()
}

/// The whole map, pen down.
#[divan::bench(args = ROBOTS, sample_count = 3, sample_size = 1)]
fn map(bencher: Bencher, robot: &str) {
    let cell = cell(robot);
    let arm = &cell.arms[0];
    let axis = -Vector3::z();
    let grid = ReachGrid::around(&[&arm.model], &axis, 0.05).expect("a lattice");
    let probe = ReachProbe::new(&arm.model, &arm.home, &[], &axis, &PlanOptions::default(), 0.2).expect("a patch");
    let count = points(&cell, &grid).len();
    bencher.counter(ItemsCount::new(count)).bench_local(|| probe.map(&grid, &|_| ()));
}

/// 1,000 random points by themselves; at least 99 % agree with the map.
#[divan::bench(args = ROBOTS, sample_count = 1, sample_size = 1)]
fn one_by_one(bencher: Bencher, robot: &str) {
    const POINTS: usize = 1000;
    let cell = cell(robot);
    let arm = &cell.arms[0];
    let axis = -Vector3::z();
    let grid = ReachGrid::around(&[&arm.model], &axis, 0.05).expect("a lattice");
    let probe = ReachProbe::new(&arm.model, &arm.home, &[], &axis, &PlanOptions::default(), 0.2).expect("a patch");
    let map = probe.map(&grid, &|_| ());
    let within = points(&cell, &grid);
    let mut random = stream(11, "points", 0);
    let tried: Vec<usize> = (0..POINTS).map(|_| within[(unit(&mut random) * within.len() as f64) as usize]).collect();
    bencher.counter(ItemsCount::new(POINTS)).bench_local(|| {
        let alone: Vec<bool> = tried.iter().map(|i| probe.reach(&grid.position(*i)) == Reach::Free).collect();
        let mapped = || tried.iter().map(|i| map.nodes[*i] == Reach::Free);
        let agree = alone.iter().zip(mapped()).filter(|(a, m)| *a == m).count();
        let (missed, free) =
            (alone.iter().zip(mapped()).filter(|(a, m)| **a && !m).count(), mapped().filter(|m| *m).count());
        println!("{robot}: {agree} of {POINTS} agree, {free} are reached on the map, {missed} are missed by it");
        assert!(agree * 100 >= POINTS * 99);
    });
}
