//! A picture cut into a few regions by colour alone.
//!
//! Graph-based segmentation (Felzenszwalb and Huttenlocher, "Efficient graph-based image segmentation", 2004,
//! doi:10.1023/B:VISI.0000022288.19776.77) gives many; these are merged by the full lambda schedule of the piecewise
//! constant Mumford-Shah functional (Koepfler, Lopez and Morel, 1994, doi:10.1137/0731015).
use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

/// How regions are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RegionOptions {
    /// Scale of observation k: larger gives larger regions. In Oklab distance times pixels.
    pub scale: f32,
    /// Smallest region, as a share of the picture.
    pub smallest: f64,
    /// Most regions.
    pub most: usize,
    /// Regions are merged below `most` down to this many while that costs little.
    pub least: usize,
    /// What costs little: colour difference squared times pixels over border length.
    pub cheap: f64,
}

impl Default for RegionOptions {
    fn default() -> Self {
        Self { scale: 1.2, smallest: 0.0015, most: 20, least: 8, cheap: 0.12 }
    }
}

/// What is known of a region.
#[derive(Clone, Debug, Default)]
struct Region {
    area: f64,
    lab: [f64; 3],
    /// Length of the border with each neighbour, px.
    borders: BTreeMap<usize, f64>,
}

/// Cuts a picture, given in Oklab row by row, into regions that are connected; for each pixel the index of its region, in
/// the order of their first pixels.
pub(super) fn regions(lab: &[[f32; 3]], width: usize, options: &RegionOptions) -> Vec<u16> {
    let height = lab.len().checked_div(width).unwrap_or(0);
    let smallest = ((options.smallest * lab.len() as f64) as u32).max(1);
    let mut forest = grow(lab, width, height, options.scale, smallest);
    let labels = numbered((0..lab.len()).map(|i| forest.root(i as u32) as usize).collect());
    let count = labels.iter().max().map_or(0, |m| m + 1);
    let merged = merge(lab, width, &labels, count, options);
    packed(&labels.iter().map(|l| merged[*l]).collect::<Vec<_>>())
}

/// The same labels, at most 65,536 different ones, numbered in the order in which they come.
pub(super) fn packed<T: Copy + Into<usize>>(labels: &[T]) -> Vec<u16> {
    numbered(labels.iter().map(|l| (*l).into()).collect()).into_iter().map(|l| l as u16).collect()
}

/// Labels numbered in the order in which they come.
fn numbered(labels: Vec<usize>) -> Vec<usize> {
    let mut name: Vec<Option<usize>> = vec![None; labels.iter().max().map_or(0, |m| m + 1)];
    let mut next = 0;
    let number = |l: usize| {
        *name[l].get_or_insert_with(|| {
            next += 1;
            next - 1
        })
    };
    labels.into_iter().map(number).collect()
}

/// Disjoint sets of pixels, with the threshold below which each still grows.
struct Forest {
    parent: Vec<u32>,
    size: Vec<u32>,
    limit: Vec<f32>,
}

impl Forest {
    fn root(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            self.parent[i as usize] = self.parent[self.parent[i as usize] as usize];
            i = self.parent[i as usize];
        }
        i
    }

    /// Joins two roots; gives the one that stays.
    fn join(&mut self, a: u32, b: u32) -> u32 {
        let (a, b) = if (self.size[a as usize], b) > (self.size[b as usize], a) { (a, b) } else { (b, a) };
        self.parent[b as usize] = a;
        self.size[a as usize] += self.size[b as usize];
        a
    }
}

fn grow(lab: &[[f32; 3]], width: usize, height: usize, scale: f32, smallest: u32) -> Forest {
    // the sides and diagonals of each pixel towards those after it
    let ways: [(i64, i64); 4] = [(1, 0), (0, 1), (1, 1), (-1, 1)];
    let weight = |a: usize, b: usize| {
        let d: f32 = (0..3).map(|k| (lab[a][k] - lab[b][k]).powi(2)).sum();
        d.sqrt()
    };
    let mut edges: Vec<(u32, u32)> = (0..lab.len())
        .into_par_iter()
        .flat_map_iter(|i| {
            let (x, y) = ((i % width) as i64, (i / width) as i64);
            ways.iter().enumerate().filter_map(move |(k, (dx, dy))| {
                let (nx, ny) = (x + dx, y + dy);
                let inside = nx >= 0 && (nx as usize) < width && (ny as usize) < height;
                inside.then(|| {
                    // bits of a positive float are in its order
                    (weight(i, ny as usize * width + nx as usize).to_bits(), (4 * i + k) as u32)
                })
            })
        })
        .collect();
    edges.par_sort_unstable();
    let n = lab.len();
    let mut forest = Forest { parent: (0..n as u32).collect(), size: vec![1; n], limit: vec![scale; n] };
    let ends = |edge: u32| {
        let (i, (dx, dy)) = (i64::from(edge / 4), ways[edge as usize % 4]);
        ((edge / 4), (i + dy * width as i64 + dx) as u32)
    };
    for (bits, edge) in &edges {
        let (a, b) = ends(*edge);
        let (a, b) = (forest.root(a), forest.root(b));
        let weight = f32::from_bits(*bits);
        if a != b && weight <= forest.limit[a as usize] && weight <= forest.limit[b as usize] {
            let kept = forest.join(a, b) as usize;
            forest.limit[kept] = weight + scale / forest.size[kept] as f32;
        }
    }
    for (_, edge) in &edges {
        let (a, b) = ends(*edge);
        let (a, b) = (forest.root(a), forest.root(b));
        if a != b && forest.size[a as usize].min(forest.size[b as usize]) < smallest {
            forest.join(a, b);
        }
    }
    forest
}

/// For each region the one that it ends up in.
fn merge(lab: &[[f32; 3]], width: usize, labels: &[usize], count: usize, options: &RegionOptions) -> Vec<usize> {
    let mut regions = vec![Region::default(); count];
    for (i, l) in labels.iter().enumerate() {
        regions[*l].area += 1.0;
        (0..3).for_each(|k| regions[*l].lab[k] += f64::from(lab[i][k]));
        for n in [((i + 1) % width != 0).then_some(i + 1), Some(i + width)].into_iter().flatten() {
            if let Some(other) = labels.get(n).filter(|o| *o != l) {
                *regions[*l].borders.entry(*other).or_default() += 1.0;
                *regions[*other].borders.entry(*l).or_default() += 1.0;
            }
        }
    }
    regions.iter_mut().for_each(|r| r.lab = r.lab.map(|v| v / r.area));
    let price = |regions: &[Region], a: usize, b: usize| {
        let (r, s) = (&regions[a], &regions[b]);
        let d: f64 = (0..3).map(|k| (r.lab[k] - s.lab[k]).powi(2)).sum();
        // non-negative, so that its bits are in its order
        (r.area * s.area / (r.area + s.area) * d / r.borders[&b].max(1.0)).to_bits()
    };
    let mut queue: BTreeSet<(u64, usize, usize)> = BTreeSet::new();
    for a in 0..count {
        let later: Vec<usize> = regions[a].borders.keys().copied().filter(|b| *b > a).collect();
        queue.extend(later.into_iter().map(|b| (price(&regions, a, b), a, b)));
    }
    let mut into: Vec<usize> = (0..count).collect();
    let mut left = count;
    while let Some(&(bits, a, b)) = queue.first() {
        if left <= options.least || (left <= options.most && f64::from_bits(bits) > options.cheap) {
            break;
        }
        for (r, s) in [(a, b), (b, a)] {
            let others: Vec<usize> = regions[r].borders.keys().copied().filter(|o| *o != s).collect();
            for o in others {
                queue.remove(&(price(&regions, r.min(o), r.max(o)), r.min(o), r.max(o)));
            }
        }
        queue.remove(&(bits, a, b));
        let gone = std::mem::take(&mut regions[b]);
        let area = regions[a].area + gone.area;
        for k in 0..3 {
            regions[a].lab[k] = (regions[a].lab[k] * regions[a].area + gone.lab[k] * gone.area) / area;
        }
        regions[a].area = area;
        regions[a].borders.remove(&b);
        for (o, length) in gone.borders.into_iter().filter(|(o, _)| *o != a) {
            *regions[a].borders.entry(o).or_default() += length;
            regions[o].borders.remove(&b);
            *regions[o].borders.entry(a).or_default() += length;
        }
        let others: Vec<usize> = regions[a].borders.keys().copied().collect();
        queue.extend(others.into_iter().map(|o| (price(&regions, a.min(o), a.max(o)), a.min(o), a.max(o))));
        into[b] = a;
        left -= 1;
    }
    (0..count)
        .map(|mut r| {
            while into[r] != r {
                r = into[r];
            }
            r
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grey picture with a dark and a light block, and a little texture.
    fn blocks(width: usize, height: usize) -> Vec<[f32; 3]> {
        let tone = |x: usize, y: usize| match (4 * x / width, 4 * y / height) {
            (1, 1 | 2) => 0.2,
            (3, 0) => 0.9,
            _ => 0.5,
        };
        (0..width * height)
            .map(|i| [tone(i % width, i / width) + 0.01 * ((i * 7919 % 13) as f32 / 13.0), 0.0, 0.0])
            .collect()
    }

    #[test]
    fn blocks_of_colour_become_regions() {
        let lab = blocks(80, 60);
        let found = regions(&lab, 80, &RegionOptions { least: 2, ..RegionOptions::default() });
        assert_eq!(found.iter().max(), Some(&2));
        assert_eq!([found[0], found[20 * 80 + 30], found[79]], [0, 2, 1]);
    }

    #[test]
    fn noise_stays_within_the_desired_number() {
        let lab: Vec<[f32; 3]> = (0..64 * 64).map(|i| [((i * 48_271) % 65_537) as f32 / 65_537.0, 0.0, 0.0]).collect();
        let found = regions(&lab, 64, &RegionOptions { smallest: 0.0, ..RegionOptions::default() });
        assert!(*found.iter().max().unwrap() < 20);
        assert_eq!(regions(&[[0.5; 3]], 1, &RegionOptions::default()), [0]);
        assert!(regions(&[], 0, &RegionOptions::default()).is_empty());
    }
}
