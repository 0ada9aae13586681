//! A base that drives: where it stands for the drawing, and who draws from place to place.
use std::collections::BTreeSet;
use std::sync::Arc;

use super::belief::Believed;
use super::products::Written;
use super::setup::Setup;
use super::{RunError, looking};
use crate::cover::{self, Found};
use crate::drawing::{Drawing, StrokeId, StrokeRef};
use crate::measure::{BaseMetrics, Metrics, Seam, SeamMetrics, seams};
use crate::pen::LayerPen;
use crate::plan::PlanOptions;
use crate::plan::cover::{BasePose as Stand, Coverage};
use crate::progress::Progress;
use crate::report::{OutputDir, seam_picture};
use crate::robot::{BasePose, Cell};
use crate::scenario::{Scenario, options};
use crate::skill::{DriveJob, DrivenPlace, DrivenStrokes};
use crate::surface::SurfaceDrawing;
use crate::twin::{ArmSetup, BaseSetup, Localiser, Record, Simulation, TrueScene};

/// Seams that are shown, and the side of their pictures, m.
const SHOWN_SEAMS: usize = 3;
const SEAM_SIDE: f64 = 0.03;

/// Where a base stands for a drawing, and what it draws from where.
pub(super) struct Driving {
    pub found: Found,
    /// The strokes of the cut drawing that are drawn from each place.
    pub strokes: Vec<Vec<StrokeRef>>,
}

impl Driving {
    /// How the two ends of each cut line met.
    pub(super) fn seams(&self, record: &Record) -> Vec<Seam> {
        let id = |r: StrokeRef| StrokeId { layer: r.layer as u32, index: r.stroke as u32 };
        let cuts: Vec<[StrokeId; 2]> = self.found.coverage.ends().into_iter().map(|ends| ends.map(id)).collect();
        seams(&record.ink, &cuts)
    }

    /// Pictures of the worst seams, close up.
    pub(super) fn pictures(&self, record: &Record, out: &OutputDir, written: &mut Written) -> Result<(), RunError> {
        let mut seams = self.seams(record);
        seams.sort_by(|a, b| (b.step + b.ahead.abs()).total_cmp(&(a.step + a.ahead.abs())));
        for (i, seam) in seams.iter().take(SHOWN_SEAMS).enumerate() {
            let png = seam_picture(&record.ink, &seam.sheet, SEAM_SIDE)?.to_png(None)?;
            let caption = format!(
                "Cut {} close up, {:.0} mm wide: its ends are {:.2} mm apart across the line, {:.2} mm along it",
                seam.cut,
                SEAM_SIDE * 1e3,
                seam.step * 1e3,
                seam.ahead * 1e3
            );
            written.picture(out.write(&format!("seam-{}.png", i + 1), &png)?, &caption);
        }
        Ok(())
    }

    /// Figures of the base and of the seams.
    pub(super) fn measure(&self, setup: &Setup, record: &Record, metrics: &mut Metrics) {
        let base = setup.cell.arms.iter().zip(&record.arms).find_map(|(arm, r)| Some((arm.base.as_ref()?, r)));
        metrics.base = base.and_then(|(base, r)| BaseMetrics::of(r, &base.base_from_arm));
        metrics.seam = SeamMetrics::of(&self.seams(record), self.found.coverage.cuts.len());
    }
}

/// Finds places for a base that drives, and cuts the drawing into what is drawn from each; `None` for a robot that stands.
pub(super) fn drive(
    scenario: &Scenario,
    drawing: &mut Drawing,
    pens: &[LayerPen],
    progress: &dyn Progress,
) -> Result<Option<Driving>, RunError> {
    let cell = Cell::load_changed(&scenario.robot, &scenario.change.robot)?;
    let Some(arm) = cell.arms.iter().find(|a| a.base.is_some()) else {
        let asked = [
            (scenario.coverage.is_some(), "`[coverage]`"),
            (scenario.drive.is_some(), "`[drive]`"),
            (scenario.localisation.is_some(), "`[localisation]`"),
            (scenario.looking.is_some(), "`[looking]`"),
        ];
        return match asked.into_iter().find(|(is, _)| *is) {
            Some((_, what)) => Err(RunError::NoBase { what, robot: cell.name }),
            None => Ok(None),
        };
    };
    let apart = [
        (scenario.touch.is_some(), "`belief = \"touch\"`"),
        (scenario.scan.is_some(), "`belief = \"scan\"`"),
        (scenario.canvas.overlay.is_some(), "`[canvas.overlay]`"),
        (scenario.tools.is_some(), "`[tools]`"),
    ];
    if let Some((_, what)) = apart.iter().find(|(is, _)| *is) {
        return Err(RunError::NotWhileDriving { what });
    }
    progress.stage("places to stand", None);
    let found = cover::find(scenario, arm, drawing, pens, &mut |probe, grid| probe.map(grid, &|_| ()), progress)?;
    let (cut, strokes) = found.coverage.cut(drawing);
    *drawing = cut;
    Ok(Some(Driving { found, strokes }))
}

/// Who draws from place to place.
pub(super) fn driver(
    scenario: &Scenario,
    setup: &Setup,
    believed: &Believed,
    driving: &Driving,
    plan: &Arc<PlanOptions>,
) -> Result<DrivenStrokes, RunError> {
    let arm = &setup.cell.arms[0];
    let base = arm.base.clone().ok_or_else(|| RunError::NoBase { what: "a base", robot: setup.cell.name.clone() })?;
    let mapped = believed.mapped.as_ref().map(|m| &m.strokes).ok_or(RunError::WhileDrawing)?;
    let settings = scenario.drive.clone().unwrap_or_default();
    let places = driving
        .strokes
        .iter()
        .enumerate()
        .map(|(k, strokes)| DrivenPlace { way: way(&driving.found.coverage, k), drawing: part(mapped, strokes) });
    Ok(DrivenStrokes::new(DriveJob {
        arm_index: 0,
        arm: arm.model.clone(),
        home: arm.home,
        base,
        places: places.collect(),
        canvas: Arc::clone(&believed.canvas),
        obstacles: Arc::new(setup.obstacles()?),
        options: Arc::clone(plan),
        drive: settings.options(),
        tolerance: settings.arrival_mm * 1e-3,
        sag_known: settings.sag_known,
        hand: options::hand_stiffness(scenario),
        look: looking::options(scenario, setup, believed)?,
    }))
}

/// The stops on the way to a place.
fn way(coverage: &Coverage, place: usize) -> Vec<BasePose> {
    let way = match place {
        0 => &coverage.way_in,
        k => &coverage.drives[k - 1],
    };
    let stop = |p: &Stand| BasePose { x: p.x, y: p.y, yaw: p.heading };
    // a way begins where the base stands
    way.iter().skip(1).chain(way.is_empty().then(|| &coverage.places[place].pose)).map(stop).collect()
}

/// These strokes of a drawing.
fn part(mapped: &SurfaceDrawing, strokes: &[StrokeRef]) -> SurfaceDrawing {
    let own: BTreeSet<(usize, usize)> = strokes.iter().map(|r| (r.layer, r.stroke)).collect();
    let mut part = SurfaceDrawing { order: Vec::new(), ..mapped.clone() };
    for (layer, l) in part.layers.iter_mut().enumerate() {
        l.strokes.retain(|s| own.contains(&(layer, s.index)));
    }
    part
}

/// The arm on its base, folded, where the robot starts, with all its sensors.
pub(super) fn on_base(
    scenario: &Scenario,
    all: &Setup,
    setup: ArmSetup,
    scene: Arc<TrueScene>,
) -> Result<Simulation, RunError> {
    let arm = &all.cell.arms[setup.index];
    let sheet = all.scene.canvas.sheet.world_from_sheet.translation;
    // what is drawn on has a mark of its own, from which the sensor measures
    let middle = [sheet.x, sheet.y];
    let Some(base) = &arm.base else { return Err(RunError::NoBase { what: "a base", robot: arm.model.name.clone() }) };
    let localisation = scenario.localisation.clone().unwrap_or_default().options();
    let mobile = BaseSetup {
        base: base.clone(),
        believed: base.clone(),
        pose: base.start,
        believed_pose: base.start,
        localiser: Some(Localiser::new(localisation, middle, scenario.seed, setup.index as u64)),
    };
    let start = ArmSetup { start: base.transport, ..setup };
    let twin = options::twin_options(scenario);
    let mut simulation = Simulation::on_base(start, mobile, Arc::clone(&scene), options::law(scenario), &twin)?;
    looking::equip(&mut simulation, scenario, all, &scene);
    Ok(simulation)
}
