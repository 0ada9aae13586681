//! The experiment as typed.
use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

/// An experiment file: TOML, unknown keys refused.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Calamus experiment")]
pub struct ExperimentFile {
    /// Name, as it stands in results; the file's name when absent.
    pub name: Option<String>,
    /// What the experiment is to find out.
    #[serde(default)]
    pub description: String,
    /// Seed of every random number of every trial.
    #[serde(default = "ExperimentFile::default_seed")]
    pub seed: u64,
    /// The scenario that every trial starts from: a path relative to this file, or a scenario's name. Its `[accept]`
    /// and pictures are left out.
    pub scenario: String,
    /// How far each trial goes: `cover` finds where a base stands and draws nothing.
    #[serde(default)]
    pub until: Stage,
    /// Trials of each case at each point of the grid.
    #[serde(default = "ExperimentFile::default_trials")]
    #[schemars(range(min = 1, max = 1_000_000))]
    pub trials: u64,
    /// Values of the scenario that are changed for all trials: dotted keys as for `--set`. Any number in them, also
    /// one in a list, may be a distribution: `[1500, 1500, { uniform = [100, 700] }]`.
    #[serde(default)]
    pub set: BTreeMap<String, Value>,
    /// Values of the scenario that vary: a list or a range `{ from, to, steps }` is an axis of the grid, whole values
    /// as `--set` takes them; a distribution is drawn for each trial. Lists that differ in one number are an axis of
    /// that number.
    #[serde(default)]
    pub vary: BTreeMap<String, Value>,
    /// Groups of changes that are compared.
    #[serde(default, rename = "case")]
    pub cases: Vec<CaseFile>,
    /// Shares of the trials that meet a condition, by name: a figure, `>=`, `<=`, `>` or `<`, and a number, as
    /// `line.coverage >= 0.99`. A trial that failed meets none. `rate.success` is there always: the share that could
    /// be done.
    #[serde(default)]
    pub rate: BTreeMap<String, String>,
    /// Bounds that results must keep, by figure or `rate.NAME`: one, or a list of them. Exit code 1 when one is
    /// missed.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, AcceptForm>")]
    pub accept: BTreeMap<String, Value>,
    /// A plot, as SVG and PNG.
    #[serde(default, rename = "plot")]
    pub plots: Vec<PlotFile>,
    /// Trials that are run again with pictures, into `worst/trial-K`.
    pub worst: Option<WorstFile>,
}

impl ExperimentFile {
    fn default_seed() -> u64 {
        1
    }
    fn default_trials() -> u64 {
        20
    }

    /// The JSON schema of experiment files: where the ranges of all numbers come from.
    pub fn schema() -> serde_json::Value {
        schemars::schema_for!(ExperimentFile).to_value()
    }
}

/// How far a trial goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// To the places where a base stands.
    Cover,
    /// To the end.
    #[default]
    End,
}

/// `[[case]]`: a named group of changes.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CaseFile {
    /// Name, as it stands in results and legends.
    pub name: String,
    /// Values of the scenario that are changed in this case: they come last.
    #[serde(default)]
    pub set: BTreeMap<String, Value>,
}

/// Bounds of one figure in `[accept]`.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AcceptFile {
    /// Of this case only.
    pub case: Option<String>,
    /// Only where these axes have these values.
    pub at: BTreeMap<String, Value>,
    /// The mean, or the rate, may not be below this.
    pub mean_min: Option<f64>,
    /// The mean, or the rate, may not be above this.
    pub mean_max: Option<f64>,
    /// The median may not be below this.
    pub median_min: Option<f64>,
    /// The median may not be above this.
    pub median_max: Option<f64>,
    /// The lower end of the mean's, or the rate's, 95 % interval may not be below this.
    pub low_min: Option<f64>,
    /// The upper end of that interval may not be above this.
    pub high_max: Option<f64>,
    /// No trial may be below this.
    pub min: Option<f64>,
    /// No trial may be above this.
    pub max: Option<f64>,
}

/// The forms of an entry of `[accept]`, for the schema.
#[derive(JsonSchema)]
#[serde(untagged)]
#[allow(dead_code)]
enum AcceptForm {
    One(AcceptFile),
    Several(Vec<AcceptFile>),
}

/// What a plot shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlotKind {
    /// The mean over an axis, with its 95 % interval; a line a case.
    Curve,
    /// How often which values come; a panel a case.
    Histogram,
    /// The mean over two axes; a panel a case.
    Heatmap,
}

/// `[[plot]]`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlotFile {
    /// What it shows.
    pub kind: PlotKind,
    /// Which figure, or `rate.NAME`.
    pub metric: String,
    /// The axis of a curve, or a heatmap's across. What isn't on an axis of the plot is averaged over.
    pub axis: Option<String>,
    /// A heatmap's axis upwards.
    pub axis_y: Option<String>,
    /// A curve's axis is logarithmic.
    #[serde(default)]
    pub log: bool,
    /// Bars of a histogram; 24 when absent.
    #[schemars(range(min = 2, max = 200))]
    pub bins: Option<u32>,
    /// Title; the figure's meaning when absent.
    pub title: Option<String>,
}

/// `[worst]`: trials that are run again with pictures.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WorstFile {
    /// By which figure; the largest are the worst.
    pub metric: String,
    /// How many.
    #[serde(default = "WorstFile::default_n")]
    #[schemars(range(min = 1, max = 100))]
    pub n: u32,
    /// The smallest are the worst.
    #[serde(default)]
    pub lowest: bool,
    /// Names of rates: the first trial that counts in each is shown too.
    #[serde(default)]
    pub each: Vec<String>,
}

impl WorstFile {
    fn default_n() -> u32 {
        3
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::unbounded;

    #[test]
    fn every_number_is_bounded_but_seeds_and_bounds_of_figures() {
        let all = unbounded(&ExperimentFile::schema());
        let numbers: Vec<&str> = all.iter().map(String::as_str).filter(|key| !key.starts_with("accept.*.")).collect();
        assert_eq!(numbers, ["seed"]);
        assert!(all.iter().any(|key| key == "accept.*.mean_min"), "{all:?}");
    }
}
