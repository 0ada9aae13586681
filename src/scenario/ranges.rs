//! Numbers in the ranges that their fields have: `#[schemars(range(...))]` is where a range is written.
use std::path::Path;

use serde_json::Value;
use toml::Value as Typed;

use crate::diagnostic::{self, ConfigError};
use crate::math::exactly;

/// A number that is not in its range.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Outside {
    /// Its dotted key; items of lists of tables are counted from 0, as in `render.camera.1.fov_deg`.
    pub key: String,
    /// What is wrong with it; goes on from its name: "must be ...".
    pub message: String,
}

/// The first number in `typed`, in the order of the schema, that is outside the range that the schema gives it, or not finite.
pub(super) fn first_outside(schema: &Value, typed: &toml::Table) -> Option<Outside> {
    table(schema, schema, typed, "")
}

/// Refuses the text of a file in which a number is outside the range that `schema` gives it.
///
/// # Errors
/// [`ConfigError::Invalid`] at the number's line.
pub(crate) fn check_ranges(schema: &Value, text: &str, file: &Path) -> Result<(), ConfigError> {
    let typed: toml::Table = diagnostic::parse(text, file)?;
    match first_outside(schema, &typed) {
        Some(Outside { key, message }) => {
            let leaf = key.rsplit('.').next().unwrap_or(&key);
            Err(diagnostic::invalid(text, file, &key, format!("`{leaf}` {message}")))
        }
        None => Ok(()),
    }
}

/// Looks at one value. What has another type than the schema says is left to who reads it.
fn value(root: &Value, schema: &Value, typed: &Typed, key: &str) -> Option<Outside> {
    if let Some(name) = schema["$ref"].as_str().and_then(|r| r.strip_prefix("#/$defs/")) {
        return value(root, &root["$defs"][name], typed, key);
    }
    if let Some(forms) = forms_of(schema) {
        return forms.iter().filter(|form| is_form(root, form, typed)).find_map(|form| value(root, form, typed, key));
    }
    match typed {
        Typed::Integer(n) => number(schema, *n as f64, key),
        Typed::Float(x) => number(schema, *x, key),
        Typed::Array(items) => items.iter().enumerate().find_map(|(i, item)| {
            let schema = schema["prefixItems"].get(i).unwrap_or(&schema["items"]);
            let key = if item.is_table() { &format!("{key}.{i}") } else { key };
            value(root, schema, item, key)
        }),
        Typed::Table(inner) => table(root, schema, inner, key),
        _ => None,
    }
}

fn table(root: &Value, schema: &Value, typed: &toml::Table, key: &str) -> Option<Outside> {
    let dotted = |name: &str| if key.is_empty() { name.to_string() } else { format!("{key}.{name}") };
    let fields = schema["properties"].as_object();
    let known = fields.into_iter().flatten().filter_map(|(name, schema)| Some((name, schema, typed.get(name)?)));
    let named = typed.iter().filter(|(name, _)| !fields.is_some_and(|f| f.contains_key(*name)));
    let others = named.map(|(name, typed)| (name, &schema["additionalProperties"], typed));
    known.chain(others).find_map(|(name, schema, typed)| value(root, schema, typed, &dotted(name)))
}

/// The forms that a value may have, where there are several.
fn forms_of(schema: &Value) -> Option<&Vec<Value>> {
    schema["anyOf"].as_array().or(schema["oneOf"].as_array())
}

/// Whether `typed` is of this form among several: a table or a list, and with the tag that the form has.
fn is_form(root: &Value, form: &Value, typed: &Typed) -> bool {
    if let Some(name) = form["$ref"].as_str().and_then(|r| r.strip_prefix("#/$defs/")) {
        return is_form(root, &root["$defs"][name], typed);
    }
    if let Some(forms) = forms_of(form) {
        return forms.iter().any(|form| is_form(root, form, typed));
    }
    let mut fields = form["properties"].as_object().into_iter().flatten();
    match typed {
        Typed::Table(inner) => {
            form["type"] == "object"
                && fields.all(|(name, field)| {
                    field.get("const").is_none_or(|tag| inner.get(name).and_then(Typed::as_str) == tag.as_str())
                })
        }
        Typed::Array(_) => form["type"] == "array",
        _ => true,
    }
}

fn number(schema: &Value, x: f64, key: &str) -> Option<Outside> {
    if !is_number(schema) {
        return None;
    }
    let (low, high) = (schema["minimum"].as_f64(), schema["maximum"].as_f64());
    let message = if !x.is_finite() {
        format!("must be a finite number, not {x}")
    } else if low.is_none_or(|low| x >= low) && high.is_none_or(|high| x <= high) {
        return None;
    } else {
        match (low, high) {
            (Some(low), Some(high)) => format!("must be from {low} to {high}, not {}", exactly(x)),
            (Some(low), None) => format!("must be at least {low}, not {}", exactly(x)),
            (None, high) => format!("must be at most {}, not {}", high.unwrap_or_default(), exactly(x)),
        }
    };
    Some(Outside { key: key.to_string(), message })
}

/// Whether the schema is that of a number, or of one that may be absent.
fn is_number(schema: &Value) -> bool {
    let one = |t: &Value| t == "number" || t == "integer";
    one(&schema["type"]) || schema["type"].as_array().is_some_and(|types| types.iter().any(one))
}

/// Keys of the numbers that have no least or no greatest value, by the schema; `*` stands for any name.
#[cfg(test)]
pub(crate) fn unbounded(schema: &Value) -> Vec<String> {
    fn look(root: &Value, schema: &Value, key: &str, found: &mut Vec<String>) {
        if let Some(name) = schema["$ref"].as_str().and_then(|r| r.strip_prefix("#/$defs/")) {
            return look(root, &root["$defs"][name], key, found);
        }
        if is_number(schema) && (schema.get("minimum").is_none() || schema.get("maximum").is_none()) {
            found.push(key.to_string());
        }
        let forms = ["anyOf", "oneOf", "prefixItems"].into_iter().filter_map(|k| schema[k].as_array()).flatten();
        // where every item has a schema of its own, that of all the others says nothing
        let others = schema.get("items").filter(|_| schema.get("prefixItems").is_none());
        forms.chain(others).for_each(|inner| look(root, inner, key, found));
        let any = schema.get("additionalProperties").map(|inner| ("*", inner));
        let fields = schema["properties"].as_object().into_iter().flatten().map(|(name, field)| (name.as_str(), field));
        for (name, field) in fields.chain(any) {
            look(root, field, &if key.is_empty() { name.to_string() } else { format!("{key}.{name}") }, found);
        }
    }
    let mut found = Vec::new();
    look(schema, schema, "", &mut found);
    found.dedup();
    found
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use schemars::JsonSchema;
    use serde::Deserialize;

    use super::*;

    #[derive(Deserialize, JsonSchema)]
    #[serde(tag = "kind", rename_all = "snake_case")]
    #[allow(dead_code)]
    enum Shape {
        Ball {
            #[schemars(range(min = 1, max = 2))]
            size: f64,
        },
        Cube {
            #[schemars(range(min = 10, max = 20))]
            size: f64,
        },
    }

    #[derive(Deserialize, JsonSchema)]
    #[allow(dead_code)]
    struct Limit {
        #[schemars(range(min = 0.5))]
        least: Option<f64>,
        #[schemars(range(max = 3))]
        most: Option<i32>,
        free: Option<f64>,
    }

    #[derive(Deserialize, JsonSchema)]
    #[allow(dead_code)]
    struct Desk {
        shape: Option<Shape>,
        #[schemars(inner(inner(range(min = -1, max = 1))))]
        places: Vec<[f64; 2]>,
        #[schemars(extend("prefixItems" = [{"type": "number", "maximum": 5}]), inner(range(min = 0, max = 9)))]
        pair: [f64; 2],
        limits: BTreeMap<String, Limit>,
        one_or_many: OneOrMany,
        list: Vec<Limit>,
        anything: Option<Value>,
    }

    #[derive(Deserialize, JsonSchema)]
    #[serde(untagged)]
    #[allow(dead_code)]
    enum OneOrMany {
        One(Limit),
        Many(Vec<Limit>),
    }

    fn outside(text: &str) -> Option<String> {
        let schema = schemars::schema_for!(Desk).to_value();
        first_outside(&schema, &toml::from_str(text).unwrap()).map(|o| format!("{} {}", o.key, o.message))
    }

    #[test]
    fn numbers_in_tables_lists_maps_and_tagged_tables_are_held_to_their_ranges() {
        for (text, expected) in [
            ("shape = { kind = 'ball', size = 1 }", None),
            ("shape = { kind = 'cube', size = 1 }", Some("shape.size must be from 10 to 20, not 1")),
            ("places = [[0, 1], [-0.5, 1.5]]", Some("places must be from -1 to 1, not 1.5")),
            ("pair = [5, 9]", None),
            ("pair = [6, 9]", Some("pair must be at most 5, not 6")),
            ("pair = [5, 10]", Some("pair must be from 0 to 9, not 10")),
            ("limits.'a.b'.least = 0", Some("limits.a.b.least must be at least 0.5, not 0")),
            ("one_or_many = { most = 4 }", Some("one_or_many.most must be at most 3, not 4")),
            ("one_or_many = [{ most = 3 }, { most = 4 }]", Some("one_or_many.1.most must be at most 3, not 4")),
            ("[[list]]\nleast = 1\n[[list]]\nleast = 0.25", Some("list.1.least must be at least 0.5, not 0.25")),
            ("anything = { x = nan, y = [1e99] }", None),
        ] {
            assert_eq!(outside(text).as_deref(), expected, "{text}");
        }
    }

    #[test]
    fn what_is_not_finite_is_refused_with_and_without_a_range() {
        for x in ["nan", "inf", "-inf"] {
            let least = outside(&format!("limits.a.least = {x}")).unwrap();
            assert!(least.starts_with("limits.a.least must be a finite number, not "), "{least}");
            assert!(outside(&format!("limits.a.free = {x}")).is_some(), "{x}");
        }
    }

    #[test]
    fn the_first_of_two_mistakes_is_the_schemas_first() {
        assert_eq!(outside("list = [{ most = 9 }]\npair = [9, 9]").unwrap(), "pair must be at most 5, not 9");
    }
}
