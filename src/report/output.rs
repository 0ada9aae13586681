//! The folder that a run writes into: checked before the work, and never holding half a file.
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use super::file_list;

/// The command whose files lie in a folder itself, whatever else is there.
const RUN: &str = "run";

/// A folder or file that can't be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: can't be written: {source}", path.display())]
pub struct OutputError {
    /// The folder or file.
    pub path: PathBuf,
    /// Why.
    pub source: io::Error,
}

/// A folder for outputs. It is made with the first file, so that a run which ends before leaves nothing behind.
#[derive(Clone, Debug)]
pub struct OutputDir {
    path: PathBuf,
    /// Where the files that are written are listed, if they are.
    list: Option<PathBuf>,
}

impl OutputDir {
    /// Checks that files can be written into `path`, or that it can be made, and leaves no trace of the check.
    pub fn check(path: &Path) -> Result<Self, OutputError> {
        let error = |path: &Path, source| OutputError { path: path.to_path_buf(), source };
        let absolute = std::path::absolute(path).map_err(|e| error(path, e))?;
        let there = absolute.ancestors().find(|p| p.exists()).unwrap_or(Path::new("/"));
        if !there.is_dir() {
            return Err(error(there, io::Error::from(io::ErrorKind::NotADirectory)));
        }
        // several runs of one process may look at one folder at a time
        static PROBES: AtomicU64 = AtomicU64::new(0);
        let number = PROBES.fetch_add(1, Ordering::Relaxed);
        let probe = there.join(format!(".calamus-{}-{number}", std::process::id()));
        File::create_new(&probe).and_then(|_| fs::remove_file(&probe)).map_err(|e| error(there, e))?;
        file_list::sweep(&absolute);
        Ok(Self { path: path.to_path_buf(), list: None })
    }

    /// The folder for a command's files: without those that it left there before, and apart from other commands'. In a folder that
    /// holds others' files, `run` moves these each into one of its own (`draw`), and the files of other commands go there at once.
    ///
    /// # Errors
    /// Old files can't be removed or moved.
    pub fn begin(&self, command: &str) -> Result<Self, OutputError> {
        let others: Vec<String> = file_list::commands(&self.path).into_iter().filter(|c| c != command).collect();
        if command == RUN {
            let moved = others.iter().try_for_each(|other| file_list::move_apart(&self.path, other));
            moved.map_err(|source| OutputError { path: self.path.clone(), source })?;
        } else if !others.is_empty() {
            return Self { path: self.path.join(command), list: None }.renewed(command);
        }
        self.renewed(command)
    }

    /// The folder for a command's files, without those that it left there before.
    ///
    /// # Errors
    /// Old files can't be removed.
    pub fn renewed(&self, command: &str) -> Result<Self, OutputError> {
        let cleared = file_list::clear(&self.path, command);
        cleared.map_err(|source| OutputError { path: self.path.clone(), source })?;
        file_list::sweep(&self.path);
        Ok(Self { path: self.path.clone(), list: Some(file_list::list(&self.path, command)) })
    }

    /// Lists a folder of a run in this one as its own.
    ///
    /// # Errors
    /// The list can't be written.
    pub fn own(&self, folder: &str) -> Result<(), OutputError> {
        let Some(list) = &self.list else { return Ok(()) };
        let noted = fs::create_dir_all(&self.path).and_then(|()| file_list::note(list, folder));
        noted.map_err(|source| OutputError { path: self.path.clone(), source })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes `name` whole: under a temporary name first, which then takes the place of what was there.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<PathBuf, OutputError> {
        self.write_with(name, |w| w.write_all(bytes))
    }

    /// [`OutputDir::write`] by a function that writes piece by piece.
    pub fn write_with(
        &self,
        name: &str,
        fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
    ) -> Result<PathBuf, OutputError> {
        let file = self.path.join(name);
        let partial = self.path.join(file_list::partial(name));
        let listed = || self.list.as_ref().map_or(Ok(()), |list| file_list::note(list, name));
        let made = fs::create_dir_all(&self.path).and_then(|()| listed());
        let written = made.and_then(|()| File::create(&partial)).and_then(|f| {
            let mut w = BufWriter::new(f);
            fill(&mut w)?;
            w.flush()?;
            drop(w);
            fs::rename(&partial, &file)
        });
        match written {
            Ok(()) => Ok(file),
            Err(source) => {
                // what is left of the attempt helps nobody; the first error is the one to tell
                let _ = fs::remove_file(&partial);
                Err(OutputError { path: file, source })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_check_leaves_nothing_behind() {
        let dir = tempfile::tempdir().unwrap();
        let out = OutputDir::check(&dir.path().join("a/b")).unwrap();
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
        assert_eq!(out.write("x.txt", b"1").unwrap(), dir.path().join("a/b/x.txt"));
        assert_eq!(fs::read_dir(out.path()).unwrap().count(), 1);
    }

    #[test]
    fn checks_at_one_time_do_not_meet() {
        let dir = tempfile::tempdir().unwrap();
        std::thread::scope(|s| {
            for i in 0..8 {
                let path = dir.path().join(i.to_string());
                s.spawn(move || (0..200).for_each(|_| drop(OutputDir::check(&path).unwrap())));
            }
        });
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_file_in_the_way_is_refused_before_work() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("file");
        fs::write(&file, "").unwrap();
        for path in [file.clone(), file.join("out")] {
            let error = OutputDir::check(&path).unwrap_err();
            assert!(error.to_string().starts_with(&format!("{}: can't be written: ", file.display())), "{error}");
        }
    }

    #[test]
    fn a_failed_write_keeps_the_old_file_and_no_scrap() {
        let dir = tempfile::tempdir().unwrap();
        let out = OutputDir::check(dir.path()).unwrap();
        out.write("x.txt", b"old").unwrap();
        let failed = out.write_with("x.txt", |w| {
            w.write_all(b"ne")?;
            Err(io::Error::other("disk full"))
        });
        assert!(failed.unwrap_err().to_string().ends_with("disk full"));
        assert_eq!(fs::read(dir.path().join("x.txt")).unwrap(), b"old");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn commands_keep_apart_and_the_new_takes_the_place_of_the_old() {
        let dir = tempfile::tempdir().unwrap();
        let out = OutputDir::check(dir.path()).unwrap();
        let read = |name: &str| fs::read_to_string(dir.path().join(name)).unwrap_or_default();
        out.begin("draw").unwrap().write("metrics.json", b"drawn").unwrap();
        let run = out.begin("run").unwrap();
        run.write("metrics.json", b"run").unwrap();
        run.write("view.png", b"").unwrap();
        assert_eq!([read("metrics.json"), read("draw/metrics.json")], ["run", "drawn"]);
        out.begin("draw").unwrap().write("metrics.json", b"drawn again").unwrap();
        assert_eq!([read("metrics.json"), read("draw/metrics.json")], ["run", "drawn again"]);
        fs::write(dir.path().join("mine.txt"), "mine").unwrap();
        out.begin("run").unwrap().write("metrics.json", b"run again").unwrap();
        assert!(!dir.path().join("view.png").exists());
        assert_eq!([read("metrics.json"), read("mine.txt")], ["run again", "mine"]);
    }
}
