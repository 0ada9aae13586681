//! The journal of an experiment: a line a finished trial, so that a kill costs no more than the trials under way.
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::report::OutputDir;

use super::row::Row;
use super::spec::Experiment;
use super::{ExperimentError, Shard};

/// Name of the journal in an experiment's folder.
pub(super) const NAME: &str = "trials.jsonl";

/// First line of a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Header {
    /// Version of the format.
    pub calamus_experiment: u32,
    /// The experiment's name.
    pub name: String,
    /// [`Experiment::hash`].
    pub hash: String,
    /// Trials of each case at each point of the grid.
    pub trials: u64,
    /// All trials of the experiment.
    pub total: u64,
    /// Which part of them the journal is for.
    pub shard: Shard,
    /// The experiment's file.
    pub file: PathBuf,
    /// Its text.
    pub text: String,
}

impl Header {
    const FORMAT: u32 = 1;

    pub fn new(experiment: &Experiment, shard: Shard) -> Self {
        Self {
            calamus_experiment: Self::FORMAT,
            name: experiment.name.clone(),
            hash: experiment.hash.clone(),
            trials: experiment.trials,
            total: experiment.total(),
            shard,
            file: experiment.file.clone(),
            text: experiment.text().to_string(),
        }
    }
}

/// A journal as read.
#[derive(Debug)]
pub(super) struct Kept {
    pub header: Header,
    pub rows: Vec<Row>,
    /// Bytes of whole lines; what follows is a torn one.
    whole: u64,
}

/// Reads a journal; a last line without its end, as a kill leaves it, is passed over. `None` where there is none, or no whole
/// header in it.
pub(super) fn read(file: &Path) -> Result<Option<Kept>, ExperimentError> {
    let bytes = match fs::read(file) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(ExperimentError::Io { file: file.to_path_buf(), source }),
    };
    parse(&bytes, file)
}

fn parse(bytes: &[u8], file: &Path) -> Result<Option<Kept>, ExperimentError> {
    let wrong = |line: usize, message: String| ExperimentError::Journal { file: file.to_path_buf(), line, message };
    let whole = bytes.iter().rposition(|b| *b == b'\n').map_or(0, |i| i + 1);
    let mut lines = bytes[..whole].split_inclusive(|b| *b == b'\n').enumerate();
    let Some((_, first)) = lines.next() else { return Ok(None) };
    let header: Header =
        serde_json::from_slice(first).map_err(|e| wrong(1, format!("not the head of a journal: {e}")))?;
    if header.calamus_experiment != Header::FORMAT {
        return Err(wrong(1, format!("format {}, should be {}", header.calamus_experiment, Header::FORMAT)));
    }
    let mut rows: Vec<Row> = Vec::new();
    let mut seen = std::collections::BTreeSet::new();
    for (i, line) in lines {
        let row: Row = serde_json::from_slice(line).map_err(|e| wrong(i + 1, format!("not a trial: {e}")))?;
        if row.trial >= header.total {
            return Err(wrong(i + 1, format!("trial {} of {}", row.trial, header.total)));
        }
        if !seen.insert(row.trial) {
            return Err(wrong(i + 1, format!("trial {} stands there twice", row.trial)));
        }
        rows.push(row);
    }
    Ok(Some(Kept { header, rows, whole: whole as u64 }))
}

/// A journal that rows are added to.
pub(super) struct Journal {
    path: PathBuf,
    file: File,
}

impl Journal {
    /// Begins a journal, or goes on with the one in `out`. Gives the rows that it holds already.
    pub fn open(
        out: &OutputDir,
        experiment: &Experiment,
        shard: Shard,
        resume: bool,
    ) -> Result<(Self, Vec<Row>), ExperimentError> {
        let path = out.path().join(NAME);
        let header = Header::new(experiment, shard);
        let mut rows = Vec::new();
        match read(&path)? {
            Some(kept) if resume => {
                let kept = settled(kept, out, experiment, &path)?;
                // the experiment may have moved: its file's place is no part of it
                let kept_trials = kept.header.trials;
                let same = Header { file: header.file.clone(), text: header.text.clone(), ..kept.header } == header;
                if !same && kept_trials > experiment.trials {
                    let (was, now) = (kept_trials, experiment.trials);
                    return Err(ExperimentError::FewerTrials { file: path, was, now });
                }
                if !same {
                    return Err(ExperimentError::Changed { file: path });
                }
                let file = OpenOptions::new().write(true).open(&path);
                file.and_then(|f| f.set_len(kept.whole))
                    .map_err(|source| ExperimentError::Io { file: path.clone(), source })?;
                rows = kept.rows;
            }
            Some(kept) if kept.rows.len() < kept.header.shard.size(kept.header.total) && !kept.rows.is_empty() => {
                let of = kept.header.shard.size(kept.header.total);
                return Err(ExperimentError::Unfinished { file: path, done: kept.rows.len(), of });
            }
            _ => {
                out.write(NAME, &line(&header)?)?;
            }
        }
        let file = OpenOptions::new()
            .append(true)
            .open(&path)
            .map_err(|source| ExperimentError::Io { file: path.clone(), source })?;
        Ok((Self { path, file }, rows))
    }

    /// Adds a row, and returns when it is on the disk.
    pub fn add(&mut self, row: &Row) -> Result<(), ExperimentError> {
        let line = line(row)?;
        let added = self.file.write_all(&line).and_then(|()| self.file.sync_data());
        added.map_err(|source| ExperimentError::Io { file: self.path.clone(), source })
    }
}

/// What is gone on from: without the trials that failed for want of a file, and with the numbers that trials have where there are now
/// more of each than there were.
fn settled(kept: Kept, out: &OutputDir, experiment: &Experiment, path: &Path) -> Result<Kept, ExperimentError> {
    let (was, now) = (kept.header.trials, experiment.trials);
    let grows = was < now && kept.header.hash == experiment.hash_of(was)?;
    if !grows && !kept.rows.iter().any(|r| r.again) {
        return Ok(kept);
    }
    let Kept { mut header, mut rows, .. } = kept;
    rows.retain(|r| !r.again);
    if grows {
        if header.shard != Shard::ALL {
            return Err(ExperimentError::ShareGrows { file: path.to_path_buf(), was, now });
        }
        // by case and point of the grid, then by repeat
        rows.iter_mut().for_each(|r| r.trial = r.trial / was * now + r.trial % was);
        header = Header { file: header.file, text: header.text, ..Header::new(experiment, header.shard) };
    }
    let bytes = bytes_of(&header, &rows)?;
    out.write(NAME, &bytes)?;
    Ok(Kept { header, rows, whole: bytes.len() as u64 })
}

/// Writes a whole journal in the order of trials.
pub(super) fn write(
    out: &OutputDir,
    experiment: &Experiment,
    shard: Shard,
    rows: &[Row],
) -> Result<PathBuf, ExperimentError> {
    Ok(out.write(NAME, &bytes_of(&Header::new(experiment, shard), rows)?)?)
}

fn bytes_of(header: &Header, rows: &[Row]) -> Result<Vec<u8>, serde_json::Error> {
    let mut bytes = line(header)?;
    for row in rows {
        bytes.extend(line(row)?);
    }
    Ok(bytes)
}

/// A value as one line of JSON.
fn line(value: &impl Serialize) -> Result<Vec<u8>, serde_json::Error> {
    let mut bytes = serde_json::to_vec(value)?;
    bytes.push(b'\n');
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn header() -> Header {
        Header {
            calamus_experiment: Header::FORMAT,
            name: "x".into(),
            hash: "0".into(),
            trials: 2,
            total: 40,
            shard: Shard::ALL,
            file: "x.toml".into(),
            text: "scenario = 'y'\n".into(),
        }
    }

    fn row(trial: u64, x: f64) -> Row {
        Row { trial, metrics: [("line.error_mean_mm".to_string(), x)].into(), ..Row::default() }
    }

    fn journal(rows: &[Row]) -> Vec<u8> {
        let mut bytes = line(&header()).unwrap();
        rows.iter().for_each(|r| bytes.extend(line(r).unwrap()));
        bytes
    }

    #[test]
    fn a_journal_torn_anywhere_keeps_its_whole_lines() {
        let rows = [row(3, 0.1), row(0, 1.0 / 3.0), row(7, 1e-300)];
        let bytes = journal(&rows);
        for cut in 0..=bytes.len() {
            let whole = bytes[..cut].iter().filter(|b| **b == b'\n').count();
            match parse(&bytes[..cut], Path::new("j")).unwrap() {
                None => assert_eq!(whole, 0),
                Some(kept) => {
                    assert_eq!(kept.rows, rows[..whole - 1]);
                    assert!(bytes[..kept.whole as usize].ends_with(b"\n"));
                }
            }
        }
    }

    #[test]
    fn a_spoilt_journal_is_refused_with_its_line() {
        let mut bytes = journal(&[row(1, 0.5)]);
        bytes.extend(b"{}\n");
        assert!(parse(&bytes, Path::new("j")).unwrap_err().to_string().starts_with("j:3: not a trial"));
        let twice = parse(&journal(&[row(1, 0.5), row(1, 0.5)]), Path::new("j")).unwrap_err();
        assert_eq!(twice.to_string(), "j:3: trial 1 stands there twice");
        let beyond = parse(&journal(&[row(40, 0.5)]), Path::new("j")).unwrap_err();
        assert_eq!(beyond.to_string(), "j:2: trial 40 of 40");
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200), with_head: bool) {
            let mut all = if with_head { line(&header()).unwrap() } else { Vec::new() };
            all.extend(bytes);
            let _ = parse(&all, Path::new("j"));
        }

        #[test]
        fn numbers_come_back_to_the_last_bit(bits: u64, trial in 0..40_u64) {
            let x = f64::from_bits(bits);
            prop_assume!(x.is_finite());
            let kept = parse(&journal(&[row(trial, x)]), Path::new("j")).unwrap().unwrap();
            prop_assert_eq!(kept.rows[0].metrics["line.error_mean_mm"].to_bits(), x.to_bits());
        }
    }
}
