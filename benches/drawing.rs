//! Artwork in, picture out: reading an SVG, tidying strokes, and rasterising ink.
use std::path::Path;

use calamus::drawing::tidy::{TidyOptions, tidy};
use calamus::drawing::{Drawing, InkLayer, Stroke, SvgOptions, svg};
use calamus::ink::{InkPoint, InkStroke, InkTrace, RasterOptions, TraceInk, rasterise};
use calamus::math::{Rgb, stream};
use divan::Bencher;
use divan::counter::{BytesCount, ItemsCount};
use nalgebra::{Point2, Point3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;

fn main() {
    divan::main();
}

/// A number in [0, 1).
fn unit(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// The owl: 56 kB of paths in two inks.
#[divan::bench]
fn read_svg(bencher: Bencher) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/art/owl.svg");
    let bytes = std::fs::read(&file).expect("the owl is there");
    bencher
        .counter(BytesCount::of_slice(&bytes))
        .bench_local(|| svg::parse(&bytes, &file, &SvgOptions::default()).expect("the owl is sound"));
}

/// Merges, simplifies and orders strokes of 20 points each, strewn over a sheet; items are strokes.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn tidy_strokes(bencher: Bencher) {
    const STROKES: usize = 5000;
    let mut rng = stream(1, "strokes", 0);
    let strokes = (0..STROKES)
        .map(|_| {
            let (x, y, turn) = (unit(&mut rng) - 0.5, unit(&mut rng) - 0.5, std::f64::consts::TAU * unit(&mut rng));
            let point = |i: i32| {
                let s = f64::from(i) * 1e-3;
                Point2::new(0.4 * x + s * (turn + 20.0 * s).cos(), 0.4 * y + s * (turn + 20.0 * s).sin())
            };
            Stroke::new((0..20).map(point).collect())
        })
        .collect();
    let layer = InkLayer { name: "black".into(), color: Rgb([0, 0, 0]), width_hint: None, strokes };
    let drawing = Drawing::new(0.5, 0.5, vec![layer]);
    bencher
        .counter(ItemsCount::new(STROKES))
        .with_inputs(|| drawing.clone())
        .bench_local_values(|mut drawing| tidy(&mut drawing, &TidyOptions::default()));
}

/// Lines of 0.8 mm in 1,000,000 segments of 0.15 mm, wound over a sheet of 300 mm, on 4096 x 4096 pixels; items are
/// segments.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn rasterise_a_million_segments(bencher: Bencher) {
    const STROKES: usize = 1000;
    const SEGMENTS: usize = 1000;
    let mut rng = stream(1, "ink", 0);
    let strokes = (0..STROKES)
        .map(|_| {
            let (x, y, turn) = (unit(&mut rng) - 0.5, unit(&mut rng) - 0.5, std::f64::consts::TAU * unit(&mut rng));
            // a circle of 48 mm round, gone round three times
            let point = |i: usize| {
                let angle = turn + i as f64 * 0.02;
                let sheet = Point2::new(0.28 * x + 0.0075 * angle.cos(), 0.28 * y + 0.0075 * angle.sin());
                InkPoint {
                    position: Point3::new(sheet.x, sheet.y, 0.0),
                    normal: Vector3::z(),
                    sheet,
                    width: 8e-4,
                    density: 1.0,
                    time: 0.0,
                }
            };
            InkStroke { ink: 0, stroke: None, arm: 0, points: (0..=SEGMENTS).map(point).collect() }
        })
        .collect();
    let trace = InkTrace { inks: vec![TraceInk { name: "black".into(), color: Rgb([0, 0, 0]) }], strokes };
    let options = RasterOptions::with_long_side(0.3, 0.3, 4096);
    bencher
        .counter(ItemsCount::new(STROKES * SEGMENTS))
        .bench_local(|| rasterise(&trace, &options).expect("the trace is sound"));
}
