//! What was really drawn, as an SVG file: one layer per ink, lines as wide as they came out.
use std::fmt::Write as _;

use crate::ink::optics::absorbance;
use crate::ink::{InkPoint, InkStroke, InkTrace};
use crate::math::{PAPER, Rgb, linear_from_srgb, srgb_from_linear};

/// A run goes on while width and density stay this near, relatively, to those it began with.
const EVEN: f64 = 0.05;
/// How far a simplified line may lie from the drawn one, mm.
const TOLERANCE_MM: f64 = 0.01;

/// The trace as an SVG document in mm, on a sheet of `width` x `height`, m.
///
/// Each ink is a group that Inkscape shows as a layer. A stroke is split into runs of nearly constant width and density (5 %);
/// a run is one path, simplified to 0.01 mm. A run whose density isn't 1 has a colour of its own, that of so much ink on
/// white [paper](PAPER); opacity would show a dot wherever two runs meet. Layers
/// are multiplied, so one ink darkens another. The text depends on the trace alone.
pub fn drawing_svg(trace: &InkTrace, width: f64, height: f64) -> String {
    let (width_mm, height_mm) = (Mm(width * 1e3), Mm(height * 1e3));
    let mut svg = format!(
        concat!(
            r#"<?xml version="1.0" encoding="UTF-8"?>"#,
            "\n",
            r#"<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape""#,
            r#" width="{w}mm" height="{h}mm" viewBox="0 0 {w} {h}">"#,
            "\n"
        ),
        w = width_mm,
        h = height_mm
    );
    for (index, ink) in trace.inks.iter().enumerate() {
        // Writing to a string can't fail.
        let _ = writeln!(
            svg,
            concat!(
                r#"<g id="ink-{index}" inkscape:groupmode="layer" inkscape:label="{name}" fill="none" "#,
                r#"stroke="{color}" stroke-linecap="round" stroke-linejoin="round" "#,
                r#"style="mix-blend-mode:multiply">"#
            ),
            index = index,
            name = escape(&ink.name),
            color = hex(ink.color)
        );
        for stroke in trace.strokes.iter().filter(|s| s.ink as usize == index) {
            write_stroke(&mut svg, stroke, ink.color, (width, height));
        }
        svg.push_str("</g>\n");
    }
    svg.push_str("</svg>\n");
    svg
}

fn write_stroke(svg: &mut String, stroke: &InkStroke, ink: Rgb, sheet: (f64, f64)) {
    let mut from = 0;
    while from < stroke.points.len() {
        let first = &stroke.points[from];
        let even = |p: &&InkPoint| {
            (p.width - first.width).abs() <= EVEN * first.width
                && (p.density - first.density).abs() <= EVEN * first.density
        };
        let last = from + stroke.points[from..].iter().take_while(even).count().max(1) - 1;
        // The point that breaks the run is its end as well, so that the line has no gap.
        let end = (last + 1).min(stroke.points.len() - 1);
        let even = &stroke.points[from..=last];
        let mean = |value: fn(&InkPoint) -> f64| even.iter().map(value).sum::<f64>() / even.len() as f64;
        let _ = write!(svg, r#"<path stroke-width="{}""#, Mm(mean(|p| p.width) * 1e3));
        let density = mean(|p| p.density);
        if (density - 1.0).abs() > EVEN {
            let _ = write!(svg, r#" stroke="{}""#, hex(shown(ink, density)));
        }
        write_line(svg, &stroke.points[from..=end], sheet);
        if end == last {
            break;
        }
        from = end;
    }
}

/// Writes where a path goes and closes it.
fn write_line(svg: &mut String, points: &[InkPoint], (width, height): (f64, f64)) {
    let place = |p: &InkPoint| [(p.sheet.x + width / 2.0) * 1e3, (height / 2.0 - p.sheet.y) * 1e3];
    let places: Vec<[f64; 2]> = points.iter().map(place).collect();
    let _ = write!(svg, r#" d="M{},{}"#, Mm(places[0][0]), Mm(places[0][1]));
    if places.len() == 1 {
        // A line of no length with round caps is a dot.
        svg.push_str("h0");
    }
    for [x, y] in simplified(&places) {
        let _ = write!(svg, " {},{}", Mm(*x), Mm(*y));
    }
    svg.push_str("\"/>\n");
}

/// The colour of an ink of some density on paper, by the law of Beer and Lambert.
fn shown(ink: Rgb, density: f64) -> Rgb {
    let a = absorbance(ink, PAPER);
    Rgb(std::array::from_fn(|k| srgb_from_linear(linear_from_srgb(PAPER.0[k]) * (-density * a[k]).exp())))
}

/// A colour as SVG writes it.
fn hex(Rgb([r, g, b]): Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The points after the first that a line within the tolerance needs (Ramer 1972, doi:10.1016/S0146-664X(72)80017-0).
fn simplified(points: &[[f64; 2]]) -> impl Iterator<Item = &[f64; 2]> {
    let mut kept = vec![false; points.len()];
    let mut spans = vec![(0, points.len() - 1)];
    while let Some((from, to)) = spans.pop() {
        kept[to] = true;
        let farthest = (from + 1..to)
            .map(|i| (distance(points[i], points[from], points[to]), i))
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        if let Some((_, i)) = farthest.filter(|(d, _)| *d > TOLERANCE_MM) {
            spans.extend([(from, i), (i, to)]);
        }
    }
    points.iter().zip(kept).skip(1).filter_map(|(p, kept)| kept.then_some(p))
}

/// Distance of a point from the piece of line between `a` and `b`.
fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (lx, ly, dx, dy) = (b[0] - a[0], b[1] - a[1], p[0] - a[0], p[1] - a[1]);
    let squared = lx * lx + ly * ly;
    let t = if squared > 0.0 { ((dx * lx + dy * ly) / squared).clamp(0.0, 1.0) } else { 0.0 };
    (dx - t * lx).hypot(dy - t * ly)
}

/// A length in mm, written to a micrometre without idle zeros.
struct Mm(f64);

impl std::fmt::Display for Mm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = format!("{:.3}", self.0);
        let text = text.trim_end_matches('0').trim_end_matches('.');
        f.write_str(if text == "-0" { "0" } else { text })
    }
}

/// Text for an XML attribute; characters that XML forbids become spaces.
fn escape(text: &str) -> String {
    text.chars().fold(String::new(), |mut out, c| {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
        out
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ink::TraceInk;
    use nalgebra::{Point2, Point3, Vector3};
    use proptest::prelude::*;

    fn point(x: f64, y: f64, width: f64) -> InkPoint {
        InkPoint {
            position: Point3::new(x, y, 0.0),
            normal: Vector3::z(),
            sheet: Point2::new(x, y),
            width,
            density: 1.0,
            time: 0.0,
        }
    }

    fn trace(points: Vec<InkPoint>) -> InkTrace {
        let ink = |name: &str, color| TraceInk { name: name.to_string(), color };
        let inks = vec![ink("black", Rgb([0, 0, 0])), ink("sea & <sky>", Rgb([0, 119, 204]))];
        InkTrace { inks, strokes: vec![InkStroke { ink: 1, stroke: None, arm: 0, points }] }
    }

    fn paths(svg: &str) -> Vec<&str> {
        svg.lines().filter(|l| l.starts_with("<path")).collect()
    }

    #[test]
    fn each_ink_is_a_layer_and_its_name_is_escaped() {
        let svg = drawing_svg(&trace(vec![point(0.0, 0.0, 8e-4), point(0.01, 0.02, 8e-4)]), 0.1, 0.06);
        assert!(svg.contains(r#"width="100mm" height="60mm" viewBox="0 0 100 60""#));
        assert!(svg.contains(r##"inkscape:label="sea &amp; &lt;sky&gt;" fill="none" stroke="#0077cc""##));
        assert_eq!(paths(&svg), [r#"<path stroke-width="0.8" d="M50,30 60,10"/>"#]);
        let count = |piece| svg.matches(piece).count();
        assert_eq!((count("<g "), count("</g>"), count("<"), count(">")), (2, 2, 8, 8), "every tag is closed");
    }

    #[test]
    fn a_swelling_line_is_split_into_runs_without_gaps() {
        let points = (0..=1000).map(|i| f64::from(i) * 1e-5).map(|x| point(x, 0.0, 4e-4 + 0.05 * x)).collect();
        let svg = drawing_svg(&trace(points), 0.1, 0.1);
        let runs = paths(&svg);
        assert!((15..=18).contains(&runs.len()), "{} runs from 0.4 mm to 0.9 mm", runs.len());
        let ends = |p: &str| {
            let d = p.split("d=\"M").nth(1).unwrap().trim_end_matches("\"/>");
            let mut places = d.split(' ');
            (places.next().unwrap().to_string(), places.next_back().unwrap().to_string())
        };
        for pair in runs.windows(2) {
            assert_eq!(ends(pair[0]).1, ends(pair[1]).0);
        }
    }

    #[test]
    fn a_faded_run_is_lighter_and_the_nominal_one_bears_its_layers_colour() {
        let mut points: Vec<InkPoint> = (0..20).map(|i| point(f64::from(i) * 1e-3, 0.0, 8e-4)).collect();
        points[10..].iter_mut().for_each(|p| p.density = 0.5);
        let svg = drawing_svg(&trace(points), 0.1, 0.1);
        let [full, faded] = paths(&svg)[..] else { panic!("{svg}") };
        assert!(!full.contains(" stroke=\""), "{full}");
        assert!(faded.contains(&format!(r#" stroke="{}""#, hex(shown(Rgb([0, 119, 204]), 0.5)))), "{faded}");
        assert_eq!((shown(Rgb([0, 119, 204]), 1.0), shown(Rgb([0, 119, 204]), 0.0)), (Rgb([0, 119, 204]), PAPER));
    }

    #[test]
    fn a_dot_is_a_path_of_no_length() {
        let svg = drawing_svg(&trace(vec![point(0.0, 0.0, 1e-3)]), 0.1, 0.1);
        assert_eq!(paths(&svg), [r#"<path stroke-width="1" d="M50,50h0"/>"#]);
    }

    proptest! {
        #[test]
        fn a_simplified_line_stays_within_its_tolerance(seed in proptest::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 2..40)) {
            let points: Vec<[f64; 2]> = seed.iter().map(|(x, y)| [*x, 0.02 * y]).collect();
            let mut line = vec![points[0]];
            line.extend(simplified(&points));
            prop_assert_eq!(line[line.len() - 1], points[points.len() - 1]);
            for p in &points {
                let off = line.windows(2).map(|w| distance(*p, w[0], w[1])).fold(f64::INFINITY, f64::min);
                prop_assert!(off <= TOLERANCE_MM * (1.0 + 1e-9));
            }
        }
    }
}
