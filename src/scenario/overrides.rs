//! `--set key=value`: changes of a scenario from outside the file.
use serde::Serialize;
use toml::{Table, Value};

/// One `--set key=value`: a dotted key and a TOML value. A value that isn't TOML is taken as a string, so that
/// `robot=iiwa_fixed` needs no quotes.
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    /// As typed.
    pub text: String,
    /// The keys from the top of the file.
    pub keys: Vec<String>,
    /// The value.
    pub value: Value,
    /// Typed by someone in a folder: a path in it may start there too.
    pub(super) typed: bool,
}

impl std::str::FromStr for Override {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (key, typed) =
            text.split_once('=').ok_or_else(|| format!("`{text}` should be key=value, as control.speed_mm_s=30"))?;
        let keys = keys_of(key.trim()).ok_or_else(|| format!("`{key}` is not a dotted key"))?;
        let typed = typed.trim();
        let value = toml::from_str::<Table>(&format!("v = {typed}"))
            .ok()
            .filter(|t| t.len() == 1)
            .and_then(|mut t| t.remove("v"))
            .unwrap_or_else(|| Value::String(typed.to_string()));
        Ok(Self { text: text.to_string(), keys, value, typed: true })
    }
}

/// The parts of a dotted key, as TOML reads it (so `accept."line.error_mean_mm".max` has three).
fn keys_of(key: &str) -> Option<Vec<String>> {
    let mut table = toml::from_str::<Table>(&format!("{key} = 0")).ok()?;
    let mut keys = Vec::new();
    loop {
        if table.len() != 1 {
            return None;
        }
        let (name, value) = table.into_iter().next()?;
        keys.push(name);
        match value {
            Value::Table(inner) => table = inner,
            _ => return Some(keys),
        }
    }
}

impl Override {
    /// The override that gives `key`, dotted, a value of data, as experiments do. The error says what is wrong with the key or
    /// why TOML has no such value.
    pub fn new(key: &str, value: &impl Serialize) -> Result<Self, String> {
        let keys = keys_of(key).ok_or_else(|| format!("`{key}` is not a dotted key"))?;
        let value = Value::try_from(value).map_err(|e| format!("`{key}` can't have this value: {e}"))?;
        Ok(Self { text: format!("{key}={value}"), keys, value, typed: false })
    }

    /// The dotted key.
    pub fn key(&self) -> String {
        self.keys.join(".")
    }

    /// Writes the value into `table`, making tables on the way. A table given as value is merged key by key.
    pub(super) fn apply(&self, table: &mut Table) -> Result<(), String> {
        let Some((leaf, path)) = self.keys.split_last() else { return Ok(()) };
        let mut here = table;
        for key in path {
            let entry = here.entry(key.clone()).or_insert_with(|| Value::Table(Table::new()));
            here = entry.as_table_mut().ok_or_else(|| format!("`{key}` is a value, not a table"))?;
        }
        // a drawing comes from a file or from a pattern: setting the one takes back the other
        match self.keys.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
            ["drawing", "source"] => drop(here.remove("pattern")),
            ["drawing", "pattern"] => drop(here.remove("source")),
            _ => {}
        }
        here.insert(leaf.clone(), self.value.clone());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_toml_or_else_a_string() {
        let set = |s: &str| s.parse::<Override>().unwrap();
        assert_eq!(set("control.speed_mm_s=30").value, Value::Integer(30));
        assert_eq!(set("canvas.offset_mm = [1, 2.5]").value.as_array().unwrap().len(), 2);
        assert_eq!(set("robot=iiwa_fixed").value, Value::String("iiwa_fixed".into()));
        assert_eq!(set("name=a = b").value, Value::String("a = b".into()));
        assert_eq!(set("accept.\"line.error_mean_mm\".max=0.2").keys, ["accept", "line.error_mean_mm", "max"]);
    }

    #[test]
    fn what_is_not_key_value_is_refused() {
        for text in ["speed", "=3", "a b=3", "a..b=3", "a=1\nb=2"] {
            let parsed = text.parse::<Override>();
            assert!(parsed.is_err() || parsed.unwrap().keys.len() == 1, "{text}");
        }
    }
}
