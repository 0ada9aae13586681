//! A tour improved in stretches, side by side, whose seams shift from round to round.
use std::time::Instant;

use rand_chacha::rand_core::Rng;
use rayon::prelude::*;

use super::Effort;
use super::kick::{Dice, kick};
use super::lin_kernighan::{NEIGHBOURS, Optimiser};
use super::metric::Metric;
use crate::math::stream;

/// Nodes in a stretch, about.
const STRETCH: f64 = 10_000.0;
/// Shortest tour that is cut into stretches.
const SPLIT: usize = 2000;
/// Kicks per node in a round.
const ROUND: f64 = 0.2;
/// Shortest stretch that is kicked.
const SHORTEST: u32 = 8;
/// Nodes over which kicks that follow each other are strewn.
const SCATTER: u32 = 100;
/// Kicks between looks at the clock.
const BATCH: u64 = 64;

/// Points with their neighbours.
pub(super) struct Map {
    pub(super) metric: Metric,
    pub(super) points: Vec<[f64; 2]>,
    pub(super) neighbours: Vec<[u32; NEIGHBOURS]>,
}

impl Map {
    /// The nodes of a stretch of a tour, numbered in its order; `position` is where each node stands in the tour.
    fn optimiser(&self, stretch: &[u32], first: usize, position: &[u32], seam: bool) -> Optimiser {
        let points: Vec<[f64; 2]> = stretch.iter().map(|&i| self.points[i as usize]).collect();
        let neighbours = stretch.iter().zip(&points).map(|(&i, &p)| {
            let mut found = [(u32::MAX, 0.0); NEIGHBOURS];
            let near = self.neighbours[i as usize].iter().take_while(|&&j| j != u32::MAX);
            let inside = near.filter_map(|&j| {
                let k = (position[j as usize] as usize).wrapping_sub(first);
                points.get(k).map(|&q| (k as u32, self.metric.distance(p, q)))
            });
            for (slot, n) in found.iter_mut().zip(inside) {
                *slot = n;
            }
            found
        });
        let neighbours = neighbours.collect();
        Optimiser::new(self.metric, points, neighbours, seam)
    }
}

fn positions(tour: &[u32]) -> Vec<u32> {
    let mut position = vec![0; tour.len()];
    for (p, &i) in (0..).zip(tour) {
        position[i as usize] = p;
    }
    position
}

/// Lin-Kernighan moves over the whole tour, until none is left.
pub(super) fn settle(map: &Map, tour: &mut [u32]) {
    let position = positions(tour);
    let mut optimiser = map.optimiser(tour, 0, &position, false);
    for i in 0..tour.len() as u32 {
        optimiser.look_at(i);
    }
    optimiser.settle(0.0);
    let new: Vec<u32> = optimiser.tour.order().iter().map(|&i| tour[i as usize]).collect();
    tour.copy_from_slice(&new);
}

/// Kicks, mended by Lin-Kernighan moves, in rounds.
pub(super) fn chain(map: &Map, tour: &mut [u32], effort: Effort, seed: u64, start: Instant) {
    let n = tour.len();
    if n < SHORTEST as usize {
        return;
    }
    let (mut left, deadline) = match effort {
        Effort::Kicks(k) => (k, None),
        Effort::Time(t) => (f64::INFINITY, start.checked_add(t)),
    };
    let count = if n < SPLIT { 1 } else { (n as f64 / STRETCH).round().max(2.0) as usize };
    let size = n.div_ceil(count);
    let mut round = 0;
    let over = || deadline.is_some_and(|d| Instant::now() >= d);
    while left > 0.0 && !over() {
        let mut rng = stream(seed, "tour", round << 32);
        tour.rotate_left((rng.next_u64() % n as u64) as usize);
        let position = positions(tour);
        let share = left.min(ROUND);
        tour.par_chunks_mut(size).enumerate().for_each(|(c, part)| {
            if over() {
                return;
            }
            let m = part.len() as u32;
            if m < SHORTEST {
                return;
            }
            let mut optimiser = map.optimiser(part, c * size, &position, count > 1);
            let mut dice = Dice::new(&mut stream(seed, "tour", round << 32 | (c as u64 + 1)));
            let kicks = (share * f64::from(m)).ceil() as u64;
            for k in 0..kicks {
                if k % BATCH == 0 && over() {
                    break;
                }
                // from one end of the stretch to the other, so that what a kick needs is still in the cache
                let at = (k * u64::from(m) / kicks) as u32;
                kick(&mut optimiser, (at + dice.below(SCATTER)) % m, &mut dice);
            }
            write_back(&optimiser, part);
        });
        left -= share;
        round += 1;
    }
}

/// The nodes of a stretch in their new order, from its first to its last.
fn write_back(optimiser: &Optimiser, part: &mut [u32]) {
    let n = part.len();
    let order = optimiser.tour.order();
    let first = optimiser.tour.position(0) as usize;
    let forwards = optimiser.tour.previous(0) == n as u32 - 1;
    let new: Vec<u32> =
        (0..n).map(|k| part[order[if forwards { (first + k) % n } else { (first + n - k) % n }] as usize]).collect();
    part.copy_from_slice(&new);
}
