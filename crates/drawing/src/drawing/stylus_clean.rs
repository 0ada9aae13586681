//! What is wrong with the samples of a stylus, put right: disorder, spikes, tremor, and hooks where the pen comes down
//! or goes up.
use kurbo::Point;

/// One reading while the pen is down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    /// Where, mm.
    pub point: Point,
    /// How hard, 0..1.
    pub pressure: f64,
    /// When, s.
    pub time: f64,
}

/// How much was put right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Repairs {
    /// Samples at the time of another.
    pub duplicates: usize,
    /// Samples later in the file than in time.
    pub disordered: usize,
    /// Samples far off their neighbours.
    pub spikes: usize,
    /// Strokes freed of a hook at an end.
    pub hooks: usize,
}

/// Sizes that tell a fault from intent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CleanOptions {
    /// Errors below this don't matter, mm.
    pub tolerance: f64,
    /// Longest hook, mm.
    pub hook: f64,
}

/// Samples in one run that may be spikes.
const SPIKE_RUN: usize = 3;
/// A spike is entered and left by steps this many times the usual one.
const SPIKE_STEP: f64 = 6.0;
/// Steps to both sides that say what is usual.
const SPIKE_WINDOW: usize = 8;
/// A hook is drawn with less than this share of the stroke's median pressure ...
const HOOK_PRESSURE: f64 = 0.6;
/// ... turns by more than this, rad, ...
const HOOK_TURN: f64 = 1.05;
/// ... and is no longer than this share of the stroke.
const HOOK_SHARE: f64 = 0.15;
/// Half widths of smoothing windows, in samples.
const WINDOWS: [usize; 7] = [2, 3, 5, 8, 12, 18, 27];
/// How many standard deviations an estimate may move when its window grows.
const CONFIDENCE: f64 = 2.0;
/// Least standard deviation of pressure that is believed.
const PRESSURE_NOISE: f64 = 0.01;

/// A stroke's samples in order of time, smooth, without faults. Never fewer than one, unless there were none.
pub(super) fn clean(mut samples: Vec<Sample>, options: &CleanOptions, repairs: &mut Repairs) -> Vec<Sample> {
    repairs.disordered += samples.windows(2).filter(|w| w[1].time < w[0].time).count();
    samples.sort_by(|a, b| a.time.total_cmp(&b.time));
    let count = samples.len();
    samples.dedup_by(|b, a| b.time - a.time < 1e-7);
    repairs.duplicates += count - samples.len();
    repairs.spikes += remove_spikes(&mut samples, options.tolerance);
    smooth(&mut samples, options.tolerance);
    let mut hooked = cut_hook(&mut samples, options.hook);
    samples.reverse();
    hooked |= cut_hook(&mut samples, options.hook);
    samples.reverse();
    repairs.hooks += usize::from(hooked);
    samples
}

/// Removes runs of samples that are entered and left by jumps though the line goes on without them.
fn remove_spikes(samples: &mut Vec<Sample>, tolerance: f64) -> usize {
    let before = samples.len();
    let mut i = 1;
    while i + 1 < samples.len() {
        let usual = usual_step(samples, i).max(2.0 * tolerance);
        let spike = (1..=SPIKE_RUN).find(|run| {
            let Some(after) = samples.get(i + run) else { return false };
            let enter = samples[i].point.distance(samples[i - 1].point);
            let leave = after.point.distance(samples[i + run - 1].point);
            let without = after.point.distance(samples[i - 1].point);
            let jump = enter.min(leave);
            jump > SPIKE_STEP * usual && 3.0 * without < jump
        });
        match spike {
            Some(run) => drop(samples.drain(i..i + run)),
            None => i += 1,
        }
    }
    before - samples.len()
}

/// Median length of the steps around sample `i`.
fn usual_step(samples: &[Sample], i: usize) -> f64 {
    let around = &samples[i.saturating_sub(SPIKE_WINDOW + 1)..(i + SPIKE_WINDOW + 1).min(samples.len())];
    let mut steps: Vec<f64> = around.windows(2).map(|w| w[1].point.distance(w[0].point)).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}

/// Takes the tremor out of positions and pressures.
fn smooth(samples: &mut [Sample], tolerance: f64) {
    let times: Vec<f64> = samples.iter().map(|s| s.time).collect();
    let places: Vec<[f64; 2]> = samples.iter().map(|s| [s.point.x, s.point.y]).collect();
    let pressures: Vec<[f64; 1]> = samples.iter().map(|s| [s.pressure]).collect();
    let places = smoothed(&times, &places, 0.05 * tolerance);
    let pressures = smoothed(&times, &pressures, PRESSURE_NOISE);
    for ((s, [x, y]), [p]) in samples.iter_mut().zip(places).zip(pressures) {
        s.point = Point::new(x, y);
        s.pressure = p.clamp(0.0, 1.0);
    }
}

/// Each value by a local quadratic in time, over the widest window whose answer agrees with those of narrower ones within
/// what noise explains: the rule of intersecting confidence intervals (Katkovnik 1999, doi:10.1109/78.782189). So straight
/// stretches are smoothed much, and corners stay.
fn smoothed<const D: usize>(times: &[f64], values: &[[f64; D]], least_noise: f64) -> Vec<[f64; D]> {
    let noise = noise(times, values).max(least_noise);
    let n = values.len();
    let estimate = |i: usize| {
        let mut best = values[i];
        // an answer with its standard deviation, for each window so far
        let mut accepted: Vec<([f64; D], f64)> = vec![(best, noise)];
        for half in WINDOWS {
            let (from, to) = (i.saturating_sub(half), (i + half).min(n - 1));
            if to - from < 4 {
                break;
            }
            let Some((value, gain)) = quadratic(&times[from..=to], &values[from..=to], times[i]) else { break };
            let agrees = accepted.iter().all(|(other, sd)| {
                let apart = value.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
                apart <= CONFIDENCE * sd * (D as f64).sqrt()
            });
            if !agrees {
                break;
            }
            best = value;
            accepted.push((value, noise * gain));
        }
        best
    };
    (0..n).map(estimate).collect()
}

/// Standard deviation of one coordinate's noise: how far values lie from the cubic through their four neighbours, which
/// curves hardly feel; by the median, which corners hardly feel.
fn noise<const D: usize>(times: &[f64], values: &[[f64; D]]) -> f64 {
    let mut off: Vec<f64> = (2..values.len().saturating_sub(2))
        .map(|i| {
            let near = [i - 2, i - 1, i + 1, i + 2];
            let weight = |k: usize| {
                near.iter()
                    .filter(|j| **j != k)
                    .map(|j| (times[i] - times[*j]) / (times[k] - times[*j]))
                    .product::<f64>()
            };
            let weights = near.map(weight);
            let spread = (1.0 + weights.iter().map(|w| w * w).sum::<f64>()).sqrt();
            let miss = |d: usize| values[i][d] - near.iter().zip(&weights).map(|(k, w)| w * values[*k][d]).sum::<f64>();
            (0..D).map(|d| miss(d).powi(2)).sum::<f64>().sqrt() / spread
        })
        .filter(|x| x.is_finite())
        .collect();
    off.sort_by(f64::total_cmp);
    // the median of the length of a normal vector, in standard deviations, for one and two coordinates
    let median = if D == 1 { 0.6745 } else { 1.1774 };
    off.get(off.len() / 2).map_or(0.0, |x| x / median)
}

/// The least-squares quadratic's value at `at`, and by how much it scales the noise of the values.
fn quadratic<const D: usize>(times: &[f64], values: &[[f64; D]], at: f64) -> Option<([f64; D], f64)> {
    let span = times[times.len() - 1] - times[0];
    let mut moments = nalgebra::Matrix3::zeros();
    let mut sums = [nalgebra::Vector3::zeros(); D];
    for (t, value) in times.iter().zip(values) {
        let s = (t - at) / span;
        let row = nalgebra::Vector3::new(1.0, s, s * s);
        moments += row * row.transpose();
        for (sum, v) in sums.iter_mut().zip(value) {
            *sum += row * *v;
        }
    }
    let first = moments.try_inverse()?.row(0).transpose();
    let value = sums.map(|s| first.dot(&s));
    (first[0] > 0.0 && value.iter().all(|v| v.is_finite())).then(|| (value, first[0].sqrt()))
}

/// Cuts a hook off the start: a light, short bit of line that then turns sharply into the stroke.
fn cut_hook(samples: &mut Vec<Sample>, longest: f64) -> bool {
    if samples.len() < 6 {
        return false;
    }
    let mut length = vec![0.0; samples.len()];
    for i in 1..samples.len() {
        length[i] = length[i - 1] + samples[i].point.distance(samples[i - 1].point);
    }
    let whole = length[samples.len() - 1];
    let mut pressures: Vec<f64> = samples.iter().map(|s| s.pressure).collect();
    pressures.sort_by(f64::total_cmp);
    let light = HOOK_PRESSURE * pressures[pressures.len() / 2];
    let mut sharpest: Option<(f64, usize)> = None;
    for k in 1..samples.len() - 1 {
        if length[k] > longest.min(HOOK_SHARE * whole) || samples[k - 1].pressure > light {
            break;
        }
        // as far on as the hook is long
        let Some(on) = (k + 1..samples.len()).find(|j| length[*j] - length[k] >= length[k]) else { break };
        let (u, v) = (samples[k].point - samples[0].point, samples[on].point - samples[k].point);
        let turn = u.cross(v).abs().atan2(u.dot(v));
        if turn > HOOK_TURN && sharpest.is_none_or(|(t, _)| turn > t) {
            sharpest = Some((turn, k));
        }
    }
    if let Some((_, k)) = sharpest {
        samples.drain(..k);
    }
    sharpest.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPTIONS: CleanOptions = CleanOptions { tolerance: 0.05, hook: 1.5 };

    /// A gentle wave of 100 mm, 200 samples a second, with noise of `sd` mm.
    fn wave(sd: f64) -> Vec<Sample> {
        use rand::RngExt as _;
        let mut rng = crate::math::stream(3, "stylus", 0);
        let mut normal = move || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        (0..=400)
            .map(|i| {
                let x = 0.25 * f64::from(i);
                let point = Point::new(x + sd * normal(), 8.0 * (x / 12.0).sin() + sd * normal());
                Sample { point, pressure: 0.5 + 0.3 * (x / 15.0).sin(), time: 5e-3 * f64::from(i) }
            })
            .collect()
    }

    fn error(samples: &[Sample]) -> f64 {
        let off = |s: &Sample| {
            (-40..=40)
                .map(|k| s.point.x + 0.01 * f64::from(k))
                .map(|x| s.point.distance(Point::new(x, 8.0 * (x / 12.0).sin())))
                .fold(f64::INFINITY, f64::min)
        };
        (samples.iter().map(|s| off(s).powi(2)).sum::<f64>() / samples.len() as f64).sqrt()
    }

    #[test]
    fn tremor_falls_to_a_third_and_clean_samples_stay() {
        let mut repairs = Repairs::default();
        let rough = error(&wave(0.1));
        let cleaned = clean(wave(0.1), &OPTIONS, &mut repairs);
        assert!(error(&cleaned) < 0.34 * rough, "{} of {rough}", error(&cleaned));
        let still = clean(wave(0.0), &OPTIONS, &mut repairs);
        assert!(still.iter().zip(wave(0.0)).all(|(a, b)| a.point.distance(b.point) < 5e-3));
        assert_eq!(repairs, Repairs::default());
    }

    #[test]
    fn a_corner_survives_the_smoothing() {
        let mut bent = wave(0.02);
        for s in &mut bent {
            s.point.y = if s.point.x < 50.0 { 0.0 } else { 2.0 * (s.point.x - 50.0) };
        }
        let cleaned = clean(bent, &OPTIONS, &mut Repairs::default());
        let nearest = cleaned.iter().map(|s| s.point.distance(Point::new(50.0, 0.0))).fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.15, "{nearest} mm from the corner");
    }

    #[test]
    fn spikes_duplicates_and_disorder_are_put_right() {
        let mut faulty = wave(0.02);
        faulty[60].point.y += 30.0;
        faulty[200].point.x -= 20.0;
        faulty[201].point.x -= 20.0;
        faulty.swap(100, 101);
        faulty.insert(300, faulty[300]);
        let mut repairs = Repairs::default();
        let cleaned = clean(faulty, &OPTIONS, &mut repairs);
        assert_eq!(repairs, Repairs { duplicates: 1, disordered: 1, spikes: 3, hooks: 0 });
        assert!(error(&cleaned) < 0.02, "{}", error(&cleaned));
    }

    #[test]
    fn light_hooks_are_cut_and_pressed_ones_are_desired() {
        let hooked = |pressure: f64| {
            let mut samples = wave(0.0);
            for (i, s) in samples.iter_mut().take(4).enumerate() {
                s.point = Point::new(1.0 + 0.2 * (4 - i) as f64 - 1.0, 0.25 * (4 - i) as f64 - 0.2);
                s.pressure = pressure;
            }
            samples
        };
        let mut repairs = Repairs::default();
        let light = clean(hooked(0.05), &OPTIONS, &mut repairs);
        assert_eq!((repairs.hooks, light.len() < 400), (1, true));
        let desired = clean(hooked(0.5), &OPTIONS, &mut repairs);
        assert_eq!((repairs.hooks, desired.len()), (1, 401));
    }
}
