//! Fills drawn as parallel pen lines.
use kurbo::{Point, Vec2};

use super::clip::{FillRule, Outline};

/// Lines that a fill may take before hatching is refused; more is a spacing given in the wrong unit.
const MAX_LINES: f64 = 100_000.0;

/// Parallel lines that fill an outline by its rule, in mm: `spacing` apart, at `angle` (rad, counter-clockwise from
/// x), with alternating direction. The ink of a pen as wide as the spacing then covers the fill and does not leave it,
/// since every line keeps half a spacing away from the outline. `None` where there would be too many lines.
pub(super) fn hatch(outline: &Outline, rule: FillRule, spacing: f64, angle: f64) -> Option<Vec<[Point; 2]>> {
    let (along, across) = (Vec2::from_angle(angle), Vec2::from_angle(angle + std::f64::consts::FRAC_PI_2));
    // Edges in a frame whose x runs along the lines.
    let turn = |p: Point| Point::new(p.to_vec2().dot(along), p.to_vec2().dot(across));
    let edges: Vec<[Point; 2]> = outline.edges().iter().map(|[a, b]| [turn(*a), turn(*b)]).collect();
    let (low, high) =
        edges.iter().flatten().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p.y), h.max(p.y)));
    let inset = 0.5 * spacing;
    let height = high - low - spacing;
    if edges.is_empty() || height < -1e-9 * spacing {
        return Some(Vec::new());
    }
    if height / spacing > MAX_LINES {
        return None;
    }
    // Whole spacings; what is left over is shared between both ends.
    let count = (height / spacing + 1e-6).floor().max(0.0) as usize + 1;
    let first = low + inset + 0.5 * (height - (count - 1) as f64 * spacing).max(0.0);

    // Each line needs the edges that cross it or come within half a spacing of it.
    let mut near: Vec<Vec<u32>> = vec![Vec::new(); count];
    for (i, [a, b]) in edges.iter().enumerate() {
        let line = |y: f64| (y - first) / spacing;
        let from = line(a.y.min(b.y) - inset).floor().max(0.0) as usize;
        let to = (line(a.y.max(b.y) + inset).ceil().max(0.0) as usize).min(count - 1);
        (from..=to).for_each(|l| near[l].push(i as u32));
    }
    let mut lines = Vec::new();
    for (l, near) in near.iter().enumerate() {
        let y = first + l as f64 * spacing;
        let mut pieces = inside(&edges, near, y, rule);
        for i in near {
            // A hair less than the inset, so that an edge along the first line does not erase it.
            if let Some(hole) = within(edges[*i as usize], y, inset * (1.0 - 1e-6)) {
                pieces = pieces.into_iter().flat_map(|p| subtract(p, hole)).collect();
            }
        }
        let back = |x: f64| (along * x + across * y).to_point();
        let mut segments: Vec<[Point; 2]> =
            pieces.into_iter().filter(|p| p.1 - p.0 > 1e-3 * spacing).map(|(a, b)| [back(a), back(b)]).collect();
        if l % 2 == 1 {
            segments.reverse();
            segments.iter_mut().for_each(|s| s.reverse());
        }
        lines.extend(segments);
    }
    Some(lines)
}

/// Stretches of the level line at `y` inside the edges, by the fill rule, from left to right.
fn inside(edges: &[[Point; 2]], near: &[u32], y: f64, rule: FillRule) -> Vec<(f64, f64)> {
    let mut crossings: Vec<(f64, i32)> = near
        .iter()
        .map(|i| edges[*i as usize])
        .filter(|[a, b]| (a.y <= y) != (b.y <= y))
        .map(|[a, b]| (a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x), if b.y > a.y { 1 } else { -1 }))
        .collect();
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let filled = |winding: i32| match rule {
        FillRule::NonZero => winding != 0,
        FillRule::EvenOdd => winding % 2 != 0,
    };
    let (mut winding, mut start, mut pieces) = (0, None, Vec::new());
    for (x, step) in crossings {
        winding += step;
        match start {
            None if filled(winding) => start = Some(x),
            Some(from) if !filled(winding) => {
                pieces.push((from, x));
                start = None;
            }
            _ => {}
        }
    }
    pieces
}

/// The stretch of the level line at `y` within a distance of an edge.
fn within([a, b]: [Point; 2], y: f64, distance: f64) -> Option<(f64, f64)> {
    let mut span: Option<(f64, f64)> = None;
    let mut add = |low: f64, high: f64| span = Some(span.map_or((low, high), |(l, h)| (l.min(low), h.max(high))));
    for end in [a, b] {
        let half = (distance * distance - (y - end.y).powi(2)).sqrt();
        if half.is_finite() {
            add(end.x - half, end.x + half);
        }
    }
    // The strip between the end discs: the line meets its two long sides, each where the foot lies on the edge.
    let d = b - a;
    let length = d.hypot();
    if length > 0.0 {
        let normal = Vec2::new(-d.y, d.x) / length;
        for side in [-distance, distance] {
            let (p, q) = (a + normal * side, b + normal * side);
            if (p.y <= y) != (q.y <= y) {
                let x = p.x + (y - p.y) / (q.y - p.y) * (q.x - p.x);
                add(x, x);
            }
        }
    }
    span
}

fn subtract(piece: (f64, f64), hole: (f64, f64)) -> impl Iterator<Item = (f64, f64)> {
    [(piece.0, piece.1.min(hole.0)), (piece.0.max(hole.1), piece.1)].into_iter().filter(|p| p.1 > p.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::clip::Outline;

    fn rectangle(x: f64, y: f64, w: f64, h: f64) -> Vec<Point> {
        [(x, y), (x + w, y), (x + w, y + h), (x, y + h)].map(Point::from).to_vec()
    }

    #[test]
    fn a_rectangle_takes_height_over_spacing_lines_inset_by_half_a_spacing() {
        let o = Outline::new(&[rectangle(0.0, 0.0, 20.0, 10.0)], FillRule::NonZero);
        let lines = hatch(&o, FillRule::NonZero, 1.0, 0.0).unwrap();
        assert_eq!(lines.len(), 10);
        for (k, [a, b]) in lines.iter().enumerate() {
            assert!((a.y - (k as f64 + 0.5)).abs() < 1e-9);
            assert!(((b.x - a.x).abs() - 19.0).abs() < 1e-3);
            assert_eq!(b.x > a.x, k % 2 == 0, "directions alternate");
        }
    }

    #[test]
    fn the_hole_of_an_even_odd_fill_stays_empty_at_any_angle() {
        let contours = [rectangle(0.0, 0.0, 20.0, 20.0), rectangle(5.0, 5.0, 10.0, 10.0)];
        let o = Outline::new(&contours, FillRule::EvenOdd);
        for k in 0..12 {
            let lines = hatch(&o, FillRule::EvenOdd, 0.7, 0.3 * k as f64).unwrap();
            let total: f64 = lines.iter().map(|[a, b]| (*b - *a).hypot()).sum();
            // Lines fill what is left when half a spacing is taken off every edge.
            let eroded = 19.3 * 19.3 - (100.0 + 40.0 * 0.35 + std::f64::consts::PI * 0.35 * 0.35);
            assert!((0.97..1.08).contains(&(total * 0.7 / eroded)), "{}", total * 0.7);
            for [a, b] in &lines {
                for t in [0.0, 0.25, 0.5, 0.75, 1.0] {
                    let p = a.lerp(*b, t);
                    let from_hole = (p - Point::new(p.x.clamp(5.0, 15.0), p.y.clamp(5.0, 15.0))).hypot();
                    assert!(from_hole > 0.349 && p.x > 0.349 && p.x < 19.651, "{p:?}");
                }
            }
        }
    }

    #[test]
    fn absurd_spacings_are_refused() {
        let o = Outline::new(&[rectangle(0.0, 0.0, 20.0, 10.0)], FillRule::NonZero);
        assert!(hatch(&o, FillRule::NonZero, 1e-7, 0.0).is_none());
    }
}
