//! A convex solid between two rings of corners: what collides as a hull and is drawn as triangles.
use nalgebra::{Matrix3, Point3, Vector3};

use crate::math::Pose;
use crate::mesh::{MeshError, TriMesh};

/// A convex solid, m.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ConvexPart {
    points: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl ConvexPart {
    /// The solid between polygons of equally many corners, `rings` from the lowest to the highest, each counter-clockwise seen
    /// from above. The caller sees to it that the whole is convex.
    pub fn loft(rings: &[Vec<Point3<f64>>]) -> Self {
        let n = rings.first().map_or(0, Vec::len) as u32;
        let points: Vec<_> = rings.iter().flatten().copied().collect();
        let mut triangles = Vec::new();
        for ring in 1..rings.len() as u32 {
            let (below, above) = ((ring - 1) * n, ring * n);
            for i in 0..n {
                let j = (i + 1) % n;
                triangles.push([below + i, below + j, above + j]);
                triangles.push([below + i, above + j, above + i]);
            }
        }
        let top = (rings.len() as u32).saturating_sub(1) * n;
        for i in 1..n.saturating_sub(1) {
            triangles.push([0, i + 1, i]);
            triangles.push([top, top + i, top + i + 1]);
        }
        Self { points, triangles }
    }

    /// A prism: the polygon `outline` (x y, counter-clockwise from above) between two heights, m.
    pub fn prism(outline: &[[f64; 2]], bottom: f64, top: f64) -> Self {
        let ring = |z: f64| outline.iter().map(|p| Point3::new(p[0], p[1], z)).collect();
        Self::loft(&[ring(bottom), ring(top)])
    }

    /// A body of revolution about the vertical through (`x`, 0): `sides` corners, `profile` of radius and height from the lowest to
    /// the highest, m.
    pub fn turned(x: f64, profile: &[[f64; 2]], sides: usize) -> Self {
        let ring = |r: f64, z: f64| {
            (0..sides)
                .map(|i| {
                    let a = i as f64 / sides as f64 * std::f64::consts::TAU;
                    Point3::new(x + r * a.cos(), r * a.sin(), z)
                })
                .collect()
        };
        Self::loft(&profile.iter().map(|p| ring(p[0], p[1])).collect::<Vec<_>>())
    }

    /// A wedge number `index` of `count` round the vertical through (`x`, 0): the sector of a ring whose section runs from
    /// `inner` (radius, height; lowest first, the radius growing ever faster) to the radius `outer`, m. Its inner faces touch the
    /// circles of those radii.
    pub fn wedge(x: f64, inner: &[[f64; 2]], outer: f64, index: usize, count: usize) -> Self {
        let angle = |i: usize| i as f64 / count as f64 * std::f64::consts::TAU;
        let wider = 1.0 / (std::f64::consts::PI / count as f64).cos();
        let corner = |r: f64, a: f64, z: f64| Point3::new(x + wider * r * a.cos(), wider * r * a.sin(), z);
        let (a, b) = (angle(index), angle(index + 1));
        let ring = |r: f64, z: f64| vec![corner(r, a, z), corner(outer, a, z), corner(outer, b, z), corner(r, b, z)];
        Self::loft(&inner.iter().map(|p| ring(p[0], p[1])).collect::<Vec<_>>())
    }

    /// Corners, m: the solid is their convex hull.
    pub fn points(&self) -> &[Point3<f64>] {
        &self.points
    }

    /// Triangles of its surface, counter-clockwise from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The same solid seen from frame a.
    pub fn seen_from(&self, a_from_b: &Pose) -> Self {
        Self { points: self.points.iter().map(|p| a_from_b * p).collect(), triangles: self.triangles.clone() }
    }

    /// Volume, m^3: the sum of the tetrahedra over its triangles.
    pub fn volume(&self) -> f64 {
        let corner = |i: u32| self.points[i as usize].coords;
        self.triangles.iter().map(|t| corner(t[0]).dot(&corner(t[1]).cross(&corner(t[2]))) / 6.0).sum()
    }

    /// Volume (m^3), first moment (m^4) and second moment `integral of x x^T` (m^5) about the origin: sums over the tetrahedra
    /// between it and each triangle, with `V / 20 (sum of v v^T over the corners + s s^T)`, `s` the corners' sum.
    pub fn moments(&self) -> (f64, Vector3<f64>, Matrix3<f64>) {
        let mut sum = (0.0, Vector3::zeros(), Matrix3::zeros());
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| self.points[i as usize].coords);
            let (volume, s) = (a.dot(&b.cross(&c)) / 6.0, a + b + c);
            let squares = [a, b, c, s].iter().map(|v| v * v.transpose()).sum::<Matrix3<f64>>();
            sum = (sum.0 + volume, sum.1 + s * (volume / 4.0), sum.2 + squares * (volume / 20.0));
        }
        sum
    }

    /// How far the farthest corner stands out of the plane of a triangle, m: 0 of a convex solid, up to rounding.
    pub fn concavity(&self) -> f64 {
        let mut worst = 0.0_f64;
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| self.points[i as usize]);
            let normal: Vector3<f64> = (b - a).cross(&(c - a));
            let length = normal.norm();
            if length > 1e-12 {
                worst = self.points.iter().map(|p| (p - a).dot(&normal) / length).fold(worst, f64::max);
            }
        }
        worst
    }
}

/// One mesh of several solids, for pictures.
///
/// # Errors
/// A corner that is not finite, or nothing of positive area.
pub fn mesh_of(parts: &[ConvexPart]) -> Result<TriMesh, MeshError> {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for part in parts {
        let start = vertices.len() as u32;
        vertices.extend_from_slice(&part.points);
        triangles.extend(part.triangles.iter().map(|t| t.map(|i| i + start)));
    }
    TriMesh::new(vertices, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_part_has_the_volume_of_its_polygon() {
        let part = ConvexPart::turned(0.1, &[[0.01, 0.0], [0.01, 0.05]], 24);
        let sector = 0.5 * 24.0 * 0.01_f64.powi(2) * (std::f64::consts::TAU / 24.0).sin();
        assert!((part.volume() - sector * 0.05).abs() < 1e-12);
        assert!(part.concavity() < 1e-12);
    }

    #[test]
    fn wedges_are_convex_and_close_the_ring() {
        let wedges: Vec<_> =
            (0..24).map(|i| ConvexPart::wedge(0.0, &[[0.008, 0.0], [0.015, 0.02]], 0.03, i, 24)).collect();
        let volume: f64 = wedges.iter().map(ConvexPart::volume).sum();
        assert!(wedges.iter().all(|w| w.concavity() < 1e-12));
        assert!(volume > 0.0 && mesh_of(&wedges).is_ok());
    }
}
