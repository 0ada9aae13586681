//! The one door through which input files are read, so that what a result depends on is known.
//!
//! Whoever has to know calls [`listened`]: it reports every file that was read meanwhile on the same thread, with a digest of its bytes.
//! `tests/architecture` sees to it that nothing else opens input files.
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use crate::math::Digest;

/// Files that were read, each with the digest of its bytes.
pub type FilesRead = BTreeMap<PathBuf, String>;

thread_local! {
    /// Who listens on this thread, the innermost last.
    static LISTENERS: RefCell<Vec<FilesRead>> = const { RefCell::new(Vec::new()) };
}

/// The bytes of a file.
///
/// # Errors
/// It can't be read.
pub fn read(file: &Path) -> io::Result<Vec<u8>> {
    let bytes = std::fs::read(file)?;
    report(file, &bytes);
    Ok(bytes)
}

/// The text of a file in UTF-8.
///
/// # Errors
/// It can't be read, or is not UTF-8 (`InvalidData`).
pub fn read_text(file: &Path) -> io::Result<String> {
    let text = std::fs::read_to_string(file)?;
    report(file, text.as_bytes());
    Ok(text)
}

/// What is in a folder, by name. Only what is read of it is reported.
///
/// # Errors
/// It can't be read.
pub fn folder(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<_>>>()?;
    found.sort();
    Ok(found)
}

/// What `work` gives, and the files that it read on this thread.
pub fn listened<T>(work: impl FnOnce() -> T) -> (T, FilesRead) {
    /// Stops listening also where `work` panics.
    struct Guard;
    impl Drop for Guard {
        fn drop(&mut self) {
            LISTENERS.with_borrow_mut(Vec::pop);
        }
    }
    LISTENERS.with_borrow_mut(|l| l.push(FilesRead::new()));
    let guard = Guard;
    let result = work();
    let read = LISTENERS.with_borrow_mut(|l| l.last_mut().map(std::mem::take)).unwrap_or_default();
    drop(guard);
    (result, read)
}

fn report(file: &Path, bytes: &[u8]) {
    LISTENERS.with_borrow_mut(|listeners| {
        if listeners.is_empty() {
            return;
        }
        let digest = Digest::new().bytes(bytes).hex();
        for l in listeners {
            l.insert(file.to_path_buf(), digest.clone());
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_is_reported_to_all_who_listen() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b] = ["a.txt", "b.bin"].map(|n| dir.path().join(n));
        std::fs::write(&a, "one").unwrap();
        std::fs::write(&b, [0xff, 0xfe]).unwrap();
        let ((inner, text), outer) = listened(|| {
            let text = read_text(&a).unwrap();
            (listened(|| read(&b).unwrap()).1, text)
        });
        assert_eq!((text.as_str(), inner.len(), outer.len()), ("one", 1, 2));
        assert_eq!(inner[&b], outer[&b]);
        assert_eq!(read_text(&b).unwrap_err().kind(), io::ErrorKind::InvalidData);
        std::fs::write(&a, "two").unwrap();
        assert_ne!(listened(|| read(&a).unwrap()).1[&a], outer[&a]);
        assert_eq!(listened(|| folder(dir.path()).unwrap()), (vec![a, b], FilesRead::new()));
    }
}
