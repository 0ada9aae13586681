//! How well a robot that draws by touch foretells where it will meet the canvas.
use serde::{Deserialize, Serialize};

use crate::math::stats::Running;
use crate::measure::BeliefMetrics;

/// Predicted less met heights along one stroke; the prediction is that from before the stroke.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrokeHeights {
    /// Index of the layer.
    pub layer: usize,
    /// Index of the stroke in the layer.
    pub stroke: usize,
    /// When it was done, s.
    pub time: f64,
    /// Touches known before it.
    pub known: usize,
    /// Places compared.
    pub places: usize,
    /// Mean of the difference, m.
    pub bias: f64,
    /// Mean of its absolute value, m.
    pub mean: f64,
    /// Largest absolute value, m.
    pub max: f64,
}

impl StrokeHeights {
    /// Sums up the differences (m) of a stroke; `None` where there are none.
    pub fn of(layer: usize, stroke: usize, time: f64, known: usize, errors: impl Iterator<Item = f64>) -> Option<Self> {
        let (mut bias, mut size) = (Running::default(), Running::default());
        for e in errors {
            bias.push(e);
            size.push(e.abs());
        }
        let places = size.count as usize;
        let own = Self { layer, stroke, time, known, places, bias: bias.mean, mean: size.mean, max: size.max };
        (places > 0).then_some(own)
    }
}

impl BeliefMetrics {
    /// These figures with those of the strokes, in the order drawn: quarters are quarters of the places met.
    pub fn with_heights(self, strokes: &[StrokeHeights]) -> Self {
        let total: usize = strokes.iter().map(|s| s.places).sum();
        let quarter = |of: &mut dyn Iterator<Item = &StrokeHeights>| {
            let (mut left, mut sum) = (total as f64 / 4.0, 0.0);
            for s in of {
                let taken = left.min(s.places as f64);
                sum += taken * s.mean;
                left -= taken;
            }
            (total > 0).then(|| sum / (total as f64 / 4.0) * 1e3)
        };
        Self {
            height_error_first_mm: quarter(&mut strokes.iter()),
            height_error_last_mm: quarter(&mut strokes.iter().rev()),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarters_are_of_the_places_met() {
        let of = |stroke, n: usize, e: f64| StrokeHeights::of(0, stroke, 0.0, 0, std::iter::repeat_n(e, n));
        let strokes: Vec<_> =
            [of(0, 10, -0.002), of(1, 0, 9.0), of(2, 60, 0.001), of(3, 30, 0.0005)].into_iter().flatten().collect();
        let m = BeliefMetrics::default().with_heights(&strokes);
        assert!((m.height_error_first_mm.unwrap() - (10.0 * 2.0 + 15.0) / 25.0).abs() < 1e-12);
        assert!((m.height_error_last_mm.unwrap() - 0.5).abs() < 1e-12);
        assert_eq!(BeliefMetrics::default().with_heights(&[]), BeliefMetrics::default());
    }
}
