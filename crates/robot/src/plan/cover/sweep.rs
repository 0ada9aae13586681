//! The exact cover of a wall by stretches: a shortest path over them, in their order along the wall.
//!
//! A stretch inside another one never helps, and among the others one that begins farther on also ends farther on. So a cover is a
//! path from stretch to stretch, a stroke is whole when one of them holds it, and the strokes that are cut are counted step by step:
//! going from a stretch to the next cuts those that end between the two ends and begin before the next's beginning.
use rayon::prelude::*;

use super::candidates::Stretch;
use super::ink::{Ink, InkStroke};

/// The best cover.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Swept {
    /// The stretches chosen, in their order along the wall.
    pub stretches: Vec<Stretch>,
    /// Strokes cut.
    pub cut: usize,
    /// Passes from one to the next.
    pub crossings: usize,
}

/// The stretches that are in no other, in their order along the wall.
pub(super) fn undominated(stretches: &[Stretch]) -> Vec<Stretch> {
    let mut sorted = stretches.to_vec();
    // of equal ones the first place stays
    sorted.sort_by(|a, b| a.first.cmp(&b.first).then(b.last.cmp(&a.last)).then(a.place.cmp(&b.place)));
    let mut kept: Vec<Stretch> = Vec::new();
    for s in sorted {
        if kept.last().is_none_or(|k| s.last > k.last) {
            kept.push(s);
        }
    }
    kept
}

/// How often a stroke passes from before column `p` to after column `q` or back: the passes that two stretches need that
/// overlap from `p` to `q`.
pub(super) fn passes(turns: &[usize], p: usize, q: usize) -> usize {
    let mut side = 0_i8;
    let mut count = 0;
    for c in turns {
        let here = if *c < p {
            -1
        } else if *c > q {
            1
        } else {
            0
        };
        if here != 0 {
            count += usize::from(side != 0 && here != side);
            side = here;
        }
    }
    count
}

/// How many strokes end in (`after`, `to`] and begin before `from`, by sums over all columns.
struct Spans {
    columns: usize,
    sums: Vec<u32>,
}

impl Spans {
    fn new(strokes: &[InkStroke], columns: usize) -> Self {
        let mut sums = vec![0_u32; (columns + 1) * (columns + 1)];
        for s in strokes {
            sums[(s.high + 1) * (columns + 1) + s.low + 1] += 1;
        }
        for i in 1..=columns {
            for j in 1..=columns {
                let at = i * (columns + 1) + j;
                sums[at] = sums[at] + sums[at - 1] + sums[at - columns - 1] - sums[at - columns - 2];
            }
        }
        Self { columns, sums }
    }

    fn count(&self, after: usize, to: usize, from: usize) -> u32 {
        let at = |high: usize, low: usize| self.sums[high * (self.columns + 1) + low];
        at(to + 1, from) - at(after + 1, from)
    }
}

/// How few stretches hold all ink; `None` where all together don't. To take the one that reaches farthest, again and again, is exact.
pub(super) fn fewest_stretches(ink: &Ink, stretches: &[Stretch]) -> Option<usize> {
    let list = undominated(stretches);
    let mut count = 0;
    let mut open = ink.next(0);
    let mut k = 0;
    while let Some(column) = open {
        // both ends rise along the list
        while k + 1 < list.len() && list[k + 1].first <= column {
            k += 1;
        }
        let reached = list.get(k).filter(|s| s.first <= column && s.last >= column)?;
        count += 1;
        open = ink.next(reached.last + 1);
    }
    Some(count)
}

/// The cover with the fewest stretches; of these the one that cuts the fewest strokes; of these the one with the fewest passes.
/// The error is the first column with ink that no stretch holds.
pub(super) fn sweep(ink: &Ink, stretches: &[Stretch]) -> Result<Swept, usize> {
    let list = undominated(stretches);
    let (first, last) = ink.ends();
    let spans = Spans::new(&ink.strokes, ink.columns.len());
    let n = list.len();
    // what must be held next after each
    let next: Vec<Option<usize>> = list.iter().map(|s| ink.next(s.last + 1)).collect();
    let joins = |i: usize, j: usize| next[i].is_some_and(|c| list[j].first <= c && list[j].last >= c);
    let price = |i: usize, j: usize| spans.count(list[i].last, list[j].last, list[j].first);
    let starts = |j: usize| list[j].first <= first && list[j].last >= first;
    let ends = |i: usize| list[i].last >= last;
    const NONE: (u32, u32) = (u32::MAX, 0);
    let mut from = vec![NONE; n];
    for j in 0..n {
        let before = (0..j).filter(|i| from[*i] != NONE && joins(*i, j));
        let reached = before.map(|i| (from[i].0 + 1, from[i].1 + price(i, j))).min().unwrap_or(NONE);
        from[j] = if starts(j) { (1, 0) } else { reached };
    }
    let Some(best) = (0..n).filter(|i| ends(*i)).map(|i| from[i]).min().filter(|b| *b != NONE) else {
        return Err(uncovered(ink, stretches));
    };
    let mut to = vec![NONE; n];
    for i in (0..n).rev() {
        let after = (i + 1..n).filter(|j| to[*j] != NONE && joins(i, *j));
        let reaches = after.map(|j| (to[j].0 + 1, to[j].1 + price(i, j))).min().unwrap_or(NONE);
        to[i] = if ends(i) { (0, 0) } else { reaches };
    }
    let on_best = |i: usize, j: usize| {
        from[i] != NONE
            && to[j] != NONE
            && joins(i, j)
            && (from[i].0 + 1 + to[j].0, from[i].1 + price(i, j) + to[j].1) == best
    };
    let edges: Vec<(usize, usize)> =
        (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).filter(|(i, j)| on_best(*i, *j)).collect();
    // edges between the same two ends cost the same
    let mut seams: Vec<(usize, usize)> = edges.iter().map(|(i, j)| (list[*j].first, list[*i].last)).collect();
    seams.sort_unstable();
    seams.dedup();
    let cost = |(p, q): &(usize, usize)| -> usize {
        let cut = ink.strokes.iter().filter(|s| s.low < *p && s.high > *q);
        cut.map(|s| passes(&s.turns, *p, *q)).sum()
    };
    let costs: Vec<usize> = seams.par_iter().map(cost).collect();
    let mut fewest: Vec<Option<(usize, Option<usize>)>> =
        (0..n).map(|j| (starts(j) && from[j] == (1, 0)).then_some((0, None))).collect();
    for j in 0..n {
        for (i, _) in edges.iter().filter(|(_, k)| *k == j) {
            let Some((passed, _)) = fewest[*i] else { continue };
            let seam = seams.binary_search(&(list[j].first, list[*i].last)).unwrap_or(0);
            let total = passed + costs[seam];
            if fewest[j].is_none_or(|f| total < f.0) {
                fewest[j] = Some((total, Some(*i)));
            }
        }
    }
    let end = (0..n)
        .filter(|i| ends(*i) && from[*i] == best)
        .filter_map(|i| fewest[i].map(|f| (f.0, i)))
        .min()
        .ok_or_else(|| uncovered(ink, stretches))?;
    let mut chosen = vec![list[end.1]];
    let mut at = end.1;
    while let Some((_, Some(before))) = fewest[at] {
        chosen.push(list[before]);
        at = before;
    }
    chosen.reverse();
    Ok(Swept { stretches: chosen, cut: best.1 as usize, crossings: end.0 })
}

/// The first column with ink that no stretch holds.
fn uncovered(ink: &Ink, stretches: &[Stretch]) -> usize {
    let held = |c: usize| stretches.iter().any(|s| (s.first..=s.last).contains(&c));
    (0..ink.columns.len()).find(|c| ink.columns[*c].is_some() && !held(*c)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ink(spans: &[(usize, usize)], columns: usize) -> Ink {
        let mut held = vec![None; columns];
        let stroke = |(a, b): &(usize, usize)| {
            let (low, high) = (*a.min(b), *a.max(b));
            InkStroke { layer: 0, stroke: 0, samples: vec![], low, high, turns: vec![*a, *b] }
        };
        let strokes: Vec<InkStroke> = spans.iter().map(stroke).collect();
        for s in &strokes {
            held[s.low..=s.high].fill(Some([1.0, 1.4]));
        }
        Ink { strokes, columns: held }
    }

    fn stretch(first: usize, last: usize, place: usize) -> Stretch {
        Stretch { first, last, place }
    }

    /// Places, strokes cut and passes of every cover, the least of all.
    fn brute(ink: &Ink, stretches: &[Stretch]) -> Option<(usize, usize, usize)> {
        let inked: Vec<usize> = (0..ink.columns.len()).filter(|c| ink.columns[*c].is_some()).collect();
        (1_u32..1 << stretches.len())
            .filter_map(|set| {
                let mut chosen: Vec<Stretch> =
                    (0..stretches.len()).filter(|k| set >> k & 1 == 1).map(|k| stretches[k]).collect();
                let held = |c: &usize| chosen.iter().any(|s| (s.first..=s.last).contains(c));
                if !inked.iter().all(held) {
                    return None;
                }
                let whole = |s: &&InkStroke| chosen.iter().any(|k| k.first <= s.low && k.last >= s.high);
                let cut = ink.strokes.iter().filter(|s| !whole(s)).count();
                chosen.sort();
                let seams = chosen.windows(2).map(|w| {
                    let cut = ink.strokes.iter().filter(|s| s.low < w[1].first && s.high > w[0].last);
                    cut.map(|s| passes(&s.turns, w[1].first, w[0].last)).sum::<usize>()
                });
                Some((chosen.len(), cut, seams.sum()))
            })
            .min()
    }

    #[test]
    fn a_stroke_that_one_place_holds_is_not_cut() {
        let ink = ink(&[(0, 3), (2, 6), (6, 9)], 10);
        // two covers of two: the first cuts the middle stroke, the second doesn't
        let stretches = [stretch(0, 5, 0), stretch(4, 9, 1), stretch(0, 6, 2), stretch(7, 9, 3)];
        let swept = sweep(&ink, &stretches).unwrap();
        assert_eq!((swept.stretches.len(), swept.cut), (2, 0));
        assert_eq!(swept.stretches[0].place, 2);
        assert_eq!(sweep(&ink, &stretches[1..2]), Err(0));
    }

    #[test]
    fn a_pass_is_counted_beyond_the_overlap_alone() {
        assert_eq!(passes(&[0, 9], 3, 5), 1);
        assert_eq!(passes(&[0, 4, 2, 9, 4, 6, 0], 3, 5), 2);
        assert_eq!(passes(&[4, 9, 4], 3, 5), 0);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]
        #[test]
        fn no_cover_of_a_small_wall_is_better(
            spans in prop::collection::vec((0..14_usize, 0..14_usize), 1..7),
            places in prop::collection::vec((0..14_usize, 2..9_usize), 1..9)
        ) {
            let ink = ink(&spans, 14);
            let stretches: Vec<Stretch> =
                places.iter().enumerate().map(|(k, (a, n))| stretch(*a, (a + n).min(13), k)).collect();
            let kept = undominated(&stretches);
            match (sweep(&ink, &stretches), brute(&ink, &kept)) {
                (Ok(s), Some((count, cut, crossings))) => {
                    prop_assert_eq!((s.stretches.len(), s.cut), (count, cut));
                    prop_assert_eq!(fewest_stretches(&ink, &stretches), Some(count));
                    prop_assert_eq!(s.crossings, crossings);
                }
                (Err(column), None) => {
                    prop_assert!(ink.columns[column].is_some() && fewest_stretches(&ink, &stretches).is_none());
                }
                (a, b) => prop_assert!(false, "{a:?} {b:?}"),
            }
        }
    }
}
