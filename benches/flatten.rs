//! How fast a canvas is flattened, by its vertices, and a drawing laid on it.
use calamus::math::{Pose, frame_from_axes};
use calamus::mesh::shapes::{self, Bumps};
use calamus::mesh::{Chart, Extent, Flattening, Patch, TriMesh};
use divan::Bencher;
use divan::counter::ItemsCount;
use nalgebra::{Point2, Translation3, Vector3};

fn main() {
    divan::main();
}

/// About how many vertices the patch has, and the size of triangles (m) that gives them.
const SIZES: [(usize, f64); 3] = [(10_000, 6.1e-3), (100_000, 1.91e-3), (172_000, 1.456e-3)];
const METHODS: [Flattening; 2] = [Flattening::LeastSquares, Flattening::BoundaryFirst];
const HALF: [f64; 2] = [0.15, 0.15];

fn column(triangle_size: f64) -> (TriMesh, Pose) {
    let bumps = Bumps { amplitude: 0.006, wavelength: 0.14 };
    let mesh = shapes::column(0.28, 0.8, &bumps, triangle_size).expect("there is such a column");
    let turn = frame_from_axes(&-Vector3::x(), &-Vector3::y());
    (mesh, Pose::from_parts(Translation3::new(-0.33, 0.0, 0.4), turn))
}

fn patch(triangle_size: f64) -> Patch {
    let (mesh, sheet) = column(triangle_size);
    Patch::cut(&mesh, &sheet, Extent::Prism([0.25, 0.25]), 0.01).expect("the column can be cut")
}

fn chart(patch: Patch, method: Flattening) -> Chart {
    Chart::new(patch, method, &Point2::origin(), HALF, &Vector3::z(), 0.01).expect("the column can be flattened")
}

/// Cutting the patch out of the whole mesh, and mending it; items are triangles of the whole.
#[divan::bench(args = SIZES, sample_count = 3, sample_size = 1)]
fn cut(bencher: Bencher, (_, size): (usize, f64)) {
    let (mesh, sheet) = column(size);
    let cut = || Patch::cut(&mesh, &sheet, Extent::Prism([0.25, 0.25]), 0.01).expect("the column can be cut");
    bencher.counter(ItemsCount::new(mesh.triangles().len())).bench_local(cut);
}

/// Flattening a patch and laying the chart; items are vertices.
#[divan::bench(args = SIZES, consts = [0, 1], sample_count = 3, sample_size = 1)]
fn flatten<const METHOD: usize>(bencher: Bencher, (_, size): (usize, f64)) {
    let patch = patch(size);
    let count = ItemsCount::new(patch.vertices.len());
    bencher.counter(count).with_inputs(|| patch.clone()).bench_local_values(|patch| chart(patch, METHODS[METHOD]));
}

/// Laying 7,000 points on the largest chart.
#[divan::bench(sample_count = 10, sample_size = 1)]
fn points(bencher: Bencher) {
    const POINTS: usize = 7000;
    let chart = chart(patch(SIZES[2].1), Flattening::BoundaryFirst);
    let at = |i: usize, step: usize| 2.0 * HALF[0] * ((i * step % POINTS) as f64 / POINTS as f64 - 0.5);
    let lay = || (0..POINTS).filter_map(|i| chart.to_surface(&Point2::new(at(i, 37), at(i, 613)))).count();
    assert_eq!(lay(), POINTS);
    bencher.counter(ItemsCount::new(POINTS)).bench_local(lay);
}
