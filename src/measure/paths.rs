//! Every numeric figure of metrics.json: its path, its unit and what it says, as the fields of [`Metrics`] have them.
use std::sync::LazyLock;

use serde_json::Value;

use super::Metrics;
use crate::math::unit_of_name;

/// A numeric figure of metrics.json, by its dotted path, and what it says in plain words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MetricPath {
    /// As `line.error_mean_mm`.
    pub path: String,
    /// Unit for people; empty for plain numbers.
    pub unit: String,
    /// What it says: the comment of its field, without a full stop.
    pub meaning: String,
}

static ALL: LazyLock<Vec<MetricPath>> = LazyLock::new(|| {
    let schema = schemars::schema_for!(Metrics).to_value();
    let mut found = Vec::new();
    walk(&schema, &schema, &Place { path: String::new(), words: None }, &mut found);
    found
});

impl MetricPath {
    /// Every numeric figure, in the order of metrics.json.
    pub fn all() -> &'static [MetricPath] {
        &ALL
    }

    /// The figure with that path.
    pub fn find(path: &str) -> Option<&'static MetricPath> {
        ALL.iter().find(|m| m.path == path)
    }
}

/// Where an object stands in metrics.json.
struct Place {
    path: String,
    /// What is said of it there, where objects of its type stand in several places: else their figures would say the same.
    words: Option<String>,
}

/// Finds the numbers in an object's schema, and in the objects within it; lists hold no figures.
fn walk(schema: &Value, object: &Value, place: &Place, found: &mut Vec<MetricPath>) {
    for (key, field) in object["properties"].as_object().into_iter().flatten() {
        let path = if place.path.is_empty() { key.clone() } else { format!("{}.{key}", place.path) };
        let words = words(field);
        if let Some(name) = referred(field) {
            let shared = schema.to_string().matches(&format!("\"#/$defs/{name}\"")).count() > 1;
            let inner = Place { path, words: shared.then_some(words) };
            walk(schema, &schema["$defs"][name], &inner, found);
        } else if is_number(field) && !place.path.is_empty() {
            let unit = field["unit"].as_str().or(unit_of_name(key)).unwrap_or_default().to_string();
            let meaning = match &place.words {
                Some(before) => format!("{before}: {}", uncapitalised(&words)),
                None => words,
            };
            found.push(MetricPath { path, unit, meaning });
        }
    }
}

/// The comment of a field on one line, without its full stop.
fn words(field: &Value) -> String {
    let text = field["description"].as_str().unwrap_or_default();
    text.split_whitespace().collect::<Vec<_>>().join(" ").trim_end_matches('.').to_string()
}

fn uncapitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

/// The name of the type of object that a field holds, if it holds one.
fn referred(field: &Value) -> Option<&str> {
    let reference = field.get("$ref").or_else(|| field["anyOf"][0].get("$ref"))?;
    reference.as_str()?.strip_prefix("#/$defs/")
}

fn is_number(field: &Value) -> bool {
    let one = |t: &Value| t == "number" || t == "integer";
    one(&field["type"]) || field["type"].as_array().is_some_and(|types| types.iter().any(one))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn a_figure_has_the_path_the_unit_and_the_words_of_its_field() {
        let unit_and_meaning = |path: &str| {
            let m = MetricPath::find(path).unwrap();
            (m.unit.as_str(), m.meaning.as_str())
        };
        assert_eq!(unit_and_meaning("line.error_mean_mm"), ("mm", "Mean distance of the ink from the desired line"));
        assert_eq!(unit_and_meaning("mapping.angle_error_mean").0, "deg");
        assert_eq!(unit_and_meaning("tool.stages.lift.x_mm").1, "The tool in the hand after the lift: out of the palm");
        assert!(MetricPath::find("plan.failures").is_none() && MetricPath::find("seed").is_none());
    }

    #[test]
    fn figures_come_in_the_order_of_the_file_and_say_different_things() {
        let all = MetricPath::all();
        let at = |path: &str| all.iter().position(|m| m.path == path).unwrap();
        assert!(at("drawing.strokes") < at("drawing.points") && at("drawing.points") < at("sim.steps"));
        let meanings: BTreeSet<(&str, &str)> =
            all.iter().map(|m| (m.path.split('.').next().unwrap(), m.meaning.as_str())).collect();
        assert_eq!(meanings.len(), all.len());
        for m in all {
            assert!(!m.meaning.is_empty() && !m.meaning.contains(['|', '[', '<']), "{}: {}", m.path, m.meaning);
        }
    }
}
