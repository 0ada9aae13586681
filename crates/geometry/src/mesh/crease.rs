//! Splitting vertices at creases, so that normals are smooth where the surface is and sharp where it is not.
use nalgebra::{Point3, Vector3};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhNode};

use super::TriMesh;
use super::topology::{root, union};
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

/// How far places are from the sharp edges of a mesh.
pub(super) struct CreaseDistance {
    edges: Vec<[Point3<f64>; 2]>,
    bvh: Bvh,
}

impl CreaseDistance {
    /// Finds the edges at which [`split`] has parted vertices of the mesh.
    pub fn new(mesh: &TriMesh) -> Self {
        let key = |v: &Point3<f64>| v.coords.map(f64::to_bits);
        let order = |a: &Point3<f64>, b: &Point3<f64>| key(a).as_slice().cmp(key(b).as_slice());
        // an edge by the places of its ends, and the vertices that it has there
        let mut all: Vec<([Point3<f64>; 2], [u32; 2])> = Vec::new();
        for t in mesh.triangles() {
            for k in 0..3 {
                let (i, j) = (t[k], t[(k + 1) % 3]);
                let (p, q) = (mesh.vertices()[i as usize], mesh.vertices()[j as usize]);
                all.push(if order(&p, &q).is_le() { ([p, q], [i, j]) } else { ([q, p], [j, i]) });
            }
        }
        all.sort_by(|(a, _), (b, _)| order(&a[0], &b[0]).then_with(|| order(&a[1], &b[1])));
        let creases = all.windows(2).filter(|w| w[0].0 == w[1].0 && w[0].1 != w[1].1).map(|w| w[0].0);
        let edges: Vec<[Point3<f64>; 2]> = creases.collect();
        let boxes: Vec<Aabb> = edges
            .iter()
            .map(|[a, b]| {
                let (low, high) = (a.inf(b), a.sup(b));
                Aabb::new(Vector::new(low.x, low.y, low.z), Vector::new(high.x, high.y, high.z))
            })
            .collect();
        let bvh = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        Self { edges, bvh }
    }

    /// Distance of a place from the nearest of them, m; infinite where there are none.
    pub fn at(&self, p: &Point3<f64>) -> f64 {
        let gap = |node: &BvhNode, _: f64| {
            let (low, high) = (node.mins(), node.maxs());
            let low = Vector3::new(low.x, low.y, low.z) - p.coords;
            let high = p.coords - Vector3::new(high.x, high.y, high.z);
            low.sup(&high).sup(&Vector3::zeros()).norm_squared()
        };
        if self.edges.is_empty() {
            return f64::INFINITY;
        }
        let found = self.bvh.find_best(f64::MAX, gap, |leaf, _| {
            let [a, b] = self.edges[leaf as usize];
            let along = b - a;
            let share = ((p - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            Some((p - (a + along * share)).norm_squared())
        });
        found.map_or(f64::INFINITY, |(_, d2)| d2.sqrt())
    }
}
