//! What is made before anything moves: the drawing, what the robot believes of the canvas, and the plan on it.
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Instant;

use super::driving::{Driving, drive};
use super::planning::{Planning, plan_all};
use super::scan::Scan;
use super::setup::Setup;
use super::{RunError, Until};
use crate::artwork::{self, Made, Part};
use crate::canvas::{mapped, mapping_onto, overlaid, own_layers};
use crate::drawing::Drawing;
use crate::exec::Journal;
use crate::math::Digest;
use crate::measure::{BeliefMetrics, DrawingMetrics, Laid, MappingMetrics, Metrics};
use crate::mesh::TriMesh;
use crate::pen::LayerPen;
use crate::progress::Progress;
use crate::scenario::{
    Artwork, BeliefKind, RenderSettings, Scenario, ScenarioError, SimSettings, Sketch, TruthSettings,
};
use crate::surface::{BelievedCanvas, StretchField, SurfaceDrawing, map_drawing};

/// Plans kept by a [`Cache`]: a few more than threads work on at a time.
const KEPT: usize = 8;

/// The drawing, its pens, and what they are expected to take.
pub(super) struct Prepared {
    pub made: Made,
    /// The drawing with all its layers: those of the artwork, and those laid over them.
    pub drawing: Drawing,
    pub pens: Vec<LayerPen>,
    pub metrics: DrawingMetrics,
    /// Where a base stands for it; the drawing's strokes are then what is drawn from one place each.
    pub driving: Option<Driving>,
}

impl Prepared {
    /// The scenario with its drawing at the height at which a cover of its wall wants it.
    pub(super) fn settled(&self, scenario: &Scenario) -> Scenario {
        let mut settled = scenario.clone();
        if let Some(driving) = &self.driving {
            settled.canvas.offset_mm[1] += driving.found.coverage.raise * 1e3;
        }
        settled
    }

    /// Figures of the drawing and of where a base stands for it.
    pub(super) fn cover_metrics(&self, scenario: &Scenario) -> Result<Metrics, RunError> {
        let robot = || scenario.robot.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let driving = self.driving.as_ref().ok_or_else(|| RunError::NoBase { what: "a cover", robot: robot() })?;
        let mut metrics = Metrics::new(&scenario.name, scenario.seed);
        metrics.drawing = Some(self.metrics.clone());
        metrics.coverage = Some(driving.found.metrics());
        Ok(metrics)
    }
}

/// The drawing as it lies on the believed canvas.
pub(super) struct Mapped {
    pub strokes: SurfaceDrawing,
    pub field: StretchField,
    pub laid: Laid,
    pub metrics: MappingMetrics,
}

/// All that is made from belief alone.
pub(super) struct Believed {
    pub prepared: Prepared,
    /// The canvas as it is believed before anything is touched.
    pub canvas: Arc<BelievedCanvas>,
    /// The scan that the belief came from, if it did.
    pub scan: Option<Scan>,
    /// `None` where the canvas is learned by touch.
    pub mapped: Option<Mapped>,
    /// `None` where strokes are planned while they are drawn or where the base stands, or where no plan was asked for.
    pub planning: Option<Planning>,
}

impl Believed {
    /// Figures of the belief, where it was scanned.
    pub(super) fn belief_metrics(&self) -> Option<BeliefMetrics> {
        self.scan.as_ref().map(Scan::metrics)
    }

    /// What may lie beyond a scan.
    pub(super) fn skirt(&self) -> Option<&TriMesh> {
        self.scan.as_ref().and_then(Scan::skirt)
    }
}

/// Reads or makes the drawing, or the part of it that `only` names.
pub(super) fn prepare(scenario: &Scenario, only: Option<&Part>, progress: &dyn Progress) -> Result<Prepared, RunError> {
    progress.stage("drawing", None);
    let started = Instant::now();
    let sketch = Sketch::from(scenario);
    let made = artwork::make(&sketch, progress)?;
    let mut drawing = made.drawing.clone();
    if let Some(part) = only {
        drawing = part.of(&drawing)?;
    }
    overlaid(&mut drawing, scenario);
    let seconds = started.elapsed().as_secs_f64();
    let pens = artwork::pens(&drawing, &sketch.pen)?;
    let metrics = DrawingMetrics {
        estimated_s: Some(artwork::estimated_time(&drawing, &sketch)),
        part: only.map(ToString::to_string),
        ..DrawingMetrics::of(&drawing, seconds)
    };
    let driving = drive(scenario, &mut drawing, &pens, progress)?;
    Ok(Prepared { made, drawing, pens, metrics, driving })
}

/// Goes from the drawing to what is planned of it, as far as `until`. Nothing here depends on the true scene, but for what a camera
/// sees of it.
pub(super) fn believe(
    scenario: &Scenario,
    prepared: Prepared,
    setup: &Setup,
    until: Until,
    journal: Option<&Journal>,
    progress: &dyn Progress,
) -> Result<Believed, RunError> {
    progress.stage("mapping", None);
    for warning in setup.cell.arms.iter().flat_map(|arm| &arm.warnings) {
        progress.note(warning);
    }
    let (canvas, scan) = match &scenario.scan {
        Some(settings) => {
            let (canvas, scan) = Scan::make(settings, setup, scenario.seed)?;
            (canvas, Some(scan))
        }
        None => (BelievedCanvas(setup.scene.canvas.clone()), None),
    };
    let mut believed = Believed { prepared, canvas: Arc::new(canvas), scan, mapped: None, planning: None };
    if scenario.touch.is_some() {
        return if until < Until::End { Err(RunError::WhileDrawing) } else { Ok(believed) };
    }
    believed.mapped = Some(lay(scenario, &believed, progress)?);
    if believed.prepared.driving.is_some() {
        // a base plans where it comes to stand
        return if until == Until::Plan { Err(RunError::WhileDriving) } else { Ok(believed) };
    }
    if until >= Until::Plan {
        believed.planning = Some(plan_all(scenario, setup, &believed, journal, progress)?);
    }
    Ok(believed)
}

/// Maps the drawing onto the believed canvas.
fn lay(scenario: &Scenario, believed: &Believed, progress: &dyn Progress) -> Result<Mapped, RunError> {
    let started = Instant::now();
    let (drawing, canvas) = (&believed.prepared.drawing, &believed.canvas);
    let (mapping, flattened) = mapping_onto(scenario, drawing, canvas)?;
    for sentence in flattened.iter().flat_map(|f| &f.mended) {
        progress.note(&format!("canvas: {sentence}"));
    }
    let step = scenario.plan.step_mm * 1e-3;
    let strokes = mapped(scenario, drawing, canvas, mapping.as_ref(), step, map_drawing)?;
    let seconds = started.elapsed().as_secs_f64();
    let field = StretchField::of(mapping.as_ref(), [drawing.width, drawing.height]);
    let own = own_layers(drawing, scenario);
    let flips = flattened.as_ref().map(|f| f.chart.flips);
    let metrics = MappingMetrics::of(mapping.kind(), &own, &strokes, seconds).with(field.distortion().as_ref(), flips);
    let laid = Laid::new(mapping.kind(), &own, &strokes, &field, flattened.as_ref());
    Ok(Mapped { strokes, field, laid, metrics })
}

type Slot = Arc<OnceLock<Result<Arc<Believed>, Arc<RunError>>>>;

/// Plans of scenarios, so that trials that differ in truth alone are planned once. Threads that want the same plan wait for
/// the one that makes it. The last few are kept.
#[derive(Default)]
pub struct Cache {
    slots: Mutex<Vec<(String, Slot)>>,
}

impl Cache {
    /// What scenarios share with this one: made by the first that asks.
    pub(super) fn believed(&self, scenario: &Scenario, progress: &dyn Progress) -> Result<Arc<Believed>, RunError> {
        let make = || {
            let prepared = prepare(scenario, None, progress)?;
            let scenario = &prepared.settled(scenario);
            let setup = Setup::load(scenario, prepared.drawing.clone(), prepared.pens.clone())?;
            believe(scenario, prepared, &setup, Until::End, None, progress)
        };
        let slot = self.slot(key(scenario)?);
        slot.get_or_init(|| make().map(Arc::new).map_err(Arc::new)).clone().map_err(RunError::Shared)
    }

    fn slot(&self, key: String) -> Slot {
        // a thread that panicked while it held the list left it whole
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        let slot = match slots.iter().position(|(k, _)| *k == key) {
            Some(at) => slots.remove(at).1,
            None => Slot::default(),
        };
        slots.push((key, slot.clone()));
        if slots.len() > KEPT {
            slots.remove(0);
        }
        slot
    }

    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.slots.lock().unwrap().len()
    }
}

/// What a scenario's plan depends on, as a digest: everything but the truth, what becomes of the pictures, and names. The seed
/// counts where something before the plan draws from it: strokes made of a picture, and a camera's noise.
pub(super) fn key(scenario: &Scenario) -> Result<String, ScenarioError> {
    let mut s = scenario.clone();
    // what the camera sees is the truth
    let seeded = s.canvas.belief == BeliefKind::Scan;
    if !seeded && !matches!(s.drawing.artwork, Artwork::Picture(_)) {
        s.seed = 0;
    }
    (s.name, s.description) = (String::new(), String::new());
    (s.sim, s.render) = (SimSettings::default(), RenderSettings::default());
    if !seeded {
        s.truth = TruthSettings::default();
    }
    s.accept.clear();
    Ok(Digest::new().bytes(s.to_toml()?.as_bytes()).hex())
}
