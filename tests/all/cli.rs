//! The command line as a user meets it: what it prints, how it exits, what it leaves behind.
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of one's own with files in it, and `calamus` run there.
struct Desk {
    folder: tempfile::TempDir,
}

impl Desk {
    fn new(files: &[(&str, &str)]) -> Self {
        let desk = Self { folder: tempfile::tempdir().unwrap() };
        for (name, text) in files {
            let file = desk.folder.path().join(name);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, text).unwrap();
        }
        desk
    }

    fn run(&self, args: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_calamus"));
        command.args(args).current_dir(self.folder.path()).env_remove("CALAMUS_ASSETS").output().unwrap()
    }

    /// Every file and folder there is, sorted.
    fn listing(&self) -> Vec<PathBuf> {
        fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    walk(&path, found);
                }
                found.push(path);
            }
        }
        let mut found = Vec::new();
        walk(self.folder.path(), &mut found);
        found.sort();
        found
    }

    /// The command is refused: exit code 2, one line that holds all of `expected`, nothing written.
    fn refuses(&self, args: &[&str], expected: &[&str]) {
        let before = self.listing();
        let output = self.run(&[args, &["-q"]].concat());
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{args:?}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{args:?}: {stderr}");
        assert!(stderr.starts_with("error: "), "{args:?}: {stderr}");
        for part in expected {
            assert!(stderr.contains(part), "{args:?}: {stderr} should have {part}");
        }
        assert!(output.stdout.is_empty(), "{args:?}");
        assert_eq!(self.listing(), before, "{args:?} left something behind");
    }

    /// The command is done: exit code 0. Returns standard output.
    fn does(&self, args: &[&str]) -> String {
        let output = self.run(args);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{args:?}: {stderr}");
        String::from_utf8(output.stdout).unwrap()
    }
}

const SVG: &str = r#"<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm" viewBox="0 0 40 40">
<path d="M5 5 L35 5 L20 30 Z" fill="none" stroke="black"/></svg>"#;

/// A scenario that is right but for what a test adds at its end or puts in its files.
const RIGHT: &str = "[drawing]\nsource = 'a.svg'\nwidth_mm = 40\n[canvas]\nscene = 'plane_table'\n";

/// [`Desk::refuses`] for `calamus run s.toml`.
fn bad(scenario: &str, files: &[(&str, &str)], expected: &[&str]) {
    let desk = Desk::new(&[&[("s.toml", scenario), ("a.svg", SVG)], files].concat());
    desk.refuses(&["run", "s.toml"], expected);
}

/// A scene around a mesh file, and a scenario that draws on it.
const ON_MESH: &str = "[drawing]\nsource = 'a.svg'\nwidth_mm = 40\n[canvas]\nscene = 'scene.toml'\n";
const MESH_SCENE: &str = "name = 'mesh'\n[canvas]\nshape = 'mesh'\nmesh = 'm.obj'\n\
    pose = { xyz_mm = [600, 0, 300] }\n[sheet]\nxyz_mm = [600, 0, 400]\nnormal = [0, 0, 1]\nup = [1, 0, 0]\n";

#[test]
fn unknown_key() {
    bad(
        &format!("{RIGHT}[pen]\npres_depth_mm = 3\n"),
        &[],
        &["s.toml:7: ", "`pres_depth_mm`", "did you mean `press_depth_mm`?"],
    );
}

#[test]
fn negative_size() {
    bad(
        "[drawing]\nsource = 'a.svg'\nheight_mm = -180\n[canvas]\nscene = 'plane_table'\n",
        &[],
        &["s.toml:3: ", "-180"],
    );
}

#[test]
fn broken_toml() {
    bad("[drawing\nsource = 'a.svg'\n", &[], &["s.toml:1: "]);
}

#[test]
fn missing_drawing() {
    bad(&RIGHT.replace("a.svg", "b.svg"), &[], &["s.toml:2: ", "b.svg"]);
}

#[test]
fn broken_svg() {
    bad(RIGHT, &[("a.svg", "<svg xmlns='http://www.w3.org/2000/svg'\n><path d='M0 0'</svg>")], &["a.svg:2: "]);
}

#[test]
fn svg_without_strokes() {
    bad(RIGHT, &[("a.svg", "<svg xmlns='http://www.w3.org/2000/svg' width='9' height='9'><g/></svg>")], &["a.svg"]);
}

#[test]
fn missing_scene() {
    bad(&RIGHT.replace("plane_table", "plane_tabel"), &[], &["s.toml:5: ", "did you mean `plane_table`?"]);
}

#[test]
fn missing_mesh() {
    bad(ON_MESH, &[("scene.toml", MESH_SCENE)], &["m.obj"]);
}

#[test]
fn mesh_with_nan() {
    bad(ON_MESH, &[("scene.toml", MESH_SCENE), ("m.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n")], &["m.obj"]);
}

#[test]
fn mesh_without_triangles() {
    bad(ON_MESH, &[("scene.toml", MESH_SCENE), ("m.obj", "v 0 0 0\nv 1 0 0\n")], &["m.obj"]);
}

#[test]
fn canvas_out_of_reach() {
    let mesh = "v -0.5 -0.5 0\nv 0.5 -0.5 0\nv 0.5 0.5 0\nv -0.5 0.5 0\nf 1 2 3\nf 1 3 4\n";
    let far = MESH_SCENE.replace("600", "6000");
    bad(ON_MESH, &[("scene.toml", &far), ("m.obj", mesh)], &["reach"]);
}

/// A robot of one joint, and its URDF with a hole for what is wrong in a test.
const LAME: &str = "name = 'lame'\n[[arm]]\nurdf = 'lame.urdf'\nbase_link = 'a'\nflange_link = 'b'\n\
    pose = { xyz_mm = [0, 0, 300] }\nhome_deg = [0]\nservice_deg = [0]\n";
const LAME_URDF: &str = r#"<robot name="lame"><link name="a"/>
<link name="b">HOLE</link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="10" velocity="1"/></joint></robot>"#;

#[test]
fn urdf_without_inertial() {
    let files = [("robots/lame.toml", LAME), ("robots/lame.urdf", &LAME_URDF.replace("HOLE", ""))];
    bad(&format!("robot = 'lame'\n{RIGHT}"), &files, &["lame.urdf:2: ", "inertial"]);
}

#[test]
fn urdf_without_its_mesh() {
    let urdf = LAME_URDF.replace("HOLE", r#"<visual><geometry><mesh filename="none.obj"/></geometry></visual>"#);
    let files = [("robots/lame.toml", LAME), ("robots/lame.urdf", &urdf)];
    bad(&format!("robot = 'lame'\n{RIGHT}"), &files, &["lame.urdf:2: ", "none.obj"]);
}

#[test]
fn output_folder_in_the_way() {
    let desk = Desk::new(&[("s.toml", RIGHT), ("a.svg", SVG), ("file", "")]);
    desk.refuses(&["run", "s.toml", "--out", "file/out"], &["file", "can't be written"]);
}

#[test]
fn unknown_override() {
    let desk = Desk::new(&[("s.toml", RIGHT), ("a.svg", SVG)]);
    desk.refuses(
        &["run", "s.toml", "--set", "control.sped_mm_s=3"],
        &["--set control.sped_mm_s=3: ", "did you mean `speed_mm_s`?"],
    );
}

#[test]
fn missing_scenario() {
    Desk::new(&[]).refuses(&["run", "none.toml"], &["none.toml"]);
    Desk::new(&[]).refuses(&["run", "first_ligt"], &["did you mean `first_light`?"]);
}

#[test]
fn unknown_flag() {
    Desk::new(&[]).refuses(&["run", "x.toml", "--sed", "3"], &["--sed", "calamus --help"]);
    Desk::new(&[]).refuses(&["run"], &["<SCENARIO>", "calamus --help"]);
}

#[test]
fn check_prints_a_scenario_that_checks_to_itself() {
    let desk = Desk::new(&[("s.toml", RIGHT), ("a.svg", SVG)]);
    let first = desk.does(&["check", "s.toml", "--set", "control.speed_mm_s=25"]);
    assert!(first.contains("speed_mm_s = 25"));
    fs::write(desk.folder.path().join("t.toml"), &first).unwrap();
    assert_eq!(desk.does(&["check", "t.toml"]), first);
}

#[test]
fn the_schema_is_json() {
    let schema: serde_json::Value = serde_json::from_str(&Desk::new(&[]).does(&["check", "--schema"])).unwrap();
    assert!(schema["properties"]["drawing"].is_object());
}

#[test]
fn lists_name_what_comes_with_the_program() {
    let desk = Desk::new(&[]);
    for (kind, name) in
        [("scenarios", "first_light"), ("scenes", "hemisphere"), ("pens", "fineliner_08"), ("robots", "iiwa_fixed")]
    {
        assert!(desk.does(&["list", kind]).lines().any(|l| l.starts_with(&format!("{name} "))), "{kind}");
    }
}

#[test]
fn every_scenario_that_comes_with_the_program_checks() {
    let desk = Desk::new(&[]);
    for line in desk.does(&["list", "scenarios"]).lines() {
        desk.does(&["check", line.split_whitespace().next().unwrap()]);
    }
}

#[test]
fn a_drawing_file_draws_to_an_svg() {
    let desk = Desk::new(&[("a.svg", SVG)]);
    let told = desk.does(&["draw", "a.svg", "--set", "drawing.width_mm=80", "--out", "here"]);
    assert!(told.contains("1 stroke"), "{told}");
    assert!(desk.folder.path().join("here/wished.svg").exists());
}

#[test]
fn reach_is_the_same_again_and_on_one_thread_and_gives_a_scenario() {
    let desk = Desk::new(&[(
        "a.svg",
        "<svg xmlns='http://www.w3.org/2000/svg' width='60mm' height='40mm'><path d='M5 5L55 35' stroke='#000' fill='none'/></svg>",
    )]);
    let reach = |out: &str, threads: &str| {
        let args =
            ["reach", "ur5e_fixed", "--spacing-mm", "100", "--drawing", "a.svg", "-o", out, "--threads", threads];
        assert!(desk.does(&args).contains("canvas "));
        let files = ["reach-ur5e.npy", "reach.json", "reach.svg", "canvas.toml", "scenario.toml"];
        files.map(|f| fs::read(desk.folder.path().join(out).join(f)).unwrap_or_else(|e| panic!("{f}: {e}")))
    };
    let first = reach("one", "1");
    assert_eq!(first, reach("one", "2"), "from the cache");
    assert_eq!(first, reach("two", "2"), "made anew");
    let json: serde_json::Value = serde_json::from_slice(&first[1]).unwrap();
    let (width, height) = (json["canvas"]["width_mm"].as_f64().unwrap(), json["canvas"]["height_mm"].as_f64().unwrap());
    assert!(height >= 200.0 && (width / height - 1.5).abs() < 1e-6, "{width} x {height}");
    desk.does(&["check", "one/scenario.toml"]);
}

#[test]
fn a_canvas_that_no_arm_reaches_is_refused() {
    let dual = ["reach", "dual_ur5e", "--spacing-mm", "200"];
    let desk = Desk::new(&[]);
    desk.refuses(
        &[&dual[..], &["--depth-mm", "2000:3000"]].concat(),
        &["left and right", "left reaches", "right reaches"],
    );
    desk.refuses(&[&dual[..], &["--arm", "middle"]].concat(), &["middle", "left, right"]);
    desk.refuses(&[&dual[..], &["--axis", "0,0,0"]].concat(), &["no direction"]);
    desk.refuses(&["reach", "dual_ur5e", "--depth-mm", "800:400"], &["800", "400"]);
    desk.refuses(&["reach", "dual_ur5e", "--spacing-mm", "0"], &["0 mm"]);
}

/// A small square on a table, drawn in seconds of the robot's time.
const SMALL: &str = "[drawing]\nwidth_mm = 10\n[drawing.pattern]\nkind = 'grid'\nn = 1\n[canvas]\nscene = 'plane_table'\n\
    [control]\nspeed_mm_s = 60\n[render]\ndrawing_px = 200\nviews = []\n[sim]\nplant = 'articulated'\n";

/// [`SMALL`] with these settings ends with exit code `code`, and one line on standard error that has all of `expected`.
fn ends(code: i32, more: &[&str], expected: &[&str]) {
    let desk = Desk::new(&[("s.toml", SMALL)]);
    let output = desk.run(&[&["run", "s.toml", "-q", "--threads", "1", "--out", "o"][..], more].concat());
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{more:?}: {told}");
    assert_eq!(told.lines().count(), usize::from(!expected.is_empty()), "{more:?}: {told}");
    for part in expected {
        assert!(told.contains(part), "{more:?}: {told} should have {part}");
    }
    // what was drawn is kept in any case
    for file in ["metrics.json", "drawing.png", "report.html", "record.mcap"] {
        assert!(desk.folder.path().join("o").join(file).exists(), "{more:?}: {file}");
    }
}

#[test]
fn a_failure_never_looks_like_success() {
    ends(0, &[], &[]);
    ends(
        1,
        &["--set", "control.delay_ms=50"],
        &["error: ", "sim.saturated_fraction", "control.delay_ms", "50 ms late"],
    );
    ends(
        1,
        &["--set", "control.torque_noise_nm=100"],
        &["contact.force_max_n", "noise of 100 N m", "control.torque_noise_nm"],
    );
    // through the arm
    let through = ["--set", "truth.offset_mm=[-600, 0, 300]"];
    ends(1, &through, &["no ink came onto the canvas", "the canvas lies 670.8 mm from where the robot believes"]);
    // nothing is no part
    ends(1, &[&through[..], &["--partial"]].concat(), &["no ink came onto the canvas"]);
    ends(1, &["--set", "control.landing_speed_mm_s=25"], &["contact.force_max_n", "lands at up to 25 mm/s"]);
    let sticky = ["--set", "change.robot.arm.0.friction_rejection=0", "--set", "control.stiffness_n_m=[100, 100, 100]"];
    ends(1, &sticky, &["line.coverage", "friction of 0.32 N m in joint A1", "100 N/m", "friction_rejection"]);
    ends(
        1,
        &["--set", "pen.press_depth_mm=14"],
        &["contact.force_mean_n is 4.8", "press_depth_mm = 14 asks for 4.9 N", "takes 4.0 N"],
    );
}

#[test]
fn who_says_so_is_content_with_less() {
    let aside = ["--set", "truth.offset_mm=[0, 7, 0]"];
    ends(1, &aside, &["error: ", "line.stroke_error_max_mm is 7.0", "the canvas lies 7.0 mm"]);
    ends(0, &[&aside[..], &["--partial"]].concat(), &["note: ", "line.stroke_error_max_mm is 7.0"]);
    let bound = ["--set", "accept.\"line.stroke_error_max_mm\".max=8", "--set", "accept.\"line.coverage\".min=0.1"];
    let tip = ["--set", "accept.\"line.tip_error_max_mm\".max=8"];
    ends(0, &[&aside[..], &bound, &tip].concat(), &[]);
    // a part is judged, too, and a bound that it keeps goes for it
    let part = ["--only", "strokes=1"];
    ends(1, &[&aside[..], &part].concat(), &["line.stroke_error_max_mm"]);
    ends(0, &[&aside[..], &part, &bound].concat(), &[]);
}

#[test]
fn old_and_new_never_mix_in_a_folder() {
    let desk = Desk::new(&[("s.toml", SMALL), ("o/mine.txt", "mine"), ("o/.calamus-4294967295-x.png", "half")]);
    let metrics = |file: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(desk.folder.path().join(file)).unwrap()).unwrap()
    };
    let there = |file: &str| desk.folder.path().join("o").join(file).exists();
    desk.does(&["draw", "s.toml", "-q", "--out", "o"]);
    assert!(!there(".calamus-4294967295-x.png") || !Path::new("/proc").is_dir());
    desk.does(&["run", "s.toml", "-q", "--out", "o", "--set", "render.drawing_px=100"]);
    assert!(metrics("o/metrics.json")["line"].is_object() && metrics("o/draw/metrics.json")["line"].is_null());
    let whole = fs::read(desk.folder.path().join("o/metrics.json")).unwrap();
    let told = desk.does(&["draw", "s.toml", "--out", "o"]);
    assert!(told.contains("o/draw: "), "{told}");
    desk.does(&["plan", "s.toml", "-q", "--out", "o"]);
    assert_eq!(fs::read(desk.folder.path().join("o/metrics.json")).unwrap(), whole);
    assert!(there("draw/preview.png") && there("plan/plan.json") && there("drawing.png"));
    // a run that is killed leaves nothing of the one before, and no file of anyone else is touched
    let mut command = Command::new(env!("CARGO_BIN_EXE_calamus"));
    command.args(["run", "s.toml", "-q", "--out", "o", "--set", "drawing.width_mm=100", "--threads", "1"]);
    let mut child = command.current_dir(desk.folder.path()).spawn().unwrap();
    while there("metrics.json") && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!there("drawing.png") || metrics("o/metrics.json")["drawing"]["length_m"].as_f64() > Some(0.3));
    assert!(there("mine.txt"));
}

#[test]
fn nothing_typed_is_no_mistake() {
    let output = Desk::new(&[]).run(&[]);
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert!(told.contains("Usage: calamus") && told.contains("run") && !told.contains("error:"), "{told}");
}

#[test]
fn a_path_that_is_typed_may_start_here() {
    let there = "[drawing]\nsource = 'a.svg'\nwidth_mm = 40\n[canvas]\nscene = 'plane_table'\n";
    let other = SVG.replace("M5 5", "M9 9");
    let desk = Desk::new(&[("far/s.toml", there), ("far/a.svg", SVG), ("a.svg", &other), ("b.svg", &other)]);
    let source = |set: &str| {
        let told = desk.does(&["check", "far/s.toml", "--set", set]);
        told.lines().find(|l| l.starts_with("source")).unwrap().to_string()
    };
    assert!(source("drawing.source=b.svg").ends_with("/b.svg\"") && !source("drawing.source=b.svg").contains("far"));
    // the scenario's folder comes first
    assert!(source("drawing.source=a.svg").ends_with("/far/a.svg\""));
    desk.refuses(&["run", "far/s.toml", "--set", "drawing.source=c.svg"], &["no file far/c.svg; no file ./c.svg"]);
    // in a file a path starts at the file
    desk.refuses(&["check", "far/t.toml"], &["far/t.toml"]);
}

#[test]
fn names_from_files_can_do_no_harm() {
    let svg = "<svg xmlns='http://www.w3.org/2000/svg' xmlns:inkscape='http://www.inkscape.org/namespaces/inkscape' width='40mm' \
        height='40mm' viewBox='0 0 40 40'><g inkscape:groupmode='layer' inkscape:label='a&#x9b;2J&#x202e;b'>\
        <path d='M5 5 L35 5' fill='none' stroke='black'/></g></svg>";
    let desk = Desk::new(&[("a.svg", svg), ("s.toml", &format!("name = \"x\\u001b[31m\"\n{RIGHT}"))]);
    let output = desk.run(&["draw", "s.toml", "--out", "o"]);
    let told = [output.stdout, output.stderr].concat();
    let told = String::from_utf8(told).unwrap();
    assert!(told.contains("x\\u001b[31m"), "{told}");
    assert!(!told.contains(|c: char| c.is_control() && c != '\n'), "{told:?}");
    let metrics = fs::read_to_string(desk.folder.path().join("o/metrics.json")).unwrap();
    assert!(metrics.contains("a\\\\u009b2J\\\\u202eb"), "{metrics}");
    let missing = desk.run(&["draw", "no\u{1b}[2J.svg"]);
    let told = String::from_utf8(missing.stderr).unwrap();
    assert!(told.contains("no\\u001b[2J.svg") && !told.contains('\u{1b}'), "{told:?}");
}

#[test]
fn a_number_of_309_digits_is_told_in_few() {
    let desk = Desk::new(&[("s.toml", SMALL)]);
    desk.refuses(&["run", "s.toml", "--set", "control.speed_mm_s=1e308"], &["must be from 0.1 to 1000, not 1e308"]);
}

/// Ctrl-C ends `args` once `begun` is there, with exit code 130 and the command that goes on.
#[cfg(unix)]
fn interrupted(desk: &Desk, args: &[&str], begun: &str) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calamus"));
    let piped = std::process::Stdio::piped();
    let child = command.args(args).current_dir(desk.folder.path()).stderr(piped).spawn().unwrap();
    let begun = desk.folder.path().join(begun);
    for _ in 0..5000 {
        if begun.exists() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{told}");
    let typed = format!("calamus {} --resume", args.join(" "));
    assert!(told.contains("go on with: ") && told.trim_end().ends_with(&typed), "{told}");
}

#[test]
#[cfg(unix)]
fn ctrl_c_says_how_to_go_on() {
    let experiment = "scenario = 's.toml'\ntrials = 200\n";
    let desk = Desk::new(&[("s.toml", SMALL), ("e.toml", experiment)]);
    let large = "drawing.pattern.n=20";
    let run = ["run", "s.toml", "-q", "--out", "o", "--set", "drawing.width_mm=150", "--set", large, "--threads", "1"];
    interrupted(&desk, &run, "o/journal/run.key");
    interrupted(&desk, &["experiment", "e.toml", "-q", "--out", "e", "--threads", "1"], "e/trials.jsonl");
}
