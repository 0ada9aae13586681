//! The camera on the hand of an arm that drives, what its robot knows of it, and figures of what it found out.
use nalgebra::{Point2, Vector2};

use super::RunError;
use super::belief::Believed;
use super::setup::Setup;
use super::team::{STRIDE, TOUCHING};
use crate::camera::HandCamera;
use crate::canvas::mapping_onto;
use crate::drawing::{Drawing, InkLayer, Stroke};
use crate::ink::{InkPoint, InkStroke};
use crate::math::{Rgb, stats};
use crate::measure::LookMetrics;
use crate::scenario::{LookingSettings, Scenario};
use crate::skill::{Aligned, LookOptions};
use crate::surface::map_drawing;
use crate::twin::{Feeling, Simulation, TrueScene};

/// Spacing of the points of a printed line, m.
const MARK_STEP: f64 = 1e-3;

/// Gives an arm its camera, and what it feels with.
pub(super) fn equip(simulation: &mut Simulation, scenario: &Scenario, setup: &Setup, scene: &TrueScene) {
    let Some(looking) = &scenario.looking else { return };
    let index = simulation.index();
    let built = looking.built(&setup.cell.arms[index].last_from_flange);
    let printed = printed(looking, setup, scene);
    simulation.see_with(HandCamera::new(built, printed, scenario.seed, index as u64));
    if looking.feel {
        let contact_force = TOUCHING * looking.feel_n;
        simulation.feel(Feeling { force_noise: looking.force_noise_n, contact_force, stride: STRIDE }, index);
    }
}

/// How the base aligns itself, as the robot knows it.
pub(super) fn options(
    scenario: &Scenario,
    setup: &Setup,
    believed: &Believed,
) -> Result<Option<LookOptions>, RunError> {
    let Some(settings) = &scenario.looking else { return Ok(None) };
    let marks = match marks(settings, setup) {
        Some(crosses) => {
            let (mapping, _) = mapping_onto(scenario, &crosses, &believed.canvas)?;
            Some(map_drawing(&crosses, mapping.as_ref(), MARK_STEP)?)
        }
        None => None,
    };
    let (widths, springs) = setup.pens.iter().map(|p| (p.pen.width_nominal, p.pen.spring.stiffness)).unzip();
    Ok(Some(settings.options(&setup.cell.arms[0].last_from_flange, widths, springs, marks)))
}

/// The printed crosses as a drawing; `None` where none is printed.
fn marks(settings: &LookingSettings, setup: &Setup) -> Option<Drawing> {
    let half = 0.5 * settings.mark_size_mm * 1e-3;
    let arms = settings
        .marks_mm
        .iter()
        .map(|m| Point2::new(m[0] * 1e-3, m[1] * 1e-3))
        .flat_map(|p| [Vector2::x(), Vector2::y()].map(|way| Stroke::new(vec![p - way * half, p + way * half])));
    let strokes: Vec<Stroke> = arms.collect();
    let layer = InkLayer { name: "marks".into(), color: Rgb([0; 3]), width_hint: None, strokes };
    (!layer.strokes.is_empty()).then(|| Drawing::new(setup.drawing.width, setup.drawing.height, vec![layer]))
}

/// The printed crosses as ink on the true canvas.
fn printed(settings: &LookingSettings, setup: &Setup, scene: &TrueScene) -> Vec<InkStroke> {
    let Some(crosses) = marks(settings, setup) else { return Vec::new() };
    let width = setup.pens.first().map_or(5e-4, |p| p.pen.width_nominal);
    let line = |s: &Stroke| {
        let count = (s.length() / MARK_STEP).ceil().max(1.0) as usize;
        let at = |i: usize| s.points[0] + (s.points[1] - s.points[0]) * (i as f64 / count as f64);
        let point = |sheet: Point2<f64>| {
            let p = scene.mapping.to_surface(&sheet)?;
            Some(InkPoint { position: p.position, normal: p.normal, sheet, width, density: 1.0, time: 0.0 })
        };
        InkStroke { ink: 0, stroke: None, arm: 0, points: (0..=count).filter_map(|i| point(at(i))).collect() }
    };
    crosses.layers[0].strokes.iter().map(line).collect()
}

/// Figures of what was found out, place after place.
pub(super) fn figures(aligned: &[Aligned]) -> LookMetrics {
    let arrived: Vec<&Aligned> = aligned.iter().filter(|a| !a.leaving).collect();
    let corrected = |of: fn(&Aligned) -> f64| {
        let values: Vec<f64> = arrived.iter().map(|a| of(a) * 1e3).collect();
        (stats::quantile(&values, 0.5), values.iter().copied().reduce(f64::max))
    };
    let (shift, turn) = (corrected(|a| a.correction[0]), corrected(|a| a.correction[1]));
    let read: Vec<f64> = aligned.iter().filter(|a| a.points > 0).map(|a| a.rms_px).collect();
    LookMetrics {
        pictures: aligned.iter().map(|a| a.pictures).sum(),
        refused: aligned.iter().filter(|a| a.refused.is_some()).count(),
        felt: aligned.iter().map(|a| a.felt).sum(),
        correction_p50_mm: shift.0,
        correction_max_mm: shift.1,
        correction_p50_mrad: turn.0,
        rms_px: stats::mean(&read),
    }
}

/// What was found out, as a table.
pub(super) fn table(aligned: &[Aligned]) -> String {
    let mut csv = String::from("place,time_s,when,pictures,points,rms_px,felt,correction_mm,correction_mrad,refused\n");
    for a in aligned {
        csv += &format!(
            "{},{:.3},{},{},{},{:.3},{},{:.4},{:.4},{}\n",
            a.place + 1,
            a.time,
            if a.leaving { "leaving" } else { "arrived" },
            a.pictures,
            a.points,
            a.rms_px,
            a.felt,
            a.correction[0] * 1e3,
            a.correction[1] * 1e3,
            a.refused.as_ref().map_or_else(String::new, ToString::to_string),
        );
    }
    csv
}
