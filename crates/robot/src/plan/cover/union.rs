//! The cover by places that reach several stretches at once: round a door, a pillar's shadow, a singular middle.
//!
//! Stretches then are no path any more, and the cover is a set cover (NP-hard), solved by branch and bound over whole numbers.
use microlp::{ComparisonOp, OptimizationDirection, Problem, SolveOptions, Variable};

use super::candidates::Stretch;
use super::ink::Ink;

/// Nodes of the search, at most: the same on every computer.
const NODES: u64 = 2_000;
/// Sets that are searched over, at most.
const SETS: usize = 3_000;

/// The fewest places found, and a number that none can be below.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fewest {
    /// Indices of the places, rising.
    pub places: Vec<usize>,
    pub bound: usize,
}

/// Columns as bits.
type Bits = Vec<u64>;

fn has(set: &Bits, column: usize) -> bool {
    set[column / 64] >> (column % 64) & 1 == 1
}

fn within(a: &Bits, b: &Bits) -> bool {
    a.iter().zip(b).all(|(a, b)| a & !b == 0)
}

/// The fewest places that hold all ink, where place k holds the stretches `sets[k]`. `None` where all together don't, or the search
/// came to nothing within its limits.
pub(super) fn fewest(ink: &Ink, sets: &[Vec<Stretch>]) -> Option<Fewest> {
    let inked: Vec<usize> = (0..ink.columns.len()).filter(|c| ink.columns[*c].is_some()).collect();
    let bits = |stretches: &Vec<Stretch>| {
        let mut set = vec![0_u64; inked.len().div_ceil(64)];
        for (i, c) in inked.iter().enumerate() {
            if stretches.iter().any(|s| (s.first..=s.last).contains(c)) {
                set[i / 64] |= 1 << (i % 64);
            }
        }
        set
    };
    let mut held: Vec<(usize, Bits)> = sets.iter().enumerate().map(|(k, s)| (k, bits(s))).collect();
    let size = |set: &Bits| set.iter().map(|w| w.count_ones()).sum::<u32>();
    held.sort_by_key(|(k, set)| (std::cmp::Reverse(size(set)), *k));
    let mut kept: Vec<(usize, Bits)> = Vec::new();
    for (k, set) in held {
        if size(&set) > 0 && !kept.iter().any(|(_, other)| within(&set, other)) {
            kept.push((k, set));
        }
        if kept.len() > SETS {
            return None;
        }
    }
    let rows = rows(inked.len(), &kept)?;
    let mut problem = Problem::new(OptimizationDirection::Minimize);
    let chosen: Vec<Variable> = kept.iter().map(|_| problem.add_binary_var(1.0)).collect();
    for row in rows {
        let terms: Vec<(Variable, f64)> = row.iter().map(|k| (chosen[*k], 1.0)).collect();
        problem.add_constraint(&terms[..], ComparisonOp::Ge, 1.0);
    }
    let mut options = SolveOptions::default();
    options.node_limit = Some(NODES);
    let outcome = problem.solve_with(options).ok()?;
    let solution = outcome.solution()?;
    let mut places: Vec<usize> =
        kept.iter().zip(&chosen).filter(|(_, v)| solution.var_value(**v) > 0.5).map(|((k, _), _)| *k).collect();
    places.sort_unstable();
    let proven = solution.stats().best_bound.unwrap_or(0.0);
    let bound = ((proven - 1e-6).ceil().max(0.0) as usize).min(places.len());
    Some(Fewest { places, bound })
}

/// For each column who holds it, without those that follow from others. `None` where one is held by none.
fn rows(columns: usize, sets: &[(usize, Bits)]) -> Option<Vec<Vec<usize>>> {
    let holders = |c: usize| (0..sets.len()).filter(|k| has(&sets[*k].1, c)).collect::<Vec<usize>>();
    let mut all: Vec<Vec<usize>> = (0..columns).map(holders).collect();
    if all.iter().any(Vec::is_empty) {
        return None;
    }
    all.sort_by(|a, b| a.len().cmp(&b.len()).then(a.cmp(b)));
    all.dedup();
    let mut rows: Vec<Vec<usize>> = Vec::new();
    for row in all {
        // whoever holds the narrower row holds this one too
        if !rows.iter().any(|r| r.iter().all(|k| row.binary_search(k).is_ok())) {
            rows.push(row);
        }
    }
    Some(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn wall(columns: usize) -> Ink {
        Ink { strokes: Vec::new(), columns: vec![Some([1.0, 1.4]); columns] }
    }

    fn brute(columns: usize, sets: &[Vec<Stretch>]) -> Option<usize> {
        let holds = |k: usize, c: usize| sets[k].iter().any(|s| (s.first..=s.last).contains(&c));
        (1_u32..1 << sets.len())
            .filter(|set| (0..columns).all(|c| (0..sets.len()).any(|k| set >> k & 1 == 1 && holds(k, c))))
            .map(u32::count_ones)
            .min()
            .map(|n| n as usize)
    }

    #[test]
    fn a_place_on_both_sides_of_a_door_counts_once() {
        let s = |first, last, place| Stretch { first, last, place };
        let sets = [vec![s(0, 3, 0), s(6, 9, 0)], vec![s(3, 6, 1)], vec![s(0, 5, 2)], vec![s(6, 9, 3)]];
        let found = fewest(&wall(10), &sets).unwrap();
        assert_eq!((found.places.len(), found.bound), (2, 2));
        assert_eq!(fewest(&wall(11), &sets), None);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]
        #[test]
        fn no_set_of_places_is_smaller(
            places in prop::collection::vec(prop::collection::vec((0..12_usize, 0..5_usize), 1..4), 1..9)
        ) {
            let sets: Vec<Vec<Stretch>> = places
                .iter()
                .enumerate()
                .map(|(k, runs)| runs.iter().map(|(a, n)| Stretch { first: *a, last: (a + n).min(11), place: k }).collect())
                .collect();
            let found = fewest(&wall(12), &sets);
            prop_assert_eq!(found.as_ref().map(|f| f.places.len()), brute(12, &sets));
            prop_assert!(found.is_none_or(|f| f.bound == f.places.len()));
        }
    }
}
