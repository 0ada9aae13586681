//! Where a base stands to draw a wall: what is found can be planned, and what can't be is refused in one line.
use std::path::Path;
use std::process::{Command, Output};

use calamus::cover::cover;
use calamus::plan::{PlanJob, PlanOptions, plan};
use calamus::progress::Silent;
use calamus::report::OutputDir;
use calamus::robot::Cell;
use calamus::scenario::{Override, Scenario};
use calamus::surface::{BelievedCanvas, Scene, map_drawing, mapping_of};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

fn scenario(name: &str, sets: &[&str]) -> Scenario {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenarios/{name}.toml"));
    let sets: Vec<Override> = sets.iter().map(|s| s.parse().unwrap()).collect();
    Scenario::read(&file, &sets).unwrap_or_else(|e| panic!("{e}"))
}

fn figures(name: &str, sets: &[&str]) -> calamus::measure::CoverageMetrics {
    let dir = tempfile::tempdir().unwrap();
    let out = OutputDir::check(dir.path()).unwrap();
    let covered = cover(&scenario(name, sets), &out, &Silent).unwrap_or_else(|e| panic!("{e}"));
    for file in ["coverage.json", "coverage.svg", "metrics.json"] {
        assert!(dir.path().join(file).is_file(), "{file}");
    }
    let lines: usize = covered.coverage.places.iter().map(|p| p.pieces.len()).sum();
    let strokes = covered.metrics.drawing.as_ref().map_or(0, |d| d.strokes);
    assert_eq!(
        lines,
        strokes + covered.coverage.cuts.len(),
        "every stroke is drawn, in one piece more than it has cuts"
    );
    covered.metrics.coverage.unwrap()
}

#[test]
fn a_frieze_takes_two_places_and_circles_take_more_and_cut() {
    let map = figures("wall_frieze", &[]);
    assert_eq!((map.places, map.optimal, map.bound), (2, 1, Some(2)));
    assert!(map.cuts <= 1, "{} strokes cut", map.cuts);
    let circles = figures("wall_frieze", &["coverage.method=\"circles\""]);
    assert!(circles.places >= map.places && circles.cuts > 10);
}

#[test]
fn a_skyline_takes_two_places_and_each_part_is_planned_whole() {
    let scenario = scenario("wall_skyline", &[]);
    let dir = tempfile::tempdir().unwrap();
    let done = cover(&scenario, &OutputDir::check(dir.path()).unwrap(), &Silent).unwrap();
    let (drawing, covered) = (done.drawing, done.coverage);
    assert!(covered.places.len() == 2 && covered.strokes_cut() <= 1);
    let canvas = Scene::read(&scenario.canvas.scene).unwrap().canvas;
    let sheet = [drawing.width, drawing.height];
    let (mapping, _) = mapping_of(&canvas, scenario.canvas.mapping, sheet, &scenario.canvas.conformal).unwrap();
    let cell = Cell::load(&scenario.robot).unwrap();
    for (k, place) in covered.places.iter().enumerate() {
        let mut arm = cell.arms[0].model.clone();
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), place.pose.heading);
        let base = Isometry3::from_parts(Translation3::new(place.pose.x, place.pose.y, 0.0), turn);
        arm.world_from_base = base * Isometry3::translation(0.12, 0.0, 0.731);
        let laid = map_drawing(&covered.part(&drawing, k), mapping.as_ref(), 0.003).unwrap();
        let options = PlanOptions { step: 0.003, ..PlanOptions::default() };
        let job = PlanJob {
            arm_index: 0,
            arm: &arm,
            home: &cell.arms[0].home,
            service: &cell.arms[0].home,
            drawing: &laid,
            canvas: &BelievedCanvas(canvas.clone()),
            obstacles: &[],
        };
        let planned = plan(&job, &options, &mut |_| ()).unwrap_or_else(|e| panic!("place {}: {e}", k + 1));
        assert_eq!(planned.reach.fraction(), 1.0);
    }
}

fn told(sets: &[&str], name: &str) -> Output {
    let dir = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_calamus"));
    command.args(["cover", name, "-q", "--out"]).arg(dir.path().join("out"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    sets.iter().for_each(|s| {
        command.args(["--set", s]);
    });
    let output = command.output().unwrap();
    assert!(!dir.path().join("out").exists() || output.status.success(), "a refused cover leaves nothing behind");
    output
}

#[test]
fn what_cant_be_is_one_line_and_exit_2() {
    for (name, sets, expected) in [
        // the base is in the arm's own way so low
        ("wall_frieze", vec!["canvas.offset_mm=[0, -500]"], "the best place misses it by"),
        (
            "wall_frieze",
            vec!["coverage.poses=[[2600, 0, 0]]"],
            "the base at place 1 (2600, 0 mm, 0.0 deg) meets the wall: move it",
        ),
        ("wall_room", vec!["coverage.poses=[[1500, 1300, 0]]"], "meets what stands on the floor (1)"),
        ("wall_frieze", vec!["coverage.poses=[[2100, 0, 0]]"], "no place reaches the ink from"),
        ("wall_frieze", vec!["coverage.margin_mm=-1"], "`margin_mm` must be from 0 to 300, not -1"),
        ("wall_frieze", vec!["coverage.poses=[[0, 0]]"], "--set coverage.poses=[[0, 0]]: "),
        ("letter", vec![], "places to stand are found before a wall"),
    ] {
        let output = told(&sets, name);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{name} {sets:?}: {message}");
        assert!(message.contains(expected) && message.lines().count() == 1, "{name} {sets:?}: {message}");
    }
}

#[test]
fn a_plan_of_a_base_that_drives_is_made_where_it_comes_to_stand() {
    let output = Command::new(env!("CARGO_BIN_EXE_calamus"))
        .args(["plan", "wall_skyline", "-q", "--out"])
        .arg(tempfile::tempdir().unwrap().path().join("out"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && message.contains("see `calamus cover`"), "{message}");
}
