//! Names of SVG: elements, the lengths that they hold, and what becomes of what isn't drawn.
use usvg::roxmltree::Node;

use super::svg_value::Axis;

/// Shapes that can have a stroke.
pub(super) const SHAPES: [&str; 7] = ["path", "rect", "circle", "ellipse", "line", "polyline", "polygon"];

/// Elements that usvg is to see, and the text that it isn't.
pub(super) const ELEMENTS: [&str; 22] = [
    "svg",
    "g",
    "a",
    "defs",
    "symbol",
    "use",
    "switch",
    "path",
    "rect",
    "circle",
    "ellipse",
    "line",
    "polyline",
    "polygon",
    "clipPath",
    "mask",
    "pattern",
    "marker",
    "linearGradient",
    "radialGradient",
    "stop",
    "text",
];

/// Attributes that decide what is drawn.
pub(super) const VITAL: [&str; 24] = [
    "stroke",
    "fill",
    "points",
    "width",
    "height",
    "transform",
    "stroke-width",
    "stroke-dasharray",
    "stroke-opacity",
    "fill-opacity",
    "opacity",
    "display",
    "visibility",
    "viewBox",
    "href",
    "clip-path",
    "fill-rule",
    "stroke-linecap",
    "stroke-linejoin",
    "stroke-dashoffset",
    "filter",
    "offset",
    "marker-start",
    "marker-end",
];

/// Elements that are passed over, with what to say of it where it would be seen.
const SKIPPED: [(&str, &str); 39] = [
    ("text", "not drawn; convert it to paths"),
    ("flowRoot", "not drawn; convert the text to paths"),
    ("image", "not drawn; trace it, or draw it as a picture"),
    ("foreignObject", "not drawn"),
    ("animate", "drawn as it starts"),
    ("animateTransform", "drawn as it starts"),
    ("animateMotion", "drawn as it starts"),
    ("animateColor", "drawn as it starts"),
    ("set", "drawn as it starts"),
    ("video", "not drawn"),
    ("audio", ""),
    ("canvas", "not drawn"),
    ("iframe", "not drawn"),
    ("mesh", "not drawn"),
    ("meshgradient", ""),
    ("meshGradient", ""),
    ("hatch", ""),
    ("solidColor", ""),
    ("style", ""),
    ("script", ""),
    ("title", ""),
    ("desc", ""),
    ("metadata", ""),
    ("filter", ""),
    ("font", ""),
    ("font-face", ""),
    ("glyph", ""),
    ("missing-glyph", ""),
    ("hkern", ""),
    ("vkern", ""),
    ("cursor", ""),
    ("view", ""),
    ("mpath", ""),
    ("color-profile", ""),
    ("discard", ""),
    ("link", ""),
    ("tspan", ""),
    ("textPath", ""),
    ("tref", ""),
];

/// Whether an element of this name is passed over.
pub(super) fn skipped(name: &str) -> bool {
    SKIPPED.iter().any(|(n, _)| *n == name)
}

/// What to say of one that is; nothing where no viewer shows it.
pub(super) fn advice(name: &str) -> Option<&'static str> {
    SKIPPED.iter().find(|(n, _)| *n == name).map(|(_, advice)| *advice).filter(|a| !a.is_empty())
}

/// How it is called in messages.
pub(super) fn title(name: &str) -> &str {
    match name {
        "animate" | "animateTransform" | "animateMotion" | "animateColor" | "set" => "animation",
        "flowRoot" => "flowRoot (text)",
        name => name,
    }
}

/// Whether usvg is to see elements of this name.
pub(super) fn known(name: &str) -> bool {
    ELEMENTS.contains(&name)
}

/// Whether an element can hold or be something seen.
pub(super) fn draws(node: &Node) -> bool {
    matches!(node.tag_name().namespace(), None | Some(super::svg_survey::SVG))
        && matches!(node.tag_name().name(), "svg" | "g" | "a" | "use" | "switch" | "text" | "image")
        || SHAPES.contains(&node.tag_name().name())
}

/// Whether a property of CSS becomes an attribute.
pub(super) fn styled(name: &str) -> bool {
    !matches!(name, "id" | "href" | "points" | "x1" | "x2" | "y1" | "y2" | "offset" | "class" | "style")
        && name.bytes().all(|b| b.is_ascii_lowercase() || b == b'-')
        && !name.starts_with('-')
}

/// The lengths of an element, with the side that percentages are of.
pub(super) fn lengths(element: &str) -> &'static [(&'static str, Axis)] {
    use Axis::{Diagonal, X, Y};
    const WIDTH: (&str, Axis) = ("stroke-width", Diagonal);
    const OFFSET: (&str, Axis) = ("stroke-dashoffset", Diagonal);
    match element {
        "rect" => &[("x", X), ("y", Y), ("width", X), ("height", Y), ("rx", X), ("ry", Y), WIDTH, OFFSET],
        "circle" => &[("cx", X), ("cy", Y), ("r", Diagonal), WIDTH, OFFSET],
        "ellipse" => &[("cx", X), ("cy", Y), ("rx", X), ("ry", Y), WIDTH, OFFSET],
        "line" => &[("x1", X), ("y1", Y), ("x2", X), ("y2", Y), WIDTH, OFFSET],
        "svg" | "use" | "symbol" => &[("x", X), ("y", Y), ("width", X), ("height", Y), WIDTH, OFFSET],
        _ => &[WIDTH, OFFSET],
    }
}

/// The known name that a name is nearest to, within two letters and a third of them.
pub(super) fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let distance = |k: &str| if k.eq_ignore_ascii_case(name) { 0 } else { edits(name, k) };
    let (near, off) = known.map(|k| (k, distance(k))).min_by_key(|(_, d)| *d)?;
    (off <= 2 && 3 * off <= name.chars().count()).then_some(near)
}

/// The vital attribute that was meant by one of an almost equal name.
pub(super) fn misspelt(name: &str) -> Option<&'static str> {
    const OTHERS: [&str; 8] = ["file", "weight", "till", "stokes", "point", "heights", "widths", "offsets"];
    let lower = name.to_ascii_lowercase();
    if name.len() < 4 || OTHERS.contains(&name) {
        return None;
    }
    VITAL
        .into_iter()
        .find(|v| name != *v && (lower == v.to_ascii_lowercase() || edits(&lower, v) == 1 || swapped(&lower, v)))
}

fn swapped(a: &str, b: &str) -> bool {
    let off: Vec<usize> = a.bytes().zip(b.bytes()).enumerate().filter(|(_, (a, b))| a != b).map(|(i, _)| i).collect();
    a.len() == b.len()
        && matches!(off[..], [i, j] if j == i + 1 && a.as_bytes()[i] == b.as_bytes()[j] && a.as_bytes()[j] == b.as_bytes()[i])
}

/// Letters put in, left out or changed.
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, c) in a.chars().take(40).enumerate() {
        let mut corner = i;
        row[0] = i + 1;
        for (j, d) in b.iter().enumerate() {
            let best = (corner + usize::from(c != *d)).min(row[j] + 1).min(row[j + 1] + 1);
            corner = std::mem::replace(&mut row[j + 1], best);
        }
    }
    row[b.len()]
}
