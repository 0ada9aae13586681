//! A scenario's figures without files and pictures.
use super::RunError;
use super::belief::{Cache, prepare};
use super::perform::perform;
use super::setup::Setup;
use crate::exec::StopFlag;
use crate::measure::Metrics;
use crate::progress::Progress;
use crate::scenario::Scenario;

/// A scenario's figures, from drawing to measuring: those of [`run`](crate::run::run) but for pictures and likeness, without a
/// file written. What `cache` has of an earlier scenario isn't made again; the figures are the same to the last bit either way, but
/// for the times that the computer took.
pub fn evaluate(scenario: &Scenario, cache: &Cache, progress: &dyn Progress) -> Result<Metrics, RunError> {
    let believed = cache.believed(scenario, progress)?;
    let prepared = &believed.prepared;
    let scenario = &prepared.settled(scenario);
    let setup = Setup::load(scenario, prepared.drawing.clone(), prepared.pens.clone())?;
    Ok(perform(scenario, &setup, &believed, None, &StopFlag::default(), progress)?.metrics)
}

/// Where a base stands for a scenario's drawing, as figures: nothing is driven or drawn.
///
/// # Errors
/// No robot that drives, or no places that do.
pub fn evaluate_cover(scenario: &Scenario, progress: &dyn Progress) -> Result<Metrics, RunError> {
    prepare(scenario, None, progress)?.cover_metrics(scenario)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::belief::key;
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
        assert_eq!(cache.len(), 1);
        assert!(kept.digest.is_some() && kept.digest == alone.digest);
        assert_eq!(kept.line, alone.line);
    }
}
