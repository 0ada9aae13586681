//! A first tour: the shortest edges that still fit, one after another.
use super::metric::Metric;
use super::neighbours::Tree;

/// Neighbours looked at when fragments are joined.
const JOIN: usize = 6;
const NONE: u32 = u32::MAX;

/// Fragments of a tour: each point knows its up to two neighbours, each end of a fragment the other end.
struct Fragments {
    links: Vec<[u32; 2]>,
    other_end: Vec<u32>,
    count: usize,
}

impl Fragments {
    fn new(n: usize) -> Self {
        Self { links: vec![[NONE; 2]; n], other_end: (0..n as u32).collect(), count: n }
    }

    /// Whether a point still lacks a neighbour.
    fn is_end(&self, i: u32) -> bool {
        self.links[i as usize][1] == NONE
    }

    /// Joins two fragments at these points, if both are ends of different ones.
    fn join(&mut self, a: u32, b: u32) {
        if !self.is_end(a) || !self.is_end(b) || self.other_end[a as usize] == b || a == b {
            return;
        }
        for (from, to) in [(a, b), (b, a)] {
            let links = &mut self.links[from as usize];
            links[usize::from(links[0] != NONE)] = to;
        }
        let (far_a, far_b) = (self.other_end[a as usize], self.other_end[b as usize]);
        self.other_end[far_a as usize] = far_b;
        self.other_end[far_b as usize] = far_a;
        self.count -= 1;
    }

    /// Joins along the given pairs, shortest first.
    fn join_all(&mut self, mut edges: Vec<(f64, u32, u32)>) {
        edges.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for (_, a, b) in edges {
            self.join(a, b);
        }
    }
}

/// A greedy tour of points none of which coincide, given the nearest neighbours of each, nearest first.
pub(super) fn greedy<const K: usize>(points: &[[f64; 2]], nearest: &[[u32; K]], metric: Metric) -> Vec<u32> {
    let mut fragments = Fragments::new(points.len());
    let mut edges = Vec::with_capacity(points.len() * K / 2);
    for (i, near) in nearest.iter().enumerate() {
        for &j in near.iter().take_while(|&&j| j != NONE) {
            // a pair that sees each other is listed once
            if (i as u32) < j || !nearest[j as usize].contains(&(i as u32)) {
                edges.push((metric.distance(points[i], points[j as usize]), i as u32, j));
            }
        }
    }
    fragments.join_all(edges);
    // what is left are ends far from each other: look for neighbours among them alone. The shortest edge between two
    // fragments always fits, so that each round joins some
    while fragments.count > 1 {
        let ends: Vec<u32> = (0..points.len() as u32).filter(|&i| fragments.is_end(i)).collect();
        let tree = Tree::new(&ends.iter().map(|&i| points[i as usize]).collect::<Vec<_>>());
        let end = |place: usize| ends[tree.ids()[place] as usize];
        let mut edges = Vec::new();
        for (place, near) in tree.nearest::<JOIN>().iter().enumerate() {
            let a = end(place);
            for b in near.iter().take_while(|&&j| j != NONE).map(|&j| end(j as usize)) {
                if fragments.other_end[a as usize] != b {
                    edges.push((metric.distance(points[a as usize], points[b as usize]), a, b));
                }
            }
        }
        fragments.join_all(edges);
    }
    walk(&fragments)
}

/// The one fragment from end to end.
fn walk(fragments: &Fragments) -> Vec<u32> {
    let n = fragments.links.len() as u32;
    let Some(mut at) = (0..n).find(|&i| fragments.is_end(i)) else { return Vec::new() };
    let mut tour = Vec::with_capacity(n as usize);
    let mut from = NONE;
    while at != NONE {
        tour.push(at);
        let [a, b] = fragments.links[at as usize];
        (from, at) = (at, if a == from { b } else { a });
    }
    tour
}
