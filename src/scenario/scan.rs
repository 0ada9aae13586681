//! `[scan]`: the canvas as a depth camera, or a cloud of one's own, shows it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::assets::existing;
use super::check::Check;
use super::resolve::ScenarioError;

/// `[scan]`: how the canvas is scanned, with `canvas.belief = "scan"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ScanSettings {
    /// A point cloud, `.ply` (text or binary, with or without normals), in place of the simulated camera; relative to
    /// the scenario's folder. World frame, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cloud: Option<String>,
    /// Metres a unit of the cloud's file: 0.001 for mm.
    #[schemars(range(min = 1e-6, max = 1e6))]
    pub scale: f64,
    /// Where the cloud's frame stands in the world; as it is when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<ScanPose>,
    /// Pictures taken: the first from straight in front of the sheet, the others round it.
    #[schemars(range(min = 1, max = 32))]
    pub views: u32,
    /// Distance of the camera's places from the sheet's centre.
    #[schemars(range(min = 10, max = 1e5))]
    pub distance_mm: f64,
    /// Angle of all but the first from the sheet's normal.
    #[schemars(range(min = 0, max = 75))]
    pub slant_deg: f64,
    /// Columns and rows of the depth image. This and the next three are a RealSense ZR300's.
    #[schemars(inner(range(min = 8, max = 4096)))]
    pub image_px: [u32; 2],
    /// Horizontal and vertical angle of view.
    #[schemars(inner(range(min = 1, max = 150)))]
    pub field_of_view_deg: [f64; 2],
    /// Distance between the camera's two eyes.
    #[schemars(range(min = 1, max = 1e4))]
    pub baseline_mm: f64,
    /// Least and greatest depth that is measured.
    #[schemars(inner(range(min = 1, max = 1e6)))]
    pub range_mm: [f64; 2],
    /// Standard deviation of the disparity `d = f b / z`, so depth is off by `z^2 / (f b)` of it: 1.3 mm at 0.7 m.
    #[schemars(range(min = 0, max = 20))]
    pub noise_px: f64,
    /// Side of the window that is matched: depths within it err alike, and more points don't average that out.
    #[schemars(range(min = 1, max = 99))]
    pub window_px: u32,
    /// Steps in which disparity is known; 0 is without steps.
    #[schemars(range(min = 0, max = 8))]
    pub disparity_step_px: f64,
    /// Share of pixels that give nothing.
    #[schemars(range(min = 0, max = 1))]
    pub dropout: f64,
    /// Share of pixels that are matched with a wrong place.
    #[schemars(range(min = 0, max = 1))]
    pub mismatches: f64,
    /// Angle between line of sight and normal from which nothing is measured; losses begin at 60.
    #[schemars(range(min = 1, max = 89.9))]
    pub grazing_deg: f64,
    /// Standard deviation of the error of a camera's place along each axis.
    #[schemars(range(min = 0, max = 1000))]
    pub calibration_mm: f64,
    /// Standard deviation of the error of a camera's angle about each axis.
    #[schemars(range(min = 0, max = 45))]
    pub calibration_deg: f64,
    /// Move the views onto each other.
    pub register: bool,
    /// Standard deviation with which the canvas's middle may stand off its nominal place along each axis, as far as
    /// the robot knows. The sheet is put where the scanned shape says that it is, as far as the shape says so. 0 is a
    /// place that is known: there the sheet stays, whatever shape and marks say. Right for a canvas that stands where
    /// it should but has another shape than it should.
    #[schemars(range(min = 0, max = 1000))]
    pub placement_mm: f64,
    /// Standard deviation with which it may be turned about each axis through its middle; 0 is a turn that is known.
    #[schemars(range(min = 0, max = 45))]
    pub placement_deg: f64,
    /// Marks are printed on the canvas, and the cameras find those that they see: they say where the sheet is where
    /// the shape doesn't. Not with `cloud`.
    pub marks: bool,
    /// Places of the marks on the sheet, from its centre, right and up: `[[-60, -60], [60, -60], [0, 60]]`; its
    /// corners when absent. They lie on the canvas straight behind.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(inner(inner(range(min = -1e4, max = 1e4))))]
    pub marks_at_mm: Vec<[f64; 2]>,
    /// Standard deviation of a mark's found place along each axis.
    #[schemars(range(min = 0, max = 1000))]
    pub marks_noise_mm: f64,
    /// What is scanned round the nominal sheet, on each side, also for how far the canvas may stand off.
    #[schemars(range(min = 0, max = 1e4))]
    pub margin_mm: f64,
    /// How far beyond what was scanned the canvas is thought to go on: level with its border or, where that rises,
    /// rising. Travels keep clear of it there too.
    #[schemars(range(min = 0, max = 1e4))]
    pub skirt_mm: f64,
    /// Points in a cube of this edge become one; 0 keeps all.
    #[schemars(range(min = 0, max = 1000))]
    pub voxel_mm: f64,
    /// Points whose neighbours are farther than usual by more standard deviations than this are dropped; 0 keeps all.
    #[schemars(range(min = 0, max = 100))]
    pub outlier_deviations: f64,
    /// Mean edge of the mesh's triangles.
    #[schemars(range(min = 0.05, max = 1000))]
    pub triangle_mm: f64,
    /// Radius of the neighbourhoods that the surface is fitted to: more is smoother, and flattens bumps; by spacing
    /// and noise of the points when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.05, max = 1000))]
    pub smooth_mm: Option<f64>,
    /// Holes up to this extent are closed.
    #[schemars(range(min = 0, max = 1000))]
    pub hole_mm: f64,
    /// A place of one's own in place of `views`.
    #[serde(rename = "camera", skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<ScanCamera>,
}

/// `pose` of a cloud: translation, and fixed-axis roll, pitch and yaw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ScanPose {
    /// Where the cloud's origin lies, in the world.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub xyz_mm: [f64; 3],
    /// Roll, pitch and yaw.
    #[schemars(inner(range(min = -360, max = 360)))]
    pub rpy_deg: [f64; 3],
}

/// `[[scan.camera]]`: a place to take a picture from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScanCamera {
    /// Where the eye is, in the world.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub eye_mm: [f64; 3],
    /// What it looks at, in the world.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
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

/// What no range says; the cloud's path made absolute.
pub(super) fn resolve_scan(mut scan: ScanSettings, check: &Check) -> Result<ScanSettings, ScenarioError> {
    if let Some(cloud) = &scan.cloud {
        let file = check.file("scan.cloud", |folder| existing(&folder.join(cloud)))?;
        if !file.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply")) {
            return Err(check.wrong("scan.cloud", "must be a .ply file"));
        }
        scan.cloud = Some(file.to_string_lossy().into_owned());
    }
    let [near, far] = scan.range_mm;
    if near >= far {
        return Err(check.wrong("scan.range_mm", format!("must rise, as [550, 2800], not [{near}, {far}]")));
    }
    if scan.marks && scan.cloud.is_some() {
        return Err(
            check.sentence("scan.marks", "marks are found by the simulated cameras: with a `cloud` there are none")
        );
    }
    for (i, camera) in scan.cameras.iter().enumerate() {
        if camera.eye_mm == camera.target_mm {
            return Err(check.sentence(&format!("scan.camera.{i}.target_mm"), "a camera can't look at its own eye"));
        }
    }
    Ok(scan)
}
