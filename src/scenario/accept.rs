//! Bounds on the figures of a run.
use std::fmt;

use crate::measure::Metrics;

use super::file::Threshold;
use super::resolve::Scenario;

/// A figure outside the bounds that the scenario sets.
#[derive(Clone, Debug, PartialEq)]
pub struct Unmet {
    /// Dotted path of the figure.
    pub path: String,
    /// Its bounds.
    pub bounds: Threshold,
    /// Its value; `None` where the run has no such figure.
    pub value: Option<f64>,
}

impl fmt::Display for Unmet {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.value {
            Some(value) => write!(f, "{} is {value}", self.path)?,
            None => write!(f, "{} was not measured", self.path)?,
        }
        match (self.bounds.min, self.bounds.max) {
            (Some(min), Some(max)) => write!(f, ": should be from {min} to {max}"),
            (Some(min), None) => write!(f, ": should be at least {min}"),
            (None, Some(max)) => write!(f, ": should be at most {max}"),
            (None, None) => Ok(()),
        }
    }
}

impl Scenario {
    /// The figures that are outside their bounds, or absent though they have bounds, by name.
    pub fn unmet(&self, metrics: &Metrics) -> Vec<Unmet> {
        let within =
            |bounds: &Threshold, x: f64| bounds.min.is_none_or(|min| x >= min) && bounds.max.is_none_or(|max| x <= max);
        let values = metrics.values();
        let mut unmet = Vec::new();
        for (path, bounds) in &self.accept {
            let value = values.iter().find(|(m, _)| m.path == *path).map(|(_, value)| *value);
            if !value.is_some_and(|x| within(bounds, x)) {
                unmet.push(Unmet { path: path.clone(), bounds: *bounds, value });
            }
        }
        unmet
    }
}
