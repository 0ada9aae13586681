//! Names the build: a digest of all sources and of the compiler, so that a run or an experiment is only gone on with by the program that
//! began it.
use std::fs;
use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What results depend on, relative to the package.
const SOURCES: [&str; 6] = ["Cargo.toml", "Cargo.lock", "build.rs", "src", "crates", "shaders"];

fn main() {
    let mut files = Vec::new();
    for source in SOURCES {
        println!("cargo:rerun-if-changed={source}");
        walk(Path::new(source), &mut files);
    }
    files.sort();
    let mut hash = DefaultHasher::new();
    for file in &files {
        // a file that went away meanwhile is a change of the folder, which runs this again
        let bytes = fs::read(file).unwrap_or_default();
        hash.write(file.to_string_lossy().replace('\\', "/").as_bytes());
        hash.write(&(bytes.len() as u64).to_le_bytes());
        hash.write(&bytes);
    }
    let compiler = std::env::var_os("RUSTC").and_then(|rustc| Command::new(rustc).arg("--version").output().ok());
    hash.write(&compiler.map(|o| o.stdout).unwrap_or_default());
    println!("cargo:rustc-env=CALAMUS_BUILD={:016x}", hash.finish());
}

/// All files below a path, without those that a build or an editor leaves.
fn walk(path: &Path, files: &mut Vec<PathBuf>) {
    if path.is_file() {
        files.push(path.to_path_buf());
        return;
    }
    let Ok(entries) = fs::read_dir(path) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name != "target" && !name.starts_with('.') && !name.ends_with('~') {
            walk(&entry.path(), files);
        }
    }
}
