//! The tables of GUIDE.md, each between `<!-- options: scenario.drive -->`, or what else is to stand there, and `<!-- end -->`.
//!
//! An option's row is what its field says: name, default, range and comment. `options: scenario` holds all that no other marker names, so
//! that no key can be left out.
use calamus::experiment::ExperimentFile;
use calamus::measure::MetricPath;
use calamus::scenario::{LocalisationSettings, ScenarioFile};
use calamus::twin::LocaliserKind;
use serde_json::{Value, json};

const END: &str = "<!-- end -->";

/// The guide with all its tables made anew. The error says which marker is wrong.
pub fn renewed(guide: &str) -> Result<String, String> {
    let root = root();
    let marked: Vec<&str> = guide.lines().filter_map(marker).collect();
    let sections: Vec<&str> =
        marked.iter().filter_map(|m| m.strip_prefix("options:")).flat_map(str::split_whitespace).collect();
    for needed in ["scenario", "experiment"] {
        if !sections.contains(&needed) {
            return Err(format!("there is no `<!-- options: {needed} -->`"));
        }
    }
    let mut new = String::new();
    let mut lines = guide.lines();
    while let Some(line) = lines.next() {
        new += &format!("{line}\n");
        let Some(marker) = marker(line) else { continue };
        new += &match marker.strip_prefix("options:") {
            Some(paths) => options(&root, &paths.split_whitespace().collect::<Vec<_>>(), &sections)?,
            None if marker == "figures" => figures(),
            None if marker == "sensors" => sensors(&root)?,
            None => return Err(format!("there is no table `{marker}`")),
        };
        if !lines.any(|l| l == END) {
            return Err(format!("`{line}` has no `{END}`"));
        }
        new += &format!("{END}\n");
    }
    Ok(new)
}

/// What stands in a comment of a line of its own, but for the end of a table.
fn marker(line: &str) -> Option<&str> {
    line.strip_prefix("<!-- ")?.strip_suffix(" -->").filter(|m| *m != "end")
}

/// One schema that holds those of scenarios and of experiments.
fn root() -> Value {
    let (scenario, experiment) = (ScenarioFile::schema(), ExperimentFile::schema());
    let mut defs = scenario["$defs"].clone();
    if let (Some(all), Some(more)) = (defs.as_object_mut(), experiment["$defs"].as_object()) {
        all.extend(more.clone());
    }
    json!({ "$defs": defs, "properties": { "scenario": scenario, "experiment": experiment } })
}

/// The table of the options under some paths of tables, which stand beside each other when there are several.
fn options(root: &Value, paths: &[&str], sections: &[&str]) -> Result<String, String> {
    let mut table = "| key | default | range | meaning |\n|---|---|---|---|\n".to_string();
    for path in paths {
        let mut schema = root;
        for name in path.split('.') {
            let inner = object(root, schema).and_then(|o| o["properties"].get(name));
            schema = inner.ok_or_else(|| format!("there is no table `{path}`"))?;
        }
        let object = object(root, schema).ok_or_else(|| format!("`{path}` is no table"))?;
        let prefix = if paths.len() > 1 { path.rsplit('.').next().unwrap_or_default() } else { "" };
        rows(root, object, &Place { path, prefix }, sections, &mut table);
    }
    Ok(table)
}

/// Where a table stands in the file, and what its keys begin with in the guide.
struct Place<'a> {
    path: &'a str,
    prefix: &'a str,
}

fn rows(root: &Value, object: &Value, place: &Place, sections: &[&str], table: &mut String) {
    let join = |a: &str, b: &str| if a.is_empty() { b.to_string() } else { format!("{a}.{b}") };
    let is_needed = |key: &str| object["required"].as_array().is_some_and(|keys| keys.iter().any(|k| k == key));
    for (key, field) in object["properties"].as_object().into_iter().flatten() {
        let (path, name) = (join(place.path, key), join(place.prefix, key));
        if sections.contains(&path.as_str()) {
            continue;
        }
        let inner = self::object(root, field);
        let header = path.split_once('.').map_or(path.as_str(), |(_, path)| path);
        let (shown, default) = match inner {
            Some(_) if field["type"] == "array" => (format!("[[{header}]]"), String::new()),
            Some(_) => (format!("[{header}]"), String::new()),
            None if is_needed(key) => (name.clone(), "needed".to_string()),
            None => (name.clone(), default(&field["default"])),
        };
        *table += &format!("| `{shown}` | {default} | {} | {} |\n", range(field), meaning(root, field));
        if let Some(inner) = inner {
            rows(root, inner, &Place { path: &path, prefix: &name }, sections, table);
        }
    }
}

/// The schema of a table with keys of its own: the field's, or that of the items of its list or map.
fn object<'a>(root: &'a Value, field: &'a Value) -> Option<&'a Value> {
    if field["properties"].is_object() {
        return Some(field);
    }
    let inner = referred(root, field).or_else(|| field["anyOf"].get(0)).or_else(|| field.get("items"));
    object(root, inner.or_else(|| field.get("additionalProperties"))?)
}

fn referred<'a>(root: &'a Value, field: &Value) -> Option<&'a Value> {
    field["$ref"].as_str()?.strip_prefix("#/$defs/").map(|name| &root["$defs"][name])
}

/// A value as TOML has it; nothing where there is none.
fn default(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) if text.is_empty() => String::new(),
        Value::Array(items) if items.is_empty() => String::new(),
        Value::Object(_) => String::new(),
        Value::Number(_) | Value::Bool(_) => plain(value),
        _ => format!("`{}`", plain(value)),
    }
}

/// A value without a needless `.0`.
fn plain(value: &Value) -> String {
    match value {
        Value::Array(items) => format!("[{}]", items.iter().map(plain).collect::<Vec<_>>().join(", ")),
        Value::Number(n) if n.is_f64() => n.as_f64().unwrap_or_default().to_string(),
        other => other.to_string(),
    }
}

/// From where to where a number may be, or each of a list.
fn range(field: &Value) -> String {
    if let (Some(_), Some(low), Some(high)) = (field.get("type"), field.get("minimum"), field.get("maximum")) {
        return format!("{} to {}", plain(low), plain(high));
    }
    if let Some(each) = field["prefixItems"].as_array() {
        return each.iter().map(range).collect::<Vec<_>>().join(", ");
    }
    match field.get("items").map(range) {
        Some(inner) if inner.is_empty() || inner.contains(',') || inner.starts_with("each") => inner,
        Some(inner) => format!("each {inner}"),
        None => String::new(),
    }
}

/// The field's comment, and what each of its values says where it has few.
fn meaning(root: &Value, field: &Value) -> String {
    let mut words = words(field);
    let kind = referred(root, field).or_else(|| referred(root, &field["anyOf"][0])).unwrap_or(&Value::Null);
    for value in kind["oneOf"].as_array().into_iter().flatten() {
        words += &format!(" `{}`: {}", value["const"], self::words(value));
    }
    words.trim_end_matches('.').to_string()
}

/// A comment on one line.
fn words(schema: &Value) -> String {
    let text = schema["description"].as_str().unwrap_or_default();
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}

fn figures() -> String {
    let row = |m: &MetricPath| format!("| `{}` | {} | {} |\n", m.path, m.unit, m.meaning);
    "| figure | unit | meaning |\n|---|---|---|\n".to_string() + &MetricPath::all().iter().map(row).collect::<String>()
}

/// What each known sensor of a base's place has, in the units of the file.
fn sensors(root: &Value) -> Result<String, String> {
    let kinds = root["$defs"]["LocaliserKind"]["oneOf"].as_array().ok_or("there are no sensors")?;
    let names: Vec<&str> = kinds.iter().filter_map(|k| k["const"].as_str()).collect();
    let mut sensors = Vec::new();
    for name in &names {
        let kind: LocaliserKind = serde_json::from_value(json!(name)).map_err(|e| e.to_string())?;
        sensors.push(serde_json::to_value(LocalisationSettings::of(kind)).map_err(|e| e.to_string())?);
    }
    let mut table =
        format!("| key | {} |\n|---|", names.iter().map(|n| format!("`\"{n}\"`")).collect::<Vec<_>>().join(" | "));
    table += &format!("{}\n", "---|".repeat(names.len()));
    for key in root["$defs"]["LocalisationSettings"]["properties"].as_object().into_iter().flat_map(|o| o.keys()) {
        if key != "sensor" {
            let values = sensors.iter().map(|s| plain(&s[key])).collect::<Vec<_>>().join(" | ");
            table += &format!("| `{key}` | {values} |\n");
        }
    }
    Ok(table)
}
