//! Shards of an experiment put together.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::ExperimentError;
use super::journal::{self, Kept};
use super::row::Row;
use super::spec::Experiment;

/// Reads the journals in these folders: of one experiment, every trial once. Gives the experiment and all rows in order.
pub fn gather(folders: &[PathBuf]) -> Result<(Experiment, Vec<Row>), ExperimentError> {
    let mut first: Option<(PathBuf, Kept)> = None;
    let mut rows: BTreeMap<u64, (Row, usize)> = BTreeMap::new();
    let mut twice: Vec<(u64, usize, usize)> = Vec::new();
    let path_of = |folder: &Path| folder.join(journal::NAME);
    for (i, folder) in folders.iter().enumerate() {
        let path = path_of(folder);
        let missing = || ExperimentError::Io { file: path.clone(), source: std::io::ErrorKind::NotFound.into() };
        let mut kept = journal::read(&path)?.ok_or_else(missing)?;
        for row in std::mem::take(&mut kept.rows) {
            let trial = row.trial;
            if let Some((_, before)) = rows.insert(trial, (row, i)) {
                twice.push((trial, before, i));
            }
        }
        match &first {
            Some((path, one)) if one.header.hash != kept.header.hash || one.header.total != kept.header.total => {
                return Err(ExperimentError::Different { first: path.clone(), other: path_of(folder) });
            }
            Some(_) => {}
            None => first = Some((path, kept)),
        }
    }
    let Some((path, Kept { header, .. })) = first else {
        return Err(ExperimentError::Missing { trials: "all trials are".into(), total: 0 });
    };
    if let Some((_, a, b)) = twice.first() {
        let trials: Vec<u64> = twice.iter().filter(|t| (t.1, t.2) == (*a, *b)).map(|t| t.0).collect();
        let (first, second) = (path_of(&folders[*a]), path_of(&folders[*b]));
        return Err(ExperimentError::Overlap { trials: spans(&trials), first, second });
    }
    let missing: Vec<u64> = (0..header.total).filter(|t| !rows.contains_key(t)).collect();
    if !missing.is_empty() {
        return Err(ExperimentError::Missing { trials: spans(&missing), total: header.total });
    }
    let experiment = Experiment::parse(&header.text, &header.file, Some(header.trials))?;
    if experiment.hash != header.hash {
        return Err(ExperimentError::Changed { file: path });
    }
    Ok((experiment, rows.into_values().map(|(row, _)| row).collect()))
}

/// `trials 3, 7 to 12 are`: which, with the verb.
fn spans(trials: &[u64]) -> String {
    const SHOWN: usize = 8;
    let mut spans: Vec<(u64, u64)> = Vec::new();
    for t in trials {
        match spans.last_mut() {
            Some((_, last)) if *last + 1 == *t => *last = *t,
            _ => spans.push((*t, *t)),
        }
    }
    let words = |(a, b): &(u64, u64)| match b - a {
        0 => a.to_string(),
        1 => format!("{a}, {b}"),
        _ => format!("{a} to {b}"),
    };
    let mut text = spans.iter().take(SHOWN).map(words).collect::<Vec<_>>().join(", ");
    if spans.len() > SHOWN {
        text += ", ...";
    }
    if trials.len() == 1 { format!("trial {text} is") } else { format!("trials {text} ({} of them) are", trials.len()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trials_are_named_in_spans() {
        assert_eq!(spans(&[3]), "trial 3 is");
        assert_eq!(spans(&[0, 1, 4, 7, 8, 9]), "trials 0, 1, 4, 7 to 9 (6 of them) are");
        let odd: Vec<u64> = (0..40).map(|i| 2 * i).collect();
        assert!(spans(&odd).contains("14, ... (40 of them)"));
    }
}
