//! Experiments: many runs of one scenario, sampled, in parallel, summed up.
//!
//! An [`Experiment`] is cases times the points of a grid times trials of each. A trial is known by its index alone: its
//! seed and what is drawn for it follow from the experiment's seed, so that it can be done on any thread, in any shard, or by itself, and
//! come out the same to the last bit. Finished trials stand in a journal; results are made of the journal.

mod accept;
mod axis;
mod charts;
mod error;
mod estimate;
mod file;
mod journal;
mod merge;
mod page;
mod place;
mod quantity;
mod row;
mod shard;
mod spec;
mod summary;
mod table;
mod terminal;
mod trials;
mod value;

use std::path::PathBuf;

use crate::progress::{Progress, Silent};
use crate::report::OutputDir;
use crate::run::{self, Until};

pub use accept::{Accept, BoundCheck};
pub use axis::Axis;
pub use error::ExperimentError;
pub use estimate::Estimate;
pub use file::{AcceptFile, CaseFile, ExperimentFile, PlotFile, PlotKind, Stage, WorstFile};
pub use merge::gather;
pub use quantity::{Quantity, Rate};
pub use row::{Row, Status};
pub use shard::Shard;
pub use spec::{Case, Experiment, PlotSpec, Trial, Worst};
pub use summary::{Contrast, Group, Summary};
pub use terminal::summary_text;
pub use trials::try_one;
pub use value::{Distribution, Template};

use journal::Journal;
use page::Shown;

/// Whose files the results are.
const EXPERIMENT: &str = "experiment";

/// What an experiment left.
#[derive(Clone, Debug)]
pub struct Results {
    /// The results; absent while other shards are missing.
    pub summary: Option<Summary>,
    /// Trials done, in this run and before.
    pub done: usize,
    /// Why the first trial failed, where all of them did.
    pub hopeless: Option<String>,
    /// The files written.
    pub files: Vec<PathBuf>,
}

/// Does the trials of a shard, as many at a time as there are cores, and with [`Shard::ALL`] makes the results. With `resume` it goes on
/// with the journal in `out`, if there is one.
pub fn conduct(
    experiment: &Experiment,
    shard: Shard,
    resume: bool,
    out: &OutputDir,
    progress: &dyn Progress,
) -> Result<Results, ExperimentError> {
    let (journal, mut rows) = Journal::open(out, experiment, shard, resume)?;
    let done: std::collections::BTreeSet<u64> = rows.iter().map(|r| r.trial).collect();
    let indices: Vec<u64> = (0..experiment.total()).filter(|t| shard.has(*t) && !done.contains(t)).collect();
    if resume && !rows.is_empty() {
        progress.note(&format!("{} trials are done, {} to go", rows.len(), indices.len()));
    }
    if rows.is_empty() {
        // results of trials that are no more
        out.renewed(EXPERIMENT)?;
    }
    if !indices.is_empty() {
        rows.extend(trials::try_all(experiment, &indices, journal, progress)?);
    }
    rows.sort_by_key(|r| r.trial);
    if shard != Shard::ALL {
        let file = journal::write(out, experiment, shard, &rows)?;
        return Ok(Results { summary: None, done: rows.len(), hopeless: hopeless(&rows), files: vec![file] });
    }
    results(experiment, &rows, out, progress)
}

/// Makes the results of all trials: tables, summary, plots, the worst trials with pictures, the page.
pub fn results(
    experiment: &Experiment,
    rows: &[Row],
    out: &OutputDir,
    progress: &dyn Progress,
) -> Result<Results, ExperimentError> {
    progress.stage("results", None);
    let mut files = vec![journal::write(out, experiment, Shard::ALL, rows)?];
    // all but the journal is made anew
    let out = &out.renewed(EXPERIMENT)?;
    let summary = Summary::of(experiment, rows);
    files.push(out.write("results.csv", &table::results_csv(rows)?)?);
    files.push(out.write("results.parquet", &table::results_parquet(rows)?)?);
    let json = serde_json::to_string_pretty(&summary)? + "\n";
    files.push(out.write("summary.json", json.as_bytes())?);
    files.push(out.write("summary.csv", &table::summary_csv(&summary)?)?);
    let mut plots: Vec<(String, String)> = Vec::new();
    for spec in &experiment.plots {
        let figure = charts::chart(experiment, spec, rows);
        let mut name = format!("{}-{}", plot_name(spec.kind), spec.quantity.name().replace('.', "-"));
        if plots.iter().any(|(n, _)| *n == name) {
            name = format!("{name}-{}", plots.len() + 1);
        }
        files.push(out.write(&format!("{name}.svg"), figure.svg().as_bytes())?);
        files.push(out.write(&format!("{name}.png"), &figure.png()?)?);
        plots.push((name, spec.title.clone()));
    }
    let shown = show_worst(experiment, rows, out, progress)?;
    let described = [
        ("results.csv", "a line a trial"),
        ("results.parquet", "the same for programs"),
        ("summary.csv", "a line a figure of each case and point of the grid"),
        ("summary.json", "the same, with bounds and differences of cases"),
        (journal::NAME, "the journal: what the results were made from"),
    ];
    let html = page::page(experiment, &summary, rows, &plots, &shown, &described);
    files.push(out.write("report.html", html.as_bytes())?);
    Ok(Results { summary: Some(summary), done: rows.len(), hopeless: hopeless(rows), files })
}

/// Why the first trial failed, where none came to figures.
fn hopeless(rows: &[Row]) -> Option<String> {
    rows.first().filter(|_| !rows.iter().any(Row::is_ok)).map(|r| r.reason.clone())
}

fn plot_name(kind: PlotKind) -> &'static str {
    match kind {
        PlotKind::Curve => "curve",
        PlotKind::Histogram => "histogram",
        PlotKind::Heatmap => "heatmap",
    }
}

/// The full run of one trial, with pictures, into `out`.
pub fn replay(
    experiment: &Experiment,
    index: u64,
    out: &OutputDir,
    progress: &dyn Progress,
) -> Result<run::Outcome, ExperimentError> {
    let scenario = experiment.scenario(&experiment.trial(index)?)?;
    let until = match experiment.until {
        Stage::Cover => Until::Cover,
        Stage::End => Until::End,
    };
    run::run(&scenario, until, &run::Manner::default(), out, progress)
        .map_err(|e| ExperimentError::Run { trial: index, source: Box::new(e) })
}

/// Runs the worst trials again, and one of each rate that is to be shown, with pictures.
fn show_worst(
    experiment: &Experiment,
    rows: &[Row],
    out: &OutputDir,
    progress: &dyn Progress,
) -> Result<Vec<Shown>, ExperimentError> {
    let Some(worst) = &experiment.worst else { return Ok(Vec::new()) };
    let mut ranked: Vec<(f64, &Row)> =
        rows.iter().filter(|r| r.is_ok()).filter_map(|r| Some((worst.quantity.value(r)?, r))).collect();
    // equal figures in the order of trials
    ranked.sort_by(|a, b| if worst.lowest { a.0.total_cmp(&b.0) } else { b.0.total_cmp(&a.0) });
    ranked.truncate(worst.n);
    let mut chosen: Vec<(&Row, String)> = worst
        .each
        .iter()
        .filter_map(|rate| Some((rows.iter().find(|r| r.is_ok() && rate.is_met(r))?, rate.name.replace('_', " "))))
        .collect();
    for (value, row) in ranked {
        let why = format!("{} {}", worst.quantity.name(), page::figure(value));
        match chosen.iter_mut().find(|(r, _)| r.trial == row.trial) {
            Some((_, words)) => *words = format!("{words}; {why}"),
            None => chosen.push((row, why)),
        }
    }
    progress.stage("worst trials", Some(chosen.len() as u64));
    let mut shown = Vec::new();
    for (i, (row, why)) in chosen.into_iter().enumerate() {
        let folder = format!("worst/trial-{}", row.trial);
        out.own(&folder)?;
        let outcome = replay(experiment, row.trial, &OutputDir::check(&out.path().join(&folder))?, &Silent)?;
        let names = outcome.files.iter().filter_map(|f| f.file_name()).map(|n| n.to_string_lossy().into_owned());
        let names: Vec<String> = names.filter(|n| n.ends_with(".png")).collect();
        // where a tool change failed says more than what was drawn
        let failed = |n: &&String| n.starts_with("stage-") && (n.contains("_failed") || n.contains("lost"));
        let others = |n: &&String| *n == "drawing.png" || *n == "coverage.png" || n.starts_with("view-");
        let pictures = names.iter().filter(failed).take(2).chain(names.iter().filter(others).take(2)).cloned();
        shown.push(Shown { row: row.clone(), why, folder, pictures: pictures.collect() });
        progress.advance(i as u64 + 1);
    }
    Ok(shown)
}
