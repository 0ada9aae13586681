//! Patches of good and bad meshes, and their flat maps.
use nalgebra::{Point2, Point3, Vector3};
use proptest::prelude::*;

use super::shapes::{self, Bumps};
use super::{Chart, Distortion, Extent, Flattening, MeshError, Patch, PatchError, TriMesh};
use crate::math::{Pose, frame_from_axes};

const METHODS: [Flattening; 2] = [Flattening::BoundaryFirst, Flattening::LeastSquares];
const HALF: [f64; 2] = [0.1, 0.1];

/// A sheet over the origin that looks down at it.
fn above() -> Pose {
    Pose::translation(0.0, 0.0, 0.5)
}

/// A sheet in front of a column about the z axis, upright.
fn beside() -> Pose {
    let turn = frame_from_axes(&Vector3::x(), &Vector3::y());
    Pose::from_parts(nalgebra::Translation3::new(0.5, 0.0, 0.2), turn)
}

fn square() -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let mesh = shapes::rectangle(0.3, 0.3, 0.0, 0.02).unwrap();
    (mesh.vertices().to_vec(), mesh.triangles().to_vec())
}

fn cut(mesh: &TriMesh) -> Result<Patch, PatchError> {
    Patch::cut(mesh, &above(), Extent::Prism([0.12, 0.12]), 0.01)
}

fn chart(patch: Patch, method: Flattening, up: Vector3<f64>) -> Chart {
    Chart::new(patch, method, &Point2::origin(), HALF, &up, 0.01).unwrap()
}

/// Whether the chart of a flat square patch is the square itself.
fn is_itself(patch: Patch) -> bool {
    METHODS.iter().all(|method| {
        let chart = chart(patch.clone(), *method, Vector3::y());
        chart.patch.vertices.iter().zip(&chart.flat).all(|(p, q)| (p.xy() - q).norm() < 1e-9)
    })
}

#[test]
fn a_plane_is_mapped_to_itself() {
    let (v, t) = square();
    let patch = cut(&TriMesh::new(v, t).unwrap()).unwrap();
    assert!(patch.repairs.sentences().is_empty(), "{:?}", patch.repairs);
    assert!((patch.mesh.area() - 0.24 * 0.24).abs() < 1e-9);
    assert!(is_itself(patch));
}

#[test]
fn a_box_is_flattened_on_its_face_alone() {
    let mesh = shapes::cuboid(&Vector3::new(0.2, 0.2, 0.2), 0.02).unwrap();
    let patch = cut(&mesh).unwrap();
    assert!((patch.mesh.area() - 0.04).abs() < 1e-9, "{}", patch.mesh.area());
    assert!(is_itself(patch));
}

#[test]
fn a_round_column_rolls_off_without_distortion() {
    let radius = 0.15;
    let mesh = shapes::cylinder(radius, 0.4, 0.004).unwrap();
    let patch = Patch::cut(&mesh, &beside(), Extent::Prism([0.12, 0.12]), 0.01).unwrap();
    for method in METHODS {
        let chart = chart(patch.clone(), method, Vector3::z());
        let d = Distortion::of(&chart.stretches()).unwrap();
        assert!(d.flips == 0 && d.angle_error_mean < 0.05, "{d:?}");
        for (x, y) in [(0.0, 0.0), (0.09, 0.03), (-0.05, -0.08)] {
            let hit = chart.to_surface(&Point2::new(x, y)).unwrap();
            let theta: f64 = x / radius;
            let there = Point3::new(radius * theta.cos(), radius * theta.sin(), 0.2 + y);
            assert!((hit.position - there).norm() < 3e-4, "{method:?} {x} {y}: {} {there}", hit.position);
            assert!((hit.normal - Vector3::new(theta.cos(), theta.sin(), 0.0)).norm() < 5e-3);
        }
    }
}

#[test]
fn angles_are_kept_on_bumps_and_boundary_first_keeps_areas_better() {
    let bumps = Bumps { amplitude: 0.02, wavelength: 0.1 };
    let mesh = shapes::column(0.28, 0.4, &bumps, 0.006).unwrap();
    let patch = Patch::cut(&mesh, &beside(), Extent::Prism([0.15, 0.15]), 0.1).unwrap();
    let figures = METHODS.map(|m| Distortion::of(&chart(patch.clone(), m, Vector3::z()).stretches()).unwrap());
    for d in figures {
        assert!(d.flips == 0 && d.quasi_conformal_mean < 1.03, "{d:?}");
    }
    assert!(figures[0].log_area_rms < figures[1].log_area_rms, "{figures:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn chart_and_surface_are_inverse_wherever_the_scene_is(
        pose in prop::array::uniform6(-2.0..2.0f64), x in -0.09..0.09f64, y in -0.09..0.09f64,
    ) {
        let mesh = shapes::dome(0.2, 0.015).unwrap();
        let [a, b, c, d, e, f] = pose;
        let moved = Pose::new(Vector3::new(a, b, c), Vector3::new(d, e, f));
        let patch = Patch::cut(&mesh.transformed(&moved), &(moved * above()), Extent::Prism([0.14, 0.14]), 0.01).unwrap();
        let chart = chart(patch, Flattening::BoundaryFirst, moved * Vector3::y());
        let there = chart.to_surface(&Point2::new(x, y)).unwrap();
        let back = chart.to_flat(&there.position, 0.05).unwrap();
        prop_assert!((back - Point2::new(x, y)).norm() < 1e-9);
        // the same place whichever way the scene is turned
        let still = Patch::cut(&mesh, &above(), Extent::Prism([0.14, 0.14]), 0.01).unwrap();
        let still = Chart::new(still, Flattening::BoundaryFirst, &Point2::origin(), HALF, &Vector3::y(), 0.01).unwrap();
        let expected = moved * still.to_surface(&Point2::new(x, y)).unwrap().position;
        prop_assert!((there.position - expected).norm() < 1e-6, "{} {}", there.position, expected);
    }
}

#[test]
fn flipped_and_double_triangles_are_mended() {
    let (v, mut t) = square();
    let doubled = t[7];
    for k in (3..t.len()).step_by(5) {
        t[k].swap(0, 1);
    }
    t.push(doubled);
    t.push([doubled[0], doubled[0], doubled[1]]);
    let patch = cut(&TriMesh::new(v, t).unwrap()).unwrap();
    assert!(patch.repairs.flipped_triangles > 20, "{:?}", patch.repairs);
    assert!(is_itself(patch));
}

#[test]
fn a_fin_on_the_surface_is_parted_from_it() {
    let (mut v, mut t) = square();
    let apex = v.len() as u32;
    // a triangle that stands upright on an inner edge: three triangles meet there
    let [a, b, _] = t[t.len() / 2];
    v.push(nalgebra::center(&v[a as usize], &v[b as usize]) + Vector3::new(0.0, 0.0, 0.004));
    t.push([a, b, apex]);
    let patch = cut(&TriMesh::new(v, t).unwrap()).unwrap();
    assert!((patch.mesh.area() - 0.24 * 0.24).abs() < 1e-9);
    assert!(is_itself(patch));
}

#[test]
fn loose_parts_are_left_out_and_said() {
    let (mut v, mut t) = square();
    let n = v.len() as u32;
    v.extend([Point3::new(0.05, 0.05, -0.02), Point3::new(0.06, 0.05, -0.02), Point3::new(0.05, 0.06, -0.02)]);
    t.push([n, n + 1, n + 2]);
    let patch = cut(&TriMesh::new(v, t).unwrap()).unwrap();
    assert_eq!(patch.repairs.parts, 1);
    assert_eq!(patch.repairs.sentences(), ["1 loose part of 1 triangles left out"]);
    assert!(is_itself(patch));
}

#[test]
fn small_holes_are_bridged_and_large_ones_stay_open() {
    let (v, t) = square();
    let without = |at: Point2<f64>, radius: f64| {
        let far = |t: &&[u32; 3]| t.iter().all(|i| (v[*i as usize].xy() - at).norm() > radius);
        let kept: Vec<[u32; 3]> = t.iter().filter(far).copied().collect();
        assert!(kept.len() < t.len());
        TriMesh::new(v.clone(), kept).unwrap()
    };
    let at = Point2::new(0.05, 0.03);
    let mesh = without(at, 0.012);
    for (bridge, crossed) in [(0.1, true), (0.01, false)] {
        let patch = Patch::cut(&mesh, &above(), Extent::Prism([0.12, 0.12]), bridge).unwrap();
        let holes = if crossed { &patch.repairs.bridged_holes } else { &patch.repairs.open_holes };
        assert!(holes.len() == 1 && (0.02..0.1).contains(&holes[0]), "{:?}", patch.repairs);
        let chart = chart(patch, Flattening::BoundaryFirst, Vector3::y());
        assert_eq!(chart.to_surface(&at).is_some(), crossed);
        assert!(chart.to_surface(&Point2::new(-0.05, 0.03)).is_some());
    }
}

#[test]
fn whole_surfaces_are_cut_open_away_from_the_drawing() {
    for mesh in [
        shapes::cylinder(0.1, 0.3, 0.02).unwrap().transformed(&Pose::translation(0.0, 0.0, -0.15)),
        shapes::sphere(0.1, 0.02).unwrap(),
    ] {
        let patch = Patch::cut(&mesh, &above(), Extent::Whole, 0.01).unwrap();
        assert!(patch.repairs.seam > 0.05, "{:?}", patch.repairs);
        assert!((patch.mesh.area() - mesh.area()).abs() < 1e-9);
        let far = |i: &u32| (patch.vertices[*i as usize] - patch.anchor.position).norm() > 0.1;
        assert!(patch.boundary.iter().all(far));
    }
    // a tube open at both ends
    let mesh = shapes::cylinder(0.1, 0.3, 0.02).unwrap();
    let wall: Vec<_> =
        mesh.triangles().iter().zip(mesh.face_normals()).filter(|(_, n)| n.z.abs() < 0.5).map(|(t, _)| *t).collect();
    let tube = TriMesh::new(mesh.vertices().to_vec(), wall).unwrap();
    let patch = Patch::cut(&tube, &beside(), Extent::Whole, 0.01).unwrap();
    assert!((0.28..0.45).contains(&patch.repairs.seam), "{:?}", patch.repairs);
    let d = Distortion::of(&chart(patch, Flattening::BoundaryFirst, Vector3::z()).stretches()).unwrap();
    assert!(d.flips == 0 && d.quasi_conformal_mean < 1.05, "{d:?}");
}

#[test]
fn what_is_no_surface_is_refused() {
    let nan = vec![Point3::new(f64::NAN, 0.0, 0.0), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
    assert!(matches!(TriMesh::new(nan, vec![[0, 1, 2]]), Err(MeshError::NotFinite { .. })));
    let speck = vec![Point3::new(-1e-7, -1e-7, 0.0), Point3::new(1e-7, -1e-7, 0.0), Point3::new(0.0, 1e-7, 0.0)];
    let speck = TriMesh::new(speck, vec![[0, 1, 2]]).unwrap();
    assert_eq!(cut(&speck).err(), Some(PatchError::Speck { triangles: 1 }));
    let (v, t) = square();
    let aside = TriMesh::new(v, t).unwrap().transformed(&Pose::translation(1.0, 0.0, 0.0));
    assert_eq!(cut(&aside).err(), Some(PatchError::NoSurface));
}
