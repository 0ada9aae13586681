//! Where a base stands to draw a wall: what is found can be planned, and what can't be is refused in one line.
use std::path::Path;
use std::process::{Command, Output};

use calamus::cover::cover;
use calamus::plan::{PlanJob, PlanOptions, plan};
use calamus::progress::Silent;
use calamus::report::OutputDir;
use calamus::robot::Cell;
use calamus::run::{Manner, Until, run};
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

#[test]
fn a_drawing_that_lies_too_high_is_moved_down_to_where_it_can_be_drawn() {
    let small = ["coverage.poses=[]", "coverage.borders_mm=[]", "canvas.offset_mm=[0, 560]"];
    let dir = tempfile::tempdir().unwrap();
    let out = OutputDir::check(dir.path()).unwrap();
    let too_high = cover(&scenario("wall_seams", &small), &out, &Silent).unwrap_err().to_string();
    assert!(too_high.contains("the best place misses it by"), "{too_high}");
    let free = scenario("wall_seams", &[small.as_slice(), &["coverage.raise_mm=[-600, 0]"]].concat());
    let found = cover(&free, &out, &Silent).unwrap();
    let raise = found.metrics.coverage.as_ref().unwrap().raise_mm.unwrap();
    assert!((-600.0..=-50.0).contains(&raise) && found.coverage.places.len() == 1, "{raise}");
    // a run lays it there
    let laid = run(&free, Until::Mapping, &Manner::default(), &out, &Silent).unwrap();
    let file = laid.files.iter().find(|f| f.ends_with("mapped.json")).unwrap();
    let mapped: serde_json::Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    let mut heights = Vec::new();
    for stroke in mapped["layers"][0]["strokes"].as_array().unwrap() {
        let targets = stroke["targets"].as_array().unwrap();
        heights.extend(targets.iter().map(|t| t["position"][2].as_f64().unwrap()));
    }
    let top = heights.iter().copied().fold(0.0, f64::max);
    assert!((top - (1.22 + 0.56 + 0.12 + raise * 1e-3)).abs() < 1e-6, "{top}");
    // no lower than it must be: the arm draws up to some 1.6 m there
    assert!(top > 1.45, "{top}");
}

#[test]
fn the_authors_places_hold_the_frieze_and_take_longer_than_two() {
    let dir = tempfile::tempdir().unwrap();
    let covered = cover(&scenario("wall_authors", &[]), &OutputDir::check(dir.path()).unwrap(), &Silent).unwrap();
    let (theirs, drawing) = (covered.metrics.coverage.unwrap(), covered.metrics.drawing.unwrap());
    assert_eq!(theirs.places, 5);
    assert!(theirs.cuts > 10);
    // what their table of times comes to: 3.0 s a stroke and 6.0 mm/s
    let table = 3.0 * (drawing.strokes + theirs.crossings) as f64 + drawing.length_m / 0.006;
    let ours = theirs.estimated_s.unwrap() - theirs.drive_s;
    assert!((ours / table - 1.0).abs() < 0.05, "{ours} {table}");
    let own = figures("wall_frieze", &[]);
    assert!(own.places == 2 && own.drive_s < theirs.drive_s && own.estimated_s < theirs.estimated_s);
}

fn told(sets: &[&str], name: &str) -> Output {
    command_told("cover", sets, name)
}

fn command_told(what: &str, sets: &[&str], name: &str) -> Output {
    let dir = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_calamus"));
    command.args([what, name, "-q", "--out"]).arg(dir.path().join("out"));
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
        // three ways to be wrong about height
        ("wall_seams", vec!["coverage.raise_mm=[0, 100]"], "only `method = \"map\"` looks for a height"),
        ("wall_frieze", vec!["coverage.raise_mm=[100, 0]"], "`raise_mm` goes from low to high, not from 100 to 0"),
        (
            "wall_seams",
            vec!["coverage.poses=[]", "coverage.borders_mm=[]", "drawing.width_mm=1300"],
            "it is 1300 mm high, and from one place the arm holds",
        ),
        // one metre of door for a base of 1030 mm with its margins
        (
            "wall_room",
            vec![
                "coverage.footprint_mm=[1400, 990]",
                "coverage.poses=[[2000, 500, 0], [4500, -3200, 0]]",
                "drawing.width_mm=500",
                "canvas.offset_mm=[0, -50]",
                "coverage.verify=false",
            ],
            "a base 1030 mm wide can't drive from place 1 to place 2: the door is 1000 mm wide",
        ),
        (
            "wall_frieze",
            vec!["change.scene.canvas.profile.points_mm=[[3000, 1300], [3000, -1300], [3500, -1300], [2500, 1000]]"],
            "wall_wave.toml, changed: the profile crosses itself at",
        ),
        (
            "wall_frieze",
            vec!["change.scene.canvas.hight_mm=3"],
            "changed: unknown key `hight_mm`: did you mean `height_mm`?",
        ),
        (
            "wall_frieze",
            vec!["change.robot.base.mount.stifness_n_m=3"],
            "changed: unknown key `stifness_n_m`: did you mean `stiffness_n_m`?",
        ),
        ("wall_frieze", vec!["change.robo.base.radius_mm=3"], "unknown key `robo`: did you mean `robot`?"),
    ] {
        let output = told(&sets, name);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{name} {sets:?}: {message}");
        assert!(message.contains(expected) && message.lines().count() == 1, "{name} {sets:?}: {message}");
    }
}

#[test]
fn a_robot_without_a_base_is_refused_where_one_is_asked_for() {
    let fixed = "robot=iiwa_fixed";
    for (name, sets, expected) in [
        ("wall_frieze", vec![fixed], "`[coverage]` is for a robot that drives from place to place"),
        ("letter", vec!["drive.speed_mm_s=100"], "`[drive]` is for a robot that drives"),
        ("letter", vec!["localisation.sensor=lidar"], "`[localisation]` is for a robot that drives"),
        ("letter", vec!["canvas.scene=wall_flat"], "has no base to drive along it, as robot = \"iiwa_ridgeback\" has"),
    ] {
        let output = command_told("run", &sets, name);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{name} {sets:?}: {message}");
        assert!(message.contains(expected) && message.contains("iiwa_ridgeback"), "{name} {sets:?}: {message}");
        assert_eq!(message.lines().count(), 1, "{name} {sets:?}: {message}");
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
