//! Which strokes are painted: the one that lowers the difference most, again and again.
use std::cmp::Ordering;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::canvas::Canvas;
use super::growth::{Candidate, Habits, Layer, Seed, grow};
use super::mask::Mask;

/// Seeds looked at again at once. A fixed number, so that the outcome doesn't depend on the number of threads.
const BATCH: usize = 48;
/// Side of the tiles whose last change is remembered, px.
const TILE: usize = 16;

/// The worth of a seed's best stroke when it was last looked at. Strokes only get worse as the canvas fills, so that is about
/// the most it can be worth now, and seeds far down the heap need not be looked at again (M. Minoux 1978, accelerated greedy).
#[derive(PartialEq)]
struct Promise {
    worth: f64,
    seed: usize,
}

impl Eq for Promise {}

impl Ord for Promise {
    fn cmp(&self, other: &Self) -> Ordering {
        self.worth.total_cmp(&other.worth).then(other.seed.cmp(&self.seed))
    }
}

impl PartialOrd for Promise {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Strokes being chosen for a canvas.
pub(super) struct Selection<'a> {
    layers: &'a [Layer],
    habits: Habits,
    inks: usize,
    seeds: Vec<Seed>,
    /// What grew from each seed, and at which count of painted strokes that was.
    grown: Vec<(Option<Candidate>, u32)>,
    /// Promises by ink.
    heaps: Vec<BinaryHeap<Promise>>,
    /// Count of painted strokes at the last change of each tile.
    changed: Vec<u32>,
    tiles: usize,
    mask: Mask,
    painted: u32,
}

impl<'a> Selection<'a> {
    pub fn new(canvas: &Canvas, layers: &'a [Layer], habits: Habits, inks: usize, seeds: Vec<Seed>) -> Self {
        let tiles = canvas.width.div_ceil(TILE);
        let mut selection = Self {
            layers,
            habits,
            inks,
            grown: vec![(None, 0); seeds.len()],
            heaps: (0..inks).map(|_| BinaryHeap::new()).collect(),
            changed: vec![0; tiles * canvas.height.div_ceil(TILE)],
            tiles,
            mask: Mask::new(canvas.width, canvas.height),
            painted: 0,
            seeds,
        };
        let all: Vec<usize> = (0..selection.seeds.len()).collect();
        selection.look_again(canvas, &all);
        selection
    }

    /// Paints up to `budget` strokes and gives them in their order. The pen stays the same while its best stroke is worth
    /// at least `patience` of the best of all.
    pub fn paint(mut self, canvas: &mut Canvas, budget: usize, patience: f64) -> Vec<Candidate> {
        let mut strokes: Vec<Candidate> = Vec::new();
        let mut pen = None;
        while strokes.len() < budget {
            self.freshen(canvas);
            let worth = |ink: usize| self.heaps[ink].peek().map_or(0.0, |p| p.worth);
            let Some(best) =
                (0..self.inks).filter(|i| worth(*i) > 0.0).reduce(|a, b| if worth(b) > worth(a) { b } else { a })
            else {
                break;
            };
            let ink = pen.filter(|ink| worth(*ink) > 0.0 && worth(*ink) >= patience * worth(best)).unwrap_or(best);
            let Some(promise) = self.heaps[ink].pop() else { break };
            let Some(stroke) = self.grown[promise.seed].0.take() else { continue };
            let mask = &mut self.mask;
            stroke.sweep(self.layers, mask);
            if canvas.exact_gain(mask.pixels(), ink) <= 0.0 {
                continue;
            }
            canvas.paint(mask.pixels(), ink);
            self.painted += 1;
            let [x0, y0, x1, y1] = stroke.bounds;
            for y in y0 / TILE..y1.div_ceil(TILE) {
                self.changed[y * self.tiles + x0 / TILE..y * self.tiles + x1.div_ceil(TILE)].fill(self.painted);
            }
            // Its seed may well grow another, which takes a look: promise the old worth for now.
            self.grown[promise.seed] = (Some(stroke.clone()), 0);
            self.heaps[ink].push(promise);
            strokes.push(stroke);
            pen = Some(ink);
        }
        strokes
    }

    /// Looks again at seeds until the best of each ink is true to the canvas.
    fn freshen(&mut self, canvas: &Canvas) {
        loop {
            let mut stale = Vec::new();
            for ink in 0..self.inks {
                while stale.len() < BATCH {
                    let Some(top) = self.heaps[ink].peek() else { break };
                    if self.is_fresh(top.seed) {
                        break;
                    }
                    stale.push(top.seed);
                    self.heaps[ink].pop();
                }
            }
            if stale.is_empty() {
                return;
            }
            self.look_again(canvas, &stale);
        }
    }

    /// Whether nothing under a seed's stroke has changed since it was grown.
    fn is_fresh(&self, seed: usize) -> bool {
        let (Some(stroke), when) = &self.grown[seed] else { return true };
        let [x0, y0, x1, y1] = stroke.bounds;
        (y0 / TILE..y1.div_ceil(TILE)).all(|y| {
            let row = &self.changed[y * self.tiles + x0 / TILE..y * self.tiles + x1.div_ceil(TILE)];
            row.iter().all(|changed| changed <= when)
        })
    }

    /// Grows strokes from these seeds as the canvas is now, and files their promises.
    fn look_again(&mut self, canvas: &Canvas, seeds: &[usize]) {
        let (all, layers, habits, inks) = (&self.seeds, self.layers, &self.habits, self.inks);
        let grown: Vec<Option<Candidate>> =
            seeds.par_iter().with_min_len(8).map(|s| grow(all[*s], layers, habits, canvas, inks)).collect();
        for (seed, grown) in seeds.iter().zip(grown) {
            if let Some(stroke) = &grown {
                self.heaps[stroke.ink].push(Promise { worth: stroke.worth, seed: *seed });
            }
            self.grown[*seed] = (grown, self.painted);
        }
    }
}
