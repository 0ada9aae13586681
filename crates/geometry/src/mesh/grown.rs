//! The part of a surface near a point as one walks on it.
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::Point3;

use super::clip::clip;
use super::repair::{nearest_triangle, weld};

/// The part of a mesh within `radius` (m) of `anchor` along its edges (E. W. Dijkstra, doi:10.1007/BF01386390), cut along that
/// distance, without holes of its making: what it surrounds, such as the tip of a nose, belongs to it.
pub(super) fn grown(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    anchor: &Point3<f64>,
    radius: f64,
) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let (mut vertices, triangles) = weld(vertices, triangles);
    if triangles.is_empty() {
        return (vertices, triangles);
    }
    let edges = Edges::new(vertices.len(), &triangles);
    let start = triangles[nearest_triangle(&vertices, &triangles, anchor)];
    let mut distance = distances(&vertices, &edges, start, anchor);
    for surrounded in edges.surrounded(&distance, radius) {
        // just within, so that it isn't cut
        distance[surrounded as usize] = radius * 0.999;
    }
    // what doesn't hang together with the anchor is infinitely far, which no cut can be placed by
    let field: Vec<f64> = distance.iter().map(|d| radius - d.min(3.0 * radius)).collect();
    let triangles = clip(&mut vertices, &triangles, |i, _| field[i]);
    weld(&vertices, &triangles)
}

/// The distance of every vertex from a point of the triangle `start`, m, along edges.
fn distances(vertices: &[Point3<f64>], edges: &Edges, start: [u32; 3], from: &Point3<f64>) -> Vec<f64> {
    let mut distance = vec![f64::INFINITY; vertices.len()];
    // lengths are not negative, so that their bits are in their order
    let mut queue = BinaryHeap::new();
    for i in start {
        let d = (vertices[i as usize] - from).norm();
        distance[i as usize] = d;
        queue.push(Reverse((d.to_bits(), i)));
    }
    while let Some(Reverse((bits, i))) = queue.pop() {
        let d = f64::from_bits(bits);
        if d > distance[i as usize] {
            continue;
        }
        for &j in edges.of(i) {
            let through = d + (vertices[j as usize] - vertices[i as usize]).norm();
            if through < distance[j as usize] {
                distance[j as usize] = through;
                queue.push(Reverse((through.to_bits(), j)));
            }
        }
    }
    distance
}

/// The neighbours of each vertex, and whether it is on the mesh's boundary.
struct Edges {
    first: Vec<u32>,
    neighbours: Vec<u32>,
    on_boundary: Vec<bool>,
}

impl Edges {
    fn new(count: usize, triangles: &[[u32; 3]]) -> Self {
        let sides = |t: &[u32; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
        let mut both: Vec<(u32, u32)> = triangles.iter().flat_map(sides).flat_map(|(i, j)| [(i, j), (j, i)]).collect();
        both.sort_unstable();
        let mut edges = Self { first: vec![0; count + 1], neighbours: Vec::new(), on_boundary: vec![false; count] };
        for same in both.chunk_by(|a, b| a == b) {
            let (i, j) = same[0];
            edges.neighbours.push(j);
            edges.first[i as usize + 1] += 1;
            edges.on_boundary[i as usize] |= same.len() == 1;
        }
        for i in 0..count {
            edges.first[i + 1] += edges.first[i];
        }
        edges
    }

    fn of(&self, i: u32) -> &[u32] {
        &self.neighbours[self.first[i as usize] as usize..self.first[i as usize + 1] as usize]
    }

    /// Vertices farther than `radius` from which no way leads out but through what is nearer: neither to the mesh's boundary nor to the
    /// largest part that is farther.
    fn surrounded(&self, distance: &[f64], radius: f64) -> Vec<u32> {
        let far = |i: u32| distance[i as usize] > radius && distance[i as usize].is_finite();
        let mut seen = vec![false; distance.len()];
        let mut parts: Vec<Vec<u32>> = Vec::new();
        for i in (0..distance.len() as u32).filter(|i| far(*i)) {
            let mut part = Vec::new();
            let mut stack = vec![i];
            while let Some(i) = stack.pop() {
                if far(i) && !std::mem::replace(&mut seen[i as usize], true) {
                    part.push(i);
                    stack.extend(self.of(i));
                }
            }
            parts.push(part);
        }
        let bounded = |part: &Vec<u32>| part.iter().any(|i| self.on_boundary[*i as usize]);
        // of a closed surface the largest part is the outside, of an open one what reaches its boundary
        if !parts.iter().any(bounded) {
            let largest = (0..parts.len()).max_by_key(|k| (parts[*k].len(), Reverse(*k)));
            largest.map(|k| parts.swap_remove(k));
        }
        parts.into_iter().filter(|part| !bounded(part)).flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn distance_goes_along_the_surface_and_holes_are_filled() {
        let square = shapes::rectangle(0.4, 0.4, 0.0, 0.01).unwrap();
        let within = |anchor: &Point3<f64>, radius: f64| {
            let (v, t) = grown(square.vertices(), square.triangles(), anchor, radius);
            (crate::mesh::TriMesh::new(v.clone(), t).unwrap().area(), v)
        };
        let (area, vertices) = within(&Point3::origin(), 0.1);
        // edges are longer than the straight way, so that it is less than the disc and more than the square that stands on a corner
        assert!((0.02..0.0315).contains(&area), "{area}");
        assert!(vertices.iter().all(|p| p.coords.norm() < 0.1 + 1e-9));
        assert!((within(&Point3::origin(), 1.0).0 - 0.16).abs() < 1e-9);
        // a tall thin spike on the square: its tip is far, but surrounded
        let mut v = square.vertices().to_vec();
        let top = v.iter().enumerate().min_by(|a, b| a.1.coords.norm().total_cmp(&b.1.coords.norm())).unwrap().0;
        v[top].z = 0.5;
        let side = Point3::new(0.03, 0.0, 0.0);
        let (v, _) = grown(&v, square.triangles(), &side, 0.1);
        assert!(v.iter().any(|p| (p.z - 0.5).abs() < 1e-12), "the tip is cut off");
    }
}
