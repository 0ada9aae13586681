//! Figures of looking and feeling: contract of metrics.json.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::math::stats;
use crate::skill::Aligned;

/// What a base found out of its place by its camera and its pen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct LookMetrics {
    /// Pictures taken by the hand's camera.
    pub pictures: usize,
    /// Pictures that were of no use: what was believed stayed.
    pub refused: usize,
    /// Points at which the pen felt the wall.
    pub felt: usize,
    /// By how much the believed place was moved, median over the places.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correction_p50_mm: Option<f64>,
    /// By how much the believed place was moved, at most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correction_max_mm: Option<f64>,
    /// By how much the believed heading was turned, median over the places.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correction_p50_mrad: Option<f64>,
    /// What is left across the lines in a picture, root of the mean square, mean over the pictures.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "px"))]
    pub rms_px: Option<f64>,
}

impl LookMetrics {
    /// Figures of what was found out, place after place.
    pub fn of(aligned: &[Aligned]) -> Self {
        let arrived: Vec<&Aligned> = aligned.iter().filter(|a| !a.leaving).collect();
        let corrected = |of: fn(&Aligned) -> f64| {
            let values: Vec<f64> = arrived.iter().map(|a| of(a) * 1e3).collect();
            (stats::quantile(&values, 0.5), values.iter().copied().reduce(f64::max))
        };
        let (shift, turn) = (corrected(|a| a.correction[0]), corrected(|a| a.correction[1]));
        let read: Vec<f64> = aligned.iter().filter(|a| a.points > 0).map(|a| a.rms_px).collect();
        Self {
            pictures: aligned.iter().map(|a| a.pictures).sum(),
            refused: aligned.iter().filter(|a| a.refused.is_some()).count(),
            felt: aligned.iter().map(|a| a.felt).sum(),
            correction_p50_mm: shift.0,
            correction_max_mm: shift.1,
            correction_p50_mrad: turn.0,
            rms_px: stats::mean(&read),
        }
    }
}
