//! A k-d tree over points that don't move.
use nalgebra::Point3;

/// Points a leaf holds at most: a few cache lines are searched faster than split.
const LEAF: usize = 12;

/// A balanced k-d tree (J. L. Bentley, doi:10.1145/361002.361007). Ties of distance go to the lower index, so that answers don't
/// depend on how the tree came about.
pub(super) struct KdTree {
    /// Points in the tree's order.
    points: Vec<Point3<f64>>,
    /// Index in the caller's order of each.
    index: Vec<u32>,
    nodes: Vec<Node>,
}

/// An inner node splits its points at `split` along `axis`; a leaf has `axis` 3.
struct Node {
    split: f64,
    axis: u8,
    /// Range of points.
    from: u32,
    to: u32,
    /// Place of the upper child; the lower one comes next in the list.
    upper: u32,
}

impl KdTree {
    /// The tree of `points`, finite, m.
    pub fn new(points: &[Point3<f64>]) -> Self {
        let mut index: Vec<u32> = (0..points.len() as u32).collect();
        let mut nodes = Vec::with_capacity(2 * points.len() / LEAF + 1);
        build(points, &mut index, 0, &mut nodes);
        let sorted = index.iter().map(|&i| points[i as usize]).collect();
        Self { points: sorted, index, nodes }
    }

    /// Calls `found` with index and squared distance (m2) of every point within `radius` (m) of `p`, in an order that depends on
    /// the points alone.
    pub fn within(&self, p: &Point3<f64>, radius: f64, found: &mut impl FnMut(usize, f64)) {
        if !self.nodes.is_empty() {
            self.visit(0, p, radius * radius, found);
        }
    }

    fn visit(&self, node: usize, p: &Point3<f64>, radius2: f64, found: &mut impl FnMut(usize, f64)) {
        let n = &self.nodes[node];
        if n.axis == 3 {
            for i in n.from as usize..n.to as usize {
                let distance2 = (self.points[i] - p).norm_squared();
                if distance2 <= radius2 {
                    found(self.index[i] as usize, distance2);
                }
            }
            return;
        }
        let gap = p[n.axis as usize] - n.split;
        if gap <= 0.0 || gap * gap <= radius2 {
            self.visit(node + 1, p, radius2, found);
        }
        if gap >= 0.0 || gap * gap <= radius2 {
            self.visit(n.upper as usize, p, radius2, found);
        }
    }

    /// The nearest point not farther than `radius` (m): its index and squared distance (m2).
    pub fn nearest(&self, p: &Point3<f64>, radius: f64) -> Option<(usize, f64)> {
        let mut best = Vec::with_capacity(1);
        self.k_nearest(p, 1, radius, &mut best);
        best.first().map(|&(distance2, i)| (i as usize, distance2))
    }

    /// Fills `best` with squared distance (m2) and index of the `k` points nearest to `p` within `radius` (m), nearest first.
    pub fn k_nearest(&self, p: &Point3<f64>, k: usize, radius: f64, best: &mut Vec<(f64, u32)>) {
        best.clear();
        if !self.nodes.is_empty() && k > 0 {
            self.search(0, p, k, radius * radius, best);
        }
    }

    fn search(&self, node: usize, p: &Point3<f64>, k: usize, radius2: f64, best: &mut Vec<(f64, u32)>) {
        let n = &self.nodes[node];
        if n.axis == 3 {
            for i in n.from as usize..n.to as usize {
                let candidate = ((self.points[i] - p).norm_squared(), self.index[i]);
                let worst = if best.len() == k { best[k - 1] } else { (radius2, u32::MAX) };
                if candidate > worst {
                    continue;
                }
                if best.len() == k {
                    best.pop();
                }
                let at = best.partition_point(|b| *b < candidate);
                best.insert(at, candidate);
            }
            return;
        }
        let gap = p[n.axis as usize] - n.split;
        let (near, far) = if gap <= 0.0 { (node + 1, n.upper as usize) } else { (n.upper as usize, node + 1) };
        self.search(near, p, k, radius2, best);
        let reach2 = if best.len() == k { best[k - 1].0 } else { radius2 };
        if gap * gap <= reach2 {
            self.search(far, p, k, radius2, best);
        }
    }
}

fn build(points: &[Point3<f64>], index: &mut [u32], from: usize, nodes: &mut Vec<Node>) {
    if index.is_empty() {
        return;
    }
    let place = nodes.len();
    let to = (from + index.len()) as u32;
    nodes.push(Node { split: 0.0, axis: 3, from: from as u32, to, upper: 0 });
    if index.len() <= LEAF {
        return;
    }
    let first = points[index[0] as usize];
    let (low, high) =
        index.iter().map(|&i| points[i as usize]).fold((first, first), |(l, h), p| (l.inf(&p), h.sup(&p)));
    let axis = (high - low).imax();
    let middle = index.len() / 2;
    let by = |a: &u32, b: &u32| points[*a as usize][axis].total_cmp(&points[*b as usize][axis]).then(a.cmp(b));
    index.select_nth_unstable_by(middle, by);
    nodes[place].split = points[index[middle] as usize][axis];
    nodes[place].axis = axis as u8;
    let (lower, upper) = index.split_at_mut(middle);
    build(points, lower, from, nodes);
    nodes[place].upper = nodes.len() as u32;
    build(points, upper, from + middle, nodes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    prop_compose! {
        /// Points on a coarse lattice, so that many distances are equal.
        fn cloud()(raw in prop::collection::vec((0..12i32, 0..12i32, 0..3i32), 0..300)) -> Vec<Point3<f64>> {
            raw.into_iter().map(|(x, y, z)| Point3::new(x.into(), y.into(), z.into())).collect()
        }
    }

    proptest! {
        #[test]
        fn neighbours_are_those_of_a_search_through_all(
            points in cloud(), x in -1.0..13.0f64, y in -1.0..13.0f64, k in 1..20usize, radius in 0.1..9.0f64,
        ) {
            let tree = KdTree::new(&points);
            let p = Point3::new(x, y, 1.0);
            let mut all: Vec<(f64, u32)> =
                points.iter().enumerate().map(|(i, q)| ((q - p).norm_squared(), i as u32)).collect();
            all.retain(|(d, _)| *d <= radius * radius);
            all.sort_by(|a, b| a.partial_cmp(b).unwrap());
            let mut near = Vec::new();
            tree.within(&p, radius, &mut |i, d| near.push((d, i as u32)));
            near.sort_by(|a, b| a.partial_cmp(b).unwrap());
            prop_assert_eq!(&near, &all);
            let mut best = Vec::new();
            tree.k_nearest(&p, k, radius, &mut best);
            prop_assert_eq!(&best[..], &all[..k.min(all.len())]);
            prop_assert_eq!(tree.nearest(&p, radius).map(|(i, _)| i as u32), all.first().map(|a| a.1));
        }
    }
}
