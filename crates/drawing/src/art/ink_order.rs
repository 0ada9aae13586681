//! The order of strokes across inks: as the artwork was made, ink by ink, or with few changes of ink while every stroke
//! stays near its place.
use std::collections::BTreeSet;

use crate::drawing::{Drawing, Stroke, StrokeRef};
use crate::math::linear_from_srgb;

/// Partial orders that are followed at once when looking for few changes.
const BEAM: usize = 48;
/// Strokes among which the next one of the same ink is chosen for less travel.
const WINDOW: usize = 64;

/// How strokes of several inks are ordered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InkOrder {
    /// As the artwork was made: back to front, contours first, coarse to fine.
    AsMade,
    /// One ink after another, as they come in the drawing or, with `light_to_dark`, the lightest first. Within an ink as
    /// made.
    ByInk {
        /// Whether the lightest ink is drawn first.
        light_to_dark: bool,
    },
    /// Few changes of ink, no stroke farther from its place as made than a share of the number of strokes.
    FewestChanges {
        /// The share, 0 (as made) to 1 (ink by ink); clamped to that.
        disorder: f64,
    },
}

/// What ordering did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OrderReport {
    /// Changes of ink as made.
    pub changes_before: usize,
    /// Changes of ink now.
    pub changes_after: usize,
    /// Farthest that a stroke went from its place as made, as a share of the number of strokes.
    pub disorder: f64,
}

/// Orders the strokes of a drawing across its inks: `drawing.order` is the result, a permutation of what
/// [`Drawing::sequence`] gave.
pub fn arrange(drawing: &mut Drawing, rule: InkOrder) -> OrderReport {
    let made = drawing.sequence();
    let changes_before = drawing.ink_changes();
    // Places of the strokes, in the new order.
    let places: Vec<usize> = match rule {
        InkOrder::AsMade => (0..made.len()).collect(),
        InkOrder::ByInk { light_to_dark } => by_ink(drawing, &made, light_to_dark),
        InkOrder::FewestChanges { disorder } => few_changes(&made, bound(disorder, made.len())),
    };
    let farthest = places.iter().enumerate().map(|(now, was)| now.abs_diff(*was)).max().unwrap_or(0);
    drawing.order = places.iter().map(|p| made[*p]).collect();
    let disorder = farthest as f64 / made.len().max(1) as f64;
    OrderReport { changes_before, changes_after: drawing.ink_changes(), disorder }
}

/// Places that a stroke may move.
fn bound(disorder: f64, strokes: usize) -> usize {
    // A disorder that isn't a number allows none.
    (disorder.clamp(0.0, 1.0) * strokes as f64) as usize
}

fn by_ink(drawing: &Drawing, made: &[StrokeRef], light_to_dark: bool) -> Vec<usize> {
    let mut inks: Vec<usize> = (0..drawing.layers.len()).collect();
    if light_to_dark {
        let light = |ink: usize| {
            let [r, g, b] = drawing.layers[ink].color.0.map(linear_from_srgb);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        inks.sort_by(|a, b| light(*b).total_cmp(&light(*a)).then(a.cmp(b)));
    }
    inks.iter().flat_map(|ink| (0..made.len()).filter(move |i| made[*i].layer == *ink)).collect()
}

/// An order begun: strokes of one ink never overtake each other, so how many of each are drawn says which.
#[derive(Clone)]
struct Begun {
    /// Strokes drawn of each ink.
    drawn: Vec<usize>,
    /// Strokes drawn in all: the next place.
    next: usize,
    /// Earliest stroke that isn't drawn.
    oldest: usize,
    /// The run that led here: its ink and its length, and the one before.
    run: Option<(usize, usize)>,
    from: usize,
}

/// An order with few changes of ink in which no stroke moves more than `bound` places.
///
/// A stroke made at place `i` may be drawn at places `i - bound ..= i + bound`. Whenever the oldest waiting stroke's time
/// has come it is drawn, and then all later ones can still be in time; so an order is a row of runs, each of one ink
/// and as long as its strokes aren't too early and nobody's time has come. Runs are chosen by a beam search, one more
/// run at a time: of all orders begun with as many changes, those that got farthest are followed.
fn few_changes(made: &[StrokeRef], bound: usize) -> Vec<usize> {
    let n = made.len();
    let inks = made.iter().map(|s| s.layer + 1).max().unwrap_or(0);
    let mut of_ink: Vec<Vec<usize>> = vec![Vec::new(); inks];
    for (place, stroke) in made.iter().enumerate() {
        of_ink[stroke.layer].push(place);
    }
    let as_made: Vec<usize> = (0..n).collect();
    let changes = |places: &[usize]| places.windows(2).filter(|w| made[w[0]].layer != made[w[1]].layer).count();
    let before = changes(&as_made);
    if n < 2 || bound == 0 || before == 0 {
        return as_made;
    }
    let mut all = vec![Begun { drawn: vec![0; inks], next: 0, oldest: 0, run: None, from: 0 }];
    let mut beam = vec![0];
    for _ in 0..=before {
        let mut grown: Vec<Begun> = Vec::new();
        let mut seen: BTreeSet<(usize, Vec<usize>)> = BTreeSet::new();
        for &from in &beam {
            for ink in 0..inks {
                let begun = &all[from];
                if begun.run.is_some_and(|r| r.0 == ink) {
                    continue;
                }
                let longest = longest_run(begun, ink, &of_ink, made, bound);
                // Half a run may leave others the time for a longer one.
                for length in [longest, longest.div_ceil(2)] {
                    if length == 0 {
                        continue;
                    }
                    let after = drawn_on(begun, from, ink, length, &of_ink, made);
                    if seen.insert((ink, after.drawn.clone())) {
                        grown.push(after);
                    }
                }
            }
        }
        grown.sort_by_key(|b| std::cmp::Reverse((b.next, b.oldest)));
        grown.truncate(BEAM);
        let Some(best) = grown.first() else { break };
        if best.next == n {
            let places = unrolled(best, &all, &of_ink);
            return if changes(&places) < before { places } else { as_made };
        }
        beam = (all.len()..all.len() + grown.len()).collect();
        all.extend(grown);
    }
    as_made
}

/// Strokes of an ink that can be drawn in a row.
fn longest_run(begun: &Begun, ink: usize, of_ink: &[Vec<usize>], made: &[StrokeRef], bound: usize) -> usize {
    let mut length = 0;
    let mut drawn = begun.drawn.clone();
    let mut oldest = begun.oldest;
    while let Some(&stroke) = of_ink[ink].get(drawn[ink]) {
        let place = begun.next + length;
        let too_early = stroke > place + bound;
        let another_is_due = place >= oldest + bound && stroke != oldest;
        if too_early || another_is_due {
            break;
        }
        drawn[ink] += 1;
        length += 1;
        oldest = oldest_from(oldest, &drawn, of_ink, made);
    }
    length
}

/// The earliest stroke from `place` on that isn't drawn.
fn oldest_from(mut place: usize, drawn: &[usize], of_ink: &[Vec<usize>], made: &[StrokeRef]) -> usize {
    while let Some(stroke) = made.get(place) {
        // Drawn if its ink's next stroke comes later.
        if of_ink[stroke.layer].get(drawn[stroke.layer]).is_some_and(|next| *next <= place) {
            break;
        }
        place += 1;
    }
    place
}

fn drawn_on(begun: &Begun, from: usize, ink: usize, length: usize, of_ink: &[Vec<usize>], made: &[StrokeRef]) -> Begun {
    let mut drawn = begun.drawn.clone();
    drawn[ink] += length;
    let oldest = oldest_from(begun.oldest, &drawn, of_ink, made);
    Begun { drawn, next: begun.next + length, oldest, run: Some((ink, length)), from }
}

/// The places of all strokes, run by run.
fn unrolled(last: &Begun, all: &[Begun], of_ink: &[Vec<usize>]) -> Vec<usize> {
    let mut runs = Vec::new();
    let mut at = last;
    while let Some((ink, length)) = at.run {
        let before = &all[at.from];
        runs.push(&of_ink[ink][before.drawn[ink]..before.drawn[ink] + length]);
        at = before;
    }
    runs.iter().rev().flat_map(|r| r.iter().copied()).collect()
}

/// Shortens the pen-up travel within the runs of one ink: the nearest of the strokes at hand comes next, no stroke
/// farther than `disorder` (a share of all strokes) from its place in `made`, the order before
/// [`arrange`]. Changes of ink stay.
pub fn shorten_travel(drawing: &mut Drawing, made: &[StrokeRef], disorder: f64) {
    let order = drawing.sequence();
    let mut place = vec![0; order.len()];
    let mut ranked: Vec<(StrokeRef, usize)> = made.iter().copied().zip(0..).collect();
    ranked.sort_unstable();
    for (i, stroke) in order.iter().enumerate() {
        match ranked.binary_search_by(|r| r.0.cmp(stroke)) {
            Ok(at) => place[i] = ranked[at].1,
            // Not an order of this drawing.
            Err(_) => return,
        }
    }
    let bound = bound(disorder, order.len());
    let mut out: Vec<usize> = Vec::with_capacity(order.len());
    let stroke_of = |i: usize| -> &Stroke { &drawing.layers[order[i].layer].strokes[order[i].stroke] };
    let mut start = 0;
    while start < order.len() {
        let end = (start..order.len()).find(|i| order[*i].layer != order[start].layer).unwrap_or(order.len());
        let mut waiting: Vec<usize> = (start..end).collect();
        // Those that are due first come first, which is what keeps the rest in time.
        waiting.sort_by_key(|i| place[*i]);
        while !waiting.is_empty() {
            let now = out.len();
            let pen = out.last().and_then(|i| stroke_of(*i).points.last().copied());
            let mut best = (0, f64::INFINITY);
            for (k, i) in waiting.iter().take(WINDOW).enumerate() {
                let early = place[*i] > now + bound;
                let travel = match (pen, stroke_of(*i).points.first()) {
                    (Some(pen), Some(first)) => (first - pen).norm(),
                    _ => 0.0,
                };
                if !early && travel < best.1 {
                    best = (k, travel);
                }
                // Whoever is passed over comes one place later.
                if now + k + 1 > place[*i] + bound {
                    break;
                }
            }
            out.push(waiting.remove(best.0));
        }
        start = end;
    }
    drawing.order = out.into_iter().map(|i| order[i]).collect();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::InkLayer;
    use crate::math::{Rgb, stream};
    use nalgebra::Point2;
    use proptest::prelude::*;
    use rand::RngExt;

    /// A drawing of strokes of these inks, in this order.
    fn drawing(inks: &[usize]) -> Drawing {
        let count = inks.iter().max().map_or(0, |m| m + 1);
        let mut layers: Vec<InkLayer> = (0..count)
            .map(|k| InkLayer {
                name: format!("ink {k}"),
                color: Rgb([[0, 200, 90, 250][k % 4]; 3]),
                width_hint: None,
                strokes: Vec::new(),
            })
            .collect();
        let mut random = stream(5, "strokes", 0);
        let mut order = Vec::new();
        for ink in inks {
            let p = Point2::new(random.random_range(-0.1..0.1), random.random_range(-0.1..0.1));
            order.push(StrokeRef { layer: *ink, stroke: layers[*ink].strokes.len() });
            layers[*ink].strokes.push(Stroke::new(vec![p, Point2::new(p.x + 0.01, p.y)]));
        }
        Drawing { order, ..Drawing::new(0.2, 0.2, layers) }
    }

    fn random_inks(count: usize) -> Vec<usize> {
        let mut random = stream(9, "inks", 0);
        (0..count).map(|_| random.random_range(0..4)).collect()
    }

    fn farthest(made: &[StrokeRef], order: &[StrokeRef]) -> usize {
        let place = |s: &StrokeRef| made.iter().position(|m| m == s).unwrap();
        order.iter().enumerate().map(|(i, s)| i.abs_diff(place(s))).max().unwrap_or(0)
    }

    proptest! {
        #[test]
        fn orders_are_permutations_within_their_bound_and_never_worse(
            inks in proptest::collection::vec(0usize..4, 0..80), disorder in -0.1f64..1.1
        ) {
            let mut d = drawing(&inks);
            let made = d.sequence();
            let report = arrange(&mut d, InkOrder::FewestChanges { disorder });
            let bound = (disorder.clamp(0.0, 1.0) * inks.len() as f64) as usize;
            let check = |d: &Drawing, changes: usize| {
                let mut sorted = d.sequence();
                sorted.sort();
                let mut all = made.clone();
                all.sort();
                prop_assert_eq!(sorted, all);
                prop_assert!(farthest(&made, &d.sequence()) <= bound);
                prop_assert_eq!(d.ink_changes(), changes);
                Ok(())
            };
            check(&d, report.changes_after)?;
            prop_assert!(report.changes_after <= report.changes_before);
            prop_assert!(report.disorder <= disorder.clamp(0.0, 1.0));
            shorten_travel(&mut d, &made, disorder);
            check(&d, report.changes_after)?;
        }
    }

    #[test]
    fn hundreds_of_changes_become_few() {
        let inks = random_inks(1500);
        let changes = |rule| {
            let mut d = drawing(&inks);
            arrange(&mut d, rule)
        };
        let made = changes(InkOrder::AsMade);
        assert!(made.changes_after == made.changes_before && made.changes_before > 900 && made.disorder == 0.0);
        assert_eq!(changes(InkOrder::ByInk { light_to_dark: true }).changes_after, 3);
        assert_eq!(changes(InkOrder::FewestChanges { disorder: 1.0 }).changes_after, 3);
        let mut last = made.changes_before;
        // Sixty strokes either way hold about fifteen of each ink at a time.
        for (disorder, at_most) in [(0.01, 220), (0.04, 60), (0.1, 25), (0.3, 9)] {
            let now = changes(InkOrder::FewestChanges { disorder }).changes_after;
            assert!(now <= at_most && now <= last, "{now} changes at disorder {disorder}");
            last = now;
        }
    }

    #[test]
    fn few_changes_are_the_fewest_of_two_inks() {
        // Two inks by turns: with b places to move, runs of b + 1 fit, then of 2 b + 1 at most.
        let inks: Vec<usize> = (0..40).map(|i| i % 2).collect();
        let mut d = drawing(&inks);
        let exact = fewest(&d.sequence(), 8);
        assert_eq!(arrange(&mut d, InkOrder::FewestChanges { disorder: 0.2 }).changes_after, exact);
    }

    /// Fewest changes over all orders of two inks, by dynamic programming over how many strokes of each are drawn.
    fn fewest(made: &[StrokeRef], bound: usize) -> usize {
        let of: Vec<Vec<usize>> = (0..2).map(|k| (0..made.len()).filter(|i| made[*i].layer == k).collect()).collect();
        let (n, m) = (of[0].len(), of[1].len());
        let mut best = vec![[usize::MAX; 2]; (n + 1) * (m + 1)];
        best[0] = [0, 0];
        for a in 0..=n {
            for b in 0..=m {
                for (ink, count) in [(0, a), (1, b)] {
                    if count == 0 || of[ink][count - 1].abs_diff(a + b - 1) > bound {
                        continue;
                    }
                    let before = best[if ink == 0 { (a - 1) * (m + 1) + b } else { a * (m + 1) + b - 1 }];
                    let turn = before[1 - ink].saturating_add(usize::from(a + b > 1));
                    best[a * (m + 1) + b][ink] = before[ink].min(turn);
                }
            }
        }
        best[n * (m + 1) + m].into_iter().min().unwrap()
    }

    #[test]
    fn light_inks_come_first_and_travel_shrinks() {
        let mut d = drawing(&random_inks(400));
        let made = d.sequence();
        arrange(&mut d, InkOrder::ByInk { light_to_dark: true });
        let mut inks: Vec<usize> = d.order.iter().map(|s| s.layer).collect();
        inks.dedup();
        assert_eq!(inks, [3, 1, 2, 0]);
        let travel = |d: &Drawing| {
            let strokes: Vec<Stroke> =
                d.sequence().iter().map(|s| d.layers[s.layer].strokes[s.stroke].clone()).collect();
            crate::drawing::stroke_order::pen_up_length(&strokes)
        };
        let before = travel(&d);
        shorten_travel(&mut d, &made, 1.0);
        assert!(travel(&d) < 0.4 * before, "{} of {before} m", travel(&d));
        assert_eq!(d.ink_changes(), 3);
    }
}
