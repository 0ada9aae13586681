//! Numbers in their ranges, and mistakes at their lines.
use std::path::{Path, PathBuf};

use crate::diagnostic;

use super::file::ScenarioFile;
use super::overrides::Override;
use super::ranges::{self, Outside};
use super::resolve::ScenarioError;

/// Names the place of a mistake: the line in the file, or the `--set` that made it.
pub(super) struct Check<'a> {
    pub text: &'a str,
    pub file: &'a Path,
    pub overrides: &'a [Override],
}

impl Check<'_> {
    /// The folder of the file, from which paths in it start.
    pub fn folder(&self) -> PathBuf {
        match self.file.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
            _ => PathBuf::from("."),
        }
    }

    /// The error that `key` is wrong; the message goes on from its name: "must be ...".
    pub fn wrong(&self, key: &str, message: impl Into<String>) -> ScenarioError {
        let leaf = key.rsplit('.').next().unwrap_or(key);
        self.sentence(key, format!("`{leaf}` {}", message.into()))
    }

    /// The error of a whole sentence about `key`.
    pub fn sentence(&self, key: &str, message: impl Into<String>) -> ScenarioError {
        let message = message.into();
        match self.set(key) {
            Some(set) => ScenarioError::Override { text: set.text.clone(), message },
            None => ScenarioError::Config(diagnostic::invalid(self.text, self.file, key, message)),
        }
    }

    /// The last `--set` that says what `key` is, if one does.
    fn set(&self, key: &str) -> Option<&Override> {
        self.overrides.iter().rev().find(|o| {
            let set = o.key();
            set == key || key.strip_prefix(&set).is_some_and(|rest| rest.starts_with('.'))
        })
    }

    /// The file that `key` names: as `find` finds it from the scenario's folder, and else, where it was typed with `--set`, from the
    /// current one.
    pub fn file(&self, key: &str, find: impl Fn(&Path) -> Result<PathBuf, String>) -> Result<PathBuf, ScenarioError> {
        let message = match find(&self.folder()) {
            Ok(file) => return Ok(file),
            Err(message) => message,
        };
        match self.set(key).filter(|o| o.typed).map(|_| find(Path::new("."))) {
            Some(Ok(file)) => Ok(file),
            Some(Err(other)) if other != message => Err(self.sentence(key, format!("{message}; {other}"))),
            _ => Err(self.sentence(key, message)),
        }
    }

    /// Every number of the scenario must be in the range that its field has.
    pub fn ranges(&self, scenario: &toml::Table) -> Result<(), ScenarioError> {
        match ranges::first_outside(ScenarioFile::schema(), scenario) {
            Some(Outside { key, message }) => Err(self.wrong(&key, message)),
            None => Ok(()),
        }
    }

    /// The number must be in `[low, high]`, where these come of other numbers.
    pub fn within(&self, key: &str, x: f64, low: f64, high: f64) -> Result<(), ScenarioError> {
        if (low..=high).contains(&x) {
            Ok(())
        } else {
            Err(self.wrong(key, format!("must be from {low} to {high}, not {x}")))
        }
    }
}
