//! What is done so far, on disk: a killed run goes on from there.
//!
//! Each arm has three files or four: `arm0.log`, to which what happened is appended; `arm0.state`, which is replaced as a whole and says
//! how much of the log belongs to it; and `arm0.task.0` or `.1`, the task that was under way, which is written once, as a line of a
//! hundred metres is too long to be written with every state. `run.key` says which run it is.
use std::fs::{self, File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Least and most time between two states that are kept: well below what a user would mind to lose.
const PERIOD: [Duration; 2] = [Duration::from_millis(2500), Duration::from_secs(8)];
/// Keeping takes no more than one part in so many of the time.
const SHARE: u32 = 25;

/// Why a journal can't be kept or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// A file can't be read or written.
    #[error("{}: {source}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// What a file holds is no state of a run.
    #[error("{}: not a journal that this program can go on from ({source}); run without --resume", file.display())]
    Content {
        /// The file.
        file: PathBuf,
        /// Why not.
        source: postcard::Error,
    },
    /// There is nothing to go on from.
    #[error("{}: no run was interrupted here; run without --resume", folder.display())]
    Nothing {
        /// The folder.
        folder: PathBuf,
    },
    /// It is another run's.
    #[error(
        "{}: {changed} has changed since the run was interrupted here; run without --resume",
        folder.display()
    )]
    OtherRun {
        /// The folder.
        folder: PathBuf,
        /// The first thing that is not as it was.
        changed: String,
    },
}

/// The folder in which a run keeps what is done.
#[derive(Clone, Debug)]
pub struct Journal {
    folder: PathBuf,
    period: [Duration; 2],
    /// The folders around it that were made for it, the innermost first.
    made: Vec<PathBuf>,
}

impl Journal {
    /// A journal of a run that begins anew. `key` tells the run from others: a line `NAME: VALUE` for each thing that it depends on.
    ///
    /// # Errors
    /// The folder can't be made.
    pub fn begin(folder: &Path, key: &str) -> Result<Self, JournalError> {
        let around = folder.ancestors().skip(1).filter(|f| !f.as_os_str().is_empty());
        let made = around.take_while(|f| !f.exists()).map(Path::to_path_buf).collect();
        let journal = Self { folder: folder.to_path_buf(), period: PERIOD, made };
        journal.remove()?;
        fs::create_dir_all(folder).map_err(|source| JournalError::File { file: folder.to_path_buf(), source })?;
        journal.replace("run.key", key.as_bytes())?;
        Ok(journal)
    }

    /// The journal of a run that was interrupted.
    ///
    /// # Errors
    /// There is none, or it is another run's.
    pub fn resume(folder: &Path, key: &str) -> Result<Self, JournalError> {
        let journal = Self { folder: folder.to_path_buf(), period: PERIOD, made: Vec::new() };
        match fs::read(folder.join("run.key")) {
            Ok(was) if was == key.as_bytes() => Ok(journal),
            Ok(was) => {
                let was = String::from_utf8_lossy(&was);
                let known: Vec<&str> = was.lines().collect();
                // a line that is new, or else one that is gone
                let gone = || known.iter().copied().find(|l| key.lines().all(|k| k != *l));
                let changed = key.lines().find(|l| !known.contains(l)).or_else(gone);
                let changed = changed.and_then(|l| l.rsplit_once(": ")).map_or("what it depends on", |(name, _)| name);
                Err(JournalError::OtherRun { folder: folder.to_path_buf(), changed: changed.to_string() })
            }
            Err(_) => Err(JournalError::Nothing { folder: folder.to_path_buf() }),
        }
    }

    /// The same with another time between two states that are kept.
    #[must_use]
    pub fn keeping_every(self, period: Duration) -> Self {
        Self { period: [period; 2], ..self }
    }

    /// Removes all of it and the folders that were made for it: nothing was done that is worth to be kept.
    ///
    /// # Errors
    /// It can't be removed.
    pub fn abandon(&self) -> Result<(), JournalError> {
        self.remove()?;
        for folder in &self.made {
            // what others have put there meanwhile stays
            let _ = fs::remove_dir(folder);
        }
        Ok(())
    }

    /// Removes all of it: the run is over.
    ///
    /// # Errors
    /// It can't be removed.
    pub fn remove(&self) -> Result<(), JournalError> {
        match fs::remove_dir_all(&self.folder) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                Err(JournalError::File { file: self.folder.clone(), source })
            }
            _ => Ok(()),
        }
    }

    /// Keeps a value that is made once in a run, so that it need not be made again.
    ///
    /// # Errors
    /// It can't be written.
    pub fn keep<T: Serialize>(&self, name: &str, value: &T) -> Result<(), JournalError> {
        let bytes = self.bytes(name, value)?;
        self.replace(name, &bytes)
    }

    /// A value that was kept; `None` if it wasn't.
    ///
    /// # Errors
    /// The file is something else.
    pub fn kept<T: DeserializeOwned>(&self, name: &str) -> Result<Option<T>, JournalError> {
        let file = self.folder.join(name);
        let Ok(bytes) = fs::read(&file) else { return Ok(None) };
        postcard::from_bytes(&bytes).map(Some).map_err(|source| JournalError::Content { file, source })
    }

    /// The pages of one arm.
    pub fn arm(&self, arm: usize) -> ArmJournal<'_> {
        ArmJournal { journal: self, arm, last: Instant::now(), took: Duration::ZERO, task: None }
    }

    fn bytes<T: Serialize>(&self, name: &str, value: &T) -> Result<Vec<u8>, JournalError> {
        postcard::to_stdvec(value).map_err(|source| JournalError::Content { file: self.folder.join(name), source })
    }

    /// Writes a file as a whole: there is always the old one or the new one.
    fn replace(&self, name: &str, bytes: &[u8]) -> Result<(), JournalError> {
        let (file, new) = (self.folder.join(name), self.folder.join(format!("{name}.new")));
        let write = || {
            let mut f = File::create(&new)?;
            f.write_all(bytes)?;
            f.sync_data()?;
            fs::rename(&new, &file)
        };
        write().map_err(|source| JournalError::File { file: file.clone(), source })
    }
}

/// The pages of one arm in a journal.
pub struct ArmJournal<'a> {
    journal: &'a Journal,
    arm: usize,
    last: Instant,
    /// Time that the last writing took.
    took: Duration,
    /// The task that is written, by its number, and in which of the two files.
    task: Option<TaskPage>,
}

/// Where a task is written: there are two files in turn, so that the one that the kept state means is never replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct TaskPage {
    number: u64,
    file: u8,
}

/// A state to be kept, and the task under way in it.
pub struct Kept<S, T> {
    /// All that changes but for the task.
    pub state: S,
    /// The task under way with its number, which no other task of the arm has.
    pub task: Option<(u64, T)>,
}

/// A state that was kept, and each piece that was logged until then with the length of the log after it, bytes.
pub type Pages<S, T, L> = (Kept<S, T>, Vec<(L, u64)>);

impl ArmJournal<'_> {
    /// Whether it is time to keep a state again.
    pub fn is_due(&self) -> bool {
        let [least, most] = self.journal.period;
        self.last.elapsed() >= (self.took * SHARE).clamp(least, most)
    }

    /// The state that was kept last, and all that was written with it and before: each piece and the length of the log after it, in bytes.
    /// `None` if nothing was.
    ///
    /// # Errors
    /// The files are something else.
    pub fn read<S, T, L>(&mut self) -> Result<Option<Pages<S, T, L>>, JournalError>
    where
        S: DeserializeOwned,
        T: DeserializeOwned,
        L: DeserializeOwned,
    {
        type Page<S> = (u64, Option<TaskPage>, S);
        let Some((length, page, state)) = self.journal.kept::<Page<S>>(&self.name("state"))? else { return Ok(None) };
        let file = self.journal.folder.join(self.name("log"));
        let bytes = fs::read(&file).map_err(|source| JournalError::File { file: file.clone(), source })?;
        let content = |source| JournalError::Content { file: file.clone(), source };
        let whole = usize::try_from(length).ok().and_then(|n| bytes.get(..n));
        let mut rest = whole.ok_or_else(|| content(postcard::Error::DeserializeUnexpectedEnd))?;
        let mut pieces = Vec::new();
        while !rest.is_empty() {
            let (piece, after) = postcard::take_from_bytes(rest).map_err(content)?;
            rest = after;
            pieces.push((piece, length - rest.len() as u64));
        }
        let task = page.map(|p| Ok((p.number, self.read_task(p)?))).transpose()?;
        self.task = page;
        Ok(Some((Kept { state, task }, pieces)))
    }

    fn read_task<T: DeserializeOwned>(&self, page: TaskPage) -> Result<T, JournalError> {
        let name = self.task_name(page);
        let file = self.journal.folder.join(&name);
        let other = |source| JournalError::Content { file: file.clone(), source };
        match self.journal.kept::<(u64, T)>(&name)? {
            Some((number, task)) if number == page.number => Ok(task),
            _ => Err(other(postcard::Error::DeserializeUnexpectedEnd)),
        }
    }

    /// Appends pieces to the log after its first `from` bytes, and keeps the state after them. The length of the log then, in bytes,
    /// after each piece.
    ///
    /// # Errors
    /// The files can't be written.
    pub fn write<S: Serialize, T: Serialize, L: Serialize>(
        &mut self,
        from: u64,
        pieces: &[L],
        kept: &Kept<S, T>,
    ) -> Result<Vec<u64>, JournalError> {
        let began = Instant::now();
        let name = self.name("log");
        let (mut bytes, mut ends) = (Vec::new(), Vec::new());
        for piece in pieces {
            bytes.extend(self.journal.bytes(&name, piece)?);
            ends.push(from + bytes.len() as u64);
        }
        let file = self.journal.folder.join(&name);
        let append = || {
            let mut f = OpenOptions::new().create(true).write(true).truncate(false).open(&file)?;
            f.set_len(from)?;
            f.seek(SeekFrom::Start(from))?;
            f.write_all(&bytes)?;
            f.sync_data()
        };
        append().map_err(|source| JournalError::File { file: file.clone(), source })?;
        let length = from + bytes.len() as u64;
        let page = kept.task.as_ref().map(|(number, task)| self.write_task(*number, task)).transpose()?;
        self.journal.keep(&self.name("state"), &(length, page, &kept.state))?;
        self.task = page.or(self.task);
        (self.last, self.took) = (Instant::now(), began.elapsed());
        Ok(ends)
    }

    /// Writes a task unless it is written.
    fn write_task<T: Serialize>(&self, number: u64, task: &T) -> Result<TaskPage, JournalError> {
        if let Some(page) = self.task.filter(|p| p.number == number) {
            return Ok(page);
        }
        let page = TaskPage { number, file: self.task.map_or(0, |p| 1 - p.file) };
        self.journal.keep(&self.task_name(page), &(number, task))?;
        Ok(page)
    }

    fn task_name(&self, page: TaskPage) -> String {
        self.name(&format!("task.{}", page.file))
    }

    fn name(&self, of: &str) -> String {
        format!("arm{}.{of}", self.arm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type State = (u32, String);

    #[test]
    fn what_is_kept_is_read_and_a_long_task_is_written_once() {
        let folder = tempfile::tempdir().unwrap();
        let journal = Journal::begin(&folder.path().join("journal"), "a: 1").unwrap();
        let mut pages = journal.arm(0);
        let task = |n: u64| Some((n, vec![n as f64; 1000]));
        let state = |n: u32| (n, "state".to_string());
        let mut from = 0;
        for (n, of) in [(1, 1), (2, 1), (3, 2), (4, 5), (5, 7)] {
            let written =
                |file: &str| folder.path().join("journal").join(file).metadata().and_then(|m| m.modified()).ok();
            let before = [written("arm0.task.0"), written("arm0.task.1")];
            from = *pages.write(from, &[n], &Kept { state: state(n), task: task(of) }).unwrap().last().unwrap();
            let after = [written("arm0.task.0"), written("arm0.task.1")];
            if n == 2 {
                assert_eq!(before, after);
            }
            // a program that begins anew finds all of it
            let (kept, pieces) = journal.arm(0).read::<State, Vec<f64>, u32>().unwrap().unwrap();
            assert_eq!((kept.state, kept.task), (state(n), task(of)));
            assert_eq!(pieces.iter().map(|p| p.0).collect::<Vec<_>>(), (1..=n).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_task_that_was_begun_and_never_kept_is_no_part_of_what_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let journal = Journal::begin(&folder.path().join("journal"), "a: 1").unwrap();
        let mut pages = journal.arm(0);
        for n in 1..4 {
            pages.write(0, &[0], &Kept { state: (n, String::new()), task: Some((u64::from(n), n)) }).unwrap();
            // killed after the next task was written and before the state that means it
            let mut killed = journal.arm(0);
            killed.read::<State, u32, u32>().unwrap();
            killed.write_task(100, &9).unwrap();
            let (kept, _) = journal.arm(0).read::<State, u32, u32>().unwrap().unwrap();
            assert_eq!(kept.task, Some((u64::from(n), n)));
        }
    }
}
