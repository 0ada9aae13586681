//! Pictures become points and lines: stippling and TSP art.
use calamus::art::{DotCount, Sheet, StippleOptions, TspOptions, stipple, tsp_art};
use calamus::math::Rgb;
use calamus::picture::{Ink, Plane, Tone};
use divan::Bencher;
use divan::counter::ItemsCount;

fn main() {
    divan::main();
}

/// Waves over a slope: every tone from white to black.
fn picture(width: usize, height: usize) -> Plane {
    Plane::from_fn(width, height, |x, y| {
        let (u, v) = (x as f32 / width as f32, y as f32 / height as f32);
        (0.5 * (u + v) + 0.4 * (12.0 * u).sin() * (9.0 * v).cos()).clamp(0.0, 1.0)
    })
}

/// 2000 x 1500 px to 80,000 dots; items are dots.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn stipple_80_000(bencher: Bencher) {
    let density = picture(2000, 1500);
    let options = StippleOptions::new(DotCount::Points(80_000));
    bencher.counter(ItemsCount::new(80_000usize)).bench_local(|| stipple(&density, &options, 1));
}

/// Four inks of 800 x 600 px, 80,000 points in all, tours and all; items are points.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn tsp_art_of_four_inks(bencher: Bencher) {
    let tone = |name: &str| Tone { ink: Ink { name: name.into(), color: Rgb([0, 0, 0]) }, coverage: picture(800, 600) };
    let tones: Vec<(Tone, f64)> = ["yellow", "magenta", "cyan", "black"].map(|n| (tone(n), 8e-4)).into();
    let options = TspOptions { points: Some(80_000), ..TspOptions::default() };
    let sheet = Sheet { width: 0.4, height: 0.3 };
    bencher
        .counter(ItemsCount::new(80_000usize))
        .bench_local(|| tsp_art(&tones, sheet, &options, 1).expect("the tones are sound"));
}
