//! Figures of looking and feeling: contract of metrics.json.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
