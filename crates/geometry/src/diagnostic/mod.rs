//! TOML text to typed values, with one clear message for a user's mistake: file, line, and what would be right.
//!
//! Every TOML file of the project is read here. Types that are read use `#[serde(deny_unknown_fields)]`, so that a
//! misspelt key is refused with the nearest known one.
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

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
}

/// Reads and parses a TOML file.
pub fn read<T: DeserializeOwned>(file: &Path) -> Result<T, ConfigError> {
    let text =
        std::fs::read_to_string(file).map_err(|source| ConfigError::Unreadable { file: file.to_path_buf(), source })?;
    parse(&text, file)
}

/// Parses TOML text; `file` is named in errors.
pub fn parse<T: DeserializeOwned>(text: &str, file: &Path) -> Result<T, ConfigError> {
    toml::from_str(text).map_err(|e| ConfigError::Invalid {
        file: file.to_path_buf(),
        line: e.span().map_or(1, |s| line_of(text, s.start)),
        message: explain(e.message()),
    })
}

/// An error at the line where `key` (a dotted path such as `control.damping_ratio`) is set, or at its table, or at
/// line 1.
pub fn invalid(text: &str, file: &Path, key: &str, message: impl Into<String>) -> ConfigError {
    ConfigError::Invalid { file: file.to_path_buf(), line: line_of_key(text, key), message: message.into() }
}

/// The 1-based line of a byte offset.
fn line_of(text: &str, offset: usize) -> usize {
    text.as_bytes().iter().take(offset).filter(|b| **b == b'\n').count() + 1
}

/// The 1-based line on which a dotted key is set.
pub fn line_of_key(text: &str, key: &str) -> usize {
    let (table, leaf) = key.rsplit_once('.').unwrap_or(("", key));
    let (mut current, mut fallback) = (String::new(), 1);
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        if let Some(header) = line.strip_prefix('[') {
            current = header.trim_matches(|c| c == '[' || c == ']' || c == ' ').to_string();
            if current == table || current == key {
                fallback = i + 1;
            }
        } else if let Some((name, _)) = line.split_once('=') {
            let name = name.trim().trim_matches(['"', '\'']);
            if (current == table && name == leaf)
                || (current.is_empty() && (name == key || name == table))
                || format!("{current}.{name}") == key
            {
                return i + 1;
            }
        }
    }
    fallback
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
    }
}
