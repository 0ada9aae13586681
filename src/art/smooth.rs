//! Planes blurred and resampled.
use rayon::prelude::*;

use crate::picture::Plane;

/// Largest standard deviation, px, for which the Gaussian is summed directly; above it three box means stand in for it.
const DIRECT: f64 = 2.0;

/// A plane blurred by a Gaussian of this standard deviation, px; the border repeats outside.
pub(super) fn blur(plane: &Plane, sigma: f64) -> Plane {
    if sigma <= 0.05 || plane.values.is_empty() {
        return plane.clone();
    }
    let pass = |values: &[f32], width: usize| -> Vec<f32> {
        let mut out = vec![0.0; values.len()];
        out.par_chunks_mut(width).zip(values.par_chunks(width)).for_each(|(out, row)| {
            if sigma <= DIRECT { gauss(row, out, sigma) } else { boxes(row, out, sigma) }
        });
        out
    };
    let (w, h) = (plane.width(), plane.height());
    let across = transpose(&pass(&plane.values, w), w, h);
    let values = transpose(&pass(&across, h), h, w);
    Plane::from_values(w, h, values).unwrap_or_default()
}

/// The values of `height` rows as columns.
fn transpose(values: &[f32], width: usize, height: usize) -> Vec<f32> {
    let mut out = vec![0.0; values.len()];
    out.par_chunks_mut(height).enumerate().for_each(|(column, out)| {
        out.iter_mut().enumerate().for_each(|(row, v)| *v = values[row * width + column]);
    });
    out
}

fn gauss(row: &[f32], out: &mut [f32], sigma: f64) {
    let reach = (3.0 * sigma).ceil() as isize;
    let weights: Vec<f32> = (-reach..=reach).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp() as f32).collect();
    let sum: f32 = weights.iter().sum();
    let last = row.len() as isize - 1;
    for (i, v) in out.iter_mut().enumerate() {
        let terms = weights.iter().enumerate();
        *v = terms.map(|(k, w)| w * row[(i as isize + k as isize - reach).clamp(0, last) as usize]).sum::<f32>() / sum;
    }
}

/// Three means over windows whose variances add up to the Gaussian's; the windows' ends are weighted by fractions.
fn boxes(row: &[f32], out: &mut [f32], sigma: f64) {
    // A window of half width r plus ends of weight f: variance of the continuous box of width 2 r + 1 + 2 f, nearly.
    let width = (4.0 * sigma * sigma + 1.0).sqrt();
    let half = 0.5 * (width - 1.0);
    let (reach, end) = (half as isize, half.fract());
    let last = row.len() as isize - 1;
    let mut from: Vec<f32> = row.to_vec();
    for _ in 0..3 {
        let at = |i: isize| f64::from(from[i.clamp(0, last) as usize]);
        let mut sum: f64 = (-reach..=reach).map(at).sum();
        for i in 0..=last {
            out[i as usize] = ((sum + end * (at(i - reach - 1) + at(i + reach + 1))) / width) as f32;
            sum += at(i + reach + 1) - at(i - reach);
        }
        from.copy_from_slice(out);
    }
}

/// A plane resampled to another size: the mean over each new pixel's area where it shrinks, bilinear where it grows.
pub(super) fn resize(plane: &Plane, width: usize, height: usize) -> Plane {
    let pass = |values: &[f32], from: usize, to: usize| -> Vec<f32> {
        let scale = from as f64 / to as f64;
        let mut out = vec![0.0; values.len() / from.max(1) * to];
        out.par_chunks_mut(to).zip(values.par_chunks(from)).for_each(|(out, row)| {
            for (i, v) in out.iter_mut().enumerate() {
                *v = if scale > 1.0 { mean(row, i as f64 * scale, (i + 1) as f64 * scale) } else { between(row, (i as f64 + 0.5) * scale) };
            }
        });
        out
    };
    let (w, h) = (plane.width(), plane.height());
    if (w, h) == (width, height) || w * h * width * height == 0 {
        return plane.clone();
    }
    let rows = pass(&plane.values, w, width);
    let values = transpose(&pass(&transpose(&rows, width, h), h, height), height, width);
    Plane::from_values(width, height, values).unwrap_or_default()
}

/// Mean of the step function `row` over an interval.
fn mean(row: &[f32], from: f64, to: f64) -> f32 {
    let (first, last) = (from as usize, (to.ceil() as usize).min(row.len()));
    let share = |i: usize| (to.min((i + 1) as f64) - from.max(i as f64)).max(0.0);
    let sum: f64 = (first..last).map(|i| share(i) * f64::from(row[i])).sum();
    (sum / (to - from)) as f32
}

/// The value at a place of the row, linear between centres at halves.
fn between(row: &[f32], x: f64) -> f32 {
    let x = (x - 0.5).clamp(0.0, (row.len() - 1) as f64);
    let i = x as usize;
    let f = (x - i as f64) as f32;
    row[i] * (1.0 - f) + row[(i + 1).min(row.len() - 1)] * f
}
