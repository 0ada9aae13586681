//! A drawing read from a file, generated, or made from a picture.
use std::path::Path;

use super::pens::ink_pen;
use super::{ArtworkError, picture_art};
use crate::art::{self, Plate};
use crate::drawing::pattern::{Figure, Pattern};
use crate::drawing::tidy::{TidyOptions, tidy};
use crate::drawing::{self, Drawing, Size, StylusOptions, SvgOptions, stylus};
use crate::math::{Rgb, plain};
use crate::picture::Picture;
use crate::progress::Progress;
use crate::scenario::{self, Artwork, DrawingSpec, InkOrder, Sketch};

/// Curves become polylines this near to them, m: well below what can be seen of the corners.
const FLATTENING: f64 = 1e-5;
/// Ink of generated patterns.
const BLACK: Rgb = Rgb([26, 26, 30]);

/// A drawing and where it came from.
pub struct Made {
    /// The strokes.
    pub drawing: Drawing,
    /// The picture that they were made from, if it was one.
    pub picture: Option<Picture>,
    /// Pictures of the way there.
    pub plates: Vec<Plate>,
}

/// Reads, or makes, a drawing and puts its strokes in order.
///
/// # Errors
/// A file that can't be read, a picture that makes no strokes, or settings that can't be met.
pub fn make(sketch: &Sketch, progress: &dyn Progress) -> Result<Made, ArtworkError> {
    let spec = &sketch.drawing;
    let mut made = match &spec.artwork {
        Artwork::Picture(picture) => picture_art::make(picture, sketch, progress)?,
        Artwork::File(file) => lines(read(file, sketch, progress)?, spec),
        Artwork::Pattern(pattern) => lines(generate(pattern, spec)?, spec),
    };
    let order = match spec.ink_order {
        InkOrder::AsMade => art::InkOrder::AsMade,
        InkOrder::ByInk => art::InkOrder::ByInk { light_to_dark: true },
        InkOrder::FewestChanges => art::InkOrder::FewestChanges { disorder: spec.disorder },
    };
    art::arrange(&mut made.drawing, order);
    Ok(made)
}

/// Millimetres to metres.
fn metres(mm: Option<f64>) -> Option<f64> {
    mm.map(|mm| mm * 1e-3)
}

/// Reads a vector file.
fn read(file: &Path, sketch: &Sketch, progress: &dyn Progress) -> Result<Drawing, ArtworkError> {
    let spec = &sketch.drawing;
    let size = match (metres(spec.width_mm), metres(spec.height_mm)) {
        (None, None) => Size::Natural,
        (Some(w), None) => Size::Width(w),
        (None, Some(h)) => Size::Height(h),
        (Some(w), Some(h)) => Size::Fit(w, h),
    };
    let fill = match spec.fill {
        scenario::Fill::Outline => drawing::Fill::Outline,
        scenario::Fill::Ignore => drawing::Fill::Ignore,
        scenario::Fill::Hatch => {
            drawing::Fill::Hatch { spacing: spec.hatch_spacing_mm * 1e-3, angle: spec.hatch_angle_deg.to_radians() }
        }
    };
    let svg = SvgOptions { size, fill, tolerance: FLATTENING, ..Default::default() };
    let recorded = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("jsonl"));
    let stylus = if recorded { stylus_options(sketch, progress)? } else { StylusOptions::default() };
    let mut loaded = drawing::load(file, &svg, &stylus)?;
    for layer in &mut loaded.drawing.layers {
        // names go onto terminals, into tables and into files of other kinds
        layer.name = plain(&layer.name).into_owned();
    }
    for warning in &loaded.warnings {
        progress.note(&format!("{}: {warning}", file.display()));
    }
    Ok(loaded.drawing)
}

/// How a recording of a stylus is read: its lines are as wide as asked for, else as the pen can draw them.
fn stylus_options(sketch: &Sketch, progress: &dyn Progress) -> Result<StylusOptions, ArtworkError> {
    let spec = &sketch.drawing;
    let pen = ink_pen(stylus::LAYER, stylus::INK, &sketch.pen)?;
    let [narrow, wide] = pen.width_range();
    let width = spec.stylus_width_mm.map_or([narrow, wide], |w| w.map(|mm| mm * 1e-3));
    if width[0] < 0.98 * narrow || width[1] > 1.02 * wide {
        let [a, b, c, d] = [width[0], width[1], narrow, wide].map(|w| w * 1e3);
        let name = &pen.name;
        progress.note(&format!("lines from {a:.2} to {b:.2} mm are desired, but a {name} draws {c:.2} to {d:.2} mm"));
    }
    Ok(StylusOptions { gamma: spec.stylus_gamma, width, ..Default::default() })
}

/// Draws a pattern: square, 150 mm unless asked for.
fn generate(pattern: &scenario::Pattern, spec: &DrawingSpec) -> Result<Drawing, ArtworkError> {
    let side = match (metres(spec.width_mm), metres(spec.height_mm)) {
        (Some(w), Some(h)) => w.min(h),
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => 0.15,
    };
    let color = BLACK;
    let pattern = match *pattern {
        scenario::Pattern::Grid { n } => Pattern::Grid { cells: n, color },
        scenario::Pattern::Hilbert { order, n } => Pattern::Hilbert { order, cells: n, color },
        scenario::Pattern::Arrowhead { order } => Pattern::Arrowhead { order, color },
        scenario::Pattern::Snowflake { order } => Pattern::Snowflake { order, color },
        scenario::Pattern::Target => Pattern::Target { figure: Figure::default(), color },
    };
    Ok(pattern.draw(side)?)
}

/// Vector lines, tidied if that is desired.
fn lines(mut drawing: Drawing, spec: &DrawingSpec) -> Made {
    if spec.tidy {
        let positive = |mm: f64| (mm > 0.0).then_some(mm * 1e-3);
        let options = TidyOptions {
            merge: positive(spec.merge_mm),
            simplify: positive(spec.simplify_mm),
            order: true,
            ..Default::default()
        };
        tidy(&mut drawing, &options);
    }
    Made { drawing, picture: None, plates: Vec::new() }
}
