//! A picture from the hand's camera, and the camera as the robot knows it.
use nalgebra::{Point2, Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::math::Pose;
use crate::robot::JointVector;

/// A pinhole camera on the hand: x right, y down and z ahead in its frame and in its pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraModel {
    /// Columns and rows of a picture.
    pub size_px: [usize; 2],
    /// Focal length, px; pixels are square, and the axis meets the middle of the picture.
    pub focal_px: f64,
    /// Where the camera sits on the arm's last link.
    pub last_from_camera: Pose,
}

impl CameraModel {
    /// A camera with this horizontal angle of view, rad.
    pub fn new(size_px: [usize; 2], field_of_view: f64, last_from_camera: Pose) -> Self {
        let focal_px = 0.5 * size_px[0] as f64 / (0.5 * field_of_view).tan();
        Self { size_px, focal_px, last_from_camera }
    }

    /// Where a point in the camera's frame (m) is in the picture, px from its upper left corner; `None` behind the camera.
    pub fn project(&self, p: &Point3<f64>) -> Option<Point2<f64>> {
        let [cx, cy] = self.middle();
        (p.z > 1e-6).then(|| Point2::new(cx + self.focal_px * p.x / p.z, cy + self.focal_px * p.y / p.z))
    }

    /// The ray through a place in the picture (px), camera frame, with z = 1.
    pub fn ray(&self, place: &Point2<f64>) -> Vector3<f64> {
        let [cx, cy] = self.middle();
        Vector3::new((place.x - cx) / self.focal_px, (place.y - cy) / self.focal_px, 1.0)
    }

    /// Whether a place (px) is in the picture, at least `margin` px from its edges.
    pub fn sees(&self, place: &Point2<f64>, margin: f64) -> bool {
        let [w, h] = self.size_px.map(|s| s as f64 - margin);
        (margin..=w).contains(&place.x) && (margin..=h).contains(&place.y)
    }

    /// Half of what is seen at a distance (m) along the narrower side of the picture, m.
    pub fn half_view(&self, distance: f64) -> f64 {
        0.5 * self.size_px[0].min(self.size_px[1]) as f64 / self.focal_px * distance
    }

    fn middle(&self) -> [f64; 2] {
        self.size_px.map(|s| 0.5 * s as f64)
    }
}

/// A picture, and the joints that the robot measured as it was taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// Columns and rows.
    pub size_px: [usize; 2],
    /// Red, green and blue of each pixel, row by row from the top; in proportion to the light.
    pub pixels: Vec<u8>,
    /// Measured joints, rad.
    pub q: JointVector,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_through_a_projected_point_meets_it() {
        let camera = CameraModel::new([1280, 960], 0.8, Pose::identity());
        let p = Point3::new(0.04, -0.03, 0.3);
        let ray = camera.ray(&camera.project(&p).expect("ahead"));
        assert!((ray * 0.3 - p.coords).norm() < 1e-15);
        assert!(camera.project(&Point3::new(0.0, 0.0, -0.1)).is_none());
        // half of the wider side is seen under half of the angle
        let edge = camera.project(&Point3::new(0.3 * 0.4f64.tan(), 0.0, 0.3)).expect("ahead");
        assert!((edge.x - 1280.0).abs() < 1e-9 && camera.sees(&edge, 0.0) && !camera.sees(&edge, 1.0));
    }
}
