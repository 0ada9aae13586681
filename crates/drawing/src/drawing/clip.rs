//! Polylines clipped against filled outlines, exactly and in stroke order.
//!
//! Every segment is cut at its crossings with the outline, and each piece is kept where its middle lies inside by the
//! outline's fill rule. Pieces that run along the outline count as inside. Coordinates are sheet millimetres.
use std::sync::Arc;

use kurbo::Point;

/// How far from an outline a point still counts as on it, mm: above the noise of single-precision input coordinates
/// of a sheet of a few metres, far below a pen's line.
const ON_OUTLINE: f64 = 1e-4;

/// Which winding numbers are inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FillRule {
    NonZero,
    EvenOdd,
}

/// A filled outline of closed contours, with its edges sorted into rows for quick queries.
#[derive(Clone, Debug)]
pub(super) struct Outline {
    edges: Vec<[Point; 2]>,
    rule: FillRule,
    low: f64,
    row_height: f64,
    rows: Vec<Vec<u32>>,
}

impl Outline {
    /// From contours, each closed implicitly.
    pub(super) fn new(contours: &[Vec<Point>], rule: FillRule) -> Self {
        let mut edges = Vec::new();
        for c in contours {
            for (i, a) in c.iter().enumerate() {
                let b = &c[(i + 1) % c.len()];
                if a != b {
                    edges.push([*a, *b]);
                }
            }
        }
        let (low, high) =
            edges.iter().flatten().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p.y), h.max(p.y)));
        let count = (edges.len() / 4).clamp(1, 1024);
        let row_height = ((high - low) / count as f64).max(ON_OUTLINE);
        let mut outline = Outline { edges, rule, low, row_height, rows: vec![Vec::new(); count] };
        for (i, [a, b]) in outline.edges.iter().enumerate() {
            let (from, to) = outline.rows_between(a.y.min(b.y), a.y.max(b.y));
            outline.rows[from..=to].iter_mut().for_each(|r| r.push(i as u32));
        }
        outline
    }

    /// All edges.
    pub(super) fn edges(&self) -> &[[Point; 2]] {
        &self.edges
    }

    /// First and last row that heights between these touch. The margin keeps points on the outline findable.
    fn rows_between(&self, low: f64, high: f64) -> (usize, usize) {
        (self.row(low - ON_OUTLINE), self.row(high + ON_OUTLINE))
    }

    fn row(&self, y: f64) -> usize {
        (((y - self.low) / self.row_height).floor().max(0.0) as usize).min(self.rows.len() - 1)
    }

    /// Whether the point lies inside or on the outline.
    pub(super) fn contains(&self, p: Point) -> bool {
        if self.edges.is_empty() {
            return false;
        }
        self.near_edge(p) || self.winds_round(p)
    }

    /// Whether the point lies inside, off the outline.
    fn covers(&self, p: Point) -> bool {
        !self.edges.is_empty() && !self.near_edge(p) && self.winds_round(p)
    }

    fn near_edge(&self, p: Point) -> bool {
        let (from, to) = self.rows_between(p.y, p.y);
        let near = |i: &u32| distance_to_segment(p, self.edges[*i as usize]) <= ON_OUTLINE;
        self.rows[from..=to].iter().flatten().any(near)
    }

    fn winds_round(&self, p: Point) -> bool {
        let mut winding = 0;
        for i in &self.rows[self.row(p.y)] {
            let [a, b] = self.edges[*i as usize];
            if (a.y <= p.y) != (b.y <= p.y) {
                let x = a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
                if x > p.x {
                    winding += if b.y > a.y { 1 } else { -1 };
                }
            }
        }
        match self.rule {
            FillRule::NonZero => winding != 0,
            FillRule::EvenOdd => winding % 2 != 0,
        }
    }

    /// Adds the parameters in (0, 1) at which a segment meets the outline.
    fn add_crossings(&self, a: Point, b: Point, at: &mut Vec<f64>) {
        if self.edges.is_empty() {
            return;
        }
        let d = b - a;
        let (from, to) = self.rows_between(a.y.min(b.y), a.y.max(b.y));
        for i in self.rows[from..=to].iter().flatten() {
            let [c, e] = self.edges[*i as usize];
            let f = e - c;
            let cross = d.cross(f);
            if cross.abs() > 1e-12 * d.hypot() * f.hypot() {
                let t = (c - a).cross(f) / cross;
                let u = (c - a).cross(d) / cross;
                if t > 0.0 && t < 1.0 && (-1e-9..=1.0 + 1e-9).contains(&u) {
                    at.push(t);
                }
            } else if distance_to_segment(c, [a, b]) <= ON_OUTLINE || distance_to_segment(e, [a, b]) <= ON_OUTLINE {
                at.extend(
                    [c, e]
                        .iter()
                        .map(|p| (*p - a).dot(d) / d.hypot2())
                        .filter(|t| t.is_finite() && *t > 0.0 && *t < 1.0),
                );
            }
        }
    }
}

fn distance_to_segment(p: Point, [a, b]: [Point; 2]) -> f64 {
    let d = b - a;
    let t = if d.hypot2() > 0.0 { ((p - a).dot(d) / d.hypot2()).clamp(0.0, 1.0) } else { 0.0 };
    (p - (a + d * t)).hypot()
}

/// A clip path: the union of outlines, each perhaps clipped itself, and clipped by a further clip path as a whole.
#[derive(Clone, Debug, Default)]
pub(super) struct Clip {
    pub(super) outlines: Vec<(Outline, Vec<Arc<Clip>>)>,
    pub(super) within: Option<Arc<Clip>>,
    /// Whether what lies inside is taken away instead of kept; what runs along an outline stays either way.
    pub(super) hides: bool,
}

impl Clip {
    /// A rectangle about the origin, full width and height in mm.
    pub(super) fn centred_rectangle(width: f64, height: f64) -> Self {
        let (x, y) = (0.5 * width, 0.5 * height);
        let corners = vec![Point::new(-x, -y), Point::new(x, -y), Point::new(x, y), Point::new(-x, y)];
        Clip { outlines: vec![(Outline::new(&[corners], FillRule::NonZero), Vec::new())], within: None, hides: false }
    }

    fn contains(&self, p: Point) -> bool {
        if self.hides {
            return !self.outlines.iter().any(|(o, clips)| o.covers(p) && clips.iter().all(|c| c.contains(p)));
        }
        self.outlines.iter().any(|(o, clips)| o.contains(p) && clips.iter().all(|c| c.contains(p)))
            && self.within.as_ref().is_none_or(|c| c.contains(p))
    }

    fn add_crossings(&self, a: Point, b: Point, at: &mut Vec<f64>) {
        for (outline, clips) in &self.outlines {
            outline.add_crossings(a, b, at);
            clips.iter().for_each(|c| c.add_crossings(a, b, at));
        }
        if let Some(c) = &self.within {
            c.add_crossings(a, b, at);
        }
    }
}

/// The parts of a polyline that lie inside all clips, in order. A closed polyline whose start lies inside is not cut
/// there. Pieces shorter than the width of the outline's edge are dropped.
pub(super) fn clip_polyline(points: &[Point], clips: &[Arc<Clip>]) -> Vec<Vec<Point>> {
    let inside = |p: Point| clips.iter().all(|c| c.contains(p));
    if clips.is_empty() {
        return vec![points.to_vec()];
    }
    if let [dot] = points {
        return if inside(*dot) { vec![vec![*dot]] } else { Vec::new() };
    }
    let (mut parts, mut current): (Vec<Vec<Point>>, Vec<Point>) = (Vec::new(), Vec::new());
    let mut at = Vec::new();
    let mut starts_inside = false;
    for (i, w) in points.windows(2).enumerate() {
        let (a, b) = (w[0], w[1]);
        at.clear();
        at.extend([0.0, 1.0]);
        clips.iter().for_each(|c| c.add_crossings(a, b, &mut at));
        at.sort_by(f64::total_cmp);
        at.dedup();
        for (j, t) in at.windows(2).enumerate() {
            if inside(a.lerp(b, 0.5 * (t[0] + t[1]))) {
                starts_inside |= i == 0 && j == 0;
                if current.is_empty() {
                    current.push(a.lerp(b, t[0]));
                }
                // Pieces of one straight segment that touch inside need no vertex between them.
                if j > 0 && current.len() > 1 && current.last() == Some(&a.lerp(b, t[0])) {
                    current.pop();
                }
                current.push(if t[1] == 1.0 { b } else { a.lerp(b, t[1]) });
            } else if !current.is_empty() {
                parts.push(std::mem::take(&mut current));
            }
        }
    }
    let ends_inside = !current.is_empty();
    if ends_inside {
        parts.push(current);
    }
    if points.first() == points.last() && starts_inside && ends_inside && parts.len() > 1 {
        let head = parts.remove(0);
        if let Some(tail) = parts.last_mut() {
            tail.extend_from_slice(&head[1..]);
        }
    }
    parts.retain(|p| p.windows(2).map(|w| (w[1] - w[0]).hypot()).sum::<f64>() > ON_OUTLINE);
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn length(p: &[Point]) -> f64 {
        p.windows(2).map(|w| (w[1] - w[0]).hypot()).sum()
    }

    fn ring(radius: f64, n: usize) -> Vec<Point> {
        (0..n)
            .map(|i| std::f64::consts::TAU * i as f64 / n as f64)
            .map(|a| Point::new(radius * a.cos(), radius * a.sin()))
            .collect()
    }

    #[test]
    fn a_chord_through_a_disc_is_cut_at_the_disc() {
        let disc = Clip {
            outlines: vec![(Outline::new(&[ring(10.0, 400)], FillRule::NonZero), vec![])],
            within: None,
            hides: false,
        };
        let clips = [Arc::new(disc)];
        for k in -9..=9 {
            let y = k as f64 + 0.123;
            let parts = clip_polyline(&[Point::new(-50.0, y), Point::new(50.0, y)], &clips);
            assert_eq!(parts.len(), 1);
            assert!((length(&parts[0]) - 2.0 * (100.0 - y * y).sqrt()).abs() < 0.01, "{y}");
        }
        assert!(clip_polyline(&[Point::new(-50.0, 11.0), Point::new(50.0, 11.0)], &clips).is_empty());
    }

    #[test]
    fn even_odd_leaves_the_hole_and_non_zero_fills_it() {
        let rings = [ring(10.0, 64), ring(5.0, 64)];
        let line = [Point::new(-20.0, 0.01), Point::new(20.0, 0.01)];
        let cut = |rule| {
            let clip = Clip { outlines: vec![(Outline::new(&rings, rule), vec![])], within: None, hides: false };
            clip_polyline(&line, &[Arc::new(clip)])
        };
        assert_eq!(cut(FillRule::EvenOdd).len(), 2);
        let filled = cut(FillRule::NonZero);
        assert_eq!((filled.len(), filled[0].len()), (1, 2), "crossings inside leave no vertex");
    }

    #[test]
    fn a_stroke_along_the_edge_is_kept_whole() {
        let clip = [Arc::new(Clip::centred_rectangle(20.0, 10.0))];
        let edge: Vec<Point> = [(-10., -5.), (10., -5.), (10., 5.), (-10., 5.), (-10., -5.)].map(Point::from).to_vec();
        assert_eq!(clip_polyline(&edge, &clip), vec![edge.clone()]);
        let longer = [Point::new(-15.0, 5.0), Point::new(15.0, 5.0)];
        assert!((length(&clip_polyline(&longer, &clip)[0]) - 20.0).abs() < 1e-9);
    }

    #[test]
    fn a_closed_stroke_is_not_cut_at_its_start() {
        let clip = [Arc::new(Clip::centred_rectangle(20.0, 20.0))];
        let mut c = ring(12.0, 360);
        c.push(c[0]);
        let turned: Vec<Point> = c.iter().map(|p| Point::new(p.x * 0.5, p.y)).collect();
        let parts = clip_polyline(&turned, &clip);
        assert_eq!(parts.len(), 2, "the ellipse leaves at the top and at the bottom");
    }
}
