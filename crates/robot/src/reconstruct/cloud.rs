//! A cloud of measured points, and what is left of it after cleaning.
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::kdtree::KdTree;
use crate::surface::SheetFrame;

/// Neighbours whose mean distance says whether a point stands alone (R. B. Rusu et al., doi:10.1016/j.robot.2008.08.005).
const NEIGHBOURS: usize = 16;

/// Measured points, world frame, m. All lists are equally long.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cloud {
    /// Positions, m.
    pub points: Vec<Point3<f64>>,
    /// Unit directions from the points to the eye that saw them.
    pub toward_eye: Vec<Vector3<f64>>,
    /// Measurements that each point stands for.
    pub weight: Vec<f64>,
}

impl Cloud {
    /// Points there are.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The points for which `keep` holds.
    pub fn filtered(&self, mut keep: impl FnMut(usize) -> bool) -> Self {
        let mut out = Self::default();
        for i in 0..self.len() {
            if keep(i) {
                out.push(self.points[i], self.toward_eye[i], self.weight[i]);
            }
        }
        out
    }

    /// Adds one point.
    pub fn push(&mut self, point: Point3<f64>, toward_eye: Vector3<f64>, weight: f64) {
        self.points.push(point);
        self.toward_eye.push(toward_eye);
        self.weight.push(weight);
    }

    /// Adds the points of another cloud.
    pub fn append(&mut self, other: Self) {
        self.points.extend(other.points);
        self.toward_eye.extend(other.toward_eye);
        self.weight.extend(other.weight);
    }

    /// What lies in front of or behind the sheet of `size` (m) widened by `margin` (m) on each side, at any height over it.
    pub fn cropped(&self, sheet: &SheetFrame, size: [f64; 2], margin: f64) -> Self {
        let sheet_from_world = sheet.world_from_sheet.inverse();
        let half = size.map(|s| 0.5 * s + margin);
        self.filtered(|i| {
            let p = sheet_from_world * self.points[i];
            p.x.abs() <= half[0] && p.y.abs() <= half[1]
        })
    }

    /// One point for each cube of edge `voxel` (m) that holds any: the weighted centre of its points.
    pub fn downsampled(&self, voxel: f64) -> Self {
        let cell = |p: &Point3<f64>| [p.x, p.y, p.z].map(|c| (c / voxel).floor() as i64);
        let mut order: Vec<([i64; 3], u32)> =
            self.points.iter().enumerate().map(|(i, p)| (cell(p), i as u32)).collect();
        order.par_sort_unstable();
        let mut out = Self::default();
        for group in order.chunk_by(|a, b| a.0 == b.0) {
            let (mut sum, mut toward, mut weight) = (Vector3::zeros(), Vector3::zeros(), 0.0);
            for &(_, i) in group {
                let i = i as usize;
                sum += self.points[i].coords * self.weight[i];
                toward += self.toward_eye[i] * self.weight[i];
                weight += self.weight[i];
            }
            let first = self.toward_eye[group[0].1 as usize];
            out.push(Point3::from(sum / weight), toward.try_normalize(1e-9).unwrap_or(first), weight);
        }
        out
    }

    /// Without the points whose neighbours are farther away, on average, than those of others: by more than `deviations` standard
    /// deviations of that mean distance over the cloud.
    pub fn without_outliers(&self, deviations: f64) -> Self {
        if self.len() <= NEIGHBOURS {
            return self.clone();
        }
        let tree = KdTree::new(&self.points);
        let mean_distance = |p: &Point3<f64>| {
            let mut near = Vec::with_capacity(NEIGHBOURS + 1);
            tree.k_nearest(p, NEIGHBOURS + 1, f64::INFINITY, &mut near);
            // the first is the point itself
            near[1..].iter().map(|(d2, _)| d2.sqrt()).sum::<f64>() / NEIGHBOURS as f64
        };
        let distances: Vec<f64> = self.points.par_iter().map(mean_distance).collect();
        // far strays would widen a plain standard deviation until it lets the near ones pass: it is taken twice
        let mut limit = f64::INFINITY;
        for _ in 0..2 {
            let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
            for d in distances.iter().filter(|d| **d <= limit) {
                n += 1.0;
                sum += d;
                squares += d * d;
            }
            let mean = sum / n;
            limit = mean + deviations * (squares / n - mean * mean).max(0.0).sqrt();
        }
        // on a perfect lattice the deviation is nothing, and rounding must not decide
        self.filtered(|i| distances[i] <= limit * (1.0 + 1e-9))
    }
}

/// Median distance of points to their nearest neighbour, m, over at most some thousand of them.
pub(super) fn spacing(points: &[Point3<f64>], tree: &KdTree) -> f64 {
    let step = points.len().div_ceil(4000).max(1);
    let mut distances: Vec<f64> = points
        .iter()
        .step_by(step)
        .filter_map(|p| {
            let mut near = Vec::with_capacity(2);
            tree.k_nearest(p, 2, f64::INFINITY, &mut near);
            near.get(1).map(|n| n.0.sqrt())
        })
        .collect();
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Pose;

    fn lattice(n: i32, step: f64) -> Cloud {
        let mut cloud = Cloud::default();
        for (x, y) in (0..n).flat_map(|x| (0..n).map(move |y| (x, y))) {
            cloud.push(Point3::new(f64::from(x) * step, f64::from(y) * step, 0.0), Vector3::z(), 1.0);
        }
        cloud
    }

    #[test]
    fn downsampling_keeps_the_weight_and_the_centre() {
        let cloud = lattice(50, 1e-3);
        let small = cloud.downsampled(5e-3);
        assert_eq!(small.len(), 100);
        assert!((small.weight.iter().sum::<f64>() - 2500.0).abs() < 1e-9);
        let centre = |c: &Cloud| {
            c.points.iter().zip(&c.weight).map(|(p, w)| p.coords * *w).sum::<Vector3<f64>>()
                / c.weight.iter().sum::<f64>()
        };
        assert!((centre(&cloud) - centre(&small)).norm() < 1e-12);
    }

    #[test]
    fn strays_go_and_the_surface_stays() {
        let mut cloud = lattice(40, 1e-3);
        for i in 0..8 {
            cloud.push(Point3::new(0.005 * f64::from(i), 0.02, 0.02 + 0.03 * f64::from(i)), Vector3::z(), 1.0);
        }
        let clean = cloud.without_outliers(3.0);
        assert!(clean.points.iter().all(|p| p.z == 0.0));
        assert!(clean.len() >= 1590, "{}", clean.len());
    }

    #[test]
    fn the_crop_follows_the_sheet() {
        let sheet = SheetFrame { world_from_sheet: Pose::translation(0.01, 0.02, 3.0) };
        let cropped = lattice(50, 1e-3).cropped(&sheet, [0.004, 0.002], 0.0005);
        assert_eq!(cropped.len(), 5 * 3);
    }
}
