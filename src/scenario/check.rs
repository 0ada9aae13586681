//! Numbers in their ranges, and mistakes at their lines.
use std::path::{Path, PathBuf};

use crate::diagnostic;

use super::overrides::Override;
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
        let set = self.overrides.iter().rev().find(|o| {
            let set = o.key();
            set == key || key.strip_prefix(&set).is_some_and(|rest| rest.starts_with('.'))
        });
        match set {
            Some(set) => ScenarioError::Override { text: set.text.clone(), message },
            None => ScenarioError::Config(diagnostic::invalid(self.text, self.file, key, message)),
        }
    }

    /// The number must be finite.
    pub fn finite(&self, key: &str, x: f64) -> Result<(), ScenarioError> {
        if x.is_finite() { Ok(()) } else { Err(self.wrong(key, format!("must be a finite number, not {x}"))) }
    }

    /// The number must be finite and in `[low, high]`.
    pub fn within(&self, key: &str, x: f64, low: f64, high: f64) -> Result<(), ScenarioError> {
        self.finite(key, x)?;
        if (low..=high).contains(&x) {
            Ok(())
        } else {
            Err(self.wrong(key, format!("must be from {low} to {high}, not {x}")))
        }
    }

    /// The number must be above 0 and at most `high`.
    pub fn above_zero(&self, key: &str, x: f64, high: f64) -> Result<(), ScenarioError> {
        self.finite(key, x)?;
        if x > 0.0 && x <= high {
            Ok(())
        } else if x > high {
            Err(self.wrong(key, format!("must be at most {high}, not {x}")))
        } else {
            Err(self.wrong(key, format!("must be greater than 0, not {x}")))
        }
    }
}
