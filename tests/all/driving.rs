//! An arm on a base that drives: what it draws from place to place, how the pieces meet, and what it refuses.
use std::path::Path;
use std::process::Command;

use calamus::measure::Metrics;
use calamus::progress::Silent;
use calamus::run::{Cache, evaluate};
use calamus::scenario::{Override, Scenario};

/// A grid on a flat wall whose three level lines are cut where two places meet.
const SEAMS: &str = "robot = 'iiwa_ridgeback'\n[drawing]\nwidth_mm = 120\n[drawing.pattern]\nkind = 'grid'\nn = 2\n\
    [canvas]\nscene = 'wall_flat'\n[coverage]\nposes = [[2150, 200, 0], [2150, -200, 0]]\nborders_mm = [2100]\n\
    [render]\ndrawing_px = 300\nviews = []\n";

fn scenario(sets: &[&str]) -> Scenario {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/seams.toml");
    let sets: Vec<Override> = sets.iter().map(|s| s.parse().unwrap()).collect();
    Scenario::parse(SEAMS, &file, &sets).unwrap()
}

fn figures(sets: &[&str]) -> Metrics {
    evaluate(&scenario(sets), &Cache::default(), &Silent).unwrap()
}

#[test]
fn pieces_drawn_from_two_places_meet() {
    let m = figures(&[]);
    let (line, seam, base) = (m.line.unwrap(), m.seam.unwrap(), m.base.unwrap());
    assert_eq!((seam.cuts, base.places), (3, 2));
    assert!(line.error_mean_mm < Some(0.05) && line.error_p95_mm < Some(0.15), "{line:?}");
    assert!(line.coverage > Some(0.999) && line.excess == Some(0.0), "{line:?}");
    assert!(seam.step_p95_mm < Some(0.1) && seam.lost_mm == Some(0.0) && seam.doubled_mm == Some(0.0), "{seam:?}");
    assert!(base.pose_error_mm < Some(1e-6) && base.creep_mm < Some(0.02), "{base:?}");
    // a way of over two metres to the first place, and 0.4 m on
    assert!(base.drive_m > 2.4 && base.drive_m < 2.8 && base.drive_s > 10.0, "{base:?}");
    // it gives way under its arm
    assert!(base.sway_peak_mm > Some(0.02), "{base:?}");
}

#[test]
fn a_base_that_knows_its_place_badly_draws_there_and_the_figures_say_so() {
    let m = figures(&["localisation.sensor=\"board\"", "localisation.mounting_mm=1.5"]);
    let (line, base) = (m.line.unwrap(), m.base.unwrap());
    assert!(base.pose_error_mm > Some(0.2), "{base:?}");
    assert!(line.error_mean_mm > Some(0.05), "{line:?} {base:?}");
}

/// A tracker that errs by millimetres, and lines that lean, so that it shows at their cuts. The quicker plant, for that is about
/// what is seen.
const TRACKED: [&str; 4] =
    ["localisation.sensor=\"tracker\"", "drawing.rotate_deg=30", "seed=2", "sim.plant=\"articulated\""];

#[test]
fn what_was_drawn_before_a_place_that_cant_be_planned_is_kept_and_the_failure_told() {
    let folder = tempfile::tempdir().unwrap();
    // the second place is too far from the wall, and nobody looked
    let far = SEAMS.replace("[2150, -200, 0]]", "[1750, -200, 0]]\nverify = false");
    std::fs::write(folder.path().join("s.toml"), far).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_calamus"));
    let out = command.args(["run", "s.toml", "-q", "--out", "o"]).current_dir(folder.path()).output().unwrap();
    let told = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(1), "{told}");
    assert!(told.contains("can't go on") && told.contains("out of reach by"), "{told}");
    let text = std::fs::read_to_string(folder.path().join("o/metrics.json")).unwrap();
    let line = serde_json::from_str::<Metrics>(&text).unwrap().line.unwrap();
    assert!(line.coverage > Some(0.3) && line.coverage < Some(0.7), "{line:?}");
}

#[test]
fn a_base_that_looks_and_feels_meets_what_it_has_drawn() {
    let without = figures(&TRACKED);
    let with = figures(&[&TRACKED[..], &["looking.distance_mm=300"]].concat());
    let (far, near) = (without.seam.unwrap(), with.seam.unwrap());
    assert!(near.missing == 0 && near.step_p95_mm < Some(0.2), "{near:?}");
    assert!(far.missing > 0 || near.step_p95_mm.unwrap() < 0.25 * far.step_p95_mm.unwrap(), "{far:?} {near:?}");
    // the pen is on the wall all the while
    assert!(with.contact.unwrap().contact_fraction > Some(0.999));
    let look = with.look.unwrap();
    // it looks back at the first place, and at what it drew there from the second; it feels both
    assert_eq!((look.pictures, look.refused, look.felt), (2, 0, 6), "{look:?}");
    assert!(look.correction_p50_mm > Some(0.5) && look.rms_px < Some(1.0), "{look:?}");
    assert!(without.look.is_none());
    // printed marks tell where on the sheet all that lies, as well as the camera is calibrated
    let marks = "looking.marks_mm=[[-80, 30], [-80, -30]]";
    let printed = figures(&[&TRACKED[..], &[marks]].concat());
    let (aside, on) = (with.base.unwrap().pose_error_mm, printed.base.unwrap().pose_error_mm);
    assert!(aside > Some(2.0) && on < Some(1.2), "{aside:?} {on:?}");
    assert!(printed.line.unwrap().coverage > Some(0.99) && printed.seam.unwrap().step_p95_mm < Some(0.2));
}

#[test]
fn a_picture_without_lines_leaves_the_belief_as_it_was() {
    // in the dark there is nothing but noise
    let sets = ["looking.noise_percent=50", "looking.feel=false", "looking.look_back=false", "drawing.rotate_deg=30"];
    let m = figures(&sets);
    let look = m.look.unwrap();
    assert_eq!((look.pictures, look.refused, look.felt, look.correction_max_mm), (1, 1, 0, Some(0.0)), "{look:?}");
    assert!(m.base.unwrap().pose_error_mm < Some(1e-6));
}

/// The task under way that a journal has kept last.
fn latest_task(journal: &Path) -> Vec<u8> {
    let files = ["arm0.task.0", "arm0.task.1"].map(|name| journal.join(name));
    let latest = files.iter().max_by_key(|file| file.metadata().and_then(|m| m.modified()).ok());
    latest.and_then(|file| std::fs::read(file).ok()).unwrap_or_default()
}

/// Kills a run of a scenario `kills` times, each time when the task it keeps is due by `due`, and goes on; the same run as of one
/// thread without a kill.
fn killed_and_resumed(text: &str, kills: usize, due: impl Fn(&[u8]) -> bool) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), text).unwrap();
    let start = |out: &str, more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_calamus"));
        command.args(["run", "s.toml", "-q", "--keep-every-ms", "100", "--out", out]).args(more);
        command.current_dir(folder.path()).spawn().unwrap()
    };
    let digest = |out: &str| {
        let text = std::fs::read_to_string(folder.path().join(out).join("metrics.json")).unwrap();
        let m: Metrics = serde_json::from_str(&text).unwrap();
        m.digest.unwrap()
    };
    assert!(start("one", &["--threads", "1"]).wait().unwrap().success());
    let mut killed = 0;
    loop {
        let more: &[&str] = if folder.path().join("two/journal/run.key").exists() { &["--resume"] } else { &[] };
        let mut child = start("two", &[&["--threads", "2"], more].concat());
        let state = folder.path().join("two/journal/arm0.state");
        let kept = |state: &Path| state.metadata().and_then(|m| m.modified()).ok();
        let mut before = kept(&state);
        let ended = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break Some(status);
            }
            let now = kept(&state);
            if killed < kills && now != before {
                before = now;
                if due(&latest_task(&folder.path().join("two/journal"))) {
                    break None;
                }
            }
            std::thread::sleep(std::time::Duration::from_millis(5));
        };
        if let Some(status) = ended {
            assert!(status.success());
            break;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        killed += 1;
    }
    assert_eq!(killed, kills, "it was over before it was killed");
    assert_eq!(digest("one"), digest("two"));
    let picture = |out: &str| std::fs::read(folder.path().join(out).join("drawing.png")).unwrap();
    assert!(picture("one") == picture("two"));
}

#[test]
fn a_drive_is_the_same_at_any_number_of_threads_and_after_a_kill() {
    // killed on its way to the first place, and once more while it draws
    killed_and_resumed(&SEAMS.replace("width_mm = 120", "width_mm = 60"), 2, |_| true);
}

#[test]
fn a_look_is_the_same_at_any_number_of_threads_and_after_a_kill() {
    // a time that stands in the task under way only while it looks
    let settle = 30.078125f64;
    let looking =
        format!("[looking]\nsettle_s = {settle}\n[localisation]\nsensor = 'tracker'\n[sim]\nplant = 'articulated'\n");
    let looks = |task: &[u8]| task.windows(8).any(|w| w == settle.to_le_bytes());
    killed_and_resumed(&(SEAMS.to_string() + &looking), 2, looks);
}

#[test]
fn what_cant_be_is_refused_before_anything_moves() {
    let say = |sets: &[&str]| evaluate(&scenario(sets), &Cache::default(), &Silent).unwrap_err().to_string();
    assert!(say(&["robot=\"iiwa_fixed\""]).contains("has no base: take robot = \"iiwa_ridgeback\""));
    assert!(say(&["canvas.belief=\"touch\""]).contains("doesn't go with a base that drives"));
    assert!(say(&["canvas.scene=\"plane_table\""]).contains("the canvas must be an extrusion"));
    assert!(say(&["coverage.poses=[[2900, 200, 0], [2150, -200, 0]]"]).contains("meets the wall"));
    let far = say(&["coverage.poses=[[1000, 200, 0], [2150, -200, 0]]"]);
    assert!(far.contains("can't be drawn") || far.contains("reaches"), "{far}");
}
