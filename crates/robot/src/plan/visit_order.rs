//! Which visits of arms to a shared canvas must have ended before another may begin: an action dependency graph.
//!
//! A schedule of planned durations gives the order; it is then kept whatever the durations really are, so no plan is made anew and no
//! arm waits for ever (Hönig et al. 2019, Persistent and Robust Execution of MAPF Schedules in Warehouses,
//! doi:10.1109/LRA.2019.2894217).
use rayon::prelude::*;

use super::schedule::{Piece, Turn, schedule};
use super::{Segment, Space, Sweep, Zone};
use crate::robot::ArmModel;

/// For each visit, the visits of other arms that come before it.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct VisitOrder {
    before: Vec<Vec<Vec<Turn>>>,
}

impl VisitOrder {
    /// Arms that are in nobody's way.
    pub fn free(arms: usize) -> Self {
        Self { before: vec![Vec::new(); arms] }
    }

    /// Who waits for whom: arms are over the canvas together where the cells that they sweep with a margin around them are not the same. `visits` are the
    /// segments of each visit by arm, `margin` is in m, `change` how long an arm is away between two visits, s.
    pub fn between(visits: &[Vec<Vec<Segment>>], models: &[ArmModel], margin: f64, change: f64) -> Self {
        if visits.len() < 2 {
            return Self::free(visits.len());
        }
        let swept = |(visits, arm): (&Vec<Vec<Segment>>, &ArmModel)| -> Vec<Sweep> {
            visits.par_iter().map(|v| Sweep::new(arm, &v.iter().collect::<Vec<_>>())).collect()
        };
        let sweeps: Vec<Vec<Sweep>> = visits.iter().zip(models).map(swept).collect();
        // for each pair of arms the zones of either in the space that both reach
        let mut zones: Vec<Vec<[Vec<Zone>; 2]>> = Vec::new();
        for a in 0..sweeps.len() {
            zones.push(Vec::new());
            for b in 0..a {
                let [one, other] = [a, b].map(|i| sweeps[i].iter().collect::<Vec<_>>());
                let space = Space::between(&one, &other, margin);
                zones[a].push([a, b].map(|i| sweeps[i].par_iter().map(|s| space.zone(s)).collect()));
            }
        }
        let clash = |(a, i): Turn, (b, j): Turn| {
            let (a, i, b, j) = if a > b { (a, i, b, j) } else { (b, j, a, i) };
            let [one, other] = &zones[a][b];
            one[i].meets(&other[j])
        };
        let durations: Vec<Vec<f64>> =
            visits.iter().map(|visits| visits.iter().map(|v| v.last().map_or(0.0, Segment::end)).collect()).collect();
        Self::of(&durations, change, &clash)
    }

    /// The order of the visits of arms: `visits` has how long each of them is planned to take, s, by arm; before each visit an arm is
    /// away for `between` s. No two visits that `clash` are ever at the same time.
    pub fn of(visits: &[Vec<f64>], between: f64, clash: &dyn Fn(Turn, Turn) -> bool) -> Self {
        let away = Piece { duration: between, over_canvas: false };
        let pieces: Vec<Vec<Piece>> = visits
            .iter()
            .map(|v| v.iter().flat_map(|d| [away, Piece { duration: *d, over_canvas: true }]).collect())
            .collect();
        let clash_of = |a: Turn, b: Turn| clash((a.0, a.1 / 2), (b.0, b.1 / 2));
        let plan = schedule(&pieces, &clash_of);
        let start = |(a, i): Turn| plan.starts[a][2 * i + 1];
        let before = |turn: Turn| -> Vec<Turn> {
            let others = (0..visits.len()).filter(|b| *b != turn.0);
            // of each other arm the last one that clashes is enough: its visits follow one another
            let last = |b: usize| {
                let earlier =
                    (0..visits[b].len()).rev().map(|j| (b, j)).filter(|o| precedes(start(*o), *o, start(turn), turn));
                earlier.into_iter().find(|o| clash(turn, *o))
            };
            others.filter_map(last).collect()
        };
        Self { before: (0..visits.len()).map(|a| (0..visits[a].len()).map(|i| before((a, i))).collect()).collect() }
    }

    /// How many arms there are.
    pub fn arms(&self) -> usize {
        self.before.len()
    }

    /// The visits that must have ended before this one may begin.
    pub fn before(&self, arm: usize, visit: usize) -> &[Turn] {
        self.before.get(arm).and_then(|v| v.get(visit)).map_or(&[], Vec::as_slice)
    }
}

/// Whether one visit is scheduled before another; of two at the same time the one of the first arm is.
fn precedes(start: f64, one: Turn, other_start: f64, other: Turn) -> bool {
    start < other_start || (start == other_start && one < other)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn nobody_waits_for_ever_and_what_clashes_is_ordered(
            visits in prop::collection::vec(prop::collection::vec(0.1..9.0f64, 0..8), 1..5), odd in 1usize..5,
        ) {
            let clash = |a: Turn, b: Turn| (a.0 + 2 * a.1 + b.0 + 2 * b.1).is_multiple_of(odd);
            let order = VisitOrder::of(&visits, 5.0, &clash);
            // carry visits out one at a time, whichever is free: all get done
            let mut done = vec![0; visits.len()];
            let mut sequence = Vec::new();
            let free = |done: &[usize], a: usize| {
                done[a] < visits[a].len() && order.before(a, done[a]).iter().all(|(b, j)| done[*b] > *j)
            };
            while let Some(a) = (0..visits.len()).rev().find(|a| free(&done, *a)) {
                sequence.push((a, done[a]));
                done[a] += 1;
            }
            prop_assert!(done.iter().zip(&visits).all(|(d, v)| *d == v.len()));
            // of two that clash, one always waits for the other, directly or through an earlier visit
            for (a, list) in visits.iter().enumerate() {
                for i in 0..list.len() {
                    for (b, others) in visits.iter().enumerate().filter(|(b, _)| *b != a) {
                        for j in (0..others.len()).filter(|j| clash((a, i), (b, *j))) {
                            let waits = |x: Turn, y: Turn| order.before(x.0, x.1).iter().any(|(c, k)| *c == y.0 && *k >= y.1);
                            prop_assert!(waits((a, i), (b, j)) || waits((b, j), (a, i)), "{a} {i} and {b} {j}");
                        }
                    }
                }
            }
        }
    }
}
