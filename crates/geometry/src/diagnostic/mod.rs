//! TOML text to typed values, with one clear message for a user's mistake: file, line, and what would be right.
//!
//! Every TOML file of the project is read here. Types that are read use `#[serde(deny_unknown_fields)]`, so that a
//! misspelt key is refused with the nearest known one.
mod changes;

pub use changes::Changes;

use crate::files;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

/// A configuration file that can't be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// It can't be read at all.
    #[error("{}: {source}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Its text is wrong.
    #[error("{}:{line}: {message}", file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// 1-based line.
        line: usize,
        /// What is wrong and what would be right.
        message: String,
    },
    /// Its text is wrong once another file has changed it.
    #[error("{}, changed: {message}", file.display())]
    Changed {
        /// The file.
        file: PathBuf,
        /// What is wrong and what would be right.
        message: String,
    },
}

/// Reads and parses a TOML file.
pub fn read<T: DeserializeOwned>(file: &Path) -> Result<T, ConfigError> {
    let text = files::read_text(file).map_err(|source| ConfigError::Unreadable { file: file.to_path_buf(), source })?;
    parse(&text, file)
}

/// Parses TOML text; `file` is named in errors.
pub fn parse<T: DeserializeOwned>(text: &str, file: &Path) -> Result<T, ConfigError> {
    toml::from_str(text).map_err(|e| ConfigError::Invalid {
        file: file.to_path_buf(),
        line: line_of(text, e.span().map_or(0, |s| place_of_error(text, s.start, e.message()))),
        message: explain(e.message()),
    })
}

/// An error at the line where `key` (a dotted path such as `control.damping_ratio`) is set, or at its table, or at
/// line 1.
pub fn invalid(text: &str, file: &Path, key: &str, message: impl Into<String>) -> ConfigError {
    ConfigError::Invalid { file: file.to_path_buf(), line: line_of_key(text, key), message: message.into() }
}

/// Where an error is that is said to be at `start`: of an unknown key in a table with a `kind`, only the table is known.
fn place_of_error(text: &str, start: usize, message: &str) -> usize {
    let Some(key) = message.strip_prefix("unknown field `").and_then(|rest| rest.split('`').next()) else {
        return start;
    };
    let rest = text.get(start..).unwrap_or_default();
    if rest.trim_start_matches(['"', '\'']).starts_with(key) {
        return start;
    }
    let sets_key = |line: &&str| line.trim_start().strip_prefix(key).is_some_and(|l| l.trim_start().starts_with('='));
    rest.split_inclusive('\n').find(sets_key).map_or(start, |line| line.as_ptr() as usize - text.as_ptr() as usize)
}

/// The 1-based line of a byte offset.
fn line_of(text: &str, offset: usize) -> usize {
    text.as_bytes().iter().take(offset).filter(|b| **b == b'\n').count() + 1
}

/// The 1-based line on which a dotted key is set, or its table, or 1. A number among its parts counts in a list, from 0; without
/// one it is the first item of a list that has the key.
pub fn line_of_key(text: &str, key: &str) -> usize {
    let (table, _) = DeTable::parse_recoverable(text);
    line_of(text, place_of_key(table.get_ref(), key).unwrap_or(0))
}

fn place_of_key(table: &DeTable, key: &str) -> Option<usize> {
    table.iter().find_map(|(name, value)| {
        let (rest, here) = (key.strip_prefix(name.get_ref().as_ref())?, name.span().start);
        if rest.is_empty() {
            Some(here)
        } else {
            Some(place_inside(value.get_ref(), rest.strip_prefix('.')?).unwrap_or(here))
        }
    })
}

fn place_inside(value: &DeValue, key: &str) -> Option<usize> {
    match value {
        DeValue::Table(table) => place_of_key(table, key),
        DeValue::Array(list) => {
            match key.split_once('.').and_then(|(n, rest)| Some((n.parse::<usize>().ok()?, rest))) {
                Some((n, rest)) => list.get(n).and_then(|item| place_inside(item.get_ref(), rest)),
                None => list.iter().find_map(|item| place_inside(item.get_ref(), key)),
            }
        }
        _ => None,
    }
}

/// The known word nearest to a misspelt one, when one is near enough to be meant.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|k| (strsim::damerau_levenshtein(word, k), k))
        .filter(|(d, k)| *d <= 1 + k.len() / 3)
        .min_by_key(|(d, _)| *d)
        .map(|(_, k)| k)
}

/// Turns serde's "unknown field/variant" into a hint at the nearest known word.
pub fn explain(message: &str) -> String {
    let words: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let kind = if message.starts_with("unknown field") {
        "key"
    } else if message.starts_with("unknown variant") {
        "value"
    } else {
        return message.trim().to_string();
    };
    let Some((wrong, known)) = words.split_first() else { return message.to_string() };
    match nearest(wrong, known.iter().copied()) {
        Some(near) => format!("unknown {kind} `{wrong}`: did you mean `{near}`?"),
        None if known.is_empty() => format!("unknown {kind} `{wrong}`: there is none here"),
        None => format!("unknown {kind} `{wrong}`: known are {}", known.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Pen {
        press_depth_mm: f64,
    }
    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct File {
        name: String,
        pen: Pen,
    }

    #[test]
    fn a_misspelt_key_is_refused_with_line_and_nearest_key() {
        let e = parse::<File>("name = 'a'\n[pen]\npres_depth_mm = 3\n", Path::new("x.toml")).unwrap_err();
        assert_eq!(e.to_string(), "x.toml:3: unknown key `pres_depth_mm`: did you mean `press_depth_mm`?");
    }

    #[test]
    fn a_key_is_found_in_its_table() {
        let text = "name = 'a'\nspeed = 2\n[pen]\nspeed = 1\n[a.b]\nc = 1\n";
        assert_eq!(line_of_key(text, "pen.speed"), 4);
        assert_eq!(line_of_key(text, "speed"), 2);
        assert_eq!(line_of_key(text, "a.b.c"), 6);
        assert_eq!(line_of_key(text, "pen.missing"), 3);
        assert_eq!(line_of_key(text, "missing"), 1);
    }

    #[test]
    fn a_key_is_found_in_inline_tables_quoted_names_and_lists() {
        let text = "[a]\nb = { c = 1, 'd.e' = 2 }\nf.g = 3\n'h.i' = { max = 4 }\n[[l]]\nx = 1\n[[l]]\ny = 2\nx = 3\n";
        for (key, line) in
            [("a.b.c", 2), ("a.b.d.e", 2), ("a.f.g", 3), ("a.h.i.max", 4), ("l.x", 6), ("l.y", 8), ("l.1.x", 9)]
        {
            assert_eq!(line_of_key(text, key), line, "{key}");
        }
    }

    #[test]
    fn an_unknown_key_of_a_tagged_table_is_found_too() {
        #[derive(Debug, Deserialize)]
        #[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
        #[allow(dead_code)]
        enum Shape {
            Dome { radius: f64 },
            Point {},
        }
        #[derive(Debug, Deserialize)]
        #[allow(dead_code)]
        struct Shapes {
            shape: Shape,
        }
        let error = |text: &str| parse::<Shapes>(text, Path::new("x.toml")).unwrap_err().to_string();
        assert_eq!(
            error("[shape]\nkind = 'dome'\nradius = 1\nradus = 2\n"),
            "x.toml:4: unknown key `radus`: did you mean `radius`?"
        );
        assert_eq!(error("[shape]\nkind = 'point'\nr = 1\n"), "x.toml:3: unknown key `r`: there is none here");
    }
}
