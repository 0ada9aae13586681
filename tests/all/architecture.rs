//! The table in ARCHITECTURE.md is law: no room uses a room or a crate that the table doesn't give it.
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Longest file that is still one noun.
const LINES: usize = 800;

/// The crates that rooms live in, each with its folder.
const CRATES: [(&str, &str); 5] = [
    ("geometry", "crates/geometry"),
    ("drawing", "crates/drawing"),
    ("robot", "crates/robot"),
    ("twin", "crates/twin"),
    ("root", "."),
];

struct Room {
    lives_in: String,
    may_use: BTreeSet<String>,
    owns: BTreeSet<String>,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The rows of the table of rooms.
fn rooms() -> BTreeMap<String, Room> {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let mut rooms = BTreeMap::new();
    for row in text.lines().filter(|l| l.starts_with("| `")) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let [room, lives_in, _, uses, owns] = cells[..] else { panic!("a row has five cells: {row}") };
        let may_use = uses.split_whitespace().filter(|w| *w != "-").map(str::to_string).collect();
        let owns = owns.split('`').skip(1).step_by(2).map(str::to_string).collect();
        rooms.insert(room.trim_matches('`').to_string(), Room { lives_in: lives_in.to_string(), may_use, owns });
    }
    assert!(rooms.len() > 10, "the table of rooms wasn't found");
    rooms
}

struct Source {
    /// The file, from its crate's `src`.
    file: PathBuf,
    lives_in: &'static str,
    room: String,
    text: String,
}

/// Every source file with its crate and room; `lib.rs` and `main.rs` are the doors and belong to none.
fn sources() -> Vec<Source> {
    fn walk(folder: &Path, files: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, files);
            } else if path.extension().is_some_and(|e| e == "rs") {
                files.push(path);
            }
        }
    }
    let mut sources = Vec::new();
    for (lives_in, folder) in CRATES {
        let src = root().join(folder).join("src");
        let mut files = Vec::new();
        walk(&src, &mut files);
        files.sort();
        for path in files {
            let file = path.strip_prefix(&src).unwrap().to_path_buf();
            let room = file.components().next().unwrap().as_os_str().to_str().unwrap().to_string();
            if !room.ends_with(".rs") {
                let text = fs::read_to_string(&path).unwrap();
                sources.push(Source { file, lives_in, room, text });
            }
        }
    }
    sources
}

/// Names of the dependencies of a crate, as paths in code spell them.
fn dependencies(folder: &str) -> BTreeSet<String> {
    let text = fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap();
    let manifest: toml::Table = toml::from_str(&text).unwrap();
    manifest["dependencies"].as_table().unwrap().keys().map(|name| name.replace('-', "_")).collect()
}

/// The code of a file, without comments and without what stands under `#[cfg(test)]` at its foot; nothing of a file
/// that holds only tests.
fn code(path: &Path, text: &str) -> String {
    let stem = path.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    if stem == "tests" || stem.ends_with("_tests") || stem == "sample" {
        return String::new();
    }
    let mut kept = String::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if line.trim() == "#[cfg(test)]" {
            // an inline module of tests ends the file; `mod tests;` is one line
            if lines.next().is_some_and(|l| l.trim_end().ends_with('{')) {
                break;
            }
            continue;
        }
        kept.push_str(line.split("//").next().unwrap());
        kept.push('\n');
    }
    kept
}

/// The word at the start of `text`.
fn word(text: &str) -> &str {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or("")
}

/// The rooms named by `crate::room` and `use crate::{room::..., room::...}`, and the same after a crate's name.
fn rooms_used(code: &str) -> BTreeSet<String> {
    let doors = CRATES.iter().map(|(name, _)| format!("calamus_{name}::")).chain(["crate::".to_string()]);
    let mut used = BTreeSet::new();
    for (at, door) in doors.flat_map(|d| code.match_indices(&d).map(|(at, door)| (at, door.len())).collect::<Vec<_>>())
    {
        if code[..at].ends_with('$') {
            continue;
        }
        let rest = &code[at + door..];
        if let Some(group) = rest.strip_prefix('{') {
            let (mut depth, mut start) = (0, true);
            for (i, c) in group.char_indices() {
                match c {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' if depth == 0 => start = true,
                    c if depth == 0 && start && !c.is_whitespace() => {
                        used.insert(word(&group[i..]).to_string());
                        start = false;
                    }
                    _ => {}
                }
            }
        } else {
            used.insert(word(rest).to_string());
        }
    }
    used
}

/// Whether `name::` or `use name` stands in the code as a path of its own.
fn uses_crate(code: &str, name: &str) -> bool {
    code.match_indices(name).any(|(at, _)| {
        let before = code[..at].chars().next_back();
        let fresh = before.is_none_or(|c| !(c.is_alphanumeric() || c == '_' || c == ':' || c == '.'));
        let after = &code[at + name.len()..];
        fresh
            && (after.starts_with("::") || (code[..at].ends_with("use ") && !after.starts_with(char::is_alphanumeric)))
    })
}

#[test]
fn rooms_use_only_the_rooms_that_the_table_gives_them() {
    let rooms = rooms();
    let mut wrong = Vec::new();
    for Source { file, lives_in, room, text } in sources() {
        let Some(here) = rooms.get(&room) else {
            wrong.push(format!("{}: the table has no room `{room}`", file.display()));
            continue;
        };
        if here.lives_in != lives_in {
            wrong.push(format!("{}: `{room}` lives in {}, not in {lives_in}", file.display(), here.lives_in));
        }
        for used in rooms_used(&code(&file, &text)) {
            if used != room && !here.may_use.contains(&used) {
                wrong.push(format!("{}: `{room}` may not use `{used}`", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn arrows_run_one_way() {
    let rooms = rooms();
    let mut done: BTreeSet<&str> = BTreeSet::new();
    while done.len() < rooms.len() {
        let ready = |r: &&Room| r.may_use.iter().all(|u| done.contains(u.as_str()));
        let next: Vec<&str> =
            rooms.iter().filter(|(n, r)| !done.contains(n.as_str()) && ready(r)).map(|(n, _)| n.as_str()).collect();
        assert!(!next.is_empty(), "the rooms left over use each other in a circle: done {done:?}");
        done.extend(next);
    }
}

#[test]
fn crates_depend_on_what_their_rooms_use_and_a_robot_on_nothing_true() {
    let rooms = rooms();
    let mut wrong = Vec::new();
    for (name, folder) in CRATES {
        let here = || rooms.values().filter(|r| r.lives_in == name);
        assert!(here().count() > 0, "no room lives in {name}");
        let desired: BTreeSet<String> = here()
            .flat_map(|r| r.may_use.iter().map(|u| rooms[u].lives_in.as_str()))
            .filter(|c| *c != name)
            .map(|c| format!("calamus_{c}"))
            .chain(here().flat_map(|r| r.owns.iter().cloned()).filter(|o| o != "schemars"))
            .collect();
        let all_owned: BTreeSet<&String> = rooms.values().flat_map(|r| &r.owns).filter(|o| *o != "schemars").collect();
        let has = dependencies(folder);
        for d in has.iter().filter(|d| d.starts_with("calamus_") || all_owned.contains(d)) {
            if !desired.contains(d) {
                wrong.push(format!("{folder}/Cargo.toml: no room of {name} may use `{d}`"));
            }
        }
        wrong.extend(desired.difference(&has).map(|d| format!("{folder}/Cargo.toml: `{d}` isn't there")));
    }
    assert!(!dependencies("crates/robot").contains("calamus_twin"), "a robot may not know what is true");
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn crates_stay_in_the_rooms_that_own_them() {
    let mut owners: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (name, room) in rooms() {
        for owned in room.owns.into_iter().filter(|o| o != "schemars") {
            owners.entry(owned).or_default().insert(name.clone());
        }
    }
    owners.insert("toml".into(), ["diagnostic".to_string(), "scenario".to_string()].into());
    let mut wrong = Vec::new();
    for Source { file, room, text, .. } in sources() {
        let code = code(&file, &text);
        for (name, at) in &owners {
            if !at.contains(&room) && uses_crate(&code, name) {
                wrong.push(format!("{}: only {at:?} may use the crate `{name}`", file.display()));
            }
        }
        let prints = ["println!", "print!(", "eprintln!", "eprint!(", "dbg!("];
        if room != "cli" && prints.iter().any(|p| code.contains(p)) {
            wrong.push(format!("{}: only `cli` prints", file.display()));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn files_hold_one_noun() {
    for Source { file, text, .. } in sources() {
        let lines = text.lines().count();
        assert!(lines <= LINES, "{} has {lines} lines: make it two files", file.display());
    }
}

#[test]
fn nothing_is_left_for_later() {
    for Source { file, text, .. } in sources() {
        for mark in ["todo!", "unimplemented!", "TODO", "FIXME", "#[ignore"] {
            assert!(!text.contains(mark), "{} has `{mark}`", file.display());
        }
    }
}

#[test]
fn the_reader_of_this_test_sees_groups_and_paths() {
    let used = rooms_used(
        "use crate::{math::{Pose, Rgb}, mesh::TriMesh};\nlet x = crate::ink::f();\n$crate::no; calamus_twin::truth::x",
    );
    assert_eq!(used.into_iter().collect::<Vec<_>>(), ["ink", "math", "mesh", "truth"]);
    assert!(uses_crate("use toml::Table;", "toml") && uses_crate(" x = toml::from_str(y)", "toml"));
    assert!(!uses_crate("s.to_toml::<T>()", "toml") && !uses_crate("my::toml::x", "toml"));
    assert_eq!(
        code(Path::new("a.rs"), "a // crate::x\n#[cfg(test)]\nmod tests;\nb\n#[cfg(test)]\nmod tests {\nc"),
        "a \nb\n"
    );
}

/// Files that may open files by themselves: the door for inputs, and what the program keeps for itself.
const OPENERS: [&str; 6] = [
    "files/mod.rs",
    "exec/journal.rs",
    "experiment/journal.rs",
    "report/file_list.rs",
    "report/output.rs",
    "reach/mod.rs",
];

#[test]
fn input_files_are_read_through_one_door() {
    let mut wrong = Vec::new();
    for Source { file, text, .. } in sources() {
        if OPENERS.iter().any(|o| file == Path::new(o)) {
            continue;
        }
        let code = code(&file, &text);
        for way in ["fs::read", "File::open", "File::options", "OpenOptions", "read_dir", "load_file", "include_dir"] {
            if code.contains(way) {
                wrong.push(format!("{}: {way}", file.display()));
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "read input files by `files`, so that results know what they depend on:\n{}",
        wrong.join("\n")
    );
}
