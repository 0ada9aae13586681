//! What is done so far, on disk: a killed run goes on from there.
//!
//! Each arm has two files: `arm0.log`, to which what happened is appended, and `arm0.state`, which is replaced as a whole and says how
//! much of the log belongs to it. `run.key` says which run it is.
use std::fs::{self, File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Least time between two states that are kept, s: well below what a user would mind to lose.
const PERIOD: Duration = Duration::from_millis(2500);

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
    period: Duration,
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
        Self { period, ..self }
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
        ArmJournal { journal: self, arm, last: Instant::now() }
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
}

/// A state, and each piece that was logged until then with the length of the log after it, bytes.
pub type Kept<S, L> = (S, Vec<(L, u64)>);

impl ArmJournal<'_> {
    /// Whether it is time to keep a state again.
    pub fn is_due(&self) -> bool {
        self.last.elapsed() >= self.journal.period
    }

    /// The state that was kept last, and all that was written with it and before: each piece and the length of the log after it, in bytes.
    /// `None` if nothing was.
    ///
    /// # Errors
    /// The files are something else.
    pub fn read<S: DeserializeOwned, L: DeserializeOwned>(&mut self) -> Result<Option<Kept<S, L>>, JournalError> {
        let Some((length, state)) = self.journal.kept::<(u64, S)>(&self.name("state"))? else { return Ok(None) };
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
        Ok(Some((state, pieces)))
    }

    /// Appends pieces to the log after its first `from` bytes, and keeps the state after them. The length of the log then, in bytes,
    /// after each piece.
    ///
    /// # Errors
    /// The files can't be written.
    pub fn write<S: Serialize, L: Serialize>(
        &mut self,
        from: u64,
        pieces: &[L],
        state: &S,
    ) -> Result<Vec<u64>, JournalError> {
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
        self.journal.keep(&self.name("state"), &(length, state))?;
        self.last = Instant::now();
        Ok(ends)
    }

    fn name(&self, of: &str) -> String {
        format!("arm{}.{of}", self.arm)
    }
}
