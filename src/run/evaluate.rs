//! A scenario's figures without files and pictures, and what scenarios that the robot believes alike share.
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Instant;

use crate::drawing::Drawing;
use crate::math::Digest;
use crate::measure::{BeliefMetrics, DrawingMetrics, MappingMetrics, Metrics, PlanMetrics};
use crate::pen::LayerPen;
use crate::plan::Plan;
use crate::progress::Progress;
use crate::run::cast::Cast;
use crate::run::laying::{lay, mapping_onto, mapping_onto_truth, overlaid, own_layers};
use crate::run::scan::Scan;
use crate::run::{RunError, artwork, make_plan, make_record, measured, tools, touching};
use crate::scenario::{
    Artwork, BeliefKind, RenderSettings, Scenario, ScenarioError, SimSettings, Sketch, TruthSettings,
};
use crate::surface::{StretchField, map_drawing};

/// Plans kept by a [`Cache`]: a few more than threads work on at a time.
const KEPT: usize = 8;

/// What is made from belief alone: drawing, pens, plan and their figures.
struct Believed {
    drawing: Drawing,
    pens: Vec<LayerPen>,
    plan: Plan,
    drawing_metrics: DrawingMetrics,
    mapping_metrics: MappingMetrics,
    plan_metrics: PlanMetrics,
    belief_metrics: Option<BeliefMetrics>,
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
    fn believed(&self, scenario: &Scenario, progress: &dyn Progress) -> Result<Arc<Believed>, RunError> {
        let slot = self.slot(key(scenario)?);
        slot.get_or_init(|| believe(scenario, progress).map(Arc::new).map_err(Arc::new))
            .clone()
            .map_err(RunError::Shared)
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
}

/// What a scenario's plan depends on, as a digest: everything but the truth, what becomes of the pictures, and names. The seed
/// counts where something before the plan draws from it: strokes made of a picture.
fn key(scenario: &Scenario) -> Result<String, ScenarioError> {
    let mut s = scenario.clone();
    let seeded = match s.canvas.belief {
        BeliefKind::Mesh => false,
        // the camera's noise, and what the camera sees is the truth
        BeliefKind::Scan => true,
        // nothing is planned beforehand
        BeliefKind::Touch => true,
    };
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

/// The drawing, its pens and its figures.
fn draw(scenario: &Scenario, progress: &dyn Progress) -> Result<(Drawing, Vec<LayerPen>, DrawingMetrics), RunError> {
    let started = Instant::now();
    let sketch = Sketch::from(scenario);
    let mut drawing = artwork::make(&sketch, progress)?.drawing;
    overlaid(&mut drawing, scenario);
    let pens = artwork::pens(&drawing, &sketch.pen)?;
    let metrics = DrawingMetrics::of(&drawing, started.elapsed().as_secs_f64());
    Ok((drawing, pens, metrics))
}

fn believe(scenario: &Scenario, progress: &dyn Progress) -> Result<Believed, RunError> {
    let (drawing, pens, drawing_metrics) = draw(scenario, progress)?;
    let cast = Cast::load(scenario, drawing, pens)?;
    let started = Instant::now();
    let (mapping, flattened) = mapping_onto(scenario, &cast, &cast.belief)?;
    let mapped = lay(scenario, &cast, &cast.belief, mapping.as_ref(), scenario.plan.step_mm * 1e-3, map_drawing)?;
    let seconds = started.elapsed().as_secs_f64();
    let field = StretchField::of(mapping.as_ref(), [cast.drawing.width, cast.drawing.height]);
    let own = own_layers(&cast.drawing, scenario);
    let mapping_metrics = MappingMetrics::of(mapping.kind(), &own, &mapped, seconds)
        .with(field.distortion().as_ref(), flattened.map(|f| f.chart.flips));
    let started = Instant::now();
    let planned = make_plan(scenario, &cast, &mapped, progress)?;
    let plan = Plan { arms: vec![planned.plan] };
    let plan_metrics = PlanMetrics::of(&plan, &planned.reach, started.elapsed().as_secs_f64());
    let belief_metrics = cast.scan.as_ref().map(Scan::metrics);
    let Cast { drawing, pens, .. } = cast;
    Ok(Believed { drawing, pens, plan, drawing_metrics, mapping_metrics, plan_metrics, belief_metrics })
}

/// A scenario's figures, from drawing to measuring: those of [`run`](crate::run::run) but for pictures and likeness, without a
/// file written. What `cache` has of an earlier scenario isn't made again; the figures are the same to the last bit either way, but
/// for the times that the computer took.
pub fn evaluate(scenario: &Scenario, cache: &Cache, progress: &dyn Progress) -> Result<Metrics, RunError> {
    let mut metrics = Metrics::new(&scenario.name, scenario.seed);
    if let Some(touch) = &scenario.touch {
        // what is planned depends on what is met: there is nothing to share
        let (drawing, pens, drawing_metrics) = draw(scenario, progress)?;
        let cast = Cast::load(scenario, drawing, pens)?;
        let touched = touching::draw(scenario, touch, &cast, progress)?;
        metrics.drawing = Some(drawing_metrics);
        touched.measured(scenario, &cast, &mut metrics)?;
        let mapping = mapping_onto_truth(scenario, &cast)?;
        measured(scenario, &cast, &touched.record, mapping.as_ref(), &mut metrics)?;
        return Ok(metrics);
    }
    if let Some(settings) = &scenario.tools {
        let (drawing, pens, drawing_metrics) = draw(scenario, progress)?;
        let cast = Cast::load(scenario, drawing, pens)?;
        let belief = mapping_onto(scenario, &cast, &cast.belief)?.0;
        let mapped = lay(scenario, &cast, &cast.belief, belief.as_ref(), scenario.plan.step_mm * 1e-3, map_drawing)?;
        let mapping = mapping_onto_truth(scenario, &cast)?;
        let done = tools::draw(scenario, settings, &cast, &mapped, mapping.as_ref(), progress)?;
        metrics.drawing = Some(drawing_metrics);
        metrics.plan = Some(PlanMetrics::of(&done.plan, &done.reach, done.planning));
        metrics.tool = Some(done.tool);
        measured(scenario, &cast, &done.record, mapping.as_ref(), &mut metrics)?;
        return Ok(metrics);
    }
    let believed = cache.believed(scenario, progress)?;
    metrics.drawing = Some(believed.drawing_metrics.clone());
    metrics.belief = believed.belief_metrics.clone();
    metrics.mapping = Some(believed.mapping_metrics.clone());
    metrics.plan = Some(believed.plan_metrics.clone());
    // what the robot believes is in the plan: it isn't scanned again
    let cast = Cast::nominal(scenario, believed.drawing.clone(), believed.pens.clone())?;
    let mapping = mapping_onto_truth(scenario, &cast)?;
    let record = make_record(scenario, &cast, &believed.plan, mapping.as_ref(), progress)?;
    measured(scenario, &cast, &record, mapping.as_ref(), &mut metrics)?;
    Ok(metrics)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::progress::Silent;
    use crate::scenario::Override;

    fn scenario(sets: &[&str]) -> Scenario {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/grid_plane.toml");
        let small = ["drawing.width_mm=20", "drawing.pattern={kind=\"grid\",n=1}", "sim.plant=\"articulated\""];
        let sets: Vec<Override> = small.iter().chain(sets).map(|s| s.parse().unwrap()).collect();
        Scenario::read(&file, &sets).unwrap()
    }

    #[test]
    fn truth_names_and_pictures_share_a_plan_and_what_the_planner_heeds_does_not() {
        let own = key(&scenario(&[])).unwrap();
        for same in ["seed=7", "name=\"x\"", "render.views=[]", "sim.record_hz=50.0", "truth.relief_percent=1.0"] {
            assert_eq!(key(&scenario(&[same])).unwrap(), own, "{same}");
        }
        for other in ["pen.press_depth_mm=4.0", "control.speed_mm_s=30.0", "canvas.offset_mm=[1.0, 0.0]"] {
            assert_ne!(key(&scenario(&[other])).unwrap(), own, "{other}");
        }
    }

    #[test]
    fn a_plan_from_the_cache_gives_the_same_bits() {
        let cache = Cache::default();
        let noisy = scenario(&["control.torque_noise_nm=0.1", "seed=3"]);
        evaluate(&scenario(&["control.torque_noise_nm=0.1"]), &cache, &Silent).unwrap();
        let kept = evaluate(&noisy, &cache, &Silent).unwrap();
        let alone = evaluate(&noisy, &Cache::default(), &Silent).unwrap();
        assert_eq!(cache.slots.lock().unwrap().len(), 1);
        assert!(kept.digest.is_some() && kept.digest == alone.digest);
        assert_eq!(kept.line, alone.line);
    }
}
