//! A patch and its flat map: points go from one to the other.
use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::distortion::{Stretch, stretch};
use super::flat_error::FlatError;
use super::flatten::{Flattening, flatten};
use super::patch::Patch;
use super::{SurfacePoint, TriMesh};

/// How far outside of the chart, m, a point may lie and still be on its edge.
const ON_EDGE: f64 = 1e-7;
/// How far beyond the patch's boundary, m, along the surface, a point may lie and still be on it.
const BEYOND: f64 = 1e-3;
/// Rounds of finding the scale at which the drawing's rectangle keeps its size.
const SCALE_ROUNDS: usize = 8;

/// A patch with its flat map.
#[derive(Clone)]
pub struct Chart {
    /// The patch.
    pub patch: Patch,
    /// Place of each of the patch's vertices in the chart, m.
    pub flat: Vec<Point2<f64>>,
    /// The flat map as a mesh at z = 0, triangle for triangle.
    flat_mesh: TriMesh,
}

impl Chart {
    /// Flattens `patch` and lays the chart so that the patch's anchor is at `anchor` and `up` (any direction in space) goes
    /// along +y there, measured on the surface within `radius` (m) of it. Lengths are real: over the rectangle round 0
    /// of half sides `half` (m) the logarithm of the scale is 0 on average, which is the least-squares choice of size.
    ///
    /// # Errors
    /// See [`FlatError`].
    pub fn new(
        mut patch: Patch,
        method: Flattening,
        anchor: &Point2<f64>,
        half: [f64; 2],
        up: &Vector3<f64>,
        radius: f64,
    ) -> Result<Self, FlatError> {
        let (mut flat, mended) = flatten(&patch, method)?;
        patch.repairs.mended_flips = mended;
        let at = |flat: &[Point2<f64>]| {
            let t = patch.triangles[patch.anchor.triangle as usize].map(|i| flat[i as usize]);
            let [u, v, w] = patch.anchor.barycentric;
            t[0].coords * u + t[1].coords * v + t[2].coords * w
        };
        let turn = upright(&patch, &flat, up, radius);
        let origin = at(&flat);
        for p in &mut flat {
            let d = p.coords - origin;
            // multiplication by the conjugate of the direction of `up`, then a quarter turn: up becomes +y
            *p = Point2::new(turn.y * d.x - turn.x * d.y, turn.x * d.x + turn.y * d.y);
        }
        let mut scale = size(&patch, &flat, |_| true).ok_or(FlatError::Collapsed)?;
        let near = |c: &Point2<f64>, scale: f64| {
            let p = c.coords * scale + anchor.coords;
            p.x.abs() <= half[0] && p.y.abs() <= half[1]
        };
        for _ in 0..SCALE_ROUNDS {
            match size(&patch, &flat, |c| near(c, scale)) {
                Some(better) => scale = better,
                None => break,
            }
        }
        for p in &mut flat {
            *p = Point2::from(p.coords * scale + anchor.coords);
        }
        let places = flat.iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect();
        let flat_mesh = TriMesh::flat(places, patch.triangles.clone());
        Ok(Self { patch, flat, flat_mesh })
    }

    /// The surface point at a point of the chart; `None` outside of it and in holes that stay open. Its triangle is one of
    /// the patch's mesh.
    pub fn to_surface(&self, flat: &Point2<f64>) -> Option<SurfacePoint> {
        let found = self.flat_mesh.closest_point_within(&Point3::new(flat.x, flat.y, 0.0), ON_EDGE)?;
        if self.patch.open[found.triangle as usize] {
            return None;
        }
        Some(self.patch.mesh.point_at(found.triangle, found.barycentric))
    }

    /// Whether a point of the plane lies on the chart, if only on a hole of it.
    pub fn covers(&self, flat: &Point2<f64>) -> bool {
        self.flat_mesh.closest_point_within(&Point3::new(flat.x, flat.y, 0.0), ON_EDGE).is_some()
    }

    /// The chart's point at the surface point nearest to `world`, if that is nearer than `max_distance` (m) and not more than
    /// 1 mm beyond the patch's boundary or an open hole's.
    pub fn to_flat(&self, world: &Point3<f64>, max_distance: f64) -> Option<Point2<f64>> {
        let found = self.patch.mesh.closest_point_within(world, max_distance)?;
        if self.patch.open[found.triangle as usize] {
            return None;
        }
        // over the inside the way to the surface is along its normal; beyond the boundary it has a part along it
        let off = world - found.position;
        if off.norm_squared() > BEYOND * BEYOND {
            let along = off - found.face_normal * found.face_normal.dot(&off);
            if along.norm() > BEYOND && self.on_boundary(&found) {
                return None;
            }
        }
        let t = self.patch.triangles[found.triangle as usize].map(|i| self.flat[i as usize].coords);
        let [u, v, w] = found.barycentric;
        Some(Point2::from(t[0] * u + t[1] * v + t[2] * w))
    }

    /// Whether a point lies on the edge of the patch: near enough that its chart point has nothing beyond it.
    fn on_boundary(&self, point: &SurfacePoint) -> bool {
        let t = self.patch.triangles[point.triangle as usize];
        (0..3).any(|k| {
            let (i, j) = (t[(k + 1) % 3], t[(k + 2) % 3]);
            point.barycentric[k] < 1e-9 && self.patch.is_boundary_edge(i, j)
        })
    }

    /// The stretch of every triangle, in order.
    pub fn stretches(&self) -> Vec<Stretch> {
        (0..self.patch.triangles.len()).map(|t| stretch(&self.patch, &self.flat, t)).collect()
    }

    /// The stretch of the triangles whose centres are in the rectangle round `center` of half sides `half` (m).
    pub fn stretches_in(&self, center: &Point2<f64>, half: [f64; 2]) -> Vec<Stretch> {
        let inside = |t: usize| {
            let c = centroid(&self.flat, &self.patch.triangles[t]) - center;
            c.x.abs() <= half[0] && c.y.abs() <= half[1]
        };
        let triangles = (0..self.patch.triangles.len()).filter(|&t| inside(t));
        triangles.map(|t| stretch(&self.patch, &self.flat, t)).collect()
    }
}

fn centroid(flat: &[Point2<f64>], t: &[u32; 3]) -> Point2<f64> {
    let [a, b, c] = t.map(|i| flat[i as usize].coords);
    Point2::from((a + b + c) / 3.0)
}

/// The factor for the chart at which the logarithm of the stretch is 0 on average over the chosen triangles (by their
/// centres), weighted by area on the surface; `None` when none is chosen.
fn size(patch: &Patch, flat: &[Point2<f64>], chosen: impl Fn(&Point2<f64>) -> bool) -> Option<f64> {
    let (mut sum, mut total) = (0.0, 0.0);
    for (t, corners) in patch.triangles.iter().enumerate() {
        if !chosen(&centroid(flat, corners)) {
            continue;
        }
        let s = stretch(patch, flat, t);
        let area = s.chart_area * s.area_ratio;
        if area > 0.0 && s.area_ratio > 0.0 {
            sum += area * 0.5 * s.area_ratio.ln();
            total += area;
        }
    }
    let factor = (sum / total).exp();
    (total > 0.0 && factor.is_finite() && factor > 0.0).then_some(factor)
}

/// The unit direction in the chart of `up` at the anchor: the mean over the triangles within `radius` (m) of it.
fn upright(patch: &Patch, flat: &[Point2<f64>], up: &Vector3<f64>, radius: f64) -> Vector2<f64> {
    let direction = |t: usize| -> Vector2<f64> {
        let corners = patch.triangles[t];
        let [a, b, c] = corners.map(|i| patch.vertices[i as usize]);
        let normal = patch.mesh.face_normals()[t];
        let tangent = up - normal * normal.dot(up);
        // tangent = r (b - a) + s (c - a), by the dual of the two edges
        let (ab, ac) = (b - a, c - a);
        let double_area = ab.cross(&ac).norm();
        let r = normal.cross(&ac).dot(&tangent) / -double_area;
        let s = normal.cross(&ab).dot(&tangent) / double_area;
        let [u, v, w] = corners.map(|i| flat[i as usize]);
        (v - u) * r + (w - u) * s
    };
    let own = patch.anchor.triangle as usize;
    let near = |t: &usize| {
        let [a, b, c] = patch.triangles[*t].map(|i| patch.vertices[i as usize].coords);
        ((a + b + c) / 3.0 - patch.anchor.position.coords).norm() <= radius
    };
    let mut sum = direction(own);
    for t in (0..patch.triangles.len()).filter(near) {
        let d = direction(t);
        if t != own && d.iter().all(|c| c.is_finite()) {
            let area = super::flatten::double_area(flat, &patch.triangles[t]).max(0.0);
            let own_area = super::flatten::double_area(flat, &patch.triangles[own]).max(f64::MIN_POSITIVE);
            sum += d * (area / own_area);
        }
    }
    sum.try_normalize(0.0).unwrap_or_else(Vector2::y)
}
