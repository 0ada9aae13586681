//! Intervals that say how far an estimate can be trusted.
use rand_chacha::rand_core::Rng;

use super::seed::unit;
use super::stats::quantile;

/// Standard normal quantile of a two-sided 95 % interval.
const Z: f64 = 1.959_963_984_540_054;

/// 95 % interval of the mean of `x` by the percentile bootstrap (doi:10.1214/aos/1176344552) with `resamples` resamples; `None`
/// of fewer than two samples.
pub fn bootstrap_mean(x: &[f64], resamples: u32, rng: &mut impl Rng) -> Option<[f64; 2]> {
    if x.len() < 2 {
        return None;
    }
    let n = x.len() as f64;
    let mut resample = || (0..x.len()).map(|_| x[(unit(rng) * n) as usize]).sum::<f64>() / n;
    let means: Vec<f64> = (0..resamples.max(2)).map(|_| resample()).collect();
    Some([quantile(&means, 0.025)?, quantile(&means, 0.975)?])
}

/// Wilson's 95 % score interval of a rate, `successes` of `n` (doi:10.1080/01621459.1927.10502953); `None` of no trials.
///
/// `(p + z^2/2n +- z sqrt(p (1 - p)/n + z^2/4n^2)) / (1 + z^2/n)`
pub fn wilson(successes: u64, n: u64) -> Option<[f64; 2]> {
    if n == 0 {
        return None;
    }
    let (count, p) = (n as f64, successes as f64 / n as f64);
    let zz = Z * Z / count;
    let half = Z * (p * (1.0 - p) / count + zz / (4.0 * count)).sqrt();
    let at = |side: f64| ((p + zz / 2.0 + side * half) / (1.0 + zz)).clamp(0.0, 1.0);
    // at none and at all the bound is the rate itself, which rounding may miss
    let low = if successes == 0 { 0.0 } else { at(-1.0) };
    let high = if successes >= n { 1.0 } else { at(1.0) };
    Some([low, high])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::stream;

    #[test]
    fn wilsons_interval_has_published_values() {
        // Newcombe 1998 (doi:10.1002/(SICI)1097-0258(19980430)17:8<857::AID-SIM777>3.0.CO;2-E), table I, method 3
        let cases = [
            ((81, 263), [0.2553, 0.3662]),
            ((15, 148), [0.0624, 0.1605]),
            ((0, 20), [0.0, 0.1611]),
            ((1, 29), [0.0061, 0.1718]),
        ];
        for ((k, n), [low, high]) in cases {
            let [a, b] = wilson(k, n).unwrap();
            assert!((a - low).abs() < 5e-5 && (b - high).abs() < 5e-5, "{k}/{n}: {a} {b}");
        }
        assert_eq!(wilson(0, 0), None);
        assert_eq!(wilson(5, 5).unwrap()[1], 1.0);
    }

    #[test]
    fn the_bootstrap_holds_the_mean_as_often_as_it_says() {
        // samples of a uniform distribution: its mean is 1/2
        let held = (0..400)
            .filter(|i| {
                let mut rng = stream(1, "samples", *i);
                let x: Vec<f64> = (0..40).map(|_| unit(&mut rng)).collect();
                let [low, high] = bootstrap_mean(&x, 300, &mut stream(2, "bootstrap", *i)).unwrap();
                low <= 0.5 && 0.5 <= high
            })
            .count();
        assert!((360..=392).contains(&held), "{held} of 400");
        assert_eq!(bootstrap_mean(&[1.0], 100, &mut stream(1, "", 0)), None);
    }
}
