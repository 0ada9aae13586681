//! How a flat map of a patch stretches it.
use nalgebra::{Matrix2, Point2};

use super::chart::Chart;
use super::patch::Patch;

/// How the map from the chart to the surface stretches one triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Area on the surface by area in the chart.
    pub area_ratio: f64,
    /// Larger by smaller principal stretch, at least 1: the quasi-conformal error; 1 where angles are kept.
    pub quasi_conformal: f64,
    /// Area of the triangle in the chart, m2; negative where it lies turned over.
    pub chart_area: f64,
}

impl Stretch {
    /// Of the linear map whose matrix, chart to surface, is `surface_from_chart`.
    pub fn of(surface_from_chart: &Matrix2<f64>, chart_area: f64) -> Self {
        // singular values by the sums and differences of a 2 x 2 matrix, without roots of differences
        let m = surface_from_chart;
        let (e, f) = ((m.m11 + m.m22) / 2.0, (m.m11 - m.m22) / 2.0);
        let (g, h) = ((m.m21 + m.m12) / 2.0, (m.m21 - m.m12) / 2.0);
        let (q, r) = (e.hypot(h), f.hypot(g));
        let (large, small) = (q + r, (q - r).abs());
        Self { area_ratio: large * small, quasi_conformal: large / small, chart_area }
    }

    /// The most that a right angle of the chart can change on the surface, degrees: `2 atan(s1 / s2) - 90`.
    pub fn angle_error_deg(&self) -> f64 {
        (2.0 * self.quasi_conformal.atan()).to_degrees() - 90.0
    }
}

/// The stretch of one triangle of a patch that lies in the chart at `flat`.
pub(super) fn stretch(patch: &Patch, flat: &[Point2<f64>], triangle: usize) -> Stretch {
    let [a, b, c] = patch.flat_triangle(triangle);
    let [u, v, w] = patch.triangles[triangle].map(|i| flat[i as usize]);
    let surface = Matrix2::from_columns(&[b - a, c - a]);
    let chart = Matrix2::from_columns(&[v - u, w - u]);
    let inverse = chart.try_inverse().unwrap_or_else(Matrix2::zeros);
    Stretch::of(&(surface * inverse), chart.determinant() / 2.0)
}

/// Figures of the stretch of many pieces, weighted by their area.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Distortion {
    /// Mean quasi-conformal error, by area; 1 for none.
    pub quasi_conformal_mean: f64,
    /// Its largest value.
    pub quasi_conformal_max: f64,
    /// Mean of the largest change of right angles, degrees.
    pub angle_error_mean: f64,
    /// Its 95th percentile, degrees.
    pub angle_error_p95: f64,
    /// 5th percentile of area on the surface by area in the chart.
    pub area_ratio_p05: f64,
    /// 95th percentile of it.
    pub area_ratio_p95: f64,
    /// Root mean square of the logarithm of the area ratio about its mean.
    pub log_area_rms: f64,
    /// Pieces that lie turned over.
    pub flips: usize,
    /// Pieces.
    pub pieces: usize,
}

impl Distortion {
    /// Sums up pieces; `None` when there are none.
    pub fn of(pieces: &[Stretch]) -> Option<Self> {
        let weight = |s: &Stretch| s.chart_area.abs();
        let total: f64 = pieces.iter().map(weight).sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mean = |value: &dyn Fn(&Stretch) -> f64| pieces.iter().map(|s| weight(s) * value(s)).sum::<f64>() / total;
        let percentile = |share: f64, value: &dyn Fn(&Stretch) -> f64| {
            let mut sorted: Vec<(f64, f64)> = pieces.iter().map(|s| (value(s), weight(s))).collect();
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut sum = 0.0;
            sorted
                .iter()
                .find(|(_, w)| {
                    sum += w;
                    sum >= share * total
                })
                .or(sorted.last())
                .map_or(0.0, |v| v.0)
        };
        let log_mean = mean(&|s| s.area_ratio.ln());
        Some(Self {
            quasi_conformal_mean: mean(&|s| s.quasi_conformal),
            quasi_conformal_max: pieces.iter().fold(1.0, |most: f64, s| most.max(s.quasi_conformal)),
            angle_error_mean: mean(&Stretch::angle_error_deg),
            angle_error_p95: percentile(0.95, &Stretch::angle_error_deg),
            area_ratio_p05: percentile(0.05, &|s| s.area_ratio),
            area_ratio_p95: percentile(0.95, &|s| s.area_ratio),
            log_area_rms: mean(&|s| (s.area_ratio.ln() - log_mean).powi(2)).sqrt(),
            flips: pieces.iter().filter(|s| s.chart_area <= 0.0).count(),
            pieces: pieces.len(),
        })
    }

    /// Of the part of a chart whose triangles' centres are in the rectangle round `center` of half sides `half` (m).
    pub fn of_chart(chart: &Chart, center: &Point2<f64>, half: [f64; 2]) -> Option<Self> {
        Self::of(&chart.stretches_in(center, half))
    }
}
