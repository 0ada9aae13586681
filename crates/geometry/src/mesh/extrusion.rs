//! Walls: profiles pulled straight up, with openings.
use nalgebra::Point3;

use super::profile::ProfileCurve;
use super::{MeshError, TriMesh};

/// Most triangles of a wall.
const MAX_TRIANGLES: f64 = 4e6;
/// Edges nearer than this are one, m.
const SAME: f64 = 1e-6;

/// A rectangular hole in a wall, m: along the profile, and over the floor edge's frame (z).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opening {
    /// Arc length of its left edge.
    pub left: f64,
    /// Arc length of its right edge.
    pub right: f64,
    /// z of its lower edge.
    pub bottom: f64,
    /// z of its upper edge.
    pub top: f64,
}

impl Opening {
    /// Whether it holds arc length `s` and height `z` (m).
    pub fn contains(&self, s: f64, z: f64) -> bool {
        (self.left..=self.right).contains(&s) && (self.bottom..=self.top).contains(&z)
    }
}

/// The wall over `profile` from z = `bottom` to `top` (m), in rows about `triangle_size` high; `openings` are left out exactly.
///
/// It is a bare surface that faces the artist; columns stand where the profile has its points.
///
/// # Errors
/// A height or a triangle size that is not positive, too many triangles, and openings that leave nothing.
pub fn extrusion(
    profile: &ProfileCurve,
    bottom: f64,
    top: f64,
    openings: &[Opening],
    triangle_size: f64,
) -> Result<TriMesh, MeshError> {
    let height = top - bottom;
    for (name, value) in [("height", height), ("triangle size", triangle_size)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(MeshError::BadSize { name, value });
        }
    }
    let columns = with_edges(profile.along().to_vec(), openings.iter().flat_map(|o| [o.left, o.right]));
    let triangles = 2.0 * columns.len() as f64 * (height / triangle_size + 1.0 + 2.0 * openings.len() as f64);
    if triangles > MAX_TRIANGLES {
        return Err(MeshError::TooFine { triangles, max: MAX_TRIANGLES });
    }
    let n = (height / triangle_size - 1e-9).ceil().max(1.0) as usize;
    let even = (0..=n).map(|i| bottom + height * i as f64 / n as f64).collect();
    let rows = with_edges(even, openings.iter().flat_map(|o| [o.bottom, o.top]));
    let vertices: Vec<Point3<f64>> = columns
        .iter()
        .map(|s| profile.at(*s))
        .flat_map(|p| rows.iter().map(move |z| Point3::new(p.x, p.y, *z)))
        .collect();
    let vertex = |i: usize, j: usize| (i * rows.len() + j) as u32;
    let mut triangles = Vec::with_capacity(2 * columns.len() * rows.len());
    for i in 0..columns.len() - 1 {
        for j in 0..rows.len() - 1 {
            let middle = (0.5 * (columns[i] + columns[i + 1]), 0.5 * (rows[j] + rows[j + 1]));
            if openings.iter().any(|o| o.contains(middle.0, middle.1)) {
                continue;
            }
            let (a, b, c, d) = (vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1));
            triangles.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    TriMesh::new(vertices, triangles)
}

/// Rising values with `edges` among them, where they lie between the first and the last. A value beside an edge gives way to it.
fn with_edges(mut values: Vec<f64>, edges: impl Iterator<Item = f64>) -> Vec<f64> {
    let (first, last) = (values[0], values[values.len() - 1]);
    let edges: Vec<f64> = edges.filter(|e| (first + SAME..last - SAME).contains(e)).collect();
    values.retain(|v| *v == first || *v == last || edges.iter().all(|e| (v - e).abs() > SAME));
    values.extend(edges);
    values.sort_by(f64::total_cmp);
    values.dedup_by(|a, b| (*a - *b).abs() < SAME);
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ProfileShape;
    use nalgebra::{Point2, Vector3};

    fn straight() -> ProfileCurve {
        let points = vec![Point2::new(1.0, 1.0), Point2::new(1.0, -1.0)];
        ProfileCurve::new(&ProfileShape::Polyline { points, fillet: 0.0 }, 0.05).unwrap()
    }

    #[test]
    fn a_wall_faces_its_artist_and_has_its_area() {
        let mesh = extrusion(&straight(), 0.2, 1.2, &[], 0.05).unwrap();
        assert!((mesh.area() - 2.0).abs() < 1e-9);
        assert!(mesh.face_normals().iter().all(|n| (n + Vector3::x()).norm() < 1e-9));
        assert!((mesh.bounds().0.z - 0.2).abs() < 1e-12 && (mesh.bounds().1.z - 1.2).abs() < 1e-12);
    }

    #[test]
    fn openings_are_left_out_exactly() {
        let door = Opening { left: 0.513, right: 1.207, bottom: 0.0, top: 0.731 };
        let mesh = extrusion(&straight(), 0.0, 1.0, &[door], 0.05).unwrap();
        assert!((mesh.area() - (2.0 - 0.694 * 0.731)).abs() < 1e-9);
        let all = Opening { left: -1.0, right: 9.0, bottom: -1.0, top: 9.0 };
        assert!(matches!(extrusion(&straight(), 0.0, 1.0, &[all], 0.05), Err(MeshError::Empty)));
        assert!(matches!(extrusion(&straight(), 1.0, 1.0, &[], 0.05), Err(MeshError::BadSize { .. })));
        assert!(matches!(extrusion(&straight(), 0.0, 1.0, &[], 1e-9), Err(MeshError::TooFine { .. })));
    }
}
