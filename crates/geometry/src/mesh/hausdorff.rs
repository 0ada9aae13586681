//! How far apart two surfaces are.
use nalgebra::Point3;

use super::TriMesh;

/// The two-sided Hausdorff distance of two meshes, m: the larger of the largest distances of a point of one surface from the
/// other (Rockafellar and Wets, Variational Analysis, 4.C). Of each surface the corners, the middles of edges and the middles of
/// triangles are looked at, so what is finer than half a triangle may be missed: the figure is a lower bound.
pub fn hausdorff(a: &TriMesh, b: &TriMesh) -> f64 {
    one_sided(b, a, one_sided(a, b, 0.0))
}

/// The largest distance of a sample of `from` from the surface `to`, m, or `least` where that is larger.
fn one_sided(from: &TriMesh, to: &TriMesh, least: f64) -> f64 {
    let mut largest = least;
    let mut look = |p: &Point3<f64>| {
        // most samples are nearer than the largest distance so far, which is quickly found out
        if to.closest_point_within(p, largest).is_none() {
            largest = largest.max((to.closest_point(p).position - p).norm());
        }
    };
    from.vertices().iter().for_each(&mut look);
    for t in from.triangles() {
        let [a, b, c] = t.map(|i| from.vertices()[i as usize]);
        look(&Point3::from((a.coords + b.coords + c.coords) / 3.0));
        // an edge is looked at from one of its two triangles
        for (i, j, p, q) in [(t[0], t[1], a, b), (t[1], t[2], b, c), (t[2], t[0], c, a)] {
            if i < j {
                look(&nalgebra::center(&p, &q));
            }
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn spheres_in_spheres_and_moved_boxes_are_as_far_apart_as_they_are() {
        let (small, large) = (shapes::sphere(0.10, 0.005).unwrap(), shapes::sphere(0.11, 0.005).unwrap());
        let d = hausdorff(&small, &large);
        assert!((d - 0.01).abs() < 2e-4, "{d}");
        assert_eq!(hausdorff(&large, &small), d);
        let cube = shapes::cuboid(&nalgebra::Vector3::new(0.1, 0.1, 0.1), 0.02).unwrap();
        let moved = cube.transformed(&crate::math::Pose::translation(0.03, 0.0, 0.0));
        assert!((hausdorff(&cube, &moved) - 0.03).abs() < 1e-12);
        assert!(hausdorff(&cube, &cube) < 1e-12);
    }

    #[test]
    fn a_hole_counts_from_the_side_that_has_none() {
        let whole = shapes::rectangle(0.2, 0.2, 0.0, 0.01).unwrap();
        let middle = |t: &[u32; 3]| t.iter().map(|&i| whole.vertices()[i as usize].coords.norm()).fold(0.0, f64::max);
        let holed = whole.triangles().iter().copied().filter(|t| middle(t) > 0.05).collect();
        let holed = TriMesh::new(whole.vertices().to_vec(), holed).unwrap();
        let d = hausdorff(&whole, &holed);
        assert!(d > 0.035 && d < 0.05, "{d}");
    }
}
