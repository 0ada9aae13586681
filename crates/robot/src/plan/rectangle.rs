//! The largest canvas that fits where an arm, or every arm, can draw.
use crate::plan::reach_grid::ReachGrid;
use crate::plan::reachability::{Reach, ReachMap};

/// Which points of a slice can be drawn on: `width` to the right by `height` up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    /// Points to the right.
    pub width: usize,
    /// Points up.
    pub height: usize,
    /// `true` at point (i, j) where `cells[i * height + j]`.
    pub cells: Vec<bool>,
}

impl Mask {
    /// Whether point (i, j) can be drawn on.
    pub fn at(&self, i: usize, j: usize) -> bool {
        self.cells[i * self.height + j]
    }

    /// Number of points that can be drawn on.
    pub fn count(&self) -> usize {
        self.cells.iter().filter(|c| **c).count()
    }

    /// Where all of `maps`, which share a grid, are free in its slice `k`.
    pub fn common(maps: &[&ReachMap], k: usize) -> Self {
        let Some(grid) = maps.first().map(|m| &m.grid) else { return Self { width: 0, height: 0, cells: Vec::new() } };
        let [width, height, _] = grid.size;
        let free = |i, j| maps.iter().all(|m| m.nodes[grid.index([i, j, k])] == Reach::Free);
        let cells = (0..width).flat_map(|i| (0..height).map(move |j| (i, j))).map(|(i, j)| free(i, j)).collect();
        Self { width, height, cells }
    }
}

/// A rectangle on a canvas at one depth, m from the grid's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slice {
    /// Coordinate along the pen's axis.
    pub depth: f64,
    /// Points at this depth that can be drawn on.
    pub points: usize,
    /// Centre of the largest rectangle, right and up; `None` where there is none.
    pub center: Option<[f64; 2]>,
    /// Its width and height; zeros where there is none.
    pub size: [f64; 2],
}

/// The largest rectangle of the aspect `width / height` between points of `mask` that can all be drawn on: left, bottom,
/// width and height in steps of the grid. `None` when no two neighbours on both directions can.
///
/// A rectangle fits where the least block of points round it is full, and each such block lies in one that can't be
/// widened or heightened. Those are listed column by column from the heights of full points (Vandevoorde, The maximal rectangle
/// problem, Dr. Dobb's Journal, 1998), and the desired rectangle is put in the middle of each. Of equally
/// large ones that in the larger block wins, then the first.
pub fn largest(mask: &Mask, aspect: f64) -> Option<[f64; 4]> {
    // run[i]: full points downwards from (i, j), this one included
    let mut run = vec![0_usize; mask.width];
    let mut best: Option<([f64; 4], usize)> = None;
    for j in 0..mask.height {
        for (i, run) in run.iter_mut().enumerate() {
            *run = if mask.at(i, j) { *run + 1 } else { 0 };
        }
        // columns whose runs rise: (first column, run)
        let mut open: Vec<(usize, usize)> = Vec::new();
        for i in 0..=mask.width {
            let here = run.get(i).copied().unwrap_or(0);
            let mut from = i;
            while let Some((first, tall)) = open.last().copied().filter(|(_, tall)| *tall >= here) {
                open.pop();
                from = first;
                if let Some(fitted) = fit(first, i - first, j + 1 - tall.min(j + 1), tall, aspect) {
                    let area = (i - first) * tall;
                    let better =
                        |(b, a): &([f64; 4], usize)| fitted[3] > b[3] + 1e-9 || (fitted[3] > b[3] - 1e-9 && area > *a);
                    if best.as_ref().is_none_or(better) {
                        best = Some((fitted, area));
                    }
                }
            }
            if here > 0 {
                open.push((from, here));
            }
        }
    }
    best.map(|b| b.0)
}

/// The rectangle of `aspect` in the middle of a block of `wide` by `tall` points.
fn fit(left: usize, wide: usize, bottom: usize, tall: usize, aspect: f64) -> Option<[f64; 4]> {
    if wide < 2 || tall < 2 {
        return None;
    }
    let (w, h) = ((wide - 1) as f64, (tall - 1) as f64);
    let height = h.min(w / aspect);
    let width = height * aspect;
    Some([left as f64 + 0.5 * (w - width), bottom as f64 + 0.5 * (h - height), width, height])
}

/// The largest rectangle that all of `maps` (of one grid) can draw on at each depth between `near` and `far`, m along the
/// pen's axis from the grid's origin.
pub fn slices(maps: &[&ReachMap], aspect: f64, near: f64, far: f64) -> Vec<Slice> {
    let Some(grid) = maps.first().map(|m| &m.grid) else { return Vec::new() };
    let within = |k: &usize| (near - 1e-9..=far + 1e-9).contains(&grid.coordinate(2, *k));
    (0..grid.size[2]).filter(within).map(|k| slice(grid, maps, aspect, k)).collect()
}

fn slice(grid: &ReachGrid, maps: &[&ReachMap], aspect: f64, k: usize) -> Slice {
    let mask = Mask::common(maps, k);
    let (depth, points) = (grid.coordinate(2, k), mask.count());
    match largest(&mask, aspect) {
        Some([left, bottom, width, height]) => {
            let at = |d: usize, n: f64| (f64::from(grid.first[d]) + n) * grid.spacing;
            let center = [at(0, left + 0.5 * width), at(1, bottom + 0.5 * height)];
            Slice { depth, points, center: Some(center), size: [width * grid.spacing, height * grid.spacing] }
        }
        None => Slice { depth, points, center: None, size: [0.0; 2] },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn mask(rows: &[&str]) -> Mask {
        let (width, height) = (rows[0].len(), rows.len());
        // the first row of the text is the uppermost
        let cell = |i: usize, j: usize| rows[height - 1 - j].as_bytes()[i] == b'#';
        let cells = (0..width).flat_map(|i| (0..height).map(move |j| (i, j))).map(|(i, j)| cell(i, j)).collect();
        Mask { width, height, cells }
    }

    /// The height of the largest rectangle, by trying every block of points.
    fn slow(mask: &Mask, aspect: f64) -> f64 {
        let mut best: f64 = 0.0;
        for (a, b) in (0..mask.width).flat_map(|a| (a + 1..mask.width).map(move |b| (a, b))) {
            for (c, d) in (0..mask.height).flat_map(|c| (c + 1..mask.height).map(move |d| (c, d))) {
                if (a..=b).all(|i| (c..=d).all(|j| mask.at(i, j))) {
                    best = best.max(((d - c) as f64).min((b - a) as f64 / aspect));
                }
            }
        }
        best
    }

    #[test]
    fn a_rectangle_keeps_its_aspect_and_the_middle_of_its_block() {
        let m = mask(&["......", ".#####", ".#####", ".#####", "##...."]);
        assert_eq!(largest(&m, 1.0), Some([2.0, 1.0, 2.0, 2.0]));
        assert_eq!(largest(&m, 2.0), Some([1.0, 1.0, 4.0, 2.0]));
        assert_eq!(largest(&m, 0.5), Some([2.5, 1.0, 1.0, 2.0]));
        assert_eq!(largest(&mask(&["#.#", ".#.", "#.#"]), 1.0), None);
        assert_eq!(largest(&mask(&["####"]), 1.0), None);
    }

    proptest! {
        #[test]
        fn no_block_holds_a_larger_rectangle(
            cells in prop::collection::vec(prop::bool::weighted(0.8), 63), aspect in 0.3..3.0f64
        ) {
            let m = Mask { width: 9, height: 7, cells };
            let found = largest(&m, aspect);
            prop_assert!((found.map_or(0.0, |r| r[3]) - slow(&m, aspect)).abs() < 1e-9);
            if let Some([left, bottom, width, height]) = found {
                prop_assert!((width - aspect * height).abs() < 1e-9);
                let (a, b) = ((left + 1e-9).floor() as usize, (left + width - 1e-9).ceil() as usize);
                let (c, d) = ((bottom + 1e-9).floor() as usize, (bottom + height - 1e-9).ceil() as usize);
                prop_assert!((a..=b).all(|i| (c..=d).all(|j| m.at(i, j))));
            }
        }
    }
}
