//! A figure over several trials.
use serde::Serialize;

use crate::math::stats::{mean, quantile};
use crate::math::{bootstrap_mean, stream, wilson};

use super::quantity::Quantity;
use super::row::Row;

/// Resamples of a bootstrap: its ends are then good to some percent of the interval's width.
const RESAMPLES: u32 = 1000;

/// A figure over several trials; of a rate, `mean` is the rate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Trials that have the figure.
    pub n: u64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Standard deviation of the trials, by n - 1; 0 of one trial.
    pub sd: f64,
    /// Median.
    pub median: f64,
    /// Lower end of the mean's 95 % interval: bootstrap, and Wilson's for a rate; absent of one trial.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low: Option<f64>,
    /// Its upper end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub high: Option<f64>,
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
}

impl Estimate {
    /// Over these trials; `None` when none has the figure. `place` names the random stream of the bootstrap.
    pub(super) fn of(quantity: &Quantity, rows: &[&Row], seed: u64, place: &str) -> Option<Self> {
        let values: Vec<f64> = rows.iter().filter_map(|r| quantity.value(r)).collect();
        let n = values.len() as u64;
        let mean = mean(&values)?;
        let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
        let interval = match quantity {
            Quantity::Rate(_) => wilson(values.iter().filter(|x| **x > 0.5).count() as u64, n),
            Quantity::Metric(m) => {
                bootstrap_mean(&values, RESAMPLES, &mut stream(seed, &format!("bootstrap {} {place}", m.path), 0))
            }
        };
        Some(Self {
            n,
            mean,
            sd: (squares / n.saturating_sub(1).max(1) as f64).sqrt(),
            median: quantile(&values, 0.5)?,
            low: interval.map(|i| i[0]),
            high: interval.map(|i| i[1]),
            min: values.iter().copied().fold(f64::INFINITY, f64::min),
            max: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        })
    }
}
