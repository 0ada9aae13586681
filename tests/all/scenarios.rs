//! Every scenario that comes with the program, drawn from start to end, and what must hold of each.
//!
//! They run by the default engine; one of them runs on the articulated plant too. Those that take long are drawn smaller. What is drawn
//! here is drawn once: other tests look at it too ([`drawn`]).
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock, Mutex, OnceLock};

use calamus::artwork::Part;
use calamus::measure::Metrics;
use calamus::progress::Silent;
use calamus::report::OutputDir;
use calamus::run::{Manner, Until, run};
use calamus::scenario::{Override, Scenario};
use calamus::verdict::Verdict;

fn scenarios() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "toml"));
    // walls are for bases that drive: tests/cover.rs
    files.retain(|f| !f.file_stem().unwrap().to_string_lossy().starts_with("wall_"));
    files.sort();
    files
}

/// What makes the drawing of a scenario smaller, where that would take too long.
fn smaller(name: &str) -> &'static [&'static str] {
    match name {
        "tsp_portrait" => &["drawing.tsp.points=1000", "drawing.height_mm=40"],
        "painterly" => &["drawing.painterly.strokes=8", "drawing.height_mm=70"],
        "layered_depth" => &["drawing.layered_depth.strokes=8", "drawing.width_mm=70"],
        "hatching" => &["drawing.height_mm=17"],
        "hilbert_column" => &["drawing.pattern.order=3", "drawing.width_mm=60"],
        "plank_wall" => &["drawing.pattern.n=2"],
        "patterns_column_both" => &["drawing.pattern.order=2", "drawing.pattern.n=4"],
        "patterns_column_arrowhead" => &["drawing.pattern.order=4", "drawing.width_mm=100"],
        "patterns_column_snowflake" => &["drawing.pattern.order=2", "drawing.width_mm=100"],
        // one of the touched ones is drawn as it is, and the drawing of the scanned one is the column figure's
        "touched_cone" | "touched_tank" | "scanned_column" => {
            &["drawing.source=\"art/letter.svg\"", "drawing.width_mm=50"]
        }
        "tool_change" => &["render.tool_stages=false"],
        "four_colours" => &["drawing.painterly.strokes=8", "drawing.height_mm=60"],
        "three_arms" => &["drawing.height_mm=60"],
        "cmyk_tsp" => &["drawing.tsp.points=60", "drawing.height_mm=15"],
        _ => &[],
    }
}

/// A scenario that was drawn: its figures, and the folder that was written.
pub struct Drawn {
    pub scenario: Scenario,
    pub metrics: Metrics,
    pub verdict: Option<Verdict>,
    pub folder: tempfile::TempDir,
}

/// What a scenario is set to in these tests: no views, and smaller where it would take too long.
pub fn settings(name: &str) -> Vec<&'static str> {
    [&["render.views=[]", "render.camera=[]", "render.drawing_px=800"], smaller(name)].concat()
}

/// A scenario that comes with the program, with these settings.
pub fn scenario(name: &str, sets: &[&str]) -> Scenario {
    let overrides: Vec<Override> = sets.iter().map(|s| s.parse().unwrap()).collect();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenarios/{name}.toml"));
    Scenario::read(&file, &overrides).unwrap()
}

/// The part of a scenario that is drawn, where all of it is much of the same.
fn part(name: &str) -> Option<Part> {
    let part = match name {
        "column_figure" => "strokes=1-45",
        // the last of its first ink and the first of its second
        "first_light" => "strokes=275-325",
        "scanned_tools" => "inks=Green,Red",
        "touched_bucket" => "strokes=1-25",
        "touched_tools" => "strokes=1-8",
        // one of each arm
        "cmyk_tsp" => "inks=cyan,black",
        _ => return None,
    };
    Some(part.parse().unwrap())
}

/// Draws a scenario with these settings, into a folder that is gone when it is dropped.
pub fn draw(name: &str, sets: &[&str]) -> Drawn {
    let scenario = scenario(name, sets);
    let folder = tempfile::tempdir().unwrap();
    let out = OutputDir::check(folder.path()).unwrap();
    let manner = Manner { only: part(name), ..Manner::default() };
    let outcome = run(&scenario, Until::End, &manner, &out, &Silent).unwrap();
    Drawn { scenario, metrics: outcome.metrics, verdict: outcome.verdict, folder }
}

/// A scenario as the tests of scenarios draw it ([`settings`]). It is drawn by the test that asks first; the others wait for it.
pub fn drawn(name: &'static str) -> Arc<Drawn> {
    type Runs = Mutex<BTreeMap<&'static str, Arc<OnceLock<Arc<Drawn>>>>>;
    static RUNS: LazyLock<Runs> = LazyLock::new(Runs::default);
    let run = RUNS.lock().unwrap().entry(name).or_default().clone();
    run.get_or_init(|| Arc::new(draw(name, &settings(name)))).clone()
}

fn check(name: &str, Drawn { scenario, metrics: m, verdict, folder }: &Drawn) {
    assert_eq!(*verdict, None, "{name}");
    let value = |path: &str| m.value(path).unwrap_or_else(|| panic!("{name}: no {path}"));

    if m.truth.is_some() {
        return check_perturbed(name, scenario, m);
    }

    // the pen leaves no ink while it is up
    assert_eq!(value("contact.pen_up_contact_steps"), 0.0, "{name}");
    assert!(value("line.excess") <= 0.01, "{name}: {} of the ink is astray", value("line.excess"));

    // all of the line is there, and where it should be
    assert_eq!(value("plan.reachable_fraction"), 1.0, "{name}");
    // a canvas that is only touched is known less well
    let touched = m.value("belief.probes").is_some();
    let coverage = if touched { 0.99 } else { 0.995 };
    assert!(value("line.coverage") >= coverage, "{name}: coverage {}", value("line.coverage"));
    assert!(value("line.error_mean_mm") <= 0.2, "{name}: mean error {} mm", value("line.error_mean_mm"));
    assert!(value("line.error_p95_mm") <= 0.5, "{name}: 95 % within {} mm", value("line.error_p95_mm"));

    // the force is what was asked for, and steady
    let spread = if touched { 0.25 } else { 0.15 };
    assert!(value("contact.contact_fraction") >= 0.995, "{name}: contact {}", value("contact.contact_fraction"));
    let target = value("contact.force_target_n");
    assert!((value("contact.force_mean_n") / target - 1.0).abs() < spread, "{name}: {m:?}");
    assert!(value("contact.force_sd_n") / target < spread, "{name}: sd {}", value("contact.force_sd_n"));
    assert!(value("sim.saturated_fraction") < 0.01, "{name}");

    // no joint steps faster than a fifth of the fastest joint's speed limit (180 deg/s) in a millisecond
    let bound = 0.2 * std::f64::consts::PI * 1e-3;
    assert!(value("plan.max_joint_step_rad") <= bound * 1.01, "{name}: {}", value("plan.max_joint_step_rad"));

    // the robot's picture is as like the artwork as the preview is
    if let Some(preview) = m.value("image.preview_ssim") {
        assert!((value("image.ssim") - preview).abs() <= 0.03, "{name}: {} {preview}", value("image.ssim"));
        let (drawn, preview) = (value("image.psnr_db"), value("image.preview_psnr_db"));
        assert!((drawn - preview).abs() <= 1.0, "{name}: {drawn} dB, preview {preview} dB");
    }

    assert!(scenario.unmet(m).is_empty(), "{name}: {:?}", scenario.unmet(m));
    for file in
        ["scenario.toml", "drawing.png", "drawing.svg", "plan.json", "plan-arm0.npy", "record.mcap", "metrics.json"]
    {
        assert!(folder.path().join(file).metadata().unwrap().len() > 100, "{name}: {file}");
    }
    assert!(folder.path().join("report.html").exists(), "{name}");
}

/// What holds where the canvas isn't as believed: all of it can be drawn and is, without force or torque beyond reason; how well is
/// in the scenario's own bounds.
fn check_perturbed(name: &str, scenario: &Scenario, m: &Metrics) {
    let value = |path: &str| m.value(path).unwrap_or_else(|| panic!("{name}: no {path}"));
    assert_eq!(value("plan.reachable_fraction"), 1.0, "{name}");
    assert!(value("contact.force_max_n") < 30.0, "{name}: {} N", value("contact.force_max_n"));
    assert!(value("sim.saturated_fraction") < 0.01, "{name}");
    assert!(!scenario.accept.is_empty() && scenario.unmet(m).is_empty(), "{name}: {:?}", scenario.unmet(m));
}

macro_rules! each {
    ($($name:ident),*) => {
        $(#[test]
        fn $name() {
            let name = stringify!($name);
            check(name, &drawn(name));
        })*

        #[test]
        fn every_scenario_is_tested() {
            let tested = [$(stringify!($name)),*];
            for file in scenarios() {
                let name = file.file_stem().unwrap().to_str().unwrap();
                assert!(tested.contains(&name), "scenarios/{name}.toml has no test here");
            }
        }
    };
}

each!(
    cmyk_tsp,
    column_figure,
    first_light,
    four_colours,
    grid_plane,
    hatching,
    hemisphere_grid,
    hilbert_column,
    layered_depth,
    letter,
    painterly,
    patterns_column_arrowhead,
    patterns_column_both,
    patterns_column_conformal,
    patterns_column_projection,
    patterns_column_snowflake,
    plank_wall,
    scanned_column,
    scanned_tools,
    stylus_signature,
    three_arms,
    tool_change,
    touched_bucket,
    touched_cone,
    touched_tank,
    touched_tools,
    tsp_portrait
);

#[test]
fn a_scenario_holds_on_the_articulated_plant_too() {
    let sets = [&settings("grid_plane")[..], &["sim.plant=articulated"]].concat();
    check("grid_plane", &draw("grid_plane", &sets));
}

#[test]
fn position_control_loses_an_uneven_half_sphere_or_presses_it_hard() {
    let set = ["control.law=position", "pen.press_depth_mm=0.06", "drawing.pattern.n=1", "drawing.width_mm=100"];
    let scenario = scenario("hemisphere_grid", &set);
    let m = calamus::run::evaluate(&scenario, &calamus::run::Cache::default(), &Silent).unwrap();
    let (contact, force) = (m.value("contact.contact_fraction").unwrap(), m.value("contact.force_max_n").unwrap());
    assert!(contact < 0.9 || force > 30.0, "contact {contact}, at most {force} N");
}
