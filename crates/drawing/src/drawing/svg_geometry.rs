//! Geometry of an SVG's elements as usvg reads it: lengths, view boxes, symbols, transforms, dashes.
use usvg::roxmltree::Node;

use super::svg_css::{short, split_outside};
use super::svg_names;
use super::svg_rewrite::{Attributes, Context, Rewriter, join};
use super::svg_shape::{shape_path, view_box};
use super::svg_survey::is_svg;
use super::svg_value::{self as value, Axis};

/// Width of a stroke of no width, user units: a hairline, which cutters are told so.
const HAIRLINE: &str = "0.0001";

impl<'d> Rewriter<'d> {
    /// Geometry: lengths, transforms, view boxes, symbols, dashes.
    pub(super) fn finish(
        &mut self,
        node: Node<'d, 'd>,
        name: &str,
        all: &mut Attributes,
        context: &mut Context,
        line: usize,
    ) {
        let told = context.seen();
        let root = node.id() == self.doc.root_element().id();
        self.lengths(name, all, context, root, line);
        match name {
            "svg" | "symbol" | "marker" | "pattern" => self.view(name, all, context, root, line),
            "use" => self.reference(all, context, told, line),
            "linearGradient" | "radialGradient" => level(all, name),
            "path" => {
                if let Some(d) = all.get("d").cloned() {
                    self.path_data(&d, all, context, line);
                }
            }
            "polyline" | "polygon" => {
                let text = all.get("points").map_or("", String::as_str);
                let vertices = svgtypes::PointsParser::from(text).count();
                let numbers = text.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()).count();
                if told && numbers % 2 == 1 && numbers > 2 * vertices {
                    self.tally.add("broken list of points", "drawn up to the error", line);
                }
            }
            _ => {}
        }
        let missing = match name {
            "rect" if !all.contains_key("width") || !all.contains_key("height") => true,
            "circle" => !all.contains_key("r"),
            _ => false,
        };
        if missing && told && !context.defined {
            self.tally.add(&format!("{name} without a size"), "not drawn", line);
        }
        self.transform(name, all, context, line);
        if svg_names::SHAPES.contains(&name) {
            self.stroke(name, all, context, line);
        }
        if let Some(told) = context.far.shift(name, all, &node) {
            self.tally.add(told.0, told.1, line);
        }
    }

    fn path_data(&mut self, d: &str, all: &mut Attributes, context: &Context, line: usize) {
        let text = d.trim();
        let css = text.strip_prefix("path(").and_then(|p| p.strip_suffix(')'));
        let text = css.map_or(text, |p| p.trim().trim_matches(['"', '\'']));
        if text.eq_ignore_ascii_case("none") {
            all.remove("d");
            return;
        }
        if css.is_some() {
            all.insert("d".into(), text.to_string());
        }
        if context.seen() && svgtypes::PathParser::from(text).any(|s| s.is_err()) {
            self.tally.add("broken path data", "drawn up to the error", line);
        }
    }

    /// Lengths in a spelling that usvg reads.
    fn lengths(&mut self, name: &str, all: &mut Attributes, context: &Context, root: bool, line: usize) {
        for (attribute, axis) in svg_names::lengths(name) {
            let Some(text) = all.get(*attribute).cloned() else { continue };
            let trimmed = text.trim();
            if trimmed.parse::<svgtypes::Length>().is_ok()
                && !trimmed.bytes().any(|b| b.is_ascii_uppercase() && b != b'E')
            {
                if trimmed.len() != text.len() {
                    all.insert((*attribute).into(), trimmed.to_string());
                }
                continue;
            }
            if matches!(trimmed, "auto" | "inherit" | "initial" | "none" | "") {
                all.remove(*attribute);
                continue;
            }
            let told = context.seen();
            if let Some(px) = context.scale.length(trimmed, *axis) {
                all.insert((*attribute).into(), px.to_string());
            } else if let Some(px) = value::decimal_comma(trimmed).and_then(|t| context.scale.length(&t, *axis)) {
                if told {
                    let what = format!("{attribute} `{}`", short(trimmed));
                    self.tally.add(&what, "read as a number with a decimal comma; SVG writes a point", line);
                }
                all.insert((*attribute).into(), px.to_string());
            } else {
                if told {
                    let what = if root {
                        format!("size of the page, {attribute} `{}`", short(trimmed))
                    } else {
                        format!("length {attribute} `{}`", short(trimmed))
                    };
                    self.tally.add(&what, "its number or unit isn't understood, doesn't count", line);
                }
                all.remove(*attribute);
            }
        }
        if let Some(dashes) = all.get("stroke-dasharray").filter(|d| *d != "none" && *d != "inherit").cloned() {
            let words: Vec<&str> = dashes.split([',', ' ', '\n', '\t']).filter(|w| !w.is_empty()).collect();
            if words.iter().all(|w| w.parse::<svgtypes::Length>().is_ok()) {
                return;
            }
            let parts = split_outside(&dashes, ',');
            let parts = parts.iter().flat_map(|p| split_outside(p.trim(), ' ')).filter(|w| !w.is_empty());
            match parts.map(|w| context.scale.length(w, Axis::Diagonal)).collect::<Option<Vec<_>>>() {
                Some(px) => drop(all.insert("stroke-dasharray".into(), join(&px))),
                None => {
                    if context.seen() {
                        self.tally.add(&format!("dashes `{}`", short(&dashes)), "not understood, drawn solid", line);
                    }
                    all.remove("stroke-dasharray");
                }
            }
        }
    }

    fn view(&mut self, name: &str, all: &mut Attributes, context: &mut Context, root: bool, line: usize) {
        if let Some(text) = all.get("viewBox").cloned() {
            match view_box(&text, &context.scale) {
                Some((corner_size, plain)) => {
                    context.scale.viewport = (corner_size[2], corner_size[3]);
                    if !plain {
                        all.insert("viewBox".into(), join(&corner_size));
                    }
                }
                None => {
                    if context.seen() {
                        self.tally.add(
                            &format!("viewBox `{}`", short(&text)),
                            "not four numbers of a size, doesn't count",
                            line,
                        );
                    }
                    all.remove("viewBox");
                }
            }
        } else if name == "svg" && !root {
            let side = |n: &str, axis, full| all.get(n).and_then(|v| context.scale.length(v, axis)).unwrap_or(full);
            let (w, h) = context.scale.viewport;
            context.scale.viewport = (side("width", Axis::X, w), side("height", Axis::Y, h));
        }
        if name == "symbol" && (all.contains_key("refX") || all.contains_key("refY")) {
            self.tally.add("symbol with refX or refY", "these don't count", line);
        }
    }

    /// A `use` takes over place and size of the symbol that it shows.
    fn reference(&mut self, all: &mut Attributes, context: &Context, told: bool, line: usize) {
        let link = all.get("href").map(|h| h.trim().to_string()).unwrap_or_default();
        let target = link.strip_prefix('#').and_then(|id| self.ids.get(id)).and_then(|id| self.doc.get_node(*id));
        let Some(target) = target else {
            if told && !context.defined {
                self.tally.add("use", "not drawn; it refers to nothing in this file", line);
            }
            return;
        };
        all.insert("href".into(), link);
        if !is_svg(&target, "symbol") {
            return;
        }
        for (name, axis) in [("x", Axis::X), ("y", Axis::Y)] {
            let own = target.attribute(name).and_then(|v| context.scale.length(v, axis)).unwrap_or(0.0);
            if own != 0.0 {
                let at = all.get(name).and_then(|v| context.scale.length(v, axis)).unwrap_or(0.0);
                all.insert(name.into(), (at + own).to_string());
            }
        }
        for name in ["width", "height"] {
            if let Some(size) = target.attribute(name).filter(|_| !all.contains_key(name))
                && let Some(px) = context.scale.length(size, if name == "width" { Axis::X } else { Axis::Y })
            {
                all.insert(name.into(), px.to_string());
            }
        }
    }

    fn transform(&mut self, name: &str, all: &mut Attributes, context: &mut Context, line: usize) {
        let css = all.remove("transform-css").is_some();
        let extra: Vec<(&str, Option<String>)> =
            ["translate", "rotate", "scale"].into_iter().map(|n| (n, all.remove(n))).collect();
        let (origin, about) = (all.remove("transform-origin"), all.remove("transform-box"));
        let text = all.get("transform").cloned();
        let plain = text.as_deref().is_none_or(|t| t.parse::<svgtypes::Transform>().is_ok());
        let moved = extra.iter().any(|(_, v)| v.is_some());
        if plain && !moved && (origin.is_none() || text.is_none()) && !(css && about.is_some()) {
            return;
        }
        let view = context.scale.viewport;
        let (corner, size) = match about.as_deref() {
            Some("fill-box" | "content-box" | "stroke-box") => match shape_path(name, all, &context.scale) {
                Some(path) => {
                    let b = kurbo::Shape::bounding_box(&path);
                    ((b.x0, b.y0), (b.width(), b.height()))
                }
                None => {
                    if context.seen() {
                        self.tally.add(
                            "transform-box of a group",
                            "not supported, turned about the page's corner",
                            line,
                        );
                    }
                    ((0.0, 0.0), view)
                }
            },
            _ => ((0.0, 0.0), view),
        };
        let mut list = String::new();
        for (function, v) in &extra {
            if let Some(v) = v.as_deref().filter(|v| *v != "none") {
                list += &format!("{function}({}) ", v.split_whitespace().collect::<Vec<_>>().join(","));
            }
        }
        list += text.as_deref().unwrap_or("");
        let origin = origin.map_or(Some((0.0, 0.0)), |o| value::origin(&o, &context.scale, size));
        match (value::transform(&list, &context.scale, size), origin) {
            (Some(map), Some((x, y))) => {
                let about = kurbo::Affine::translate((corner.0 + x, corner.1 + y));
                let about = if about == kurbo::Affine::translate(corner) && corner == (0.0, 0.0) {
                    kurbo::Affine::IDENTITY
                } else {
                    about
                };
                let m = about * map * about.inverse();
                all.insert("transform".into(), format!("matrix({})", join(&m.as_coeffs())));
            }
            _ => {
                if context.seen() {
                    self.tally.add(&format!("broken transform `{}`", short(&list)), "ignored", line);
                }
                all.remove("transform");
            }
        }
    }

    /// Hairlines and dashes by `pathLength`.
    fn stroke(&mut self, name: &str, all: &mut Attributes, context: &Context, line: usize) {
        let value_of = |n: &str| context.inherited.get(n).map_or("", String::as_str);
        let none = |v: &str| v.is_empty() || v == "none";
        if none(value_of("stroke")) {
            return;
        }
        let zero = context.scale.length(value_of("stroke-width"), Axis::Diagonal) == Some(0.0);
        if zero && value_of("fill") == "none" && context.seen() {
            all.insert("stroke-width".into(), HAIRLINE.into());
            self.tally.add("stroke of no width", "drawn as a hairline", line);
        }
        let dashes = value_of("stroke-dasharray");
        let Some(wanted) = all.get("pathLength").and_then(|p| value::number(p)).map(|p| p.0).filter(|p| *p > 0.0)
        else {
            return;
        };
        if none(dashes) {
            return;
        }
        let number = |w: &str| context.scale.length(w, Axis::Diagonal);
        let numbers: Option<Vec<f64>> = dashes.split([',', ' ']).filter(|w| !w.is_empty()).map(number).collect();
        let length = shape_path(name, all, &context.scale)
            .map(|p| p.segments().map(|s| kurbo::ParamCurveArclen::arclen(&s, 1e-6)).sum::<f64>());
        match (numbers, length) {
            (Some(numbers), Some(length)) if length > 0.0 => {
                let scale = length / wanted;
                let scaled: Vec<f64> = numbers.iter().map(|n| n * scale).collect();
                all.insert("stroke-dasharray".into(), join(&scaled));
                if let Some(offset) = number(value_of("stroke-dashoffset")) {
                    all.insert("stroke-dashoffset".into(), (offset * scale).to_string());
                }
            }
            _ => self.tally.add("pathLength", "not honoured, dashes keep the lengths as written", line),
        }
    }
}

/// A gradient is drawn in its mean colour: its place doesn't matter, and flat lines have no box to measure it by.
fn level(all: &mut Attributes, name: &str) {
    all.retain(|n, _| matches!(n.as_str(), "id" | "href"));
    all.insert("gradientUnits".into(), "userSpaceOnUse".into());
    let place: &[(&str, &str)] = match name {
        "linearGradient" => &[("x1", "0"), ("y1", "0"), ("x2", "1"), ("y2", "0")],
        _ => &[("cx", "0"), ("cy", "0"), ("r", "1")],
    };
    place.iter().for_each(|(n, v)| drop(all.insert((*n).into(), (*v).into())));
}
