//! From measured points to a believed canvas: the cleaning of point clouds, and a mesh through them.
//!
//! [`from_views`] takes what a depth camera saw from several places, [`from_cloud`] points from anywhere. The way from points to mesh: views are moved onto each other (point-to-plane, all at once, held by how well
//! the cameras' poses are known), what isn't round the sheet and what stands alone is dropped, points in one small cube become one;
//! then surface nets through the implicit moving-least-squares distance give the topology, what no point bears out is trimmed, small
//! holes are closed, and each vertex is put on a quadratic patch fitted robustly to its neighbourhood. The result is a manifold in one
//! piece with a boundary. The dissertation (V.A.2) measures normals of the points, or of a mesh through them, and takes the mesh.
mod cloud;
mod error;
mod fit;
mod kdtree;
mod meshing;
mod nets;
mod normals;
mod options;
mod patch;
mod register;
mod sheet_pose;
mod skirt;

use nalgebra::{Isometry3, Point2, Point3, Vector3};

use crate::math::Pose;
use crate::mesh::PointCloud;
use crate::surface::{BelievedCanvas, Canvas, Mapping, Projection, SheetFrame};

pub use cloud::Cloud;
pub use error::ReconstructError;
pub use options::{MeshingOptions, ScanReport};
pub use register::Prior;
pub use sheet_pose::{Located, Mark, Placement, locate_sheet};
pub use skirt::skirt;

use meshing::{Built, MeshOptions, reconstruct};
use register::register;

/// Fewest points round the sheet that a mesh is made of.
const FEWEST: usize = 50;
/// Points of each view beyond this many are thinned out for registration's normals, m.
const REGISTER_VOXEL: f64 = 0.003;
/// Radius of the normals that views are registered by, m.
const REGISTER_RADIUS: f64 = 0.012;
/// What a cloud without normals is thought to have been seen from: so far in front of the sheet, m.
const EYE_DISTANCE: f64 = 0.7;

/// The canvas through what cameras saw that are believed to be at `world_from_camera`, a view an entry of both. Where `prior` says
/// how well they are known to be there, the views are moved onto each other.
///
/// `sheet_size` (m) is what is to be drawn on; [`MeshingOptions::margin`] is added on each side.
///
/// # Errors
/// Options out of range, points that are too few, and clouds through which no surface goes.
pub fn from_views(
    views: Vec<Cloud>,
    world_from_camera: &[Pose],
    prior: Option<Prior>,
    name: &str,
    sheet: &SheetFrame,
    sheet_size: [f64; 2],
    options: &MeshingOptions,
) -> Result<(BelievedCanvas, ScanReport), ReconstructError> {
    options.check()?;
    let measured = views.iter().map(Cloud::len).sum();
    let clean = |seen: Cloud| cleaned(seen.cropped(sheet, sheet_size, options.margin), options);
    let mut views: Vec<Cloud> = views.into_iter().map(clean).collect();
    let found: usize = views.iter().map(Cloud::len).sum();
    if found < FEWEST {
        return Err(ReconstructError::TooFewPoints { found, all: measured, needed: FEWEST });
    }
    let mut registered_by = 0.0f64;
    if let Some(prior) = prior {
        let eyes: Vec<Point3<f64>> = world_from_camera.iter().map(|p| Point3::from(p.translation.vector)).collect();
        let thin: Vec<Cloud> = views.iter().map(|v| v.downsampled(REGISTER_VOXEL)).collect();
        // views may be apart by what the calibration may be off, and by noise
        let distance =
            world_from_camera.iter().map(|p| (p.translation.vector - sheet.world_from_sheet.translation.vector).norm());
        let reach = 0.004 + 4.0 * (prior.distance + prior.angle * distance.fold(0.0, f64::max));
        let moves = register(&thin, &eyes, prior, reach, REGISTER_RADIUS);
        for ((view, motion), eye) in views.iter_mut().zip(&moves).zip(&eyes) {
            move_cloud(view, motion);
            registered_by = registered_by.max((motion * eye - eye).norm());
        }
    }
    let mut cloud = Cloud::default();
    views.into_iter().for_each(|v| cloud.append(v));
    let (belief, report) = build(cloud, measured, name, sheet, options)?;
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
) -> Result<(BelievedCanvas, ScanReport), ReconstructError> {
    options.check()?;
    let finite = |v: &Vector3<f64>| v.iter().all(|c| c.is_finite());
    if let Some(index) = points.points.iter().position(|p| !finite(&p.coords)) {
        return Err(ReconstructError::NotFinite { index });
    }
    if let Some(index) = points.normals.iter().position(|n| !finite(n)) {
        return Err(ReconstructError::NotFinite { index });
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
) -> Result<(BelievedCanvas, ScanReport), ReconstructError> {
    if cloud.len() < FEWEST {
        return Err(ReconstructError::TooFewPoints { found: cloud.len(), all: measured, needed: FEWEST });
    }
    let cloud = if options.voxel > 0.0 { cloud.downsampled(options.voxel) } else { cloud };
    let mesh = MeshOptions { triangle: options.triangle, radius: options.radius, hole: options.hole };
    let Built { mesh, cloud, noise, radius, loops } = reconstruct(&cloud, sheet, mesh)?;
    let canvas = Canvas { name: name.to_string(), mesh, sheet: sheet.clone() };
    if Projection::new(&canvas).to_surface(&Point2::origin()).is_none() {
        return Err(ReconstructError::NoSurface);
    }
    let report = ScanReport { measured, cloud, noise, radius, boundary_loops: loops, registered_by: 0.0 };
    Ok((BelievedCanvas(canvas), report))
}

fn move_cloud(cloud: &mut Cloud, motion: &Isometry3<f64>) {
    cloud.points.iter_mut().for_each(|p| *p = motion * *p);
    cloud.toward_eye.iter_mut().for_each(|d| *d = motion * *d);
}

#[cfg(test)]
mod tests;
