//! Settings of a scan.
use nalgebra::Point3;

use super::{DepthCamera, ScanError};
use crate::reconstruct::MeshingOptions;

/// Where a camera stands and what it looks at, world, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// The eye.
    pub eye: Point3<f64>,
    /// What is in the middle of its picture.
    pub target: Point3<f64>,
}

/// From where the canvas is looked at.
#[derive(Clone, Debug, PartialEq)]
pub enum Viewpoints {
    /// So many, found by themselves: one straight in front of the sheet's centre, the others round it, aslant.
    Around {
        /// How many.
        count: usize,
        /// Distance of the eyes from the sheet's centre, m.
        distance: f64,
        /// Angle of the others from the first, rad.
        slant: f64,
    },
    /// These.
    At(Vec<Viewpoint>),
}

/// A scan by a simulated camera.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanOptions {
    /// The camera.
    pub camera: DepthCamera,
    /// From where.
    pub views: Viewpoints,
    /// Standard deviation of the error of each camera's place along each axis, m.
    pub calibration: f64,
    /// Standard deviation of the error of each camera's angle about each axis, rad.
    pub calibration_angle: f64,
    /// Move the views onto each other.
    pub register: bool,
    /// From points to mesh.
    pub meshing: MeshingOptions,
}

impl Default for ScanOptions {
    fn default() -> Self {
        Self {
            camera: DepthCamera::default(),
            views: Viewpoints::Around { count: 3, distance: 0.7, slant: 25f64.to_radians() },
            calibration: 5e-4,
            calibration_angle: 0.05f64.to_radians(),
            register: true,
            meshing: MeshingOptions::default(),
        }
    }
}

/// An option in its range, or the error that names it.
fn check(name: &'static str, value: f64, holds: bool, right: &'static str) -> Result<(), ScanError> {
    if value.is_finite() && holds { Ok(()) } else { Err(ScanError::BadOption { name, value, right }) }
}

impl ScanOptions {
    /// Every number in its range.
    pub(super) fn check(&self) -> Result<(), ScanError> {
        self.meshing.check()?;
        let c = &self.camera;
        let pixels = c.size_px[0].saturating_mul(c.size_px[1]);
        check("size_px", pixels as f64, pixels > 0 && pixels <= 50_000_000, "from 1 to 5e7 pixels")?;
        for angle in c.field_of_view {
            check("field_of_view", angle, angle > 0.0 && angle < 3.0, "above 0 and below 3 rad")?;
        }
        check("baseline", c.baseline, c.baseline > 0.0, "above 0 m")?;
        check(
            "range",
            c.range[0],
            c.range[0] > 0.0 && c.range[0] < c.range[1] && c.range[1].is_finite(),
            "two rising depths",
        )?;
        check("noise_px", c.noise_px, c.noise_px >= 0.0, "0 px or more")?;
        check("window_px", c.window_px as f64, c.window_px <= 99, "at most 99 px")?;
        check("disparity_step_px", c.disparity_step_px, c.disparity_step_px >= 0.0, "0 px or more")?;
        check("dropout", c.dropout, (0.0..=1.0).contains(&c.dropout), "from 0 to 1")?;
        check("mismatches", c.mismatches, (0.0..=1.0).contains(&c.mismatches), "from 0 to 1")?;
        check("grazing", c.grazing, c.grazing > 0.0 && c.grazing < 1.571, "above 0 and below a right angle")?;
        check("calibration", self.calibration, (0.0..=1.0).contains(&self.calibration), "from 0 to 1 m")?;
        check(
            "calibration_angle",
            self.calibration_angle,
            (0.0..=1.0).contains(&self.calibration_angle),
            "from 0 to 1 rad",
        )?;
        if let Viewpoints::Around { count, distance, slant } = &self.views {
            check("count", *count as f64, (1..=32).contains(count), "from 1 to 32 views")?;
            check("distance", *distance, *distance > 0.0 && *distance <= 100.0, "above 0 and at most 100 m")?;
            check("slant", *slant, (0.0..1.4).contains(slant), "from 0 to 1.4 rad")?;
        }
        Ok(())
    }
}
