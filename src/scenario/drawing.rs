//! `[drawing]` as it is meant: a vector file, a pattern or a picture, and how large.
use std::path::{Path, PathBuf};

use crate::math::Rgb;
use crate::picture::is_picture;

use super::assets::existing;
use super::check::Check;
use super::file::{DrawingFile, PatternFile, PatternKind};
use super::picture::{
    ColorSettings, EdgeSettings, HatchingSettings, InkOrder, LayeredDepthSettings, PainterlySettings, Separation,
    StippleSettings, Style, TspSettings,
};
use super::resolve::ScenarioError;
use super::settings::Fill;

/// A generated drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// `n` x `n` squares.
    Grid {
        /// Squares a side.
        n: u32,
    },
    /// Hilbert's curve.
    Hilbert {
        /// Order; the curve has 4^order points.
        order: u32,
        /// Squares a side of a grid under it; 0 for none.
        n: u32,
    },
    /// Sierpinski's arrowhead curve.
    Arrowhead {
        /// Order; the curve has 3^order sides.
        order: u32,
    },
    /// Koch's snowflake.
    Snowflake {
        /// Order; the curve has 3 * 4^order sides.
        order: u32,
    },
    /// A test target.
    Target,
}

/// Where the drawing comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Artwork {
    /// An `.svg`, `.jsonl` or `_k.txt` file; the path is absolute.
    File(PathBuf),
    /// A pattern.
    Pattern(Pattern),
    /// A picture, and what becomes of it.
    Picture(PictureSpec),
}

/// A picture, and what becomes of it.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureSpec {
    /// The picture; the path is absolute.
    pub file: PathBuf,
    /// How it becomes strokes.
    pub generator: Generator,
    /// How it is taken apart into inks.
    pub color: ColorSettings,
}

/// How a picture becomes strokes.
#[derive(Clone, Debug, PartialEq)]
pub enum Generator {
    /// Tours through points.
    Tsp(TspSettings),
    /// Dots.
    Stipple(StippleSettings),
    /// Brush strokes.
    Painterly(PainterlySettings),
    /// Brush strokes by object and depth; paths are absolute.
    LayeredDepth(LayeredDepthSettings),
    /// Cross-hatching.
    Hatching(HatchingSettings),
    /// Edge lines.
    Edges(EdgeSettings),
}

impl Generator {
    /// Its name in scenarios.
    pub fn style(&self) -> Style {
        match self {
            Generator::Tsp(_) => Style::Tsp,
            Generator::Stipple(_) => Style::Stipple,
            Generator::Painterly(_) => Style::Painterly,
            Generator::LayeredDepth(_) => Style::LayeredDepth,
            Generator::Hatching(_) => Style::Hatching,
            Generator::Edges(_) => Style::Edges,
        }
    }
}

/// What is drawn, and how large.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawingSpec {
    /// Where the drawing comes from.
    pub artwork: Artwork,
    /// Height, mm. Both: fit into; neither: its own size.
    pub height_mm: Option<f64>,
    /// Width, mm.
    pub width_mm: Option<f64>,
    /// Turn, counter-clockwise, degrees.
    pub rotate_deg: f64,
    /// What becomes of filled areas.
    pub fill: Fill,
    /// Distance between hatch lines, mm.
    pub hatch_spacing_mm: f64,
    /// Direction of hatch lines, degrees from the x axis.
    pub hatch_angle_deg: f64,
    /// Width of a stylus's line at no and at full pressure, mm; `None`: what the pen can draw.
    pub stylus_width_mm: Option<[f64; 2]>,
    /// Exponent of the pressure in that.
    pub stylus_gamma: f64,
    /// Merge and order strokes.
    pub tidy: bool,
    /// Joining distance, mm.
    pub merge_mm: f64,
    /// Simplification tolerance, mm.
    pub simplify_mm: f64,
    /// In which order strokes of several inks are drawn.
    pub ink_order: InkOrder,
    /// How far from its turn a stroke may be drawn, as a share of all strokes.
    pub disorder: f64,
}

/// Fills in, checks and finds what `[drawing]` names.
pub(super) fn resolve_drawing(typed: DrawingFile, check: &Check) -> Result<DrawingSpec, ScenarioError> {
    if let Some([min, max]) = typed.stylus_width_mm {
        check.within("drawing.stylus_width_mm", max, min, 100.0)?;
    }
    Ok(DrawingSpec {
        height_mm: typed.height_mm,
        width_mm: typed.width_mm,
        rotate_deg: typed.rotate_deg,
        fill: typed.fill,
        hatch_spacing_mm: typed.hatch_spacing_mm,
        hatch_angle_deg: typed.hatch_angle_deg,
        stylus_width_mm: typed.stylus_width_mm,
        stylus_gamma: typed.stylus_gamma,
        tidy: typed.tidy,
        merge_mm: typed.merge_mm,
        simplify_mm: typed.simplify_mm,
        ink_order: typed.ink_order,
        disorder: typed.disorder,
        artwork: resolve_artwork(typed, check)?,
    })
}

/// What kind of artwork a file is.
enum Kind {
    Vector,
    Picture,
}

/// By its extension, or, where that says nothing, by its content.
fn kind_of(source: &str, find: impl FnOnce(&str) -> Result<PathBuf, ScenarioError>) -> Option<Kind> {
    let extension = Path::new(source).extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "svg" | "svgz" | "txt" | "jsonl" => Some(Kind::Vector),
        "png" | "jpg" | "jpeg" | "webp" | "tif" | "tiff" | "gif" | "bmp" | "qoi" | "hdr" => Some(Kind::Picture),
        _ => find(source).is_ok_and(|file| is_picture(&file)).then_some(Kind::Picture),
    }
}

fn resolve_artwork(typed: DrawingFile, check: &Check) -> Result<Artwork, ScenarioError> {
    let find = |source: &str| check.file("drawing.source", |folder| existing(&folder.join(source)));
    let for_pictures = picture_section(&typed);
    match (typed.source.as_deref().map(|s| (s, kind_of(s, find))), &typed.pattern) {
        (Some(_), Some(_)) => {
            Err(check.wrong("drawing.source", "and `[drawing.pattern]` exclude each other: keep one"))
        }
        (None, None) => {
            Err(check.sentence("drawing.source", "`[drawing]` needs a `source` file or a `[drawing.pattern]`"))
        }
        (Some((source, None)), _) => {
            let known =
                "an .svg, a .jsonl, a _k.txt file, or a picture (.png, .jpg, .webp, .tif, .gif, .bmp, .qoi, .hdr)";
            Err(check.wrong("drawing.source", format!("must be {known}, not {source}")))
        }
        (Some((source, Some(Kind::Picture))), _) => {
            let file = find(source)?;
            let color = typed.color.clone().unwrap_or_default();
            check_color(&color, check)?;
            Ok(Artwork::Picture(PictureSpec { file, color, generator: resolve_generator(typed, check)? }))
        }
        (vector, pattern) => {
            if let Some(key) = for_pictures {
                return Err(check.wrong(key, "is for pictures (.png, .jpg, ...): a vector drawing has strokes already"));
            }
            match (vector, pattern) {
                (Some((source, _)), _) => Ok(Artwork::File(find(source)?)),
                (None, Some(pattern)) => Ok(Artwork::Pattern(resolve_pattern(pattern.clone(), check)?)),
                (None, None) => Err(check.sentence("drawing.source", "`[drawing]` needs a `source` file")),
            }
        }
    }
}

/// The sections of `typed` that only a picture heeds, in the order of the file format.
fn sections(typed: &DrawingFile) -> Vec<(&'static str, Style)> {
    let all = [
        (typed.tsp.is_some(), "drawing.tsp", Style::Tsp),
        (typed.stipple.is_some(), "drawing.stipple", Style::Stipple),
        (typed.painterly.is_some(), "drawing.painterly", Style::Painterly),
        (typed.layered_depth.is_some(), "drawing.layered_depth", Style::LayeredDepth),
        (typed.hatching.is_some(), "drawing.hatching", Style::Hatching),
        (typed.edges.is_some(), "drawing.edges", Style::Edges),
    ];
    all.into_iter().filter(|(there, ..)| *there).map(|(_, key, style)| (key, style)).collect()
}

/// The first key that makes no sense without a picture.
fn picture_section(typed: &DrawingFile) -> Option<&'static str> {
    let first = sections(typed).first().map(|(key, _)| *key);
    first.or(typed.color.is_some().then_some("drawing.color")).or(typed.style.is_some().then_some("drawing.style"))
}

fn resolve_generator(typed: DrawingFile, check: &Check) -> Result<Generator, ScenarioError> {
    let style = match (typed.style, &sections(&typed)[..]) {
        (Some(style), _) => style,
        (None, []) => Style::default(),
        (None, [(_, style)]) => *style,
        (None, [(first, _), (second, _), ..]) => {
            let message = format!("`[{first}]` and `[{second}]`: keep one, or choose with `style`");
            return Err(check.sentence(second, message));
        }
    };
    Ok(match style {
        Style::Tsp => Generator::Tsp(typed.tsp.unwrap_or_default()),
        Style::Stipple => Generator::Stipple(typed.stipple.unwrap_or_default()),
        Style::Painterly => Generator::Painterly(typed.painterly.unwrap_or_default()),
        Style::LayeredDepth => {
            let mut layered = typed.layered_depth.unwrap_or_default();
            resolve_semantics(&mut layered, check)?;
            Generator::LayeredDepth(layered)
        }
        Style::Hatching => Generator::Hatching(typed.hatching.unwrap_or_default()),
        Style::Edges => Generator::Edges(typed.edges.unwrap_or_default()),
    })
}

fn resolve_semantics(layered: &mut LayeredDepthSettings, check: &Check) -> Result<(), ScenarioError> {
    let files = [
        ("drawing.layered_depth.labels", &mut layered.labels),
        ("drawing.layered_depth.segments", &mut layered.segments),
        ("drawing.layered_depth.depth", &mut layered.depth),
        ("drawing.layered_depth.segment_model", &mut layered.segment_model),
        ("drawing.layered_depth.depth_model", &mut layered.depth_model),
    ];
    for (key, file) in files {
        if let Some(typed) = file {
            *typed = check.file(key, |folder| existing(&folder.join(&*typed)))?;
        }
    }
    if layered.labels.is_some() && layered.segment_model.is_some() {
        return Err(check.wrong("drawing.layered_depth.segment_model", "and `labels` exclude each other: keep one"));
    }
    if layered.depth.is_some() && layered.depth_model.is_some() {
        return Err(check.wrong("drawing.layered_depth.depth_model", "and `depth` exclude each other: keep one"));
    }
    if layered.segments.is_some() && layered.labels.is_none() && layered.segment_model.is_none() {
        return Err(check.wrong("drawing.layered_depth.segments", "names labels: give `labels` too"));
    }
    Ok(())
}

fn check_color(color: &ColorSettings, check: &Check) -> Result<(), ScenarioError> {
    check.within("drawing.color.white_point", color.white_point, color.black_point + 0.01, 1.0)?;
    for (pen, color) in &color.pens {
        if parse_color(color).is_none() {
            let message = format!("pen `{pen}` has the colour `{color}`, which should be like #20407f");
            return Err(check.sentence(&format!("drawing.color.pens.{pen}"), message));
        }
    }
    if color.separation == Some(Separation::Pens) && color.pens.is_empty() {
        return Err(check.sentence("drawing.color.separation", "`separation = \"pens\"` needs `[drawing.color.pens]`"));
    }
    Ok(())
}

/// A colour `#rrggbb`.
pub fn parse_color(text: &str) -> Option<Rgb> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let channel = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).ok();
    Some(Rgb([channel(0)?, channel(2)?, channel(4)?]))
}

fn resolve_pattern(typed: PatternFile, check: &Check) -> Result<Pattern, ScenarioError> {
    let refuse = |key: &str, given: Option<u32>, message: &str| match given {
        Some(_) => Err(check.wrong(key, message)),
        None => Ok(()),
    };
    let count = |key: &str, given: Option<u32>, default: u32, low: u32, high: u32| {
        let x = given.unwrap_or(default);
        check.within(key, f64::from(x), f64::from(low), f64::from(high)).map(|()| x)
    };
    const N: &str = "drawing.pattern.n";
    const ORDER: &str = "drawing.pattern.order";
    match typed.kind {
        PatternKind::Grid => refuse(ORDER, typed.order, "is for curves: a grid takes `n`")?,
        PatternKind::Target => {
            refuse(ORDER, typed.order, "is for curves: a target takes none")?;
            refuse(N, typed.n, "is for grids: a target takes none")?;
        }
        PatternKind::Hilbert => (),
        _ => refuse(N, typed.n, "is for grids: this curve takes `order`")?,
    }
    Ok(match typed.kind {
        PatternKind::Grid => Pattern::Grid { n: count(N, typed.n, 7, 1, 200)? },
        PatternKind::Hilbert => {
            Pattern::Hilbert { order: count(ORDER, typed.order, 5, 1, 8)?, n: count(N, typed.n, 0, 0, 200)? }
        }
        PatternKind::Arrowhead => Pattern::Arrowhead { order: count(ORDER, typed.order, 6, 1, 9)? },
        PatternKind::Snowflake => Pattern::Snowflake { order: count(ORDER, typed.order, 4, 0, 7)? },
        PatternKind::Target => Pattern::Target,
    })
}

impl From<DrawingSpec> for DrawingFile {
    fn from(s: DrawingSpec) -> Self {
        let mut file = DrawingFile {
            height_mm: s.height_mm,
            width_mm: s.width_mm,
            rotate_deg: s.rotate_deg,
            fill: s.fill,
            hatch_spacing_mm: s.hatch_spacing_mm,
            hatch_angle_deg: s.hatch_angle_deg,
            stylus_width_mm: s.stylus_width_mm,
            stylus_gamma: s.stylus_gamma,
            tidy: s.tidy,
            merge_mm: s.merge_mm,
            simplify_mm: s.simplify_mm,
            ink_order: s.ink_order,
            disorder: s.disorder,
            ..Self::default()
        };
        let text = |path: PathBuf| path.to_string_lossy().into_owned();
        match s.artwork {
            Artwork::File(path) => file.source = Some(text(path)),
            Artwork::Pattern(pattern) => file.pattern = Some(pattern.into()),
            Artwork::Picture(picture) => {
                file.source = Some(text(picture.file));
                file.style = Some(picture.generator.style());
                file.color = Some(picture.color);
                match picture.generator {
                    Generator::Tsp(x) => file.tsp = Some(x),
                    Generator::Stipple(x) => file.stipple = Some(x),
                    Generator::Painterly(x) => file.painterly = Some(x),
                    Generator::LayeredDepth(x) => file.layered_depth = Some(x),
                    Generator::Hatching(x) => file.hatching = Some(x),
                    Generator::Edges(x) => file.edges = Some(x),
                }
            }
        }
        file
    }
}

impl From<Pattern> for PatternFile {
    fn from(pattern: Pattern) -> Self {
        let (kind, n, order) = match pattern {
            Pattern::Grid { n } => (PatternKind::Grid, Some(n), None),
            Pattern::Hilbert { order, n } => (PatternKind::Hilbert, (n > 0).then_some(n), Some(order)),
            Pattern::Arrowhead { order } => (PatternKind::Arrowhead, None, Some(order)),
            Pattern::Snowflake { order } => (PatternKind::Snowflake, None, Some(order)),
            Pattern::Target => (PatternKind::Target, None, None),
        };
        PatternFile { kind, n, order }
    }
}
