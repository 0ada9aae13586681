//! Normals of points by planes fitted to their neighbourhoods.
use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};
use rayon::prelude::*;

use super::cloud::Cloud;
use super::kdtree::KdTree;

/// Fewest points that a plane is fitted to.
const FEWEST: usize = 6;

/// The unit normal of every point, towards the eye that saw it: the least principal direction of the points within `radius` (m), or of
/// the nearest few where that holds fewer (H. Hoppe et al., doi:10.1145/133994.134011). Points that have no plane face their eye.
pub(super) fn normals(cloud: &Cloud, tree: &KdTree, radius: f64) -> Vec<Vector3<f64>> {
    cloud
        .points
        .par_iter()
        .zip(&cloud.toward_eye)
        .map(|(p, eye)| {
            let mut near = Vec::new();
            tree.within(p, radius, &mut |i, d2| near.push((d2, i as u32)));
            if near.len() < FEWEST {
                tree.k_nearest(p, FEWEST, f64::INFINITY, &mut near);
            }
            plane(cloud, p, &near, radius).map_or(*eye, |n| if n.dot(eye) < 0.0 { -n } else { n })
        })
        .collect()
}

/// The direction in which the neighbours vary least, weighted by nearness; `None` when they lie on a line.
fn plane(cloud: &Cloud, p: &Point3<f64>, near: &[(f64, u32)], radius: f64) -> Option<Vector3<f64>> {
    let reach2 = near.iter().map(|n| n.0).fold(radius * radius, f64::max);
    let weighted = || {
        near.iter().map(|&(d2, i)| {
            let falloff = 1.0 - 0.9 * d2 / reach2;
            (cloud.points[i as usize] - p, cloud.weight[i as usize] * falloff)
        })
    };
    let total: f64 = weighted().map(|(_, w)| w).sum();
    let mean = weighted().map(|(d, w)| d * w).sum::<Vector3<f64>>() / total;
    let spread: Matrix3<f64> = weighted().map(|(d, w)| (d - mean) * (d - mean).transpose() * w).sum();
    let eigen = SymmetricEigen::new(spread);
    let least = eigen.eigenvalues.imin();
    let most = eigen.eigenvalues.max();
    let middle = eigen.eigenvalues.sum() - most - eigen.eigenvalues[least];
    // a line, or a single place, has no normal
    if middle.is_nan() || middle <= 1e-6 * most {
        return None;
    }
    eigen.eigenvectors.column(least).into_owned().try_normalize(1e-12)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_of_a_ball_point_outward() {
        let mut cloud = Cloud::default();
        for k in 0..4000 {
            // Fibonacci's lattice
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 4000.0;
            let (r, a) = ((1.0 - z * z).sqrt(), 2.399_963_229_728_653 * f64::from(k));
            let n = Vector3::new(r * a.cos(), r * a.sin(), z);
            cloud.push(Point3::from(n * 0.1), n, 1.0);
        }
        let found = normals(&cloud, &KdTree::new(&cloud.points), 0.012);
        let worst = found.iter().zip(&cloud.toward_eye).map(|(a, b)| a.dot(b)).fold(1.0, f64::min);
        assert!(worst > 0.999, "{worst}");
    }

    #[test]
    fn a_line_has_no_plane() {
        let mut cloud = Cloud::default();
        (0..20).for_each(|i| cloud.push(Point3::new(f64::from(i) * 0.001, 0.0, 0.0), Vector3::z(), 1.0));
        assert!(normals(&cloud, &KdTree::new(&cloud.points), 0.005).iter().all(|n| *n == Vector3::z()));
    }
}
