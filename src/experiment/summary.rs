//! Results summed up: each case at each point of the grid, each case, and the bounds.
use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use crate::measure::MetricPath;

use super::accept::BoundCheck;
use super::estimate::Estimate;
use super::quantity::Quantity;
use super::row::Row;
use super::spec::Experiment;

/// Some of the trials, summed up.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Group {
    /// Their case; empty when there are no cases.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub case: String,
    /// Their point of the grid; empty where all of a case are summed up.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub axes: BTreeMap<String, Value>,
    /// How many.
    pub n: u64,
    /// How many of them failed.
    pub failures: u64,
    /// Rates: `success`, and those of the experiment; a trial that failed meets none.
    pub rates: BTreeMap<String, Estimate>,
    /// Figures of those that didn't fail.
    pub metrics: BTreeMap<String, Estimate>,
}

/// How two cases differ in trials that met the same randomness.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Contrast {
    /// The case.
    pub case: String,
    /// The one that it is compared with: the first.
    pub against: String,
    /// Each figure's difference, over the pairs in which both have it.
    pub metrics: BTreeMap<String, Estimate>,
}

/// summary.json.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Version of this format.
    pub schema: u32,
    /// Version of the program.
    pub calamus_version: String,
    /// The experiment.
    pub experiment: String,
    /// Its seed.
    pub seed: u64,
    /// Digest of everything that its trials depend on.
    pub hash: String,
    /// Trials.
    pub trials: u64,
    /// How many of them failed.
    pub failures: u64,
    /// The bounds.
    pub accept: Vec<BoundCheck>,
    /// Each case.
    pub cases: Vec<Group>,
    /// Each case at each point of the grid, when there is a grid.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cells: Vec<Group>,
    /// Each case against the first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub contrasts: Vec<Contrast>,
}

impl Summary {
    /// Version of the format.
    pub const SCHEMA: u32 = 1;

    /// Of all trials, in order.
    pub(super) fn of(experiment: &Experiment, rows: &[Row]) -> Self {
        let mut cases = Vec::new();
        let mut cells = Vec::new();
        for case in &experiment.cases {
            let own: Vec<&Row> = rows.iter().filter(|r| r.case == case.name).collect();
            if !experiment.axes.is_empty() {
                for cell in 0..experiment.cells() {
                    let here: Vec<&Row> = own.iter().copied().filter(|r| r.cell == cell).collect();
                    let axes = here.first().map_or_else(BTreeMap::new, |r| r.axes.clone());
                    cells.push(group(experiment, &case.name, axes, &here, &format!("{} {cell}", case.name)));
                }
            }
            cases.push(group(experiment, &case.name, BTreeMap::new(), &own, &case.name));
        }
        Self {
            schema: Self::SCHEMA,
            calamus_version: env!("CARGO_PKG_VERSION").into(),
            experiment: experiment.name.clone(),
            seed: experiment.seed,
            hash: experiment.hash.clone(),
            trials: rows.len() as u64,
            failures: rows.iter().filter(|r| !r.is_ok()).count() as u64,
            accept: experiment.accept.iter().flat_map(|a| a.judge(experiment, rows)).collect(),
            contrasts: contrasts(experiment, rows),
            cases,
            cells,
        }
    }

    /// Whether every bound is kept.
    pub fn is_accepted(&self) -> bool {
        self.accept.iter().all(|v| v.met)
    }

    /// The groups that say most: cells where there is a grid, else cases.
    pub fn groups(&self) -> &[Group] {
        if self.cells.is_empty() { &self.cases } else { &self.cells }
    }
}

fn group(experiment: &Experiment, case: &str, axes: BTreeMap<String, Value>, rows: &[&Row], place: &str) -> Group {
    let metrics = MetricPath::all().iter().filter_map(|m| {
        let estimate = Estimate::of(&Quantity::Metric(m), rows, experiment.seed, place)?;
        Some((m.path.clone(), estimate))
    });
    let rates = experiment.rates.iter().filter_map(|r| {
        let estimate = Estimate::of(&Quantity::Rate(r.clone()), rows, experiment.seed, place)?;
        Some((r.name.clone(), estimate))
    });
    Group {
        case: case.to_string(),
        axes,
        n: rows.len() as u64,
        failures: rows.iter().filter(|r| !r.is_ok()).count() as u64,
        rates: rates.collect(),
        metrics: metrics.collect(),
    }
}

/// Each case less the first, trial by trial of equal cell and repeat.
fn contrasts(experiment: &Experiment, rows: &[Row]) -> Vec<Contrast> {
    let Some((first, others)) = experiment.cases.split_first() else { return Vec::new() };
    let reference: BTreeMap<(u64, u64), &Row> =
        rows.iter().filter(|r| r.case == first.name).map(|r| ((r.cell, r.repeat), r)).collect();
    let contrast = |case: &super::spec::Case| {
        let pairs = rows.iter().filter(|r| r.case == case.name);
        let differences: Vec<Row> = pairs
            .filter_map(|r| {
                let other = reference.get(&(r.cell, r.repeat))?;
                let less = |(k, x): (&String, &f64)| Some((k.clone(), x - other.metrics.get(k)?));
                Some(Row { metrics: r.metrics.iter().filter_map(less).collect(), ..Row::default() })
            })
            .collect();
        let differences: Vec<&Row> = differences.iter().collect();
        let place = format!("{} against {}", case.name, first.name);
        let metrics = MetricPath::all().iter().filter_map(|m| {
            let estimate = Estimate::of(&Quantity::Metric(m), &differences, experiment.seed, &place)?;
            Some((m.path.clone(), estimate))
        });
        Contrast { case: case.name.clone(), against: first.name.clone(), metrics: metrics.collect() }
    };
    others.iter().map(contrast).collect()
}
