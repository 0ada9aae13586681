//! Painterly strokes: curved brush strokes from big to small, each where it lowers the difference to the picture most.
//!
//! A. Hertzmann, *Painterly rendering with curved brush strokes of multiple sizes*, SIGGRAPH 1998
//! (doi:10.1145/280814.280951), for pens: strokes follow the image's flow with a brush of one of a few radii, and one is
//! painted only where it brings the canvas `C` nearer to the picture `I`, by equation 4.1 of the dissertation,
//! `min ||I - C_t||^2`. Unlike paint, ink is transparent: light passes through all inks that lie over each other, so what has
//! been darkened can't be lightened again. Each candidate is therefore scored by what its ink would really do to the canvas,
//! and under a budget the best of all candidates is painted, again and again (lazy greedy).
use nalgebra::Point2;
use rand_chacha::rand_core::Rng;
use rayon::prelude::*;

use crate::art::brush::{BrushFill, PenBrush, spline};
use crate::art::{ArtError, Artwork, Plate, Sheet};
use crate::drawing::{Drawing, InkLayer, Stroke, StrokeRef};
use crate::math::stream;
use crate::picture::{Flat, Picture, Plane};

mod canvas;
mod flow;
mod growth;
mod mask;
mod selection;

use canvas::{Canvas, Wash, perceived, wash};
use flow::{Flow, blur};
use growth::{Candidate, Habits, Layer, Seed};
use mask::Mask;
use selection::Selection;

/// The styles of Hertzmann 1998, section 3.1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PainterlyStyle {
    /// Curved strokes that follow the forms; the default.
    #[default]
    Impressionist,
    /// Long strokes that keep their direction, with paper showing through.
    Expressionist,
    /// Loose strokes of half coverage.
    ColouristWash,
    /// Dots.
    Pointillist,
}

/// How a picture is painted. Lengths on the sheet, m.
#[derive(Clone, Debug, PartialEq)]
pub struct PainterlyOptions {
    /// R_i: brush radii, largest first; empty: a fiftieth of the sheet's shorter side, halved down to the pen.
    pub radii: Vec<f64>,
    /// T: a stroke is painted where it brings the canvas nearer to the picture by at least this much on average, in Oklab
    /// (0 to about 1; the square root of the mean fall of the squared difference).
    pub threshold: f64,
    /// f_sigma: the flow of a brush is that of the picture blurred by this many radii.
    pub blur: f64,
    /// f_g: distance between seeds, in radii.
    pub grid: f64,
    /// Shortest stroke, in radii.
    pub min_length: f64,
    /// Longest stroke, in radii.
    pub max_length: f64,
    /// f_c: 1 follows the picture's flow, less keeps to the stroke's own direction, 0 draws straight lines.
    pub curvature: f64,
    /// How far strokes turn from the flow, at random: standard deviation, rad.
    pub jitter: f64,
    /// Share of a brush stroke's area that its lines cover: above 1 they overlap, below 1 paper shows between them.
    pub coverage: f64,
    /// How wide brush strokes are filled.
    pub fill: BrushFill,
    /// How much it counts against a stroke that another ink, or none, would do better under parts of it. At 0 the fall of
    /// the difference alone counts, and broad strokes run over details.
    pub regret: f64,
    /// 0 paints the picture, 1 its flattened version.
    pub flatness: f64,
    /// Most strokes.
    pub strokes: usize,
    /// Keep the pen in hand while its best stroke is worth at least this share of the best of all, 0..=1. At 1 the best
    /// stroke is always next, and pens change most.
    pub patience: f64,
}

impl Default for PainterlyOptions {
    fn default() -> Self {
        Self {
            radii: Vec::new(),
            threshold: 0.025,
            blur: 0.5,
            grid: 1.0,
            min_length: 4.0,
            max_length: 16.0,
            curvature: 1.0,
            jitter: 0.0,
            coverage: 1.0 / 0.9,
            fill: BrushFill::Bundle,
            regret: 4.0,
            flatness: 0.5,
            strokes: 1500,
            patience: 0.9,
        }
    }
}

impl PainterlyOptions {
    /// The options of a style.
    pub fn style(style: PainterlyStyle) -> Self {
        let base = Self::default();
        match style {
            PainterlyStyle::Impressionist => base,
            PainterlyStyle::Expressionist => {
                Self { threshold: 0.03, curvature: 0.25, min_length: 10.0, coverage: 0.7, jitter: 0.15, ..base }
            }
            PainterlyStyle::ColouristWash => Self { threshold: 0.06, coverage: 0.5, ..base },
            PainterlyStyle::Pointillist => Self { grid: 0.5, min_length: 0.0, max_length: 0.0, ..base },
        }
    }

    /// The first option that makes no sense.
    fn invalid(&self) -> Option<ArtError> {
        let within = [
            ("threshold", self.threshold, 0.0, 1.0),
            ("blur", self.blur, 0.0, 20.0),
            ("grid", self.grid, 0.1, 20.0),
            ("min_length", self.min_length, 0.0, 1000.0),
            ("max_length", self.max_length, self.min_length, 1000.0),
            ("curvature", self.curvature, 0.0, 1.0),
            ("jitter", self.jitter, 0.0, 3.2),
            ("coverage", self.coverage, 0.05, 4.0),
            ("regret", self.regret, 0.0, 100.0),
            ("flatness", self.flatness, 0.0, 1.0),
            ("patience", self.patience, 0.0, 1.0),
            ("strokes", self.strokes as f64, 1.0, 1e6),
        ];
        let bad = within.into_iter().find(|(_, value, low, high)| !(low..=high).contains(&value));
        let bad = bad.map(|(name, value, low, high)| (name, value, format!("should be from {low} to {high}")));
        let radius = self.radii.iter().find(|r| !(**r > 0.0 && r.is_finite()));
        bad.or(radius.map(|r| ("radii", *r, "should be a length above 0".to_string())))
            .map(|(name, value, message)| ArtError::BadOption { name, value, message })
    }
}

/// Pixels to a line of the finest pen: less blurs what it can draw, more is work for nothing.
const PX_PER_LINE: f64 = 3.0;
/// Longest side of the working canvas, px.
const LONGEST: f64 = 1200.0;
/// Pictures of progress.
const FRAMES: usize = 5;

/// Paints a picture in the inks of its flattened version, with pens whose lines are `line_widths` wide, m, one for each ink.
///
/// The drawing has one layer for each ink that is used, one stroke for each brush stroke, and its order is that of
/// painting. The picture lies in the middle of the sheet, as large as fits. Same arguments, same strokes, at any number of
/// threads.
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
    let pens: Vec<usize> = (0..flat.inks.len()).filter(|i| Some(*i) != flat.paper).collect();
    let Some(line) = pens.iter().map(|i| line_widths[*i]).reduce(f64::min) else {
        return Err(ArtError::NothingToDraw { reason: "the palette holds no ink but the paper".into() });
    };
    let (w, h) = (original.width() as f64, original.height() as f64);
    let shown = (sheet.width / w).min(sheet.height / h);
    let (wide, high) = (shown * w, shown * h);
    let px = (line / PX_PER_LINE).max(wide.max(high) / LONGEST);
    let size = [(wide / px).round().max(1.0) as usize, (high / px).round().max(1.0) as usize];
    let scale = [wide / size[0] as f64, high / size[1] as f64];
    let px = 0.5 * (scale[0] + scale[1]);

    let target = wished(flat, original, size, options.flatness, 0.25 * line / px);
    let brushes = brushes(options, wide * high, wide.min(high), line);
    let lines: Vec<f64> = pens.iter().map(|i| line_widths[*i]).collect();
    let layers = layers(&target, &brushes, &lines, px, options);
    let coverage = options.coverage;
    let washes: Vec<Wash> = pens.iter().map(|i| bundled(wash(flat.inks[*i].color), coverage)).collect();
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
        return Err(ArtError::NothingToDraw { reason: "no ink makes the paper more like the picture".into() });
    }

    let on_sheet =
        |p: Point2<f64>| Point2::new((p.x - 0.5 * size[0] as f64) * scale[0], (0.5 * size[1] as f64 - p.y) * scale[1]);
    let drawn: Vec<Stroke> = strokes
        .par_iter()
        .map(|s| {
            let brush = PenBrush { line: lines[s.ink], ..brushes[s.layer] };
            let controls: Vec<_> = s.controls.iter().map(|p| on_sheet(*p)).collect();
            let room = [0.5 * (wide - brush.line), 0.5 * (high - brush.line)];
            Stroke::new(brush.pen_line(&spline(&controls, 0.5 * brush.line), room))
        })
        .collect();
    let drawing = drawing(flat, &pens, &lines, sheet, &strokes, drawn);
    let mut plates = vec![plate("flat", "The picture in the palette's inks", &flat.picture())];
    plates.extend(frames(blank, &layers, &strokes));
    plates.push(plate("painted", "The strokes as the painter thinks they look", &canvas.picture()));
    Ok(Artwork { drawing, plates: plates.into_iter().flatten().collect(), notes: Vec::new() })
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

/// The picture to be painted: of this size, between the original and its flat version, blurred a little, as finer than a
/// line can't be drawn.
fn wished(flat: &Flat, original: &Picture, size: [usize; 2], flatness: f64, sigma: f64) -> Picture {
    let planes = |picture: &Picture| {
        let channel = |k: usize| {
            let values = picture.pixels.iter().map(|p| p[k]).collect();
            let plane = Plane::from_values(picture.width(), picture.height(), values).unwrap_or_default();
            blur(&resized(&plane, size), sigma)
        };
        [channel(0), channel(1), channel(2)]
    };
    let (original, flat) = (planes(original), planes(&flat.picture()));
    let f = flatness as f32;
    let mixed = |i: usize| std::array::from_fn(|k| (1.0 - f) * original[k].values[i] + f * flat[k].values[i]);
    let pixels = (0..size[0] * size[1]).map(mixed).collect();
    Picture::from_pixels(size[0], size[1], pixels).unwrap_or_default()
}

/// A plane on another grid: the mean of what a pixel covers, or between pixel centres where that is less than one.
fn resized(plane: &Plane, [width, height]: [usize; 2]) -> Plane {
    let (sx, sy) = (plane.width() as f64 / width as f64, plane.height() as f64 / height as f64);
    // Samples no farther apart than the pixels of the plane
    let (nx, ny) = (sx.ceil().max(1.0), sy.ceil().max(1.0));
    let value = |x: usize, y: usize| {
        let mut sum = 0.0;
        for j in 0..ny as usize {
            for i in 0..nx as usize {
                let (u, v) = ((i as f64 + 0.5) / nx, (j as f64 + 0.5) / ny);
                sum += plane.sample((x as f64 + u) * sx, (y as f64 + v) * sy);
            }
        }
        sum / (nx * ny) as f32
    };
    let value = &value;
    let values = (0..height).into_par_iter().flat_map_iter(|y| (0..width).map(move |x| value(x, y))).collect();
    Plane::from_values(width, height, values).unwrap_or_default()
}

/// The brushes, largest first, without those that a pen of this line can't tell apart.
fn brushes(options: &PainterlyOptions, area: f64, longest: f64, line: f64) -> Vec<PenBrush> {
    let mut radii = options.radii.clone();
    if radii.is_empty() {
        // As many strokes as there may be cover the sheet a few times over.
        let mut radius = (0.4 * (area / options.strokes as f64).sqrt()).max(1.5 * line);
        while radius > 1.2 * line {
            radii.push(radius);
            radius *= 0.5;
        }
        radii.push(0.5 * line);
    }
    radii.iter_mut().for_each(|r| *r = r.clamp(0.5 * line, 0.5 * longest.max(line)));
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
            flow: Flow::new(&blur(&lightness, options.blur * radius), radius),
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
            let sum: f64 = (0..4).map(|_| f64::from(random.next_u32()) / f64::from(u32::MAX) - 0.5).sum();
            let corner = [column, row].map(|n| (n as f64 * layer.grid) as u32);
            seeds.push(Seed { layer: i as u16, corner, turn: (jitter * sum * 3f64.sqrt()) as f32 });
        }
    }
    seeds
}

/// The drawing of these strokes, which lie beside the candidates they were made of.
fn drawing(
    flat: &Flat,
    pens: &[usize],
    lines: &[f64],
    sheet: Sheet,
    strokes: &[Candidate],
    drawn: Vec<Stroke>,
) -> Drawing {
    let mut layers: Vec<InkLayer> = Vec::new();
    let mut layer_of = vec![None; pens.len()];
    for pen in (0..pens.len()).filter(|pen| strokes.iter().any(|s| s.ink == *pen)) {
        layer_of[pen] = Some(layers.len());
        let ink = &flat.inks[pens[pen]];
        layers.push(InkLayer {
            name: ink.name.clone(),
            color: ink.color,
            width_hint: Some(lines[pen]),
            strokes: Vec::new(),
        });
    }
    let mut order = Vec::with_capacity(strokes.len());
    for (candidate, stroke) in strokes.iter().zip(drawn) {
        let Some(layer) = layer_of[candidate.ink] else { continue };
        order.push(StrokeRef { layer, stroke: layers[layer].strokes.len() });
        layers[layer].strokes.push(stroke);
    }
    Drawing { width: sheet.width, height: sheet.height, layers, order }
}

/// The canvas after some of the strokes, evenly chosen.
fn frames(mut canvas: Canvas, layers: &[Layer], strokes: &[Candidate]) -> Vec<Option<Plate>> {
    let mut mask = Mask::new(canvas.width, canvas.height);
    let mut frames = Vec::new();
    for (i, stroke) in strokes.iter().enumerate() {
        stroke.sweep(layers, &mut mask);
        canvas.paint(mask.pixels(), stroke.ink);
        // Much happens early: frame k of n shows (k/n)^2 of the strokes.
        let k = frames.len() + 1;
        if k <= FRAMES && (i + 1) * (FRAMES + 1).pow(2) >= strokes.len() * k * k {
            let caption = format!("After {} of {} strokes", i + 1, strokes.len());
            frames.push(plate(&format!("frame-{k}"), &caption, &canvas.picture()));
        }
    }
    frames
}

fn plate(name: &str, caption: &str, picture: &Picture) -> Option<Plate> {
    let image = picture.to_image().ok()?;
    Some(Plate { name: name.into(), caption: caption.into(), image })
}
