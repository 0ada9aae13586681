//! GUIDE.md tells everything there is to set and everything that is measured.
use calamus::experiment::ExperimentFile;
use calamus::measure::MetricPath;
use calamus::scenario::ScenarioFile;

fn guide() -> String {
    std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/GUIDE.md")).unwrap()
}

#[test]
fn every_key_of_a_scenario_is_in_the_guide() {
    every_key(&ScenarioFile::schema());
}

#[test]
fn every_key_of_an_experiment_is_in_the_guide() {
    every_key(&schemars::schema_for!(ExperimentFile).to_value());
}

fn every_key(schema: &serde_json::Value) {
    let guide = guide();
    let objects = schema["$defs"].as_object().unwrap().values().chain([schema]);
    for object in objects.filter_map(|o| o["properties"].as_object()) {
        for key in object.keys() {
            let named =
                [format!("`{key}`"), format!("[{key}]"), format!(".{key}]"), format!("{key} = "), format!(".{key}`")];
            assert!(named.iter().any(|n| guide.contains(n)), "GUIDE.md doesn't explain `{key}`");
        }
    }
}

#[test]
fn every_figure_is_in_the_guide_in_the_same_words() {
    let guide = guide();
    let rows = MetricPath::all().iter().map(|m| format!("| `{}` | {} | {} |", m.path, m.unit, m.meaning));
    let missing: Vec<String> = rows.filter(|row| !guide.contains(row.as_str())).collect();
    assert!(missing.is_empty(), "GUIDE.md should have the rows:\n{}", missing.join("\n"));
}
