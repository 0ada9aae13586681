//! `[scan]`: the canvas as a depth camera, or a cloud of one's own, shows it.
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::assets::existing;
use super::check::Check;
use super::resolve::ScenarioError;

/// `[scan]`: how the canvas is scanned, with `canvas.belief = "scan"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ScanSettings {
    /// A point cloud, `.ply`, in place of the simulated camera; relative to the scenario's folder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cloud: Option<String>,
    /// Metres a unit of the cloud's file.
    pub scale: f64,
    /// Where the cloud's frame stands in the world; as it is when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<ScanPose>,
    /// Pictures taken, from places round the sheet that are found by themselves.
    pub views: u32,
    /// Distance of those places from the sheet's centre, mm.
    pub distance_mm: f64,
    /// Angle of all but the first from the sheet's normal, degrees.
    pub slant_deg: f64,
    /// Columns and rows of the depth image, pixels.
    pub image_px: [u32; 2],
    /// Horizontal and vertical angle of view, degrees.
    pub field_of_view_deg: [f64; 2],
    /// Distance between the camera's two eyes, mm.
    pub baseline_mm: f64,
    /// Least and greatest depth that is measured, mm.
    pub range_mm: [f64; 2],
    /// Standard deviation of the disparity, pixels.
    pub noise_px: f64,
    /// Side of the window that is matched, pixels: depths within it err alike.
    pub window_px: u32,
    /// Steps in which disparity is known, pixels; 0 is without steps.
    pub disparity_step_px: f64,
    /// Share of pixels that give nothing.
    pub dropout: f64,
    /// Share of pixels that are matched with a wrong place.
    pub mismatches: f64,
    /// Angle between line of sight and normal from which nothing is measured, degrees.
    pub grazing_deg: f64,
    /// Standard deviation of the error of a camera's place along each axis, mm.
    pub calibration_mm: f64,
    /// Standard deviation of the error of a camera's angle about each axis, degrees.
    pub calibration_deg: f64,
    /// Move the views onto each other.
    pub register: bool,
    /// Standard deviation with which the canvas's middle may stand off its nominal place along each axis, as far as the robot knows,
    /// mm. The sheet is put where the scanned shape says that it is, as far as the shape says so. 0 is a place that is known: there it
    /// stays.
    pub placement_mm: f64,
    /// Standard deviation with which it may be turned about each axis through its middle, degrees; 0 is a turn that is known.
    pub placement_deg: f64,
    /// Marks are printed on the canvas, and cameras find them: they say where the sheet is where the shape doesn't.
    pub marks: bool,
    /// Places of the marks on the sheet, mm from its centre, right and up; its corners when absent.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub marks_at_mm: Vec<[f64; 2]>,
    /// Standard deviation of a mark's found place along each axis, mm.
    pub marks_noise_mm: f64,
    /// What is scanned round the sheet, on each side, mm.
    pub margin_mm: f64,
    /// How far beyond what was scanned the canvas is thought to go on, mm: travels keep clear of it there too.
    pub skirt_mm: f64,
    /// Points in a cube of this edge become one, mm; 0 keeps all.
    pub voxel_mm: f64,
    /// Points whose neighbours are farther than usual by more standard deviations than this are dropped; 0 keeps all.
    pub outlier_deviations: f64,
    /// Mean edge of the mesh's triangles, mm.
    pub triangle_mm: f64,
    /// Radius of the neighbourhoods that the surface is fitted to, mm; by spacing and noise of the points when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smooth_mm: Option<f64>,
    /// Holes up to this extent are closed, mm.
    pub hole_mm: f64,
    /// Places of one's own in place of `views`.
    #[serde(rename = "camera", skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<ScanCamera>,
}

/// `pose` of a cloud: translation, and fixed-axis roll, pitch and yaw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ScanPose {
    /// Where the cloud's origin lies, mm, world.
    pub xyz_mm: [f64; 3],
    /// Roll, pitch and yaw, degrees.
    pub rpy_deg: [f64; 3],
}

/// `[[scan.camera]]`: a place to take a picture from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScanCamera {
    /// Where the eye is, mm, world.
    pub eye_mm: [f64; 3],
    /// What it looks at, mm, world.
    pub target_mm: [f64; 3],
}

impl Default for ScanSettings {
    fn default() -> Self {
        Self {
            cloud: None,
            scale: 1.0,
            pose: None,
            views: 3,
            distance_mm: 700.0,
            slant_deg: 25.0,
            image_px: [628, 468],
            field_of_view_deg: [59.0, 46.0],
            baseline_mm: 70.0,
            range_mm: [550.0, 2800.0],
            noise_px: 0.1,
            window_px: 5,
            disparity_step_px: 0.0,
            dropout: 0.02,
            mismatches: 0.001,
            grazing_deg: 80.0,
            calibration_mm: 0.5,
            calibration_deg: 0.05,
            register: true,
            placement_mm: 10.0,
            placement_deg: 1.0,
            marks: false,
            marks_at_mm: Vec::new(),
            marks_noise_mm: 0.3,
            margin_mm: 60.0,
            skirt_mm: 200.0,
            voxel_mm: 2.0,
            outlier_deviations: 3.0,
            triangle_mm: 4.5,
            smooth_mm: None,
            hole_mm: 30.0,
            cameras: Vec::new(),
        }
    }
}

/// Every number in its range; the cloud's path made absolute.
pub(super) fn resolve_scan(
    mut scan: ScanSettings,
    folder: &Path,
    check: &Check,
) -> Result<ScanSettings, ScenarioError> {
    if let Some(cloud) = &scan.cloud {
        let file = existing(&folder.join(cloud)).map_err(|e| check.sentence("scan.cloud", e))?;
        if !file.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply")) {
            return Err(check.wrong("scan.cloud", "must be a .ply file"));
        }
        scan.cloud = Some(file.to_string_lossy().into_owned());
    }
    check.above_zero("scan.scale", scan.scale, 1e6)?;
    if let Some(pose) = scan.pose {
        for x in pose.xyz_mm {
            check.within("scan.pose.xyz_mm", x, -1e6, 1e6)?;
        }
        for x in pose.rpy_deg {
            check.within("scan.pose.rpy_deg", x, -360.0, 360.0)?;
        }
    }
    check.within("scan.views", f64::from(scan.views), 1.0, 32.0)?;
    check.above_zero("scan.distance_mm", scan.distance_mm, 1e5)?;
    check.within("scan.slant_deg", scan.slant_deg, 0.0, 75.0)?;
    for px in scan.image_px {
        check.within("scan.image_px", f64::from(px), 8.0, 4096.0)?;
    }
    for angle in scan.field_of_view_deg {
        check.within("scan.field_of_view_deg", angle, 1.0, 150.0)?;
    }
    check.above_zero("scan.baseline_mm", scan.baseline_mm, 1e4)?;
    let [near, far] = scan.range_mm;
    check.above_zero("scan.range_mm", near, 1e6)?;
    check.above_zero("scan.range_mm", far, 1e6)?;
    if near >= far {
        return Err(check.wrong("scan.range_mm", format!("must rise, as [550, 2800], not [{near}, {far}]")));
    }
    check.within("scan.noise_px", scan.noise_px, 0.0, 20.0)?;
    check.within("scan.window_px", f64::from(scan.window_px), 1.0, 99.0)?;
    check.within("scan.disparity_step_px", scan.disparity_step_px, 0.0, 8.0)?;
    check.within("scan.dropout", scan.dropout, 0.0, 1.0)?;
    check.within("scan.mismatches", scan.mismatches, 0.0, 1.0)?;
    check.within("scan.grazing_deg", scan.grazing_deg, 1.0, 89.9)?;
    check.within("scan.calibration_mm", scan.calibration_mm, 0.0, 1000.0)?;
    check.within("scan.calibration_deg", scan.calibration_deg, 0.0, 45.0)?;
    check.within("scan.placement_mm", scan.placement_mm, 0.0, 1000.0)?;
    check.within("scan.placement_deg", scan.placement_deg, 0.0, 45.0)?;
    check.within("scan.marks_noise_mm", scan.marks_noise_mm, 0.0, 1000.0)?;
    for x in scan.marks_at_mm.iter().flatten() {
        check.within("scan.marks_at_mm", *x, -1e4, 1e4)?;
    }
    if scan.marks && scan.cloud.is_some() {
        return Err(
            check.sentence("scan.marks", "marks are found by the simulated cameras: with a `cloud` there are none")
        );
    }
    check.within("scan.margin_mm", scan.margin_mm, 0.0, 1e4)?;
    check.within("scan.skirt_mm", scan.skirt_mm, 0.0, 1e4)?;
    check.within("scan.voxel_mm", scan.voxel_mm, 0.0, 1000.0)?;
    check.within("scan.outlier_deviations", scan.outlier_deviations, 0.0, 100.0)?;
    check.within("scan.triangle_mm", scan.triangle_mm, 0.05, 1000.0)?;
    if let Some(radius) = scan.smooth_mm {
        check.above_zero("scan.smooth_mm", radius, 1000.0)?;
    }
    check.within("scan.hole_mm", scan.hole_mm, 0.0, 1000.0)?;
    for camera in &scan.cameras {
        for x in camera.eye_mm.iter().chain(&camera.target_mm) {
            check.within("scan.camera.eye_mm", *x, -1e6, 1e6)?;
        }
        if camera.eye_mm == camera.target_mm {
            return Err(check.sentence("scan.camera.target_mm", "a camera can't look at its own eye"));
        }
    }
    Ok(scan)
}
