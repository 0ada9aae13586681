use std::path::{Path, PathBuf};

use proptest::prelude::*;

use super::*;

/// A folder with one of each asset, and a scenario text that uses them.
struct House(tempfile::TempDir);

impl House {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let files =
            ["robots/iiwa_fixed.toml", "pens/fineliner_08.toml", "pens/marker.toml", "scenes/dome.toml", "a.svg"];
        for file in files {
            let file = dir.path().join(file);
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            std::fs::write(file, "").unwrap();
        }
        Self(dir)
    }
    fn file(&self) -> PathBuf {
        self.0.path().join("s.toml")
    }
    fn parse(&self, text: &str, sets: &[&str]) -> Result<Scenario, ScenarioError> {
        let sets: Vec<Override> = sets.iter().map(|s| s.parse().unwrap()).collect();
        Scenario::parse(text, &self.file(), &sets)
    }
    /// The error without the folder's name.
    fn error(&self, text: &str, sets: &[&str]) -> String {
        let error = self.parse(text, sets).unwrap_err().to_string();
        error.replace(&format!("{}/", self.0.path().display()), "")
    }
}

const SHORT: &str = "[drawing]\nsource = 'a.svg'\nheight_mm = 180\n[canvas]\nscene = 'dome'\n";

#[test]
fn a_short_scenario_is_filled_in() {
    let house = House::new();
    let s = house.parse(SHORT, &[]).unwrap();
    assert_eq!((s.name.as_str(), s.seed), ("s", 1));
    assert_eq!(s.drawing.height_mm, Some(180.0));
    assert!(s.robot.is_absolute() && s.robot.ends_with("robots/iiwa_fixed.toml"));
    assert_eq!(s.control, ControlSettings::default());
}

#[test]
fn the_resolved_file_gives_the_same_scenario_anywhere() {
    let house = House::new();
    let text = format!(
        "name = 'a \"name\"'\nseed = 7\n{SHORT}offset_mm = [1, -2.5]\n[pen.inks]\n'#AABBCC' = 'marker'\nsky = 'marker'\n\
         [render]\nviews = ['top']\n[[render.camera]]\nname = 'above'\neye_mm = [0, 0, 900]\ntarget_mm = [600, 0, 0]\n\
         [accept]\n'line.error_mean_mm' = {{ max = 0.2 }}\n"
    );
    let first = house.parse(&text, &["control.speed_mm_s=33.3"]).unwrap();
    let toml = first.to_toml().unwrap();
    let again = Scenario::parse(&toml, Path::new("/somewhere/else.toml"), &[]).unwrap();
    assert_eq!(first, again, "{toml}");
    assert_eq!(again.to_toml().unwrap(), toml);
    assert!(first.pen.inks.contains_key("#aabbcc"));
}

#[test]
fn mistakes_name_their_line_and_what_would_be_right() {
    let house = House::new();
    for (extra, expected) in [
        ("[pen]\npres_depth_mm = 3\n", "s.toml:7: unknown key `pres_depth_mm`: did you mean `press_depth_mm`?"),
        ("mapping = 'conforml'\n", "s.toml:6: unknown value `conforml`: did you mean `conformal`?"),
        ("[canvas.conformal]\nmargin_mm = -1\n", "s.toml:7: `margin_mm` must be from 0 to 10000, not -1"),
        ("[control]\nspeed_mm_s = -4\n", "s.toml:7: `speed_mm_s` must be from 0.1 to 1000, not -4"),
        ("[control]\ndelay_ms = nan\n", "s.toml:7: `delay_ms` must be a finite number, not NaN"),
        ("[pen]\nkind = 'markr'\n", "s.toml:7: no pen `markr`: did you mean `marker`?"),
        ("[render]\nviews = ['heroo']\n", "s.toml:7: no view `heroo`: did you mean `hero`?"),
        (
            "[accept]\n'line.eror_mean_mm' = { max = 1 }\n",
            "s.toml:7: no metric `line.eror_mean_mm`: did you mean `line.error_mean_mm`?",
        ),
        (
            "[drawing.pattern]\nkind = 'grid'\n",
            "s.toml:2: `source` and `[drawing.pattern]` exclude each other: keep one",
        ),
        ("[sim]\nrecord_hz = inf\n", "s.toml:7: `record_hz` must be a finite number, not inf"),
        (
            "[drive]\nacceleration_mm_s2 = 1e-12\n",
            "s.toml:7: `acceleration_mm_s2` must be from 1 to 10000, not 0.000000000001",
        ),
        ("[coverage]\nposes = [[0, 0, 0], [0, 0, 400]]\n", "s.toml:7: `poses` must be from -360 to 360, not 400"),
        ("[coverage]\nmount_mm = [0, 0, -1]\n", "s.toml:7: `mount_mm` must be from 0 to 3000, not -1"),
        ("[localisation]\nreadings = 0\n", "s.toml:7: `readings` must be from 1 to 1000000, not 0"),
        (
            "[[render.camera]]\nname = 'a'\neye_mm = [0, 0, 9]\ntarget_mm = [0, 0, 0]\n\
             [[render.camera]]\nname = 'b'\neye_mm = [0, 0, 9]\ntarget_mm = [0, 0, 0]\nfov_deg = 400\n",
            "s.toml:14: `fov_deg` must be from 1 to 120, not 400",
        ),
        ("[accept]\n'sim.steps' = { min = 1, max = nan }\n", "s.toml:7: `max` must be a finite number, not NaN"),
    ] {
        assert_eq!(house.error(&format!("{SHORT}{extra}"), &[]), expected);
    }
    assert_eq!(
        house.error("[canvas]\nscene='dome'\n", &[]),
        "s.toml:1: `[drawing]` needs a `source` file or a `[drawing.pattern]`"
    );
    assert_eq!(house.error("[drawing]\nsource = 'b.svg'\n[canvas]\nscene='dome'\n", &[]), "s.toml:2: no file b.svg");
    assert_eq!(
        house.error("[drawing]\nheight_mm = -3\nsource = 'a.svg'\n", &[]),
        "s.toml:2: `height_mm` must be from 0.1 to 100000, not -3"
    );
    assert_eq!(
        house.error("[drawing.pattern]\nkind = 'arrowhead'\nn = 3\n[canvas]\nscene='dome'\n", &[]),
        "s.toml:3: `n` is for grids: this curve takes `order`"
    );
}

#[test]
fn overrides_change_the_scenario_and_own_their_mistakes() {
    let house = House::new();
    let s = house.parse(SHORT, &["drawing.pattern={kind='hilbert',order=3}", "pen.kind=marker"]).unwrap();
    assert_eq!(s.drawing.artwork, Artwork::Pattern(Pattern::Hilbert { order: 3, n: 0 }));
    assert!(s.pen.kind.ends_with("pens/marker.toml"));
    for (set, expected) in [
        ("control.sped_mm_s=3", "--set control.sped_mm_s=3: unknown key `sped_mm_s`: did you mean `speed_mm_s`?"),
        ("control.speed_mm_s=-3", "--set control.speed_mm_s=-3: `speed_mm_s` must be from 0.1 to 1000, not -3"),
        ("control={speed_mm_s=0}", "--set control={speed_mm_s=0}: `speed_mm_s` must be from 0.1 to 1000, not 0"),
        ("seed.x=1", "--set seed.x=1: invalid type: map, expected u64"),
    ] {
        assert_eq!(house.error(SHORT, &[set]), expected);
    }
}

#[test]
fn a_figure_outside_its_bounds_or_absent_is_unmet() {
    use crate::measure::{LineMetrics, Metrics};
    let house = House::new();
    let accept = "[accept]\n'line.error_mean_mm' = { max = 0.2 }\n'line.coverage' = { min = 0.995 }\n'sim.steps' = { min = 1 }\n";
    let s = house.parse(&format!("{SHORT}{accept}"), &[]).unwrap();
    let line = LineMetrics { error_mean_mm: Some(0.3), coverage: Some(0.999), ..LineMetrics::default() };
    let unmet = s.unmet(&Metrics { line: Some(line), ..Metrics::new("x", 1) });
    let unmet: Vec<String> = unmet.iter().map(ToString::to_string).collect();
    assert_eq!(
        unmet,
        ["line.error_mean_mm is 0.3: should be at most 0.2", "sim.steps was not measured: should be at least 1"]
    );
}

#[test]
fn the_schema_knows_every_section() {
    let schema = ScenarioFile::schema();
    for section in ["drawing", "canvas", "pen", "plan", "control", "sim", "render", "accept"] {
        assert!(schema["properties"][section].is_object(), "{section}");
    }
}

#[test]
fn defaults_are_in_their_ranges_and_every_number_is_bounded() {
    let schema = ScenarioFile::schema();
    let sections = "[truth]\n[scan.pose]\n[touch]\n[tools]\n[coverage]\n[drive]\n[localisation]\n[looking]\n[drawing.pattern]\nkind = 'grid'\n\
                    [drawing.color]\n[drawing.tsp]\n[drawing.stipple]\n[drawing.painterly]\n[drawing.layered_depth]\n\
                    [drawing.hatching]\n[drawing.edges]\n[canvas.overlay]\nmapping = 'conformal'\n";
    let all: ScenarioFile = toml::from_str(sections).unwrap();
    assert_eq!(ranges::first_outside(schema, &toml::Table::try_from(&all).unwrap()), None);
    // any seed is as good as another, and figures may be of any size
    assert_eq!(ranges::unbounded(schema), ["seed", "accept.*.min", "accept.*.max"]);
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused(text in "\\PC{0,200}") {
        let house = House::new();
        let _ = house.parse(&text, &[]);
    }

    #[test]
    fn a_mutated_scenario_is_read_or_refused_in_one_place(at in 0usize..400, cut in 0usize..4, put in "[\\PC\n]{0,4}") {
        let house = House::new();
        let whole = house.parse(SHORT, &[]).unwrap().to_toml().unwrap();
        let chars: Vec<char> = whole.chars().collect();
        let at = at * chars.len() / 400;
        let mutated: String =
            chars[..at].iter().copied().chain(put.chars()).chain(chars[(at + cut).min(chars.len())..].iter().copied()).collect();
        if let Ok(s) = house.parse(&mutated, &[]) {
            prop_assert!(s.control.speed_mm_s.is_finite() && s.control.speed_mm_s > 0.0);
            let again = house.parse(&s.to_toml().unwrap(), &[]).unwrap();
            prop_assert_eq!(s, again);
        }
    }

    #[test]
    fn any_override_is_taken_or_refused(text in "\\PC{0,60}") {
        let house = House::new();
        if let Ok(set) = text.parse::<Override>() {
            let _ = Scenario::parse(SHORT, &house.file(), &[set]);
        }
    }

    #[test]
    fn numbers_survive_the_round_trip(speed in 0.1..1000.0f64, depth in 0.0..50.0f64, seed in 0..i64::MAX as u64) {
        let house = House::new();
        let sets = [format!("control.speed_mm_s={speed:?}"), format!("pen.press_depth_mm={depth:?}"), format!("seed={seed}")];
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let s = house.parse(SHORT, &sets).unwrap();
        prop_assert_eq!((s.control.speed_mm_s, s.pen.press_depth_mm, s.seed), (speed, depth, seed));
        prop_assert_eq!(&house.parse(&s.to_toml().unwrap(), &[]).unwrap(), &s);
    }
}
