//! Settings of a scan, and what it found out.
use nalgebra::Point3;

use super::ScanError;
use super::camera::DepthCamera;
use crate::mesh::PointCloud;

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

/// How a cloud is cleaned and made a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshingOptions {
    /// What is kept round the sheet on each side, m.
    pub margin: f64,
    /// Points in a cube of this edge (m) become one; 0 keeps all.
    pub voxel: f64,
    /// Points whose neighbours are farther than usual by more standard deviations than this are dropped; 0 keeps all.
    pub outlier_deviations: f64,
    /// Mean edge of the triangles, m.
    pub triangle: f64,
    /// Radius of the neighbourhoods that the surface is fitted to, m; chosen by spacing and noise when absent.
    pub radius: Option<f64>,
    /// Holes up to this extent are closed, m.
    pub hole: f64,
}

impl Default for MeshingOptions {
    fn default() -> Self {
        Self { margin: 0.06, voxel: 0.002, outlier_deviations: 3.0, triangle: 0.0045, radius: None, hole: 0.03 }
    }
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

/// What a scan found out.
#[derive(Clone, Debug)]
pub struct ScanReport {
    /// Points that were measured.
    pub measured: usize,
    /// The cloud that the mesh was made of, world, with its normals.
    pub cloud: PointCloud,
    /// Spread of those points about the surface, m.
    pub noise: f64,
    /// Radius of the neighbourhoods that the surface was fitted to, m.
    pub radius: f64,
    /// Loops of the mesh's boundary: 1 for a disc, more when holes are left.
    pub boundary_loops: usize,
    /// Largest movement of a camera by registration, m.
    pub registered_by: f64,
}

/// An option in its range, or the error that names it.
fn check(name: &'static str, value: f64, holds: bool, right: &'static str) -> Result<(), ScanError> {
    if value.is_finite() && holds { Ok(()) } else { Err(ScanError::BadOption { name, value, right }) }
}

impl MeshingOptions {
    /// Every number in its range.
    pub(super) fn check(&self) -> Result<(), ScanError> {
        check("margin", self.margin, (0.0..=10.0).contains(&self.margin), "from 0 to 10 m")?;
        check("voxel", self.voxel, (0.0..=1.0).contains(&self.voxel), "from 0 to 1 m")?;
        check("outlier_deviations", self.outlier_deviations, self.outlier_deviations >= 0.0, "0 or more")?;
        check("triangle", self.triangle, (1e-5..=1.0).contains(&self.triangle), "from 1e-5 to 1 m")?;
        check("hole", self.hole, (0.0..=1.0).contains(&self.hole), "from 0 to 1 m")?;
        let radius = self.radius.unwrap_or(1.0);
        check("radius", radius, radius > 0.0 && radius <= 1.0, "above 0 and at most 1 m")
    }
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
