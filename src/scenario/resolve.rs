//! The scenario as it is meant: what the file says, with defaults, ranges and paths resolved.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::config::{self, ConfigError};
use crate::measure::MetricPath;
use crate::surface::MappingKind;

use super::assets::{AssetKind, Assets, existing};
use super::check::Check;
use super::file::{CanvasFile, DrawingFile, PatternFile, PatternKind, PenFile, ScenarioFile, Threshold};
use super::overrides::Override;
use super::settings::{BeliefKind, ControlSettings, Fill, PlanSettings, RenderSettings, SimSettings, VIEWS};

/// A scenario that can't be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScenarioError {
    /// The file is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A `--set` is wrong.
    #[error("--set {text}: {message}")]
    Override {
        /// As typed.
        text: String,
        /// What is wrong and what would be right.
        message: String,
    },
    /// The scenario can't be written as TOML.
    #[error("the scenario can't be written as TOML: {0}")]
    Unwritable(#[from] toml::ser::Error),
}

/// A generated drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// `n` x `n` squares.
    Grid {
        /// Squares a side.
        n: u32,
    },
    /// Hilbert's curve.
    Hilbert {
        /// Order; the curve has 4^order points.
        order: u32,
    },
    /// Sierpinski's arrowhead curve.
    Arrowhead {
        /// Order; the curve has 3^order sides.
        order: u32,
    },
    /// Koch's snowflake.
    Snowflake {
        /// Order; the curve has 3 * 4^order sides.
        order: u32,
    },
    /// A test target.
    Target,
}

/// Where the drawing comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Artwork {
    /// An `.svg`, `.jsonl` or `_k.txt` file; the path is absolute.
    File(PathBuf),
    /// A pattern.
    Pattern(Pattern),
}

/// What is drawn, and how large.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawingSpec {
    /// Where the drawing comes from.
    pub artwork: Artwork,
    /// Height, mm. Both: fit into; neither: its own size.
    pub height_mm: Option<f64>,
    /// Width, mm.
    pub width_mm: Option<f64>,
    /// Turn, counter-clockwise, degrees.
    pub rotate_deg: f64,
    /// What becomes of filled areas.
    pub fill: Fill,
    /// Distance between hatch lines, mm.
    pub hatch_spacing_mm: f64,
    /// Direction of hatch lines, degrees from the x axis.
    pub hatch_angle_deg: f64,
    /// Width of a stylus's line at no and at full pressure, mm; `None`: what the pen can draw.
    pub stylus_width_mm: Option<[f64; 2]>,
    /// Exponent of the pressure in that.
    pub stylus_gamma: f64,
    /// Merge and order strokes.
    pub tidy: bool,
    /// Joining distance, mm.
    pub merge_mm: f64,
    /// Simplification tolerance, mm.
    pub simplify_mm: f64,
}

/// What is drawn on.
#[derive(Clone, Debug, PartialEq)]
pub struct CanvasSpec {
    /// The scene's file; absolute.
    pub scene: PathBuf,
    /// How the sheet is laid on the canvas.
    pub mapping: MappingKind,
    /// What the robot knows of the canvas.
    pub belief: BeliefKind,
    /// Moves the drawing right and up on the sheet, mm.
    pub offset_mm: [f64; 2],
}

/// What is drawn with.
#[derive(Clone, Debug, PartialEq)]
pub struct PenSpec {
    /// The pen's file; absolute.
    pub kind: PathBuf,
    /// Press depth, mm.
    pub press_depth_mm: f64,
    /// Time of a pen change by hand, s.
    pub change_s: f64,
    /// Pens of some layers: by layer name or `#rrggbb` in lower case; absolute.
    pub inks: BTreeMap<String, PathBuf>,
}

/// A scenario without anything left to find out. It is written and read in the form of [`ScenarioFile`].
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(into = "ScenarioFile")]
pub struct Scenario {
    /// Name of the run.
    pub name: String,
    /// What the run shows.
    pub description: String,
    /// Seed of every random number of the run.
    pub seed: u64,
    /// The robot's file; absolute.
    pub robot: PathBuf,
    /// What is drawn, and how large.
    pub drawing: DrawingSpec,
    /// What is drawn on.
    pub canvas: CanvasSpec,
    /// What is drawn with.
    pub pen: PenSpec,
    /// How strokes become joint motion.
    pub plan: PlanSettings,
    /// The impedance law and the speed of the pen.
    pub control: ControlSettings,
    /// The plant and what is kept of it.
    pub sim: SimSettings,
    /// Pictures.
    pub render: RenderSettings,
    /// Bounds on figures of metrics.json, by dotted name.
    pub accept: BTreeMap<String, Threshold>,
}

impl Scenario {
    /// Reads a scenario file, applies the overrides in order, and resolves it. Paths are relative to the file.
    pub fn read(file: &Path, overrides: &[Override]) -> Result<Self, ScenarioError> {
        let text = std::fs::read_to_string(file)
            .map_err(|source| ConfigError::Unreadable { file: file.to_path_buf(), source })?;
        Self::parse(&text, file, overrides)
    }

    /// [`Scenario::read`] on text; `file` is named in errors, and its folder is where paths start.
    pub fn parse(text: &str, file: &Path, overrides: &[Override]) -> Result<Self, ScenarioError> {
        let mut typed: ScenarioFile = config::parse(text, file)?;
        let mut table: toml::Table = config::parse(text, file)?;
        for set in overrides {
            let wrong = |message: String| ScenarioError::Override { text: set.text.clone(), message };
            set.apply(&mut table).map_err(wrong)?;
            typed = ScenarioFile::deserialize(table.clone()).map_err(|e| wrong(config::explain(e.message())))?;
        }
        resolve(typed, &Check { text, file, overrides })
    }

    /// A scenario file that says everything: read again, it gives this scenario.
    pub fn to_toml(&self) -> Result<String, ScenarioError> {
        Ok(toml::to_string(&ScenarioFile::from(self.clone()))?)
    }
}

impl DrawingSpec {
    /// The drawing in a file, as a scenario with that `source` would have it; only `drawing.` keys can be overridden.
    pub fn of_file(file: &Path, overrides: &[Override]) -> Result<Self, ScenarioError> {
        let mut table = toml::Table::new();
        for set in overrides {
            let wrong = |message: String| ScenarioError::Override { text: set.text.clone(), message };
            if set.keys.first().is_none_or(|k| k != "drawing") {
                return Err(wrong("a drawing file has only `drawing.` keys".into()));
            }
            set.apply(&mut table).map_err(wrong)?;
            ScenarioFile::deserialize(table.clone()).map_err(|e| wrong(config::explain(e.message())))?;
        }
        let check = Check { text: "", file, overrides };
        let mut typed = ScenarioFile::deserialize(table).map_err(|e| check.sentence("drawing", e.message()))?.drawing;
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        typed.source.get_or_insert(name);
        resolve_drawing(typed, file.parent().unwrap_or(Path::new("")), &check)
    }
}

/// Fills in, checks and finds.
fn resolve(typed: ScenarioFile, check: &Check) -> Result<Scenario, ScenarioError> {
    let folder = check.file.parent().unwrap_or(Path::new("")).to_path_buf();
    let folder = if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder };
    let assets = Assets::seen_from(&folder);
    let asset = |key: &str, kind, text: &str| assets.find(kind, text, &folder).map_err(|e| check.sentence(key, e));

    let stem = || check.file.file_stem().map_or_else(|| "scenario".into(), |s| s.to_string_lossy().into_owned());
    let drawing = resolve_drawing(typed.drawing, &folder, check)?;
    let CanvasFile { scene, mapping, belief, offset_mm } = typed.canvas;
    let scene = scene.ok_or_else(|| check.sentence("canvas.scene", "`[canvas]` needs a `scene`, as \"hemisphere\""))?;
    for x in offset_mm {
        check.within("canvas.offset_mm", x, -10_000.0, 10_000.0)?;
    }
    let PenFile { kind, press_depth_mm, change_s, inks } = typed.pen;
    check.within("pen.press_depth_mm", press_depth_mm, 0.0, 50.0)?;
    check.within("pen.change_s", change_s, 0.0, 3600.0)?;
    let mut pens = BTreeMap::new();
    for (ink, pen) in inks {
        let key = if ink.starts_with('#') { ink_color(&ink, check)? } else { ink.clone() };
        pens.insert(key, asset(&format!("pen.inks.{ink}"), AssetKind::Pen, &pen)?);
    }
    check_plan(&typed.plan, check)?;
    check_control(&typed.control, check)?;
    check.above_zero("sim.record_hz", typed.sim.record_hz, 1000.0)?;
    check_render(&typed.render, check)?;
    check_accept(&typed.accept, check)?;
    Ok(Scenario {
        name: typed.name.unwrap_or_else(stem),
        description: typed.description,
        seed: typed.seed,
        robot: asset("robot", AssetKind::Robot, &typed.robot)?,
        drawing,
        canvas: CanvasSpec { scene: asset("canvas.scene", AssetKind::Scene, &scene)?, mapping, belief, offset_mm },
        pen: PenSpec { kind: asset("pen.kind", AssetKind::Pen, &kind)?, press_depth_mm, change_s, inks: pens },
        plan: typed.plan,
        control: typed.control,
        sim: typed.sim,
        render: typed.render,
        accept: typed.accept,
    })
}

fn resolve_drawing(typed: DrawingFile, folder: &Path, check: &Check) -> Result<DrawingSpec, ScenarioError> {
    let artwork = match (typed.source, typed.pattern) {
        (Some(source), None) => {
            let name = source.to_ascii_lowercase();
            if ![".svg", ".jsonl", ".txt"].iter().any(|e| name.ends_with(e)) {
                let message = format!("must be an .svg, a .jsonl or a _k.txt file, not {source}");
                return Err(check.wrong("drawing.source", message));
            }
            Artwork::File(existing(&folder.join(source)).map_err(|e| check.sentence("drawing.source", e))?)
        }
        (None, Some(pattern)) => Artwork::Pattern(resolve_pattern(pattern, check)?),
        (Some(_), Some(_)) => {
            return Err(check.wrong("drawing.source", "and `[drawing.pattern]` exclude each other: keep one"));
        }
        (None, None) => {
            let message = "`[drawing]` needs a `source` file or a `[drawing.pattern]`";
            return Err(check.sentence("drawing.source", message));
        }
    };
    for (key, size) in [("drawing.height_mm", typed.height_mm), ("drawing.width_mm", typed.width_mm)] {
        if let Some(size) = size {
            check.above_zero(key, size, 100_000.0)?;
        }
    }
    check.within("drawing.rotate_deg", typed.rotate_deg, -360.0, 360.0)?;
    check.above_zero("drawing.hatch_spacing_mm", typed.hatch_spacing_mm, 1000.0)?;
    check.within("drawing.hatch_angle_deg", typed.hatch_angle_deg, -360.0, 360.0)?;
    if let Some([min, max]) = typed.stylus_width_mm {
        check.above_zero("drawing.stylus_width_mm", min, 100.0)?;
        check.within("drawing.stylus_width_mm", max, min, 100.0)?;
    }
    check.above_zero("drawing.stylus_gamma", typed.stylus_gamma, 10.0)?;
    check.within("drawing.merge_mm", typed.merge_mm, 0.0, 10.0)?;
    check.within("drawing.simplify_mm", typed.simplify_mm, 0.0, 10.0)?;
    Ok(DrawingSpec {
        artwork,
        height_mm: typed.height_mm,
        width_mm: typed.width_mm,
        rotate_deg: typed.rotate_deg,
        fill: typed.fill,
        hatch_spacing_mm: typed.hatch_spacing_mm,
        hatch_angle_deg: typed.hatch_angle_deg,
        stylus_width_mm: typed.stylus_width_mm,
        stylus_gamma: typed.stylus_gamma,
        tidy: typed.tidy,
        merge_mm: typed.merge_mm,
        simplify_mm: typed.simplify_mm,
    })
}

fn resolve_pattern(typed: PatternFile, check: &Check) -> Result<Pattern, ScenarioError> {
    let refuse = |key: &str, given: Option<u32>, message: &str| match given {
        Some(_) => Err(check.wrong(key, message)),
        None => Ok(()),
    };
    let count = |key: &str, given: Option<u32>, default: u32, low: u32, high: u32| {
        let x = given.unwrap_or(default);
        check.within(key, f64::from(x), f64::from(low), f64::from(high)).map(|()| x)
    };
    const N: &str = "drawing.pattern.n";
    const ORDER: &str = "drawing.pattern.order";
    match typed.kind {
        PatternKind::Grid => refuse(ORDER, typed.order, "is for curves: a grid takes `n`")?,
        PatternKind::Target => {
            refuse(ORDER, typed.order, "is for curves: a target takes none")?;
            refuse(N, typed.n, "is for grids: a target takes none")?;
        }
        _ => refuse(N, typed.n, "is for grids: this curve takes `order`")?,
    }
    Ok(match typed.kind {
        PatternKind::Grid => Pattern::Grid { n: count(N, typed.n, 7, 1, 200)? },
        PatternKind::Hilbert => Pattern::Hilbert { order: count(ORDER, typed.order, 5, 1, 8)? },
        PatternKind::Arrowhead => Pattern::Arrowhead { order: count(ORDER, typed.order, 6, 1, 9)? },
        PatternKind::Snowflake => Pattern::Snowflake { order: count(ORDER, typed.order, 4, 0, 7)? },
        PatternKind::Target => Pattern::Target,
    })
}

/// A colour key in lower case.
fn ink_color(ink: &str, check: &Check) -> Result<String, ScenarioError> {
    let digits = &ink[1..];
    if digits.len() == 6 && digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        Ok(ink.to_ascii_lowercase())
    } else {
        Err(check.sentence(&format!("pen.inks.{ink}"), format!("`{ink}` should be a colour like #20407f")))
    }
}

fn check_plan(plan: &PlanSettings, check: &Check) -> Result<(), ScenarioError> {
    check.above_zero("plan.joint_speed_fraction", plan.joint_speed_fraction, 1.0)?;
    check.above_zero("plan.joint_acceleration_rad_s2", plan.joint_acceleration_rad_s2, 1000.0)?;
    check.above_zero("plan.joint_jerk_rad_s3", plan.joint_jerk_rad_s3, 1e6)?;
    check.above_zero("plan.acceleration_mm_s2", plan.acceleration_mm_s2, 1e5)?;
    check.within("plan.hover_mm", plan.hover_mm, 1.0, 200.0)?;
    check.within("plan.step_mm", plan.step_mm, 0.05, 10.0)
}

fn check_control(control: &ControlSettings, check: &Check) -> Result<(), ScenarioError> {
    for k in control.stiffness_n_m {
        check.above_zero("control.stiffness_n_m", k, 1e5)?;
    }
    for k in control.stiffness_nm_rad {
        check.above_zero("control.stiffness_nm_rad", k, 1e4)?;
    }
    check.above_zero("control.damping_ratio", control.damping_ratio, 5.0)?;
    check.above_zero("control.speed_mm_s", control.speed_mm_s, 1000.0)?;
    check.above_zero("control.landing_speed_mm_s", control.landing_speed_mm_s, 1000.0)?;
    check.above_zero("control.travel_speed_mm_s", control.travel_speed_mm_s, 5000.0)?;
    check.within("control.nullspace_stiffness_nm_rad", control.nullspace_stiffness_nm_rad, 0.0, 1e4)?;
    check.within("control.nullspace_damping_ratio", control.nullspace_damping_ratio, 0.0, 5.0)?;
    check.within("control.believed_friction", control.believed_friction, 0.0, 2.0)?;
    check.within("control.torque_noise_nm", control.torque_noise_nm, 0.0, 100.0)?;
    check.within("control.delay_ms", control.delay_ms, 0.0, 100.0)?;
    check.above_zero("control.torque_rate_nm_ms", control.torque_rate_nm_ms, 1e4)
}

fn check_render(render: &RenderSettings, check: &Check) -> Result<(), ScenarioError> {
    check.within("render.drawing_px", f64::from(render.drawing_px), 16.0, 32_768.0)?;
    for px in render.view_px {
        check.within("render.view_px", f64::from(px), 16.0, 8192.0)?;
    }
    let mut names: Vec<&str> = VIEWS.to_vec();
    for camera in &render.cameras {
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if camera.name.is_empty() || !camera.name.chars().all(plain) {
            return Err(check.sentence("render.camera.name", "a camera's name is letters, digits, `-` and `_`"));
        }
        if names.contains(&camera.name.as_str()) {
            return Err(check.sentence("render.camera.name", format!("there are two views `{}`", camera.name)));
        }
        for x in camera.eye_mm.iter().chain(&camera.target_mm) {
            check.within("render.camera.eye_mm", *x, -1e6, 1e6)?;
        }
        if camera.eye_mm == camera.target_mm {
            return Err(check.sentence("render.camera.target_mm", "a camera can't look at its own eye"));
        }
        check.within("render.camera.fov_deg", camera.fov_deg, 1.0, 120.0)?;
        names.push(&camera.name);
    }
    for view in &render.views {
        if !VIEWS.contains(&view.as_str()) {
            let message = match config::nearest(view, VIEWS) {
                Some(near) => format!("no view `{view}`: did you mean `{near}`?"),
                None => format!("no view `{view}`: known are {}", VIEWS.join(", ")),
            };
            return Err(check.sentence("render.views", message));
        }
    }
    Ok(())
}

fn check_accept(accept: &BTreeMap<String, Threshold>, check: &Check) -> Result<(), ScenarioError> {
    for (path, bounds) in accept {
        let key = format!("accept.{path}");
        if MetricPath::find(path).is_none() {
            let names = MetricPath::ALL.iter().map(|m| m.path);
            let message = match config::nearest(path, names) {
                Some(near) => format!("no metric `{path}`: did you mean `{near}`?"),
                None => format!("no metric `{path}`: the metrics are explained in GUIDE.md"),
            };
            return Err(check.sentence(&key, message));
        }
        if bounds.min.is_none() && bounds.max.is_none() {
            return Err(check.sentence(&key, format!("`{path}` needs a `min` or a `max`")));
        }
        for x in bounds.min.iter().chain(&bounds.max) {
            check.finite(&key, *x)?;
        }
    }
    Ok(())
}

impl From<Scenario> for ScenarioFile {
    fn from(s: Scenario) -> Self {
        let text = |path: PathBuf| path.to_string_lossy().into_owned();
        let (source, pattern) = match s.drawing.artwork {
            Artwork::File(file) => (Some(text(file)), None),
            Artwork::Pattern(p) => (None, Some(p.into())),
        };
        ScenarioFile {
            name: Some(s.name),
            description: s.description,
            seed: s.seed,
            robot: text(s.robot),
            drawing: DrawingFile {
                source,
                height_mm: s.drawing.height_mm,
                width_mm: s.drawing.width_mm,
                rotate_deg: s.drawing.rotate_deg,
                fill: s.drawing.fill,
                hatch_spacing_mm: s.drawing.hatch_spacing_mm,
                hatch_angle_deg: s.drawing.hatch_angle_deg,
                stylus_width_mm: s.drawing.stylus_width_mm,
                stylus_gamma: s.drawing.stylus_gamma,
                tidy: s.drawing.tidy,
                merge_mm: s.drawing.merge_mm,
                simplify_mm: s.drawing.simplify_mm,
                pattern,
            },
            canvas: CanvasFile {
                scene: Some(text(s.canvas.scene)),
                mapping: s.canvas.mapping,
                belief: s.canvas.belief,
                offset_mm: s.canvas.offset_mm,
            },
            pen: PenFile {
                kind: text(s.pen.kind),
                press_depth_mm: s.pen.press_depth_mm,
                change_s: s.pen.change_s,
                inks: s.pen.inks.into_iter().map(|(ink, pen)| (ink, text(pen))).collect(),
            },
            plan: s.plan,
            control: s.control,
            sim: s.sim,
            render: s.render,
            accept: s.accept,
        }
    }
}

impl From<Pattern> for PatternFile {
    fn from(pattern: Pattern) -> Self {
        let (kind, n, order) = match pattern {
            Pattern::Grid { n } => (PatternKind::Grid, Some(n), None),
            Pattern::Hilbert { order } => (PatternKind::Hilbert, None, Some(order)),
            Pattern::Arrowhead { order } => (PatternKind::Arrowhead, None, Some(order)),
            Pattern::Snowflake { order } => (PatternKind::Snowflake, None, Some(order)),
            Pattern::Target => (PatternKind::Target, None, None),
        };
        PatternFile { kind, n, order }
    }
}
