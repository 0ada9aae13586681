//! Which files in a folder a command wrote, so that old and new never mix: a hidden list beside them, written before they are.
use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Component, Path, PathBuf};

/// What the names of lists begin with; the command follows.
const LIST: &str = ".calamus-files-";
/// What the names of files begin with that are being written; the process and the name follow.
const PARTIAL: &str = ".calamus-";

/// The list of a command's files in a folder.
pub(super) fn list(folder: &Path, command: &str) -> PathBuf {
    folder.join(format!("{LIST}{command}"))
}

/// The name under which this process writes a file.
pub(super) fn partial(name: &str) -> String {
    format!("{PARTIAL}{}-{}", std::process::id(), name.replace('/', "-"))
}

/// The commands that have files in a folder.
pub(super) fn commands(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.filter_map(|e| Some(e.file_name().to_str()?.strip_prefix(LIST)?.to_string()));
    let mut commands: Vec<String> = names.collect();
    commands.sort();
    commands
}

/// Adds a file to a list, before it is there.
pub(super) fn note(list: &Path, name: &str) -> io::Result<()> {
    let mut file = OpenOptions::new().create(true).append(true).open(list)?;
    file.write_all(format!("{name}\n").as_bytes())
}

/// The listed files. A list that was written into by someone else leads nowhere outside its folder.
fn listed(folder: &Path, command: &str) -> Vec<String> {
    let text = fs::read_to_string(list(folder, command)).unwrap_or_default();
    let inside =
        |name: &&str| !name.is_empty() && Path::new(name).components().all(|c| matches!(c, Component::Normal(_)));
    text.lines().filter(inside).map(str::to_string).collect()
}

/// Removes a command's files, the folders of runs among them, and its list.
pub(super) fn clear(folder: &Path, command: &str) -> io::Result<()> {
    for name in listed(folder, command) {
        let file = folder.join(name);
        if file.is_dir() {
            commands(&file).iter().try_for_each(|c| clear(&file, c))?;
            // what someone else has put there stays
            let _ = fs::remove_dir(&file);
            let _ = file.parent().filter(|p| *p != folder).map(fs::remove_dir);
        } else {
            gone(fs::remove_file(&file))?;
        }
    }
    gone(fs::remove_file(list(folder, command)))
}

/// Moves a command's files, and its list, into a folder of its own in this one.
pub(super) fn move_apart(folder: &Path, command: &str) -> io::Result<()> {
    let apart = folder.join(command);
    fs::create_dir_all(&apart)?;
    for name in listed(folder, command) {
        gone(fs::rename(folder.join(&name), apart.join(&name)))?;
    }
    fs::rename(list(folder, command), list(&apart, command))
}

/// Removes what processes that are no more have left half written.
pub(super) fn sweep(folder: &Path) {
    let is_dead = |process: u32| {
        let processes = Path::new("/proc");
        process != std::process::id() && processes.is_dir() && !processes.join(process.to_string()).exists()
    };
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let writer = name.to_str().and_then(|n| n.strip_prefix(PARTIAL)?.split_once('-')?.0.parse().ok());
        if writer.is_some_and(is_dead) {
            // another may have swept it meanwhile
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// A file that isn't there is as gone as one that was removed.
fn gone(removed: io::Result<()>) -> io::Result<()> {
    removed.or_else(|e| if e.kind() == io::ErrorKind::NotFound { Ok(()) } else { Err(e) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_listed_goes_and_all_else_stays() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        let file = |name: &str| {
            let file = folder.join(name);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, "").unwrap();
        };
        ["a.png", "mine.txt", "worst/trial-1/b.png"].into_iter().for_each(file);
        let list_of = list(folder, "experiment");
        for name in ["a.png", "never-written.png", "worst/trial-1", "../x", "/etc/x", ""] {
            note(&list_of, name).unwrap();
        }
        note(&list(&folder.join("worst/trial-1"), "run"), "b.png").unwrap();
        assert_eq!(commands(folder), ["experiment"]);
        clear(folder, "experiment").unwrap();
        let left: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(left, ["mine.txt"]);
    }

    #[test]
    fn only_what_the_dead_left_is_swept() {
        let dir = tempfile::tempdir().unwrap();
        let own = partial("x.png");
        for name in [own.as_str(), ".calamus-4294967295-x.png", ".calamus-files-run", ".x.png"] {
            fs::write(dir.path().join(name), "").unwrap();
        }
        sweep(dir.path());
        let there = |name: &str| dir.path().join(name).exists();
        assert!(there(&own) && there(".calamus-files-run") && there(".x.png"));
        assert_eq!(there(".calamus-4294967295-x.png"), !Path::new("/proc").is_dir());
    }
}
