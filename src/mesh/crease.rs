//! Splitting vertices at creases, so that normals are smooth where the surface is and sharp where it is not.
use nalgebra::{Point3, Vector3};

use super::triangle::Triangle;

/// Edges that bend by this much or more (rad) are creases.
const CREASE_ANGLE: f64 = 40.0 * std::f64::consts::PI / 180.0;

/// A mesh whose vertices belong to one smooth patch each.
pub(super) struct Split {
    pub vertices: Vec<Point3<f64>>,
    pub normals: Vec<Vector3<f64>>,
    pub triangles: Vec<[u32; 3]>,
}

/// Gives every vertex one copy for each smooth fan of triangles round it, with the fan's angle-weighted normal. The
/// first fan keeps the vertex's place in the order; copies for further fans come at the end.
pub(super) fn split(vertices: &[Point3<f64>], triangles: &[[u32; 3]], face_normals: &[Vector3<f64>]) -> Split {
    let fans = smooth_fans(triangles, face_normals);

    let mut fan_of_vertex = vec![None; vertices.len()];
    for (corner, &vertex) in triangles.iter().flatten().enumerate() {
        fan_of_vertex[vertex as usize].get_or_insert(fans[corner]);
    }
    let mut index_of_fan = vec![None; fans.len()];
    let mut out = Vec::with_capacity(vertices.len());
    for (vertex, fan) in fan_of_vertex.iter().enumerate() {
        if let Some(fan) = fan {
            index_of_fan[*fan as usize] = Some(out.len() as u32);
            out.push(vertices[vertex]);
        }
    }
    let mut split_triangles = triangles.to_vec();
    for (corner, vertex) in split_triangles.iter_mut().flatten().enumerate() {
        let index = index_of_fan[fans[corner] as usize].get_or_insert_with(|| {
            out.push(vertices[*vertex as usize]);
            out.len() as u32 - 1
        });
        *vertex = *index;
    }
    let normals = angle_weighted_normals(&out, &split_triangles, face_normals);
    Split { vertices: out, normals, triangles: split_triangles }
}

/// The fan (named by its first corner) of each triangle corner. Corner `3 t + k` is corner `k` of triangle `t`.
fn smooth_fans(triangles: &[[u32; 3]], face_normals: &[Vector3<f64>]) -> Vec<u32> {
    // Each undirected edge, with the corners that its lower and its higher vertex have in the triangle.
    let mut edges: Vec<([u32; 2], [u32; 2])> = Vec::with_capacity(3 * triangles.len());
    for (t, corners) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (i, j) = (k, (k + 1) % 3);
            let (ci, cj) = ((3 * t + i) as u32, (3 * t + j) as u32);
            let (vi, vj) = (corners[i], corners[j]);
            edges.push(if vi < vj { ([vi, vj], [ci, cj]) } else { ([vj, vi], [cj, ci]) });
        }
    }
    edges.sort_unstable();
    let mut parent: Vec<u32> = (0..3 * triangles.len() as u32).collect();
    for pair in edges.windows(2) {
        let ((edge, [a, b]), (other_edge, [c, d])) = (pair[0], pair[1]);
        let bend = face_normals[a as usize / 3].angle(&face_normals[c as usize / 3]);
        if edge == other_edge && bend < CREASE_ANGLE {
            union(&mut parent, a, c);
            union(&mut parent, b, d);
        }
    }
    (0..parent.len() as u32).map(|corner| root(&mut parent, corner)).collect()
}

fn root(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}

fn union(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parent, a), root(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}

/// Sum of the face normals round each vertex, weighted by the corner's angle: it does not depend on how a flat polygon
/// is cut into triangles (Thuermer and Wuethrich, doi:10.1080/10867651.1998.10487487).
fn angle_weighted_normals(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    face_normals: &[Vector3<f64>],
) -> Vec<Vector3<f64>> {
    let mut sums = vec![Vector3::zeros(); vertices.len()];
    let mut any = vec![Vector3::zeros(); vertices.len()];
    for (t, n) in triangles.iter().zip(face_normals) {
        for (vertex, angle) in t.iter().zip(Triangle::of(vertices, t).angles()) {
            sums[*vertex as usize] += n * angle;
            any[*vertex as usize] = *n;
        }
    }
    // Faces can cancel only in a fan that folds back on itself; then any of its normals is as good as another.
    sums.iter().zip(&any).map(|(sum, any)| sum.try_normalize(1e-9).unwrap_or(*any)).collect()
}
