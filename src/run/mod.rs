//! One scenario, from start to end: scenario in, products out.

mod belief;
mod driving;
mod error;
mod evaluate;
mod looking;
mod mapping;
mod perform;
mod pictures;
mod planning;
mod products;
mod scan;
mod scene_builder;
mod setup;
mod team;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::artwork::{self, Part};
use crate::exec::{Journal, StopFlag};
use crate::inputs::Inputs;
use crate::measure::{DrawingMetrics, Metrics};
use crate::progress::Progress;
use crate::report::OutputDir;
use crate::scenario::{Scenario, Sketch};
use crate::verdict::Verdict;

pub use belief::Cache;
pub use error::RunError;
pub use evaluate::{evaluate, evaluate_cover};

use belief::{believe, prepare};
use perform::perform;
use products::Written;
use setup::Setup;

/// Folder of the journal among a run's files.
const JOURNAL: &str = "journal";

/// How far to go along the way from drawing to pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Until {
    /// To the drawing on its sheet.
    Drawing,
    /// To the places where a base stands for it.
    Cover,
    /// To the drawing on the canvas.
    Mapping,
    /// To the timed joint motion.
    Plan,
    /// To the report.
    End,
}

impl Until {
    /// The command that goes so far.
    fn command(self) -> &'static str {
        match self {
            Self::Drawing => "draw",
            Self::Cover => "cover",
            Self::Mapping => "map",
            Self::Plan => "plan",
            Self::End => "run",
        }
    }
}

/// How a run is done, beside what its scenario says.
#[derive(Default)]
pub struct Manner<'a> {
    /// Draw this part of the drawing alone.
    pub only: Option<Part>,
    /// Go on where a run with the same files was interrupted.
    pub resume: bool,
    /// Least time between two states that are kept to go on from; a few seconds if not said.
    pub keep_every: Option<Duration>,
    /// Stops the run at the next safe point once it is raised.
    pub stop: Option<&'a StopFlag>,
}

/// Result of a run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Its figures.
    pub metrics: Metrics,
    /// The files written, in the order written.
    pub files: Vec<PathBuf>,
    /// Why the robot stopped before all was drawn; what it had drawn is there.
    pub stopped: Option<String>,
    /// Why what came of a run that went to its end is no drawing, whatever its scenario's bounds; `None` where it is one.
    pub verdict: Option<Verdict>,
    /// Whether it was interrupted; it can go on.
    pub interrupted: bool,
}

/// Runs a scenario as far as `until`, and writes the files of every stage that it passes into `out`.
///
/// Nothing is written before everything that could be wrong with the scenario's files, the mapping and the plan is known to be right.
pub fn run(
    scenario: &Scenario,
    until: Until,
    manner: &Manner,
    out: &OutputDir,
    progress: &dyn Progress,
) -> Result<Outcome, RunError> {
    let mut written = Written::default();
    let toml = scenario.to_toml()?;
    let prepared = prepare(scenario, manner.only.as_ref(), progress)?;
    let sheet = products::Sheet::new(&prepared)?;
    if until == Until::Drawing {
        let metrics = sheet.metrics(scenario, &prepared)?;
        let out = &out.begin(until.command())?;
        written.scenario(&toml, out)?;
        sheet.write(&prepared, out, &mut written)?;
        return finish(metrics, written, out);
    }
    if until == Until::Cover {
        let metrics = prepared.cover_metrics(scenario)?;
        let out = &out.begin(until.command())?;
        written.scenario(&toml, out)?;
        if let Some(driving) = &prepared.driving {
            products::write_places(&scenario.name, &driving.found, out, &mut written)?;
        }
        return finish(metrics, written, out);
    }
    let settled = prepared.settled(scenario);
    let scenario = &settled;
    let setup = Setup::load(scenario, prepared.drawing.clone(), prepared.pens.clone())?;
    if until < Until::End {
        let believed = believe(scenario, prepared, &setup, until, None, progress)?;
        let made = products::Products { scenario, setup: &setup, believed: &believed, sheet: &sheet, toml: &toml };
        let out = &out.begin(until.command())?;
        let metrics = made.write_unfinished(until, out, &mut written)?;
        return finish(metrics, written, out);
    }
    let journal = journal(scenario, manner, &toml, out)?;
    let believed = believe(scenario, prepared, &setup, until, Some(&journal), progress).or_else(|error| {
        // nothing moved: there is nothing to go on from
        journal.abandon()?;
        Err(error)
    })?;
    // from here on the folder is this run's, also if it is killed
    let out = &out.begin(until.command())?;
    let silent = StopFlag::default();
    let stop = manner.stop.unwrap_or(&silent);
    let performance = perform(scenario, &setup, &believed, Some(&journal), stop, progress)?;
    let (stopped, interrupted) = (performance.stopped.clone(), performance.interrupted);
    let whole = stopped.is_none() && !interrupted;
    let (takes, part) = (setup.pens.iter().map(|p| p.pen.force_max).fold(0.0, f64::max), manner.only.is_some());
    let judge = || Verdict::of(scenario, &setup.cell.arms, takes, &performance.metrics, part);
    let verdict = whole.then(judge).flatten();
    let made = products::Products { scenario, setup: &setup, believed: &believed, sheet: &sheet, toml: &toml };
    let metrics = made.write(performance, out, &mut written, progress)?;
    if !interrupted {
        journal.remove()?;
    }
    Ok(Outcome { stopped, verdict, interrupted, ..finish(metrics, written, out)? })
}

/// The journal of a run: where an interrupted one goes on, or a new one.
fn journal(scenario: &Scenario, manner: &Manner, toml: &str, out: &OutputDir) -> Result<Journal, RunError> {
    let only = manner.only.as_ref().map_or_else(String::new, ToString::to_string);
    let key = Inputs::run_key(scenario, [toml, &only])?;
    let folder: PathBuf = out.path().join(JOURNAL);
    let journal = if manner.resume { Journal::resume(&folder, &key)? } else { Journal::begin(&folder, &key)? };
    Ok(match manner.keep_every {
        Some(period) => journal.keeping_every(period),
        None => journal,
    })
}

/// Reads, or makes, a drawing, and writes the desired lines, a preview of them and the figures.
pub fn draw(sketch: &Sketch, out: &OutputDir, progress: &dyn Progress) -> Result<Outcome, RunError> {
    progress.stage("drawing", None);
    let started = Instant::now();
    let made = artwork::make(sketch, progress)?;
    let seconds = started.elapsed().as_secs_f64();
    let mut metrics = Metrics::new(&sketch.name, sketch.seed);
    let estimate = artwork::estimated_time(&made.drawing, sketch);
    metrics.drawing =
        Some(DrawingMetrics { estimated_s: Some(estimate), ..DrawingMetrics::of(&made.drawing, seconds) });
    let pens = artwork::pens(&made.drawing, &sketch.pen)?;
    let drawing = made.drawing.clone();
    let figures = DrawingMetrics::of(&drawing, seconds);
    let prepared = belief::Prepared { made, drawing, pens, metrics: figures, driving: None };
    let sheet = products::Sheet::with_side(&prepared, sketch.render.drawing_px)?;
    metrics.image = Some(sheet.likeness(None)?);
    let mut written = Written::default();
    let out = &out.begin(Until::Drawing.command())?;
    sheet.write(&prepared, out, &mut written)?;
    finish(metrics, written, out)
}

fn finish(metrics: Metrics, mut written: Written, out: &OutputDir) -> Result<Outcome, RunError> {
    let json = crate::report::metrics_json(&metrics)?;
    written.other(out.write("metrics.json", json.as_bytes())?, "Figures");
    Ok(Outcome { metrics, files: written.files, stopped: None, verdict: None, interrupted: false })
}

fn name_of(file: &Path) -> String {
    file.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}
