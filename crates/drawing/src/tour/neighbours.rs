//! Nearest neighbours of points in the plane, by a k-d tree.
use rayon::prelude::*;

/// Points below which a range of the tree isn't split further.
const LEAF: usize = 8;
/// Points above which the two halves of a range are built in parallel.
const FORK: usize = 4096;

/// Points in the order of the leaves of a k-d tree; the tree itself is implied by halving.
pub(super) struct Tree {
    /// Points in leaf order.
    points: Vec<[f64; 2]>,
    /// Which given point stands at each place.
    ids: Vec<u32>,
    /// Splits, at heap indices.
    splits: Vec<Split>,
}

/// Points up to `at` on an axis stand in the first half, points from `at` on in the second.
#[derive(Clone, Copy, Default)]
struct Split {
    axis: usize,
    at: f64,
}

/// The nearest found so far, nearest first.
struct Nearest<const K: usize> {
    distance: [f64; K],
    place: [u32; K],
}

impl<const K: usize> Nearest<K> {
    fn offer(&mut self, distance: f64, place: u32) {
        if distance >= self.distance[K - 1] {
            return;
        }
        let mut i = K - 1;
        while i > 0 && self.distance[i - 1] > distance {
            self.distance[i] = self.distance[i - 1];
            self.place[i] = self.place[i - 1];
            i -= 1;
        }
        self.distance[i] = distance;
        self.place[i] = place;
    }
}

impl Tree {
    pub(super) fn new(points: &[[f64; 2]]) -> Self {
        let mut ids: Vec<u32> = (0..points.len() as u32).collect();
        let mut levels = 0;
        while (points.len() >> levels) >= LEAF {
            levels += 1;
        }
        let splits = split(points, &mut ids, levels);
        Self { points: ids.iter().map(|&i| points[i as usize]).collect(), ids, splits }
    }

    /// Given points in leaf order: neighbours in the list are neighbours in the plane.
    pub(super) fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// The places (in leaf order) of the `K` points nearest to each place, nearest first, itself left out;
    /// `u32::MAX` fills up where there are fewer.
    pub(super) fn nearest<const K: usize>(&self) -> Vec<[u32; K]> {
        let of = |i: usize| {
            let mut nearest = Nearest { distance: [f64::INFINITY; K], place: [u32::MAX; K] };
            self.search(0, self.points.len(), 0, i, &mut nearest);
            nearest.place
        };
        (0..self.points.len()).into_par_iter().with_min_len(256).map(of).collect()
    }

    fn search<const K: usize>(&self, lo: usize, hi: usize, node: usize, from: usize, nearest: &mut Nearest<K>) {
        let p = self.points[from];
        if node >= self.splits.len() || hi - lo < LEAF {
            for (i, q) in self.points[lo..hi].iter().enumerate() {
                let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
                if lo + i != from {
                    nearest.offer(dx * dx + dy * dy, (lo + i) as u32);
                }
            }
            return;
        }
        let mid = lo + (hi - lo) / 2;
        let split = self.splits[node];
        let beyond = p[split.axis] - split.at;
        let (left, right) = (2 * node + 1, 2 * node + 2);
        if beyond < 0.0 {
            self.search(lo, mid, left, from, nearest);
            if beyond * beyond < nearest.distance[K - 1] {
                self.search(mid, hi, right, from, nearest);
            }
        } else {
            self.search(mid, hi, right, from, nearest);
            if beyond * beyond < nearest.distance[K - 1] {
                self.search(lo, mid, left, from, nearest);
            }
        }
    }
}

/// Sorts `ids` into leaf order and returns the splits, `levels` deep, at heap indices.
fn split(points: &[[f64; 2]], ids: &mut [u32], levels: u32) -> Vec<Split> {
    let mut splits = vec![Split::default(); (1 << levels) - 1];
    if levels == 0 || ids.len() < LEAF {
        return splits;
    }
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for &i in ids.iter() {
        let p = points[i as usize];
        for a in 0..2 {
            low[a] = low[a].min(p[a]);
            high[a] = high[a].max(p[a]);
        }
    }
    let axis = usize::from(high[1] - low[1] > high[0] - low[0]);
    let mid = ids.len() / 2;
    ids.select_nth_unstable_by(mid, |&a, &b| {
        points[a as usize][axis].total_cmp(&points[b as usize][axis]).then(a.cmp(&b))
    });
    splits[0] = Split { axis, at: points[ids[mid] as usize][axis] };
    let (left, right) = ids.split_at_mut(mid);
    let (left, right) = if left.len() > FORK {
        rayon::join(|| split(points, left, levels - 1), || split(points, right, levels - 1))
    } else {
        (split(points, left, levels - 1), split(points, right, levels - 1))
    };
    // a level of the halves is the next level of the whole, left half first
    for level in 0..levels - 1 {
        let (from, count) = ((1 << level) - 1, 1 << level);
        let to = (1 << (level + 1)) - 1;
        splits[to..to + count].copy_from_slice(&left[from..from + count]);
        splits[to + count..to + 2 * count].copy_from_slice(&right[from..from + count]);
    }
    splits
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn squared(a: [f64; 2], b: [f64; 2]) -> f64 {
        (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)
    }

    proptest! {
        #[test]
        fn neighbours_are_the_nearest(
            even in prop::collection::vec((0.0..1.0f64, 0.0..1.0f64), 0..300),
            grid in prop::collection::vec((0..9i32, 0..9i32), 0..100),
        ) {
            let grid = grid.into_iter().map(|(x, y)| [f64::from(x), f64::from(y)]);
            let points: Vec<[f64; 2]> = even.into_iter().map(|(x, y)| [x, y]).chain(grid).collect();
            let tree = Tree::new(&points);
            let place = |i: u32| points[tree.ids()[i as usize] as usize];
            for (i, near) in (0..).zip(tree.nearest::<8>()) {
                let found: Vec<f64> =
                    near.iter().take_while(|&&j| j != u32::MAX).map(|&j| squared(place(i), place(j))).collect();
                let others = (0..points.len() as u32).filter(|&j| j != i);
                let mut all: Vec<f64> = others.map(|j| squared(place(i), place(j))).collect();
                all.sort_by(f64::total_cmp);
                all.truncate(8);
                prop_assert_eq!(found, all);
            }
        }
    }
}
