//! Strokes made easier to draw: joined where they meet, freed of dust and needless points, and put in order.
use std::collections::BTreeMap;

use nalgebra::Point2;

use super::stroke_order::{order_strokes, pen_up_length};
use super::{Drawing, Stroke};

/// What [`tidy`] does, in this order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TidyOptions {
    /// Strokes shorter than this, m, are dropped; dots count as dust then. `None` keeps all.
    pub dust: Option<f64>,
    /// Strokes whose ends are at most this far apart, m, are joined. `None` joins none.
    pub merge: Option<f64>,
    /// Points are left out where the line then moves by at most this, m. `None` keeps all.
    pub simplify: Option<f64>,
    /// Whether strokes are reordered, and turned round, for less pen-up travel.
    pub order: bool,
    /// Bound on the elementary steps of the ordering, about 1e8 a second.
    pub effort: u64,
}

impl Default for TidyOptions {
    fn default() -> Self {
        TidyOptions { dust: None, merge: Some(1e-4), simplify: Some(2e-5), order: true, effort: 50_000_000 }
    }
}

/// What [`tidy`] changed. Pen-up travel counts within layers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TidyReport {
    /// Strokes before and after.
    pub strokes: [usize; 2],
    /// Points before and after.
    pub points: [usize; 2],
    /// Pen-up travel before and after, m.
    pub pen_up: [f64; 2],
}

/// Tidies each layer of a drawing; layers keep their order. Layers left without strokes are dropped.
pub fn tidy(drawing: &mut Drawing, options: &TidyOptions) -> TidyReport {
    let mut report = TidyReport::default();
    let mut note = |drawing: &Drawing, i: usize| {
        report.strokes[i] = drawing.stroke_count();
        report.points[i] = drawing.point_count();
        report.pen_up[i] = drawing.layers.iter().map(|l| pen_up_length(&l.strokes)).sum();
    };
    note(drawing, 0);
    for layer in &mut drawing.layers {
        let mut strokes = std::mem::take(&mut layer.strokes);
        if let Some(least) = options.dust {
            strokes.retain(|s| s.length() >= least);
        }
        if let Some(tolerance) = options.merge {
            strokes = merge_strokes(strokes, tolerance);
        }
        if let Some(tolerance) = options.simplify {
            strokes = strokes.iter().map(|s| simplify(s, tolerance)).collect();
        }
        if options.order {
            strokes = order_strokes(strokes, options.effort);
        }
        layer.strokes = strokes;
    }
    drawing.layers.retain(|l| !l.strokes.is_empty());
    note(drawing, 1);
    report
}

fn ends_of(points: &[Point2<f64>]) -> Option<[Point2<f64>; 2]> {
    Some([*points.first()?, *points.last()?])
}

/// Joins strokes whose ends are at most `tolerance` (m) apart, turning them round where needed. Where more than two
/// ends meet, the line goes on as straight as it can. A gap becomes a short piece of line, and a line that comes back
/// to its start is closed. Dots, closed strokes and strokes of varying width stay as they are.
pub fn merge_strokes(strokes: Vec<Stroke>, tolerance: f64) -> Vec<Stroke> {
    let side = tolerance.max(1e-9);
    let cell = |p: &Point2<f64>| ((p.x / side).floor() as i64, (p.y / side).floor() as i64);
    // Ends of strokes that can be joined, by cell: stroke and whether it is its last point.
    let mut ends: BTreeMap<(i64, i64), Vec<(usize, bool)>> = BTreeMap::new();
    for (i, stroke) in strokes.iter().enumerate() {
        if let Some([a, b]) =
            ends_of(&stroke.points).filter(|[a, b]| stroke.points.len() > 1 && a != b && stroke.widths.is_empty())
        {
            ends.entry(cell(&a)).or_default().push((i, false));
            ends.entry(cell(&b)).or_default().push((i, true));
        }
    }
    let (lines, mut widths): (Vec<_>, Vec<_>) = strokes.into_iter().map(|s| (s.points, s.widths)).unzip();
    let mut slots: Vec<Option<Vec<Point2<f64>>>> = lines.into_iter().map(Some).collect();
    let mut merged = Vec::new();
    for i in 0..slots.len() {
        let Some(mut line) = slots[i].take() else { continue };
        if !widths[i].is_empty() {
            merged.push(Stroke { points: line, widths: std::mem::take(&mut widths[i]) });
            continue;
        }
        let joinable = ends_of(&line).is_some_and(|[a, b]| a != b);
        // Grow at the tail, then turn round and grow at the other end. The second turn restores the direction.
        for _ in 0..2 {
            while joinable && let Some([head, tail]) = ends_of(&line) {
                if line.len() > 2 && (head - tail).norm() <= tolerance {
                    break;
                }
                let heading = heading_at_end(&line);
                let (x, y) = cell(&tail);
                let near = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (x + dx, y + dy)));
                let mut best: Option<(f64, usize, bool)> = None;
                for &(j, last) in near.filter_map(|c| ends.get(&c)).flatten() {
                    let Some([a, b]) = slots[j].as_deref().and_then(ends_of) else { continue };
                    let (near, points) = if last { (b, slots[j].as_deref()) } else { (a, slots[j].as_deref()) };
                    if (near - tail).norm() > tolerance {
                        continue;
                    }
                    let onward =
                        points.map_or(heading, |p| if last { -heading_at_end(p) } else { heading_at_start(p) });
                    let bend = 1.0 - heading.dot(&onward);
                    if best.is_none_or(|(least, k, _)| bend < least - 1e-9 || (bend < least + 1e-9 && j < k)) {
                        best = Some((bend, j, last));
                    }
                }
                let Some((_, j, last)) = best else { break };
                let mut next = slots[j].take().unwrap_or_default();
                if last {
                    next.reverse();
                }
                let skip = usize::from(next.first() == line.last());
                line.extend_from_slice(&next[skip..]);
            }
            line.reverse();
        }
        if let Some([head, tail]) = ends_of(&line)
            && joinable
            && line.len() > 3
            && head != tail
            && (head - tail).norm() <= tolerance
        {
            line.push(head);
        }
        merged.push(Stroke::new(line));
    }
    merged
}

fn heading_at_start(points: &[Point2<f64>]) -> nalgebra::Vector2<f64> {
    points
        .windows(2)
        .map(|w| w[1] - w[0])
        .find(|d| d.norm() > 0.0)
        .map_or_else(nalgebra::Vector2::zeros, |d| d.normalize())
}

fn heading_at_end(points: &[Point2<f64>]) -> nalgebra::Vector2<f64> {
    points
        .windows(2)
        .rev()
        .map(|w| w[1] - w[0])
        .find(|d| d.norm() > 0.0)
        .map_or_else(nalgebra::Vector2::zeros, |d| d.normalize())
}

/// The stroke with fewer points, none of the left-out ones farther than `tolerance` (m) from the new line
/// (Ramer, doi:10.1016/S0146-664X(72)80017-0; Douglas and Peucker). Ends are kept; a stroke of varying width is kept whole.
pub fn simplify(stroke: &Stroke, tolerance: f64) -> Stroke {
    let points = &stroke.points;
    if points.len() < 3 || !stroke.widths.is_empty() {
        return stroke.clone();
    }
    let mut keep = vec![false; points.len()];
    let last = points.len() - 1;
    (keep[0], keep[last]) = (true, true);
    let mut open = vec![(0, last)];
    while let Some((a, b)) = open.pop() {
        let farthest =
            (a + 1..b).map(|i| (distance(&points[i], &points[a], &points[b]), i)).max_by(|x, y| x.0.total_cmp(&y.0));
        if let Some((d, i)) = farthest
            && d > tolerance
        {
            keep[i] = true;
            open.extend([(a, i), (i, b)]);
        }
    }
    Stroke::new(points.iter().zip(keep).filter(|(_, k)| *k).map(|(p, _)| *p).collect())
}

/// Distance of a point to a segment.
fn distance(p: &Point2<f64>, a: &Point2<f64>, b: &Point2<f64>) -> f64 {
    let d = b - a;
    let along = if d.norm_squared() > 0.0 { ((p - a).dot(&d) / d.norm_squared()).clamp(0.0, 1.0) } else { 0.0 };
    (p - (a + d * along)).norm()
}

/// The same line with points at most `step` (m) apart: each segment is divided evenly, all vertices are kept; widths are
/// interpolated. A step that is not positive changes nothing.
pub fn resample(stroke: &Stroke, step: f64) -> Stroke {
    let mut points: Vec<Point2<f64>> = stroke.points.first().copied().into_iter().collect();
    let mut widths: Vec<f64> = stroke.widths.first().copied().into_iter().collect();
    for (i, w) in stroke.points.windows(2).enumerate() {
        let parts = if step > 0.0 { ((w[1] - w[0]).norm() / step - 1e-9).ceil().max(1.0) as usize } else { 1 };
        let shares = (1..parts).map(|k| k as f64 / parts as f64);
        points.extend(shares.clone().map(|u| w[0] + (w[1] - w[0]) * u));
        points.push(w[1]);
        if let (Some(a), Some(b)) = (stroke.width_at(i), stroke.width_at(i + 1)) {
            widths.extend(shares.map(|u| a + (b - a) * u));
            widths.push(b);
        }
    }
    Stroke { points, widths }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::drawing::InkLayer;
    use crate::math::Rgb;

    fn stroke(points: &[(f64, f64)]) -> Stroke {
        Stroke::new(points.iter().map(|(x, y)| Point2::new(*x, *y)).collect())
    }

    fn drawing(strokes: Vec<Stroke>) -> Drawing {
        let layer = InkLayer { name: "a".into(), color: Rgb([0; 3]), width_hint: None, strokes };
        Drawing::new(1.0, 1.0, vec![layer])
    }

    /// Strokes on a coarse lattice, so that many ends meet.
    fn lattice_strokes() -> impl Strategy<Value = Vec<Stroke>> {
        let stroke = proptest::collection::vec((0..5i32, 0..5i32), 2..5).prop_map(|p| {
            Stroke::new(p.into_iter().map(|(x, y)| Point2::new(0.1 * x as f64, 0.1 * y as f64)).collect())
        });
        proptest::collection::vec(stroke, 1..30)
    }

    fn segments(strokes: &[Stroke]) -> Vec<[u64; 4]> {
        let key = |p: &Point2<f64>| [p.x.to_bits(), p.y.to_bits()];
        let sorted = |w: &[Point2<f64>]| (key(&w[0]).min(key(&w[1])), key(&w[0]).max(key(&w[1])));
        let mut all: Vec<_> = strokes
            .iter()
            .flat_map(|s| s.points.windows(2))
            .map(sorted)
            .map(|(a, b)| [a[0], a[1], b[0], b[1]])
            .collect();
        all.sort();
        all
    }

    proptest! {
        #[test]
        fn merging_and_ordering_keep_every_segment(strokes in lattice_strokes()) {
            let mut d = drawing(strokes.clone());
            let report = tidy(&mut d, &TidyOptions { merge: Some(1e-6), simplify: None, ..Default::default() });
            prop_assert_eq!(segments(&strokes), segments(&d.layers[0].strokes));
            prop_assert!(report.strokes[1] <= report.strokes[0]);
            let length: f64 = strokes.iter().map(Stroke::length).sum();
            prop_assert!((d.length() - length).abs() < 1e-9);
        }

        #[test]
        fn after_merging_no_two_open_ends_meet(strokes in lattice_strokes()) {
            let merged = merge_strokes(strokes, 1e-6);
            let open: Vec<_> = merged.iter().filter_map(|s| ends_of(&s.points)).filter(|[a, b]| a != b).collect();
            for (i, a) in open.iter().enumerate() {
                for b in &open[i + 1..] {
                    prop_assert!(a.iter().all(|p| b.iter().all(|q| (p - q).norm() > 1e-6)), "{a:?} {b:?}");
                }
            }
        }

        #[test]
        fn simplified_lines_stay_within_tolerance(
            points in proptest::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 1..60), tolerance in 0.0..0.5f64,
        ) {
            let s = stroke(&points);
            let t = simplify(&s, tolerance);
            prop_assert_eq!(s.points.first(), t.points.first());
            prop_assert_eq!(s.points.last(), t.points.last());
            for p in &s.points {
                let near = t.points.windows(2).map(|w| distance(p, &w[0], &w[1])).fold(f64::INFINITY, f64::min);
                prop_assert!(t.points.len() < 2 || near <= tolerance + 1e-12);
            }
        }

        #[test]
        fn resampling_keeps_the_line_and_bounds_the_step(
            points in proptest::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 1..20), step in 0.01..1.0f64,
        ) {
            let mut s = stroke(&points);
            s.widths = points.iter().map(|(x, _)| 2.0 + x).collect();
            let t = resample(&s, step);
            prop_assert!(t.points.iter().zip(&t.widths).all(|(p, w)| (2.0 + p.x - w).abs() < 1e-12));
            prop_assert_eq!(t.points.len(), t.widths.len());
            prop_assert!((s.length() - t.length()).abs() < 1e-9);
            prop_assert!(t.points.windows(2).all(|w| (w[1] - w[0]).norm() <= step * (1.0 + 1e-6)));
            prop_assert!(s.points.iter().all(|p| t.points.contains(p)));
        }
    }

    #[test]
    fn lines_go_straight_on_where_four_ends_meet() {
        let cross = vec![
            stroke(&[(-1.0, 0.0), (0.0, 0.0)]),
            stroke(&[(0.0, -1.0), (0.0, 0.0)]),
            stroke(&[(1.0, 0.0), (0.0, 0.0)]),
            stroke(&[(0.0, 1.0), (0.0, 0.0)]),
        ];
        let merged = merge_strokes(cross, 1e-6);
        assert_eq!(merged.len(), 2);
        assert_eq!(merged[0], stroke(&[(-1.0, 0.0), (0.0, 0.0), (1.0, 0.0)]));
    }

    #[test]
    fn four_sides_become_one_closed_square() {
        let sides = vec![
            stroke(&[(0.0, 0.0), (1.0, 0.0)]),
            stroke(&[(1.0, 1.0), (0.0, 1.0)]),
            stroke(&[(1.0, 0.0), (1.0, 1.0)]),
            stroke(&[(0.0, 0.0), (0.0, 0.99995)]),
        ];
        let merged = merge_strokes(sides, 1e-4);
        assert_eq!(merged.len(), 1);
        assert_eq!(merged[0].points.first(), merged[0].points.last());
        assert!((merged[0].length() - 4.0).abs() < 2e-4);
    }

    #[test]
    fn strokes_of_varying_width_come_through_whole() {
        let swelling = |x: f64| Stroke {
            points: (0..=10).map(|i| Point2::new(x + 0.01 * f64::from(i), 0.0)).collect(),
            widths: (0..=10).map(|i| 1e-3 + 1e-4 * f64::from(i)).collect(),
        };
        let mut d = drawing(vec![swelling(0.0), stroke(&[(0.1, 0.0), (0.1, 0.1)]), swelling(0.1)]);
        assert_eq!(tidy(&mut d, &TidyOptions::default()).strokes, [3, 3]);
        let same = |s: &Stroke, t: &Stroke| {
            let mut turned = t.clone();
            turned.reverse();
            s == t || *s == turned
        };
        for x in [0.0, 0.1] {
            assert!(d.layers[0].strokes.iter().any(|s| same(s, &swelling(x))));
        }
    }

    #[test]
    fn dust_goes_only_when_asked() {
        let strokes = vec![stroke(&[(0.0, 0.0)]), stroke(&[(0.1, 0.1), (0.2, 0.1)]), stroke(&[(0.3, 0.3), (0.3, 0.3)])];
        let mut d = drawing(strokes.clone());
        assert_eq!(tidy(&mut d, &TidyOptions::default()).strokes, [3, 3]);
        let mut d = drawing(strokes);
        assert_eq!(tidy(&mut d, &TidyOptions { dust: Some(1e-4), ..Default::default() }).strokes, [3, 1]);
    }

    #[test]
    fn scattered_strokes_are_ordered_well() {
        // A random tour through n points in a unit square has about 0.52 n of travel, a good one 0.7124 sqrt(n).
        use rand::RngExt as _;
        let mut rng = crate::math::stream(7, "tidy", 0);
        let strokes: Vec<Stroke> = (0..5000)
            .map(|_| {
                let (x, y, a) = (rng.random::<f64>(), rng.random::<f64>(), rng.random::<f64>() * 6.3);
                stroke(&[(x, y), (x + 2e-3 * a.cos(), y + 2e-3 * a.sin())])
            })
            .collect();
        let mut d = drawing(strokes);
        let report = tidy(&mut d, &TidyOptions::default());
        assert!(report.pen_up[0] > 2000.0);
        assert!(report.pen_up[1] < 1.12 * 0.7124 * 5000f64.sqrt(), "{:?}", report);
    }
}
