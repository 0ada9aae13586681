//! How a canvas that is touched becomes known, as a table and as a plot.
use std::fmt::Write as _;

use crate::measure::StrokeHeights;

use super::figure::Figure;
use super::plot::{Frame, Plot, WIDTH, series_color};

/// Height of the plot's axes, px.
const AXES: f64 = 300.0;
/// Below them: ticks and label, px.
const FOOT: f64 = 52.0;
/// Strokes that the smooth line looks at, as a share of all.
const WINDOW: f64 = 0.1;

/// One line a stroke, in mm, after a line of names.
pub fn heights_csv(strokes: &[StrokeHeights]) -> String {
    let mut csv = String::from("layer,stroke,time_s,known,places,bias_mm,error_mean_mm,error_max_mm\n");
    for s in strokes {
        let [bias, mean, max] = [s.bias, s.mean, s.max].map(|m| m * 1e3);
        let _ = writeln!(
            csv,
            "{},{},{:.3},{},{},{bias:.4},{mean:.4},{max:.4}",
            s.layer, s.stroke, s.time, s.known, s.places
        );
    }
    csv
}

/// Height errors over the touches that were known: a dot a stroke, and their running mean.
pub fn heights_figure(strokes: &[StrokeHeights]) -> Figure {
    let mut figure = Figure::new("Height error of the prediction, stroke by stroke", Figure::HEAD + AXES + FOOT);
    let frame = Frame { left: 74.0, top: Figure::HEAD, right: WIDTH - 24.0, bottom: Figure::HEAD + AXES };
    let errors: Vec<(f64, f64)> = strokes.iter().map(|s| (s.known as f64, s.mean * 1e3)).collect();
    let top = errors.iter().map(|e| e.1).fold(0.0, f64::max);
    let last = errors.iter().map(|e| e.0).fold(1.0, f64::max);
    let mut plot = Plot::within(frame, (0.0, last * 1.02), (0.0, top * 1.08));
    for (x, y) in &errors {
        plot.curve(series_color(0), &[(*x, *y)]);
    }
    let half = ((errors.len() as f64 * WINDOW * 0.5).ceil() as usize).max(1);
    let smooth: Vec<(f64, f64)> = (0..errors.len())
        .map(|i| {
            let near = i.saturating_sub(half)..(i + half + 1).min(errors.len());
            let places: usize = strokes[near.clone()].iter().map(|s| s.places).sum();
            let sum: f64 = strokes[near].iter().map(|s| s.mean * 1e3 * s.places as f64).sum();
            (errors[i].0, sum / places.max(1) as f64)
        })
        .collect();
    plot.curve(series_color(1), &smooth);
    figure.add(&plot, "touches known before the stroke", "mean height error, mm");
    figure.legend(series_color(0), "a stroke");
    figure.legend(series_color(1), "running mean");
    figure
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_is_a_line_and_a_dot() {
        let stroke =
            |stroke, known, error: f64| StrokeHeights::of(0, stroke, 12.5, known, [error, -error].into_iter()).unwrap();
        let strokes = [stroke(0, 9, 1e-3), stroke(1, 40, 5e-4)];
        let csv = heights_csv(&strokes);
        assert_eq!(csv.lines().nth(1), Some("0,0,12.500,9,2,0.0000,1.0000,1.0000"));
        assert_eq!(csv.lines().count(), 3);
        let svg = heights_figure(&strokes).svg();
        assert!(svg.matches("<circle").count() >= 2 && !svg.contains("NaN"));
        assert!(!heights_figure(&[]).svg().contains("NaN"));
    }
}
