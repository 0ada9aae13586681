//! SVG to [`Drawing`].
//!
//! usvg resolves styles, units, references, shapes and markers; here its paths are placed on the sheet, dashed,
//! clipped, filled as asked, flattened and gathered into layers.
//!
//! What is drawn: every shape with a stroke, along its centre line; fills as [`Fill`] asks. What is not: text, images,
//! patterns, masks and filters are named in the warnings; gradients become their mean colour; partial opacity becomes
//! full ink. Invisible shapes (`display`, `visibility`, zero opacity) are left out as every viewer does, and ink of
//! the paper's colour with a warning, since it would leave no mark; filled shapes of that colour hide the lines under them.
//!
//! Precision: usvg works in single precision (1e-7 of the largest coordinate) and turns an arc into cubics that stay
//! within 0.03 % of its radius. Flattening adds at most [`SvgOptions::tolerance`], on the sheet.
use std::path::Path;

use kurbo::Affine;

use super::Drawing;
use super::encoding;
use super::svg_survey::{self, Survey};
use super::svg_walk::{MAX_POINTS, Walk};
use super::{DrawingError, Loaded, Size};
use crate::files;
use crate::math::Rgb;

/// Millimetres per CSS pixel: 96 px = 25.4 mm.
const MM_PER_PX: f64 = 25.4 / 96.0;
/// Stack of the thread that reads a document: usvg recurses through groups, `use` and clip paths.
const STACK: usize = 256 << 20;
/// Largest file that is read.
const MAX_BYTES: usize = 256 << 20;

/// How filled shapes are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Fill {
    /// Not at all.
    Ignore,
    /// As their outline, where they have no stroke of their own.
    #[default]
    Outline,
    /// As parallel lines with alternating direction that keep half a spacing away from the outline; what is too thin
    /// for a line is outlined.
    Hatch {
        /// Distance of the lines, m.
        spacing: f64,
        /// Direction of the lines, rad, counter-clockwise from x.
        angle: f64,
    },
}

/// How an SVG file is read.
#[derive(Clone, Debug, PartialEq)]
pub struct SvgOptions {
    /// Desired size of the page.
    pub size: Size,
    /// How filled shapes are drawn.
    pub fill: Fill,
    /// Greatest distance between a curve and its polyline on the sheet, m.
    pub tolerance: f64,
    /// One layer per colour in the whole drawing, since a change of pens costs time; otherwise one per colour in each
    /// top-level group.
    pub by_ink: bool,
    /// Whether strokes are cut at the edge of the page, as viewers do.
    pub crop: bool,
    /// Colour of the paper: ink of this colour is left out. `None` draws every colour.
    pub paper: Option<Rgb>,
}

impl Default for SvgOptions {
    fn default() -> Self {
        SvgOptions {
            size: Size::Natural,
            fill: Fill::Outline,
            tolerance: 5e-5,
            by_ink: true,
            crop: true,
            paper: Some(Rgb([255, 255, 255])),
        }
    }
}

/// Reads an SVG file.
///
/// # Errors
/// As [`parse`], and where the file can't be read.
pub fn read(file: &Path, options: &SvgOptions) -> Result<Loaded, DrawingError> {
    let bytes = files::read(file).map_err(|source| DrawingError::Unreadable { file: file.to_path_buf(), source })?;
    parse(&bytes, file, options)
}

/// Makes a drawing of an SVG document; `file` is named in errors.
///
/// # Errors
/// `Invalid` with the line for what is not an SVG document of a usable size, `Empty` where no stroke is left,
/// `BadOption` for a size, tolerance or spacing out of range.
pub fn parse(bytes: &[u8], file: &Path, options: &SvgOptions) -> Result<Loaded, DrawingError> {
    let invalid =
        |line: usize, message: &str| DrawingError::Invalid { file: file.into(), line, message: message.into() };
    check(options)?;
    let unpacked = match bytes.starts_with(&[0x1f, 0x8b]) {
        true => encoding::unpack(bytes, MAX_BYTES).map_err(|e| invalid(1, &format!("compressed, but broken: {e}")))?,
        false => Vec::new(),
    };
    let bytes = if unpacked.is_empty() { bytes } else { &unpacked };
    if bytes.len() > MAX_BYTES {
        return Err(invalid(1, "larger than 256 MiB: split it"));
    }
    let text = &*encoding::text(bytes)
        .map_err(|line| invalid(line, "not text in UTF-8, UTF-16 or Latin-1: save the SVG as UTF-8"))?;
    // A thread of its own gives usvg's recursion the stack it may need, and keeps a panic in it from ours.
    let result = std::thread::scope(|scope| {
        let work = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, || convert(text, file, options));
        work.map(|w| w.join())
    });
    match result {
        Ok(Ok(loaded)) => loaded,
        Ok(Err(_)) => Err(invalid(1, "the SVG reader failed on this document: simplify it")),
        Err(source) => Err(DrawingError::Unreadable { file: file.into(), source }),
    }
}

fn check(options: &SvgOptions) -> Result<(), DrawingError> {
    let bad = |name, value| {
        Err(DrawingError::BadOption { name, value, message: "must lie between 1e-6 and 1 m".to_string() })
    };
    if !(1e-6..=1.0).contains(&options.tolerance) {
        return bad("tolerance", options.tolerance);
    }
    match options.fill {
        Fill::Hatch { spacing, .. } if !(1e-6..=1.0).contains(&spacing) => bad("spacing", spacing),
        Fill::Hatch { angle, .. } if !angle.is_finite() => {
            Err(DrawingError::BadOption { name: "angle", value: angle, message: "must be finite".into() })
        }
        _ => Ok(()),
    }
}

fn convert(text: &str, file: &Path, options: &SvgOptions) -> Result<Loaded, DrawingError> {
    let Survey { text: rewritten, labels, warnings } = svg_survey::survey(text, file)?;
    let invalid = |line, message| DrawingError::Invalid { file: file.into(), line, message };
    // Images are never drawn, so no file that the document names is opened.
    let image_href_resolver =
        usvg::ImageHrefResolver { resolve_data: Box::new(|_, _, _| None), resolve_string: Box::new(|_, _| None) };
    let tree = usvg::Tree::from_str(&rewritten, &usvg::Options { image_href_resolver, ..Default::default() }).map_err(
        |e| match e {
            usvg::Error::ParsingFailed(usvg::roxmltree::Error::NodesLimitReached)
            | usvg::Error::ElementsLimitReached => {
                invalid(1, "more than a million elements, or nested too deep, once every `use` is resolved".to_string())
            }
            usvg::Error::ParsingFailed(e) => invalid(e.pos().row as usize, e.to_string()),
            usvg::Error::InvalidSize => invalid(
                line_of_root(text),
                "the page has no size: `width` and `height` must be positive, or a `viewBox` given".to_string(),
            ),
            e => invalid(1, e.to_string()),
        },
    )?;
    let natural =
        (f64::from(tree.size().width()) * MM_PER_PX * 1e-3, f64::from(tree.size().height()) * MM_PER_PX * 1e-3);
    let (width, height) = options.size.resolve(natural.0, natural.1)?;
    let scale = MM_PER_PX * width / natural.0;
    let sheet_from_px = Affine::new([scale, 0.0, 0.0, -scale, -0.5e3 * width, 0.5e3 * height]);
    let mut walk = Walk::new(options, sheet_from_px, (1e3 * width, 1e3 * height), &labels);
    walk.top_level(tree.root());
    if walk.overflowed() {
        return Err(invalid(
            1,
            format!("more than {MAX_POINTS:e} points: simplify the artwork or raise the tolerance"),
        ));
    }
    let mut warnings = warnings;
    warnings.extend(walk.warnings());
    let layers = walk.layers();
    if layers.is_empty() {
        let reason = match warnings.is_empty() {
            true => "no visible shape has a stroke or a fill".to_string(),
            false => warnings.iter().map(|w| w.to_string()).collect::<Vec<_>>().join("; "),
        };
        return Err(DrawingError::Empty { file: file.into(), reason });
    }
    Ok(Loaded { drawing: Drawing::new(width, height, layers), warnings })
}

/// The line on which the root element starts.
fn line_of_root(text: &str) -> usize {
    text.find("<svg").map_or(1, |at| text[..at].matches('\n').count() + 1)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nalgebra::Point2;
    use proptest::prelude::*;

    use super::*;
    use crate::drawing::{Stroke, Warning};

    fn load(svg: &str, options: &SvgOptions) -> Loaded {
        parse(svg.as_bytes(), Path::new("a.svg"), options).unwrap()
    }

    fn error(svg: &str) -> String {
        parse(svg.as_bytes(), Path::new("a.svg"), &SvgOptions::default()).unwrap_err().to_string()
    }

    /// A page of 100 x 100 mm in mm units.
    fn page(body: &str) -> String {
        format!(
            "<svg xmlns='http://www.w3.org/2000/svg' xmlns:xlink='http://www.w3.org/1999/xlink' \
             xmlns:inkscape='http://www.inkscape.org/namespaces/inkscape' \
             width='100mm' height='100mm' viewBox='0 0 100 100'>{body}</svg>"
        )
    }

    fn draw(body: &str) -> Drawing {
        load(&page(body), &SvgOptions::default()).drawing
    }

    fn points_mm(s: &Stroke) -> Vec<(f64, f64)> {
        let round = |x: f64| (x * 1e3 * 1e4).round() / 1e4;
        s.points.iter().map(|p| (round(p.x), round(p.y))).collect()
    }

    #[test]
    fn documents_keep_their_true_size_in_every_unit() {
        for (size, mm) in [("50mm", 50.0), ("5cm", 50.0), ("2in", 50.8), ("96px", 25.4), ("96", 25.4), ("72pt", 25.4)] {
            let svg = format!(
                "<svg xmlns='http://www.w3.org/2000/svg' width='{size}' height='{size}'><path d='M0 0L10 10' stroke='black'/></svg>"
            );
            let d = load(&svg, &SvgOptions::default()).drawing;
            assert!((d.width - 1e-3 * mm).abs() < 1e-8 && (d.height - 1e-3 * mm).abs() < 1e-8, "{size}: {}", d.width);
            assert!((d.length() - 200f64.sqrt() * 25.4e-3 / 96.0).abs() < 1e-8);
        }
    }

    #[test]
    fn the_sheet_has_its_origin_in_the_centre_and_y_up() {
        let d = draw("<polyline points='0 0 100 0 100 75' fill='none' stroke='red'/>");
        assert_eq!(points_mm(&d.layers[0].strokes[0]), [(-50.0, 50.0), (50.0, 50.0), (50.0, -25.0)]);
        assert_eq!(d.layers[0].color, Rgb([255, 0, 0]));
    }

    #[test]
    fn desired_sizes_scale_uniformly() {
        let svg = page("<path d='M0 0H100' stroke='black'/>").replace("height='100mm'", "height='50mm'");
        for (size, w) in [(Size::Width(0.3), 0.3), (Size::Height(0.3), 0.6), (Size::Fit(0.4, 0.1), 0.2)] {
            let d = load(&svg, &SvgOptions { size, ..Default::default() }).drawing;
            assert!((d.width - w).abs() < 1e-9 && (d.height - 0.5 * w).abs() < 1e-9);
        }
    }

    #[test]
    fn every_path_command_has_the_length_of_its_shape() {
        let cases = [
            ("M10 10 l10 0 v10 h-10 z", 40.0),
            ("M10 10 H30 V20 L20 20", 40.0),
            // 20 (sqrt(5) / 2 + asinh(2) / 4)
            ("M10 10 Q 20 10 30 30", 29.578_857),
            // A cubic and a smooth cubic along one straight line.
            ("M10 10 C 15 10 20 10 25 10 S 35 10 40 10", 30.0),
            ("M10 10 Q 15 10 20 10 T 40 10", 30.0),
            ("M10 50 A 20 20 0 0 1 50 50", PI * 20.0),
            ("M10 50 a 20 20 0 1 0 20 -20", 1.5 * PI * 20.0),
            ("M10 10 10 20 M30 30 30 45", 25.0),
        ];
        for (d, mm) in cases {
            let length = draw(&format!("<path d='{d}' fill='none' stroke='black'/>")).length() * 1e3;
            assert!((length - mm).abs() < 1e-3 * mm, "{d}: {length} is not {mm}");
        }
    }

    #[test]
    fn shapes_become_their_outlines() {
        let cases = [
            ("<rect x='10' y='10' width='30' height='20'", 100.0, 1),
            ("<rect x='10' y='10' width='30' height='20' rx='5'", 60.0 + 2.0 * PI * 5.0, 1),
            ("<circle cx='50' cy='50' r='20'", 40.0 * PI, 1),
            ("<ellipse cx='50' cy='50' rx='20' ry='20'", 40.0 * PI, 1),
            ("<line x1='10' y1='10' x2='40' y2='50'", 50.0, 1),
            ("<polyline points='10,10 20,10 20,20'", 20.0, 1),
            ("<polygon points='10,10 40,10 40,50'", 120.0, 1),
        ];
        for (shape, mm, strokes) in cases {
            let d = draw(&format!("{shape} fill='none' stroke='black'/>"));
            assert_eq!(d.stroke_count(), strokes, "{shape}");
            assert!((d.length() * 1e3 - mm).abs() < 2e-3 * mm, "{shape}: {}", d.length());
        }
    }

    #[test]
    fn circles_stay_within_tolerance_of_the_analytic_circle() {
        for (tolerance, size) in [(5e-5, 0.1), (5e-4, 0.1), (5e-5, 0.4)] {
            let svg = page("<circle cx='50' cy='50' r='40' fill='none' stroke='black'/>");
            let d = load(&svg, &SvgOptions { tolerance, size: Size::Width(size), ..Default::default() }).drawing;
            let r = 0.4 * size;
            for w in d.layers[0].strokes[0].points.windows(2) {
                for p in [w[0], nalgebra::center(&w[0], &w[1])] {
                    assert!((p.coords.norm() - r).abs() < tolerance + 3e-4 * r, "{}", p.coords.norm() - r);
                }
            }
        }
    }

    #[test]
    fn transforms_and_use_move_the_shape() {
        let d = draw(
            "<defs><path id='p' d='M0 0 L10 0' stroke='black'/></defs>\
             <g transform='translate(50 50)'><g transform='rotate(90) scale(2)'><use xlink:href='#p' x='1'/></g></g>",
        );
        assert_eq!(points_mm(&d.layers[0].strokes[0]), [(0.0, -2.0), (0.0, -22.0)]);
    }

    #[test]
    fn a_clip_path_cuts_strokes_at_its_outline() {
        let d = draw(
            "<clipPath id='c'><circle cx='50' cy='50' r='20'/></clipPath>\
             <g clip-path='url(#c)'><path d='M0 50 H100 M0 90 H100' stroke='black'/></g>",
        );
        assert_eq!(d.stroke_count(), 1);
        assert!((d.length() - 0.04).abs() < 2e-5);
    }

    #[test]
    fn nested_and_transformed_clips_intersect() {
        let d = draw(
            "<clipPath id='a'><rect width='60' height='100'/></clipPath>\
             <clipPath id='b' clip-path='url(#a)'><rect x='40' width='60' height='100'/></clipPath>\
             <g transform='translate(10 0)'><path clip-path='url(#b)' d='M-10 50 H90' stroke='black'/></g>",
        );
        assert_eq!(points_mm(&d.layers[0].strokes[0]), [(0.0, 0.0), (20.0, 0.0)]);
    }

    #[test]
    fn strokes_are_cut_at_the_page_unless_asked() {
        let svg = page("<path d='M-50 50 H150' stroke='black'/>");
        let cut = load(&svg, &SvgOptions::default());
        assert!((cut.drawing.length() - 0.1).abs() < 1e-8);
        assert_eq!(cut.warnings.len(), 1);
        let whole = load(&svg, &SvgOptions { crop: false, ..Default::default() });
        assert!((whole.drawing.length() - 0.2).abs() < 1e-8 && whole.warnings.is_empty());
    }

    #[test]
    fn layers_keep_names_colours_widths_and_order() {
        let svg = page(
            "<g inkscape:label='sky' id='l1'><path d='M0 0H50' stroke='blue' stroke-width='0.8'/></g>\
             <g id='earth'><path d='M0 10H50' stroke='green'/><path d='M0 20H50' stroke='blue'/></g>\
             <g><path d='M0 30H50' stroke='green'/></g>\
             <path d='M0 40H50' stroke='#102030'/>",
        );
        let apart = load(&svg, &SvgOptions { by_ink: false, ..Default::default() }).drawing;
        let names: Vec<&str> = apart.layers.iter().map(|l| l.name.as_str()).collect();
        assert_eq!(names, ["sky", "earth #008000", "earth #0000ff", "#008000", "#102030"]);
        assert!((apart.layers[0].width_hint.unwrap() - 0.8e-3).abs() < 1e-9);
        let merged = load(&svg, &SvgOptions::default()).drawing;
        let names: Vec<&str> = merged.layers.iter().map(|l| l.name.as_str()).collect();
        assert_eq!(names, ["#0000ff", "earth #008000", "#102030"]);
        assert_eq!(merged.stroke_count(), 5);
    }

    #[test]
    fn dashes_cover_their_share_of_the_line() {
        let d = draw("<path d='M0 50 H100' stroke='black' stroke-dasharray='3 2'/>");
        assert_eq!(d.stroke_count(), 20);
        assert!((d.length() - 0.06).abs() < 1e-7);
        let dots = draw("<path d='M0 50 H100' stroke='black' stroke-linecap='round' stroke-dasharray='0 5'/>");
        assert!((20..=21).contains(&dots.stroke_count()) && dots.length() < 1e-4, "{}", dots.stroke_count());
    }

    #[test]
    fn fills_are_outlined_hatched_or_ignored_as_asked() {
        let svg = page(
            "<rect x='10' y='10' width='20' height='10' fill='red'/>\
             <rect x='40' y='10' width='20' height='10' fill='red' stroke='black'/>",
        );
        let with = |fill| load(&svg, &SvgOptions { fill, ..Default::default() });
        let outlined = with(Fill::Outline).drawing;
        assert_eq!(outlined.layers.iter().map(|l| l.strokes.len()).collect::<Vec<_>>(), [1, 1]);
        assert!((outlined.length() - 0.12).abs() < 1e-6);
        let hatched = with(Fill::Hatch { spacing: 1e-3, angle: 0.0 }).drawing;
        assert_eq!(hatched.layers.iter().map(|l| l.strokes.len()).collect::<Vec<_>>(), [20, 1]);
        let ignored = with(Fill::Ignore);
        assert_eq!((ignored.drawing.stroke_count(), ignored.warnings.len()), (1, 1));
    }

    #[test]
    fn invisible_and_paper_coloured_shapes_are_left_out() {
        let body = "<path d='M0 0H9' stroke='red' display='none'/><path d='M0 0H9' stroke='red' visibility='hidden'/>\
             <g opacity='0'><path d='M0 0H9' stroke='red'/></g><path d='M0 0H9' stroke='red' stroke-opacity='0'/>\
             <path d='M0 0H9' stroke='white'/><path d='M0 50H9' stroke='black'/>";
        let loaded = load(&page(body), &SvgOptions::default());
        assert_eq!(loaded.drawing.stroke_count(), 1);
        assert_eq!(loaded.warnings.len(), 1, "only the white one would be missed: {:?}", loaded.warnings);
        let all = load(&page(body), &SvgOptions { paper: None, ..Default::default() });
        assert_eq!(all.drawing.stroke_count(), 2);
    }

    #[test]
    fn what_cannot_be_drawn_is_named_with_its_line() {
        let body = "\n<text x='1' y='9'>a</text>\n<text>b</text>\n<image href='a.png' width='9' height='9'/>\
             <path d='M0 0H9 what' stroke='black'/><use href='#nothing'/>\
             <linearGradient id='g'><stop offset='0' stop-color='red'/><stop offset='1' stop-color='blue'/></linearGradient>\
             <rect width='9' height='9' stroke='url(#g)' fill='none'/>";
        let loaded = load(&page(body), &SvgOptions::default());
        let told: Vec<String> = loaded.warnings.iter().map(Warning::to_string).collect();
        for part in ["line 2: 2 x text", "line 4: 1 x image", "broken path data", "line 4: 1 x use", "1 x gradient"] {
            assert!(told.iter().any(|t| t.contains(part)), "{part} in {told:?}");
        }
        assert!(loaded.drawing.layers.iter().any(|l| l.color == Rgb([128, 0, 128])));
    }

    #[test]
    fn errors_name_file_and_line() {
        let cases = [
            ("<svg xmlns='http://www.w3.org/2000/svg'>\n<g>\n</svg>", "a.svg:3: not well-formed XML"),
            ("\n<html/>", "a.svg:2: the root element is `html`"),
            ("<svg xmlns='http://www.w3.org/2000/svg'>", "a.svg:1: not well-formed XML"),
            ("<svg xmlns='http://www.w3.org/2000/svg' width='0' height='9'/>", "a.svg:1: the page has no size"),
            (&page("<text>a</text>"), "a.svg: holds no strokes: line 1: 1 x text"),
            (&page(""), "a.svg: holds no strokes: no visible shape"),
        ];
        for (svg, start) in cases {
            let e = error(svg);
            assert!(e.starts_with(start), "{e}");
        }
        let bad = SvgOptions { size: Size::Width(0.0), ..Default::default() };
        assert!(parse(page("").as_bytes(), Path::new("a.svg"), &bad).unwrap_err().to_string().starts_with("width = 0"));
    }

    #[test]
    fn deep_but_lawful_documents_are_read() {
        let body =
            format!("{}<path d='M0 0H9' stroke='red'/>{}", "<g opacity='0.999'>".repeat(390), "</g>".repeat(390));
        assert_eq!(draw(&body).stroke_count(), 1);
        let circle = "<clipPath id='a' clip-path='url(#b)'><path d='M0 0H9V9z'/></clipPath>\
             <clipPath id='b' clip-path='url(#a)'><path d='M0 0H9V9z'/></clipPath>\
             <path clip-path='url(#a)' d='M1 1L1 99M50 50H60' stroke='red'/><path d='M0 0H9' stroke='red'/>";
        assert!(draw(circle).stroke_count() >= 1);
    }

    #[test]
    fn bombs_are_refused() {
        let deep = page(&format!("{}{}", "<g>".repeat(50_000), "</g>".repeat(50_000)));
        assert!(error(&deep).contains("nested deeper"), "{}", error(&deep));

        let mut uses = "<path id='u0' d='M0 0H1' stroke='red'/>".to_string();
        for i in 1..40 {
            uses += &format!("<g id='u{i}'><use href='#u{0}'/><use href='#u{0}'/></g>", i - 1);
        }
        assert!(error(&page(&uses)).contains("more than a million"), "{}", error(&page(&uses)));

        let mut laughs = "<!DOCTYPE svg [<!ENTITY a0 'hahahahahahahahahahahahahaha'>".to_string();
        for i in 1..9 {
            laughs += &format!("<!ENTITY a{i} '{}'>", format!("&a{};", i - 1).repeat(10));
        }
        laughs += &format!("]>{}", page("<text>&a8;</text>"));
        assert!(parse(laughs.as_bytes(), Path::new("a.svg"), &SvgOptions::default()).is_err());

        let row: String = (0..20_000)
            .map(|i| format!("<clipPath id='c{i}' clip-path='url(#c{})'><path d='M0 0H9V9z'/></clipPath>", i + 1))
            .collect();
        let row = page(&format!("{row}<path clip-path='url(#c0)' d='M0 0H9' stroke='red'/>"));
        assert!(error(&row).contains("in a row"), "{}", error(&row));

        let bush: String = (0..60)
            .map(|i| {
                let shape = format!("<path mask='url(#m{})' d='M0 0H9V9z'/>", i + 1);
                format!("<mask id='m{i}'>{shape}{shape}</mask>")
            })
            .collect();
        let bush = page(&format!("{bush}<path mask='url(#m0)' d='M0 0H9' stroke='red'/>"));
        assert!(error(&bush).contains("multiply without bound"), "{}", error(&bush));

        let mut nest = "<path id='n0' d='M0 0H9' stroke='red'/>".to_string();
        for i in 1..2_000 {
            nest += &format!("<g id='n{i}'><use href='#n{}'/></g>", i - 1);
        }
        assert!(error(&page(&nest)).contains("nested too deep"), "{}", error(&page(&nest)));

        let far = page("<path d='M0 0C1e30 0 0 1e30 1 1' stroke='red'/><path d='M0 0H9' stroke='red'/>");
        assert_eq!(load(&far, &SvgOptions::default()).drawing.stroke_count(), 1);
        let dashes = page("<path d='M0 0H99' stroke='red' stroke-dasharray='1e-9'/>");
        assert_eq!(load(&dashes, &SvgOptions::default()).drawing.stroke_count(), 1);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]

        #[test]
        fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            let _ = parse(&bytes, Path::new("a.svg"), &SvgOptions::default());
        }

        #[test]
        fn mutated_documents_never_fail_inside_usvg(
            edits in proptest::collection::vec((0usize..4000, "[ -~]{0,3}"), 1..6),
            hatch in any::<bool>(),
        ) {
            let mut svg = page(
                "<defs><clipPath id='c'><circle cx='50' cy='50' r='40'/></clipPath><path id='u' d='M0 0l9 9'/></defs>\
                 <g inkscape:label='a' clip-path='url(#c)'><path d='M10 10C20 20 30 5 40 40A9 9 0 0 1 50 50z' stroke='red'/></g>\
                 <g transform='rotate(30) scale(2 1)'><rect x='5' y='5' width='30' height='9' rx='2' fill='blue'/></g>\
                 <use xlink:href='#u' stroke='green' stroke-dasharray='1 2' style='stroke-width:0.5mm'/>",
            );
            for (at, text) in edits {
                let from = at % svg.len();
                svg.replace_range(from..(from + 1).min(svg.len()), &text);
            }
            let fill = if hatch { Fill::Hatch { spacing: 1e-3, angle: 0.5 } } else { Fill::Outline };
            match parse(svg.as_bytes(), Path::new("a.svg"), &SvgOptions { fill, ..Default::default() }) {
                Ok(loaded) => {
                    let d = loaded.drawing;
                    let on_page = |p: &Point2<f64>| p.x.abs() <= 0.5 * d.width + 1e-6 && p.y.abs() <= 0.5 * d.height + 1e-6;
                    prop_assert!(d.layers.iter().flat_map(|l| &l.strokes).flat_map(|s| &s.points).all(on_page));
                }
                Err(e) => prop_assert!(!e.to_string().contains("the SVG reader failed"), "{}", e),
            }
        }
    }
}
