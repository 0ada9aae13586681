//! Tours through points strewn evenly over a square: the time by number of points at one effort.
use calamus::math::stream;
use calamus::tour::{Effort, TourOptions, solve};
use divan::Bencher;
use divan::counter::ItemsCount;
use nalgebra::Point2;
use rand_chacha::rand_core::Rng;

fn main() {
    divan::main();
}

fn bench(bencher: Bencher, points: usize, kicks: f64) {
    let mut rng = stream(1, "points", points as u64);
    let mut unit = || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let points: Vec<Point2<f64>> = (0..points).map(|_| Point2::new(unit(), unit())).collect();
    let options = TourOptions { effort: Effort::Kicks(kicks), ..TourOptions::default() };
    bencher
        .counter(ItemsCount::new(points.len()))
        .bench_local(|| solve(&points, &options).expect("the points are finite"));
}

/// Neighbours, greedy tour, and Lin-Kernighan moves until none is left; items are points.
#[divan::bench(args = [10_000, 50_000, 200_000], sample_count = 3, sample_size = 1)]
fn lin_kernighan(bencher: Bencher, points: usize) {
    bench(bencher, points, 0.0);
}

/// The same, and a kick for every tenth point; items are points.
#[divan::bench(args = [10_000, 50_000, 200_000], sample_count = 3, sample_size = 1)]
fn chained(bencher: Bencher, points: usize) {
    bench(bencher, points, 0.1);
}
