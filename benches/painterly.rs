//! Painterly strokes of a picture of 640 x 480 in four inks.
use calamus::art::{PainterlyOptions, PainterlyStyle, Sheet, painterly};
use calamus::math::{PAPER, Rgb};
use calamus::picture::{Flat, Ink, Picture, linear_from_rgb, oklab_difference2, oklab_from_linear, oklab_from_rgb};
use divan::Bencher;
use divan::counter::ItemsCount;

const WIDTH: usize = 640;
const HEIGHT: usize = 480;
const STROKES: usize = 1500;

fn main() {
    divan::main();
}

/// Hills under a sky, with a low sun and ripples of light over all.
fn landscape() -> Picture {
    let mix = |a: [u8; 3], b: [u8; 3], t: f32| {
        let (a, b) = (linear_from_rgb(Rgb(a)), linear_from_rgb(Rgb(b)));
        std::array::from_fn(|k| a[k] + t.clamp(0.0, 1.0) * (b[k] - a[k]))
    };
    let pixel = |i: usize| {
        let (x, y) = ((i % WIDTH) as f32 / WIDTH as f32, (i / WIDTH) as f32 / HEIGHT as f32);
        let ripple = 0.5 + 0.5 * (40.0 * x + 25.0 * y + 3.0 * (9.0 * y).sin()).sin();
        let (near, far) = (0.72 + 0.08 * (7.0 * x).sin(), 0.5 + 0.1 * (5.0 * x + 1.0).sin());
        match () {
            () if y > near => mix([30, 40, 30], [70, 90, 50], ripple * (1.0 - x)),
            () if y > far => mix([60, 90, 140], [110, 130, 120], x + 0.3 * ripple),
            () if (x - 0.7).hypot(y - 0.3) < 0.1 => mix([255, 250, 220], [250, 200, 80], 5.0 * (x - 0.65)),
            () => mix([240, 200, 140], [180, 190, 220], 1.6 * y + 0.2 * ripple),
        }
    };
    Picture::from_pixels(WIDTH, HEIGHT, (0..WIDTH * HEIGHT).map(pixel).collect()).expect("the pixels fill it")
}

/// Each pixel in the nearest of four inks, or paper.
fn flattened(picture: &Picture) -> Flat {
    let colors = [PAPER, Rgb([235, 190, 110]), Rgb([150, 165, 190]), Rgb([75, 100, 130]), Rgb([45, 55, 40])];
    let nearest = |p: &[f32; 3]| {
        let distance = |i: &u8| oklab_difference2(oklab_from_linear(*p), oklab_from_rgb(colors[usize::from(*i)]));
        (0..5).min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("there are five")
    };
    let inks = colors.iter().enumerate().map(|(i, color)| Ink { name: format!("ink {i}"), color: *color }).collect();
    Flat::new(WIDTH, HEIGHT, inks, Some(0), picture.pixels.iter().map(nearest).collect()).expect("the labels fill it")
}

/// All of it, from pixels to pen strokes with a line of 0.8 mm on 200 x 150 mm; items are strokes.
#[divan::bench(
    args = [
        PainterlyStyle::Impressionist,
        PainterlyStyle::Expressionist,
        PainterlyStyle::ColouristWash,
        PainterlyStyle::Pointillist,
    ],
    sample_count = 3,
    sample_size = 1
)]
fn paint(bencher: Bencher, style: PainterlyStyle) {
    let picture = landscape();
    let flat = flattened(&picture);
    let options = PainterlyOptions { strokes: STROKES, ..PainterlyOptions::style(style) };
    let sheet = Sheet { width: 0.2, height: 0.15 };
    bencher
        .counter(ItemsCount::new(STROKES))
        .bench_local(|| painterly(&flat, &picture, sheet, &[8e-4; 5], &options, 1).expect("there is much to draw"));
}
