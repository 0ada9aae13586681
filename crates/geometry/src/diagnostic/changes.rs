//! Values of a file that another file changes.
use std::path::Path;

use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::ConfigError;

/// Values that take the place of those in a TOML file, as a table of the same shape.
///
/// A table is merged key by key, anything else takes the place of what stands there. Where the file has a list, a table whose keys are
/// numbers changes its items, from 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Changes(Table);

impl Changes {
    /// Whether nothing is changed.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// What `make` makes of the text of `file`, which it is given changed.
    ///
    /// # Errors
    /// Those of `make`, that of a text which isn't TOML, and that of a list's item which isn't there. What is wrong with a changed text
    /// is told without a line, for its lines aren't the file's.
    pub fn with<T, E: From<ConfigError>>(
        &self,
        text: &str,
        file: &Path,
        make: impl FnOnce(&str) -> Result<T, E>,
        config: impl FnOnce(E) -> Result<ConfigError, E>,
    ) -> Result<T, E> {
        if self.is_empty() {
            return make(text);
        }
        let mut table: Table = super::parse(text, file)?;
        let changed = |message| ConfigError::Changed { file: file.to_path_buf(), message };
        merge(&mut table, &self.0, "").map_err(changed)?;
        let text = toml::to_string(&table).map_err(|e| changed(e.to_string()))?;
        make(&text).map_err(|e| match config(e) {
            Ok(ConfigError::Invalid { file, message, .. }) => ConfigError::Changed { file, message }.into(),
            Ok(other) => other.into(),
            Err(other) => other,
        })
    }
}

fn merge(into: &mut Table, from: &Table, path: &str) -> Result<(), String> {
    for (key, value) in from {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        match (into.get_mut(key), value) {
            (Some(Value::Table(here)), Value::Table(change)) => merge(here, change, &path)?,
            (Some(Value::Array(items)), Value::Table(change)) => merge_items(items, change, &path)?,
            _ => {
                into.insert(key.clone(), value.clone());
            }
        }
    }
    Ok(())
}

fn merge_items(items: &mut [Value], from: &Table, path: &str) -> Result<(), String> {
    let count = items.len();
    for (key, value) in from {
        let item = key.parse::<usize>().ok().and_then(|i| items.get_mut(i));
        let Some(item) = item else { return Err(format!("`{path}` is a list of {count} items, from 0: no `{key}`")) };
        match (item, value) {
            (Value::Table(here), Value::Table(change)) => merge(here, change, &format!("{path}.{key}"))?,
            (item, value) => *item = value.clone(),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "name = 'a'\nlist = [1, 2]\n[base]\nsize = 1\n[[arm]]\nfriction = 1\n[[arm]]\nfriction = 2\n";

    fn changed(changes: &str) -> Result<Table, ConfigError> {
        let changes: Changes = toml::from_str(changes).unwrap();
        changes.with(FILE, Path::new("r.toml"), |text| super::super::parse(text, Path::new("r.toml")), Ok)
    }

    #[test]
    fn tables_are_merged_and_items_of_lists_changed() {
        let table = changed("base.size = 7\nbase.more = 1\narm.1.friction = 5\nlist = [3]\n").unwrap();
        assert_eq!(table["base"]["size"].as_integer(), Some(7));
        assert_eq!(table["base"]["more"].as_integer(), Some(1));
        assert_eq!(
            (table["arm"][0]["friction"].as_integer(), table["arm"][1]["friction"].as_integer()),
            (Some(1), Some(5))
        );
        assert_eq!((table["list"].as_array().unwrap().len(), table["name"].as_str()), (1, Some("a")));
    }

    #[test]
    fn what_is_wrong_with_a_change_is_told_without_a_line() {
        let error = changed("arm.2.friction = 5\n").unwrap_err().to_string();
        assert_eq!(error, "r.toml, changed: `arm` is a list of 2 items, from 0: no `2`");
        #[derive(Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        #[allow(dead_code)]
        struct Named {
            name: String,
        }
        let changes: Changes = toml::from_str("nam = 3").unwrap();
        let read = |text: &str| super::super::parse::<Named>(text, Path::new("r.toml"));
        let error = changes.with("name = 'a'", Path::new("r.toml"), read, Ok).unwrap_err().to_string();
        assert_eq!(error, "r.toml, changed: unknown key `nam`: did you mean `name`?");
    }
}
