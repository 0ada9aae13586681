//! One patch of surface: what the points bear out, in one piece, without branches, with small holes closed.
use std::collections::HashMap;

use nalgebra::{Point3, Vector3};

use super::nets::Net;

/// The edges of triangles, undirected, with the triangles at them, sorted.
pub(super) struct Edges {
    /// `(lower vertex, higher vertex, triangle)`.
    list: Vec<[u32; 3]>,
}

impl Edges {
    pub fn new(triangles: &[[u32; 3]]) -> Self {
        let mut list = Vec::with_capacity(3 * triangles.len());
        for (t, corners) in triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                list.push([a.min(b), a.max(b), t as u32]);
            }
        }
        list.sort_unstable();
        Self { list }
    }

    /// Each edge once: its triangles, with the two vertices in each entry.
    pub fn groups(&self) -> impl Iterator<Item = &[[u32; 3]]> {
        self.list.chunk_by(|a, b| a[..2] == b[..2])
    }

    /// Vertices that lie on an edge of one triangle.
    pub fn boundary(&self, vertices: usize) -> Vec<bool> {
        let mut on = vec![false; vertices];
        for g in self.groups().filter(|g| g.len() == 1) {
            on[g[0][0] as usize] = true;
            on[g[0][1] as usize] = true;
        }
        on
    }
}

/// Names joined into sets.
struct Sets(Vec<u32>);

impl Sets {
    fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }
    fn find(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            self.0[i as usize] = self.0[self.0[i as usize] as usize];
            i = self.0[i as usize];
        }
        i
    }
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        // the lower name stays, so that names don't depend on the order of joining
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// Drops the triangles that have a vertex which no point bears out, but keeps those that close a hole: that hang together, without
/// reaching an outer edge of the net, over an extent of at most `hole` (m).
pub(super) fn trim(net: &mut Net, borne_out: &[bool], hole: f64) {
    let Net { vertices, triangles } = net;
    let edges = Edges::new(triangles);
    let outer = edges.boundary(vertices.len());
    let bad: Vec<bool> = triangles.iter().map(|t| t.iter().any(|&v| !borne_out[v as usize])).collect();
    // triangles that share a vertex which isn't borne out hang together
    let mut sets = Sets::new(triangles.len());
    let mut first_at: Vec<Option<u32>> = vec![None; vertices.len()];
    for (t, corners) in triangles.iter().enumerate().filter(|(t, _)| bad[*t]) {
        for &v in corners.iter().filter(|v| !borne_out[**v as usize]) {
            match first_at[v as usize] {
                Some(other) => sets.join(other, t as u32),
                None => first_at[v as usize] = Some(t as u32),
            }
        }
    }
    let mut open = vec![false; triangles.len()];
    let mut boxes: Vec<Option<(Point3<f64>, Point3<f64>)>> = vec![None; triangles.len()];
    for (t, corners) in triangles.iter().enumerate().filter(|(t, _)| bad[*t]) {
        let set = sets.find(t as u32) as usize;
        for &v in corners {
            open[set] |= outer[v as usize];
            if !borne_out[v as usize] {
                let p = vertices[v as usize];
                boxes[set] = Some(boxes[set].map_or((p, p), |(l, h)| (l.inf(&p), h.sup(&p))));
            }
        }
    }
    let small = |b: &Option<(Point3<f64>, Point3<f64>)>| b.is_some_and(|(l, h)| (h - l).norm() <= hole);
    let mut t = 0;
    triangles.retain(|_| {
        let set = sets.find(t) as usize;
        let keep = !bad[t as usize] || (!open[set] && small(&boxes[set]));
        t += 1;
        keep
    });
}

/// Makes the net a manifold with boundary: drops triangles at edges that more than two share, parts vertices where sheets touch in a
/// point, and keeps the piece for which `desired` (given a vertex index) is least.
pub(super) fn one_piece(net: &mut Net, desired: impl Fn(&Point3<f64>) -> f64) {
    let branching: Vec<bool> = {
        let mut branching = vec![false; net.triangles.len()];
        for g in Edges::new(&net.triangles).groups().filter(|g| g.len() > 2) {
            g.iter().for_each(|e| branching[e[2] as usize] = true);
        }
        branching
    };
    let mut t = 0;
    net.triangles.retain(|_| {
        t += 1;
        !branching[t - 1]
    });
    let edges = Edges::new(&net.triangles);
    let mut pieces = Sets::new(net.triangles.len());
    edges.groups().filter(|g| g.len() == 2).for_each(|g| pieces.join(g[0][2], g[1][2]));
    let best = net
        .triangles
        .iter()
        .enumerate()
        .map(|(t, corners)| {
            (corners.iter().map(|&v| desired(&net.vertices[v as usize])).fold(f64::INFINITY, f64::min), t)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let Some((_, best)) = best else { return };
    let kept = pieces.find(best as u32);
    let mut t = 0;
    net.triangles.retain(|_| {
        t += 1;
        pieces.find(t - 1) == kept
    });
    part_fans(net);
    drop_unused(net);
}

/// Gives each fan of triangles round a vertex a vertex of its own.
fn part_fans(net: &mut Net) {
    // a corner is `3 t + k`; corners at one vertex whose triangles share an edge there are one fan
    let mut fans = Sets::new(3 * net.triangles.len());
    let corner = |t: u32, v: u32| 3 * t + net.triangles[t as usize].iter().position(|c| *c == v).unwrap_or(0) as u32;
    for g in Edges::new(&net.triangles).groups().filter(|g| g.len() == 2) {
        let (s, t) = (g[0][2], g[1][2]);
        for v in [g[0][0], g[0][1]] {
            fans.join(corner(s, v), corner(t, v));
        }
    }
    let mut fan_of: Vec<Option<u32>> = vec![None; net.vertices.len()];
    let mut copy_of: HashMap<u32, u32> = HashMap::new();
    for t in 0..net.triangles.len() {
        for k in 0..3 {
            let v = net.triangles[t][k];
            let fan = fans.find((3 * t + k) as u32);
            if *fan_of[v as usize].get_or_insert(fan) == fan {
                continue;
            }
            let vertices = &mut net.vertices;
            let copy = *copy_of.entry(fan).or_insert_with(|| {
                vertices.push(vertices[v as usize]);
                vertices.len() as u32 - 1
            });
            net.triangles[t][k] = copy;
        }
    }
}

/// Drops triangles that hang on by a single edge, or by none: teeth of a trimmed edge, whose corner would be a sliver once smoothed.
pub(super) fn without_teeth(net: &mut Net) {
    for _ in 0..10 {
        let mut shared = vec![0u8; net.triangles.len()];
        for g in Edges::new(&net.triangles).groups().filter(|g| g.len() == 2) {
            g.iter().for_each(|e| shared[e[2] as usize] += 1);
        }
        let before = net.triangles.len();
        let mut t = 0;
        net.triangles.retain(|_| {
            t += 1;
            shared[t - 1] >= 2
        });
        if net.triangles.len() == before {
            break;
        }
    }
}

/// Drops the vertices that no triangle uses; the others keep their order.
pub(super) fn drop_unused(net: &mut Net) {
    let mut used = vec![false; net.vertices.len()];
    net.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    let mut place = vec![0; used.len()];
    let mut kept = Vec::new();
    for (v, _) in used.iter().enumerate().filter(|(_, u)| **u) {
        place[v] = kept.len() as u32;
        kept.push(net.vertices[v]);
    }
    net.triangles.iter_mut().flatten().for_each(|v| *v = place[*v as usize]);
    net.vertices = kept;
}

/// Vertices next to each vertex, sorted.
pub(super) fn neighbours(net: &Net) -> Vec<Vec<u32>> {
    let mut near = vec![Vec::new(); net.vertices.len()];
    for g in Edges::new(&net.triangles).groups() {
        let [a, b, _] = g[0];
        near[a as usize].push(b);
        near[b as usize].push(a);
    }
    near
}

/// How many closed loops the boundary consists of.
pub(super) fn boundary_loops(net: &Net) -> usize {
    let edges = Edges::new(&net.triangles);
    let on = edges.boundary(net.vertices.len());
    let mut sets = Sets::new(net.vertices.len());
    edges.groups().filter(|g| g.len() == 1).for_each(|g| sets.join(g[0][0], g[0][1]));
    (0..on.len() as u32).filter(|&v| on[v as usize] && sets.find(v) == v).count()
}

/// The normal of each vertex, weighted by area; zero where triangles cancel.
pub(super) fn vertex_normals(net: &Net) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); net.vertices.len()];
    for t in &net.triangles {
        let [a, b, c] = t.map(|v| net.vertices[v as usize]);
        let area = (b - a).cross(&(c - a));
        t.iter().for_each(|&v| normals[v as usize] += area);
    }
    normals.iter().map(|n| n.try_normalize(1e-300).unwrap_or_default()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat net of n x n squares.
    fn flat(n: u32) -> Net {
        let side = n + 1;
        let vertices =
            (0..side * side).map(|i| Point3::new(f64::from(i % side), f64::from(i / side), 0.0) * 1e-3).collect();
        let mut triangles = Vec::new();
        for (x, y) in (0..n).flat_map(|y| (0..n).map(move |x| (x, y))) {
            let a = y * side + x;
            triangles.extend([[a, a + 1, a + side + 1], [a, a + side + 1, a + side]]);
        }
        Net { vertices, triangles }
    }

    #[test]
    fn small_holes_are_closed_and_large_ones_stay() {
        for (reach, loops) in [(2.5, 1), (6.0, 2)] {
            let mut net = flat(20);
            let borne_out: Vec<bool> =
                net.vertices.iter().map(|v| (v * 1e3 - Point3::new(10.0, 10.0, 0.0)).norm() > reach).collect();
            trim(&mut net, &borne_out, 8e-3);
            assert_eq!(boundary_loops(&net), loops);
        }
    }

    #[test]
    fn what_reaches_the_edge_is_trimmed() {
        let mut net = flat(20);
        let borne_out: Vec<bool> = net.vertices.iter().map(|v| v.x > 2.5e-3).collect();
        trim(&mut net, &borne_out, 1.0);
        drop_unused(&mut net);
        assert!(net.vertices.iter().all(|v| v.x > 2.5e-3));
        assert_eq!(boundary_loops(&net), 1);
    }

    #[test]
    fn pieces_that_touch_in_a_point_are_parted() {
        let mut net = flat(4);
        // two squares left that share a corner, and one by itself
        net.triangles = [0, 1, 10, 11, 30, 31].map(|t| net.triangles[t]).to_vec();
        let mut both = Net { vertices: net.vertices.clone(), triangles: net.triangles[..4].to_vec() };
        part_fans(&mut both);
        assert_eq!(both.vertices.len(), net.vertices.len() + 1);
        one_piece(&mut net, |p| -p.x);
        assert_eq!((net.triangles.len(), net.vertices.len()), (2, 4));
    }
}
