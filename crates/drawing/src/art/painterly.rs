//! Painterly strokes: curved brush strokes from big to small, each where it lowers the difference to the picture most.
//!
//! A. Hertzmann, *Painterly rendering with curved brush strokes of multiple sizes*, SIGGRAPH 1998
//! (doi:10.1145/280814.280951), for pens: strokes follow the image's flow with a brush of one of a few radii, and one is
//! painted only where it brings the canvas `C` nearer to the picture `I`, by equation 4.1 of the dissertation,
//! `min ||I - C_t||^2`. Unlike paint, ink is transparent: light passes through all inks that lie over each other, so what has
//! been darkened can't be lightened again. Each candidate is therefore scored by what its ink would really do to the canvas,
//! and under a budget the best of all candidates is painted, again and again (lazy greedy).
use nalgebra::Point2;
use rand::RngExt;
use rayon::prelude::*;

use crate::art::brush::{PenBrush, spline};
use crate::art::{ArtError, Artwork, Plate, Sheet};
use crate::drawing::{Drawing, InkLayer, Stroke, StrokeRef};
use crate::math::stream;
use crate::picture::{Flat, Picture, Plane};

mod canvas;
mod flow;
mod growth;
mod mask;
mod options;
mod selection;

use crate::art::wash::Wash;
use canvas::{Canvas, perceived, wash};
use flow::Flow;
use growth::{Candidate, Habits, Layer, Seed};
use mask::Mask;
pub use options::{PainterlyOptions, PainterlyStyle};
use selection::Selection;

/// Pixels to a line of the finest pen: less blurs what it can draw, more is work for nothing.
const PX_PER_LINE: f64 = 3.0;
/// Longest side of the working canvas, px.
const LONGEST: f64 = 1200.0;
/// Shares of the longest stroke, from this to 1, that strokes may have.
const SHORTEST: f32 = 0.4;
/// Pictures of progress.
const FRAMES: usize = 5;

/// Paints a picture in the inks of its flattened version, with pens whose lines are `line_widths` wide, m, one for each ink.
///
/// The drawing has one layer for each ink that is used, one stroke for each brush stroke, and its order is that of
/// painting. The picture lies in the middle of the sheet, as large as fits, and strokes end at its edge. Same arguments,
/// same strokes, at any number of threads.
///
/// # Errors
/// [`ArtError::BadOption`], and [`ArtError::NothingToDraw`] where no ink makes the paper more like the picture.
pub fn painterly(
    flat: &Flat,
    original: &Picture,
    sheet: Sheet,
    line_widths: &[f64],
    options: &PainterlyOptions,
    seed: u64,
) -> Result<Artwork, ArtError> {
    check(flat, original, sheet, line_widths, options)?;
    let painting = Painting::new(flat, original, sheet, line_widths, options, seed)?;
    let mut plates = vec![plate("flat", "The picture in the palette's inks", &painting.flat)];
    plates.extend(painting.frames());
    plates.push(plate("painted", "The strokes as the painter thinks they look", &painting.canvas.picture()));
    let drawing = painting.drawing(flat, sheet);
    let unused = painting.pens.iter().map(|i| &flat.inks[*i].name);
    let unused: Vec<_> = unused.filter(|name| drawing.layers.iter().all(|l| l.name != **name)).cloned().collect();
    let notes = match unused[..] {
        [] => Vec::new(),
        _ => vec![format!("No stroke is drawn in {}: other inks do better everywhere.", unused.join(", "))],
    };
    Ok(Artwork { drawing, plates: plates.into_iter().flatten().collect(), notes })
}

/// A painted picture.
struct Painting {
    /// Inks that are drawn, as indices into the palette, and the widths of their lines, m.
    pens: Vec<usize>,
    lines: Vec<f64>,
    brushes: Vec<PenBrush>,
    layers: Vec<Layer>,
    /// Size of a pixel of the canvas, m.
    px: [f64; 2],
    /// The picture in the palette's inks, of the canvas's size.
    flat: Picture,
    blank: Canvas,
    canvas: Canvas,
    strokes: Vec<Candidate>,
}

impl Painting {
    fn new(
        flat: &Flat,
        original: &Picture,
        sheet: Sheet,
        line_widths: &[f64],
        options: &PainterlyOptions,
        seed: u64,
    ) -> Result<Self, ArtError> {
        let nothing = |reason: &str| ArtError::NothingToDraw { reason: reason.into() };
        let pens: Vec<usize> = (0..flat.inks.len()).filter(|i| Some(*i) != flat.paper).collect();
        let lines: Vec<f64> = pens.iter().map(|i| line_widths[*i]).collect();
        let line =
            lines.iter().copied().reduce(f64::min).ok_or_else(|| nothing("the palette has no ink but the paper"))?;
        let (w, h) = (original.width() as f64, original.height() as f64);
        let shown = (sheet.width / w).min(sheet.height / h);
        let (wide, high) = (shown * w, shown * h);
        if lines.iter().any(|line| *line >= wide.min(high)) {
            return Err(nothing("the picture is so slender that it is narrower on the sheet than a pen's line"));
        }
        let px = (line / PX_PER_LINE).max(wide.max(high) / LONGEST);
        let size = [wide, high].map(|m| (m / px).round().max(1.0) as usize);
        let px = [wide / size[0] as f64, high / size[1] as f64];
        let mean_px = 0.5 * (px[0] + px[1]);

        let colors = pens.iter().map(|i| flat.inks[*i].color);
        let flat = flat.picture().resized(size[0], size[1]);
        let target = desired(&flat, original, options.flatness, (0.25 * line / mean_px) as f32);
        let brushes = brushes(options, [wide, high], line);
        let layers = layers(&target, &brushes, &lines, mean_px, options);
        let washes = colors.map(|color| bundled(wash(color), options.coverage)).collect();
        let blank = Canvas::new(&target, washes, options.regret as f32);
        let habits = Habits {
            curvature: options.curvature,
            threshold: options.threshold * options.threshold,
            extra: std::f64::consts::PI * layers[0].radius * layers[0].radius,
        };
        let mut canvas = blank.clone();
        let seeds = seeds(&layers, size, options.jitter, seed);
        let selection = Selection::new(&canvas, &layers, habits, pens.len(), seeds);
        let strokes = selection.paint(&mut canvas, options.strokes, options.patience);
        if strokes.is_empty() {
            return Err(nothing("no ink of the palette makes the paper more like the picture"));
        }
        Ok(Self { pens, lines, brushes, layers, px, flat, blank, canvas, strokes })
    }

    /// What the pens draw.
    fn drawing(&self, flat: &Flat, sheet: Sheet) -> Drawing {
        let (wide, high) = (self.px[0] * self.canvas.width as f64, self.px[1] * self.canvas.height as f64);
        let on_sheet = |p: &Point2<f64>| Point2::new(p.x * self.px[0] - 0.5 * wide, 0.5 * high - p.y * self.px[1]);
        let drawn = |stroke: &Candidate| {
            let brush = PenBrush { line: self.lines[stroke.ink], ..self.brushes[stroke.layer] };
            let controls: Vec<_> = stroke.controls.iter().map(on_sheet).collect();
            let room = [0.5 * (wide - brush.line), 0.5 * (high - brush.line)];
            Stroke::new(brush.pen_line(&spline(&controls, 0.5 * brush.line), room))
        };
        let drawn: Vec<Stroke> = self.strokes.par_iter().map(drawn).collect();

        let mut layers: Vec<InkLayer> = Vec::new();
        let mut layer_of = vec![None; self.pens.len()];
        for pen in (0..self.pens.len()).filter(|pen| self.strokes.iter().any(|s| s.ink == *pen)) {
            layer_of[pen] = Some(layers.len());
            let ink = &flat.inks[self.pens[pen]];
            let (name, width_hint) = (ink.name.clone(), Some(self.lines[pen]));
            layers.push(InkLayer { name, color: ink.color, width_hint, strokes: Vec::new() });
        }
        let mut order = Vec::with_capacity(self.strokes.len());
        for (candidate, stroke) in self.strokes.iter().zip(drawn) {
            let Some(layer) = layer_of[candidate.ink] else { continue };
            order.push(StrokeRef { layer, stroke: layers[layer].strokes.len() });
            layers[layer].strokes.push(stroke);
        }
        Drawing { width: sheet.width, height: sheet.height, layers, order }
    }

    /// The canvas after some of the strokes.
    fn frames(&self) -> Vec<Option<Plate>> {
        let mut canvas = self.blank.clone();
        let mut mask = Mask::new(canvas.width, canvas.height);
        let mut frames = Vec::new();
        let n = self.strokes.len();
        for (i, stroke) in self.strokes.iter().enumerate() {
            stroke.sweep(&self.layers, &mut mask);
            canvas.paint(mask.pixels(), stroke.ink);
            // Much happens early: frame k of n shows (k/n)^2 of the strokes.
            let k = frames.len() + 1;
            if k <= FRAMES && (i + 1) * (FRAMES + 1).pow(2) >= n * k * k {
                let share = 100.0 * canvas.difference() / self.blank.difference();
                let caption = format!("After {} of {n} strokes: {share:.0} % of the squared difference is left", i + 1);
                frames.push(plate(&format!("frame-{k}"), &caption, &canvas.picture()));
            }
        }
        frames
    }
}

/// Refuses what can't be painted.
fn check(
    flat: &Flat,
    original: &Picture,
    sheet: Sheet,
    line_widths: &[f64],
    options: &PainterlyOptions,
) -> Result<(), ArtError> {
    let bad = |name, value, message: &str| Err(ArtError::BadOption { name, value, message: message.into() });
    if let Some(error) = options.invalid() {
        return Err(error);
    }
    if original.pixels.is_empty() || flat.labels.is_empty() {
        return Err(ArtError::NothingToDraw { reason: "the picture has no pixels".into() });
    }
    let length = |v: f64| v > 0.0 && v.is_finite();
    if !length(sheet.width) || !length(sheet.height) {
        return bad("sheet", sheet.width.min(sheet.height), "should have sides above 0");
    }
    if line_widths.len() != flat.inks.len() {
        return bad("line_widths", line_widths.len() as f64, "should be one width for each ink of the palette");
    }
    let Some(line) = line_widths.iter().find(|w| !length(**w) || **w > 0.5 * sheet.width.min(sheet.height)) else {
        return Ok(());
    };
    bad("line_widths", *line, "should be a length above 0, at most half of the sheet's shorter side")
}

/// The picture to be painted: of the flat one's size, between that and the original, blurred a little, as finer than a line
/// can't be drawn.
fn desired(flat: &Picture, original: &Picture, flatness: f64, sigma: f32) -> Picture {
    let mut desired = original.resized(flat.width(), flat.height());
    for (o, p) in desired.pixels.iter_mut().zip(&flat.pixels) {
        *o = std::array::from_fn(|k| o[k] + flatness as f32 * (p[k] - o[k]));
    }
    desired.blurred(sigma)
}

/// The brushes, largest first, without those that a pen of this line can't tell apart.
fn brushes(options: &PainterlyOptions, [wide, high]: [f64; 2], line: f64) -> Vec<PenBrush> {
    let mut radii = options.radii.clone();
    if radii.is_empty() {
        // A stroke covers a disc and a band; about half as many as there may be cover all, and half are left for detail.
        let radii2 = 2.5 + 0.33 * options.max_length;
        let mut radius = (wide * high / (options.strokes as f64 * radii2)).sqrt().max(1.5 * line);
        while radius > 1.2 * line {
            radii.push(radius);
            radius *= 0.5;
        }
        radii.push(0.5 * line);
    }
    radii.iter_mut().for_each(|r| *r = r.clamp(0.5 * line, 0.5 * wide.min(high)));
    radii.sort_by(|a, b| b.total_cmp(a));
    radii.dedup();
    let brush = |radius| PenBrush { radius, line, coverage: options.coverage, fill: options.fill };
    radii.into_iter().map(brush).collect()
}

/// What each brush needs to know to grow strokes on the working canvas.
fn layers(target: &Picture, brushes: &[PenBrush], lines: &[f64], px: f64, options: &PainterlyOptions) -> Vec<Layer> {
    let lightness = target.pixels.iter().map(|p| perceived(*p)[0]).collect();
    let lightness = Plane::from_values(target.width(), target.height(), lightness).unwrap_or_default();
    let layer = |brush: &PenBrush| {
        let radius = brush.radius / px;
        let step = (0.5 * radius).max(2.0);
        let steps = |length: f64| (length / step).round() as usize;
        let largest = brushes[0].radius / px;
        Layer {
            radius,
            drawn: lines.iter().map(|line| PenBrush { line: *line, ..*brush }.drawn_radius() / px).collect(),
            grid: (options.grid * radius).max(4.0),
            step,
            steps: [steps(options.min_length * radius), steps(options.max_length * (radius * largest).sqrt())],
            flow: Flow::new(&lightness.blurred((options.blur * radius) as f32), radius as f32),
        }
    };
    brushes.iter().map(layer).collect()
}

/// What lines of an ink that cover this share of an area let through, on average. Above 1, the lines overlap in places.
fn bundled(wash: Wash, coverage: f64) -> Wash {
    let c = coverage as f32;
    wash.map(|t| if c < 1.0 { 1.0 - c * (1.0 - t) } else { t * (1.0 - (c - 1.0) * (1.0 - t)).max(t) })
}

/// The cells of all layers' grids.
fn seeds(layers: &[Layer], size: [usize; 2], jitter: f64, seed: u64) -> Vec<Seed> {
    let mut random = stream(seed, "painterly", 0);
    let mut seeds = Vec::new();
    for (i, layer) in layers.iter().enumerate() {
        let cells = size.map(|n| (n as f64 / layer.grid).ceil() as usize);
        for (row, column) in (0..cells[1]).flat_map(|row| (0..cells[0]).map(move |column| (row, column))) {
            // The sum of four even numbers is nearly normal; its deviation is sqrt(1/3).
            let sum: f64 = (0..4).map(|_| random.random_range(-0.5..0.5)).sum();
            let turn = (jitter * sum * 3f64.sqrt()) as f32;
            let length = random.random_range(SHORTEST..=1.0);
            let corner = [column, row].map(|n| (n as f64 * layer.grid) as u32);
            seeds.push(Seed { layer: i as u16, corner, turn, length });
        }
    }
    seeds
}

/// A plate; `None` of a picture without pixels.
fn plate(name: &str, caption: &str, picture: &Picture) -> Option<Plate> {
    let image = picture.to_image().ok()?;
    Some(Plate { name: name.into(), caption: caption.into(), image })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{PAPER, Rgb};
    use crate::picture::{Ink, linear_from_rgb};
    use rayon::ThreadPoolBuilder;

    const SHEET: Sheet = Sheet { width: 0.12, height: 0.09 };
    const LINE: f64 = 8e-4;

    fn palette(colors: &[[u8; 3]]) -> Vec<Ink> {
        colors.iter().enumerate().map(|(i, c)| Ink { name: format!("ink {i}"), color: Rgb(*c) }).collect()
    }

    /// Discs and a stripe of three inks on paper.
    fn still_life(width: usize, height: usize) -> (Flat, Picture) {
        let inks = palette(&[PAPER.0, [30, 60, 140], [220, 160, 40], [40, 30, 30]]);
        let label = |i: usize| {
            let (x, y) = ((i % width) as f64 / width as f64, (i / width) as f64 / height as f64);
            let disc = |u: f64, v: f64, r: f64| (x - u).hypot(y - v) < r;
            match () {
                () if disc(0.3, 0.4, 0.2) => 1,
                () if disc(0.7, 0.6, 0.25) => 2,
                () if (0.8..0.9).contains(&(y + 0.2 * x)) => 3,
                () => 0,
            }
        };
        let flat = Flat::new(width, height, inks, Some(0), (0..width * height).map(label).collect()).unwrap();
        let picture = flat.picture();
        (flat, picture)
    }

    fn plain(color: [u8; 3], width: usize, height: usize) -> (Flat, Picture) {
        let flat =
            Flat::new(width, height, palette(&[PAPER.0, [20, 20, 20]]), Some(0), vec![0; width * height]).unwrap();
        let pixels = vec![linear_from_rgb(Rgb(color)); width * height];
        (flat, Picture::from_pixels(width, height, pixels).unwrap())
    }

    #[test]
    fn no_stroke_raises_the_difference_and_the_budget_holds() {
        let (flat, picture) = still_life(160, 120);
        let options = PainterlyOptions { strokes: 120, ..PainterlyOptions::default() };
        let painting = Painting::new(&flat, &picture, SHEET, &[LINE; 4], &options, 1).unwrap();
        assert!((60..=120).contains(&painting.strokes.len()), "{} strokes", painting.strokes.len());
        let mut canvas = painting.blank.clone();
        let mut mask = Mask::new(canvas.width, canvas.height);
        let mut difference = canvas.difference();
        for stroke in &painting.strokes {
            stroke.sweep(&painting.layers, &mut mask);
            canvas.paint(mask.pixels(), stroke.ink);
            let now = canvas.difference();
            assert!(now < difference, "{now} after {difference}");
            difference = now;
        }
        assert_eq!(difference, painting.canvas.difference());
        assert!(difference < 0.25 * painting.blank.difference(), "{difference} of {}", painting.blank.difference());
    }

    #[test]
    fn strokes_have_an_ink_a_turn_and_a_place_on_the_picture() {
        let (flat, picture) = still_life(160, 160);
        for style in [
            PainterlyStyle::Impressionist,
            PainterlyStyle::Expressionist,
            PainterlyStyle::ColouristWash,
            PainterlyStyle::Pointillist,
        ] {
            let options = PainterlyOptions { strokes: 60, ..PainterlyOptions::style(style) };
            let widths = [LINE, LINE, 2.0 * LINE, LINE];
            let art = painterly(&flat, &picture, SHEET, &widths, &options, 1).unwrap();
            let drawing = &art.drawing;
            let mut order = drawing.order.clone();
            order.sort();
            let all = Drawing { order: Vec::new(), ..drawing.clone() }.sequence();
            assert!(order == all && !all.is_empty() && all.len() <= 60, "{style:?}: {} strokes", all.len());
            for layer in &drawing.layers {
                let ink = flat.inks.iter().position(|i| i.name == layer.name && i.color == layer.color).unwrap();
                assert!(ink != 0 && layer.width_hint == Some(widths[ink]) && !layer.strokes.is_empty());
                // A square picture in the middle of a wide sheet, and the ink within its edge
                let room = 0.5 * (SHEET.height - widths[ink]) + 1e-9;
                for stroke in &layer.strokes {
                    assert!(!stroke.points.is_empty());
                    assert!(stroke.points.iter().all(|p| p.x.abs() <= room && p.y.abs() <= room), "{style:?}");
                }
            }
            let names: Vec<_> = art.plates.iter().map(|p| p.name.as_str()).collect();
            assert_eq!(names, ["flat", "frame-1", "frame-2", "frame-3", "frame-4", "frame-5", "painted"]);
        }
    }

    #[test]
    fn the_number_of_threads_changes_nothing_and_the_seed_does() {
        let (flat, picture) = still_life(120, 90);
        let options = PainterlyOptions { strokes: 80, jitter: 0.2, ..PainterlyOptions::default() };
        let drawn = |threads: usize, seed: u64| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| painterly(&flat, &picture, SHEET, &[LINE; 4], &options, seed)).unwrap().drawing
        };
        let one = drawn(1, 5);
        assert_eq!(one, drawn(2, 5));
        assert_eq!(one, drawn(3, 5));
        assert_ne!(one, drawn(2, 6));
    }

    #[test]
    fn white_pictures_are_refused_and_black_ones_filled() {
        let options = PainterlyOptions { strokes: 300, ..PainterlyOptions::default() };
        for (width, height) in [(1, 1), (40, 30)] {
            let (flat, picture) = plain([255; 3], width, height);
            let refused = painterly(&flat, &picture, SHEET, &[LINE; 2], &options, 1);
            assert!(matches!(refused, Err(ArtError::NothingToDraw { .. })));
            let (flat, picture) = plain([0; 3], width, height);
            let options = PainterlyOptions { flatness: 0.0, ..options.clone() };
            let painting = Painting::new(&flat, &picture, SHEET, &[LINE; 2], &options, 1).unwrap();
            assert!(painting.canvas.difference() < 0.1 * painting.blank.difference());
        }
        let (flat, picture) = plain([0; 3], 1, 5000);
        assert!(matches!(
            painterly(&flat, &picture, SHEET, &[LINE; 2], &options, 1),
            Err(ArtError::NothingToDraw { .. })
        ));
    }

    #[test]
    fn patience_saves_pen_changes() {
        let (flat, picture) = still_life(120, 90);
        let changes = |patience: f64| {
            let options = PainterlyOptions { strokes: 100, patience, ..PainterlyOptions::default() };
            painterly(&flat, &picture, SHEET, &[LINE; 4], &options, 1).unwrap().drawing.ink_changes()
        };
        let (eager, patient) = (changes(1.0), changes(0.3));
        assert!(2 * patient < eager, "{patient} changes, {eager} without patience");
    }

    #[test]
    fn options_that_make_no_sense_are_named() {
        let (flat, picture) = still_life(20, 20);
        let refused =
            |options: &PainterlyOptions, widths: &[f64]| match painterly(&flat, &picture, SHEET, widths, options, 1)
                .unwrap_err()
            {
                ArtError::BadOption { name, .. } => name,
                other => panic!("{other}"),
            };
        let base = PainterlyOptions::default;
        assert_eq!(refused(&PainterlyOptions { coverage: 0.0, ..base() }, &[LINE; 4]), "coverage");
        assert_eq!(refused(&PainterlyOptions { threshold: f64::NAN, ..base() }, &[LINE; 4]), "threshold");
        assert_eq!(refused(&PainterlyOptions { min_length: 20.0, ..base() }, &[LINE; 4]), "max_length");
        assert_eq!(refused(&PainterlyOptions { radii: vec![1e-3, -1.0], ..base() }, &[LINE; 4]), "radii");
        assert_eq!(refused(&base(), &[LINE; 3]), "line_widths");
        assert_eq!(refused(&base(), &[LINE, LINE, 0.0, LINE]), "line_widths");
    }
}
