//! Where in an experiment file a mistake stands.
use std::path::Path;

use crate::diagnostic::ConfigError;

/// A section of an experiment file, or an entry of one of its lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Section {
    Top,
    Set,
    Vary,
    Rate,
    Accept,
    Worst,
    Case(usize),
    Plot(usize),
}

/// The error at the line of `key` in a section, or of the section itself when the key isn't to be seen.
pub(super) fn wrong(text: &str, file: &Path, section: Section, key: &str, message: impl Into<String>) -> ConfigError {
    ConfigError::Invalid { file: file.to_path_buf(), line: line_of(text, section, key), message: message.into() }
}

/// The 1-based line of `key` in a section.
fn line_of(text: &str, section: Section, key: &str) -> usize {
    let (name, index) = match section {
        Section::Top => ("", 0),
        Section::Set => ("set", 0),
        Section::Vary => ("vary", 0),
        Section::Rate => ("rate", 0),
        Section::Accept => ("accept", 0),
        Section::Worst => ("worst", 0),
        Section::Case(i) => ("case", i),
        Section::Plot(i) => ("plot", i),
    };
    let leaf = key.rsplit('.').next().unwrap_or(key);
    let (mut header, mut seen, mut start) = (String::new(), 0, None);
    let (mut by_name, mut by_leaf) = (None, None);
    for (number, line) in text.lines().enumerate().map(|(i, l)| (i + 1, l.trim())) {
        if let Some(head) = line.strip_prefix('[') {
            let is_item = head.starts_with('[');
            header = head.split(']').next().unwrap_or("").trim_matches(['[', ' ']).to_string();
            if header == name {
                seen += usize::from(is_item);
                if !is_item || seen == index + 1 {
                    start.get_or_insert(number);
                }
            }
        }
        let table = header.split('.').next().unwrap_or("");
        let here = match name {
            "" => header.is_empty() || header == key,
            // `set.pen.kind = ...` may stand at the top
            _ => table == name && (seen == 0 || seen == index + 1) || header.is_empty() && line.starts_with(name),
        };
        if !here || line.starts_with('#') {
            continue;
        }
        // `key = ...`, or a key in an inline table, or `[vary.control]` with `speed_mm_s` in it
        let name_here = line.split('=').next().unwrap_or("").trim().trim_matches(['"', '\'']);
        if name_here == key {
            return number;
        }
        let quoted = |q: char| line.contains(&format!("{q}{key}{q}"));
        if quoted('"') || quoted('\'') || (key.contains('.') && line.contains(key)) {
            by_name.get_or_insert(number);
        } else if !leaf.is_empty() && (name_here == leaf || leaf.len() > 2 && line.contains(leaf)) {
            by_leaf.get_or_insert(number);
        }
    }
    by_name.or(by_leaf).or(start).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_a_key_is_found_in_its_section() {
        let text = "name = 'x'\nseed = 1\n[set]\n\"control.speed_mm_s\" = 3\n[vary.control]\ndamping_ratio = [1]\n\
                    [[case]]\nname = 'a'\nset = { \"pen.kind\" = 'm' }\n[[case]]\nname = 'b'\n[case.set]\n\"pen.kind\" = 'n'\n\
                    [[plot]]\nkind = 'curve'\n[worst]\nmetric = 'line'\nn = 0\n";
        for (section, key, line) in [
            (Section::Top, "seed", 2),
            (Section::Set, "control.speed_mm_s", 4),
            (Section::Vary, "control.damping_ratio", 6),
            (Section::Case(0), "pen.kind", 9),
            (Section::Case(1), "pen.kind", 13),
            (Section::Case(1), "absent", 10),
            (Section::Plot(0), "metric", 14),
            (Section::Plot(1), "metric", 1),
            (Section::Worst, "n", 18),
        ] {
            assert_eq!(line_of(text, section, key), line, "{section:?} {key}");
        }
    }
}
