//! The canvas as a depth camera sees it: a simulated stereo camera, the cleaning of point clouds, and a mesh through them.
//!
//! [`scan_canvas`] is the sensor: it may see the true canvas and gives a believed one. [`from_cloud`] does the same from points that
//! were really measured. The way from points to mesh: views are moved onto each other (point-to-plane, all at once, held by how well
//! the cameras' poses are known), what isn't round the sheet and what stands alone is dropped, points in one small cube become one;
//! then surface nets through the implicit moving-least-squares distance give the topology, what no point bears out is trimmed, small
//! holes are closed, and each vertex is put on a quadratic patch fitted robustly to its neighbourhood. The result is a manifold in one
//! piece with a boundary. The dissertation (V.A.2) measures normals of the points, or of a mesh through them, and takes the mesh.
mod camera;
mod cloud;
mod error;
mod fit;
mod kdtree;
mod nets;
mod normals;
mod options;
mod patch;
mod reconstruct;
mod register;
mod skirt;

use nalgebra::{Isometry3, Point2, Point3, Rotation3, UnitQuaternion, Vector3};

use crate::math::Pose;
use crate::mesh::{PointCloud, TriMesh};
use crate::surface::{BelievedCanvas, Canvas, Mapping, Projection, SheetFrame, TrueCanvas};

pub use camera::DepthCamera;
pub use cloud::Cloud;
pub use error::ScanError;
pub use options::{MeshingOptions, ScanOptions, ScanReport, Viewpoint, Viewpoints};
pub use skirt::skirt;

use reconstruct::{Built, Wish, reconstruct};
use register::{Prior, register};

/// Fewest points round the sheet that a mesh is made of.
const FEWEST: usize = 50;
/// Points of each view beyond this many are thinned out for registration's normals, m.
const REGISTER_VOXEL: f64 = 0.003;
/// Radius of the normals that views are registered by, m.
const REGISTER_RADIUS: f64 = 0.012;
/// What a cloud without normals is thought to have been seen from: so far in front of the sheet, m.
const EYE_DISTANCE: f64 = 0.7;

/// Scans the true canvas, and the `occluders` (world) round it, which the camera sees as well, and gives the canvas that the robot
/// believes in after it: the reconstructed mesh of what lies behind the centre of `nominal_sheet`, and that sheet.
///
/// `sheet_size` (m) is what is to be drawn on; [`MeshingOptions::margin`] is added on each side.
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
    let meshes: Vec<&TriMesh> = std::iter::once(&truth.mesh).chain(occluders).collect();
    let mut measured = 0;
    let mut views: Vec<Cloud> = Vec::with_capacity(poses.len());
    for (i, pose) in poses.iter().enumerate() {
        let real = camera::misplaced(pose, options.calibration, options.calibration_angle, seed, i as u64);
        let seen = options.camera.take(&meshes, &real, pose, seed, i as u64);
        measured += seen.len();
        let seen = seen.cropped(nominal_sheet, sheet_size, options.meshing.margin);
        views.push(cleaned(seen, &options.meshing));
    }
    let found: usize = views.iter().map(Cloud::len).sum();
    if found < FEWEST {
        return Err(ScanError::NothingSeen { min_range_mm: options.camera.range[0] * 1e3 });
    }
    let mut registered_by = 0.0f64;
    if options.register {
        let eyes: Vec<Point3<f64>> = poses.iter().map(|p| Point3::from(p.translation.vector)).collect();
        let prior = Prior { distance: options.calibration, angle: options.calibration_angle };
        let thin: Vec<Cloud> = views.iter().map(|v| v.downsampled(REGISTER_VOXEL)).collect();
        // views may be apart by what the calibration may be off, and by noise
        let distance =
            poses.iter().map(|p| (p.translation.vector - nominal_sheet.world_from_sheet.translation.vector).norm());
        let reach = 0.004 + 4.0 * (prior.distance + prior.angle * distance.fold(0.0, f64::max));
        let moves = register(&thin, &eyes, prior, reach, REGISTER_RADIUS);
        for ((view, motion), eye) in views.iter_mut().zip(&moves).zip(&eyes) {
            move_cloud(view, motion);
            registered_by = registered_by.max((motion * eye - eye).norm());
        }
    }
    let mut cloud = Cloud::default();
    views.into_iter().for_each(|v| cloud.append(v));
    let (belief, report) = build(cloud, measured, &truth.name, nominal_sheet, &options.meshing)?;
    Ok((belief, ScanReport { registered_by, ..report }))
}

/// The canvas through a measured cloud (world, m). Its normals, when it has any, say on which side it was seen from; without them it
/// was seen from in front of the sheet.
///
/// # Errors
/// Points that are not finite or too few, and clouds through which no surface goes.
pub fn from_cloud(
    points: &PointCloud,
    name: &str,
    sheet: &SheetFrame,
    sheet_size: [f64; 2],
    options: &MeshingOptions,
) -> Result<(BelievedCanvas, ScanReport), ScanError> {
    options.check()?;
    let finite = |v: &Vector3<f64>| v.iter().all(|c| c.is_finite());
    if let Some(index) = points.points.iter().position(|p| !finite(&p.coords)) {
        return Err(ScanError::NotFinite { index });
    }
    if let Some(index) = points.normals.iter().position(|n| !finite(n)) {
        return Err(ScanError::NotFinite { index });
    }
    let eye = sheet.world_from_sheet * Point3::new(0.0, 0.0, EYE_DISTANCE);
    let outward = sheet.world_from_sheet * Vector3::z();
    let mut cloud = Cloud::default();
    for (i, p) in points.points.iter().enumerate() {
        let toward = (eye - p).try_normalize(1e-9).unwrap_or(outward);
        let side = points.normals.get(i).and_then(|n| n.try_normalize(1e-9));
        cloud.push(*p, side.unwrap_or(toward), 1.0);
    }
    let cloud = cleaned(cloud.cropped(sheet, sheet_size, options.margin), options);
    build(cloud, points.points.len(), name, sheet, options)
}

/// Without what stands alone.
fn cleaned(cloud: Cloud, options: &MeshingOptions) -> Cloud {
    if options.outlier_deviations > 0.0 { cloud.without_outliers(options.outlier_deviations) } else { cloud }
}

/// From a cleaned cloud to the canvas.
fn build(
    cloud: Cloud,
    measured: usize,
    name: &str,
    sheet: &SheetFrame,
    options: &MeshingOptions,
) -> Result<(BelievedCanvas, ScanReport), ScanError> {
    if cloud.len() < FEWEST {
        return Err(ScanError::TooFewPoints { found: cloud.len(), all: measured, needed: FEWEST });
    }
    let cloud = if options.voxel > 0.0 { cloud.downsampled(options.voxel) } else { cloud };
    let wish = Wish { triangle: options.triangle, radius: options.radius, hole: options.hole };
    let Built { mesh, cloud, noise, radius, loops } = reconstruct(&cloud, sheet, wish)?;
    let canvas = Canvas { name: name.to_string(), mesh, sheet: sheet.clone() };
    if Projection::new(&canvas).to_surface(&Point2::origin()).is_none() {
        return Err(ScanError::NoSurface);
    }
    let report = ScanReport { measured, cloud, noise, radius, boundary_loops: loops, registered_by: 0.0 };
    Ok((BelievedCanvas(canvas), report))
}

fn move_cloud(cloud: &mut Cloud, motion: &Isometry3<f64>) {
    cloud.points.iter_mut().for_each(|p| *p = motion * *p);
    cloud.toward_eye.iter_mut().for_each(|d| *d = motion * *d);
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
        .map(|(camera, place)| camera::look_at(&place.eye, &place.target, &up).ok_or(ScanError::BadCamera { camera }))
        .collect()
}

#[cfg(test)]
mod tests;
