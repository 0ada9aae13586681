//! Shapes and view boxes of an SVG in double precision, before usvg rounds them; and coordinates far from the page,
//! which it would fold onto each other.
use kurbo::{Affine, BezPath, Point, Shape};
use usvg::roxmltree::Node;

use super::svg_rewrite::{Attributes, join};
use super::svg_value::{self as value, Axis, Scale};

/// Steps of single precision at the page's corner, as a share of its larger side, above which coordinates are moved.
const COARSE: f64 = 2e-5;
/// Accuracy of a curve that stands for a circle, user units.
const ACCURACY: f64 = 1e-6;

/// Numbers of a view box, and whether they stand there as SVG wants them; `None` where there are no four, or no size.
pub(super) fn view_box(text: &str, scale: &Scale) -> Option<([f64; 4], bool)> {
    if let Ok(v) = text.parse::<svgtypes::ViewBox>() {
        return Some(([v.x, v.y, v.w, v.h], true));
    }
    let words: Vec<&str> = text.split([',', ' ', '\n', '\t']).filter(|w| !w.is_empty()).collect();
    let plain = |w: &&str| {
        let (number, unit) = value::number(w)?;
        scale.length(&format!("1{unit}"), Axis::X).map(|_| number)
    };
    // The unit that all share is that of the drawing: its numbers count.
    let all: Vec<f64> = words.iter().filter_map(plain).collect();
    match all[..] {
        [x, y, w, h] if words.len() == 4 && w > 0.0 && h > 0.0 => Some(([x, y, w, h], false)),
        _ => None,
    }
}

/// Size of the page in user units.
pub(super) fn page_size(root: &Node, scale: &Scale) -> (f64, f64) {
    if let Some(([_, _, w, h], _)) = root.attribute("viewBox").and_then(|v| view_box(v, scale)) {
        return (w, h);
    }
    let side = |n, axis| root.attribute(n).and_then(|v| scale.length(v, axis)).filter(|s| *s > 0.0).unwrap_or(100.0);
    (side("width", Axis::X), side("height", Axis::Y))
}

/// A shape's outline in user units; `None` for what has none.
pub(super) fn shape_path(name: &str, all: &Attributes, scale: &Scale) -> Option<BezPath> {
    let get = |n: &str, axis| all.get(n).and_then(|v| scale.length(v, axis));
    let x = |n: &str| get(n, Axis::X).unwrap_or(0.0);
    let y = |n: &str| get(n, Axis::Y).unwrap_or(0.0);
    Some(match name {
        "path" => BezPath::from_svg(all.get("d")?).ok()?,
        "line" => {
            [Point::new(x("x1"), y("y1")), Point::new(x("x2"), y("y2"))].windows(2).fold(BezPath::new(), |mut p, w| {
                p.move_to(w[0]);
                p.line_to(w[1]);
                p
            })
        }
        "rect" => {
            let (rx, ry) = (get("rx", Axis::X), get("ry", Axis::Y));
            if rx.or(ry).unwrap_or(0.0) > 0.0 {
                return None;
            }
            kurbo::Rect::new(x("x"), y("y"), x("x") + x("width"), y("y") + y("height")).to_path(ACCURACY)
        }
        "circle" => kurbo::Circle::new((x("cx"), y("cy")), get("r", Axis::Diagonal)?).to_path(ACCURACY),
        "ellipse" => kurbo::Ellipse::new((x("cx"), y("cy")), (x("rx"), y("ry")), 0.0).to_path(ACCURACY),
        "polyline" | "polygon" => {
            let mut path = BezPath::new();
            for (i, (x, y)) in svgtypes::PointsParser::from(all.get("points")?.as_str()).enumerate() {
                if i == 0 { path.move_to((x, y)) } else { path.line_to((x, y)) }
            }
            if name == "polygon" && !path.is_empty() {
                path.close_path();
            }
            path
        }
        _ => return None,
    })
}

/// What is told of what can't be moved.
const TOLD: (&str, &str) = (
    "element with coordinates far from the page",
    "too large to be read exactly, its place is rounded; move the drawing to the origin",
);

/// How coordinates far from the page are moved to it: what is taken from those of the present element.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Far {
    on: bool,
    by: (f64, f64),
}

impl Far {
    /// Whether a document needs it.
    pub(super) fn of(root: &Node, page: (f64, f64)) -> Self {
        let limit = COARSE * page.0.max(page.1) / f64::from(f32::EPSILON);
        let view = root.attribute("viewBox").and_then(|v| v.parse::<svgtypes::ViewBox>().ok());
        let far_view = view.is_some_and(|v| v.x.abs().max(v.y.abs()) > limit);
        let far_move = root.descendants().filter_map(|n| n.attribute("transform")).any(|t| {
            t.parse::<svgtypes::Transform>()
                .is_ok_and(|t| t.e.abs().max(t.f.abs()) > limit * t.a.abs().max(t.b.abs()).max(1e-9))
        });
        Far { on: far_view || far_move, by: (0.0, 0.0) }
    }

    /// Moves one element's own coordinates and hands the rest on; what to tell where that can't be.
    pub(super) fn shift(
        &mut self,
        name: &str,
        all: &mut Attributes,
        node: &Node,
    ) -> Option<(&'static str, &'static str)> {
        if !self.on {
            return None;
        }
        let root = node.parent().is_some_and(|p| p.is_root());
        if root {
            if let Some(v) = all.get("viewBox").and_then(|v| v.parse::<svgtypes::ViewBox>().ok()) {
                self.by = (v.x, v.y);
                all.insert("viewBox".into(), join(&[0.0, 0.0, v.w, v.h]));
            }
            return None;
        }
        if let "use" | "svg" | "clipPath" | "mask" | "pattern" | "symbol" | "marker" | "defs" = name {
            if name == "use" || name == "svg" {
                self.place(all);
                self.on = false;
                return Some(TOLD);
            }
            *self = Far::default();
            return None;
        }
        if all.contains_key("clip-path") {
            self.place(all);
            self.on = false;
            return Some(TOLD);
        }
        if let Some(text) = all.get("transform") {
            let Ok(t) = text.parse::<svgtypes::Transform>() else { return Some(TOLD) };
            let linear = Affine::new([t.a, t.b, t.c, t.d, 0.0, 0.0]);
            if linear.determinant().abs() < 1e-12 {
                return Some(TOLD);
            }
            let by = linear.inverse() * Point::new(self.by.0 - t.e, self.by.1 - t.f);
            self.by = (by.x, by.y);
            all.insert("transform".into(), format!("matrix({})", join(&linear.as_coeffs())));
        }
        self.coordinates(name, all)
    }

    /// Moves an element as a whole, in front of its own transform.
    fn place(&self, all: &mut Attributes) {
        let own = all.get("transform").cloned().unwrap_or_default();
        all.insert("transform".into(), format!("translate({}) {own}", join(&[-self.by.0, -self.by.1])));
    }

    fn coordinates(&self, name: &str, all: &mut Attributes) -> Option<(&'static str, &'static str)> {
        let (dx, dy) = self.by;
        let pairs: &[(&str, f64)] = match name {
            "rect" => &[("x", dx), ("y", dy)],
            "circle" | "ellipse" => &[("cx", dx), ("cy", dy)],
            "line" => &[("x1", dx), ("y1", dy), ("x2", dx), ("y2", dy)],
            "polyline" | "polygon" => {
                if let Some(text) = all.get("points") {
                    let points = svgtypes::PointsParser::from(text.as_str());
                    let moved: Vec<String> = points.map(|(x, y)| join(&[x - dx, y - dy])).collect();
                    all.insert("points".into(), moved.join(" "));
                }
                return None;
            }
            "path" => {
                let Ok(mut path) = BezPath::from_svg(all.get("d")?) else {
                    let own = all.get("transform").cloned().unwrap_or_default();
                    all.insert("transform".into(), format!("{own} translate({})", join(&[-dx, -dy])));
                    return Some(TOLD);
                };
                path.apply_affine(Affine::translate((-dx, -dy)));
                all.insert("d".into(), path.to_svg());
                return None;
            }
            _ => return None,
        };
        for (name, by) in pairs {
            let old = all
                .get(*name)
                .map_or(Some(0.0), |v| value::number(v).filter(|(_, unit)| matches!(*unit, "" | "px")).map(|n| n.0));
            let Some(old) = old else {
                return Some(("element with coordinates far from the page", "in units, not moved to it"));
            };
            all.insert((*name).into(), (old - by).to_string());
        }
        None
    }
}
