//! Experiments as a user meets them: the same bits however they are done, and each mistake in one line.
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use calamus::experiment::Experiment;

/// A small square on a table, drawn in seconds of the robot's time.
const SCENARIO: &str = "[drawing]\nwidth_mm = 10\n[drawing.pattern]\nkind = 'grid'\nn = 1\n[canvas]\nscene = 'plane_table'\n\
    [control]\nspeed_mm_s = 60\nlanding_speed_mm_s = 20\n[render]\ndrawing_px = 300\nviews = []\n\
    [sim]\nplant = 'articulated'\n";

/// Two cases, a grid of two, two trials of each, something drawn, and every kind of result.
const EXPERIMENT: &str = r#"name = "a small one"
scenario = "s.toml"
trials = 2
seed = 5

[set]
"control.torque_noise_nm" = { uniform = [0.01, 0.1] }

[vary]
"pen.press_depth_mm" = [2.0, 4.0]
"control.believed_friction" = { normal = [0.3, 0.05] }

[[case]]
name = "soft"

[[case]]
name = "stiff"
set = { "control.stiffness_n_m" = [1500, 1500, 700] }

[rate]
covered = "line.coverage >= 0.9"

[accept]
"line.coverage" = { mean_min = 0.9 }
"rate.success" = [{ mean_min = 1 }, { mean_min = 1, case = "stiff", at = { "pen.press_depth_mm" = 2 } }]

[[plot]]
kind = "curve"
metric = "contact.force_mean_n"
axis = "pen.press_depth_mm"

[[plot]]
kind = "histogram"
metric = "contact.force_max_n"

[worst]
metric = "line.error_mean_mm"
n = 1
"#;

/// A folder of one's own with the scenario, an experiment, and `calamus` run there.
struct Desk {
    folder: tempfile::TempDir,
}

impl Desk {
    fn new(experiment: &str) -> Self {
        let desk = Self { folder: tempfile::tempdir().unwrap() };
        desk.write("s.toml", SCENARIO);
        desk.write("e.toml", experiment);
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_calamus"));
        command.args(args).current_dir(self.folder.path());
        command
    }

    fn run(&self, args: &[&str]) -> Output {
        self.command(args).output().unwrap()
    }

    /// The command ends with this code; gives standard output.
    fn ends(&self, code: i32, args: &[&str]) -> String {
        let output = self.run(args);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{args:?}: {stderr}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// The command is refused in one line that holds all of `expected`, and leaves nothing behind.
    fn refuses(&self, args: &[&str], expected: &[&str]) {
        let before = listing(self.folder.path());
        let output = self.run(&[args, &["-q"]].concat());
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{args:?}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{args:?}: {stderr}");
        for part in expected {
            assert!(stderr.contains(part), "{args:?}: {stderr} should have {part}");
        }
        assert!(output.stdout.is_empty(), "{args:?}");
        assert_eq!(listing(self.folder.path()), before, "{args:?} left something behind");
    }

    /// Two folders hold the same results to the last byte.
    fn same(&self, one: &str, other: &str) {
        for file in RESULTS {
            let bytes = fs::read(self.path(one).join(file)).unwrap();
            assert!(bytes.len() > 100, "{one}/{file}");
            assert!(bytes == fs::read(self.path(other).join(file)).unwrap(), "{one}/{file} and {other}/{file} differ");
        }
    }
}

const RESULTS: [&str; 10] = [
    "results.csv",
    "results.parquet",
    "summary.csv",
    "summary.json",
    "trials.jsonl",
    "report.html",
    "curve-contact-force_mean_n.svg",
    "curve-contact-force_mean_n.png",
    "histogram-contact-force_max_n.svg",
    "histogram-contact-force_max_n.png",
];

fn listing(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(listing(&path));
        }
        found.push(path);
    }
    found.sort();
    found
}

#[test]
fn results_are_the_same_however_they_are_done() {
    let desk = Desk::new(EXPERIMENT);
    desk.ends(0, &["experiment", "e.toml", "--out", "one", "--threads", "1", "-q"]);

    // in shares, put together in any order
    for i in ["1", "2", "3"] {
        let (shard, out) = (format!("{i}/3"), format!("part{i}"));
        desk.ends(0, &["experiment", "e.toml", "--shard", &shard, "--out", &out, "--threads", "1", "-q"]);
    }
    desk.refuses(&["merge", "part1", "part3", "--out", "whole"], &["trials 1, 4, 7 (3 of them) are missing, of 8"]);
    desk.refuses(&["merge", "part1", "part2", "part1", "--out", "whole"], &["trials 0, 3, 6", "done twice", "part1"]);
    desk.ends(0, &["merge", "part3", "part1", "part2", "--out", "whole", "-q"]);
    desk.same("one", "whole");

    // stopped within a line, and gone on with
    let journal = fs::read(desk.path("one/trials.jsonl")).unwrap();
    fs::create_dir(desk.path("torn")).unwrap();
    fs::write(desk.path("torn/trials.jsonl"), &journal[..journal.len() * 2 / 3]).unwrap();
    desk.refuses(&["experiment", "e.toml", "--out", "torn"], &["torn/trials.jsonl holds", "of 8 trials", "--resume"]);
    desk.ends(0, &["experiment", "e.toml", "--out", "torn", "--resume", "-q"]);
    desk.same("one", "torn");

    // on two threads, and really killed
    let mut child = desk
        .command(&["experiment", "e.toml", "--out", "killed", "--threads", "2", "-q"])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let began = Instant::now();
    let lines = || fs::read(desk.path("killed/trials.jsonl")).map_or(0, |b| b.iter().filter(|b| **b == b'\n').count());
    while lines() < 3 && began.elapsed() < Duration::from_secs(120) && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    desk.ends(0, &["experiment", "e.toml", "--out", "killed", "--threads", "2", "--resume", "-q"]);
    desk.same("one", "killed");

    // a trial by itself
    let journal = fs::read_to_string(desk.path("one/trials.jsonl")).unwrap();
    for k in [0, 5] {
        let row = desk.ends(0, &["experiment", "e.toml", "--trial", &k.to_string(), "-q"]);
        assert_eq!(row.trim(), journal.lines().nth(k + 1).unwrap());
    }
    // the same randomness in both cases, another in each trial
    let rows: Vec<serde_json::Value> = journal.lines().skip(1).map(|l| serde_json::from_str(l).unwrap()).collect();
    for k in 0..4 {
        assert_eq!((&rows[k]["seed"], &rows[k]["draws"]), (&rows[k + 4]["seed"], &rows[k + 4]["draws"]));
        assert_ne!(rows[k]["digest"], rows[k + 4]["digest"]);
        assert!((0..k).all(|j| rows[j]["seed"] != rows[k]["seed"] && rows[j]["digest"] != rows[k]["digest"]));
    }

    // another experiment isn't mixed in
    desk.write("e.toml", &EXPERIMENT.replace("[2.0, 4.0]", "[2.0, 5.0]"));
    desk.refuses(&["experiment", "e.toml", "--out", "torn", "--resume"], &["torn/trials.jsonl", "another experiment"]);
    desk.ends(0, &["experiment", "e.toml", "--shard", "3/3", "--out", "part3", "-q"]);
    desk.refuses(&["merge", "part1", "part2", "part3", "--out", "x"], &["part1", "part3", "different experiments"]);
    desk.refuses(&["merge", "nothing", "--out", "x"], &["nothing/trials.jsonl"]);
}

#[test]
fn a_trial_that_cant_be_done_is_a_row_and_a_missed_bound_an_exit_code() {
    let text = "scenario = 's.toml'\ntrials = 1\n[vary]\n'drawing.width_mm' = [20, 1500]\n[accept]\n'rate.success' = { mean_min = 0.9 }\n\
                'line.coverage' = { min = 0.5 }\n";
    let desk = Desk::new(text);
    let output = desk.run(&["experiment", "e.toml", "--out", "out"]);
    let (stdout, stderr) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(
        stderr.contains("error: rate.success, mean: 0.5, should be at least 0.9 (1 of its trials failed)"),
        "{stderr}"
    );
    assert!(stdout.contains("kept   line.coverage"), "{stdout}");
    let csv = fs::read_to_string(desk.path("out/results.csv")).unwrap();
    let failed = csv.lines().find(|l| l.starts_with("1,")).unwrap();
    assert!(failed.contains(",failed,"), "{failed}");
    // by itself it fails the same way
    let row = desk.ends(1, &["experiment", "e.toml", "--trial", "1", "-q"]);
    assert_eq!(row.trim(), fs::read_to_string(desk.path("out/trials.jsonl")).unwrap().lines().nth(2).unwrap());
}

#[test]
fn a_trial_is_run_whole_when_files_are_asked_for() {
    let desk = Desk::new("scenario = 's.toml'\ntrials = 3\n");
    let row = desk.ends(0, &["experiment", "e.toml", "--trial", "2", "--out", "t", "-q"]);
    let row: serde_json::Value = serde_json::from_str(&row).unwrap();
    let metrics: serde_json::Value = serde_json::from_slice(&fs::read(desk.path("t/metrics.json")).unwrap()).unwrap();
    assert_eq!((&row["digest"], &row["seed"]), (&metrics["digest"], &metrics["seed"]));
    assert_eq!(row["metrics"]["line.error_mean_mm"], metrics["line"]["error_mean_mm"]);
    assert!(desk.path("t/drawing.png").exists());
}

#[test]
fn each_mistake_is_one_line_with_its_place() {
    let small = "scenario = 's.toml'\ntrials = 1\n";
    for (text, expected) in [
        ("trials = 1\n", "missing field `scenario`"),
        ("scenario = 'nothing'\n", "e.toml:1: no scenario `nothing`"),
        ("scenario = 's.toml'\ntrails = 3\n", "e.toml:2: unknown key `trails`: did you mean `trials`?"),
        ("scenario = 's.toml'\ntrials = 0\n", "e.toml:2: `trials` must be from 1 to 1000000, not 0"),
        ("[set]\n'control.sped_mm_s' = 3\n", "e.toml:4: unknown key `sped_mm_s`: did you mean `speed_mm_s`?"),
        ("[set]\ncontrol.speed_mm_s = -3\n", "e.toml:4: `speed_mm_s` must be from 0.1 to 1000, not -3"),
        ("[set]\nseed = 3\n", "e.toml:4: each trial has its own seed"),
        ("[set]\n'pen.press_depth_mm' = nan\n", "e.toml:4: `pen.press_depth_mm`: must be a finite number"),
        ("[vary]\n'pen.press_depth_mm' = []\n", "e.toml:4: `pen.press_depth_mm`: an axis needs values"),
        ("[vary]\n'pen.press_depth_mm' = [1, 160]\n", "e.toml:4: `press_depth_mm` must be from 0 to 100, not 160"),
        ("[vary]\n'pen.press_depth_mm' = 3\n", "e.toml:4: `pen.press_depth_mm`: doesn't vary"),
        (
            "[vary]\n'pen.press_depth_mm' = { unifrom = [1, 2] }\n",
            "e.toml:4: `pen.press_depth_mm`: no distribution `unifrom`",
        ),
        (
            "[vary]\n'pen.press_depth_mm' = { from = 1, to = 2, steps = 1 }\n",
            "e.toml:4: `pen.press_depth_mm`: `steps` counts",
        ),
        ("[vary]\n'pen.press_depth_mm' = { normal = [-9, 0.1] }\n", "(trial 0)"),
        (
            "[set]\n'pen.change_s' = 3\n[vary]\n'pen.change_s' = [1, 2]\n",
            "e.toml:4: `pen.change_s` is set here and varied",
        ),
        ("[[case]]\nname = 'a'\n[[case]]\nname = 'a'\n", "e.toml:6: each case needs a name of its own"),
        ("[[case]]\nname = 'a'\nset = { 'pen.kind' = 'quill' }\n", "e.toml:5: no pen `quill`"),
        ("[rate]\nx = 'line.coverage = 1'\n", "e.toml:4: `line.coverage = 1` should be a figure"),
        (
            "[accept]\n'line.coverag' = { min = 1 }\n",
            "e.toml:4: no metric `line.coverag`: did you mean `line.coverage`?",
        ),
        (
            "[accept]\n'line.coverage' = { mean_mni = 1 }\n",
            "e.toml:4: `line.coverage`: unknown key `mean_mni`: did you mean",
        ),
        ("[accept]\n'line.coverage' = {}\n", "e.toml:4: `line.coverage` needs a bound"),
        ("[accept]\n'line.coverage' = { min = 1, case = 'b' }\n", "e.toml:4: no case `b`"),
        ("[accept]\n'line.coverage' = { min = 1, at = { x = 1 } }\n", "e.toml:4: no axis `x`"),
        ("[accept]\n'rate.good' = { mean_min = 1 }\n", "e.toml:4: no rate `good`"),
        ("[accept]\n'sim.wall_s' = { max = 1 }\n", "e.toml:4: `sim.wall_s` isn't kept"),
        ("[[plot]]\nkind = 'curve'\nmetric = 'line.coverage'\n", "e.toml:3: this plot needs `axis`"),
        ("[[plot]]\nkind = 'pie'\nmetric = 'line.coverage'\n", "unknown value `pie`"),
        ("[worst]\nmetric = 'line.coverage'\nn = 0\n", "e.toml:5: `n` must be from 1 to 100, not 0"),
        (
            "[[plot]]\nkind = 'histogram'\nmetric = 'line.coverage'\n[[plot]]\nkind = 'histogram'\nmetric = 'line.coverage'\nbins = 1\n",
            "e.toml:9: `bins` must be from 2 to 200, not 1",
        ),
        (
            "[accept]\n'line.coverage' = [{ min = 1 }, { mean_min = nan }]\n",
            "e.toml:4: `mean_min` must be a finite number",
        ),
    ] {
        let whole = if text.contains("scenario =") || text.starts_with("trials") {
            text.into()
        } else {
            format!("{small}{text}")
        };
        Desk::new(&whole).refuses(&["experiment", "e.toml"], &[expected, "e.toml"]);
    }
    let desk = Desk::new(small);
    desk.refuses(&["experiment", "absent.toml"], &["absent.toml: "]);
    desk.refuses(
        &["experiment", "stifness_sweep"],
        &["no experiment `stifness_sweep`: did you mean `stiffness_sweep`?"],
    );
    desk.refuses(&["experiment", "e.toml", "--trial", "1"], &["no trial 1: the experiment has 1, from 0 to 0"]);
    desk.refuses(&["experiment", "e.toml", "--shard", "0/3"], &["`0/3` should be a share such as 3/10"]);
    desk.write("s.toml", "[drawing]\nsource = 'x.svg'\n[canvas]\nscene = 'plane_table'\n");
    desk.refuses(&["experiment", "e.toml"], &["s.toml:2: ", "x.svg"]);
}

#[test]
fn every_experiment_that_comes_with_the_program_is_right() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/experiments");
    let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty());
    for file in files {
        let experiment = Experiment::read(&file, None).unwrap_or_else(|e| panic!("{e}"));
        assert!(!experiment.description.is_empty(), "{}: no description", file.display());
        assert!(
            !experiment.accept.is_empty() && !experiment.plots.is_empty(),
            "{}: no bounds or plots",
            file.display()
        );
    }
}

#[test]
fn an_experiment_of_failures_alone_has_failed() {
    let desk = Desk::new("scenario = 's.toml'\ntrials = 1\n[vary]\n'drawing.width_mm' = [1500, 1600]\n");
    let output = desk.run(&["experiment", "e.toml", "--out", "out", "-q"]);
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("error: all 2 trials failed; the first: "), "{told}");
    desk.ends(1, &["experiment", "e.toml", "--out", "part", "--shard", "1/2", "-q"]);
}

#[test]
fn an_axis_and_a_figure_never_share_a_column() {
    let axes =
        "'truth.scale_percent' = [0, 1]\n'truth.offset_mm' = [[0, 0, 0], [0, 0, 1]]\n'pen.press_depth_mm' = [3]\n";
    let desk = Desk::new(&format!("scenario = 's.toml'\ntrials = 1\n[vary]\n{axes}"));
    desk.ends(0, &["experiment", "e.toml", "--out", "out", "-q"]);
    let csv = fs::read_to_string(desk.path("out/results.csv")).unwrap();
    let head: Vec<&str> = csv.lines().next().unwrap().split(',').collect();
    let distinct: std::collections::BTreeSet<&&str> = head.iter().collect();
    assert_eq!(distinct.len(), head.len(), "{head:?}");
    for name in ["set.truth.offset_mm", "truth.offset_mm", "set.truth.scale_percent", "pen.press_depth_mm"] {
        assert!(head.contains(&name), "{name}: {head:?}");
    }
    let parquet = fs::read(desk.path("out/results.parquet")).unwrap();
    assert!(parquet.windows(19).any(|w| w == b"set.truth.offset_mm"));
    assert!(
        fs::read_to_string(desk.path("out/summary.csv"))
            .unwrap()
            .starts_with("case,pen.press_depth_mm,set.truth.offset_mm,")
    );
}

#[test]
fn a_changed_mesh_is_another_experiment() {
    let desk = Desk::new("scenario = 's.toml'\ntrials = 1\n");
    let scene = "name = 'mesh'\n[canvas]\nshape = 'mesh'\nmesh = 'm.obj'\npose = { xyz_mm = [600, 0, 300] }\n\
        [sheet]\nxyz_mm = [600, 0, 320]\nnormal = [0, 0, 1]\nup = [1, 0, 0]\n";
    let mesh = |side: &str| "v -S -S 0\nv S -S 0\nv S S 0\nv -S S 0\nf 1 2 3\nf 1 3 4\n".replace('S', side);
    desk.write("scene.toml", scene);
    desk.write("m.obj", &mesh("0.2"));
    desk.write("s.toml", &SCENARIO.replace("plane_table", "scene.toml"));
    desk.ends(0, &["experiment", "e.toml", "--out", "out", "-q"]);
    desk.ends(0, &["experiment", "e.toml", "--out", "out", "--resume", "-q"]);
    desk.write("m.obj", &mesh("0.201"));
    desk.refuses(
        &["experiment", "e.toml", "--out", "out", "--resume"],
        &["out/trials.jsonl", "a file that it uses has changed"],
    );
}

#[test]
fn more_trials_may_be_asked_for_and_what_lacked_a_file_is_tried_again() {
    let desk = Desk::new("scenario = 's.toml'\ntrials = 2\n[vary]\n'pen.press_depth_mm' = [2, 4]\n");
    let same = |one: &str, other: &str| {
        for file in ["trials.jsonl", "results.csv", "summary.json"] {
            let read = |folder: &str| fs::read_to_string(desk.path(folder).join(file)).unwrap();
            assert_eq!(read(one), read(other), "{one}/{file} and {other}/{file}");
        }
    };
    desk.ends(0, &["experiment", "e.toml", "--out", "one", "-q"]);
    desk.ends(0, &["experiment", "e.toml", "--out", "grown", "--trials", "1", "-q"]);
    desk.ends(0, &["experiment", "e.toml", "--out", "grown", "--resume", "-q"]);
    same("one", "grown");
    let fewer = ["experiment", "e.toml", "--out", "grown", "--resume", "--trials", "1"];
    desk.refuses(&fewer, &["grown/trials.jsonl holds 2 trials of each", "1 are asked for"]);
    desk.ends(0, &["experiment", "e.toml", "--out", "part", "--shard", "1/4", "-q"]);
    let share = ["experiment", "e.toml", "--out", "part", "--shard", "1/4", "--resume", "--trials", "3"];
    desk.refuses(&share, &["part/trials.jsonl is one share", "3 can be asked for"]);

    // a trial that failed for want of a file isn't kept as failed
    let whole = fs::read_to_string(desk.path("one/trials.jsonl")).unwrap();
    let lost = |line: &str| {
        let mut row: serde_json::Value = serde_json::from_str(line).unwrap();
        let row = row.as_object_mut().unwrap();
        row.retain(|k, _| k != "metrics" && k != "digest");
        row.insert("status".into(), "failed".into());
        row.insert("reason".into(), "a.svg: No such file".into());
        row.insert("again".into(), true.into());
        serde_json::to_string(row).unwrap()
    };
    let lines = whole.lines().enumerate().map(|(i, l)| if i == 3 { lost(l) } else { l.to_string() });
    fs::create_dir(desk.path("lost")).unwrap();
    fs::write(desk.path("lost/trials.jsonl"), lines.map(|l| l + "\n").collect::<String>()).unwrap();
    desk.ends(0, &["experiment", "e.toml", "--out", "lost", "--resume", "-q"]);
    same("one", "lost");
}
