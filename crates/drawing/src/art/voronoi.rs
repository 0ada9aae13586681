//! Weighted Voronoi cells of a density, by the hierarchy of the picture's own tiles.
use rayon::join;

use crate::picture::Plane;

/// Side of the tiles whose cells are summed by one thread at a time, samples.
const BLOCK: usize = 64;

/// Side of the tiles whose samples are compared with each of a handful of sites, samples.
const LEAF: usize = 8;

/// A site of a power diagram, in samples of the density: a sample belongs to the site of least `|sample - site|^2 - power`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Site {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) power: f32,
}

/// What a site's cell holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cell {
    /// Sum of the density.
    pub(super) ink: f64,
    /// Mean of the density, weighted by itself: that of the cell's dark part where an edge runs through it.
    pub(super) density: f64,
    /// Centroid of the ink, samples.
    pub(super) x: f64,
    pub(super) y: f64,
    /// Variance of the ink about its centroid, samples^2.
    pub(super) xx: f64,
    pub(super) xy: f64,
    pub(super) yy: f64,
}

/// Ink, its first and second moments and the sum of the density's square, about a block's corner.
type Moments = [f32; 8];

/// A site that may own samples of a tile; `id` is its index, and inside a block its place among the block's candidates.
#[derive(Clone, Copy)]
struct Candidate {
    x: f32,
    y: f32,
    power: f32,
    id: u32,
}

/// What one block adds to a site's cell.
struct Share {
    site: u32,
    block: (usize, usize),
    moments: Moments,
}

/// Sample centres of a tile: from `x0, y0` to `x1, y1`.
#[derive(Clone, Copy)]
struct Extent {
    x0: f32,
    y0: f32,
    x1: f32,
    y1: f32,
}

impl Extent {
    fn new(x: usize, y: usize, side: usize) -> Self {
        let (x0, y0, reach) = (x as f32 + 0.5, y as f32 + 0.5, (side - 1) as f32);
        Self { x0, y0, x1: x0 + reach, y1: y0 + reach }
    }

    /// Power distance from a site to the nearest place of the tile.
    fn nearest(&self, c: &Candidate) -> f32 {
        let dx = larger(larger(self.x0 - c.x, c.x - self.x1), 0.0);
        let dy = larger(larger(self.y0 - c.y, c.y - self.y1), 0.0);
        dx * dx + dy * dy - c.power
    }

    /// Power distance from a site to the farthest place of the tile.
    fn farthest(&self, c: &Candidate) -> f32 {
        let dx = larger(c.x - self.x0, self.x1 - c.x);
        let dy = larger(c.y - self.y0, self.y1 - c.y);
        dx * dx + dy * dy - c.power
    }

    /// What no owner of a place of the tile is farther than.
    fn bound(&self, candidates: &[Candidate]) -> f32 {
        candidates.iter().fold(f32::INFINITY, |least, c| {
            let d = self.farthest(c);
            if d < least { d } else { least }
        })
    }

    /// Appends to `stack` those of its candidates from `from` to `to` that may own a place of the tile, in their order.
    fn cull(&self, stack: &mut Vec<Candidate>, from: usize, to: usize) {
        let bound = self.bound(&stack[from..to]);
        for i in from..to {
            let c = stack[i];
            if self.nearest(&c) <= bound {
                stack.push(c);
            }
        }
    }
}

/// `f32::max` of numbers only: one instruction.
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The cell of each site: every sample of the density belongs to the nearest site, of equals to the first.
///
/// Tiles of the picture are halved again and again, and only sites that may own a part of a tile go down with it; what is
/// left at the end is tried sample by sample. Blocks are summed in a fixed order, so that the sums are the same bits at any
/// number of threads.
pub(super) fn cells(density: &Plane, sites: &[Site]) -> Vec<Cell> {
    let all: Vec<Candidate> =
        (0..).zip(sites).map(|(id, s)| Candidate { x: s.x, y: s.y, power: s.power, id }).collect();
    let mut side = BLOCK;
    while side < density.width().max(density.height()) {
        side *= 2;
    }
    let mut sums = vec![[0.0f64; 7]; sites.len()];
    for share in descend(density, &all, 0, 0, side) {
        let [m, x, y, xx, xy, yy, dd, _] = share.moments.map(f64::from);
        let (bx, by) = (share.block.0 as f64, share.block.1 as f64);
        let sum = &mut sums[share.site as usize];
        let global = [
            m,
            x + bx * m,
            y + by * m,
            xx + 2.0 * bx * x + bx * bx * m,
            xy + bx * y + by * x + bx * by * m,
            yy + 2.0 * by * y + by * by * m,
            dd,
        ];
        for (s, g) in sum.iter_mut().zip(global) {
            *s += g;
        }
    }
    sums.into_iter()
        .map(|[ink, x, y, xx, xy, yy, dd]| {
            if ink <= 0.0 {
                return Cell::default();
            }
            let (x, y) = (x / ink, y / ink);
            Cell { ink, density: dd / ink, x, y, xx: xx / ink - x * x, xy: xy / ink - x * y, yy: yy / ink - y * y }
        })
        .collect()
}

/// The shares of all blocks in a tile.
fn descend(density: &Plane, candidates: &[Candidate], x: usize, y: usize, side: usize) -> Vec<Share> {
    if x >= density.width() || y >= density.height() || (side == BLOCK && white(density, x, y)) {
        return Vec::new();
    }
    let extent = Extent::new(x, y, side);
    let bound = extent.bound(candidates);
    let near: Vec<Candidate> = candidates.iter().filter(|c| extent.nearest(c) <= bound).copied().collect();
    if side == BLOCK {
        return block(density, near, x, y);
    }
    let half = side / 2;
    let ((mut a, b), (c, d)) = join(
        || join(|| descend(density, &near, x, y, half), || descend(density, &near, x + half, y, half)),
        || join(|| descend(density, &near, x, y + half, half), || descend(density, &near, x + half, y + half, half)),
    );
    a.extend(b.into_iter().chain(c).chain(d));
    a
}

/// Whether a block has no ink.
fn white(density: &Plane, x: usize, y: usize) -> bool {
    let (columns, rows) = (BLOCK.min(density.width() - x), BLOCK.min(density.height() - y));
    (y..y + rows).all(|row| density.values[row * density.width() + x..][..columns].iter().all(|d| *d <= 0.0))
}

/// The shares of one block.
fn block(density: &Plane, mut stack: Vec<Candidate>, x: usize, y: usize) -> Vec<Share> {
    // from here on, coordinates are the block's
    let ids: Vec<u32> = stack.iter().map(|c| c.id).collect();
    for (place, c) in (0..).zip(&mut stack) {
        *c = Candidate { x: c.x - x as f32, y: c.y - y as f32, power: c.power, id: place };
    }
    let mut sums = vec![Moments::default(); stack.len()];
    let count = stack.len();
    quarter(density, &mut stack, (0, count), (x, y), (0, 0), BLOCK, &mut sums);
    let shares = ids.into_iter().zip(sums).filter(|(_, moments)| moments[0] > 0.0);
    shares.map(|(site, moments)| Share { site, block: (x, y), moments }).collect()
}

/// Adds up a tile of a block, whose candidates are those of `stack` in `span`.
fn quarter(
    density: &Plane,
    stack: &mut Vec<Candidate>,
    span: (usize, usize),
    block: (usize, usize),
    at: (usize, usize),
    side: usize,
    sums: &mut [Moments],
) {
    if block.0 + at.0 >= density.width() || block.1 + at.1 >= density.height() {
        return;
    }
    if side == LEAF {
        leaf(density, &stack[span.0..span.1], block, at, sums);
        return;
    }
    let half = side / 2;
    for (dx, dy) in [(0, 0), (half, 0), (0, half), (half, half)] {
        let at = (at.0 + dx, at.1 + dy);
        let from = stack.len();
        Extent::new(at.0, at.1, half).cull(stack, span.0, span.1);
        let to = stack.len();
        quarter(density, stack, (from, to), block, at, half, sums);
        stack.truncate(from);
    }
}

/// Adds up the samples of a leaf.
fn leaf(density: &Plane, candidates: &[Candidate], block: (usize, usize), at: (usize, usize), sums: &mut [Moments]) {
    let (x, y) = (block.0 + at.0, block.1 + at.1);
    let (columns, rows) = (LEAF.min(density.width() - x), LEAF.min(density.height() - y));
    let row = |j: usize| &density.values[(y + j) * density.width() + x..][..columns];
    if (0..rows).all(|j| row(j).iter().all(|d| *d <= 0.0)) {
        return;
    }
    let mut owner = [[0u32; LEAF]; LEAF];
    if let [only] = candidates {
        owner = [[only.id; LEAF]; LEAF];
    } else {
        let mut best = [[f32::INFINITY; LEAF]; LEAF];
        for c in candidates {
            let dx2: [f32; LEAF] = std::array::from_fn(|i| (at.0 as f32 + i as f32 + 0.5 - c.x).powi(2) - c.power);
            let dy2: [f32; LEAF] = std::array::from_fn(|j| (at.1 as f32 + j as f32 + 0.5 - c.y).powi(2));
            for ((best, owner), dy2) in best.iter_mut().zip(&mut owner).zip(dy2) {
                for i in 0..LEAF {
                    let d = dx2[i] + dy2;
                    // a mask, so that no sample is a branch
                    let nearer = u32::from(d < best[i]).wrapping_neg();
                    owner[i] = (c.id & nearer) | (owner[i] & !nearer);
                    best[i] = if d < best[i] { d } else { best[i] };
                }
            }
        }
    }
    let across: [Moments; LEAF] = std::array::from_fn(|i| {
        let u = at.0 as f32 + i as f32 + 0.5;
        [1.0, u, 1.0, u * u, u, 1.0, 0.0, 0.0]
    });
    for (j, owner) in owner.iter().enumerate().take(rows) {
        let v = at.1 as f32 + j as f32 + 0.5;
        let down = [1.0, 1.0, v, 1.0, v, v * v, 0.0, 0.0];
        for ((d, owner), across) in row(j).iter().zip(owner).zip(&across) {
            let sum = &mut sums[*owner as usize];
            for k in 0..8 {
                sum[k] += d * across[k] * down[k];
            }
            sum[6] += d * d;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Every sample with every site.
    fn plainly(density: &Plane, sites: &[Site]) -> Vec<(f64, f64, f64)> {
        let mut sums = vec![(0.0, 0.0, 0.0); sites.len()];
        for row in 0..density.height() {
            for column in 0..density.width() {
                let (x, y) = (column as f32 + 0.5, row as f32 + 0.5);
                let distance = |s: &Site| (x - s.x).powi(2) + (y - s.y).powi(2) - s.power;
                let owner =
                    (0..sites.len()).min_by(|a, b| distance(&sites[*a]).total_cmp(&distance(&sites[*b]))).unwrap();
                let d = f64::from(density.at(column, row));
                sums[owner].0 += d;
                sums[owner].1 += d * f64::from(x);
                sums[owner].2 += d * f64::from(y);
            }
        }
        sums
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn every_sample_belongs_to_its_nearest_site(
            size in (1usize..150, 1usize..150),
            places in proptest::collection::vec((0.0f32..1.0, 0.0f32..1.0, -4.0f32..4.0), 1..60),
        ) {
            let (width, height) = size;
            let density = Plane::from_fn(width, height, |x, y| ((x * 7 + y * 13) % 5) as f32 / 4.0);
            let site = |(x, y, power): &(f32, f32, f32)| Site { x: x * width as f32, y: y * height as f32, power: *power };
            let sites: Vec<Site> = places.iter().map(site).collect();
            for (cell, (ink, x, y)) in cells(&density, &sites).iter().zip(plainly(&density, &sites)) {
                // ties may fall either way by rounding: not more than a few samples
                prop_assert!((cell.ink - ink).abs() <= 3.0, "{} {}", cell.ink, ink);
                prop_assert!((cell.ink - ink).abs() > 1e-3 || (cell.x * cell.ink - x).abs() + (cell.y * cell.ink - y).abs() < 1e-4 * (1.0 + x + y));
            }
        }
    }

    #[test]
    fn a_cell_has_the_moments_of_its_ink() {
        let cell = cells(&Plane::filled(100, 70, 0.5), &[Site { x: 3.0, y: 60.0, power: 0.0 }])[0];
        assert!((cell.ink - 3500.0).abs() < 1e-6 && (cell.density - 0.5).abs() < 1e-6);
        assert!((cell.x - 50.0).abs() < 1e-4 && (cell.y - 35.0).abs() < 1e-4);
        // of samples at centres: (n^2 - 1) / 12
        assert!(
            (cell.xx - 9999.0 / 12.0).abs() < 0.05 && (cell.yy - 4899.0 / 12.0).abs() < 0.05 && cell.xy.abs() < 0.05
        );
    }
}
