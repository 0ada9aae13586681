//! A line of desired width comes out as wide as desired, from the plan to the ink.
use std::path::{Path, PathBuf};
use std::sync::Arc;

use calamus::control::{ImpedanceOptions, LawOptions};
use calamus::drawing::{Drawing, InkLayer, Stroke};
use calamus::ink::InkPoint;
use calamus::math::Rgb;
use calamus::measure::{ContactMetrics, width_error};
use calamus::pen::LayerPen;
use calamus::pen::PenModel;
use calamus::plan::{self, PlanOptions, PressDepths};
use calamus::robot::Cell;
use calamus::surface::{BelievedCanvas, Projection, Scene, SurfaceDrawing, map_drawing};
use calamus::truth::TrueCanvas;
use calamus::twin::{ArmSetup, Record, TrueScene, TwinOptions, simulate};
use nalgebra::Point2;

fn asset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// Draws one stroke of these widths (m), straight from x = -70 mm to 70 mm, with a felt-tip pen on a scene.
fn drawn(scene: &str, widths: Vec<f64>) -> (SurfaceDrawing, Record) {
    let arm = Cell::load(&asset("robots/iiwa_fixed.toml")).unwrap().arms.remove(0);
    let scene = Scene::read(&asset(scene)).unwrap();
    let (truth, belief) = (TrueCanvas::nominal(scene.canvas.clone()), BelievedCanvas(scene.canvas.clone()));
    let pen = PenModel::named("felt_tip").unwrap();
    let control = ImpedanceOptions::default();
    let share = |i: usize| i as f64 / (widths.len() - 1) as f64;
    let points = (0..widths.len()).map(|i| Point2::new(0.14 * share(i) - 0.07, 0.01)).collect();
    let strokes = vec![Stroke { points, widths: widths.clone() }];
    let drawing =
        Drawing::new(0.2, 0.1, vec![InkLayer { name: "ink".into(), color: Rgb([0; 3]), width_hint: None, strokes }]);

    let mapping = Projection::new(truth.reveal());
    let options = PlanOptions::default();
    let [narrow, wide] = pen.width_range();
    let at = |w: f64| (w, pen.force_for_width(w, options.pen_speed) / control.stiffness[2]);
    let table = (0..=12).map(|i| at(narrow + (wide - narrow) * f64::from(i) / 12.0)).collect();
    let options = PlanOptions { press: PressDepths { default: 3e-3, layers: vec![table] }, ..options };
    let mapped = map_drawing(&drawing, &mapping, 1e-3).unwrap();
    let planned = plan::plan(
        &plan::PlanJob {
            arm_index: 0,
            arm: &arm.model,
            home: &arm.home,
            service: &arm.service,
            drawing: &mapped,
            canvas: &belief,
            obstacles: &[],
        },
        &options,
        &mut |_| (),
    )
    .unwrap();

    let (model, believed) = (arm.model.clone(), arm.model.clone());
    let colors = vec![Rgb([0; 3])];
    let setup = ArmSetup { index: 0, model, believed, start: arm.home, layer: 0, gripper: None, colors };
    let pens = vec![LayerPen { pen, ink: "ink".into() }];
    let own = Box::new(Projection::new(truth.reveal()));
    let friction = scene.friction;
    let scene = Arc::new(TrueScene { canvas: truth, friction, compliance: 0.0, mapping: own, pens });
    let options = TwinOptions::default();
    let law = LawOptions::Impedance(control);
    let record = simulate(setup, &planned.plan.segments, &scene, law, &options).unwrap();
    (map_drawing(&drawing, &mapping, 2.5e-4).unwrap(), record)
}

#[test]
fn a_ramp_from_thin_to_thick_is_within_a_tenth_over_nine_tenths_of_its_length() {
    let desired = |x: f64| 0.75e-3 + (2.2e-3 - 0.75e-3) * (x + 0.07) / 0.14;
    // on the dome the force wavers by 0.06 N, and the lightest part of the line, 0.08 N, loses touch now and then
    for (scene, touching) in [("scenes/plane_table.toml", 0.999), ("scenes/hemisphere.toml", 0.98)] {
        let (line, record) = drawn(scene, vec![0.75e-3, 2.2e-3]);
        let ink: Vec<&InkPoint> = record.ink.strokes.iter().flat_map(|s| &s.points).collect();
        let nearest =
            |x: f64| ink.iter().min_by(|a, b| (a.sheet.x - x).abs().total_cmp(&(b.sheet.x - x).abs())).unwrap();
        let error = |i: u32| {
            let x = -0.07 + 1.4e-4 * (f64::from(i) + 0.5);
            let p = nearest(x);
            if (p.sheet.x - x).abs() > 3e-4 { 1.0 } else { (p.width / desired(x) - 1.0).abs() }
        };
        let mut errors: Vec<f64> = (0..1000).map(error).collect();
        errors.sort_by(f64::total_cmp);
        assert!(errors[900] < 0.1, "{scene}: {} at 90 %, {} at 50 %", errors[900], errors[500]);
        let measured = width_error(&line, &record.ink, 0.9).unwrap();
        assert!((measured - errors[900]).abs() < 0.01, "{scene}: {measured} and {}", errors[900]);

        let contact = ContactMetrics::of(&record);
        assert!(
            contact.contact_fraction.unwrap() > touching && contact.force_sd_n.unwrap() < 0.1,
            "{scene}: {contact:?}"
        );
        assert!(contact.force_max_n.unwrap() < 3.6, "{scene}: {contact:?}");
    }
}

#[test]
fn letters_swell_and_shrink_within_a_tenth() {
    // strokes of a hand: 14 mm from hairline to hairline
    let widths: Vec<f64> =
        (0..=140).map(|i| 1.45e-3 - 0.45e-3 * (f64::from(i) * std::f64::consts::TAU / 14.0).cos()).collect();
    let (line, record) = drawn("scenes/plane_table.toml", widths);
    let error = width_error(&line, &record.ink, 0.9).unwrap();
    assert!(error < 0.1, "{error}");
}
