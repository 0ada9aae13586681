//! An order of strokes with little pen-up travel: greedy nearest neighbour, then 2-opt and Or-opt moves.
//!
//! Strokes may be drawn backwards, and closed ones from any vertex. The moves follow the usual neighbour-list scheme
//! (Johnson and McGeoch, "The Traveling Salesman Problem: A Case Study in Local Optimization", 1997): a gap of length
//! g can only be improved by a new gap shorter than g at one of its ends, so only the nearest few ends are tried. All
//! ties are broken by index; the result depends on the strokes alone.
use nalgebra::Point2;

use super::Stroke;

/// Vertices of a closed stroke that the greedy search considers as its start; the best one is taken afterwards.
const STARTS: usize = 16;
/// Nearest ends that are tried for a new gap.
const NEIGHBOURS: usize = 10;
/// Longest run of strokes that is moved elsewhere in one piece.
const RUN: usize = 3;
/// Improvements below this length are rounding, m.
const GAIN: f64 = 1e-12;

/// Length of pen-up travel between consecutive strokes, m.
pub fn pen_up_length(strokes: &[Stroke]) -> f64 {
    let ends = strokes.iter().filter_map(|s| Some((s.points.first()?, s.points.last()?)));
    ends.clone().zip(ends.skip(1)).map(|(a, b)| (b.0 - a.1).norm()).sum()
}

/// The same strokes in an order, and in directions, with less pen-up travel, starting near the sheet's upper left
/// corner. `effort` bounds the elementary steps of the improvement (about 1e8 a second); 0 leaves the greedy order.
/// Strokes without points are dropped.
pub fn order_strokes(mut strokes: Vec<Stroke>, effort: u64) -> Vec<Stroke> {
    strokes.retain(|s| !s.points.is_empty());
    if strokes.len() < 2 {
        return strokes;
    }
    let mut tour = greedy(&mut strokes);
    tour.improve(effort);
    let mut slots: Vec<Option<Stroke>> = strokes.into_iter().map(Some).collect();
    let mut ordered: Vec<Stroke> = Vec::with_capacity(slots.len());
    for (s, backwards) in tour.visits {
        if let Some(mut stroke) = slots[s as usize].take() {
            if backwards {
                stroke.reverse();
            }
            ordered.push(stroke);
        }
    }
    turn_closed(&mut ordered);
    ordered
}

/// Whether the stroke may begin at any of its vertices; one of varying width would get a step there.
fn is_closed(stroke: &Stroke) -> bool {
    stroke.widths.is_empty() && stroke.points.len() > 2 && stroke.points.first() == stroke.points.last()
}

/// Starts a closed stroke at another of its vertices.
fn turn(stroke: &mut Stroke, vertex: usize) {
    stroke.points.pop();
    stroke.points.rotate_left(vertex);
    stroke.points.extend(stroke.points.first().copied());
}

/// Starts each closed stroke where the way to it and from it is shortest.
fn turn_closed(strokes: &mut [Stroke]) {
    for i in 0..strokes.len() {
        if !is_closed(&strokes[i]) {
            continue;
        }
        let before = i.checked_sub(1).and_then(|j| strokes[j].points.last().copied());
        let after = strokes.get(i + 1).and_then(|s| s.points.first().copied());
        let way = |p: &Point2<f64>| before.map_or(0.0, |q| (p - q).norm()) + after.map_or(0.0, |q| (p - q).norm());
        let points = &strokes[i].points;
        let best = (0..points.len() - 1).min_by(|a, b| way(&points[*a]).total_cmp(&way(&points[*b])));
        if let Some(best) = best.filter(|b| way(&points[*b]) < way(&points[0]) - GAIN) {
            turn(&mut strokes[i], best);
        }
    }
}

/// Points in square cells, for nearest-point queries.
struct Cells {
    low: Point2<f64>,
    side: f64,
    columns: usize,
    rows: usize,
    cells: Vec<Vec<u32>>,
    points: Vec<Point2<f64>>,
}

impl Cells {
    fn new(points: Vec<Point2<f64>>) -> Self {
        let first = points.first().copied().unwrap_or_else(Point2::origin);
        let (low, high) = points.iter().fold((first, first), |(l, h), p| (l.inf(p), h.sup(p)));
        let (w, h) = (high.x - low.x, high.y - low.y);
        // About two points per cell, whatever the shape of the cloud.
        let count = (0.5 * points.len() as f64).max(1.0);
        let side = (w * h / count).sqrt().max(w.max(h) / count).max(1e-9);
        let (columns, rows) = ((w / side) as usize + 1, (h / side) as usize + 1);
        let mut cells = Cells { low, side, columns, rows, cells: vec![Vec::new(); columns * rows], points };
        for i in 0..cells.points.len() {
            let (c, r) = cells.cell_of(&cells.points[i]);
            cells.cells[r * columns + c].push(i as u32);
        }
        cells
    }

    fn cell_of(&self, p: &Point2<f64>) -> (usize, usize) {
        let index = |x: f64, low: f64, n: usize| (((x - low) / self.side).max(0.0) as usize).min(n - 1);
        (index(p.x, self.low.x, self.columns), index(p.y, self.low.y, self.rows))
    }

    fn remove(&mut self, point: u32) {
        let (c, r) = self.cell_of(&self.points[point as usize]);
        self.cells[r * self.columns + c].retain(|p| *p != point);
    }

    /// The nearest `count` points for which `wanted` holds, nearest first.
    fn nearest(&self, p: &Point2<f64>, count: usize, wanted: impl Fn(u32) -> bool) -> Vec<u32> {
        let (c, r) = self.cell_of(p);
        let mut found: Vec<(f64, u32)> = Vec::new();
        for ring in 0..self.columns.max(self.rows) {
            // Everything in this ring and beyond is at least this far away.
            let reach = (ring as f64 - 1.0) * self.side;
            if found.len() >= count && found[count - 1].0 <= reach {
                break;
            }
            let before = found.len();
            let (top, bottom) = (r as isize - ring as isize, r as isize + ring as isize);
            let (left, right) = (c as isize - ring as isize, c as isize + ring as isize);
            for row in top.max(0)..=bottom.min(self.rows as isize - 1) {
                // Inner rows of a ring have two cells only.
                let step = if row == top || row == bottom || ring == 0 { 1 } else { (right - left).max(1) };
                let mut column = left;
                while column <= right {
                    if (0..self.columns as isize).contains(&column) {
                        let cell = &self.cells[row as usize * self.columns + column as usize];
                        let points = cell.iter().filter(|q| wanted(**q));
                        found.extend(points.map(|q| ((self.points[*q as usize] - p).norm(), *q)));
                    }
                    column += step;
                }
            }
            if found.len() > before {
                found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                found.truncate(count);
            }
        }
        found.into_iter().map(|(_, q)| q).collect()
    }
}

/// Always on to the nearest free end. Turns closed strokes to the vertex at which they are entered.
fn greedy(strokes: &mut [Stroke]) -> Tour {
    // Candidates: both ends of open strokes, some vertices of closed ones.
    let mut owners: Vec<(u32, u32)> = Vec::new();
    let mut first = Vec::new();
    for (s, stroke) in strokes.iter().enumerate() {
        first.push(owners.len() as u32);
        let last = stroke.points.len() - 1;
        if is_closed(stroke) {
            let count = last.min(STARTS);
            owners.extend((0..count).map(|k| (s as u32, (k * last / count) as u32)));
        } else {
            owners.push((s as u32, 0));
            if last > 0 {
                owners.push((s as u32, last as u32));
            }
        }
    }
    first.push(owners.len() as u32);
    let mut cells = Cells::new(owners.iter().map(|(s, v)| strokes[*s as usize].points[*v as usize]).collect());
    let mut at = Point2::new(cells.low.x, cells.low.y + cells.rows as f64 * cells.side);
    let mut visits = Vec::with_capacity(strokes.len());
    while let Some(&nearest) = cells.nearest(&at, 1, |_| true).first() {
        let (s, vertex) = owners[nearest as usize];
        (first[s as usize]..first[s as usize + 1]).for_each(|c| cells.remove(c));
        let stroke = &mut strokes[s as usize];
        let closed = is_closed(stroke);
        if closed {
            turn(stroke, vertex as usize);
        }
        let backwards = !closed && vertex > 0;
        visits.push((s, backwards));
        let exit = if backwards { stroke.points.first() } else { stroke.points.last() };
        at = exit.copied().unwrap_or(at);
    }
    let ends = strokes.iter().map(|s| [s.points[0], s.points[s.points.len() - 1]]).collect();
    Tour { visits, ends }
}

/// An order of strokes.
struct Tour {
    /// Stroke and whether it is drawn backwards, in drawing order.
    visits: Vec<(u32, bool)>,
    /// First and last point of each stroke.
    ends: Vec<[Point2<f64>; 2]>,
}

impl Tour {
    fn entry(&self, position: usize) -> Point2<f64> {
        let (s, backwards) = self.visits[position];
        self.ends[s as usize][usize::from(backwards)]
    }

    fn exit(&self, position: usize) -> Point2<f64> {
        let (s, backwards) = self.visits[position];
        self.ends[s as usize][usize::from(!backwards)]
    }

    /// Travel between the exit of one position and the entry of another; none beyond the tour's ends.
    fn gap(&self, from: Option<usize>, to: usize) -> f64 {
        match from {
            Some(from) if to < self.visits.len() => (self.entry(to) - self.exit(from)).norm(),
            _ => 0.0,
        }
    }

    fn reverse(&mut self, from: usize, to: usize, positions: &mut [u32]) {
        self.visits[from..=to].reverse();
        for i in from..=to {
            self.visits[i].1 ^= true;
            positions[self.visits[i].0 as usize] = i as u32;
        }
    }

    /// Improves until no move helps or the effort is spent.
    fn improve(&mut self, effort: u64) {
        let n = self.visits.len();
        let cells = Cells::new(self.ends.iter().flatten().copied().collect());
        // For each end (2 s, 2 s + 1) the nearest ends of other strokes.
        let neighbours: Vec<Vec<u32>> = match effort {
            0 => return,
            _ => (0..2 * n as u32)
                .map(|e| cells.nearest(&cells.points[e as usize], NEIGHBOURS, |o| o / 2 != e / 2))
                .collect(),
        };
        let mut positions = vec![0u32; n];
        for (i, (s, _)) in self.visits.iter().enumerate() {
            positions[*s as usize] = i as u32;
        }
        let mut spent = 0u64;
        loop {
            let mut improved = false;
            for s in 0..n as u32 {
                for end in [2 * s, 2 * s + 1] {
                    for &other in &neighbours[end as usize] {
                        spent += 1;
                        let distance = (cells.points[end as usize] - cells.points[other as usize]).norm();
                        if let Some(steps) = self.try_join(end, other, distance, &mut positions) {
                            improved = true;
                            spent += steps;
                        }
                        if spent > effort {
                            return;
                        }
                    }
                }
            }
            if !improved {
                return;
            }
        }
    }

    /// Tries the moves that put `other` next to `end`, a distance away; returns the steps of the one that was made.
    fn try_join(&mut self, end: u32, other: u32, distance: f64, positions: &mut [u32]) -> Option<u64> {
        let n = self.visits.len();
        let (p, q) = (positions[end as usize / 2] as usize, positions[other as usize / 2] as usize);
        let is_exit = |e: u32, position: usize| (e % 2 == 1) != self.visits[position].1;
        let (end_exits, other_exits) = (is_exit(end, p), is_exit(other, q));
        // The gap at `end` that the new one would replace.
        let old = if end_exits { self.gap(Some(p), p + 1) } else { self.gap(p.checked_sub(1), p) };
        let at_tour_end = if end_exits { p + 1 == n } else { p == 0 };
        if distance >= old - GAIN && !at_tour_end {
            return None;
        }
        // 2-opt: two exits, or two entries, meet when the stretch between them is turned round.
        if end_exits == other_exits {
            let (from, to) = match end_exits {
                true => (p.min(q) + 1, p.max(q)),
                false => (p.min(q), p.max(q) - 1),
            };
            let before = self.gap(from.checked_sub(1), from) + self.gap(Some(to), to + 1);
            let far = match end_exits {
                true if to + 1 < n => (self.entry(from) - self.entry(to + 1)).norm(),
                false if from > 0 => (self.exit(from - 1) - self.exit(to)).norm(),
                _ => 0.0,
            };
            if distance + far < before - GAIN {
                self.reverse(from, to, positions);
                return Some((to - from + 1) as u64);
            }
        }
        self.try_move(p, end_exits, q, other_exits, positions)
    }

    /// Or-opt: moves a short run of strokes that begins with the one at `q` into the gap after (or before) `p`, so
    /// that q's given end comes next to p.
    fn try_move(&mut self, p: usize, after: bool, q: usize, by_exit: bool, positions: &mut [u32]) -> Option<u64> {
        let n = self.visits.len();
        // Positions on both sides of the gap that the run goes into.
        let (left, right) = if after { (Some(p), p + 1) } else { (p.checked_sub(1), p) };
        for run in 1..=RUN {
            // The run reaches from q away from the end that joins p.
            let (from, to) = match by_exit {
                true if q + 1 >= run => (q + 1 - run, q),
                false if q + run <= n => (q, q + run - 1),
                _ => break,
            };
            if (from..=to).contains(&p)
                || left.is_some_and(|l| (from..=to).contains(&l))
                || (from..=to).contains(&right)
            {
                break;
            }
            // After p the run must begin with the joining end, before p it must end with it.
            let turned = after == by_exit;
            let (head, tail) = match turned {
                true => (self.exit(to), self.entry(from)),
                false => (self.entry(from), self.exit(to)),
            };
            let closing = match from.checked_sub(1) {
                Some(f) if to + 1 < n => (self.entry(to + 1) - self.exit(f)).norm(),
                _ => 0.0,
            };
            let removed = self.gap(from.checked_sub(1), from) + self.gap(Some(to), to + 1) - closing;
            let into = left.map_or(0.0, |l| (head - self.exit(l)).norm())
                + if right < n { (self.entry(right) - tail).norm() } else { 0.0 };
            let added = into - self.gap(left, right);
            if added < removed - GAIN {
                if turned {
                    self.reverse(from, to, positions);
                }
                // Rotating the stretch between the run and the gap moves the run.
                let (low, high) = match right <= from {
                    true => {
                        self.visits[right..=to].rotate_right(run);
                        (right, to)
                    }
                    false => {
                        self.visits[from..right].rotate_left(run);
                        (from, right - 1)
                    }
                };
                for i in low..=high {
                    positions[self.visits[i].0 as usize] = i as u32;
                }
                return Some((high - low + 1) as u64);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn strokes() -> impl Strategy<Value = Vec<Stroke>> {
        let stroke =
            (proptest::collection::vec((0.0..1.0f64, 0.0..1.0f64), 1..6), any::<bool>()).prop_map(|(p, close)| {
                let mut points: Vec<_> = p.into_iter().map(|(x, y)| Point2::new(x, y)).collect();
                if close && points.len() > 2 {
                    points.push(points[0]);
                }
                Stroke::new(points)
            });
        proptest::collection::vec(stroke, 0..40)
    }

    /// Every segment of a stroke, without direction, sorted; a dot is a segment of no length.
    fn segments(strokes: &[Stroke]) -> Vec<[u64; 4]> {
        let mut all = Vec::new();
        for s in strokes {
            let dot = [s.points[0]; 2];
            for w in s.points.windows(2).chain((s.points.len() == 1).then_some(&dot[..])) {
                let key = |p: &Point2<f64>| [p.x.to_bits(), p.y.to_bits()];
                let (a, b) = (key(&w[0]).min(key(&w[1])), key(&w[0]).max(key(&w[1])));
                all.push([a[0], a[1], b[0], b[1]]);
            }
        }
        all.sort();
        all
    }

    proptest! {
        #[test]
        fn ordering_keeps_every_segment_and_improving_never_lengthens(strokes in strokes()) {
            let greedy = order_strokes(strokes.clone(), 0);
            let better = order_strokes(strokes.clone(), 1_000_000);
            prop_assert_eq!(segments(&strokes), segments(&greedy));
            prop_assert_eq!(segments(&strokes), segments(&better));
            prop_assert_eq!(strokes.len(), better.len());
        }

        #[test]
        fn moves_shorten_the_tour_by_what_they_claim(strokes in strokes()) {
            prop_assume!(strokes.len() > 1);
            let mut strokes = strokes;
            let mut tour = greedy(&mut strokes);
            let travel = |t: &Tour| (1..t.visits.len()).map(|i| t.gap(Some(i - 1), i)).sum::<f64>();
            let before = travel(&tour);
            tour.improve(1_000_000);
            prop_assert!(travel(&tour) <= before + 1e-12);
            let mut visited: Vec<u32> = tour.visits.iter().map(|v| v.0).collect();
            visited.sort();
            prop_assert!(visited.into_iter().eq(0..strokes.len() as u32));
        }
    }

    #[test]
    fn parallel_lines_are_drawn_to_and_fro() {
        let line = |k: usize| {
            let y = 0.01 * k as f64;
            Stroke::new(vec![Point2::new(0.0, y), Point2::new(0.2, y)])
        };
        let shuffled: Vec<Stroke> = (0..50).map(|k| line(k * 17 % 50)).collect();
        let ordered = order_strokes(shuffled, 1_000_000);
        assert!((pen_up_length(&ordered) - 0.49).abs() < 1e-9, "{}", pen_up_length(&ordered));
    }

    #[test]
    fn closed_strokes_start_where_the_pen_comes_from() {
        let square = |x: f64| {
            let corners = [(0., 0.), (1., 0.), (1., 1.), (0., 1.), (0., 0.)];
            Stroke::new(corners.map(|(a, b)| Point2::new(x + a, b)).to_vec())
        };
        let ordered = order_strokes(vec![square(0.0), square(3.0), square(1.5)], 1000);
        // Each of the inner ones is left where it is entered, so half of its width must be crossed at least.
        assert!((pen_up_length(&ordered) - 2.0).abs() < 1.0 + 1e-9, "{}", pen_up_length(&ordered));
    }

    #[test]
    fn a_stroke_that_is_turned_round_keeps_its_widths() {
        let line = |x: [f64; 3], widths: Vec<f64>| Stroke { points: x.map(|x| Point2::new(x, 0.0)).to_vec(), widths };
        let there = line([0.0, 0.1, 0.2], vec![1e-3, 2e-3, 3e-3]);
        let mut loose = line([0.3, 0.4, 0.3], vec![1e-3, 2e-3, 3e-3]);
        let strokes = vec![there.clone(), line([0.5, 0.4, 0.25], vec![4e-3, 5e-3, 6e-3]), loose.clone()];
        let ordered = order_strokes(strokes, 1000);
        let turned = ordered.iter().find(|s| s.points.contains(&Point2::new(0.5, 0.0))).unwrap();
        let at = turned.points.iter().position(|p| p.x == 0.5).unwrap();
        assert_eq!(turned.widths[at], 4e-3);
        assert!(ordered.contains(&there));
        // a closed line of varying width begins at an end of its own
        if !ordered.contains(&loose) {
            loose.reverse();
            assert!(ordered.contains(&loose));
        }
    }

    #[test]
    fn the_same_strokes_come_out_in_the_same_order() {
        let strokes: Vec<Stroke> = (0..300u32)
            .map(|k| {
                let h = |m: u32| f64::from(k.wrapping_mul(m) >> 16 & 1023) / 1023.0;
                Stroke::new(vec![Point2::new(h(2654435761), h(40503 << 8)), Point2::new(h(97 << 15), h(31 << 17))])
            })
            .collect();
        assert_eq!(order_strokes(strokes.clone(), 1_000_000), order_strokes(strokes, 1_000_000));
    }
}
