//! Bounds on results, and whether they were kept.
use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize as _, Serialize};
use serde_json::Value;

use crate::diagnostic;
use crate::scenario::told_apart;

use super::axis::{Axis, words};
use super::estimate::Estimate;
use super::file::AcceptFile;
use super::quantity::{Quantity, Rate};
use super::row::Row;
use super::spec::{Case, Experiment};

/// Bounds of one figure over some of the trials.
#[derive(Clone, Debug)]
pub struct Accept {
    quantity: Quantity,
    bounds: AcceptFile,
}

/// One bound and the value that it is for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BoundCheck {
    /// The figure, or `rate.NAME`.
    pub metric: String,
    /// The case that it is for, when for one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub case: Option<String>,
    /// The point of the axes that it is for, when for one.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub at: BTreeMap<String, Value>,
    /// Which statistic: `mean_max` and so on.
    pub bound: &'static str,
    /// What it may be.
    pub limit: f64,
    /// What it is; absent when no trial has the figure.
    pub value: Option<f64>,
    /// Trials that failed among those it is for.
    pub failures: u64,
    /// Whether it is kept.
    pub met: bool,
}

impl fmt::Display for BoundCheck {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (statistic, side) = self.bound.rsplit_once('_').unwrap_or(("every trial", self.bound));
        let statistic = match statistic {
            "low" => "lower end of the 95 % interval",
            "high" => "upper end of the 95 % interval",
            other => other,
        };
        let side = if side == "min" { "at least" } else { "at most" };
        write!(f, "{}", self.metric)?;
        if let Some(case) = &self.case {
            write!(f, " of {case}")?;
        }
        for (key, value) in &self.at {
            write!(f, " at {key} = {}", words(value))?;
        }
        write!(f, ", {statistic}: ")?;
        match self.value {
            Some(value) => write!(f, "{}", told_apart(value, self.limit))?,
            None => write!(f, "not measured")?,
        }
        write!(f, ", should be {side} {}", self.limit)?;
        if self.failures > 0 {
            write!(f, " ({} of its trials failed)", self.failures)?;
        }
        Ok(())
    }
}

impl Accept {
    /// Reads `[accept]`. The error is the figure at fault and what is wrong.
    pub(super) fn parse_all(
        table: &BTreeMap<String, Value>,
        rates: &[Rate],
        cases: &[Case],
        axes: &[Axis],
    ) -> Result<Vec<Self>, (String, String)> {
        let mut all = Vec::new();
        // `rate.x = {...}` without quotes is a table in a table
        let nested = |(key, value): (&String, &Value)| match value {
            Value::Object(inner) if key == "rate" => {
                inner.iter().map(|(k, v)| (format!("rate.{k}"), v.clone())).collect()
            }
            _ => vec![(key.clone(), value.clone())],
        };
        for (key, value) in table.iter().flat_map(nested) {
            let items = match value {
                Value::Array(items) if !items.is_empty() => items,
                one => vec![one],
            };
            for item in items {
                let accept = Self::parse(&key, &item, rates, cases, axes);
                all.push(accept.map_err(|message| (key.clone(), message))?);
            }
        }
        Ok(all)
    }

    fn parse(key: &str, value: &Value, rates: &[Rate], cases: &[Case], axes: &[Axis]) -> Result<Self, String> {
        let quantity = Quantity::parse(key, rates)?;
        if !value.is_object() {
            return Err(format!("`{key}` takes bounds such as {{ mean_max = 0.1 }}, or a list of them"));
        }
        let bounds =
            AcceptFile::deserialize(value).map_err(|e| format!("`{key}`: {}", diagnostic::explain(&e.to_string())))?;
        if let Some(case) = bounds.case.as_deref().filter(|c| !cases.iter().any(|known| known.name == *c)) {
            return Err(match diagnostic::nearest(case, cases.iter().map(|c| c.name.as_str())) {
                Some(near) if !near.is_empty() => format!("no case `{case}`: did you mean `{near}`?"),
                _ => format!("no case `{case}`"),
            });
        }
        for (name, value) in &bounds.at {
            let Some(axis) = axes.iter().find(|a| a.key == *name) else {
                return Err(match diagnostic::nearest(name, axes.iter().map(|a| a.key.as_str())) {
                    Some(near) => format!("no axis `{name}`: did you mean `{near}`?"),
                    None => format!("no axis `{name}` in [vary]"),
                });
            };
            if !axis.values.iter().any(|v| same(v, value)) {
                let known: Vec<String> = axis.values.iter().map(words).collect();
                return Err(format!("`{name}` never is {}: it is {}", words(value), known.join(", ")));
            }
        }
        let accept = Self { quantity, bounds };
        match accept.limits().next() {
            Some(_) => Ok(accept),
            None => Err(format!(
                "`{key}` needs a bound: mean_max, mean_min, median_max, median_min, low_min, high_max, max or min"
            )),
        }
    }

    /// The bounds that are given.
    fn limits(&self) -> impl Iterator<Item = (&'static str, f64)> + use<> {
        let b = &self.bounds;
        [
            ("mean_min", b.mean_min),
            ("mean_max", b.mean_max),
            ("median_min", b.median_min),
            ("median_max", b.median_max),
            ("low_min", b.low_min),
            ("high_max", b.high_max),
            ("min", b.min),
            ("max", b.max),
        ]
        .into_iter()
        .filter_map(|(name, limit)| Some((name, limit?)))
    }

    /// Whether each bound is kept.
    pub(super) fn judge(&self, experiment: &Experiment, rows: &[Row]) -> Vec<BoundCheck> {
        let is_meant = |row: &&Row| {
            self.bounds.case.as_ref().is_none_or(|c| row.case == *c)
                && self.bounds.at.iter().all(|(k, v)| row.axes.get(k).is_some_and(|x| same(x, v)))
        };
        let meant: Vec<&Row> = rows.iter().filter(is_meant).collect();
        let failures = meant.iter().filter(|r| !r.is_ok()).count() as u64;
        let estimate = Estimate::of(&self.quantity, &meant, experiment.seed, "accept");
        let value_of = |bound: &str| {
            let e = estimate.as_ref()?;
            match bound {
                "mean_min" | "mean_max" => Some(e.mean),
                "median_min" | "median_max" => Some(e.median),
                "low_min" => e.low,
                "high_max" => e.high,
                "min" => Some(e.min),
                _ => Some(e.max),
            }
        };
        self.limits()
            .map(|(bound, limit)| {
                let value = value_of(bound);
                let keeps = |x: f64| if bound.ends_with("min") { x >= limit } else { x <= limit };
                BoundCheck {
                    metric: self.quantity.name(),
                    case: self.bounds.case.clone(),
                    at: self.bounds.at.clone(),
                    bound,
                    limit,
                    value,
                    failures,
                    met: value.is_some_and(keeps),
                }
            })
            .collect()
    }
}

/// Whether values are equal, whole numbers and others alike.
fn same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b)),
        _ => a == b || a.as_f64().zip(b.as_f64()).is_some_and(|(a, b)| a == b),
    }
}
