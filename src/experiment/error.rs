//! Why an experiment can't be done.
use std::io;
use std::path::PathBuf;

use crate::diagnostic::ConfigError;
use crate::picture::PictureError;
use crate::report::{FigureError, OutputError};
use crate::run::RunError;
use crate::scenario::ScenarioError;

/// Why an experiment can't be done. Each says in one line what is wrong and what would be right.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// The experiment's file is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The scenario that it starts from is wrong.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// There is no such trial.
    #[error("no trial {index}: the experiment has {total}, from 0 to {last}", last = total.saturating_sub(1))]
    NoTrial {
        /// As asked for.
        index: u64,
        /// How many there are.
        total: u64,
    },
    /// A file that the experiment reads, or a journal, can't be read or written.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A journal has an unusable line.
    #[error("{}:{line}: {message}", file.display())]
    Journal {
        /// The journal.
        file: PathBuf,
        /// 1-based line.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// A folder holds unfinished work that would be lost.
    #[error("{} holds {done} of {of} trials: `--resume` goes on with them; remove it to begin anew", file.display())]
    Unfinished {
        /// The journal.
        file: PathBuf,
        /// Trials done.
        done: usize,
        /// Trials to do.
        of: usize,
    },
    /// A journal is of another experiment.
    #[error("{} is of another experiment, or the experiment, its scenario or a file that it uses has changed since: give another --out, or remove it", file.display())]
    Changed {
        /// The journal.
        file: PathBuf,
    },
    /// A journal has more trials than are asked for.
    #[error("{} holds {was} trials of each case and point of the grid, and {now} are asked for: `--resume` goes on with as many or more", file.display())]
    FewerTrials {
        /// The journal.
        file: PathBuf,
        /// Trials of each in the journal.
        was: u64,
        /// Trials of each that are asked for.
        now: u64,
    },
    /// More trials are asked of a share, and would lie in other shares.
    #[error("{} is one share of {was} trials of each case and point of the grid: {now} can be asked for where all trials are in one folder, as `calamus merge` makes it", file.display())]
    ShareGrows {
        /// The journal.
        file: PathBuf,
        /// Trials of each in the journal.
        was: u64,
        /// Trials of each that are asked for.
        now: u64,
    },
    /// Shards don't belong together.
    #[error("{} and {} are of different experiments", first.display(), other.display())]
    Different {
        /// The first shard's journal.
        first: PathBuf,
        /// The one that differs.
        other: PathBuf,
    },
    /// Two shards did the same trials.
    #[error("{trials} done twice: in {} and in {}", first.display(), second.display())]
    Overlap {
        /// Which, in words.
        trials: String,
        /// One journal.
        first: PathBuf,
        /// The other.
        second: PathBuf,
    },
    /// Trials that no shard did.
    #[error("{trials} missing, of {total}: the shards that should have done them aren't here or didn't finish")]
    Missing {
        /// Which, in words.
        trials: String,
        /// How many there should be.
        total: u64,
    },
    /// A result can't be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A plot can't be made.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// A picture can't be made.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A trial's pictures can't be made.
    #[error("trial {trial}: {source}")]
    Run {
        /// Which.
        trial: u64,
        /// Why.
        source: Box<RunError>,
    },
    /// Results can't be written as a table.
    #[error("{what} can't be written: {why}")]
    Table {
        /// Which file.
        what: &'static str,
        /// Why.
        why: String,
    },
    /// Results can't be written as JSON.
    #[error("results can't be written: {0}")]
    Json(#[from] serde_json::Error),
}
