//! The surface that points stand for: signed heights over it, and the nearest place on it.
use nalgebra::{Matrix6, Point3, Vector3, Vector6};

use super::cloud::Cloud;
use super::kdtree::KdTree;
use crate::math::frame_from_axes;

/// Fewest points that a curved patch is fitted to: twice its coefficients.
const FEWEST: usize = 12;
/// Pull of curvature towards none, as a share of the data's weight: it counts where points lie on one side alone.
const FLATTENING: f64 = 2e-4;
/// Rounds in which points far off the patch lose their weight.
const ROBUST_ROUNDS: usize = 2;

/// A cleaned cloud with normals, ready to be asked for the surface through it.
pub(super) struct PointSurface<'a> {
    pub cloud: &'a Cloud,
    pub tree: &'a KdTree,
    pub normals: &'a [Vector3<f64>],
    /// Radius of the neighbourhoods that are fitted, m.
    pub radius: f64,
}

/// A place on the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    pub position: Point3<f64>,
    pub normal: Vector3<f64>,
    /// Spread of the points about the patch there, m: a standard deviation.
    pub spread: f64,
}

impl PointSurface<'_> {
    /// Signed distance (m) of `x` from the surface by the mean of its neighbours' planes, positive towards the eyes; `None` when no
    /// point is within `reach` (m). `f = sum w_i n_i (x - p_i) / sum w_i`, implicit moving least squares (R. Kolluri,
    /// doi:10.1145/1361192.1361195).
    pub fn signed_distance(&self, x: &Point3<f64>, reach: f64) -> Option<f64> {
        let (_, nearest2) = self.tree.nearest(x, reach)?;
        // as wide as the fit where there are points, and as wide as it takes where there are none
        let radius = self.radius.max(1.5 * nearest2.sqrt());
        let (mut sum, mut weights) = (0.0, 0.0);
        self.tree.within(x, radius, &mut |i, d2| {
            let w = falloff(d2, radius) * self.cloud.weight[i];
            sum += w * self.normals[i].dot(&(x - self.cloud.points[i]));
            weights += w;
        });
        (weights > 0.0).then(|| sum / weights)
    }

    /// The place on the surface near `x` along `normal`: a quadratic height field over the plane at right angles to `normal` is fitted
    /// to the neighbourhood by moving least squares (M. Alexa et al., doi:10.1109/TVCG.2003.1175093). A plane alone would cut bumps.
    pub fn foot(&self, x: &Point3<f64>, normal: &Vector3<f64>) -> Option<Foot> {
        let mut radius = self.radius;
        for _ in 0..4 {
            let mut near = Vec::new();
            self.tree.within(x, radius, &mut |i, d2| near.push((i, d2)));
            // what faces away is another side of a thin thing
            near.retain(|&(i, _)| self.normals[i].dot(normal) > 0.2);
            if near.len() >= FEWEST
                && let Some(foot) = self.patch(x, normal, &near, radius)
            {
                return Some(foot);
            }
            radius *= 1.5;
        }
        None
    }

    fn patch(&self, x: &Point3<f64>, normal: &Vector3<f64>, near: &[(usize, f64)], radius: f64) -> Option<Foot> {
        let frame = frame_from_axes(normal, &Vector3::x());
        let samples: Vec<(Vector6<f64>, f64, f64)> = near
            .iter()
            .map(|&(i, d2)| {
                let d = frame.inverse() * (self.cloud.points[i] - x) / radius;
                let (u, v) = (d.x, d.y);
                let weight = falloff(d2, radius) * self.cloud.weight[i];
                (Vector6::new(1.0, u, v, u * u, u * v, v * v), d.z, weight)
            })
            .collect();
        let mut scale = f64::INFINITY;
        let mut fit = Vector6::zeros();
        for round in 0..=ROBUST_ROUNDS {
            let (mut h, mut g, mut total) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
            for (basis, height, weight) in &samples {
                let u = (height - basis.dot(&fit)) / (4.685 * scale);
                let w = if round == 0 || u == 0.0 { *weight } else { weight * (1.0 - u * u).max(0.0).powi(2) };
                h += basis * basis.transpose() * w;
                g += basis * (height * w);
                total += w;
            }
            for i in 3..6 {
                h[(i, i)] += FLATTENING * total;
            }
            fit = h.cholesky()?.solve(&g);
            let (mut squares, mut weights) = (0.0, 0.0);
            for (basis, height, weight) in &samples {
                let e = height - basis.dot(&fit);
                let u = e / (4.685 * scale);
                let w = if u.abs() < 1.0 { *weight } else { 0.0 };
                squares += w * e * e;
                weights += w;
            }
            scale = (squares / weights).sqrt().max(1e-9);
        }
        // a fit that leads out of its own neighbourhood says nothing
        if fit[0].is_nan() || fit[0].abs() >= 1.0 {
            return None;
        }
        Some(Foot {
            position: x + normal * (fit[0] * radius),
            normal: (frame * Vector3::new(-fit[1], -fit[2], 1.0)).normalize(),
            spread: scale * radius,
        })
    }
}

/// Weight of a neighbour: 1 at the middle, smoothly 0 at the radius (H. Wendland, doi:10.1007/BF02123482).
fn falloff(distance2: f64, radius: f64) -> f64 {
    let r = (distance2.sqrt() / radius).min(1.0);
    (1.0 - r).powi(4) * (4.0 * r + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A paraboloid z = (x^2 - y^2) / 2 r, sampled on a lattice.
    fn saddle(r: f64) -> Cloud {
        let mut cloud = Cloud::default();
        for (i, j) in (-40..=40).flat_map(|i| (-40..=40).map(move |j| (i, j))) {
            let (x, y) = (f64::from(i) * 1e-3, f64::from(j) * 1e-3);
            cloud.push(Point3::new(x, y, (x * x - 0.5 * y * y) / (2.0 * r)), Vector3::z(), 1.0);
        }
        cloud
    }

    #[test]
    fn curvature_doesnt_pull_the_foot_off_the_surface() {
        let cloud = saddle(0.1);
        let tree = KdTree::new(&cloud.points);
        let normals = super::super::normals::normals(&cloud, &tree, 0.004);
        let surface = PointSurface { cloud: &cloud, tree: &tree, normals: &normals, radius: 0.015 };
        let foot = surface.foot(&Point3::new(0.001, 0.002, 0.003), &Vector3::z()).unwrap();
        let p = foot.position;
        let height = p.z - (p.x * p.x - 0.5 * p.y * p.y) / 0.2;
        assert!(height.abs() < 2e-6, "{height}");
        let desired = Vector3::new(-p.x / 0.1, 0.5 * p.y / 0.1, 1.0).normalize();
        assert!((foot.normal - desired).norm() < 1e-3);
        assert!(surface.signed_distance(&Point3::new(0.0, 0.0, 0.005), 0.02).unwrap() > 0.004);
        assert!(surface.signed_distance(&Point3::new(0.0, 0.0, -0.005), 0.02).unwrap() < -0.004);
        assert!(surface.signed_distance(&Point3::new(0.0, 0.0, -0.5), 0.02).is_none());
    }
}
