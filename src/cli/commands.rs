//! One function a command.
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::Deserialize;

use crate::cover::CoverageError;
use crate::exec::StopFlag;
use crate::experiment::ExperimentError;
use crate::files;
use crate::reach::ReachError;
use crate::report::{OutputDir, OutputError, summary};
use crate::run::{self, Manner, Outcome, RunError, Until};
use crate::scenario::{AssetKind, Assets, Override, Scenario, ScenarioError, ScenarioFile, Sketch};

use super::Ending;
use super::again;
use super::args::{Args, Command, Job, Listed};
use super::cover;
use super::experiments;
use super::print::{self, Printer};
use super::progress::listener;
use super::reach;

/// Why a command can't be done.
#[derive(Debug, thiserror::Error)]
pub(super) enum CommandError {
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    #[error("{0}")]
    Missing(String),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Cover(#[from] CoverageError),
    #[error(transparent)]
    Reach(#[from] ReachError),
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    #[error("--threads {count}: {source}")]
    Threads { count: u16, source: rayon::ThreadPoolBuildError },
    #[error("Ctrl-C can't be listened for: {0}")]
    Signal(#[from] ctrlc::Error),
    #[error("standard output: {0}")]
    Print(#[from] io::Error),
    #[error("the JSON schema can't be printed: {0}")]
    Schema(#[from] serde_json::Error),
}

/// Does what was typed.
pub(super) fn run(args: &Args) -> Result<Ending, CommandError> {
    if let Some(count) = args.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(count));
        pool.build_global().map_err(|source| CommandError::Threads { count, source })?;
    }
    match &args.command {
        Command::Run { job, partial, only, resume, keep_every_ms } => {
            let stop: &'static StopFlag = Box::leak(Box::default());
            ctrlc::set_handler(move || interrupted(stop))?;
            let keep_every = keep_every_ms.map(Duration::from_millis);
            let manner = Manner { only: only.clone(), resume: *resume, keep_every, stop: Some(stop) };
            stages(args, job, *partial, Until::End, &manner)
        }
        Command::Plan { job, partial } => stages(args, job, *partial, Until::Plan, &Manner::default()),
        Command::Map(job) => stages(args, job, false, Until::Mapping, &Manner::default()),
        Command::Draw(job) => draw(args, job),
        Command::Check { schema: true, .. } => schema(),
        Command::Check { scenario, sets, .. } => check(scenario.as_deref().unwrap_or(Path::new("")), sets),
        Command::Experiment { experiment, out, trials, shard, resume, trial } => {
            let task = experiments::Task { file: experiment, out: out.as_deref(), trials: *trials, shard: *shard };
            match trial {
                Some(index) => experiments::replay(args, &task, *index),
                None => experiments::experiment(args, &task, *resume),
            }
        }
        Command::Merge { folders, out } => experiments::merge(args, folders, out),
        Command::Cover(job) => cover::cover(args, job),
        Command::Reach(job) => reach::reach(args, job),
        Command::List { kind } => list(*kind),
    }
}

/// Ctrl-C: the first lets the arms stop where their pens are next off the canvas, the second ends the program at once.
fn interrupted(stop: &StopFlag) {
    if stop.is_raised() {
        print::error(&format!("ended at once; go on with: {}", again::command()));
        std::process::exit(Ending::INTERRUPTED);
    }
    stop.raise();
}

/// `run`, `plan`, `map`: a scenario as far as `until`.
fn stages(args: &Args, job: &Job, partial: bool, until: Until, manner: &Manner) -> Result<Ending, CommandError> {
    let file = scenario_file(&job.scenario)?;
    let mut scenario = Scenario::read(&file, &job.sets)?;
    scenario.plan.partial |= partial;
    let out = OutputDir::check(&out_folder(job, &file))?;
    let progress = listener(args.quiet, args.verbose);
    if args.verbose {
        for (what, path) in
            [("robot", &scenario.robot), ("canvas", &scenario.canvas.scene), ("pen", &scenario.pen.kind)]
        {
            progress.note(&format!("{what}: {}", path.display()));
        }
    }
    let outcome = run::run(&scenario, until, manner, &out, progress.as_ref())?;
    drop(progress);
    tell(args, &outcome)?;
    if outcome.interrupted {
        print::error(&format!("interrupted: what was drawn is kept; go on with: {}", again::command()));
        return Ok(Ending::Interrupted);
    }
    let unmet =
        if until == Until::End && manner.only.is_none() { scenario.unmet(&outcome.metrics) } else { Vec::new() };
    for bound in &unmet {
        print::error(&bound.to_string());
    }
    if let Some(why) = &outcome.stopped {
        print::error(&format!("stopped: {why}"));
        return Ok(Ending::Unmet);
    }
    let mut failed = !unmet.is_empty();
    if let Some(verdict) = &outcome.verdict {
        // what is asked for in part may come in part; nothing is no part
        let excused = scenario.plan.partial && !verdict.is_of_nothing();
        failed |= !excused;
        if excused {
            print::line(&format!("note: {verdict}"));
        } else {
            print::error(&verdict.to_string());
        }
    }
    Ok(if failed { Ending::Unmet } else { Ending::Done })
}

/// `draw`: the drawing alone, of a scenario or of a drawing file.
fn draw(args: &Args, job: &Job) -> Result<Ending, CommandError> {
    let is_scenario = job.scenario.extension().is_none_or(|e| e == "toml");
    let (file, sketch) = if is_scenario {
        let file = scenario_file(&job.scenario)?;
        let scenario = Scenario::read(&file, &job.sets)?;
        (file, Sketch::from(&scenario))
    } else {
        (job.scenario.clone(), Sketch::of_file(&job.scenario, &job.sets)?)
    };
    let out = OutputDir::check(&out_folder(job, &file))?;
    let progress = listener(args.quiet, args.verbose);
    let outcome = run::draw(&sketch, &out, progress.as_ref())?;
    drop(progress);
    tell(args, &outcome)?;
    Ok(Ending::Done)
}

fn check(file: &Path, sets: &[Override]) -> Result<Ending, CommandError> {
    let scenario = Scenario::read(&scenario_file(file)?, sets)?;
    Printer::new().text(&scenario.to_toml()?)?;
    Ok(Ending::Done)
}

fn schema() -> Result<Ending, CommandError> {
    let text = serde_json::to_string_pretty(ScenarioFile::schema())?;
    Printer::new().text(&(text + "\n"))?;
    Ok(Ending::Done)
}

/// What an asset says of itself; everything else in its file is left to whoever uses it.
#[derive(Deserialize)]
struct Described {
    description: Option<String>,
}

/// One line about an asset: its description, else the comment that its file begins with, else the file.
fn about(file: &Path) -> String {
    let described = crate::diagnostic::read::<Described>(file).ok().and_then(|d| d.description);
    let comment = || {
        let text = files::read_text(file).ok()?;
        text.lines().next()?.strip_prefix('#').map(|c| c.trim().to_string())
    };
    let about = described.or_else(comment).unwrap_or_else(|| file.display().to_string());
    about.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn list(kind: Listed) -> Result<Ending, CommandError> {
    let kind = match kind {
        Listed::Robots => AssetKind::Robot,
        Listed::Scenes => AssetKind::Scene,
        Listed::Scenarios => AssetKind::Scenario,
        Listed::Experiments => AssetKind::Experiment,
        Listed::Pens => AssetKind::Pen,
    };
    let assets = Assets::seen_from(Path::new(".")).list(kind);
    let width = assets.iter().map(|a| a.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for asset in assets {
        text += &format!("{:<width$}  {}\n", asset.name, about(&asset.file));
    }
    Printer::new().text(&text)?;
    Ok(Ending::Done)
}

/// The summary of a run.
fn tell(args: &Args, outcome: &Outcome) -> Result<(), CommandError> {
    if !args.quiet {
        Printer::new().text(&summary(&outcome.metrics, &outcome.files))?;
    }
    Ok(())
}

pub(super) fn scenario_file(typed: &Path) -> Result<PathBuf, CommandError> {
    asset_file(AssetKind::Scenario, typed)
}

/// The file that was typed, or the asset of that name.
pub(super) fn asset_file(kind: AssetKind, typed: &Path) -> Result<PathBuf, CommandError> {
    match typed.to_str() {
        Some(name) if !typed.exists() && !name.contains('/') && typed.extension().is_none() => {
            let here = Path::new(".");
            Assets::seen_from(here).find(kind, name, here).map_err(CommandError::Missing)
        }
        _ => Ok(typed.to_path_buf()),
    }
}

/// Where the files go: as typed, or `out/` and the file's name.
pub(super) fn out_folder(job: &Job, file: &Path) -> PathBuf {
    job.out.clone().unwrap_or_else(|| Path::new("out").join(file.file_stem().unwrap_or(OsStr::new("scenario"))))
}
