//! Whose turn it is: arms share one canvas, and only one of them is over it at a time.

/// What an arm does in a piece of its work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// How long it takes, s.
    pub duration: f64,
    /// Whether the arm is over the canvas in it.
    pub over_canvas: bool,
}

/// When the pieces of all arms begin.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Schedule {
    /// Start of each piece, s: an entry an arm.
    pub starts: Vec<Vec<f64>>,
    /// End of the last piece, s.
    pub end: f64,
    /// How long arms stood waiting for the canvas, s, over all arms.
    pub waiting: f64,
}

/// The earliest starts in which each arm's pieces follow one another, and no two arms are over the canvas at once. Of arms that
/// are ready for it, the one that was ready first goes first; of two at the same time, the first.
pub(super) fn schedule(arms: &[Vec<Piece>]) -> Schedule {
    let mut plan = Schedule { starts: vec![Vec::new(); arms.len()], ..Schedule::default() };
    let mut ready = vec![0.0; arms.len()];
    let mut free = 0.0f64;
    loop {
        for (a, pieces) in arms.iter().enumerate() {
            while let Some(piece) = pieces.get(plan.starts[a].len()).filter(|p| !p.over_canvas) {
                plan.starts[a].push(ready[a]);
                ready[a] += piece.duration;
            }
        }
        let waits = |a: &usize| plan.starts[*a].len() < arms[*a].len();
        let next = (0..arms.len()).filter(waits).min_by(|a, b| f64::total_cmp(&ready[*a], &ready[*b]));
        let Some(a) = next else { break };
        let start = ready[a].max(free);
        plan.waiting += start - ready[a];
        free = start + arms[a][plan.starts[a].len()].duration;
        plan.starts[a].push(start);
        ready[a] = free;
    }
    plan.end = ready.into_iter().fold(0.0, f64::max);
    plan
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn one_fetches_while_the_other_draws() {
        let [fetch, draw] = [false, true].map(|over_canvas| Piece { duration: 10.0, over_canvas });
        let plan = schedule(&[vec![fetch, draw, fetch, draw], vec![fetch, draw, fetch, draw]]);
        assert_eq!(plan.starts[0], [0.0, 10.0, 20.0, 30.0]);
        assert_eq!(plan.starts[1], [0.0, 20.0, 30.0, 40.0]);
        assert_eq!((plan.end, plan.waiting), (50.0, 10.0));
    }

    proptest! {
        #[test]
        fn the_canvas_is_never_shared_and_no_piece_begins_early(
            arms in prop::collection::vec(prop::collection::vec((0.1..9.0f64, any::<bool>()), 0..12), 1..4),
        ) {
            let arms: Vec<Vec<Piece>> = arms.iter()
                .map(|a| a.iter().map(|(duration, over_canvas)| Piece { duration: *duration, over_canvas: *over_canvas }).collect())
                .collect();
            let plan = schedule(&arms);
            let mut taken: Vec<(f64, f64)> = Vec::new();
            for (pieces, starts) in arms.iter().zip(&plan.starts) {
                prop_assert_eq!(pieces.len(), starts.len());
                let mut at = 0.0;
                for (piece, start) in pieces.iter().zip(starts) {
                    prop_assert!(*start >= at - 1e-9);
                    at = start + piece.duration;
                    if piece.over_canvas {
                        taken.push((*start, at));
                    }
                }
                prop_assert!(plan.end >= at - 1e-9);
            }
            taken.sort_by(|a, b| a.0.total_cmp(&b.0));
            prop_assert!(taken.windows(2).all(|w| w[1].0 >= w[0].1 - 1e-9));
        }
    }
}
