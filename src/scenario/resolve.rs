//! The scenario as it is meant: what the file says, with defaults, ranges and paths resolved.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::diagnostic::{self, ConfigError};
use crate::files;
use crate::measure::MetricPath;
use crate::surface::{FlattenOptions, MappingKind};

use super::assets::{AssetKind, Assets};
use super::change::ChangeSettings;
use super::check::Check;
use super::coverage::{CoverageSettings, check_coverage};
use super::drawing::{DrawingSpec, parse_color, resolve_drawing};
use super::drive::DriveSettings;
use super::file::{CanvasFile, Overlay, PenFile, ScenarioFile, Threshold};
use super::localisation::LocalisationSettings;
use super::looking::LookingSettings;
use super::overrides::Override;
use super::scan::{ScanSettings, resolve_scan};
use super::settings::{BeliefKind, ControlSettings, PlanSettings, RenderSettings, SimSettings, VIEWS};
use super::tools::ToolSettings;
use super::touch::{TouchSettings, check_touch};
use super::truth::{TruthSettings, check_truth};

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
    /// How a conformal map is made.
    pub conformal: FlattenOptions,
    /// The drawing once more, laid by another mapping.
    pub overlay: Option<Overlay>,
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
    /// Which arm draws, of a robot of several.
    pub arm: Option<String>,
    /// What is drawn, and how large.
    pub drawing: DrawingSpec,
    /// What is drawn on.
    pub canvas: CanvasSpec,
    /// How what it is drawn on differs from what the robot believes.
    pub truth: TruthSettings,
    /// What is drawn with.
    pub pen: PenSpec,
    /// How the canvas is scanned; there when the belief is a scan.
    pub scan: Option<ScanSettings>,
    /// How the canvas is learned by touch; there when that is the belief.
    pub touch: Option<TouchSettings>,
    /// How arms with grippers fetch their pens.
    pub tools: Option<ToolSettings>,
    /// Where a mobile base stands.
    pub coverage: Option<CoverageSettings>,
    /// How a mobile base drives.
    pub drive: Option<DriveSettings>,
    /// How a mobile base finds out where it stands.
    pub localisation: Option<LocalisationSettings>,
    /// Values of the robot's and of the scene's file that are changed.
    pub change: ChangeSettings,
    /// How it finds out better by looking and feeling.
    pub looking: Option<LookingSettings>,
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
        let text =
            files::read_text(file).map_err(|source| ConfigError::Unreadable { file: file.to_path_buf(), source })?;
        Self::parse(&text, file, overrides)
    }

    /// [`Scenario::read`] on text; `file` is named in errors, and its folder is where paths start.
    pub fn parse(text: &str, file: &Path, overrides: &[Override]) -> Result<Self, ScenarioError> {
        let mut typed: ScenarioFile = diagnostic::parse(text, file)?;
        let mut table: toml::Table = diagnostic::parse(text, file)?;
        for set in overrides {
            let wrong = |message: String| ScenarioError::Override { text: set.text.clone(), message };
            set.apply(&mut table).map_err(wrong)?;
            typed = ScenarioFile::deserialize(table.clone()).map_err(|e| wrong(diagnostic::explain(e.message())))?;
        }
        let check = Check { text, file, overrides };
        check.ranges(&table)?;
        resolve(typed, &check)
    }

    /// A scenario file that says everything: read again, it gives this scenario.
    pub fn to_toml(&self) -> Result<String, ScenarioError> {
        Ok(toml::to_string(&ScenarioFile::from(self.clone()))?)
    }
}

/// A drawing by itself: what is drawn and with what, without robot and canvas.
#[derive(Clone, Debug, PartialEq)]
pub struct Sketch {
    /// Name of the drawing.
    pub name: String,
    /// Seed of every random number.
    pub seed: u64,
    /// What is drawn, and how large.
    pub drawing: DrawingSpec,
    /// What it is drawn with.
    pub pen: PenSpec,
    /// Speed of the pen and of travels, for the time that drawing takes.
    pub control: ControlSettings,
    /// Heights and accelerations, for the same.
    pub plan: PlanSettings,
    /// The picture's size.
    pub render: RenderSettings,
}

impl Sketch {
    /// The drawing in a file, as a scenario with that `source` would have it. Overrides may change `drawing`, `pen`,
    /// `control`, `plan`, `render` and `seed`.
    pub fn of_file(file: &Path, overrides: &[Override]) -> Result<Self, ScenarioError> {
        const HEEDED: [&str; 6] = ["drawing", "pen", "control", "plan", "render", "seed"];
        let mut table = toml::Table::new();
        for set in overrides {
            let wrong = |message: String| ScenarioError::Override { text: set.text.clone(), message };
            if !set.keys.first().is_some_and(|k| HEEDED.contains(&k.as_str())) {
                return Err(wrong(format!("of a scenario, a drawing by itself heeds {}", HEEDED.join(", "))));
            }
            set.apply(&mut table).map_err(wrong)?;
            ScenarioFile::deserialize(table.clone()).map_err(|e| wrong(diagnostic::explain(e.message())))?;
        }
        let check = Check { text: "", file, overrides };
        check.ranges(&table)?;
        let mut typed = ScenarioFile::deserialize(table).map_err(|e| check.sentence("drawing", e.message()))?;
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        typed.drawing.source.get_or_insert(name);
        let folder = check.folder();
        check_render(&typed.render, &check)?;
        Ok(Self {
            name: file.file_stem().map_or_else(|| "drawing".into(), |s| s.to_string_lossy().into_owned()),
            seed: typed.seed,
            drawing: resolve_drawing(typed.drawing, &check)?,
            pen: resolve_pen(typed.pen, &Assets::seen_from(&folder), &check)?,
            control: typed.control,
            plan: typed.plan,
            render: typed.render,
        })
    }
}

impl From<&Scenario> for Sketch {
    fn from(s: &Scenario) -> Self {
        Self {
            name: s.name.clone(),
            seed: s.seed,
            drawing: s.drawing.clone(),
            pen: s.pen.clone(),
            control: s.control.clone(),
            plan: s.plan.clone(),
            render: s.render.clone(),
        }
    }
}

/// Fills in, checks and finds.
fn resolve(typed: ScenarioFile, check: &Check) -> Result<Scenario, ScenarioError> {
    let folder = check.folder();
    let assets = Assets::seen_from(&folder);
    let asset = |key: &str, kind, text: &str| check.file(key, |folder| assets.find(kind, text, folder));

    let stem = || check.file.file_stem().map_or_else(|| "scenario".into(), |s| s.to_string_lossy().into_owned());
    let drawing = resolve_drawing(typed.drawing, check)?;
    let CanvasFile { scene, mapping, belief, offset_mm, conformal, overlay } = typed.canvas;
    let scene = scene.ok_or_else(|| check.sentence("canvas.scene", "`[canvas]` needs a `scene`, as \"hemisphere\""))?;
    check_truth(&typed.truth, check)?;
    let pen = resolve_pen(typed.pen, &assets, check)?;
    let scan = match (belief, typed.scan) {
        (BeliefKind::Scan, scan) => Some(resolve_scan(scan.unwrap_or_default(), check)?),
        (_, None) => None,
        (_, Some(_)) => {
            return Err(check.sentence("scan", "`[scan]` is used with `belief = \"scan\"` under `[canvas]` alone"));
        }
    };
    let touch = resolve_touch(belief, mapping, overlay.is_some(), typed.touch, typed.plan.hover_mm, check)?;
    if let Some(coverage) = &typed.coverage {
        check_coverage(coverage, check)?;
    }
    check_render(&typed.render, check)?;
    check_accept(&typed.accept, check)?;
    Ok(Scenario {
        name: typed.name.unwrap_or_else(stem),
        description: typed.description,
        seed: typed.seed,
        robot: asset("robot", AssetKind::Robot, &typed.robot)?,
        arm: typed.arm,
        drawing,
        canvas: CanvasSpec {
            scene: asset("canvas.scene", AssetKind::Scene, &scene)?,
            mapping,
            belief,
            offset_mm,
            conformal,
            overlay,
        },
        truth: typed.truth,
        scan,
        touch,
        tools: typed.tools,
        coverage: typed.coverage,
        drive: typed.drive,
        localisation: typed.localisation,
        change: typed.change,
        looking: typed.looking,
        pen,
        plan: typed.plan,
        control: typed.control,
        sim: typed.sim,
        render: typed.render,
        accept: typed.accept,
    })
}

/// The touch settings, when the canvas is learned by touch.
fn resolve_touch(
    belief: BeliefKind,
    mapping: MappingKind,
    overlaid: bool,
    touch: Option<TouchSettings>,
    hover_mm: f64,
    check: &Check,
) -> Result<Option<TouchSettings>, ScenarioError> {
    if belief != BeliefKind::Touch {
        return match touch {
            None => Ok(None),
            Some(_) => {
                Err(check.sentence("touch", "`[touch]` is used with `belief = \"touch\"` under `[canvas]` alone"))
            }
        };
    }
    if mapping != MappingKind::Projection {
        let message = "`mapping` must be \"projection\" with `belief = \"touch\"`: a map needs the whole surface first";
        return Err(check.sentence("canvas.mapping", message));
    }
    if overlaid {
        let message = "`overlay` doesn't go with `belief = \"touch\"`: it lays by another mapping, which needs the whole surface first";
        return Err(check.sentence("canvas.overlay", message));
    }
    let touch = touch.unwrap_or_default();
    check_touch(&touch, hover_mm, check)?;
    Ok(Some(touch))
}

fn resolve_pen(typed: PenFile, assets: &Assets, check: &Check) -> Result<PenSpec, ScenarioError> {
    let PenFile { kind, press_depth_mm, change_s, inks } = typed;
    let asset = |key: &str, text: &str| check.file(key, |folder| assets.find(AssetKind::Pen, text, folder));
    let mut pens = BTreeMap::new();
    for (ink, pen) in inks {
        let key = if ink.starts_with('#') { ink_color(&ink, check)? } else { ink.clone() };
        pens.insert(key, asset(&format!("pen.inks.{ink}"), &pen)?);
    }
    Ok(PenSpec { kind: asset("pen.kind", &kind)?, press_depth_mm, change_s, inks: pens })
}

/// A colour key in lower case.
fn ink_color(ink: &str, check: &Check) -> Result<String, ScenarioError> {
    match parse_color(ink) {
        Some(_) => Ok(ink.to_ascii_lowercase()),
        None => Err(check.sentence(&format!("pen.inks.{ink}"), format!("`{ink}` should be a colour like #20407f"))),
    }
}

fn check_render(render: &RenderSettings, check: &Check) -> Result<(), ScenarioError> {
    let mut names: Vec<&str> = VIEWS.to_vec();
    for (i, camera) in render.cameras.iter().enumerate() {
        let key = |leaf: &str| format!("render.camera.{i}.{leaf}");
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if camera.name.is_empty() || !camera.name.chars().all(plain) {
            return Err(check.sentence(&key("name"), "a camera's name is letters, digits, `-` and `_`"));
        }
        if names.contains(&camera.name.as_str()) {
            return Err(check.sentence(&key("name"), format!("there are two views `{}`", camera.name)));
        }
        if camera.eye_mm == camera.target_mm {
            return Err(check.sentence(&key("target_mm"), "a camera can't look at its own eye"));
        }
        names.push(&camera.name);
    }
    for view in &render.views {
        if !VIEWS.contains(&view.as_str()) {
            let message = match diagnostic::nearest(view, VIEWS) {
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
            let names = MetricPath::all().iter().map(|m| m.path.as_str());
            let message = match diagnostic::nearest(path, names) {
                Some(near) => format!("no metric `{path}`: did you mean `{near}`?"),
                None => format!("no metric `{path}`: the metrics are explained in GUIDE.md"),
            };
            return Err(check.sentence(&key, message));
        }
        if bounds.min.is_none() && bounds.max.is_none() {
            return Err(check.sentence(&key, format!("`{path}` needs a `min` or a `max`")));
        }
    }
    Ok(())
}

impl From<Scenario> for ScenarioFile {
    fn from(s: Scenario) -> Self {
        let text = |path: PathBuf| path.to_string_lossy().into_owned();
        ScenarioFile {
            name: Some(s.name),
            description: s.description,
            seed: s.seed,
            robot: text(s.robot),
            arm: s.arm,
            drawing: s.drawing.into(),
            canvas: CanvasFile {
                scene: Some(text(s.canvas.scene)),
                mapping: s.canvas.mapping,
                belief: s.canvas.belief,
                offset_mm: s.canvas.offset_mm,
                conformal: s.canvas.conformal,
                overlay: s.canvas.overlay,
            },
            truth: s.truth,
            pen: PenFile {
                kind: text(s.pen.kind),
                press_depth_mm: s.pen.press_depth_mm,
                change_s: s.pen.change_s,
                inks: s.pen.inks.into_iter().map(|(ink, pen)| (ink, text(pen))).collect(),
            },
            scan: s.scan,
            touch: s.touch,
            tools: s.tools,
            coverage: s.coverage,
            drive: s.drive,
            localisation: s.localisation,
            change: s.change,
            looking: s.looking,
            plan: s.plan,
            control: s.control,
            sim: s.sim,
            render: s.render,
            accept: s.accept,
        }
    }
}
