//! The canvas as cameras see it: a simulated stereo camera, and where it looks from; and a camera on the hand, which sees ink too.
//!
//! [`scan_canvas`] is the sensor: it sees the true canvas, and gives what a robot believes of what was seen. [`HandCamera`] gives pixels.
mod depth_camera;
mod error;
mod hand_camera;
mod marks;
mod options;

use nalgebra::{Point3, Rotation3, UnitQuaternion, Vector3};

use crate::math::Pose;
use crate::mesh::TriMesh;
use crate::reconstruct::{Cloud, Prior, ReconstructError, ScanReport, from_views};
use crate::surface::{BelievedCanvas, SheetFrame};
use crate::truth::TrueCanvas;

pub use depth_camera::DepthCamera;
pub use error::ScanError;
pub use hand_camera::{HandCamera, HandCameraOptions, Sight};
pub use marks::{find_marks, sheet_corners};
pub use options::{ScanOptions, Viewpoint, Viewpoints};

use depth_camera::{look_at, misplaced};

/// Scans the true canvas, and the `occluders` (world) round it, which the camera sees as well, and gives the canvas that the robot
/// believes in after it: the reconstructed mesh of what lies behind the centre of `nominal_sheet`, and that sheet.
///
/// `sheet_size` (m) is what is to be drawn on; [`MeshingOptions::margin`](crate::reconstruct::MeshingOptions::margin) is added on each side.
///
/// # Errors
/// Options out of range, cameras that see nothing of it, and clouds through which no surface goes.
pub fn scan_canvas(
    truth: &TrueCanvas,
    occluders: &[TriMesh],
    nominal_sheet: &SheetFrame,
    sheet_size: [f64; 2],
    options: &ScanOptions,
    seed: u64,
) -> Result<(BelievedCanvas, ScanReport), ScanError> {
    options.check()?;
    let poses = poses(&options.views, nominal_sheet)?;
    let meshes: Vec<&TriMesh> = std::iter::once(truth.mesh()).chain(occluders).collect();
    let take = |(i, pose): (usize, &Pose)| {
        let real = misplaced(pose, options.calibration, options.calibration_angle, seed, i as u64);
        options.camera.take(&meshes, &real, pose, seed, i as u64)
    };
    let views: Vec<Cloud> = poses.iter().enumerate().map(take).collect();
    let prior = options.register.then_some(Prior { distance: options.calibration, angle: options.calibration_angle });
    let made = from_views(views, &poses, prior, truth.name(), nominal_sheet, sheet_size, &options.meshing);
    made.map_err(|error| match error {
        ReconstructError::TooFewPoints { .. } => ScanError::NothingSeen { min_range_mm: options.camera.range[0] * 1e3 },
        error => error.into(),
    })
}

/// `world_from_camera` of each view, as planned. The sheet's upper edge is up in the pictures.
fn poses(views: &Viewpoints, sheet: &SheetFrame) -> Result<Vec<Pose>, ScanError> {
    let places: Vec<Viewpoint> = match views {
        Viewpoints::At(places) => places.clone(),
        Viewpoints::Around { count, distance, slant } => (0..*count)
            .map(|i| {
                let target = sheet.world_from_sheet * Point3::origin();
                let round = std::f64::consts::TAU * (i.max(1) - 1) as f64 / (count.max(&2) - 1) as f64;
                let tilt = if i == 0 { 0.0 } else { *slant };
                let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_euler_angles(0.0, tilt, 0.0));
                let spin = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), round);
                let back = spin * turn * Vector3::z() * *distance;
                Viewpoint { eye: target + sheet.world_from_sheet * back, target }
            })
            .collect(),
    };
    let up = sheet.world_from_sheet * Vector3::y();
    places
        .iter()
        .enumerate()
        .map(|(camera, place)| look_at(&place.eye, &place.target, &up).ok_or(ScanError::BadCamera { camera }))
        .collect()
}

#[cfg(test)]
mod sheet_tests;
#[cfg(test)]
mod tests;
