//! The canvas that the robot believes in after a scan.
use std::path::PathBuf;
use std::time::Instant;

use nalgebra::{Point2, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::RunError;
use super::products::Written;
use super::setup::Setup;
use crate::camera::{
    DepthCamera, ScanError, ScanOptions, Viewpoint, Viewpoints, find_marks, scan_canvas, sheet_corners,
};
use crate::math::Pose;
use crate::measure::BeliefMetrics;
use crate::mesh::{self, PointCloud, TriMesh};
use crate::reconstruct::{Located, Mark, MeshingOptions, Placement, ScanReport, from_cloud, locate_sheet, skirt};
use crate::report::OutputDir;
use crate::scenario::{ScanPose, ScanSettings};
use crate::surface::{BelievedCanvas, Canvas};
use crate::truth::TrueCanvas;

/// What a scan left.
pub(super) struct Scan {
    cloud: PointCloud,
    metrics: BeliefMetrics,
    /// What the canvas is thought to be beyond the scan.
    skirt: Option<TriMesh>,
}

impl Scan {
    /// Scans the canvas among the furniture for the drawing, or takes the cloud that the settings name. What the robot knows beforehand
    /// is the nominal canvas: cameras are aimed at its sheet, and the sheet stays there but for what is found out.
    pub fn make(settings: &ScanSettings, setup: &Setup, seed: u64) -> Result<(BelievedCanvas, Self), RunError> {
        let nominal = &setup.scene.canvas;
        let started = Instant::now();
        let truth = setup.truth.canvas();
        let furniture: Vec<TriMesh> = setup.scene.furniture.iter().map(|f| f.mesh.clone()).collect();
        let size = [setup.drawing.width, setup.drawing.height];
        let file = settings.cloud.as_ref().map(PathBuf::from);
        let (scanned, marks) = match &file {
            Some(file) => {
                let mut cloud = mesh::read_cloud(file, settings.scale)?;
                if let Some(pose) = settings.pose {
                    place(&mut cloud, pose);
                }
                let made = from_cloud(&cloud, &nominal.name, &nominal.sheet, size, &meshing(settings));
                (made.map_err(ScanError::from), Ok(vec![]))
            }
            None => {
                let options = options(settings);
                let scanned = scan_canvas(truth, &furniture, &nominal.sheet, size, &options, seed);
                (scanned, marks(settings, truth, nominal, &furniture, size, &options, seed))
            }
        };
        let located = scanned.and_then(|(scanned, report)| {
            let (belief, located) =
                locate_sheet(scanned, nominal, &marks?, &placement(settings)).map_err(ScanError::from)?;
            Ok((belief, located, report))
        });
        let (belief, located, report) = located.map_err(|source| RunError::Scan { cloud: file, source })?;
        let seconds = started.elapsed().as_secs_f64();
        let ScanReport { measured, cloud, noise, .. } = report;
        let Located { shown, marks, .. } = located;
        let metrics = BeliefMetrics {
            measured: Some(measured),
            points: Some(cloud.points.len()),
            noise_mm: Some(noise * 1e3),
            shown_motions: Some(shown),
            marks: settings.marks.then_some(marks),
            duration_s: Some(seconds),
            ..BeliefMetrics::of("scan", truth, &belief, size)
        };
        let skirt = match settings.skirt_mm {
            mm if mm > 0.0 => skirt(&belief.mesh, &belief.sheet, mm * 1e-3).map_err(RunError::Skirt)?,
            _ => None,
        };
        Ok((belief, Self { cloud, metrics, skirt }))
    }

    /// Its figures.
    pub fn metrics(&self) -> BeliefMetrics {
        self.metrics.clone()
    }

    /// What the canvas is thought to be beyond the scan, m, world.
    pub fn skirt(&self) -> Option<&TriMesh> {
        self.skirt.as_ref()
    }

    /// Writes the cloud, and the surface that was made of it.
    pub fn write(&self, belief: &BelievedCanvas, out: &OutputDir, written: &mut Written) -> Result<(), RunError> {
        let content = "The cleaned cloud of the scan, with normals, m, world";
        written.other(out.write("scan.ply", &self.cloud.to_ply())?, content);
        let content = "The canvas as the robot believes it to be, m, world";
        written.other(out.write("belief.ply", &mesh::ply_bytes(&belief.mesh))?, content);
        Ok(())
    }
}

/// Moves a cloud into the world.
fn place(cloud: &mut PointCloud, pose: ScanPose) {
    let [roll, pitch, yaw] = pose.rpy_deg.map(f64::to_radians);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_euler_angles(roll, pitch, yaw));
    let pose = Pose::from_parts(Translation3::from(Vector3::from(pose.xyz_mm) * 1e-3), rotation);
    cloud.points.iter_mut().for_each(|p| *p = pose * *p);
    cloud.normals.iter_mut().for_each(|n| *n = pose * *n);
}

/// The marks that cameras find; none where none are printed.
fn marks(
    settings: &ScanSettings,
    truth: &TrueCanvas,
    nominal: &Canvas,
    furniture: &[TriMesh],
    size: [f64; 2],
    options: &ScanOptions,
    seed: u64,
) -> Result<Vec<Mark>, ScanError> {
    if !settings.marks {
        return Ok(vec![]);
    }
    let stated = settings.marks_at_mm.iter().map(|mm| Point2::from(mm.map(|x| x * 1e-3)));
    let places = if settings.marks_at_mm.is_empty() { sheet_corners(size) } else { stated.collect() };
    find_marks(truth, furniture, &nominal.sheet, &places, settings.marks_noise_mm * 1e-3, options, seed)
}

/// How well the canvas's place is known beforehand, and marks are measured.
fn placement(s: &ScanSettings) -> Placement {
    Placement { shift: s.placement_mm * 1e-3, turn: s.placement_deg.to_radians(), mark_noise: s.marks_noise_mm * 1e-3 }
}

fn meshing(s: &ScanSettings) -> MeshingOptions {
    MeshingOptions {
        margin: s.margin_mm * 1e-3,
        voxel: s.voxel_mm * 1e-3,
        outlier_deviations: s.outlier_deviations,
        triangle: s.triangle_mm * 1e-3,
        radius: s.smooth_mm.map(|mm| mm * 1e-3),
        hole: s.hole_mm * 1e-3,
    }
}

/// Settings of the scan: SI units.
fn options(s: &ScanSettings) -> ScanOptions {
    let point = |mm: [f64; 3]| Point3::from(mm.map(|x| x * 1e-3));
    let views = if s.cameras.is_empty() {
        Viewpoints::Around { count: s.views as usize, distance: s.distance_mm * 1e-3, slant: s.slant_deg.to_radians() }
    } else {
        let view = |c: &crate::scenario::ScanCamera| Viewpoint { eye: point(c.eye_mm), target: point(c.target_mm) };
        Viewpoints::At(s.cameras.iter().map(view).collect())
    };
    ScanOptions {
        camera: DepthCamera {
            size_px: s.image_px.map(|px| px as usize),
            field_of_view: s.field_of_view_deg.map(f64::to_radians),
            baseline: s.baseline_mm * 1e-3,
            range: s.range_mm.map(|mm| mm * 1e-3),
            noise_px: s.noise_px,
            window_px: s.window_px as usize,
            disparity_step_px: s.disparity_step_px,
            dropout: s.dropout,
            mismatches: s.mismatches,
            grazing: s.grazing_deg.to_radians(),
        },
        views,
        calibration: s.calibration_mm * 1e-3,
        calibration_angle: s.calibration_deg.to_radians(),
        register: s.register,
        meshing: meshing(s),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::drawing::Drawing;
    use crate::scenario::Scenario;

    /// How far (mm) the believed sheet's centre is from the true one and from the nominal one, on a scanned table.
    fn off(sets: &[&str]) -> [f64; 2] {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/grid_plane.toml");
        let sets = ["canvas.belief=\"scan\"", "scan.noise_px=0.05"].iter().chain(sets).map(|s| s.parse().unwrap());
        let scenario = Scenario::read(&file, &sets.collect::<Vec<_>>()).unwrap();
        let setup = Setup::load(&scenario, Drawing::new(0.15, 0.15, vec![]), vec![]).unwrap();
        let (belief, _) = Scan::make(scenario.scan.as_ref().unwrap(), &setup, scenario.seed).unwrap();
        let centre = |c: &Canvas| c.sheet.world_from_sheet.translation.vector;
        [setup.truth.canvas().reveal(), &setup.scene.canvas].map(|c| (centre(&belief) - centre(c)).norm() * 1e3)
    }

    #[test]
    fn a_table_that_slid_in_its_plane_is_believed_where_it_should_be() {
        let [truth, nominal] = off(&["truth.offset_mm=[10, 0, 0]"]);
        assert!((truth - 10.0).abs() < 0.5 && nominal < 0.5, "{truth} mm, {nominal} mm");
        let [truth, _] = off(&["truth.offset_mm=[10, 0, 0]", "scan.marks=true"]);
        assert!(truth < 0.5, "{truth} mm");
    }
}
