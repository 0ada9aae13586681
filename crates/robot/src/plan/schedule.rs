//! Whose turn it is: arms share one canvas, and where they would come near each other one of them waits.

/// What an arm does in a piece of its work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// How long it takes, s.
    pub duration: f64,
    /// Whether the arm is over the canvas in it.
    pub over_canvas: bool,
}

/// When the pieces of all arms begin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Schedule {
    /// Start of each piece, s: an entry an arm.
    pub starts: Vec<Vec<f64>>,
    /// How long the arm stands waiting before each piece, s.
    pub waits: Vec<Vec<f64>>,
    /// End of the last piece, s.
    pub end: f64,
    /// Time in which more than one arm is over the canvas, s.
    pub together: f64,
}

impl Schedule {
    /// How long arms stand waiting, s, over all arms.
    pub fn waiting(&self) -> f64 {
        self.waits.iter().flatten().sum()
    }
}

/// A piece of an arm's work: index of the arm, index of the piece.
pub type Turn = (usize, usize);

/// The earliest starts in which each arm's pieces follow one another, and no two arms are over the canvas at once in pieces that
/// `clash`. Of arms that are ready for the canvas, the one that was ready first goes first; of two at the same time, the first.
pub fn schedule(arms: &[Vec<Piece>], clash: &dyn Fn(Turn, Turn) -> bool) -> Schedule {
    let mut plan =
        Schedule { starts: vec![Vec::new(); arms.len()], waits: vec![Vec::new(); arms.len()], ..Schedule::default() };
    let mut ready = vec![0.0; arms.len()];
    // pieces over the canvas that have their time: from, to
    let mut taken: Vec<(Turn, f64, f64)> = Vec::new();
    loop {
        for (a, pieces) in arms.iter().enumerate() {
            while let Some(piece) = pieces.get(plan.starts[a].len()).filter(|p| !p.over_canvas) {
                plan.starts[a].push(ready[a]);
                plan.waits[a].push(0.0);
                ready[a] += piece.duration;
            }
        }
        let waits = |a: &usize| plan.starts[*a].len() < arms[*a].len();
        let next = (0..arms.len()).filter(waits).min_by(|a, b| f64::total_cmp(&ready[*a], &ready[*b]));
        let Some(a) = next else { break };
        let turn = (a, plan.starts[a].len());
        // what is over by then is in nobody's way, also later: no one is ready before this one
        taken.retain(|(_, _, end)| *end > ready[a]);
        let others = || taken.iter().filter(|((b, _), _, _)| *b != a);
        let free = others().filter(|(other, _, _)| clash(turn, *other)).map(|(_, _, end)| *end);
        let start = free.fold(ready[a], f64::max);
        let end = start + arms[a][turn.1].duration;
        plan.together += others().map(|(_, s, e)| (end.min(*e) - start.max(*s)).max(0.0)).sum::<f64>();
        plan.waits[a].push(start - ready[a]);
        plan.starts[a].push(start);
        ready[a] = end;
        taken.push((turn, start, end));
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
        let plan = schedule(&[vec![fetch, draw, fetch, draw], vec![fetch, draw, fetch, draw]], &|_, _| true);
        assert_eq!(plan.starts[0], [0.0, 10.0, 20.0, 30.0]);
        assert_eq!(plan.starts[1], [0.0, 20.0, 30.0, 40.0]);
        assert_eq!((plan.end, plan.waiting(), plan.together), (50.0, 10.0, 0.0));
    }

    #[test]
    fn those_that_keep_apart_draw_together() {
        let [fetch, draw] = [false, true].map(|over_canvas| Piece { duration: 10.0, over_canvas });
        let arms = [vec![fetch, draw, fetch, draw], vec![fetch, draw, fetch, draw]];
        let plan = schedule(&arms, &|a, b| a.1 != b.1);
        assert_eq!((&plan.starts[0], plan.together), (&plan.starts[1], 20.0));
        let plan = schedule(&arms, &|a, b| a.1 == 1 && b.1 == 1);
        assert_eq!(plan.starts[1], [0.0, 20.0, 30.0, 40.0]);
        let plan = schedule(&arms, &|_, _| false);
        assert_eq!((plan.end, plan.waiting(), plan.together), (40.0, 0.0, 20.0));
    }

    proptest! {
        #[test]
        fn pieces_that_clash_are_never_at_the_same_time_and_none_begins_early(
            arms in prop::collection::vec(prop::collection::vec((0.1..9.0f64, any::<bool>()), 0..12), 1..4),
            odd in 1usize..5,
        ) {
            let clash = |a: Turn, b: Turn| (a.0 + 2 * a.1 + b.0 + 2 * b.1).is_multiple_of(odd);
            let arms: Vec<Vec<Piece>> = arms.iter()
                .map(|a| a.iter().map(|(duration, over_canvas)| Piece { duration: *duration, over_canvas: *over_canvas }).collect())
                .collect();
            let plan = schedule(&arms, &clash);
            let mut taken: Vec<(Turn, f64, f64)> = Vec::new();
            for (a, (pieces, starts)) in arms.iter().zip(&plan.starts).enumerate() {
                prop_assert_eq!(pieces.len(), starts.len());
                let mut at = 0.0;
                for (i, (piece, start)) in pieces.iter().zip(starts).enumerate() {
                    prop_assert!(*start >= at - 1e-9);
                    at = start + piece.duration;
                    if piece.over_canvas {
                        taken.push(((a, i), *start, at));
                    }
                }
                prop_assert!(plan.end >= at - 1e-9);
            }
            for (one, start, end) in &taken {
                for (other, s, e) in &taken {
                    prop_assert!(one.0 == other.0 || !clash(*one, *other) || *s >= end - 1e-9 || *start >= e - 1e-9);
                }
            }
        }
    }
}
