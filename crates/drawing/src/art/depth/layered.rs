//! Layered depth painting (section IV.B.3 of the dissertation): what a picture means decides what is painted when.
//!
//! Things come before stuff, the heaviest thing first. Each is outlined, then filled from back to front, as if a plane moved
//! through it towards the viewer; where the plane passes, superpixels are the seeds of strokes that follow the form. One who
//! watches sees the shape first, and then its detail.
use std::borrow::Cow;

use nalgebra::Point2;

use crate::art::depth::painter::{Painter, Planned, in_order};
use crate::art::depth::plates::{self, Placed};
use crate::art::depth::{Kind, LayeredOptions, Semantics};
use crate::art::{ArtError, Artwork, Sheet};
use crate::drawing::{Drawing, InkLayer, Stroke, StrokeRef};
use crate::math::{PAPER, Rgb};
use crate::picture::{Flat, Picture, majority};

/// Most pixels that strokes are chosen on: a larger picture is made smaller first, as no pen draws so finely.
const MOST_PIXELS: usize = 1_500_000;

/// Paints a picture in layers: `flat` in its inks, along the forms of `original`, in the order that `semantics` gives.
/// Both pictures have one size; semantics of another size are resampled. The picture is fitted into the sheet, centred.
/// `line_widths` holds the width of the pen's line for each of `flat.inks`, m. Strokes share the budget by what they bring
/// the canvas nearer to the picture, `|I - C|^2` in Oklab with transparent inks; one that brings it no nearer isn't drawn.
/// [`Drawing::order`] is the order in which it is to be watched.
///
/// Plates: `segments`, `depth`, `superpixels`, and `frame-01` ... of the growing painting.
///
/// # Errors
/// [`ArtError::NothingToDraw`] when the picture is empty or all paper, [`ArtError::BadOption`] for options, sizes or widths
/// that make no sense.
pub fn layered_depth(
    flat: &Flat,
    original: &Picture,
    semantics: &Semantics,
    sheet: Sheet,
    line_widths: &[f64],
    options: &LayeredOptions,
    seed: u64,
) -> Result<Artwork, ArtError> {
    options.check()?;
    let (width, height) = (flat.width(), flat.height());
    if width == 0 || height == 0 {
        return Err(ArtError::NothingToDraw { reason: "the picture has no pixels".into() });
    }
    if (original.width(), original.height()) != (width, height) {
        let message = format!("the flat picture is {width} px wide and {height} px high, and both must be of one size");
        return Err(ArtError::BadOption { name: "width of the original", value: original.width() as f64, message });
    }
    if line_widths.len() != flat.inks.len() {
        let message = format!("there are {} inks, and each needs the width of its line", flat.inks.len());
        return Err(ArtError::BadOption { name: "line widths", value: line_widths.len() as f64, message });
    }
    if let Some(w) = line_widths.iter().find(|w| !(**w > 0.0 && w.is_finite())) {
        return Err(ArtError::BadOption { name: "line width", value: *w, message: "a width is above 0 m".into() });
    }
    if let Some(v) = [sheet.width, sheet.height].into_iter().find(|v| !(*v > 0.0 && v.is_finite())) {
        return Err(ArtError::BadOption { name: "sheet", value: v, message: "its sides are above 0 m".into() });
    }
    if flat.labels.iter().all(|l| Some(usize::from(*l)) == flat.paper) {
        return Err(ArtError::NothingToDraw { reason: "the whole picture has the paper's colour".into() });
    }
    let (width, height) = working_size(width, height, MOST_PIXELS);
    let original =
        if original.width() == width { Cow::Borrowed(original) } else { Cow::Owned(original.resized(width, height)) };
    let flat = shrunk(flat, width, height);
    let semantics = semantics.resized(width, height).map_err(|e| ArtError::BadOption {
        name: "width of the semantics",
        value: semantics.width() as f64,
        message: e.to_string(),
    })?;
    let scale = (sheet.width / width as f64).min(sheet.height / height as f64);
    let lines: Vec<f64> = line_widths.iter().map(|w| w / scale).collect();
    let flat = calmed(flat, &lines);
    let mut painter = Painter::new(&flat, &original, &semantics, &lines, options, seed);
    let planned = in_order(painter.paint(), &flat.inks);
    if planned.is_empty() {
        let reason = "no stroke of these inks brings the paper nearer to the picture".to_string();
        return Err(ArtError::NothingToDraw { reason });
    }
    let drawing = drawing(&flat, &planned, sheet, scale, line_widths);
    let placed: Vec<Placed> = planned
        .iter()
        .map(|p| Placed { line: &p.line, width: lines[p.ink], ink: p.ink, outline: p.layer == 0 })
        .collect();
    let superpixels = painter.superpixels.as_ref();
    let mut plates = plates::maps(&original, &semantics, superpixels);
    plates.extend(plates::frames(&flat, paper_color(&flat), &placed, options.frames));
    let mut notes = semantics.notes.clone();
    notes.push(summary(&semantics, &planned, &drawing));
    Ok(Artwork { drawing, plates, notes })
}

/// The size at which a picture is worked on: its own, or one of about so many pixels.
pub(super) fn working_size(width: usize, height: usize, most: usize) -> (usize, usize) {
    let pixels = width as f64 * height as f64;
    if pixels <= most as f64 {
        return (width, height);
    }
    let shrink = (most as f64 / pixels).sqrt();
    let side = |n: usize| ((n as f64 * shrink).round() as usize).max(1);
    (side(width), side(height))
}

/// The flat picture at a smaller size: each pixel is the commonest of those that it stands for.
fn shrunk(flat: &Flat, width: usize, height: usize) -> Flat {
    if (width, height) == (flat.width(), flat.height()) {
        return flat.clone();
    }
    let span = |i: usize, from: usize, to: usize| i * from / to..((i + 1) * from / to).max(i * from / to + 1).min(from);
    let mut labels = Vec::with_capacity(width * height);
    for row in 0..height {
        for column in 0..width {
            let mut votes = [0u32; 256];
            for y in span(row, flat.height(), height) {
                let line = &flat.labels[y * flat.width()..][..flat.width()];
                line[span(column, flat.width(), width)].iter().for_each(|l| votes[usize::from(*l)] += 1);
            }
            let commonest = (0..=255u8).max_by_key(|l| (votes[usize::from(*l)], u8::MAX - l));
            labels.push(commonest.unwrap_or(0));
        }
    }
    Flat::new(width, height, flat.inks.clone(), flat.paper, labels).unwrap_or_else(|| flat.clone())
}

/// The flat picture without specks that no pen could draw; as it is where nothing would be left.
fn calmed(flat: Flat, lines: &[f64]) -> Flat {
    let line = lines.iter().copied().fold(0.0, f64::max);
    let radius = (0.5 * line).round().clamp(1.0, 3.0) as usize;
    let once = majority(&flat.labels, flat.width(), radius);
    let labels = majority(&once, flat.width(), radius);
    if labels.iter().all(|l| Some(usize::from(*l)) == flat.paper) {
        return flat;
    }
    Flat::new(flat.width(), flat.height(), flat.inks.clone(), flat.paper, labels).unwrap_or(flat)
}

/// The colour of the bare paper in a flat picture.
pub(super) fn paper_color(flat: &Flat) -> Rgb {
    flat.paper.and_then(|p| flat.inks.get(p)).map_or(PAPER, |i| i.color)
}

fn summary(semantics: &Semantics, planned: &[Planned], drawing: &Drawing) -> String {
    let order = semantics.drawing_order();
    let things = order.iter().filter(|i| matches!(semantics.segments()[**i].kind, Kind::Thing { .. })).count();
    let outlines = planned.iter().filter(|p| p.layer == 0).count();
    format!(
        "{} strokes ({outlines} of outlines) in {} segments, {things} of them things, with {} changes of ink",
        planned.len(),
        order.len(),
        drawing.ink_changes()
    )
}

/// The strokes on the sheet, one layer for each ink that draws, in the order planned.
fn drawing(flat: &Flat, planned: &[Planned], sheet: Sheet, scale: f64, line_widths: &[f64]) -> Drawing {
    let (w, h) = (flat.width() as f64, flat.height() as f64);
    let place = |p: &Point2<f64>| Point2::new((p.x - 0.5 * w) * scale, (0.5 * h - p.y) * scale);
    let mut layers: Vec<InkLayer> = Vec::new();
    let mut slot: Vec<Option<usize>> = vec![None; flat.inks.len()];
    for (i, ink) in flat.inks.iter().enumerate() {
        if planned.iter().any(|p| p.ink == i) {
            slot[i] = Some(layers.len());
            let (name, color) = (ink.name.clone(), ink.color);
            layers.push(InkLayer { name, color, width_hint: Some(line_widths[i]), strokes: Vec::new() });
        }
    }
    let mut order = Vec::with_capacity(planned.len());
    for p in planned {
        if let Some(layer) = slot[p.ink] {
            let strokes = &mut layers[layer].strokes;
            order.push(StrokeRef { layer, stroke: strokes.len() });
            strokes.push(Stroke::new(p.line.iter().map(place).collect()));
        }
    }
    Drawing { order, ..Drawing::new(sheet.width, sheet.height, layers) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::art::depth::Segment;
    use crate::art::depth::canvas::Canvas;
    use crate::picture::{Ink, Plane};

    const WIDTH: usize = 120;
    const HEIGHT: usize = 90;
    const SHEET: Sheet = Sheet { width: 0.2, height: 0.15 };

    fn inks() -> Vec<Ink> {
        let ink = |name: &str, color| Ink { name: name.into(), color: Rgb(color) };
        vec![
            ink("paper", [253, 252, 248]),
            ink("red", [190, 40, 40]),
            ink("green", [60, 130, 70]),
            ink("black", [20; 3]),
        ]
    }

    /// A red ball with a black spot on a meadow; the sky is paper.
    fn scene() -> (Flat, Picture, Semantics) {
        let label = |x: usize, y: usize| {
            let from = |cx: f64, cy: f64| (x as f64 + 0.5 - cx).hypot(y as f64 + 0.5 - cy);
            match () {
                () if from(55.0, 42.0) < 7.0 => 3,
                () if from(60.0, 45.0) < 28.0 => 1,
                () if y > 50 => 2,
                () => 0,
            }
        };
        let labels: Vec<u8> = (0..WIDTH * HEIGHT).map(|i| label(i % WIDTH, i / WIDTH)).collect();
        let segments: Vec<u16> = labels.iter().map(|l| [2, 0, 1, 0][usize::from(*l)]).collect();
        let depth = Plane::from_fn(WIDTH, HEIGHT, |x, y| {
            let r = (x as f32 + 0.5 - 60.0).hypot(y as f32 + 0.5 - 45.0) / 28.0;
            if r < 1.0 { 1.0 - 0.5 * r } else { 0.4 * y as f32 / HEIGHT as f32 }
        });
        let name = |name: &str, kind| Segment { name: name.into(), kind };
        let segments_named = vec![
            name("ball", Kind::Thing { confidence: 0.9 }),
            name("meadow", Kind::Stuff { order: 1 }),
            name("sky", Kind::Stuff { order: 0 }),
        ];
        let flat = Flat::new(WIDTH, HEIGHT, inks(), Some(0), labels).unwrap();
        let picture = flat.picture();
        (flat, picture, Semantics::new(segments_named, segments, depth).unwrap())
    }

    fn options(strokes: usize) -> LayeredOptions {
        LayeredOptions { strokes, frames: 3, ..LayeredOptions::default() }
    }

    fn planned(options: &LayeredOptions) -> Vec<Planned> {
        let (flat, picture, semantics) = scene();
        in_order(Painter::new(&flat, &picture, &semantics, &[0.6; 4], options, 1).paint(), &flat.inks)
    }

    #[test]
    fn things_come_before_stuff_outlines_before_layers_and_back_before_front() {
        let found = planned(&options(300));
        let keys: Vec<_> = found.iter().map(|p| (p.rank, p.layer, p.pass)).collect();
        assert!(keys.is_sorted());
        // the ball is first, has an outline, and then all its layers
        for layer in 0..=5 {
            assert!(found.iter().any(|p| (p.rank, p.layer) == (0, layer)), "layer {layer}");
        }
        let out = |p: &Planned| {
            let d: f64 = p.line.iter().map(|q| (q - Point2::new(60.0, 45.0)).norm()).sum();
            d / p.line.len() as f64
        };
        let mean = |layer: usize| {
            let all: Vec<f64> = found.iter().filter(|p| (p.rank, p.layer) == (0, layer)).map(out).collect();
            all.iter().sum::<f64>() / all.len() as f64
        };
        // the plane moves from the ball's rim, which is its back, to its middle
        assert!((26.0..29.0).contains(&mean(0)), "{}", mean(0));
        assert!(mean(1) > mean(3) && mean(3) > mean(5));
        assert!(found.iter().any(|p| p.rank > 0));
    }

    #[test]
    fn strokes_bring_the_paper_nearer_to_the_picture() {
        let (flat, picture, semantics) = scene();
        let lines = [0.6; 4];
        let mut canvas = Canvas::new(&flat.picture(), Rgb([253, 252, 248]), &flat.inks);
        let total = |c: &Canvas| c.difference().iter().map(|d| f64::from(*d)).sum::<f64>();
        let before = total(&canvas);
        let options = options(400);
        let planned = Painter::new(&flat, &picture, &semantics, &lines, &options, 1).paint();
        for p in &planned {
            let gain = canvas.gain(&p.line, lines[p.ink], p.ink, 1.0);
            assert!(gain > 0.0);
            canvas.draw(&p.line, lines[p.ink], p.ink);
        }
        assert!(total(&canvas) < 0.25 * before, "{} of {before}", total(&canvas));
    }

    #[test]
    fn the_budget_is_kept_and_every_stroke_is_drawn_once() {
        let (flat, picture, semantics) = scene();
        for strokes in [1, 10, 200] {
            let art = layered_depth(&flat, &picture, &semantics, SHEET, &[0.0008; 4], &options(strokes), 1).unwrap();
            let count = art.drawing.stroke_count();
            assert!((1..=strokes).contains(&count), "{count} of {strokes}");
            let mut order = art.drawing.order.clone();
            assert_eq!(order.len(), count);
            order.sort();
            order.dedup();
            assert_eq!(order.len(), count);
            let inside = |p: &Point2<f64>| p.x.abs() <= 0.5 * SHEET.width && p.y.abs() <= 0.5 * SHEET.height;
            assert!(art.drawing.layers.iter().flat_map(|l| &l.strokes).all(|s| s.points.iter().all(inside)));
            let names: Vec<&str> = art.plates.iter().map(|p| p.name.as_str()).collect();
            assert_eq!(names, ["segments", "depth", "superpixels", "frame-01", "frame-02", "frame-03"]);
        }
    }

    #[test]
    fn any_thread_count_gives_the_same_strokes_and_another_seed_others() {
        let (flat, picture, semantics) = scene();
        let run = |threads, seed| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let options = options(200);
            pool.install(|| layered_depth(&flat, &picture, &semantics, SHEET, &[0.0008; 4], &options, seed))
                .unwrap()
                .drawing
        };
        assert_eq!(run(1, 7), run(3, 7));
        assert_ne!(run(1, 7), run(1, 8));
    }

    #[test]
    fn a_large_picture_is_worked_on_smaller() {
        assert_eq!(working_size(4000, 1000, 1_000_000), (2000, 500));
        assert_eq!(working_size(100_000, 1, 1000), (10_000, 1));
        assert_eq!(working_size(30, 20, 1000), (30, 20));
        let (flat, _, _) = scene();
        let small = shrunk(&flat, 40, 30);
        assert!((0..40 * 30).all(|i| {
            let block: Vec<u8> =
                (0..9).map(|k| flat.labels[(i / 40 * 3 + k / 3) * WIDTH + i % 40 * 3 + k % 3]).collect();
            block.iter().filter(|l| **l == small.labels[i]).count() >= 3
        }));
    }

    #[test]
    fn nothing_to_draw_and_senseless_options_are_said() {
        let (flat, picture, semantics) = scene();
        let white = Flat::new(WIDTH, HEIGHT, inks(), Some(0), vec![0; WIDTH * HEIGHT]).unwrap();
        let run = |flat: &Flat, widths: &[f64], options: &LayeredOptions| {
            layered_depth(flat, &picture, &semantics, SHEET, widths, options, 1).map(|_| ()).unwrap_err()
        };
        assert!(matches!(run(&white, &[1e-3; 4], &options(9)), ArtError::NothingToDraw { .. }));
        assert!(run(&flat, &[1e-3; 3], &options(9)).to_string().contains("there are 4 inks"));
        assert!(run(&flat, &[0.0; 4], &options(9)).to_string().starts_with("line width = 0"));
        assert!(run(&flat, &[1e-3; 4], &options(0)).to_string().starts_with("strokes = 0"));
        let bad = LayeredOptions { passes: vec![0.5, f64::NAN], ..options(9) };
        assert!(run(&flat, &[1e-3; 4], &bad).to_string().starts_with("passes = NaN"));
    }

    #[test]
    fn one_pixel_and_all_black_are_drawn() {
        for (width, height) in [(1, 1), (3, 2), (60, 40)] {
            let flat = Flat::new(width, height, inks(), Some(0), vec![3; width * height]).unwrap();
            let picture = flat.picture();
            let one = vec![Segment { name: "night".into(), kind: Kind::Stuff { order: 0 } }];
            let depth = Plane::filled(width, height, 0.0);
            let semantics = Semantics::new(one, vec![0; width * height], depth).unwrap();
            let sheet = Sheet { width: 0.06, height: 0.04 };
            let art = layered_depth(&flat, &picture, &semantics, sheet, &[0.001; 4], &options(100), 1).unwrap();
            assert!(art.drawing.stroke_count() > 0, "{width} x {height}");
        }
    }
}
