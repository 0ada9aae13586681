//! Press depth: how deep for which width of line, along a stroke, and over time.
use crate::pen::PenModel;
use crate::plan::JointSpline;
use crate::robot::JointVector;

/// Press depth delta of equation 6.1 by layer and desired width of line.
#[derive(Clone, Debug, PartialEq)]
pub struct PressDepths {
    /// Depth where no width is desired, m.
    pub default: f64,
    /// For each layer, depths (m) of lines of rising width (m): pairs of width and depth. Between two widths the depth is
    /// interpolated, outside it is that of the nearest. A layer without any takes the default everywhere.
    pub layers: Vec<Vec<(f64, f64)>>,
}

/// Widths for which a pen's press depth is worked out; between them it is interpolated.
const WIDTHS: usize = 16;

impl PressDepths {
    /// Depths (m) of lines of rising width (m) that a pen draws at `speed` (m/s): as its force for a width asks of a spring of
    /// `stiffness` (N/m), `delta = f / k` (eq. 6.1).
    pub fn by_width(pen: &PenModel, stiffness: f64, speed: f64) -> Vec<(f64, f64)> {
        let [narrow, wide] = pen.force_range().map(|force| pen.line_width(force, speed));
        let widths = (0..WIDTHS).map(|i| narrow + (wide - narrow) * i as f64 / (WIDTHS - 1) as f64);
        let mut depths: Vec<_> = widths.map(|w| (w, pen.force_for_width(w, speed) / stiffness)).collect();
        // a pen whose line hardly changes has fewer widths than that
        depths.dedup_by(|b, a| b.0 <= a.0);
        depths
    }

    /// One depth, m, for all lines.
    pub fn constant(depth: f64) -> Self {
        Self { default: depth, layers: Vec::new() }
    }

    /// Depth, m, for a line of `width` (m; `None`: the pen's own) of a layer.
    pub fn of(&self, layer: usize, width: Option<f64>) -> f64 {
        let (Some(width), Some(table)) = (width, self.layers.get(layer)) else { return self.default };
        let next = table.partition_point(|(w, _)| *w < width);
        match (next.checked_sub(1).and_then(|i| table.get(i)), table.get(next)) {
            (Some((w, d)), Some((x, e))) => d + (e - d) * ((width - w) / (x - w)),
            (Some((_, d)), None) | (None, Some((_, d))) => *d,
            (None, None) => self.default,
        }
    }

    /// Largest depth, m.
    pub fn largest(&self) -> f64 {
        self.layers.iter().flatten().map(|(_, d)| *d).fold(self.default, f64::max)
    }

    /// A depth that is no depth, if there is one.
    pub(crate) fn invalid(&self) -> Option<f64> {
        let depths = std::iter::once(self.default).chain(self.layers.iter().flatten().map(|(_, d)| *d));
        let mut bad = depths.filter(|d| !(*d >= 0.0 && d.is_finite()));
        let rises = |t: &[(f64, f64)]| {
            t.windows(2).find(|w| w[1].0.partial_cmp(&w[0].0) != Some(std::cmp::Ordering::Greater)).map(|w| w[1].0)
        };
        bad.next().or_else(|| self.layers.iter().find_map(|t| rises(t)))
    }
}

/// Depths at places `s` (rising, m) that change by no more than `slope` from place to place, near to the desired ones: neighbours
/// too far apart meet half-way, again and again, so that a step becomes a ramp about it. Depths that change less stay as
/// they are.
pub(crate) fn limit_slope(s: &[f64], depths: &mut [f64], slope: f64) {
    let n = depths.len();
    for _ in 0..SWEEPS {
        let mut steep = false;
        // pairs that share no place, then the others: projections by turns (von Neumann)
        for first in [1, 2] {
            for i in (first..n).step_by(2) {
                let rise = depths[i] - depths[i - 1];
                let excess = 0.5 * (rise.abs() - slope * (s[i] - s[i - 1]));
                if excess > 0.0 {
                    steep = true;
                    depths[i] -= excess * rise.signum();
                    depths[i - 1] += excess * rise.signum();
                }
            }
        }
        if !steep {
            return;
        }
    }
    // what is left: the mean of the largest such depths below and the smallest above
    let (mut below, mut above) = (depths.to_vec(), depths.to_vec());
    for i in 1..n {
        let most = slope * (s[i] - s[i - 1]);
        below[i] = below[i].min(below[i - 1] + most);
        above[i] = above[i].max(above[i - 1] - most);
    }
    for i in (1..n).rev() {
        let most = slope * (s[i] - s[i - 1]);
        below[i - 1] = below[i - 1].min(below[i] + most);
        above[i - 1] = above[i - 1].max(above[i] - most);
    }
    for (depth, (low, high)) in depths.iter_mut().zip(below.iter().zip(&above)) {
        if low != high {
            *depth = 0.5 * (low + high);
        }
    }
}

/// Most sweeps over a stroke's depths.
const SWEEPS: usize = 300;

/// Press depth at an instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct DepthSample {
    /// Depth, m.
    pub depth: f64,
    /// How fast it grows, m/s.
    pub rate: f64,
    /// How fast that grows, m/s2.
    pub acceleration: f64,
}

/// Press depth over a segment's time.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct DepthProfile {
    knots: Vec<(f64, DepthSample)>,
}

impl DepthProfile {
    /// One depth, m, all the time.
    pub fn constant(depth: f64) -> Self {
        Self { knots: vec![(0.0, DepthSample { depth, ..Default::default() })] }
    }

    /// Through samples at times (s) that rise.
    pub fn new(knots: Vec<(f64, DepthSample)>) -> Self {
        debug_assert!(knots.windows(2).all(|w| w[1].0 > w[0].0));
        Self { knots }
    }

    /// Knots: time, s, and what holds there.
    pub fn knots(&self) -> &[(f64, DepthSample)] {
        &self.knots
    }

    /// The depth at `time`, s, by the quintic between two knots; 0 of an empty profile. `cursor` remembers the last
    /// interval, for walks forward; start with 0.
    pub fn at(&self, time: f64, cursor: &mut usize) -> DepthSample {
        let (Some(first), Some(last)) = (self.knots.first(), self.knots.last()) else { return DepthSample::default() };
        if time <= first.0 {
            return first.1;
        }
        if time >= last.0 {
            return last.1;
        }
        let mut i = (*cursor).min(self.knots.len() - 2);
        if self.knots[i].0 > time {
            i = self.knots.partition_point(|k| k.0 <= time) - 1;
        }
        while self.knots[i + 1].0 < time {
            i += 1;
        }
        *cursor = i;
        quintic(&self.knots[i], &self.knots[i + 1], time)
    }
}

/// The quintic that meets both knots' depth, rate and acceleration.
fn quintic((ta, a): &(f64, DepthSample), (tb, b): &(f64, DepthSample), time: f64) -> DepthSample {
    let (h, t) = (tb - ta, time - ta);
    let depth = b.depth - a.depth - a.rate * h - 0.5 * a.acceleration * h * h;
    let rate = (b.rate - a.rate - a.acceleration * h) * h;
    let acceleration = (b.acceleration - a.acceleration) * h * h;
    let c3 = 10.0 * depth - 4.0 * rate + 0.5 * acceleration;
    let c4 = -15.0 * depth + 7.0 * rate - acceleration;
    let c5 = 6.0 * depth - 3.0 * rate + 0.5 * acceleration;
    let u = t / h;
    DepthSample {
        depth: a.depth + t * (a.rate + 0.5 * t * a.acceleration) + u * u * u * (c3 + u * (c4 + u * c5)),
        rate: a.rate + t * a.acceleration + u * u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)) / h,
        acceleration: a.acceleration + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5)) / (h * h),
    }
}

/// Depths along a path as a smooth function of its parameter.
pub(crate) struct DepthSpline(JointSpline);

impl DepthSpline {
    /// Through `depths` at the rising parameters `s`; both of the same length, at least two.
    pub(crate) fn new(s: Vec<f64>, depths: &[f64]) -> Self {
        let lone = |d: &f64| JointVector::from_fn(|i, _| if i == 0 { *d } else { 0.0 });
        Self(JointSpline::new(s, depths.iter().map(lone).collect()))
    }

    /// The depth where the parameter is `s`, passed at `speed` and `acceleration`.
    pub(crate) fn at(&self, s: f64, speed: f64, acceleration: f64, cursor: &mut usize) -> DepthSample {
        let p = self.0.at(s, cursor);
        DepthSample {
            depth: p.q[0].max(0.0),
            rate: p.d1[0] * speed,
            acceleration: p.d2[0] * speed * speed + p.d1[0] * acceleration,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn depths_are_interpolated_within_the_table_and_held_outside() {
        let depths = PressDepths { default: 3e-3, layers: vec![vec![], vec![(1e-3, 1e-3), (2e-3, 5e-3)]] };
        let cases = [
            (1, Some(0.5e-3), 1e-3),
            (1, Some(1.25e-3), 2e-3),
            (1, Some(9e-3), 5e-3),
            (1, None, 3e-3),
            (0, Some(1e-3), 3e-3),
            (7, Some(1e-3), 3e-3),
        ];
        for (layer, width, wanted) in cases {
            assert!((depths.of(layer, width) - wanted).abs() < 1e-15, "{layer} {width:?}");
        }
        assert_eq!((depths.largest(), depths.invalid()), (5e-3, None));
        assert!(PressDepths { default: 1e-3, layers: vec![vec![(2e-3, 1e-3), (1e-3, 2e-3)]] }.invalid().is_some());
        assert!(PressDepths::constant(f64::NAN).invalid().is_some());
    }

    proptest! {
        #[test]
        fn the_slope_is_kept_and_gentle_depths_stay(desired in proptest::collection::vec(0.0..1e-2f64, 1..60), slope in 0.05..2.0f64) {
            let s: Vec<f64> = (0..desired.len()).map(|i| 1e-3 * i as f64).collect();
            let mut depths = desired.clone();
            limit_slope(&s, &mut depths, slope);
            prop_assert!(depths.windows(2).all(|w| (w[1] - w[0]).abs() <= slope * 1e-3 * (1.0 + 1e-9)));
            let (low, high) = desired.iter().fold((f64::INFINITY, 0.0f64), |(l, h), d| (l.min(*d), h.max(*d)));
            prop_assert!(depths.iter().all(|d| *d >= low && *d <= high));
            let again = depths.clone();
            limit_slope(&s, &mut depths, slope * (1.0 + 1e-6));
            prop_assert_eq!(depths, again);
        }
    }

    #[test]
    fn a_quintic_depth_is_reproduced() {
        let sample = |t: f64| DepthSample {
            depth: 3e-3 + 1e-3 * t - 2e-3 * t.powi(3) + 1e-3 * t.powi(5),
            rate: 1e-3 - 6e-3 * t.powi(2) + 5e-3 * t.powi(4),
            acceleration: -12e-3 * t + 20e-3 * t.powi(3),
        };
        let profile = DepthProfile::new([0.0, 0.4, 1.0].map(|t| (t, sample(t))).to_vec());
        let mut cursor = 0;
        for i in 0..=100 {
            let t = 0.01 * f64::from(i);
            let (is, wanted) = (profile.at(t, &mut cursor), sample(t));
            assert!((is.depth - wanted.depth).abs() < 1e-15 && (is.rate - wanted.rate).abs() < 1e-14);
            assert!((is.acceleration - wanted.acceleration).abs() < 1e-12);
        }
        assert_eq!(DepthProfile::constant(2e-3).at(7.0, &mut 0).depth, 2e-3);
    }
}
