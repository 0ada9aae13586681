use std::collections::BTreeMap;

use nalgebra::{Point2, Translation3};

use super::*;
use crate::math::{Pose, frame_from_axes};
use crate::mesh::PointCloud;
use crate::mesh::shapes::{self, Bumps};
use crate::reconstruct::{MeshingOptions, from_cloud};
use crate::surface::{Canvas, Mapping, Projection};

/// A bumpy column before a sheet that hangs 50 mm off it.
fn column() -> TrueCanvas {
    let mesh = shapes::column(0.28, 0.6, &Bumps { amplitude: 0.006, wavelength: 0.14 }, 0.01).unwrap();
    let outward = -Vector3::x();
    let rotation = frame_from_axes(&outward, &Vector3::z().cross(&outward));
    let sheet = SheetFrame { world_from_sheet: Pose::from_parts(Translation3::new(-0.33, 0.0, 0.3), rotation) };
    TrueCanvas::nominal(Canvas { name: "column".into(), mesh, sheet })
}

/// A small and quick scan.
fn options(noise_px: f64) -> ScanOptions {
    let camera = DepthCamera { size_px: [314, 234], noise_px, window_px: 1, ..DepthCamera::default() };
    let meshing = MeshingOptions { margin: 0.03, triangle: 0.006, ..MeshingOptions::default() };
    ScanOptions { camera, meshing, calibration: 0.0, calibration_angle: 0.0, ..ScanOptions::default() }
}

const SIZE: [f64; 2] = [0.1, 0.1];

/// Distances (m) of the believed surface from the true one, all over the sheet.
fn errors(truth: &TrueCanvas, belief: &BelievedCanvas) -> Vec<f64> {
    let projection = Projection::new(belief);
    (0..21 * 21)
        .map(|k| Point2::new(f64::from(k % 21) - 10.0, f64::from(k / 21) - 10.0) * 0.005)
        .map(|p| projection.to_surface(&p).expect("the sheet is covered").position)
        .map(|p| (truth.mesh().closest_point(&p).position - p).norm())
        .collect()
}

fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|e| e * e).sum::<f64>() / x.len() as f64).sqrt()
}

/// Every edge has one or two triangles, there is one boundary, and the numbers of vertices, edges and triangles are a disc's.
fn is_disc(mesh: &TriMesh, report: &ScanReport) -> bool {
    let mut edges: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for [a, b, c] in mesh.triangles() {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *edges.entry([*from.min(to), *from.max(to)]).or_default() += 1;
        }
    }
    let manifold = edges.values().all(|n| *n <= 2);
    let euler = mesh.vertices().len() as i64 - edges.len() as i64 + mesh.triangles().len() as i64;
    manifold && euler == 1 && report.boundary_loops == 1
}

#[test]
fn without_noise_the_surface_comes_back() {
    let truth = column();
    let (belief, report) = scan_canvas(&truth, &[], truth.sheet(), SIZE, &options(0.0), 1).unwrap();
    let errors = errors(&truth, &belief);
    assert!(rms(&errors) < 5e-5, "{} m", rms(&errors));
    assert!(is_disc(&belief.mesh, &report));
    assert_eq!(report.boundary_loops, 1);
    let outward = -Vector3::x();
    assert!(belief.mesh.face_normals().iter().all(|n| n.dot(&outward) > 0.0));
}

#[test]
fn noise_is_averaged_down_and_more_noise_is_more_error() {
    let truth = column();
    let error = |noise_px| {
        let (belief, report) = scan_canvas(&truth, &[], truth.sheet(), SIZE, &options(noise_px), 1).unwrap();
        assert!(is_disc(&belief.mesh, &report), "at {noise_px} px: {} loops", report.boundary_loops);
        assert!(report.noise > 0.0);
        rms(&errors(&truth, &belief))
    };
    let (low, high) = (error(0.05), error(0.2));
    // the half-size image has half the focal length, so a pixel of disparity is twice the depth
    let one_pixel = options(0.05).camera.depth_deviation(0.75);
    assert!(low < 0.3 * one_pixel, "{low} of {one_pixel}");
    assert!(low < high, "{low} {high}");
}

#[test]
fn furniture_before_the_canvas_leaves_a_hole_or_another_view_fills_it() {
    let truth = column();
    // a rod before the middle of the sheet's right half
    let rod = shapes::cuboid(&Vector3::new(0.01, 0.012, 0.012), 0.012).unwrap();
    let rod = rod.transformed(&Pose::translation(-0.5, 0.03, 0.3));
    let (belief, report) = scan_canvas(&truth, &[rod], truth.sheet(), SIZE, &options(0.0), 1).unwrap();
    assert!(rms(&errors(&truth, &belief)) < 2e-4);
    assert!(is_disc(&belief.mesh, &report));
}

#[test]
fn registration_makes_up_for_cameras_out_of_place() {
    let truth = column();
    let off = ScanOptions { calibration: 2e-3, calibration_angle: 0.2f64.to_radians(), ..options(0.05) };
    let spread = |register| {
        let o = ScanOptions { register, ..off.clone() };
        let (_, report) = scan_canvas(&truth, &[], truth.sheet(), SIZE, &o, 3).unwrap();
        report.noise
    };
    assert!(spread(true) < 0.8 * spread(false), "{} {}", spread(true), spread(false));
}

#[test]
fn a_seed_gives_the_same_bits_at_any_number_of_threads() {
    let truth = column();
    let scan = || scan_canvas(&truth, &[], truth.sheet(), SIZE, &options(0.1), 5).unwrap().0.mesh.vertices().to_vec();
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    assert_eq!(pool(1).install(scan), pool(3).install(scan));
}

#[test]
fn a_cloud_of_ones_own_becomes_a_canvas() {
    let truth = column();
    let (_, report) = scan_canvas(&truth, &[], truth.sheet(), SIZE, &options(0.0), 1).unwrap();
    let meshing = options(0.0).meshing;
    let bare = PointCloud { points: report.cloud.points, ..PointCloud::default() };
    let (belief, again) = from_cloud(&bare, "own", truth.sheet(), SIZE, &meshing).unwrap();
    assert_eq!((again.measured, belief.name.as_str()), (bare.points.len(), "own"));
    assert!(rms(&errors(&truth, &belief)) < 1e-4);
}

#[test]
fn options_that_make_no_scan_are_refused() {
    let truth = column();
    let scan = |o: &ScanOptions| scan_canvas(&truth, &[], truth.sheet(), SIZE, o, 1).err().map(|e| e.to_string());
    let blind = ScanOptions { views: Viewpoints::Around { count: 2, distance: 0.3, slant: 0.3 }, ..options(0.0) };
    assert!(scan(&blind).unwrap().contains("550 mm"), "nearer than the least range");
    let place = Viewpoint { eye: Point3::origin(), target: Point3::origin() };
    let nowhere = ScanOptions { views: Viewpoints::At(vec![place]), ..options(0.0) };
    assert!(scan(&nowhere).unwrap().starts_with("camera 0 stands where it looks"));
    let mut broken = options(0.0);
    broken.meshing.triangle = f64::NAN;
    assert!(scan(&broken).unwrap().contains("`triangle` of NaN"));
}
