//! Where a canvas is probed, and how far a stroke goes before the next look.
use nalgebra::Point2;

use crate::drawing::{Drawing, InkLayer, Stroke};

/// A node of the probing grid takes a point of the first ink that is not farther than this share of the extent's diagonal.
const NEAR: f64 = 0.15;

/// Points of the drawing nearest to the nodes of an `n` x `n` grid over its extent, from the middle outward: probes mark the
/// canvas only where it is drawn on, and in the ink of layer `first`, whose pen is held, where that has a point near.
pub fn probe_places(drawing: &Drawing, first: usize, n: usize) -> Vec<Point2<f64>> {
    let of = |layer: &InkLayer| layer.strokes.iter().flat_map(|s| s.points.iter().copied()).collect::<Vec<_>>();
    let points: Vec<Point2<f64>> = drawing.layers.iter().flat_map(of).collect();
    let own = drawing.layers.get(first).map(of).unwrap_or_default();
    let Some(start) = points.first() else { return Vec::new() };
    let (low, high) = points.iter().fold((*start, *start), |(l, h), p| (l.inf(p), h.sup(p)));
    let share = |i: usize| i as f64 / (n - 1) as f64;
    let mut nodes: Vec<Point2<f64>> = (0..n * n)
        .map(|k| {
            // rows there and back, so that ways are short
            let (row, i) = (k / n, k % n);
            let column = if row % 2 == 0 { i } else { n - 1 - i };
            low + (high - low).component_mul(&nalgebra::Vector2::new(share(column), share(row)))
        })
        .collect();
    nodes.insert(0, nalgebra::center(&low, &high));
    let mut places: Vec<Point2<f64>> = Vec::new();
    for node in nodes {
        let gap = |p: &&Point2<f64>| (**p - node).norm_squared();
        let nearest = |of: &[Point2<f64>]| of.iter().min_by(|a, b| gap(a).total_cmp(&gap(b))).copied();
        let near_enough = |p: &Point2<f64>| (p - node).norm() <= NEAR * (high - low).norm();
        let Some(near) = nearest(&own).filter(near_enough).or_else(|| nearest(&points)) else { continue };
        if places.iter().all(|p| (p - near).norm() > 0.005) {
            places.push(near);
        }
    }
    places
}

/// A stroke in pieces of equal length, none longer than `longest` (m).
pub fn pieces(stroke: &Stroke, longest: f64) -> Vec<Stroke> {
    let whole = stroke.length();
    let count = (whole / longest).ceil().max(1.0) as usize;
    if count == 1 {
        return vec![stroke.clone()];
    }
    let cut = whole / count as f64;
    let mut made = Vec::with_capacity(count);
    let mut piece = Stroke { points: vec![stroke.points[0]], widths: stroke.width_at(0).into_iter().collect() };
    let mut passed = 0.0;
    for (i, w) in stroke.points.windows(2).enumerate() {
        let gap = (w[1] - w[0]).norm();
        let mut ends = (made.len() + 1) as f64 * cut;
        while made.len() + 1 < count && gap > 0.0 && passed + gap > ends {
            let u = (ends - passed) / gap;
            let point = w[0] + (w[1] - w[0]) * u;
            let width = stroke.width_at(i).zip(stroke.width_at(i + 1)).map(|(a, b)| a + (b - a) * u);
            piece.points.push(point);
            piece.widths.extend(width);
            let next = Stroke { points: vec![point], widths: width.into_iter().collect() };
            made.push(std::mem::replace(&mut piece, next));
            ends = (made.len() + 1) as f64 * cut;
        }
        piece.points.push(w[1]);
        piece.widths.extend(stroke.width_at(i + 1));
        passed += gap;
    }
    made.push(piece);
    made
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn pieces_are_the_stroke_and_none_is_too_long(
            points in proptest::collection::vec((-0.1..0.1f64, -0.1..0.1f64), 2..20), longest in 0.01..0.2f64,
        ) {
            let widths = (0..points.len()).map(|i| 1e-3 + 1e-4 * i as f64).collect();
            let stroke = Stroke { points: points.iter().map(|(x, y)| Point2::new(*x, *y)).collect(), widths };
            let cut = pieces(&stroke, longest);
            let total: f64 = cut.iter().map(Stroke::length).sum();
            prop_assert!((total - stroke.length()).abs() < 1e-9);
            prop_assert!(cut.iter().all(|p| p.length() <= longest * (1.0 + 1e-9) && p.points.len() == p.widths.len()));
            prop_assert!(cut.windows(2).all(|w| w[0].points.last() == w[1].points.first()));
            prop_assert_eq!(cut[0].points[0], stroke.points[0]);
            prop_assert_eq!(cut[cut.len() - 1].points.last(), stroke.points.last());
        }
    }

    #[test]
    fn probes_touch_where_the_drawing_is() {
        let corner = |x: f64, y: f64| Point2::new(0.05 * x, 0.08 * y);
        let ring = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let layer = InkLayer {
            name: "black".into(),
            color: crate::math::Rgb([0; 3]),
            width_hint: None,
            strokes: vec![Stroke::new(ring.clone()), Stroke::new(vec![corner(0.0, 0.1)])],
        };
        let places = probe_places(&Drawing::new(0.1, 0.16, vec![layer]), 0, 3);
        assert_eq!(places[0], corner(0.0, 0.1));
        assert_eq!(places.len(), 5);
        assert!(ring.iter().all(|p| places.contains(p)));
    }
}
