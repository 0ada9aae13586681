//! Means, spreads and quantiles of samples.

/// Arithmetic mean; `None` of no samples.
pub fn mean(x: &[f64]) -> Option<f64> {
    (!x.is_empty()).then(|| x.iter().sum::<f64>() / x.len() as f64)
}

/// Quantile `p` in `[0, 1]` by linear interpolation between order statistics (type 7); `None` of no samples.
pub fn quantile(x: &[f64], p: f64) -> Option<f64> {
    if x.is_empty() {
        return None;
    }
    let mut sorted = x.to_vec();
    sorted.sort_by(f64::total_cmp);
    let h = p.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    let (i, f) = (h.floor() as usize, h.fract());
    let next = sorted[(i + 1).min(sorted.len() - 1)];
    Some(sorted[i] + f * (next - sorted[i]))
}

/// Smallest value that at least the share `p` of the weight doesn't exceed, of `(value, weight)` pairs, which are
/// sorted by value on the way; `None` without weight.
pub fn weighted_quantile(x: &mut [(f64, f64)], p: f64) -> Option<f64> {
    x.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = x.iter().map(|v| v.1).sum();
    let mut sum = 0.0;
    if total <= 0.0 {
        return None;
    }
    for (value, weight) in x.iter() {
        sum += weight;
        if sum >= p * total {
            return Some(*value);
        }
    }
    x.last().map(|v| v.0)
}

/// Running mean, spread and extremes of a series, by Welford's update (doi:10.1080/00401706.1962.10490022).
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Running {
    /// Samples seen.
    pub count: u64,
    /// Mean of the samples.
    pub mean: f64,
    m2: f64,
    /// Largest sample (0 before the first).
    pub max: f64,
    /// Smallest sample (0 before the first).
    pub min: f64,
}

impl Running {
    /// Adds one sample.
    pub fn push(&mut self, x: f64) {
        if self.count == 0 {
            (self.max, self.min) = (x, x);
        }
        self.count += 1;
        let d = x - self.mean;
        self.mean += d / self.count as f64;
        self.m2 += d * (x - self.mean);
        self.max = self.max.max(x);
        self.min = self.min.min(x);
    }

    /// Adds all samples of another series (Chan's pairwise update).
    pub fn merge(&mut self, other: &Running) {
        if other.count == 0 {
            return;
        }
        if self.count == 0 {
            *self = other.clone();
            return;
        }
        let (n, m) = (self.count as f64, other.count as f64);
        let d = other.mean - self.mean;
        self.mean += d * m / (n + m);
        self.m2 += other.m2 + d * d * n * m / (n + m);
        self.count += other.count;
        self.max = self.max.max(other.max);
        self.min = self.min.min(other.min);
    }

    /// Population standard deviation.
    pub fn sd(&self) -> f64 {
        if self.count == 0 { 0.0 } else { (self.m2 / self.count as f64).max(0.0).sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_a_ramp() {
        let x: Vec<f64> = (0..101).map(f64::from).collect();
        assert_eq!(quantile(&x, 0.95), Some(95.0));
        assert_eq!(quantile(&[1.0, 2.0], 0.5), Some(1.5));
        assert_eq!(quantile(&[], 0.5), None);
    }

    #[test]
    fn merged_series_equal_the_whole() {
        let x: Vec<f64> = (0..57).map(|i| (i as f64 * 0.7).sin() * 3.0 + 1.0).collect();
        let (mut a, mut b, mut all) = (Running::default(), Running::default(), Running::default());
        x[..20].iter().for_each(|v| a.push(*v));
        x[20..].iter().for_each(|v| b.push(*v));
        x.iter().for_each(|v| all.push(*v));
        a.merge(&b);
        assert!((a.mean - all.mean).abs() < 1e-12 && (a.sd() - all.sd()).abs() < 1e-12);
        assert_eq!((a.max, a.min, a.count), (all.max, all.min, all.count));
    }
}
