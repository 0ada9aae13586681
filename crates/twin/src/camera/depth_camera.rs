//! A stereo depth camera: where it looks, what it sees, and how wrong it is.
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rayon::prelude::*;

use crate::math::{self, Pose, frame_from_axes};
use crate::mesh::TriMesh;
use crate::reconstruct::Cloud;

/// Incidence (rad) from which a surface begins to be lost; at [`DepthCamera::grazing`] it is lost for sure.
const GRAZING_BEGINS: f64 = 60.0 * std::f64::consts::PI / 180.0;
/// A point counts as seen by the second eye when nothing is in its way nearer than this to it, m.
const SEEN: f64 = 2e-3;

/// A stereo depth camera. The figures by default are those of an Intel RealSense ZR300 (the dissertation's section VIII.A; sizes
/// and angles of view from Intel's `camera_specs.md` of the R200 family).
#[derive(Clone, Debug, PartialEq)]
pub struct DepthCamera {
    /// Columns and rows of the depth image.
    pub size_px: [usize; 2],
    /// Horizontal and vertical angle of view, rad.
    pub field_of_view: [f64; 2],
    /// Distance between the two imagers, m.
    pub baseline: f64,
    /// Least and greatest depth that is measured, m.
    pub range: [f64; 2],
    /// Standard deviation of the disparity, px. Depth is `z = f b / d`, so its deviation is `z^2 / (f b)` of it: 0.1 px are 1.3 mm at
    /// 0.7 m (Intel, "Tuning depth cameras for best performance": about 0.05 to 0.1 px on well-textured things).
    pub noise_px: f64,
    /// Side of the window that is matched, px: noise of pixels nearer than this is alike.
    pub window_px: usize,
    /// Steps in which disparity is known, px; 0 is without steps.
    pub disparity_step_px: f64,
    /// Share of pixels that give nothing.
    pub dropout: f64,
    /// Share of pixels that are matched with a wrong place, anywhere in the range.
    pub mismatches: f64,
    /// Angle between ray and normal from which nothing is measured, rad.
    pub grazing: f64,
}

impl Default for DepthCamera {
    fn default() -> Self {
        Self {
            size_px: [628, 468],
            field_of_view: [59f64.to_radians(), 46f64.to_radians()],
            baseline: 0.07,
            range: [0.55, 2.8],
            noise_px: 0.1,
            window_px: 5,
            disparity_step_px: 0.0,
            dropout: 0.02,
            mismatches: 0.001,
            grazing: 80f64.to_radians(),
        }
    }
}

impl DepthCamera {
    /// Focal lengths in x and y, px.
    pub fn focal_px(&self) -> [f64; 2] {
        [0, 1].map(|i| 0.5 * self.size_px[i] as f64 / (0.5 * self.field_of_view[i]).tan())
    }

    /// Standard deviation of the depth of one pixel at depth `z` (m), m.
    pub fn depth_deviation(&self, z: f64) -> f64 {
        z * z / (self.focal_px()[0] * self.baseline) * self.noise_px
    }

    /// Takes one picture of `meshes` (world) from `true_pose` and returns the points as the camera's believed pose puts them: both
    /// are `world_from_camera`, with x right, y down and z forward in the picture. `view` numbers the picture.
    pub fn take(&self, meshes: &[&TriMesh], true_pose: &Pose, believed_pose: &Pose, seed: u64, view: u64) -> Cloud {
        let [columns, rows] = self.size_px;
        let noise = self.noise(seed, view);
        let row = |v: usize| {
            let mut rng = math::stream(seed, "scan-pixels", (view << 32) | v as u64);
            let mut seen = Vec::new();
            for u in 0..columns {
                // every pixel takes its three numbers, so that what one sees doesn't shift the others'
                let [lost, wrong, place] = [(); 3].map(|()| rng.random::<f64>());
                let depth = self.measure(meshes, true_pose, [u, v], noise[v * columns + u], lost);
                let depth = depth.map(|z| if wrong < self.mismatches { self.anywhere(place) } else { z });
                seen.extend(depth.map(|z| believed_pose * (self.ray([u, v]) * z)));
            }
            seen
        };
        let lines: Vec<Vec<Vector3<f64>>> = (0..rows)
            .into_par_iter()
            .map(|v| row(v).into_iter().map(|p| p + believed_pose.translation.vector).collect())
            .collect();
        let eye = Point3::from(believed_pose.translation.vector);
        let mut cloud = Cloud::default();
        for p in lines.into_iter().flatten().map(Point3::from) {
            cloud.push(p, (eye - p).normalize(), 1.0);
        }
        cloud
    }

    /// The ray through the middle of a pixel, camera frame, with z = 1.
    fn ray(&self, [u, v]: [usize; 2]) -> Vector3<f64> {
        let [fx, fy] = self.focal_px();
        let [cx, cy] = self.size_px.map(|s| 0.5 * s as f64);
        Vector3::new((u as f64 + 0.5 - cx) / fx, (v as f64 + 0.5 - cy) / fy, 1.0)
    }

    /// The depth that a pixel measures, m; `noise` is its disparity's error, px, and `lost` in 0..1 decides dropouts.
    fn measure(&self, meshes: &[&TriMesh], pose: &Pose, pixel: [usize; 2], noise: f64, lost: f64) -> Option<f64> {
        let ray = self.ray(pixel);
        let direction = pose * ray.normalize();
        let eye = Point3::from(pose.translation.vector);
        let reach = self.range[1] * ray.norm();
        let hit = meshes
            .iter()
            .filter_map(|m| m.cast_ray(&eye, &direction, reach))
            .map(|h| (h, (h.position - eye).norm()))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let (hit, distance) = hit?;
        let incidence = hit.face_normal.dot(&direction).abs().clamp(0.0, 1.0).acos();
        let graze = ((incidence - GRAZING_BEGINS) / (self.grazing - GRAZING_BEGINS).max(1e-9)).clamp(0.0, 1.0);
        if incidence >= self.grazing || lost < self.dropout + (1.0 - self.dropout) * graze * graze {
            return None;
        }
        // both eyes must see the place
        let other = eye + pose * Vector3::x() * self.baseline;
        let across = hit.position - other;
        let free = across.norm() - SEEN;
        let across = across.normalize();
        if meshes.iter().any(|m| m.cast_ray(&other, &across, free).is_some()) {
            return None;
        }
        let scale = self.focal_px()[0] * self.baseline;
        let mut disparity = scale / (distance / ray.norm()) + noise;
        if self.disparity_step_px > 0.0 {
            disparity = (disparity / self.disparity_step_px).round() * self.disparity_step_px;
        }
        let depth = scale / disparity;
        (disparity > 0.0 && (self.range[0]..=self.range[1]).contains(&depth)).then_some(depth)
    }

    /// A depth within the range, even in disparity, as a wrong match is; `place` is in 0..1.
    fn anywhere(&self, place: f64) -> f64 {
        let [near, far] = self.range.map(|z| 1.0 / z);
        1.0 / (far + place * (near - far))
    }

    /// Disparity errors, px, row by row: white noise averaged over the matching window and brought back to its deviation.
    fn noise(&self, seed: u64, view: u64) -> Vec<f64> {
        let [columns, rows] = self.size_px;
        let w = self.window_px.max(1);
        let (wide, high) = (columns + w - 1, rows + w - 1);
        let white: Vec<f64> = (0..high)
            .into_par_iter()
            .flat_map_iter(|v| {
                let mut rng = math::stream(seed, "scan-disparity", (view << 32) | v as u64);
                (0..wide).map(move |_| math::standard_normal(&mut rng)).collect::<Vec<f64>>()
            })
            .collect();
        let along: Vec<f64> = (0..high * columns)
            .map(|i| {
                let (v, u) = (i / columns, i % columns);
                white[v * wide + u..v * wide + u + w].iter().sum::<f64>()
            })
            .collect();
        // the mean of w * w numbers has a deviation of 1 / w
        let scale = self.noise_px / w as f64;
        (0..rows * columns).map(|i| (0..w).map(|k| along[i + k * columns]).sum::<f64>() * scale).collect()
    }
}

/// `world_from_camera` of a camera at `eye` that looks at `target` with the picture's upper edge towards `up`; `None` when eye and
/// target are one place.
pub(super) fn look_at(eye: &Point3<f64>, target: &Point3<f64>, up: &Vector3<f64>) -> Option<Pose> {
    let forward = (target - eye).try_normalize(1e-9)?;
    // right = forward x up, and the frame falls back by itself when they are parallel
    let rotation = frame_from_axes(&forward, &forward.cross(up));
    Some(Pose::from_parts(Translation3::from(eye.coords), rotation))
}

/// A pose that is off by normal errors of deviation `distance` (m) along and `angle` (rad) about each of the camera's axes.
pub(super) fn misplaced(pose: &Pose, distance: f64, angle: f64, seed: u64, view: u64) -> Pose {
    let mut rng = math::stream(seed, "scan-calibration", view);
    let mut three = |deviation: f64| Vector3::from_fn(|_, _| math::standard_normal(&mut rng) * deviation);
    let (shift, turn) = (three(distance), three(angle));
    pose * Pose::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::stats::Running;
    use crate::mesh::shapes;

    fn wall() -> TriMesh {
        let wall = shapes::cuboid(&Vector3::new(2.0, 2.0, 0.1), 0.2).unwrap();
        wall.transformed(&Pose::translation(0.0, 0.0, -0.05))
    }

    fn from_above(height: f64) -> Pose {
        look_at(&Point3::new(0.0, 0.0, height), &Point3::origin(), &Vector3::y()).unwrap()
    }

    #[test]
    fn the_picture_is_upright() {
        let pose = from_above(0.7);
        assert!((pose * Vector3::z() + Vector3::z()).norm() < 1e-12, "looks down");
        assert!((pose * Vector3::y() + Vector3::y()).norm() < 1e-12, "rows go down");
        assert!((pose * Vector3::x() - Vector3::x()).norm() < 1e-12, "columns go right");
    }

    #[test]
    fn depth_is_as_uncertain_as_disparity_says() {
        let camera = DepthCamera { dropout: 0.0, mismatches: 0.0, size_px: [160, 120], ..DepthCamera::default() };
        for height in [0.6, 1.2] {
            let pose = from_above(height);
            let cloud = camera.take(&[&wall()], &pose, &pose, 1, 0);
            assert_eq!(cloud.len(), 160 * 120);
            let mut heights = Running::default();
            // a ray's error along z is the depth's own
            cloud.points.iter().for_each(|p| heights.push(p.z));
            let desired = camera.depth_deviation(height);
            assert!((heights.sd() / desired - 1.0).abs() < 0.1, "{} {desired}", heights.sd());
        }
    }

    #[test]
    fn what_is_hidden_near_or_grazing_is_not_seen() {
        let camera =
            DepthCamera { dropout: 0.0, mismatches: 0.0, noise_px: 0.0, size_px: [80, 60], ..Default::default() };
        let wall = wall();
        assert!(camera.take(&[&wall], &from_above(0.5), &from_above(0.5), 1, 0).is_empty(), "below the least range");
        let low = look_at(&Point3::new(-0.9, 0.0, 0.08), &Point3::origin(), &Vector3::z()).unwrap();
        assert!(camera.take(&[&wall], &low, &low, 1, 0).is_empty(), "at 85 degrees");
        let plate =
            shapes::cuboid(&Vector3::new(0.2, 0.2, 0.01), 0.2).unwrap().transformed(&Pose::translation(0.0, 0.0, 0.1));
        let pose = from_above(0.7);
        let behind = |c: &Cloud| c.points.iter().filter(|p| p.z < 0.05 && p.x.abs() < 0.09 && p.y.abs() < 0.09).count();
        assert!(behind(&camera.take(&[&wall], &pose, &pose, 1, 0)) > 100);
        assert_eq!(behind(&camera.take(&[&wall, &plate], &pose, &pose, 1, 0)), 0);
    }

    #[test]
    fn a_picture_is_the_same_at_any_number_of_threads() {
        let camera = DepthCamera { size_px: [80, 60], ..DepthCamera::default() };
        let take = || camera.take(&[&wall()], &from_above(0.7), &from_above(0.7), 7, 2);
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(take);
        let three = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap().install(take);
        assert_eq!(one, three);
        assert_ne!(one, camera.take(&[&wall()], &from_above(0.7), &from_above(0.7), 8, 2));
    }
}
