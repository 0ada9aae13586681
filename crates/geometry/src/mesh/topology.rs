//! How the triangles of a mesh hang together: glued edges, fans round vertices, components and boundary loops.
use nalgebra::{Point3, Vector3};

/// The half-edge that a boundary half-edge is glued to.
pub(super) const NONE: u32 = u32::MAX;

/// Which half-edges of a list of triangles are glued. Half-edge `3 t + k` runs from corner `k` of triangle `t` to the
/// next one. At most two are glued together, so the surface is a manifold once vertices are split by [`Gluing::fans`].
#[derive(Clone, Debug)]
pub(super) struct Gluing {
    /// For each half-edge the one on its other side, or [`NONE`].
    pub opposite: Vec<u32>,
    /// Edges that more than two triangles share.
    pub crowded_edges: usize,
}

/// The half-edge after `h` in its triangle.
#[inline]
pub(super) fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// The vertex where half-edge `h` starts.
#[inline]
pub(super) fn start(triangles: &[[u32; 3]], h: u32) -> u32 {
    triangles[h as usize / 3][h as usize % 3]
}

impl Gluing {
    /// Glues each edge that two triangles share. Where more meet, the two that continue one another most nearly straight
    /// are glued, then the next two; what is left over ends there.
    pub fn new(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let mut edges: Vec<(u64, u32)> = Vec::with_capacity(3 * triangles.len());
        for h in 0..3 * triangles.len() as u32 {
            let (a, b) = (start(triangles, h), start(triangles, next(h)));
            edges.push(((u64::from(a.min(b)) << 32) | u64::from(a.max(b)), h));
        }
        edges.sort_unstable();
        let mut opposite = vec![NONE; edges.len()];
        let mut crowded_edges = 0;
        for group in edges.chunk_by(|a, b| a.0 == b.0) {
            if let [(_, a), (_, b)] = *group {
                opposite[a as usize] = b;
                opposite[b as usize] = a;
            } else if group.len() > 2 {
                crowded_edges += 1;
                let wings: Vec<(u32, Vector3<f64>)> =
                    group.iter().map(|&(_, h)| (h, wing(vertices, triangles, h))).collect();
                for (a, b) in straightest_pairs(wings) {
                    opposite[a as usize] = b;
                    opposite[b as usize] = a;
                }
            }
        }
        Self { opposite, crowded_edges }
    }

    /// The fan that each corner (numbered as the half-edge that starts there) belongs to, numbered in order of first
    /// appearance; and how many there are. Corners at one vertex that no chain of glued edges joins are apart.
    pub fn fans(&self, triangles: &[[u32; 3]]) -> (Vec<u32>, usize) {
        let mut parent: Vec<u32> = (0..self.opposite.len() as u32).collect();
        for (h, &o) in self.opposite.iter().enumerate() {
            let h = h as u32;
            if o == NONE || o < h {
                continue;
            }
            let (mut a, mut b) = (o, next(o));
            if start(triangles, a) != start(triangles, h) {
                std::mem::swap(&mut a, &mut b);
            }
            union(&mut parent, h, a);
            union(&mut parent, next(h), b);
        }
        let mut number = vec![NONE; parent.len()];
        let mut count = 0;
        let mut fans = Vec::with_capacity(parent.len());
        for corner in 0..parent.len() as u32 {
            let root = root(&mut parent, corner) as usize;
            if number[root] == NONE {
                number[root] = count;
                count += 1;
            }
            fans.push(number[root]);
        }
        (fans, count as usize)
    }

    /// The component of each triangle, numbered in order of first appearance; and how many there are.
    pub fn components(&self) -> (Vec<u32>, usize) {
        let count = self.opposite.len() / 3;
        let mut component = vec![NONE; count];
        let mut found = 0;
        let mut stack = Vec::new();
        for seed in 0..count {
            if component[seed] != NONE {
                continue;
            }
            component[seed] = found;
            stack.push(seed);
            while let Some(t) = stack.pop() {
                for &o in &self.opposite[3 * t..3 * t + 3] {
                    if o != NONE && component[o as usize / 3] == NONE {
                        component[o as usize / 3] = found;
                        stack.push(o as usize / 3);
                    }
                }
            }
            found += 1;
        }
        (component, found as usize)
    }

    /// The boundary as closed loops of half-edges, each in the direction of its triangles: the surface lies at the left.
    /// Triangles must be wound alike.
    pub fn loops(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.opposite.len()];
        let mut loops = Vec::new();
        for first in 0..self.opposite.len() as u32 {
            if self.opposite[first as usize] != NONE || seen[first as usize] {
                continue;
            }
            let mut edges = Vec::new();
            let mut h = first;
            while !seen[h as usize] {
                seen[h as usize] = true;
                edges.push(h);
                h = next(h);
                while self.opposite[h as usize] != NONE {
                    h = next(self.opposite[h as usize]);
                }
            }
            loops.push(edges);
        }
        loops
    }

    /// Euler characteristic: vertices - edges + triangles, with vertices split by fans. 1 for a disc, 2 for a sphere.
    pub fn euler(&self, fans: usize) -> i64 {
        let boundary = self.opposite.iter().filter(|o| **o == NONE).count();
        let edges = (self.opposite.len() + boundary) / 2;
        fans as i64 - edges as i64 + (self.opposite.len() / 3) as i64
    }
}

/// Direction in which the triangle of half-edge `h` leaves that edge, unit (zero without area).
fn wing(vertices: &[Point3<f64>], triangles: &[[u32; 3]], h: u32) -> Vector3<f64> {
    let at = |h: u32| vertices[start(triangles, h) as usize];
    let (a, b, c) = (at(h), at(next(h)), at(next(next(h))));
    // the same direction of the edge for all its triangles, so that rounding doesn't depend on their winding
    let edge = (b - a).try_normalize(0.0).unwrap_or_default();
    let out = c - a;
    (out - edge * edge.dot(&out)).try_normalize(0.0).unwrap_or_default()
}

/// Pairs of half-edges whose wings are most nearly opposite, the best pair first.
fn straightest_pairs(mut wings: Vec<(u32, Vector3<f64>)>) -> Vec<(u32, u32)> {
    /// Past this many triangles on one edge they are paired in order.
    const MOST: usize = 64;
    let mut pairs = Vec::new();
    if wings.len() > MOST {
        return wings.chunks_exact(2).map(|w| (w[0].0, w[1].0)).collect();
    }
    while wings.len() >= 2 {
        let mut best = (f64::INFINITY, 0, 1);
        for i in 0..wings.len() {
            for j in i + 1..wings.len() {
                let bend = wings[i].1.dot(&wings[j].1);
                if bend < best.0 {
                    best = (bend, i, j);
                }
            }
        }
        let b = wings.remove(best.2).0;
        let a = wings.remove(best.1).0;
        pairs.push((a, b));
    }
    pairs
}

/// The first of the set that `i` belongs to, in a forest of sets.
pub(super) fn root(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}

/// Joins the sets of `a` and `b`.
pub(super) fn union(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parent, a), root(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    fn welded(mesh: &crate::mesh::TriMesh) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        crate::mesh::repair::weld(mesh.vertices(), mesh.triangles())
    }

    #[test]
    fn known_shapes_have_their_characteristic() {
        let closed = welded(&shapes::cuboid(&Vector3::new(1.0, 2.0, 3.0), 0.5).unwrap());
        let gluing = Gluing::new(&closed.0, &closed.1);
        assert_eq!(gluing.euler(gluing.fans(&closed.1).1), 2);
        assert!(gluing.loops().is_empty());
        assert_eq!(gluing.components().1, 1);

        let sheet = welded(&shapes::rectangle(1.0, 1.0, 0.0, 0.1).unwrap());
        let gluing = Gluing::new(&sheet.0, &sheet.1);
        assert_eq!(gluing.euler(gluing.fans(&sheet.1).1), 1);
        let loops = gluing.loops();
        assert_eq!((loops.len(), loops[0].len()), (1, 40));
        for pair in loops[0].windows(2) {
            assert_eq!(start(&sheet.1, next(pair[0])), start(&sheet.1, pair[1]));
        }
    }

    #[test]
    fn crossing_sheets_are_glued_straight_on() {
        let v = [[0., 0., 0.], [0., 1., 0.], [1., 0., 0.], [-1., 0., 0.], [0., 0., 1.], [0., 0., -1.]];
        let v: Vec<Point3<f64>> = v.iter().map(|&[x, y, z]| Point3::new(x, y, z)).collect();
        let t = [[0, 1, 2], [0, 1, 4], [1, 0, 3], [1, 0, 5]];
        let gluing = Gluing::new(&v, &t);
        assert_eq!(gluing.crowded_edges, 1);
        assert_eq!((gluing.opposite[0], gluing.opposite[3]), (6, 9));
        assert_eq!(gluing.components().1, 2);
        assert_eq!(gluing.fans(&t).1, 8);
    }
}
