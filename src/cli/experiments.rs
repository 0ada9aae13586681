//! The commands about experiments.
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::experiment::{self, Experiment, Results, Shard, summary_text};
use crate::report::OutputDir;
use crate::run::Cache;
use crate::scenario::AssetKind;

use super::Ending;
use super::again;
use super::args::Args;
use super::commands::{CommandError, asset_file};
use super::print::{self, Printer};
use super::progress::listener;

/// An experiment, and which part of it.
pub(super) struct Task<'a> {
    pub file: &'a Path,
    pub out: Option<&'a Path>,
    pub trials: Option<u64>,
    pub shard: Shard,
}

/// `experiment`: all trials of a shard, and the results when that is all.
pub(super) fn experiment(args: &Args, task: &Task, resume: bool) -> Result<Ending, CommandError> {
    let (file, experiment) = read(task)?;
    let default = || Path::new("out/experiments").join(file.file_stem().unwrap_or(OsStr::new("experiment")));
    let out = OutputDir::check(&task.out.map_or_else(default, Path::to_path_buf))?;
    // each trial that ended is on the disk: nothing waits to be saved
    ctrlc::set_handler(|| {
        print::error(&format!("interrupted: the trials that ended are kept; go on with: {}", again::command()));
        std::process::exit(Ending::INTERRUPTED);
    })?;
    let progress = listener(args.quiet, args.verbose);
    let results = experiment::conduct(&experiment, task.shard, resume, &out, progress.as_ref())?;
    drop(progress);
    if results.summary.is_none() && !args.quiet {
        let Shard { index, count } = task.shard;
        let text = format!(
            "share {index} of {count} is done, {} trials: `calamus merge DIR... --out DIR` puts the shares together\n",
            results.done
        );
        Printer::new().text(&text)?;
    }
    tell(args, &experiment, &results, &out)
}

/// `experiment --trial`: one trial by itself, and its row.
pub(super) fn replay(args: &Args, task: &Task, index: u64) -> Result<Ending, CommandError> {
    let (_, experiment) = read(task)?;
    let out = task.out.map(OutputDir::check).transpose()?;
    let row = experiment::try_one(&experiment, index, &Cache::default())?;
    Printer::new().text(&(serde_json::to_string(&row)? + "\n"))?;
    if let Some(out) = out.filter(|_| row.is_ok()) {
        let progress = listener(args.quiet, args.verbose);
        experiment::replay(&experiment, index, &out, progress.as_ref())?;
    }
    Ok(if row.is_ok() { Ending::Done } else { Ending::Unmet })
}

/// `merge`: the results of shards.
pub(super) fn merge(args: &Args, folders: &[PathBuf], out: &Path) -> Result<Ending, CommandError> {
    let (experiment, rows) = experiment::gather(folders)?;
    let out = OutputDir::check(out)?;
    let progress = listener(args.quiet, args.verbose);
    let results = experiment::results(&experiment, &rows, &out, progress.as_ref())?;
    drop(progress);
    tell(args, &experiment, &results, &out)
}

fn read(task: &Task) -> Result<(PathBuf, Experiment), CommandError> {
    let file = asset_file(AssetKind::Experiment, task.file)?;
    let experiment = Experiment::read(&file, task.trials)?;
    Ok((file, experiment))
}

/// The summary on standard output, missed bounds on standard error.
fn tell(args: &Args, experiment: &Experiment, results: &Results, out: &OutputDir) -> Result<Ending, CommandError> {
    if let Some(reason) = &results.hopeless {
        print::error(&format!("all {} trials failed; the first: {reason}", results.done));
    }
    let ending = |accepted: bool| if accepted && results.hopeless.is_none() { Ending::Done } else { Ending::Unmet };
    let Some(summary) = &results.summary else { return Ok(ending(true)) };
    if !args.quiet {
        let page = out.path().join("report.html");
        Printer::new().text(&format!("{}report {}\n", summary_text(experiment, summary), page.display()))?;
    }
    for missed in summary.accept.iter().filter(|v| !v.met) {
        print::error(&missed.to_string());
    }
    Ok(ending(summary.is_accepted()))
}
