//! Where a base stands before a wall, from above, as figure 7.3 of the dissertation shows it.
use std::fmt::Write as _;

use nalgebra::{Point2, Vector2};

use crate::plan::cover::{BasePose, Coverage};
use crate::surface::Wall;

use super::figure::Figure;
use super::html::escape;
use super::plot::{WIDTH, series_color};

/// Room round the plan, px.
const MARGIN: f64 = 30.0;
/// Distance between what neighbours reach and the wall, m, so that overlaps show.
const BESIDE: f64 = 0.035;

/// What is shown.
pub struct CoverSketch<'a> {
    /// Name of the drawing.
    pub title: &'a str,
    /// Places and what they reach.
    pub coverage: &'a Coverage,
    /// The wall.
    pub wall: &'a Wall,
    /// Outlines of what stands on the floor, m.
    pub obstacles: Vec<Vec<Point2<f64>>>,
    /// Length and width of the base, m.
    pub footprint: [f64; 2],
    /// Where the arm's first axis stands on it, m.
    pub mount: [f64; 2],
    /// Radius, offset and radius of the base of circles, m, where they are used.
    pub circle: Option<[f64; 3]>,
}

/// The way in, and those between places.
fn ways(coverage: &Coverage) -> impl Iterator<Item = &Vec<BasePose>> {
    std::iter::once(&coverage.way_in).filter(|w| !w.is_empty()).chain(&coverage.drives)
}

/// The plane of the picture: the wall's left end at the left, the artist below.
struct Sight {
    right: Vector2<f64>,
    front: Vector2<f64>,
    low: [f64; 2],
    scale: f64,
}

impl Sight {
    fn of(sketch: &CoverSketch) -> (Self, f64) {
        let points = sketch.wall.profile.points();
        let chord = points[points.len() - 1] - points[0];
        let right = chord.try_normalize(1e-9).unwrap_or_else(Vector2::x);
        let front = Vector2::new(right.y, -right.x);
        let mut all: Vec<Point2<f64>> = points.to_vec();
        let reach = 0.5 * sketch.footprint[0].hypot(sketch.footprint[1]);
        let poses = sketch.coverage.places.iter().map(|p| p.pose).chain(ways(sketch.coverage).flatten().copied());
        for p in poses {
            all.extend([right, front].iter().flat_map(|d| [p.center() + d * reach, p.center() - d * reach]));
        }
        all.extend(sketch.obstacles.iter().flatten());
        let bound = |d: &Vector2<f64>| {
            let along = all.iter().map(|p| p.coords.dot(d));
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |b, x| (b.0.min(x), b.1.max(x)))
        };
        let ((x0, x1), (y0, y1)) = (bound(&right), bound(&front));
        let scale = (WIDTH - 2.0 * MARGIN) / (x1 - x0).max(0.1);
        let height = Figure::HEAD + 2.0 * MARGIN + (y1 - y0 + 0.15) * scale;
        (Self { right, front, low: [x0, y0 - 0.15], scale }, height)
    }

    fn at(&self, p: &Point2<f64>) -> (f64, f64) {
        let x = MARGIN + (p.coords.dot(&self.right) - self.low[0]) * self.scale;
        (x, Figure::HEAD + MARGIN + (p.coords.dot(&self.front) - self.low[1]) * self.scale)
    }

    fn path(&self, points: impl IntoIterator<Item = Point2<f64>>) -> String {
        let mut path = String::new();
        for (k, p) in points.into_iter().enumerate() {
            let (x, y) = self.at(&p);
            let _ = write!(path, "{}{x:.1} {y:.1}", if k == 0 { "M" } else { "L" });
        }
        path
    }
}

/// The plan from above as SVG that needs nothing else.
pub fn cover_svg(sketch: &CoverSketch) -> String {
    let (sight, height) = Sight::of(sketch);
    let mut body = String::new();
    for outline in &sketch.obstacles {
        let path = sight.path(outline.iter().copied());
        let _ = writeln!(body, r##"<path d="{path}Z" fill="#d9d5ca" stroke="#a8a294"/>"##);
    }
    for [a, b] in sketch.wall.barriers() {
        let path = sight.path([a, b]);
        let _ = writeln!(
            body,
            r##"<path d="{path}" fill="none" stroke="#4a4a4a" stroke-width="3" stroke-linecap="round"/>"##
        );
    }
    for way in ways(sketch.coverage) {
        let path = sight.path(way.iter().map(BasePose::center));
        let _ = writeln!(
            body,
            r##"<path d="{path}" fill="none" stroke="#8a8a8a" stroke-width="1.5" stroke-dasharray="6 4"/>"##
        );
    }
    if let Some(start) = sketch.coverage.way_in.first() {
        let (x, y) = sight.at(&start.center());
        let _ = writeln!(
            body,
            r##"<path d="{}Z" fill="none" stroke="#8a8a8a" stroke-dasharray="3 3"/><text x="{x:.1}" y="{:.1}" font-size="11" text-anchor="middle" fill="#6a6a6a">start</text>"##,
            sight.path(base_corners(sketch, start)),
            y + 4.0
        );
    }
    for k in 0..sketch.coverage.places.len() {
        body += &place(sketch, &sight, k);
    }
    for cut in &sketch.coverage.cuts {
        let p = sketch.wall.profile.at(cut.along);
        let n = sketch.wall.profile.normal(cut.along);
        let path = sight.path([p - n * 0.03, p + n * 0.03]);
        let _ = writeln!(body, r##"<path d="{path}" stroke="#111111" stroke-width="1"/>"##);
    }
    let c = sketch.coverage;
    let title = format!(
        "{}: {} places, {} strokes cut at {} crossings, {:.2} m of driving ({})",
        sketch.title,
        c.places.len(),
        c.strokes_cut(),
        c.cuts.len(),
        c.drive(),
        c.method
    );
    let title = escape(&title);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height:.0}\" viewBox=\"0 0 {WIDTH} {height:.0}\" \
         font-family=\"Ubuntu, sans-serif\" role=\"img\" aria-label=\"{title}\">\n\
         <rect width=\"{WIDTH}\" height=\"{height:.0}\" fill=\"#ffffff\"/>\n\
         <text x=\"20\" y=\"26\" font-size=\"15\">{title}</text>\n\
         <text x=\"20\" y=\"48\" font-size=\"12\" fill=\"#555555\">from above; wall as each place reaches it, ticks where strokes are cut, \
         dashed the drive</text>\n{body}</svg>\n"
    )
}

/// The corners of a base that stands at `pose`.
fn base_corners(sketch: &CoverSketch, pose: &BasePose) -> [Point2<f64>; 4] {
    let [l, w] = sketch.footprint.map(|s| 0.5 * s);
    [(l, w), (-l, w), (-l, -w), (l, -w)].map(|(x, y)| pose.isometry() * Point2::new(x, y))
}

/// One place: its stretch of wall, its base, its arm, its circles.
fn place(sketch: &CoverSketch, sight: &Sight, k: usize) -> String {
    let place = &sketch.coverage.places[k];
    let color = series_color(k);
    let mut text = String::new();
    let [a, b] = place.stretch;
    let aside = BESIDE * (1.0 + (k % 2) as f64);
    let n = ((b - a) / 0.01).ceil().max(1.0) as usize;
    let beside = (0..=n).map(|i| {
        let s = a + (b - a) * i as f64 / n as f64;
        sketch.wall.profile.at(s) + sketch.wall.profile.normal(s) * aside
    });
    let path = sight.path(beside);
    let _ = writeln!(text, r#"<path d="{path}" fill="none" stroke="{color}" stroke-width="5" stroke-opacity="0.85"/>"#);
    let world = place.pose.isometry();
    let [l, w] = sketch.footprint.map(|s| 0.5 * s);
    let _ = writeln!(
        text,
        r#"<path d="{}Z" fill="{color}" fill-opacity="0.10" stroke="{color}" stroke-width="1.5"/>"#,
        sight.path(base_corners(sketch, &place.pose))
    );
    let front =
        sight.path([Point2::new(l, 0.5 * w), Point2::new(l + 0.08, 0.0), Point2::new(l, -0.5 * w)].map(|p| world * p));
    let _ = writeln!(text, r#"<path d="{front}" fill="none" stroke="{color}" stroke-width="1.5"/>"#);
    let (x, y) = sight.at(&(world * Point2::new(sketch.mount[0], sketch.mount[1])));
    let _ = writeln!(text, r#"<circle cx="{x:.1}" cy="{y:.1}" r="4" fill="{color}"/>"#);
    if let Some([radius, offset, base]) = sketch.circle {
        let (x, y) = sight.at(&(world * Point2::new(offset, 0.0)));
        let r = radius * sight.scale;
        let _ = writeln!(
            text,
            r#"<circle cx="{x:.1}" cy="{y:.1}" r="{r:.1}" fill="none" stroke="{color}" stroke-width="1"/>"#
        );
        let (x, y) = sight.at(&place.pose.center());
        let r = base * sight.scale;
        let _ = writeln!(
            text,
            r##"<circle cx="{x:.1}" cy="{y:.1}" r="{r:.1}" fill="none" stroke="#999999" stroke-width="0.7"/>"##
        );
    }
    let (x, y) = sight.at(&place.pose.center());
    let _ = writeln!(
        text,
        r#"<text x="{x:.1}" y="{:.1}" font-size="15" text-anchor="middle" fill="{color}">{}</text><text x="{x:.1}" y="{:.1}" font-size="11" text-anchor="middle" fill="{color}">{} pieces</text>"#,
        y + 5.0,
        k + 1,
        y + 20.0,
        place.pieces.len()
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{ProfileCurve, ProfileShape};
    use crate::plan::cover::Place;

    #[test]
    fn a_plan_has_its_wall_and_a_base_for_each_place() {
        let points = vec![Point2::new(3.0, 1.0), Point2::new(3.0, -1.0)];
        let profile = ProfileCurve::new(&ProfileShape::Polyline { points, fillet: 0.0 }, 0.5).unwrap();
        let wall = Wall { profile, bottom: 0.0, top: 2.0, openings: vec![] };
        let place = |y: f64| Place {
            pose: BasePose { x: 2.0, y, heading: 0.0 },
            stretch: [0.5 - 0.5 * y, 1.5 - 0.5 * y],
            pieces: vec![],
        };
        let coverage = Coverage {
            raise: 0.0,
            way_in: vec![BasePose { x: 0.0, y: 0.0, heading: 0.0 }, place(0.5).pose],
            method: "map".into(),
            places: vec![place(0.5), place(-0.5)],
            cuts: vec![],
            drives: vec![vec![place(0.5).pose, place(-0.5).pose]],
            borders: vec![],
            optimal: true,
            bound: 2,
            rounds: 1,
            solver_s: 0.0,
        };
        let sketch = CoverSketch {
            title: "a < b",
            coverage: &coverage,
            wall: &wall,
            obstacles: vec![],
            footprint: [0.96, 0.8],
            mount: [0.12, 0.0],
            circle: None,
        };
        let svg = cover_svg(&sketch);
        assert!(
            svg.contains("a &lt; b: 2 places")
                && svg.matches("0 pieces").count() == 2
                && svg.contains(">start<")
                && !svg.contains("NaN")
        );
        // the artist stands below the wall, its left at the left
        let (sight, _) = Sight::of(&sketch);
        let (wall, base) = (sight.at(&Point2::new(3.0, 0.5)), sight.at(&Point2::new(2.0, 0.5)));
        assert!(base.1 > wall.1 && sight.at(&Point2::new(3.0, -0.5)).0 > wall.0);
        assert!(super::super::svg_png(&svg).is_ok());
    }
}
