//! Pictures of the steps: segments, depth, superpixels, and the painting as it grows.
use nalgebra::Point2;

use crate::art::Plate;
use crate::art::depth::canvas::{Paper, through};
use crate::art::depth::{Kind, Semantics, Superpixels};
use crate::math::{Rgb, linear_from_srgb};
use crate::picture::{Flat, Picture};

/// Longer side that a frame has at least, px: small pictures are painted larger, as lines are thin.
const FRAME: usize = 1000;

/// A stroke as the frames show it.
pub(super) struct Placed<'a> {
    /// The pen's way, px of the picture.
    pub line: &'a [Point2<f64>],
    /// Width of the line, px of the picture.
    pub width: f64,
    /// Index of its ink.
    pub ink: usize,
    /// Whether it is part of an outline.
    pub outline: bool,
}

/// The plates of what is known before the first stroke.
pub(super) fn maps(original: &Picture, semantics: &Semantics, superpixels: Option<&Superpixels>) -> Vec<Plate> {
    let (width, height) = (semantics.width(), semantics.height());
    let order = semantics.drawing_order();
    let mut colors = vec![[0.5; 3]; semantics.segments().len()];
    for (rank, s) in order.iter().enumerate() {
        // things in full colours, stuff in pale ones; hues a golden angle apart, so that neighbours differ
        let full = matches!(semantics.segments()[*s].kind, Kind::Thing { .. });
        colors[*s] = hue(rank as f32 * 137.508, if full { 1.0 } else { 0.4 });
    }
    let tint = |(s, p): (&u16, &[f32; 3])| {
        let light = 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
        std::array::from_fn(|k| colors[usize::from(*s)][k] * (0.35 + 0.65 * light.clamp(0.0, 1.0).sqrt()))
    };
    let segments = semantics.labels().iter().zip(&original.pixels).map(tint).collect();
    let gray = |d: &f32| [linear_from_srgb((255.0 * d) as u8) as f32; 3];
    let depth = semantics.depth().values.iter().map(gray).collect();
    let mut plates = vec![
        plate("segments", caption(semantics, &order), width, height, segments),
        plate("depth", "depth: near is bright".to_string(), width, height, depth),
    ];
    if let Some(s) = superpixels {
        let edge = |i: usize| {
            let differs = |j: usize| s.labels.get(j).is_some_and(|l| *l != s.labels[i]);
            (i % width + 1 < width && differs(i + 1)) || differs(i + width)
        };
        let pixels = original.pixels.iter().enumerate().map(|(i, p)| if edge(i) { p.map(|v| 0.25 * v) } else { *p });
        let caption = format!("{} superpixels: seeds of strokes", s.cells.len());
        plates.push(plate("superpixels", caption, width, height, pixels.collect()));
    }
    plates.into_iter().flatten().collect()
}

fn caption(semantics: &Semantics, order: &[usize]) -> String {
    const SHOWN: usize = 8;
    let names: Vec<&str> = order.iter().take(SHOWN).map(|s| semantics.segments()[*s].name.as_str()).collect();
    let more = if order.len() > SHOWN { format!(" and {} more", order.len() - SHOWN) } else { String::new() };
    format!("segments in their order: {}{more}", names.join(", "))
}

/// A colour of a hue, deg, in linear light.
fn hue(degrees: f32, saturation: f32) -> [f32; 3] {
    let wave = |shift: f32| {
        let v = (0.5 + 0.5 * (degrees + shift).to_radians().cos()).powi(2);
        0.9 * (1.0 - saturation * (1.0 - v))
    };
    [wave(0.0), wave(-120.0), wave(120.0)]
}

fn plate(name: &str, caption: String, width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Option<Plate> {
    let image = Picture::from_pixels(width, height, pixels)?.to_image().ok()?;
    Some(Plate { name: name.to_string(), caption, image })
}

/// The painting after some strokes, so many times, evenly spread; the first frame shows the first outline alone.
pub(super) fn frames(flat: &Flat, paper: Rgb, strokes: &[Placed], count: usize) -> Vec<Plate> {
    let scale = (FRAME as f64 / flat.width().max(flat.height()) as f64).clamp(1.0, 4.0);
    let size = |n: usize| (n as f64 * scale).round() as usize;
    let mut sheet = Paper::new(size(flat.width()), size(flat.height()), paper);
    let through: Vec<[f32; 3]> = flat.inks.iter().map(|i| through(i.color, paper)).collect();
    let outline = strokes.iter().take_while(|s| s.outline).count();
    let mut plates = Vec::with_capacity(count);
    let mut drawn = 0;
    for frame in 1..=count {
        let even = strokes.len() * frame / count;
        let until = if frame == 1 && count > 1 && outline > 0 { outline } else { even.max(drawn) };
        for s in &strokes[drawn..until] {
            let line: Vec<Point2<f64>> = s.line.iter().map(|p| p * scale).collect();
            sheet.lay(&line, s.width * scale);
            sheet.ink(through[s.ink]);
        }
        drawn = until;
        let Ok(image) = sheet.picture().to_image() else { continue };
        let caption = format!("after {drawn} of {} strokes", strokes.len());
        plates.push(Plate { name: format!("frame-{frame:02}"), caption, image });
    }
    plates
}
