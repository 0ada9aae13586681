//! What is kept of one trial.
use std::collections::BTreeMap;
use std::error::Error;
use std::io;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::measure::Metrics;
use crate::run::RunError;

use super::spec::Trial;

/// How a trial ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// It was drawn and measured.
    #[default]
    Ok,
    /// It couldn't be: the reason stands beside it.
    Failed,
}

/// One trial: a line of the journal, a row of the results. Nothing in it depends on the computer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Index of the trial in the experiment, from 0.
    pub trial: u64,
    /// Name of its case; empty when there are no cases.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub case: String,
    /// Index of its point of the grid.
    pub cell: u64,
    /// Which of the trials of its case and cell it is.
    pub repeat: u64,
    /// The scenario's seed.
    pub seed: u64,
    /// Values on the axes of the grid, by dotted key.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub axes: BTreeMap<String, Value>,
    /// Values drawn for this trial, by dotted key.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub draws: BTreeMap<String, Value>,
    /// How it ended.
    pub status: Status,
    /// Why it failed.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub reason: String,
    /// It failed for a file that wasn't there or couldn't be written, and is tried again by `--resume`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub again: bool,
    /// Digest of the final state and of the drawing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
    /// Its figures, by dotted path.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub metrics: BTreeMap<String, f64>,
}

/// Whether a figure is kept of trials: those about the computer's time would differ from run to run, and trials have no pictures.
pub(super) fn kept(path: &str) -> bool {
    let of_computer = path.ends_with(".duration_s")
        || path.ends_with(".solver_s")
        || path == "sim.wall_s"
        || path == "sim.real_time_factor";
    let of_pictures = path.starts_with("render.") || path.starts_with("image.");
    !of_computer && !of_pictures
}

impl Row {
    /// The row of a trial that came out so.
    pub(super) fn new(trial: &Trial, case: &str, outcome: Result<Metrics, RunError>) -> Self {
        let row = Row {
            trial: trial.index,
            case: case.to_string(),
            cell: trial.cell,
            repeat: trial.repeat,
            seed: trial.seed,
            axes: trial.axes.clone(),
            draws: trial.draws.clone(),
            ..Row::default()
        };
        match outcome {
            Ok(metrics) => {
                let values = metrics.values().into_iter().filter(|(m, _)| kept(&m.path));
                let values = values.map(|(m, value)| (m.path.clone(), value)).collect();
                Row { digest: metrics.digest, metrics: values, ..row }
            }
            Err(error) => {
                let reason = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
                Row { status: Status::Failed, reason, again: is_of_files(&error), ..row }
            }
        }
    }

    /// Whether it was drawn and measured.
    pub fn is_ok(&self) -> bool {
        self.status == Status::Ok
    }
}

/// Whether a file or the disk was to blame: another time it may be there.
fn is_of_files(error: &RunError) -> bool {
    let chain = std::iter::successors(Some(error as &dyn Error), |&e| e.source());
    // what a file holds stays wrong as long as it is the same file
    let of_content = |e: &io::Error| matches!(e.kind(), io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof);
    chain.filter_map(|e| e.downcast_ref::<io::Error>()).any(|e| !of_content(e))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::inputs::InputError;

    #[test]
    fn a_missing_file_is_told_from_a_wrong_one() {
        let of = |kind: io::ErrorKind| RunError::Input(InputError::File { file: "x".into(), source: kind.into() });
        assert!(is_of_files(&of(io::ErrorKind::NotFound)));
        assert!(is_of_files(&RunError::Shared(Arc::new(of(io::ErrorKind::PermissionDenied)))));
        assert!(!is_of_files(&of(io::ErrorKind::InvalidData)));
        assert!(!is_of_files(&RunError::WhileDrawing));
    }
}
