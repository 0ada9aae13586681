//! The folder that a run writes into: checked before the work, and never holding half a file.
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

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
        Ok(Self { path: path.to_path_buf() })
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
        let partial = self.path.join(format!(".{name}.{}", std::process::id()));
        let written = fs::create_dir_all(&self.path).and_then(|()| File::create(&partial)).and_then(|f| {
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
}
