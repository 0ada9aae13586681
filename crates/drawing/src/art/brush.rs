//! Brush strokes as a pen draws them: one line, a bundle of lines side by side, or a zigzag.
use std::f64::consts::TAU;

use nalgebra::{Point2, Vector2};

/// How a pen fills a brush stroke that is wider than its line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BrushFill {
    /// Lines along the stroke, to and fro.
    #[default]
    Bundle,
    /// To and fro across the stroke.
    Zigzag,
}

/// A brush stroke up to this many line widths across is drawn as a single line.
const SINGLE: f64 = 1.5;

/// A brush in the hand of one who has only a pen. Lengths in the unit of the points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PenBrush {
    /// Radius of the brush.
    pub radius: f64,
    /// Width of the pen's line.
    pub line: f64,
    /// Share of the area that the lines cover: 1 sets them edge to edge, more overlaps them, less leaves paper between.
    pub coverage: f64,
    /// How it is filled.
    pub fill: BrushFill,
}

impl PenBrush {
    /// Whether it is a single line.
    pub fn is_line(&self) -> bool {
        2.0 * self.radius <= SINGLE * self.line
    }

    /// Half the width of what the pen makes of the brush.
    pub fn drawn_radius(&self) -> f64 {
        if self.is_line() { 0.5 * self.line } else { self.radius }
    }

    /// The pen's way over a brush stroke with this spine: one line without lifting, a single point for a dot as small as the
    /// pen. Between two points there are at most about half a line's width, except across a zigzag.
    ///
    /// The spine is resampled; its ends become round. What is farther than `room` from the origin, across and up, is cut off
    /// as if by masking tape.
    pub fn pen_line(&self, spine: &[Point2<f64>], room: [f64; 2]) -> Vec<Point2<f64>> {
        if spine.is_empty() {
            return Vec::new();
        }
        let spine = Spine::new(spine, 0.5 * self.line);
        let way = match self.fill {
            _ if self.is_line() => taped(&spine.points, room),
            _ if spine.points.len() == 1 => taped(&self.spiral(spine.points[0]), room),
            BrushFill::Bundle => self.bundle(&spine, room),
            BrushFill::Zigzag => taped(&self.zigzag(&spine), room),
        };
        if !way.is_empty() {
            return way;
        }
        // All of it lies within half a line of the edge, or beyond: the edge is as near as the pen gets.
        let edge = |p: &Point2<f64>| Point2::new(p.x.clamp(-room[0], room[0]), p.y.clamp(-room[1], room[1]));
        let mut way: Vec<_> = spine.points.iter().map(edge).collect();
        way.dedup();
        way
    }

    fn bundle(&self, spine: &Spine, room: [f64; 2]) -> Vec<Point2<f64>> {
        let half = self.radius - 0.5 * self.line;
        let gaps = (2.0 * half * self.coverage / self.line).ceil().max(1.0) as usize;
        let mut way = Vec::new();
        for i in 0..=gaps {
            let offset = half * (2.0 * i as f64 / gaps as f64 - 1.0);
            let mut line = taped(&spine.offset(offset, (half * half - offset * offset).max(0.0).sqrt()), room);
            if i % 2 == 1 {
                line.reverse();
            }
            way.extend(line);
        }
        way
    }

    /// A round dot: once round its rim, then inwards to its middle.
    fn spiral(&self, middle: Point2<f64>) -> Vec<Point2<f64>> {
        let (half, step) = (self.radius - 0.5 * self.line, 0.5 * self.line);
        let mut way = Vec::new();
        let mut angle = 0.0f64;
        loop {
            let radius = half - (angle / TAU - 1.0).max(0.0) * self.line / self.coverage;
            if radius <= 0.0 {
                way.push(middle);
                return way;
            }
            way.push(middle + radius * Vector2::new(angle.cos(), angle.sin()));
            // Longer chords would cut the rim visibly short of its circle.
            angle += (step / radius).min(0.4);
        }
    }

    fn zigzag(&self, spine: &Spine) -> Vec<Point2<f64>> {
        let half = self.radius - 0.5 * self.line;
        let length = spine.length() + 2.0 * half;
        let crossings = (length * self.coverage / self.line).ceil().max(1.0) as usize;
        (0..=crossings)
            .map(|i| {
                let along = length * i as f64 / crossings as f64 - half;
                let beyond = (-along).max(along - spine.length()).max(0.0);
                let side = (half * half - beyond * beyond).max(0.0).sqrt();
                spine.at(along) + spine.normal(along) * if i % 2 == 0 { side } else { -side }
            })
            .collect()
    }
}

/// The middle of a brush stroke, at even steps.
struct Spine {
    points: Vec<Point2<f64>>,
    tangents: Vec<Vector2<f64>>,
    step: f64,
}

impl Spine {
    fn new(points: &[Point2<f64>], step: f64) -> Self {
        let (points, step) = resampled(points, step);
        let last = points.len() - 1;
        let tangent = |i: usize| {
            let d = points[(i + 1).min(last)] - points[i.saturating_sub(1)];
            d.try_normalize(0.0).unwrap_or(Vector2::x())
        };
        let tangents = (0..=last).map(tangent).collect();
        Self { points, tangents, step }
    }

    fn length(&self) -> f64 {
        self.step * (self.points.len() - 1) as f64
    }

    /// The place so far along, straight on beyond the ends.
    fn at(&self, along: f64) -> Point2<f64> {
        let last = self.points.len() - 1;
        if along <= 0.0 || last == 0 {
            return self.points[0] + along * self.tangents[0];
        }
        if along >= self.length() {
            return self.points[last] + (along - self.length()) * self.tangents[last];
        }
        let i = ((along / self.step) as usize).min(last - 1);
        self.points[i] + (along - i as f64 * self.step) / self.step * (self.points[i + 1] - self.points[i])
    }

    fn normal(&self, along: f64) -> Vector2<f64> {
        let last = self.points.len() - 1;
        let t = self.tangents[((along / self.step.max(1e-300)).round().max(0.0) as usize).min(last)];
        Vector2::new(-t.y, t.x)
    }

    /// The line this far to the left, going on beyond the ends by `overhang`. Where the spine is bent more tightly than the
    /// offset, the line would turn back in a loop: what comes nearer to the spine than the offset is left out.
    fn offset(&self, offset: f64, overhang: f64) -> Vec<Point2<f64>> {
        let left = |t: &Vector2<f64>| offset * Vector2::new(-t.y, t.x);
        let window = (3.2 * offset.abs() / self.step.max(1e-300)).min(1e6) as usize + 1;
        let clear = (0.98 * offset).powi(2);
        let mut line = Vec::new();
        let (first, last) = (0, self.points.len() - 1);
        if overhang > 0.0 {
            let t = self.tangents[first];
            line.push(self.points[first] - overhang * t + left(&t));
        }
        for (i, (p, t)) in self.points.iter().zip(&self.tangents).enumerate() {
            let q = p + left(t);
            let near = &self.points[i.saturating_sub(window)..(i + window + 1).min(self.points.len())];
            if near.iter().all(|s| (s - q).norm_squared() >= clear) {
                line.push(q);
            }
        }
        if overhang > 0.0 {
            let t = self.tangents[last];
            line.push(self.points[last] + overhang * t + left(&t));
        }
        line
    }
}

/// What of a polyline lies in a rectangle about the origin, its parts joined straight: along the edge, as the pen turns
/// round there. Points that it crosses the edge in are added.
fn taped(line: &[Point2<f64>], room: [f64; 2]) -> Vec<Point2<f64>> {
    let inside = |p: &Point2<f64>| p.x.abs() <= room[0] && p.y.abs() <= room[1];
    let mut kept: Vec<Point2<f64>> = Vec::with_capacity(line.len());
    for (i, p) in line.iter().enumerate() {
        if let Some((from, to)) = i.checked_sub(1).and_then(|i| crossing(line[i], *p, room)) {
            kept.extend([from, to].into_iter().filter(|q| *q != line[i - 1] && q != p));
        }
        if inside(p) {
            kept.push(*p);
        }
    }
    kept
}

/// The ends of the part of a segment that lies in a rectangle about the origin (Liang and Barsky 1984).
fn crossing(a: Point2<f64>, b: Point2<f64>, room: [f64; 2]) -> Option<(Point2<f64>, Point2<f64>)> {
    let (mut first, mut last) = (0.0f64, 1.0f64);
    for k in 0..2 {
        let d = b[k] - a[k];
        if d == 0.0 {
            if a[k].abs() > room[k] {
                return None;
            }
            continue;
        }
        let (u, v) = ((-room[k] - a[k]) / d, (room[k] - a[k]) / d);
        first = first.max(u.min(v));
        last = last.min(u.max(v));
    }
    let at = |t: f64| {
        let p = a + t * (b - a);
        Point2::new(p.x.clamp(-room[0], room[0]), p.y.clamp(-room[1], room[1]))
    };
    let end = |t: f64, p: Point2<f64>| if t == 0.0 || t == 1.0 { p } else { at(t) };
    (first <= last).then(|| (end(first, a), end(last, b)))
}

/// A uniform cubic B-spline through the plane, from the first to the last of its control points, as a polyline with steps of
/// about this length. Hertzmann 1998 draws his strokes so: it bends softly, and never beyond the hull of its points.
pub(super) fn spline(controls: &[Point2<f64>], step: f64) -> Vec<Point2<f64>> {
    let n = controls.len();
    if n < 3 {
        return resampled(controls, step).0;
    }
    // A phantom point beyond each end, mirrored in it, makes the curve start and end in the end points.
    let at = |i: isize| -> Point2<f64> {
        if i < 0 {
            controls[0] + (controls[0] - controls[1])
        } else if i as usize >= n {
            controls[n - 1] + (controls[n - 1] - controls[n - 2])
        } else {
            controls[i as usize]
        }
    };
    let mut points = Vec::new();
    for i in 0..n as isize - 1 {
        let [a, b, c, d] = [at(i - 1), at(i), at(i + 1), at(i + 2)].map(|p| p.coords);
        let pieces = ((c - b).norm() / step).ceil().clamp(1.0, 1e4) as usize;
        for k in 0..pieces {
            let t = k as f64 / pieces as f64;
            let (t2, t3) = (t * t, t * t * t);
            let sum = a * (1.0 - t).powi(3)
                + b * (3.0 * t3 - 6.0 * t2 + 4.0)
                + c * (-3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0)
                + d * t3;
            points.push(Point2::from(sum / 6.0));
        }
    }
    points.push(controls[n - 1]);
    points
}

/// Points at even steps of at most this length along a polyline, and the step; a single point for one without length.
fn resampled(points: &[Point2<f64>], step: f64) -> (Vec<Point2<f64>>, f64) {
    let length: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    let pieces = (length / step).ceil().min(1e6) as usize;
    let Some((first, last)) = points.first().zip(points.last()) else { return (Vec::new(), 0.0) };
    if pieces == 0 {
        return (vec![*first], 0.0);
    }
    let step = length / pieces as f64;
    let mut even = vec![*first];
    let mut passed = 0.0;
    for w in points.windows(2) {
        let piece = (w[1] - w[0]).norm();
        while even.len() < pieces && step * even.len() as f64 <= passed + piece {
            let t = (step * even.len() as f64 - passed) / piece;
            even.push(w[0] + t * (w[1] - w[0]));
        }
        passed += piece;
    }
    even.push(*last);
    (even, step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const WIDE: [f64; 2] = [1e3, 1e3];

    /// Distance of a place from a polyline.
    fn distance(line: &[Point2<f64>], p: Point2<f64>) -> f64 {
        let segment = |w: &[Point2<f64>]| {
            let d = w[1] - w[0];
            let t = ((p - w[0]).dot(&d) / d.norm_squared().max(1e-300)).clamp(0.0, 1.0);
            (w[0] + t * d - p).norm()
        };
        let ends = line.iter().map(|q| (q - p).norm());
        line.windows(2).map(segment).chain(ends).fold(f64::INFINITY, f64::min)
    }

    /// A bend of this angle, rad, on a circle of this radius.
    fn bend(radius: f64, angle: f64) -> Vec<Point2<f64>> {
        let at = |i: i32| {
            let a = angle * f64::from(i) / 60.0;
            Point2::new(radius * a.sin(), radius * (1.0 - a.cos()))
        };
        (0..=60).map(at).collect()
    }

    /// Shares of the brush's area that the pen leaves bare, and of the pen's area that lies beyond the brush.
    fn bare_and_beyond(brush: &PenBrush, spine: &[Point2<f64>]) -> (f64, f64) {
        let way = brush.pen_line(spine, WIDE);
        let (mut area, mut bare, mut inked, mut beyond) = (0, 0, 0, 0);
        let step = 0.1 * brush.line;
        let low = spine.iter().fold([f64::INFINITY; 2], |l, p| [l[0].min(p.x), l[1].min(p.y)]);
        let high = spine.iter().fold([f64::NEG_INFINITY; 2], |h, p| [h[0].max(p.x), h[1].max(p.y)]);
        let margin = brush.radius + brush.line;
        let cells = |k: usize| ((high[k] - low[k] + 2.0 * margin) / step) as usize;
        for (i, j) in (0..cells(0)).flat_map(|i| (0..cells(1)).map(move |j| (i, j))) {
            let p = Point2::new(low[0] - margin + i as f64 * step, low[1] - margin + j as f64 * step);
            let (brushed, drawn) = (distance(spine, p) <= brush.radius, distance(&way, p) <= 0.5 * brush.line);
            area += usize::from(brushed);
            bare += usize::from(brushed && !drawn);
            inked += usize::from(drawn);
            beyond += usize::from(drawn && !brushed);
        }
        (f64::from(bare as u32) / f64::from(area as u32), f64::from(beyond as u32) / f64::from(inked as u32))
    }

    #[test]
    fn a_bundle_covers_its_brush_and_little_else() {
        for radius in [0.9, 1.6, 4.0] {
            let brush = PenBrush { radius, line: 0.8, coverage: 1.0 / 0.9, fill: BrushFill::Bundle };
            for angle in [1e-3, 1.0, 2.5] {
                let (bare, beyond) = bare_and_beyond(&brush, &bend(8.0 * radius / angle, angle));
                assert!(bare < 0.04 && beyond < 0.01, "{radius} {angle}: {bare} bare, {beyond} beyond");
            }
            let (bare, beyond) = bare_and_beyond(&brush, &[Point2::origin()]);
            assert!(bare < 0.04 && beyond < 0.01, "dot of {radius}: {bare} bare, {beyond} beyond");
        }
    }

    #[test]
    fn a_zigzag_stays_in_its_brush_and_covers_most_of_it() {
        let brush = PenBrush { radius: 3.0, line: 0.8, coverage: 1.3, fill: BrushFill::Zigzag };
        let (bare, beyond) = bare_and_beyond(&brush, &bend(20.0, 1.2));
        assert!(bare < 0.25 && beyond < 0.02, "{bare} bare, {beyond} beyond");
    }

    #[test]
    fn a_bend_as_tight_as_its_brush_makes_no_loops() {
        let brush = PenBrush { radius: 3.0, line: 0.8, coverage: 1.0, fill: BrushFill::Bundle };
        for radius in [1.0, 2.0, 3.0] {
            let spine = bend(radius, 3.0);
            let (bare, beyond) = bare_and_beyond(&brush, &spine);
            assert!(bare < 0.1 && beyond < 0.02, "{radius}: {bare} bare, {beyond} beyond");
        }
    }

    #[test]
    fn a_brush_as_fine_as_the_pen_is_one_line_or_a_point() {
        let brush = PenBrush { radius: 0.5, line: 0.8, coverage: 1.0, fill: BrushFill::Zigzag };
        assert!(brush.is_line() && brush.drawn_radius() == 0.4);
        assert_eq!(brush.pen_line(&[Point2::new(1.0, 2.0)], WIDE), [Point2::new(1.0, 2.0)]);
        let way = brush.pen_line(&[Point2::origin(), Point2::new(3.0, 0.0)], WIDE);
        assert!(way.len() > 7 && way.iter().all(|p| p.y == 0.0));
        assert_eq!(brush.pen_line(&[], WIDE), []);
    }

    #[test]
    fn a_spline_ends_in_its_end_points() {
        let controls = [(0.0, 0.0), (1.0, 1.0), (2.0, -1.0), (3.0, 0.0)].map(|(x, y)| Point2::new(x, y));
        let line = spline(&controls, 0.01);
        assert!((line[0] - controls[0]).norm() < 1e-12 && (line[line.len() - 1] - controls[3]).norm() < 1e-12);
        assert!(line.windows(2).all(|w| (w[1] - w[0]).norm() < 0.02));
    }

    proptest! {
        #[test]
        fn no_point_leaves_the_room(
            spine in proptest::collection::vec((-12.0..12.0f64, -8.0..8.0f64), 1..6),
            radius in 0.2..5.0f64,
            fill in prop_oneof![Just(BrushFill::Bundle), Just(BrushFill::Zigzag)],
        ) {
            let spine: Vec<_> = spine.into_iter().map(|(x, y)| Point2::new(x, y)).collect();
            let brush = PenBrush { radius, line: 0.8, coverage: 1.0, fill };
            let way = brush.pen_line(&spline(&spine, 0.4), [6.0, 4.0]);
            prop_assert!(!way.is_empty());
            prop_assert!(way.iter().all(|p| p.x.abs() <= 6.0 && p.y.abs() <= 4.0), "{:?}", way);
        }
    }
}
