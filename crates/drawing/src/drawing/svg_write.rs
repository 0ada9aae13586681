//! [`Drawing`] to SVG text: the desired lines, in millimetres, one Inkscape layer per ink. A line of varying width is
//! written in runs of even width.
use std::fmt::Write as _;

use nalgebra::Point2;

use super::{Drawing, InkLayer, Stroke};
use crate::math::Rgb;

/// Width of lines whose layer asks for none, mm.
const DEFAULT_WIDTH_MM: f64 = 0.5;
/// A run goes on while the width stays this near, relatively, to that it began with.
const EVEN: f64 = 0.05;

/// The drawing as an SVG document whose user unit is a millimetre. Coordinates are rounded to 0.1 um.
pub fn write(drawing: &Drawing) -> String {
    let (width, height) = (1e3 * drawing.width, 1e3 * drawing.height);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" \
         xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" \
         width=\"{0}mm\" height=\"{1}mm\" viewBox=\"0 0 {0} {1}\">\n",
        number(width),
        number(height)
    );
    for (i, layer) in drawing.layers.iter().enumerate() {
        add_layer(&mut svg, i, layer, width, height);
    }
    svg.push_str("</svg>\n");
    svg
}

fn add_layer(svg: &mut String, index: usize, layer: &InkLayer, width: f64, height: f64) {
    let Rgb([r, g, b]) = layer.color;
    // Writing to a string does not fail.
    let _ = writeln!(
        svg,
        "<g id=\"layer{}\" inkscape:groupmode=\"layer\" inkscape:label=\"{}\" fill=\"none\" \
         stroke=\"#{r:02x}{g:02x}{b:02x}\" stroke-width=\"{}\" stroke-linecap=\"round\" stroke-linejoin=\"round\">",
        index + 1,
        escape(&layer.name),
        number(layer.width_hint.map_or(DEFAULT_WIDTH_MM, |w| 1e3 * w)),
    );
    for stroke in &layer.strokes {
        if stroke.widths.len() == stroke.points.len() {
            add_runs(svg, stroke, width, height);
        } else {
            svg.push_str("<path");
            add_path(svg, &stroke.points, width, height);
        }
    }
    svg.push_str("</g>\n");
}

/// A stroke of varying width as paths one after another, each of one width: the mean of its points'.
fn add_runs(svg: &mut String, stroke: &Stroke, width: f64, height: f64) {
    let last = stroke.points.len().saturating_sub(1);
    let mut from = 0;
    loop {
        let Some(begun) = stroke.width_at(from) else { return };
        let even = stroke.widths[from..].iter().take_while(|w| (*w - begun).abs() <= EVEN * begun).count().max(1);
        let widths = &stroke.widths[from..from + even];
        let mean = widths.iter().sum::<f64>() / widths.len() as f64;
        // the point that ends a run begins the next, so that the line has no gap
        let to = (from + even).min(last);
        let _ = write!(svg, "<path stroke-width=\"{}\"", number(1e3 * mean));
        add_path(svg, &stroke.points[from..=to], width, height);
        if to == last {
            return;
        }
        from = to;
    }
}

/// Ends a path's tag with where it goes.
fn add_path(svg: &mut String, points: &[Point2<f64>], width: f64, height: f64) {
    let Some(first) = points.first() else { return };
    let closed = points.len() > 2 && points.first() == points.last();
    let rest = &points[1..points.len() - usize::from(closed)];
    // A dot is a line of no length, which round caps make visible.
    let dot = if points.len() == 1 { std::slice::from_ref(first) } else { &[] };
    svg.push_str(" d=\"M");
    for (i, p) in std::iter::once(first).chain(rest).chain(dot).enumerate() {
        let lead = if i == 0 { "" } else { "L" };
        let _ = write!(svg, "{lead}{} {}", number(1e3 * p.x + 0.5 * width), number(0.5 * height - 1e3 * p.y));
    }
    svg.push_str(if closed { "Z\"/>\n" } else { "\"/>\n" });
}

/// A number of millimetres without trailing zeros.
fn number(x: f64) -> String {
    // Adding zero turns -0 into 0.
    ((x * 1e4).round() / 1e4 + 0.0).to_string()
}

/// Text as an attribute's value; characters that XML can't hold are left out.
fn escape(text: &str) -> String {
    let mut escaped = String::new();
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            c if c < ' ' || c == '\u{fffe}' || c == '\u{ffff}' => {}
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;
    use proptest::prelude::*;

    use super::*;
    use crate::drawing::{SvgOptions, svg};

    fn stroke() -> impl Strategy<Value = Stroke> {
        proptest::collection::vec((-0.099..0.099f64, -0.049..0.049f64), 1..12)
            .prop_map(|p| Stroke::new(p.into_iter().map(|(x, y)| Point2::new(x, y)).collect()))
    }

    proptest! {
        #[test]
        fn what_is_written_reads_back(
            layers in proptest::collection::vec((any::<[u8; 3]>(), "\\PC{1,12}", proptest::collection::vec(stroke(), 1..5)), 1..4),
        ) {
            let layers: Vec<InkLayer> = layers
                .into_iter()
                .map(|(c, name, strokes)| InkLayer { name, color: Rgb(c), width_hint: Some(0.4e-3), strokes })
                .collect();
            let drawing = Drawing::new(0.2, 0.1, layers);
            let options = SvgOptions { by_ink: false, paper: None, ..Default::default() };
            let text = write(&drawing);
            let read = svg::parse(text.as_bytes(), std::path::Path::new("a.svg"), &options).unwrap();
            prop_assert!(read.warnings.is_empty(), "{:?}", read.warnings);
            let read = read.drawing;
            prop_assert!((read.width - 0.2).abs() < 1e-8 && (read.height - 0.1).abs() < 1e-8);
            prop_assert_eq!(read.layers.len(), drawing.layers.len());
            for (a, b) in read.layers.iter().zip(&drawing.layers) {
                prop_assert_eq!(a.color, b.color);
                prop_assert!(b.name.trim().is_empty() || a.name == b.name.trim(), "{} {}", a.name, b.name);
                prop_assert!((a.width_hint.unwrap() - 0.4e-3).abs() < 1e-9);
                prop_assert_eq!(a.strokes.len(), b.strokes.len());
                for (s, t) in a.strokes.iter().zip(&b.strokes) {
                    prop_assert_eq!(s.points.len(), t.points.len());
                    for (p, q) in s.points.iter().zip(&t.points) {
                        prop_assert!((p - q).norm() < 2e-7, "{} {}", p, q);
                    }
                }
            }
        }
    }

    #[test]
    fn a_swelling_line_is_written_in_runs_without_gaps() {
        let points: Vec<_> = (0..=40).map(|i| Point2::new(1e-3 * f64::from(i), 0.0)).collect();
        let widths = (0..=40).map(|i| 5e-4 * (1.0 + 0.025 * f64::from(i))).collect();
        let layer = InkLayer {
            name: "a".into(),
            color: Rgb([0; 3]),
            width_hint: None,
            strokes: vec![Stroke { points, widths }],
        };
        let drawing = Drawing::new(0.2, 0.1, vec![layer]);
        let text = write(&drawing);
        let runs: Vec<&str> = text.lines().filter(|l| l.starts_with("<path stroke-width")).collect();
        assert!((8..=20).contains(&runs.len()), "{} runs from 0.5 to 1 mm", runs.len());
        let options = SvgOptions { by_ink: false, paper: None, ..Default::default() };
        let read = svg::parse(text.as_bytes(), std::path::Path::new("a.svg"), &options).unwrap().drawing;
        assert!((read.length() - 0.04).abs() < 1e-6, "{}", read.length());
    }

    #[test]
    fn the_document_is_in_millimetres_with_y_down() {
        let stroke = Stroke::new(vec![Point2::new(-0.01, 0.02), Point2::new(0.01, 0.02)]);
        let layer = InkLayer { name: "a<b".into(), color: Rgb([1, 2, 255]), width_hint: None, strokes: vec![stroke] };
        let text = write(&Drawing::new(0.04, 0.06, vec![layer]));
        assert!(text.contains("width=\"40mm\" height=\"60mm\" viewBox=\"0 0 40 60\""));
        assert!(text.contains("inkscape:label=\"a&lt;b\"") && text.contains("stroke=\"#0102ff\""));
        assert!(text.contains("<path d=\"M10 10L30 10\"/>"), "{text}");
    }
}
