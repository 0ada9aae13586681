//! A triangle mesh with smooth normals and a bounding-volume hierarchy.
use std::fmt;
use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector as ParryVector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhNode};
use parry3d_f64::query::Ray;

use super::crease;
use super::repair::weld;
use super::topology::{Gluing, start};
use super::triangle::Triangle;
use crate::math::Pose;

/// Largest coordinate a mesh may have, m. Beyond it a scale is wrong, and squares of squares would leave f64.
const MAX_COORDINATE: f64 = 1e6;
/// Leaf boxes are grown by this much, m, so that rays in the plane of a flat mesh can't slip past its flat boxes.
const BOX_MARGIN: f64 = 1e-9;

/// Why a mesh can't be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A coordinate is NaN or infinite.
    #[error("vertex {index} is not finite")]
    NotFinite {
        /// Index of the first such vertex.
        index: usize,
    },
    /// A coordinate is absurdly large.
    #[error(
        "vertex {index} has a coordinate of {coordinate:e} m; the largest allowed is 1e6 m, so a scale may be wrong"
    )]
    TooLarge {
        /// Index of the first such vertex.
        index: usize,
        /// The coordinate, m.
        coordinate: f64,
    },
    /// A shape was asked for with a size that makes none.
    #[error("{name} of {value} m makes no shape")]
    BadSize {
        /// What the size is of.
        name: &'static str,
        /// The size, m.
        value: f64,
    },
    /// A shape was asked for with too many triangles.
    #[error("the triangle size asks for {triangles:.1e} triangles; at most {max:.0e} are made")]
    TooFine {
        /// About how many.
        triangles: f64,
        /// The limit.
        max: f64,
    },
    /// No triangle of positive area.
    #[error("mesh has no triangles")]
    Empty,
    /// A triangle names a vertex that isn't there.
    #[error("triangle {triangle} names vertex {vertex} of {count}")]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// Index of the vertex it names.
        vertex: u32,
        /// Vertices there are.
        count: usize,
    },
}

/// A point on a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Position, m, in the mesh's frame.
    pub position: Point3<f64>,
    /// Smooth outward unit normal (interpolated from the vertices).
    pub normal: Vector3<f64>,
    /// Outward unit normal of the facet.
    pub face_normal: Vector3<f64>,
    /// Index of the triangle.
    pub triangle: u32,
    /// Barycentric coordinates on that triangle; they sum to 1.
    pub barycentric: [f64; 3],
}

/// An immutable triangle mesh, m. Triangles wind counter-clockwise seen from outside. Clones share their data.
///
/// Normals are smooth across edges that bend by less than the crease angle of 40 degrees. At sharper edges the
/// vertices are split in two, so that each side keeps its own normal: a box has 24 vertices. Vertices that no triangle
/// uses are dropped. Where nothing is split or dropped, vertices keep their order.
#[derive(Clone)]
pub struct TriMesh {
    data: Arc<Data>,
}

struct Data {
    vertices: Vec<Point3<f64>>,
    vertex_normals: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
    face_normals: Vec<Vector3<f64>>,
    bounds: (Point3<f64>, Point3<f64>),
    bvh: Bvh,
}

impl TriMesh {
    /// Checks the arrays (`vertices` n x 3 in m, `triangles` m x 3 indices) and builds the mesh. Triangles of zero area are dropped.
    ///
    /// # Errors
    /// A vertex that is not finite or larger than 1e6 m, an index without a vertex, or no triangle of positive area.
    pub fn new(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        for (index, v) in vertices.iter().enumerate() {
            if !v.coords.iter().all(|c| c.is_finite()) {
                return Err(MeshError::NotFinite { index });
            }
            let coordinate = v.coords[v.coords.iamax()];
            if coordinate.abs() > MAX_COORDINATE {
                return Err(MeshError::TooLarge { index, coordinate });
            }
        }
        let count = vertices.len();
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&c| c as usize >= count) {
                return Err(MeshError::IndexOutOfRange { triangle, vertex, count });
            }
        }
        let mut kept = triangles;
        let mut face_normals = Vec::with_capacity(kept.len());
        kept.retain(|t| {
            let normal = Triangle::of(&vertices, t).unit_normal();
            face_normals.extend(normal);
            normal.is_some()
        });
        if kept.is_empty() {
            return Err(MeshError::Empty);
        }
        let split = crease::split(&vertices, &kept, &face_normals);
        Ok(Self::assemble(split.vertices, split.normals, split.triangles, face_normals))
    }

    /// Builds the hierarchy over checked arrays.
    fn assemble(
        vertices: Vec<Point3<f64>>,
        vertex_normals: Vec<Vector3<f64>>,
        triangles: Vec<[u32; 3]>,
        face_normals: Vec<Vector3<f64>>,
    ) -> Self {
        let boxes: Vec<Aabb> = triangles
            .iter()
            .map(|t| {
                let Triangle { a, b, c } = Triangle::of(&vertices, t);
                let margin = Vector3::repeat(BOX_MARGIN);
                let low = a.coords.inf(&b.coords).inf(&c.coords) - margin;
                let high = a.coords.sup(&b.coords).sup(&c.coords) + margin;
                Aabb::new(to_parry(&low), to_parry(&high))
            })
            .collect();
        let first = vertices[0];
        let bounds = vertices.iter().fold((first, first), |(low, high), v| (low.inf(v), high.sup(v)));
        let bvh = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        Self { data: Arc::new(Data { vertices, vertex_normals, triangles, face_normals, bounds, bvh }) }
    }

    /// A flat mesh at z = 0 whose triangles, all of an area, keep their numbers.
    pub(super) fn flat(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Self {
        let vertex_normals = vec![Vector3::z(); vertices.len()];
        let face_normals = vec![Vector3::z(); triangles.len()];
        Self::assemble(vertices, vertex_normals, triangles, face_normals)
    }

    /// Vertices, m.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.data.vertices
    }

    /// Vertex indices of each triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.data.triangles
    }

    /// Smooth unit normals, one a vertex, weighted by corner angle (doi:10.1080/10867651.1998.10487487).
    pub fn vertex_normals(&self) -> &[Vector3<f64>] {
        &self.data.vertex_normals
    }

    /// Unit normals, one a triangle.
    pub fn face_normals(&self) -> &[Vector3<f64>] {
        &self.data.face_normals
    }

    /// The boundary as closed loops of points, m, each with the surface at its left; none of a closed mesh. Vertices that stand at one
    /// place, to a picometre, as at creases and poles, are one here.
    pub fn boundary_loops(&self) -> Vec<Vec<Point3<f64>>> {
        let rounded = |p: &Point3<f64>| p.map(|x| (x * 1e12).round() * 1e-12);
        let places: Vec<Point3<f64>> = self.vertices().iter().map(rounded).collect();
        let (vertices, triangles) = weld(&places, self.triangles());
        let points = |edges: Vec<u32>| edges.into_iter().map(|h| vertices[start(&triangles, h) as usize]).collect();
        Gluing::new(&vertices, &triangles).loops().into_iter().map(points).collect()
    }

    /// Axis-aligned bounds (lower, upper), m.
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        self.data.bounds
    }

    /// Surface area, m2.
    pub fn area(&self) -> f64 {
        self.data.triangles.iter().map(|t| self.corners(t).area_vector().norm() / 2.0).sum()
    }

    /// Signed volume, m3, by the divergence theorem: positive for a closed mesh whose normals point outward. Without
    /// meaning for an open one.
    pub fn signed_volume(&self) -> f64 {
        let origin = self.data.bounds.0;
        let six = |t: &[u32; 3]| {
            let Triangle { a, b, c } = self.corners(t);
            (a - origin).dot(&(b - origin).cross(&(c - origin)))
        };
        self.data.triangles.iter().map(six).sum::<f64>() / 6.0
    }

    /// The mesh moved by `pose`.
    pub fn transformed(&self, pose: &Pose) -> Self {
        Self::assemble(
            self.data.vertices.iter().map(|v| pose * v).collect(),
            self.data.vertex_normals.iter().map(|n| pose * n).collect(),
            self.data.triangles.clone(),
            self.data.face_normals.iter().map(|n| pose * n).collect(),
        )
    }

    /// The point on triangle `triangle` with the given barycentric coordinates.
    ///
    /// # Panics
    /// When there is no such triangle.
    pub fn point_at(&self, triangle: u32, barycentric: [f64; 3]) -> SurfacePoint {
        let t = &self.data.triangles[triangle as usize];
        let [n0, n1, n2] = t.map(|i| self.data.vertex_normals[i as usize]);
        let face_normal = self.data.face_normals[triangle as usize];
        let [u, v, w] = barycentric;
        let smooth = n0 * u + n1 * v + n2 * w;
        SurfacePoint {
            position: self.corners(t).at(barycentric),
            normal: smooth.try_normalize(1e-9).unwrap_or(face_normal),
            face_normal,
            triangle,
            barycentric,
        }
    }

    /// The surface point nearest to `p`. For a `p` that is not finite it is some point of the surface.
    pub fn closest_point(&self, p: &Point3<f64>) -> SurfacePoint {
        self.closest_point_within(p, f64::INFINITY).unwrap_or_else(|| self.point_at(0, [1.0 / 3.0; 3]))
    }

    /// The surface point nearest to `p` when it is nearer than `max_distance` (m), else `None`. Fast when far: this is
    /// the query of the 1 kHz contact loop (aim: below 0.5 us when away, 1 us when touching, on a 50 k triangle mesh).
    pub fn closest_point_within(&self, p: &Point3<f64>, max_distance: f64) -> Option<SurfacePoint> {
        // Costs are squared distances: no square roots on the way down.
        let found = self.data.bvh.find_best(
            max_cost(max_distance),
            |node, _| squared_distance_to_box(p, node),
            |leaf, _| {
                let (barycentric, distance2) = self.corner_triangle(leaf).closest(p);
                Some((distance2, barycentric))
            },
        );
        found.map(|(triangle, (_, barycentric))| self.point_at(triangle, barycentric))
    }

    /// The first point hit by the ray from `origin` along unit `direction`, nearer than `max_distance` (m). Both sides
    /// of a triangle can be hit.
    pub fn cast_ray(&self, origin: &Point3<f64>, direction: &Vector3<f64>, max_distance: f64) -> Option<SurfacePoint> {
        let ray = Ray::new(to_parry(&origin.coords), to_parry(direction));
        let found = self.data.bvh.find_best(
            max_distance.clamp(0.0, f64::MAX),
            |node, best| node.cast_ray(&ray, best),
            |leaf, _| self.corner_triangle(leaf).hit(origin, direction),
        );
        found.map(|(triangle, (_, barycentric))| self.point_at(triangle, barycentric))
    }

    /// Distance (m) of the segment `a`-`b` from the surface, or `None` when it is `max_distance` or more. 0 where it crosses.
    pub fn distance_to_segment(&self, a: &Point3<f64>, b: &Point3<f64>, max_distance: f64) -> Option<f64> {
        let (low, high) = (a.inf(b), a.sup(b));
        let center = nalgebra::center(a, b);
        let half_length = (b - a).norm() / 2.0;
        let lower_bound = |node: &BvhNode, _: f64| {
            let (box_low, box_high) = (from_parry(node.mins()), from_parry(node.maxs()));
            let gap = (box_low - high).sup(&(low - box_high)).sup(&Vector3::zeros());
            let ball = (squared_distance_to_box(&center, node).sqrt() - half_length).max(0.0);
            gap.norm_squared().max(ball * ball)
        };
        let found = self.data.bvh.find_best(max_cost(max_distance), lower_bound, |leaf, _| {
            Some(self.corner_triangle(leaf).squared_distance_to_segment(a, b))
        });
        found.map(|(_, distance2)| distance2.sqrt())
    }

    fn corners(&self, triangle: &[u32; 3]) -> Triangle {
        Triangle::of(&self.data.vertices, triangle)
    }

    fn corner_triangle(&self, leaf: u32) -> Triangle {
        self.corners(&self.data.triangles[leaf as usize])
    }
}

impl fmt::Debug for TriMesh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TriMesh")
            .field("vertices", &self.data.vertices.len())
            .field("triangles", &self.data.triangles.len())
            .field("bounds", &self.data.bounds)
            .finish()
    }
}

/// The squared-distance limit of a search; a negative or NaN distance finds nothing.
fn max_cost(distance: f64) -> f64 {
    if distance > 0.0 { (distance * distance).min(f64::MAX) } else { 0.0 }
}

#[inline]
fn squared_distance_to_box(p: &Point3<f64>, node: &BvhNode) -> f64 {
    let (low, high) = (node.mins(), node.maxs());
    // Comparisons instead of `f64::max`, whose care for NaN costs time here.
    let gap = |low: f64, x: f64, high: f64| {
        if x < low {
            low - x
        } else if x > high {
            x - high
        } else {
            0.0
        }
    };
    let (x, y, z) = (gap(low.x, p.x, high.x), gap(low.y, p.y, high.y), gap(low.z, p.z, high.z));
    x * x + y * y + z * z
}

fn to_parry(v: &Vector3<f64>) -> ParryVector {
    ParryVector::new(v.x, v.y, v.z)
}

fn from_parry(v: ParryVector) -> Point3<f64> {
    Point3::new(v.x, v.y, v.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Point3<f64>> {
        (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64).prop_map(|(x, y, z)| Point3::new(x, y, z))
    }

    prop_compose! {
        /// Up to 60 random triangles over 20 random vertices.
        fn soup()(vertices in prop::collection::vec(point(), 20), triangles in prop::collection::vec([0..20u32, 0..20, 0..20], 1..60))
            -> Option<TriMesh> {
            TriMesh::new(vertices, triangles).ok()
        }
    }

    /// Distance to the nearest of a dense set of samples is an upper bound of the distance, close to it.
    fn brute_force(mesh: &TriMesh, p: &Point3<f64>) -> f64 {
        let one = |t: &[u32; 3]| {
            let tri = mesh.corners(t);
            let n = tri.unit_normal().unwrap();
            let foot = p - n * n.dot(&(p - tri.a));
            let inside = [(tri.a, tri.b), (tri.b, tri.c), (tri.c, tri.a)]
                .iter()
                .all(|(a, b)| (b - a).cross(&(foot - a)).dot(&n) >= 0.0);
            let to_edge = |a: Point3<f64>, b: Point3<f64>| {
                let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                (a + (b - a) * t - p).norm()
            };
            if inside {
                (foot - p).norm()
            } else {
                to_edge(tri.a, tri.b).min(to_edge(tri.b, tri.c)).min(to_edge(tri.c, tri.a))
            }
        };
        mesh.triangles().iter().map(one).fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn closest_point_is_the_nearest_of_all_triangles(mesh in soup(), p in point(), limit in 0.0..1.0f64) {
            let Some(mesh) = mesh else { return Ok(()) };
            let expected = brute_force(&mesh, &p);
            let found = mesh.closest_point(&p);
            prop_assert!(((found.position - p).norm() - expected).abs() < 1e-9);
            prop_assert!((found.barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            prop_assert!((found.normal.norm() - 1.0).abs() < 1e-12 && (found.face_normal.norm() - 1.0).abs() < 1e-12);
            if (expected - limit).abs() > 1e-9 {
                prop_assert_eq!(mesh.closest_point_within(&p, limit).is_some(), expected < limit);
            }
        }

        #[test]
        fn a_ray_hits_the_first_of_all_triangles(mesh in soup(), origin in point(), towards in point()) {
            let Some(mesh) = mesh else { return Ok(()) };
            prop_assume!((towards - origin).norm() > 1e-3);
            let direction = (towards - origin).normalize();
            let hits = (0..mesh.triangles().len() as u32).filter_map(|t| mesh.corner_triangle(t).hit(&origin, &direction));
            let expected = hits.map(|(t, _)| t).min_by(f64::total_cmp);
            let found = mesh.cast_ray(&origin, &direction, 10.0).map(|s| (s.position - origin).dot(&direction));
            prop_assert_eq!(expected.is_some(), found.is_some());
            if let (Some(e), Some(f)) = (expected, found) {
                prop_assert!((e - f).abs() < 1e-9);
            }
        }

        #[test]
        fn distance_to_a_segment_is_that_of_its_nearest_point(mesh in soup(), a in point(), b in point()) {
            let Some(mesh) = mesh else { return Ok(()) };
            let found = mesh.distance_to_segment(&a, &b, f64::INFINITY).unwrap();
            let samples = 400;
            let sampled = (0..=samples)
                .map(|i| brute_force(&mesh, &(a + (b - a) * (i as f64 / samples as f64))))
                .fold(f64::INFINITY, f64::min);
            let spacing = (b - a).norm() / samples as f64;
            prop_assert!(found <= sampled + 1e-9 && sampled <= found + spacing, "{found} {sampled}");
            prop_assert!(mesh.distance_to_segment(&a, &b, found * (1.0 - 1e-9)).is_none());
        }

        #[test]
        fn moving_mesh_and_point_together_changes_nothing(mesh in soup(), p in point(), by in point()) {
            let Some(mesh) = mesh else { return Ok(()) };
            let pose = Pose::new(by.coords, Vector3::new(by.z, by.x, by.y));
            let moved = mesh.transformed(&pose).closest_point(&(pose * p)).position;
            prop_assert!(((moved - pose * p).norm() - (mesh.closest_point(&p).position - p).norm()).abs() < 1e-9);
        }
    }

    #[test]
    fn bad_arrays_are_refused() {
        let v = vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
        let nan = vec![v[0], v[1], Point3::new(0.0, f64::NAN, 0.0)];
        assert!(matches!(TriMesh::new(nan, vec![[0, 1, 2]]), Err(MeshError::NotFinite { index: 2 })));
        let far = vec![v[0], v[1], Point3::new(0.0, 1e7, 0.0)];
        assert!(matches!(TriMesh::new(far, vec![[0, 1, 2]]), Err(MeshError::TooLarge { index: 2, .. })));
        let out = TriMesh::new(v.clone(), vec![[0, 1, 2], [0, 1, 3]]);
        assert!(matches!(out, Err(MeshError::IndexOutOfRange { triangle: 1, vertex: 3, count: 3 })));
        assert!(matches!(TriMesh::new(v.clone(), vec![[0, 1, 1]]), Err(MeshError::Empty)));
        assert!(matches!(TriMesh::new(vec![], vec![]), Err(MeshError::Empty)));
        assert_eq!(TriMesh::new(v, vec![[0, 1, 1], [0, 1, 2]]).unwrap().triangles(), [[0, 1, 2]]);
    }

    #[test]
    fn queries_that_are_not_finite_find_nothing_or_something_finite() {
        let v = vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
        let mesh = TriMesh::new(v, vec![[0, 1, 2]]).unwrap();
        let nan = Point3::new(f64::NAN, 0.0, 0.0);
        assert!(mesh.closest_point_within(&nan, 1.0).is_none());
        assert!(mesh.closest_point(&nan).position.coords.iter().all(|c| c.is_finite()));
        assert!(mesh.cast_ray(&nan, &Vector3::z(), 1.0).is_none());
        assert!(mesh.closest_point_within(&Point3::origin(), f64::NAN).is_none());
    }

    #[test]
    fn a_right_angle_is_a_crease_and_a_gentle_bend_is_smooth() {
        let hinge = |angle: f64| {
            let v = vec![
                Point3::new(0.0, 0.0, 0.0),
                Point3::new(0.0, 1.0, 0.0),
                Point3::new(-1.0, 0.0, 0.0),
                Point3::new(angle.cos(), 0.0, -angle.sin()),
            ];
            TriMesh::new(v, vec![[0, 1, 2], [0, 3, 1]]).unwrap()
        };
        let sharp = hinge(1.5);
        assert_eq!(sharp.vertices().len(), 6);
        assert!((sharp.closest_point(&Point3::new(-0.2, 0.2, 0.1)).normal - Vector3::z()).norm() < 1e-12);
        let smooth = hinge(0.3);
        assert_eq!(smooth.vertices().len(), 4);
        let on_edge = smooth.closest_point(&Point3::new(0.0, 0.5, 0.1)).normal;
        assert!((on_edge.x - 0.15f64.sin()).abs() < 1e-3, "{on_edge}");
    }
}
