//! Trials at work: all cores, a journal line each.
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::progress::{Progress, Silent};
use crate::run::{Cache, evaluate, evaluate_cover};

use super::ExperimentError;
use super::file::Stage;
use super::journal::Journal;
use super::row::Row;
use super::spec::Experiment;

/// The row of one trial. A trial that can't be done is a row too.
pub fn try_one(experiment: &Experiment, index: u64, cache: &Cache) -> Result<Row, ExperimentError> {
    let trial = experiment.trial(index)?;
    let scenario = experiment.scenario(&trial)?;
    let outcome = match experiment.until {
        Stage::Cover => evaluate_cover(&scenario, &Silent),
        Stage::End => evaluate(&scenario, cache, &Silent),
    };
    Ok(Row::new(&trial, &experiment.cases[trial.case].name, outcome))
}

/// Does the trials of `indices`, one a core at a time, and adds each to the journal as it ends. The rows come in no order.
pub(super) fn try_all(
    experiment: &Experiment,
    indices: &[u64],
    journal: Journal,
    progress: &dyn Progress,
) -> Result<Vec<Row>, ExperimentError> {
    struct Done {
        journal: Journal,
        rows: Vec<Row>,
        failed: usize,
        error: Option<ExperimentError>,
    }
    progress.stage("trials", Some(indices.len() as u64));
    let cache = Cache::default();
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Done { journal, rows: Vec::new(), failed: 0, error: None });
    // in turn, not by halves of the list: trials of one plan come together, and a kill leaves the first ones done
    rayon::broadcast(|_| {
        while let Some(index) = indices.get(next.fetch_add(1, Ordering::Relaxed)) {
            let tried = try_one(experiment, *index, &cache);
            let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
            if done.error.is_some() {
                return;
            }
            match tried.and_then(|row| done.journal.add(&row).map(|()| row)) {
                Ok(row) => {
                    if !row.is_ok() {
                        done.failed += 1;
                        // the first ones are told, so that a mistake is seen while the rest is still to come
                        if done.failed <= 3 {
                            progress.note(&format!("trial {} failed: {}", row.trial, row.reason));
                        }
                    }
                    done.rows.push(row);
                    progress.advance(done.rows.len() as u64);
                }
                Err(error) => {
                    done.error = Some(error);
                    return;
                }
            }
        }
    });
    let done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.error.map_or(Ok(done.rows), Err)
}
