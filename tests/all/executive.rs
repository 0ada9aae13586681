//! The executive through the program: killed runs go on to the same bytes, parts are drawn alone, arms and sensors combine.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, SystemTime};

use crate::scenarios::{drawn, scenario, settings};
use calamus::measure::Metrics;
use calamus::progress::Silent;
use calamus::report::OutputDir;
use calamus::run::{Cache, Manner, Until, evaluate, run};

fn asset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn start(name: &str, out: &Path, more: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_calamus"))
        .args(["run", &asset(&format!("scenarios/{name}.toml")).to_string_lossy(), "-q", "--out"])
        .arg(out)
        .args(more)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// What of a run doesn't depend on the clock.
pub fn timeless(metrics: &Metrics) -> serde_json::Value {
    fn strip(value: &mut serde_json::Value) {
        if let Some(map) = value.as_object_mut() {
            map.retain(|k, _| !matches!(k.as_str(), "duration_s" | "wall_s" | "real_time_factor" | "image" | "render"));
            map.values_mut().for_each(strip);
        }
    }
    let mut value = serde_json::to_value(metrics).unwrap();
    let schedule = value.pointer("/tool/schedule").cloned();
    strip(&mut value);
    if let (Some(schedule), Some(place)) = (schedule, value.pointer_mut("/tool/schedule")) {
        *place = schedule;
    }
    value
}

/// The files of a run that don't depend on the clock, but for metrics.json, whose figures are compared apart from times.
fn products(folder: &Path) -> (BTreeMap<String, Vec<u8>>, serde_json::Value) {
    let names = ["drawing.png", "drawing.svg", "plan.json", "record.mcap", "wished.svg", "tools.csv", "belief.csv"];
    let files = names.iter().filter_map(|n| Some(((*n).to_string(), std::fs::read(folder.join(n)).ok()?)));
    let metrics: Metrics = serde_json::from_slice(&std::fs::read(folder.join("metrics.json")).unwrap()).unwrap();
    (files.collect(), timeless(&metrics))
}

/// When the states that a run keeps were last written.
fn kept(out: &Path) -> Vec<SystemTime> {
    let states = ["arm0.state", "arm1.state"].map(|f| out.join("journal").join(f));
    states.iter().filter_map(|f| f.metadata().and_then(|m| m.modified()).ok()).collect()
}

/// Kills a run as soon as it has begun, then twice a while after it has kept a state, and lets it go on until it ends. Tells how
/// often it went on from a state.
fn killed(name: &str, out: &Path, sets: &[&str]) -> usize {
    let key = out.join("journal/run.key");
    let mut gone_on = 0;
    for kill in 0..4 {
        let before = kept(out);
        gone_on += usize::from(!before.is_empty());
        let often = ["--keep-every-ms", "300"];
        let more: Vec<&str> = sets.iter().copied().chain(often).chain(key.exists().then_some("--resume")).collect();
        let mut child = start(name, out, &more);
        let due = || if kill == 0 { key.exists() } else { kept(out) != before };
        while kill == 3 || !due() {
            if let Some(status) = child.try_wait().unwrap() {
                assert!(status.success(), "{name} after {kill} kills: {status}");
                return gone_on;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        std::thread::sleep(Duration::from_millis(70 * kill));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    unreachable!("the last time it isn't killed")
}

#[test]
fn a_killed_run_goes_on_to_the_same_bytes() {
    let mut gone_on = 0;
    for name in ["touched_cone", "tool_change"] {
        let folder = tempfile::tempdir().unwrap();
        let sets: Vec<&str> = settings(name).into_iter().flat_map(|s| ["--set", s]).collect();
        let times = killed(name, folder.path(), &sets);
        let whole = drawn(name);
        assert_eq!(products(folder.path()), products(whole.folder.path()), "{name}, gone on with {times} times");
        assert!(!folder.path().join("journal").exists(), "{name}: the journal of a finished run is gone");
        gone_on += times;
    }
    assert!(gone_on > 0, "each run was over before it kept a state");
}

#[test]
fn there_is_nothing_to_go_on_from_where_nothing_was_interrupted() {
    let folder = tempfile::tempdir().unwrap();
    let status = start("letter", folder.path(), &["--resume"]).wait().unwrap();
    assert_eq!(status.code(), Some(2));
}

#[test]
fn a_part_is_drawn_alone_and_says_so() {
    let s = scenario(
        "first_light",
        &["render.views=[]", "render.camera=[]", "render.drawing_px=200", "drawing.width_mm=30"],
    );
    let folder = tempfile::tempdir().unwrap();
    let out = OutputDir::check(folder.path()).unwrap();
    let manner = Manner { only: Some("strokes=1-2".parse().unwrap()), ..Manner::default() };
    let outcome = run(&s, Until::End, &manner, &out, &Silent).unwrap();
    let drawing = outcome.metrics.drawing.unwrap();
    assert_eq!((drawing.part.as_deref(), drawing.strokes), (Some("strokes=1-2"), 2));
    assert!(outcome.metrics.line.unwrap().coverage > Some(0.99));
}

#[test]
fn no_ink_where_ink_was_asked_is_a_failure_and_none_of_the_line() {
    let folder = tempfile::tempdir().unwrap();
    // the table stands lower than anyone thinks
    let text = "[drawing]\nwidth_mm = 10\n[drawing.pattern]\nkind = 'grid'\nn = 1\n[canvas]\nscene = 'plane_table'\n\
        [truth]\noffset_mm = [0, 0, -40]\n[render]\ndrawing_px = 200\nviews = []\n";
    std::fs::write(folder.path().join("s.toml"), text).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_calamus"));
    let out = command.args(["run", "s.toml", "-q", "--out", "o"]).current_dir(folder.path()).output().unwrap();
    let told = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(1), "{told}");
    assert!(told.contains("no ink came onto the canvas"), "{told}");
    let metrics: Metrics =
        serde_json::from_slice(&std::fs::read(folder.path().join("o/metrics.json")).unwrap()).unwrap();
    assert_eq!(metrics.line.unwrap().coverage, Some(0.0));
}

#[test]
fn an_experiments_figures_are_a_runs() {
    // and so of arms that fetch their pens: tools.rs
    for name in ["scanned_column", "touched_cone"] {
        let whole = drawn(name);
        let alone = evaluate(&whole.scenario, &Cache::default(), &Silent).unwrap();
        assert_eq!(timeless(&alone), timeless(&whole.metrics), "{name}");
    }
}

#[test]
fn no_two_fetches_of_a_dock_are_the_same_and_nothing_is_invented_of_them() {
    let drawn = drawn("four_colours");
    let (tool, folder) = (drawn.metrics.tool.as_ref().unwrap(), &drawn.folder);
    // more than there are inks, each simulated by itself
    assert!(tool.fetches > 3 && tool.fetches_distinct == tool.fetches && tool.failed == 0, "{tool:?}");
    assert!(tool.success_rate == Some(1.0) && tool.success_rate_low.unwrap() < 0.8, "{tool:?}");
    assert!(tool.handover_jump_rad.unwrap() < 1e-4 && tool.settling_s == Some(0.2));
    // stage by stage two fetches of one dock differ
    let csv = std::fs::read_to_string(folder.path().join("tools.csv")).unwrap();
    let grasps: Vec<&str> = csv.lines().filter(|l| l.contains(",fetch,") && l.contains(",full_grasp,")).collect();
    let pose = |l: &str| l.splitn(8, ',').last().unwrap().to_string();
    assert_eq!(grasps.len() as u64, tool.fetches, "{csv}");
    let distinct: std::collections::BTreeSet<String> = grasps.iter().map(|l| pose(l)).collect();
    assert_eq!(distinct.len(), grasps.len(), "{grasps:?}");
    // what isn't simulated in a tool change is absent from its record, and what happened in it is there
    let mcap = std::fs::read(folder.path().join("record.mcap")).unwrap();
    let text = String::from_utf8_lossy(&mcap);
    assert_eq!(text.matches("pen_fetched").count() as u64, tool.fetches);
    assert_eq!(text.matches("pen_returned").count() as u64, tool.fetches);
    let in_change = text.find("\"segment\":\"change_tool\"").map(|at| &text[at..at + 120]).unwrap();
    assert!(!in_change.contains("normal_force") && !in_change.contains("desired"), "{in_change}");
}
