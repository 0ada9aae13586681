//! Bounds on the figures of a run.
use std::fmt;

use crate::math::{exactly, figure};
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
            Some(value) => {
                let limit = self.bounds.min.filter(|min| value < *min).or(self.bounds.max).unwrap_or(f64::NAN);
                write!(f, "{} is {}", self.path, told_apart(value, limit))?;
            }
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

/// A figure in as many digits as tell it from a limit: six, or all where these would put it on the limit or to its other side.
pub fn told_apart(value: f64, limit: f64) -> String {
    let short = figure(value);
    let differs = short.parse().ok().and_then(|x: f64| x.partial_cmp(&limit)) == value.partial_cmp(&limit);
    if differs { short } else { exactly(value) }
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

#[cfg(test)]
mod tests {
    use super::told_apart;

    #[test]
    fn a_missed_bound_shows_that_it_is_missed() {
        assert_eq!(told_apart(0.994_999_96, 0.995), "0.99499996");
        assert_eq!(told_apart(0.123_456_789, 0.5), "0.123457");
        assert_eq!(told_apart(0.5, 0.5), "0.5");
    }
}
