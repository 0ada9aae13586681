//! Short tours through points of the plane: the Euclidean travelling-salesman problem.
//!
//! Chained Lin-Kernighan (Applegate, Cook and Rohe, "Chained Lin-Kernighan for Large Traveling Salesman Problems",
//! 2003): a greedy tour is shortened by Lin-Kernighan moves until none is left; then small double bridges are tried
//! all over it, each mended by such moves and taken back if the tour didn't get shorter. A tour of many points is
//! worked on in stretches side by side, which are cut elsewhere in each round.
//!
//! Lengths are in the units of the points.
mod array;
mod exact;
mod greedy;
mod kick;
mod lin_kernighan;
mod metric;
mod neighbours;
mod stretches;
pub mod tsplib;

use std::time::{Duration, Instant};

use nalgebra::Point2;
use thiserror::Error;

use metric::Metric;
use neighbours::Tree;
use stretches::Map;

/// Different points, with the ends of an open tour joined at one, up to which the shortest tour is found for sure.
const EXACT: usize = 9;
/// Most points: places are counted in `u32`, with room for sums of two.
const MOST: usize = 1 << 30;
/// Coordinates up to which lengths can be rounded to whole numbers, and their sums are still exact.
const WHOLE: f64 = (1u64 << 45) as f64;

/// How long to search once no Lin-Kernighan move is left; to come there takes about a second for 100,000 points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effort {
    /// Kicks for each point: the same tour on any machine and at any number of threads. Tours through 20,000 to 100,000
    /// points are 0.4 to 1.3 % longer than the shortest at 0, 0.2 to 0.7 % at 0.3, and 0.15 to 0.4 % at 1.
    Kicks(f64),
    /// Until so much time has gone by since the call, or no Lin-Kernighan move is left, whichever comes last: the tour
    /// depends on the machine.
    Time(Duration),
}

/// What tour is wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct TourOptions {
    /// Whether the tour returns to its first point; an open one may start and end anywhere.
    pub closed: bool,
    /// How long to search.
    pub effort: Effort,
    /// Seed of the kicks.
    pub seed: u64,
    /// Whether each edge counts its length rounded to a whole number, as TSPLIB's `EUC_2D` has it.
    pub rounded: bool,
}

impl Default for TourOptions {
    fn default() -> Self {
        Self { closed: true, effort: Effort::Kicks(0.3), seed: 1, rounded: false }
    }
}

/// Why there is no tour.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum TourError {
    /// A coordinate that is no number.
    #[error("point {index} is at ({x}, {y}): a tour needs finite coordinates")]
    NotFinite {
        /// Which point, from 0.
        index: usize,
        /// Its x.
        x: f64,
        /// Its y.
        y: f64,
    },
    /// An effort that is no number, negative or endless.
    #[error("{kicks} kicks per point: a finite number from 0 on is needed")]
    BadEffort {
        /// As given.
        kicks: f64,
    },
    /// More points than can be counted.
    #[error("{count} points are too many: a tour has at most {MOST}")]
    TooMany {
        /// Points given.
        count: usize,
    },
}

/// A short tour: the indices of all points, each once, in the order of the visit.
///
/// Points may coincide; they come one after another. With an effort of kicks the tour depends on the arguments alone.
///
/// # Errors
/// `NotFinite` names the first bad point; `BadEffort`; `TooMany`.
pub fn solve(points: &[Point2<f64>], options: &TourOptions) -> Result<Vec<u32>, TourError> {
    let start = Instant::now();
    if points.len() > MOST {
        return Err(TourError::TooMany { count: points.len() });
    }
    if let Some(index) = points.iter().position(|p| !(p.x.is_finite() && p.y.is_finite())) {
        return Err(TourError::NotFinite { index, x: points[index].x, y: points[index].y });
    }
    if let Effort::Kicks(kicks) = options.effort
        && !(kicks.is_finite() && kicks >= 0.0)
    {
        return Err(TourError::BadEffort { kicks });
    }
    let size = points.iter().fold(0.0, |m: f64, p| m.max(p.x.abs()).max(p.y.abs()));
    // whole numbers beyond this are as fine as an `f64` gets
    let (metric, scale) = if options.rounded && size < WHOLE { (Metric::whole(), 1.0) } else { (Metric::fine(), size) };
    // all points may be at 0; `+ 0.0` makes one number of 0 and -0
    let scaled = |v: f64| if scale > 0.0 { v / scale + 0.0 } else { 0.0 };
    let places: Vec<[f64; 2]> = points.iter().map(|p| [scaled(p.x), scaled(p.y)]).collect();
    let sorted = sorted_by_place(&places);
    let groups: Vec<&[u32]> = sorted.chunk_by(|&a, &b| places[a as usize] == places[b as usize]).collect();
    let different: Vec<[f64; 2]> = groups.iter().map(|g| places[g[0] as usize]).collect();
    let tour = tour_of_different(&different, metric, options, start);
    Ok(tour.iter().flat_map(|&g| groups[g as usize]).copied().collect())
}

/// Length of a tour; with `closed` from its last point back to the first, too.
///
/// # Panics
/// If `order` names a point that isn't there.
pub fn length(points: &[Point2<f64>], order: &[u32], closed: bool) -> f64 {
    edges(points, order, closed).sum()
}

/// Length of a tour as TSPLIB's `EUC_2D` has it: each edge rounded to the nearest whole number.
///
/// # Panics
/// If `order` names a point that isn't there.
pub fn rounded_length(points: &[Point2<f64>], order: &[u32], closed: bool) -> f64 {
    edges(points, order, closed).map(|d| (d + 0.5).floor()).sum()
}

fn edges(points: &[Point2<f64>], order: &[u32], closed: bool) -> impl Iterator<Item = f64> {
    let back = if closed { order.first() } else { None };
    let ends = order.iter().zip(order.iter().skip(1).chain(back));
    ends.map(|(&a, &b)| (points[a as usize] - points[b as usize]).norm())
}

/// Indices of the points, those at one place side by side.
fn sorted_by_place(places: &[[f64; 2]]) -> Vec<u32> {
    let mut ids: Vec<u32> = (0..places.len() as u32).collect();
    ids.sort_unstable_by(|&a, &b| {
        let (p, q) = (places[a as usize], places[b as usize]);
        p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])).then(a.cmp(&b))
    });
    ids
}

/// A short tour of points none of which coincide.
fn tour_of_different(points: &[[f64; 2]], metric: Metric, options: &TourOptions, start: Instant) -> Vec<u32> {
    // an open tour is a closed one through a point that is near everywhere
    const NOWHERE: [f64; 2] = [f64::NAN; 2];
    let nowhere = points.len() as u32;
    let nodes = points.len() + usize::from(!options.closed);
    let (tour, ids) = if nodes <= EXACT {
        let all: Vec<[f64; 2]> = points.iter().copied().chain((!options.closed).then_some(NOWHERE)).collect();
        (exact::shortest(&all, metric), (0..nodes as u32).collect())
    } else {
        let tree = Tree::new(points);
        let mut ids = tree.ids().to_vec();
        let mut neighbours = tree.nearest();
        let mut nodes: Vec<[f64; 2]> = ids.iter().map(|&i| points[i as usize]).collect();
        let mut tour = greedy::greedy(&nodes, &neighbours, metric);
        if !options.closed {
            for near in &mut neighbours {
                near.rotate_right(1);
                near[0] = nowhere;
            }
            ids.push(nowhere);
            nodes.push(NOWHERE);
            neighbours.push([u32::MAX; _]);
            tour.push(nowhere);
        }
        let map = Map { metric, points: nodes, neighbours };
        stretches::settle(&map, &mut tour);
        stretches::chain(&map, &mut tour, options.effort, options.seed, start);
        (tour, ids)
    };
    let mut tour: Vec<u32> = tour.iter().map(|&i| ids[i as usize]).collect();
    if let Some(at) = tour.iter().position(|&i| i == nowhere) {
        tour.rotate_left(at);
        tour.remove(0);
    }
    tour
}

#[cfg(test)]
mod tests;
