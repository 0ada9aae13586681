//! The canvas that the robot believes in after a scan.
use std::path::PathBuf;
use std::time::Instant;

use nalgebra::Point2;

use super::RunError;
use super::products::Written;
use super::setup::Setup;
use crate::camera::{ScanError, ScanOptions, find_marks, scan_canvas, sheet_corners};
use crate::measure::BeliefMetrics;
use crate::mesh::{self, PointCloud, TriMesh};
use crate::reconstruct::{Located, Mark, ScanReport, from_cloud, locate_sheet, skirt};
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
                if let Some(pose) = settings.pose.map(ScanPose::pose) {
                    cloud.points.iter_mut().for_each(|p| *p = pose * *p);
                    cloud.normals.iter_mut().for_each(|n| *n = pose * *n);
                }
                let made = from_cloud(&cloud, &nominal.name, &nominal.sheet, size, &settings.meshing());
                (made.map_err(ScanError::from), Ok(vec![]))
            }
            None => {
                let options = settings.scan_options();
                let scanned = scan_canvas(truth, &furniture, &nominal.sheet, size, &options, seed);
                (scanned, marks(settings, truth, nominal, &furniture, size, &options, seed))
            }
        };
        let located = scanned.and_then(|(scanned, report)| {
            let (belief, located) =
                locate_sheet(scanned, nominal, &marks?, &settings.placement()).map_err(ScanError::from)?;
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
