//! Marks printed on the canvas, and where a camera finds them.
use nalgebra::{Point2, Point3, Vector3};

use super::{DepthCamera, ScanError, ScanOptions, depth_camera as camera, poses};
use crate::math::{Pose, standard_normal, stream};
use crate::mesh::{SurfacePoint, TriMesh};
use crate::reconstruct::Mark;
use crate::surface::{Mapping, Projection, SheetFrame};
use crate::truth::TrueCanvas;

/// A mark counts as seen when nothing is in its way nearer than this to it, m.
const SEEN: f64 = 2e-3;

/// The corners of a sheet of `size` (m), where marks are printed unless another place is stated.
pub fn sheet_corners(size: [f64; 2]) -> Vec<Point2<f64>> {
    let [x, y] = size.map(|s| 0.5 * s);
    vec![Point2::new(-x, -y), Point2::new(x, -y), Point2::new(x, y), Point2::new(-x, y)]
}

/// Looks for the marks that are printed on the true canvas straight behind `places` (m) of its sheet. A camera that has the mark in
/// its picture and its range, free and not at a grazing angle, finds it: at its true place with normal errors of deviation `noise`
/// (m) along each axis, the same however many cameras see it. The cameras are those that scan: they are aimed at `nominal_sheet`.
///
/// # Errors
/// Options out of range.
pub fn find_marks(
    truth: &TrueCanvas,
    occluders: &[TriMesh],
    nominal_sheet: &SheetFrame,
    places: &[Point2<f64>],
    noise: f64,
    options: &ScanOptions,
    seed: u64,
) -> Result<Vec<Mark>, ScanError> {
    options.check()?;
    let meshes: Vec<&TriMesh> = std::iter::once(truth.mesh()).chain(occluders).collect();
    let eyes: Vec<Pose> = poses(&options.views, nominal_sheet)?
        .iter()
        .enumerate()
        .map(|(i, pose)| camera::misplaced(pose, options.calibration, options.calibration_angle, seed, i as u64))
        .collect();
    let printed = Projection::new(truth.reveal());
    let find = |(i, on_sheet): (usize, &Point2<f64>)| {
        let mark = printed.to_surface(on_sheet)?;
        let mut random = stream(seed, "scan marks", i as u64);
        let error = Vector3::from_fn(|_, _| noise * standard_normal(&mut random));
        let found = eyes.iter().any(|eye| sees(&options.camera, eye, &meshes, &mark));
        found.then(|| Mark { on_sheet: *on_sheet, position: mark.position + error })
    };
    Ok(places.iter().enumerate().filter_map(find).collect())
}

/// Whether a camera at `world_from_camera` sees a mark among `meshes`.
fn sees(camera: &DepthCamera, world_from_camera: &Pose, meshes: &[&TriMesh], mark: &SurfacePoint) -> bool {
    let p = world_from_camera.inverse() * mark.position;
    let in_range = (camera.range[0]..=camera.range[1]).contains(&p.z);
    let [half_x, half_y] = camera.field_of_view.map(|angle| (0.5 * angle).tan());
    if !in_range || p.x.abs() > half_x * p.z || p.y.abs() > half_y * p.z {
        return false;
    }
    let eye = Point3::from(world_from_camera.translation.vector);
    let (direction, distance) = nalgebra::Unit::new_and_get(mark.position - eye);
    let incidence = -mark.face_normal.dot(&direction);
    incidence > camera.grazing.cos() && meshes.iter().all(|m| m.cast_ray(&eye, &direction, distance - SEEN).is_none())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Viewpoint, Viewpoints};
    use crate::mesh::shapes;
    use crate::surface::Canvas;

    const SIZE: [f64; 2] = [0.2, 0.1];

    /// A wall 50 mm behind its sheet.
    fn wall() -> TrueCanvas {
        let mesh = shapes::rectangle(0.5, 0.5, 0.01, 0.05).unwrap();
        let sheet = SheetFrame { world_from_sheet: Pose::translation(0.02, 0.01, 0.05) };
        TrueCanvas::nominal(Canvas { name: "wall".into(), mesh, sheet })
    }

    fn found(occluders: &[TriMesh], noise: f64, options: &ScanOptions, seed: u64) -> Vec<Mark> {
        let truth = wall();
        find_marks(&truth, occluders, truth.sheet(), &sheet_corners(SIZE), noise, options, seed).unwrap()
    }

    #[test]
    fn marks_lie_on_the_canvas_behind_the_corners_of_the_true_sheet() {
        let marks = found(&[], 0.0, &ScanOptions::default(), 1);
        assert_eq!(marks.len(), 4);
        for m in marks {
            let desired = Point3::new(m.on_sheet.x + 0.02, m.on_sheet.y + 0.01, 0.0);
            assert!((m.position - desired).norm() < 1e-9, "{}", m.position);
        }
    }

    #[test]
    fn errors_have_their_spread_and_each_mark_its_own() {
        let marks: Vec<Mark> = (0..200).flat_map(|seed| found(&[], 1e-3, &ScanOptions::default(), seed)).collect();
        assert_eq!(marks.len(), 800);
        let off = |m: &Mark| m.position - Point3::new(m.on_sheet.x + 0.02, m.on_sheet.y + 0.01, 0.0);
        for axis in 0..3 {
            let sd = (marks.iter().map(|m| off(m)[axis].powi(2)).sum::<f64>() / 800.0).sqrt();
            assert!((sd / 1e-3 - 1.0).abs() < 0.1, "{sd}");
        }
        assert!((off(&marks[0]) - off(&marks[1])).norm() > 1e-5);
        // that one mark is hidden doesn't shift the errors of the others
        let lid = shapes::cuboid(&Vector3::new(0.02, 0.02, 0.005), 0.01).unwrap();
        let lid = lid.transformed(&Pose::translation(-0.08, -0.04, 0.006));
        let rest = found(&[lid], 1e-3, &ScanOptions::default(), 0);
        assert_eq!(rest, marks[1..4]);
    }

    #[test]
    fn what_no_camera_sees_is_not_found() {
        let only = |eye: Point3<f64>, target: Point3<f64>| ScanOptions {
            views: Viewpoints::At(vec![Viewpoint { eye, target }]),
            ..ScanOptions::default()
        };
        let middle = Point3::new(0.02, 0.01, 0.0);
        let count = |eye, target| found(&[], 0.0, &only(eye, target), 1).len();
        assert_eq!(count(Point3::new(0.02, 0.01, 0.7), middle), 4);
        assert_eq!(count(Point3::new(0.02, 0.01, 0.4), middle), 0, "nearer than the range");
        assert_eq!(count(Point3::new(0.02, 0.01, -0.7), middle), 0, "from behind");
        assert_eq!(count(Point3::new(0.7, 0.01, 0.05), middle), 0, "grazing");
        assert_eq!(count(Point3::new(0.42, 0.01, 0.7), Point3::new(0.42, 0.01, 0.0)), 2, "beside the picture");
    }
}
