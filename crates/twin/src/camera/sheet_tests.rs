//! Where the sheet is believed to lie after scans of canvases that stand elsewhere.
use nalgebra::Vector3;

use crate::camera::{DepthCamera, ScanOptions, find_marks, scan_canvas, sheet_corners};
use crate::math::Pose;
use crate::math::{frame_from_axes, rotation_vector};
use crate::mesh::shapes::{self, Bumps};
use crate::reconstruct::{Located, MeshingOptions, Placement, locate_sheet};
use crate::surface::{Canvas, SheetFrame};
use crate::truth::{TrueCanvas, TruthOptions, perturb};

const SIZE: [f64; 2] = [0.12, 0.12];

/// A board that faces up, its sheet 40 mm over it.
fn board() -> Canvas {
    let mesh = shapes::rectangle(0.32, 0.42, 0.01, 0.02).unwrap();
    let sheet = SheetFrame { world_from_sheet: Pose::translation(0.01, 0.02, 0.04) };
    Canvas { name: "board".into(), mesh, sheet }
}

fn dome() -> Canvas {
    let mesh = shapes::dome(0.15, 0.005).unwrap();
    Canvas { name: "dome".into(), mesh, sheet: SheetFrame { world_from_sheet: Pose::translation(0.0, 0.0, 0.2) } }
}

/// A column before a sheet that hangs 50 mm off it.
fn column(amplitude: f64) -> Canvas {
    let mesh = shapes::column(0.28, 0.6, &Bumps { amplitude, wavelength: 0.14 }, 0.007).unwrap();
    let outward = -Vector3::x();
    let rotation = frame_from_axes(&outward, &Vector3::z().cross(&outward));
    let place = nalgebra::Translation3::new(-0.33, 0.0, 0.3);
    Canvas { name: "column".into(), mesh, sheet: SheetFrame { world_from_sheet: Pose::from_parts(place, rotation) } }
}

/// A small and quick scan by cameras that are where they should be.
fn options() -> ScanOptions {
    let camera = DepthCamera { size_px: [314, 234], noise_px: 0.05, ..DepthCamera::default() };
    let meshing = MeshingOptions { triangle: 0.006, ..MeshingOptions::default() };
    ScanOptions { camera, meshing, calibration: 0.0, calibration_angle: 0.0, ..ScanOptions::default() }
}

/// The nominal, the true and the believed sheet.
struct Sheets {
    nominal: Pose,
    truth: Pose,
    belief: Pose,
    located: Located,
}

impl Sheets {
    /// From the nominal and from the true sheet's centre, m.
    fn off(&self) -> [f64; 2] {
        [self.nominal, self.truth].map(|p| (self.belief.translation.vector - p.translation.vector).norm())
    }
    /// From the true sheet's directions, rad.
    fn turned(&self) -> f64 {
        rotation_vector(&(self.belief.rotation * self.truth.rotation.inverse())).norm()
    }
}

fn scanned(nominal: &Canvas, truth: &TruthOptions, marks: bool, placement: &Placement) -> Sheets {
    let (truth, _) = perturb(nominal, truth, 3).unwrap();
    scanned_truth(nominal, &truth, marks, placement)
}

fn scanned_truth(nominal: &Canvas, truth: &TrueCanvas, marks: bool, placement: &Placement) -> Sheets {
    let (belief, _) = scan_canvas(truth, &[], &nominal.sheet, SIZE, &options(), 2).unwrap();
    let places = if marks { sheet_corners(SIZE) } else { vec![] };
    let noise = placement.mark_noise;
    let marks = find_marks(truth, &[], &nominal.sheet, &places, noise, &options(), 2).unwrap();
    let (belief, located) = locate_sheet(belief, nominal, &marks, placement).unwrap();
    let pose = |c: &Canvas| c.sheet.world_from_sheet;
    Sheets { nominal: pose(nominal), truth: pose(truth.reveal()), belief: pose(&belief), located }
}

fn shifted(x: f64, y: f64, z: f64) -> TruthOptions {
    TruthOptions { offset: [x, y, z], ..Default::default() }
}

#[test]
fn a_plane_that_slides_on_itself_isnt_noticed_without_marks() {
    let sheets = scanned(&board(), &shifted(0.01, 0.0, 0.0), false, &Placement::default());
    let [nominal, truth] = sheets.off();
    assert!(nominal < 3e-4 && (truth - 0.01).abs() < 3e-4, "{nominal} m, {truth} m");
    assert_eq!(sheets.located.shown, 3);
    let sheets = scanned(&board(), &shifted(0.01, 0.0, 0.0), true, &Placement::default());
    let [_, truth] = sheets.off();
    assert!(truth < 5e-4, "{truth} m");
    assert_eq!(sheets.located.marks, 4);
}

#[test]
fn a_plane_that_is_higher_or_tilted_is_found_by_its_shape() {
    let higher = scanned(&board(), &shifted(0.0, 0.0, 0.005), false, &Placement::default());
    assert!(higher.off()[1] < 3e-4, "{} m", higher.off()[1]);
    let tilt = TruthOptions { turn: [0.012, 0.0125, 0.0], ..Default::default() };
    let tilted = scanned(&board(), &tilt, false, &Placement::default());
    // 1 degree is 17 mrad
    assert!(tilted.turned() < 1.5e-3, "{} rad", tilted.turned());
    assert!(tilted.off()[1] < 5e-4, "{} m", tilted.off()[1]);
}

#[test]
fn bumps_and_domes_are_found_by_their_shape() {
    // both stand 5 mm off; bumps show less of it than a dome does
    let bumps = (column(0.006), shifted(0.0, 0.004, 0.003), 8e-4);
    let dome = (dome(), shifted(0.004, 0.003, 0.0), 3e-4);
    for (nominal, by, desired) in [bumps, dome] {
        let sheets = scanned(&nominal, &by, false, &Placement::default());
        assert!(sheets.off()[1] < desired, "{}: {} m", nominal.name, sheets.off()[1]);
    }
}

#[test]
fn a_smooth_column_tells_neither_its_height_nor_its_turn() {
    let by = TruthOptions { turn: [0.0, 0.0, 0.03], ..shifted(0.003, 0.0, 0.008) };
    let sheets = scanned(&column(0.0), &by, false, &Placement::default());
    assert_eq!(sheets.located.shown, 4);
    let believed = sheets.belief.translation.vector - sheets.nominal.translation.vector;
    // its axis is found, and nothing else: the turn would lead 10 mm aside, the height 8 mm up
    assert!((believed - Vector3::new(0.003, 0.0, 0.0)).norm() < 6e-4, "{believed}");
}

#[test]
fn relief_of_the_truth_shows_no_more_motions() {
    let relief = TruthOptions { relief: 0.02, ..shifted(0.01, 0.0, 0.0) };
    let sheets = scanned(&board(), &relief, false, &Placement::default());
    assert_eq!(sheets.located.shown, 3);
    let across = sheets.belief.translation.vector - sheets.nominal.translation.vector;
    assert!(across.xy().norm() < 1e-3, "{across}");
    let sheets = scanned(&board(), &relief, true, &Placement::default());
    let across = sheets.belief.translation.vector - sheets.truth.translation.vector;
    assert!(across.xy().norm() < 2e-3, "{across}");
}

#[test]
fn marks_lead_to_a_canvas_that_is_far_off() {
    let by = TruthOptions { turn: [0.0, 0.0, 0.5], ..shifted(-0.02, 0.01, 0.02) };
    let sheets = scanned(&board(), &by, true, &Placement::default());
    assert!(sheets.off()[1] < 5e-4, "{} m", sheets.off()[1]);
    assert!(sheets.turned() < 5e-3, "{} rad", sheets.turned());
}

#[test]
fn a_place_that_is_known_stays() {
    let known = Placement { shift: 0.0, turn: 0.0, ..Placement::default() };
    let sheets = scanned(&dome(), &shifted(0.0, 0.0, 0.005), false, &known);
    assert_eq!(sheets.belief, sheets.nominal);
    assert_eq!(sheets.located.shown, 0);
}
