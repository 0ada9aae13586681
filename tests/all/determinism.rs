//! The same seed gives the same bits, at any number of threads.
use std::fs;
use std::path::Path;
use std::process::Command;

/// Two inks, a curve, a dot and a crossing.
const SVG: &str = r#"<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="60mm" viewBox="0 0 60 60" fill="none">
<path d="M10 10 C 40 0 50 30 30 50" stroke="black"/><path d="M10 40 L50 20" stroke="black"/>
<path d="M20 20 h20 v20 h-20 z" stroke="red"/></svg>"#;
const SCENARIO: &str = "[drawing]\nsource = 'a.svg'\nheight_mm = 60\n[canvas]\nscene = 'hemisphere'\n[pen]\nchange_s = 1\n\
    [control]\ntorque_noise_nm = 0.05\ndelay_ms = 1\n[render]\ndrawing_px = 600\nviews = []\n";

/// Runs the scenario into `out`; returns the digest.
fn run(folder: &Path, out: &str, extra: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calamus"));
    let output = command.args(["run", "s.toml", "-q", "--out", out]).args(extra).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metrics = fs::read_to_string(folder.join(out).join("metrics.json")).unwrap();
    let metrics: serde_json::Value = serde_json::from_str(&metrics).unwrap();
    metrics["digest"].as_str().unwrap().to_string()
}

#[test]
fn same_seed_same_bits_at_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("s.toml"), SCENARIO).unwrap();
    fs::write(folder.path().join("a.svg"), SVG).unwrap();
    let first = run(folder.path(), "first", &["--threads", "1"]);
    assert_eq!(run(folder.path(), "again", &["--threads", "1"]), first);
    assert_eq!(run(folder.path(), "two", &["--threads", "2"]), first);
    for file in ["drawing.png", "drawing.svg", "plan.json", "plan-arm0.npy", "record.mcap", "scenario.toml"] {
        let whole = fs::read(folder.path().join("first").join(file)).unwrap();
        for other in ["again", "two"] {
            assert!(fs::read(folder.path().join(other).join(file)).unwrap() == whole, "{other}/{file} differs");
        }
    }
    // and the seed is heard: sensor noise of another seed is another drawing
    assert_ne!(run(folder.path(), "other", &["--set", "seed=2"]), first);
}
