//! A depth camera's cloud becomes a canvas.
use calamus::math::Pose;
use calamus::mesh::PointCloud;
use calamus::reconstruct::{Cloud, MeshingOptions, from_cloud};
use calamus::surface::SheetFrame;
use divan::Bencher;
use nalgebra::{Point3, Vector3};

fn main() {
    divan::main();
}

/// 172 k points, 1.2 mm apart, on a wavy patch of 0.5 m a side, with a roughness of 0.7 mm.
fn points() -> Vec<Point3<f64>> {
    let n = 415;
    (0..n * n)
        .map(|k| {
            let (x, y) = (f64::from(k % n) * 0.0012 - 0.25, f64::from(k / n) * 0.0012 - 0.25);
            let rough = (f64::from(k) * 12.9898).sin() * 43_758.545_3;
            Point3::new(x, y, 0.006 * (45.0 * x).sin() * (40.0 * y).cos() + 1e-3 * (rough - rough.floor() - 0.5) * 2.4)
        })
        .collect()
}

fn cloud() -> Cloud {
    let points = points();
    Cloud { toward_eye: vec![Vector3::z(); points.len()], weight: vec![1.0; points.len()], points }
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn downsample(bencher: Bencher) {
    let cloud = cloud();
    bencher.bench_local(|| cloud.downsampled(0.002));
}

#[divan::bench(sample_count = 3, sample_size = 1)]
fn outliers(bencher: Bencher) {
    let cloud = cloud();
    bencher.bench_local(|| cloud.without_outliers(3.0));
}

/// All the way: crop, outliers, downsampling, normals, reconstruction.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn cloud_to_mesh(bencher: Bencher) {
    let cloud = PointCloud { points: points(), ..PointCloud::default() };
    let sheet = SheetFrame { world_from_sheet: Pose::translation(0.0, 0.0, 0.1) };
    let options = MeshingOptions { margin: 0.05, ..MeshingOptions::default() };
    bencher.bench_local(|| from_cloud(&cloud, "wave", &sheet, [0.4, 0.4], &options).expect("is a surface"));
}
