//! Solids to triangles: surface nets, then relaxed on the surface.
use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use crate::Mesh;
use crate::solid::Solid;

/// Rounds of relaxation.
const ROUNDS: usize = 12;

/// The surface of `solid` within the box `low`..`high`, by cells of `size`, all mm.
///
/// Surface nets (Gibson 1998): one vertex a cell that the surface crosses, one quadrilateral an edge that it crosses.
/// Vertices then move to the middle of their neighbours and back on the surface, which evens the triangles out.
pub fn mesh(solid: &Solid, low: Point3<f64>, high: Point3<f64>, size: f64) -> Mesh {
    let count = ((high - low) / size).map(|n| n.ceil() as usize + 1);
    let place = |c: [usize; 3]| low + Vector3::new(c[0] as f64, c[1] as f64, c[2] as f64) * size;
    let index = |c: [usize; 3]| (c[2] * count.y + c[1]) * count.x + c[0];
    let mut value = vec![0.0; count.x * count.y * count.z];
    for z in 0..count.z {
        for y in 0..count.y {
            for x in 0..count.x {
                value[index([x, y, z])] = solid(&place([x, y, z]));
            }
        }
    }
    let mut mesh = Mesh::default();
    let mut vertex_of: BTreeMap<usize, u32> = BTreeMap::new();
    let mut vertex = |cell: [usize; 3], mesh: &mut Mesh| {
        *vertex_of.entry(index(cell)).or_insert_with(|| {
            mesh.vertices.push(crossing(&value, cell, &index, &place));
            mesh.vertices.len() as u32 - 1
        })
    };
    for z in 1..count.z - 1 {
        for y in 1..count.y - 1 {
            for x in 1..count.x - 1 {
                for axis in 0..3 {
                    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                    let here = [x, y, z];
                    let mut there = here;
                    there[axis] += 1;
                    let (a, b) = (value[index(here)], value[index(there)]);
                    if (a < 0.0) == (b < 0.0) {
                        continue;
                    }
                    let mut quad = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[du, dv]| {
                        let mut cell = here;
                        cell[u] -= du;
                        cell[v] -= dv;
                        vertex(cell, &mut mesh)
                    });
                    if a >= 0.0 {
                        quad.reverse();
                    }
                    mesh.triangles.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
                }
            }
        }
    }
    relax(&mut mesh, solid, size);
    flip_to_shorter(&mut mesh);
    mesh
}

/// Mean of the points where the surface crosses the edges of a cell.
fn crossing(
    value: &[f64],
    cell: [usize; 3],
    index: &impl Fn([usize; 3]) -> usize,
    place: &impl Fn([usize; 3]) -> Point3<f64>,
) -> Point3<f64> {
    let (mut sum, mut n) = (Vector3::zeros(), 0.0);
    for corner in 0..8usize {
        let a = [0, 1, 2].map(|k| cell[k] + (corner >> k & 1));
        for k in 0..3 {
            if corner >> k & 1 == 0 {
                let mut b = a;
                b[k] += 1;
                let (va, vb) = (value[index(a)], value[index(b)]);
                if (va < 0.0) != (vb < 0.0) {
                    sum += (place(a) + (place(b) - place(a)) * (va / (va - vb))).coords;
                    n += 1.0;
                }
            }
        }
    }
    Point3::from(sum / f64::max(n, 1.0))
}

fn relax(mesh: &mut Mesh, solid: &Solid, size: f64) {
    let mut edges: Vec<[u32; 2]> = mesh.triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]).collect();
    edges.iter_mut().for_each(|e| e.sort_unstable());
    edges.sort_unstable();
    edges.dedup();
    for round in 0..ROUNDS {
        let mut sum = vec![(Vector3::zeros(), 0.0); mesh.vertices.len()];
        for [a, b] in &edges {
            for (i, j) in [(*a as usize, *b as usize), (*b as usize, *a as usize)] {
                sum[i].0 += mesh.vertices[j].coords;
                sum[i].1 += 1.0;
            }
        }
        for (v, (s, n)) in mesh.vertices.iter_mut().zip(sum) {
            let step = if round + 1 == ROUNDS { 0.0 } else { 0.5 };
            let mut p = Point3::from(v.coords.lerp(&(s / n), step));
            for _ in 0..3 {
                let g = gradient(solid, &p);
                p -= (g * (solid(&p) / g.norm_squared().max(0.05))).cap_magnitude(size * 0.5);
            }
            *v = p;
        }
    }
}

fn gradient(solid: &Solid, p: &Point3<f64>) -> Vector3<f64> {
    const H: f64 = 0.01;
    Vector3::from_fn(|k, _| {
        let mut d = Vector3::zeros();
        d[k] = H;
        (solid(&(p + d)) - solid(&(p - d))) / (2.0 * H)
    })
}

/// Cuts each quadrilateral along its shorter diagonal. Its two triangles stand one after the other.
fn flip_to_shorter(mesh: &mut Mesh) {
    let v = &mesh.vertices;
    for pair in mesh.triangles.chunks_exact_mut(2) {
        let ([a, b, c], d) = (pair[0], pair[1][2]);
        let length = |i: u32, j: u32| (v[i as usize] - v[j as usize]).norm();
        if length(b, d) < length(a, c) {
            pair[0] = [a, b, d];
            pair[1] = [b, c, d];
        }
    }
}
