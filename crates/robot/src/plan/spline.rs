//! A twice continuously differentiable cubic spline through joint waypoints.
use crate::robot::JointVector;

/// Joint positions as a cubic spline over a path parameter (arc length of the tip, m).
///
/// Between `s[i]` and `s[i + 1]` with `h = s[i + 1] - s[i]`, `a = (s[i + 1] - s) / h`, `b = 1 - a`:
/// `q(s) = a q_i + b q_i+1 + ((a^3 - a) m_i + (b^3 - b) m_i+1) h^2 / 6`, where the second derivatives `m` make the
/// first derivative continuous. The ends run out as parabolas (`m_0 = m_1`), which follows a curved path to its end
/// better than the natural condition does.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct JointSpline {
    s: Vec<f64>,
    q: Vec<JointVector>,
    m: Vec<JointVector>,
}

/// Position and the first three derivatives with respect to the path parameter.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub struct SplinePoint {
    /// Position, rad.
    pub q: JointVector,
    /// First derivative, rad/m.
    pub d1: JointVector,
    /// Second derivative, rad/m2.
    pub d2: JointVector,
    /// Third derivative, rad/m3 (constant within an interval).
    pub d3: JointVector,
}

impl JointSpline {
    /// The spline through `q` at the strictly rising parameters `s`; both of the same length, at least two.
    pub fn new(s: Vec<f64>, q: Vec<JointVector>) -> Self {
        debug_assert!(s.len() == q.len() && s.len() >= 2 && s.windows(2).all(|w| w[1] > w[0]));
        let n = s.len();
        let mut m = vec![JointVector::zeros(); n];
        if n > 2 {
            // Thomas's algorithm on rows 1..n-1 of  h0 m0 + 2 (h0 + h1) m1 + h1 m2 = 6 (slope1 - slope0)
            let mut upper = vec![0.0; n];
            for i in 1..n - 1 {
                let (h0, h1) = (s[i] - s[i - 1], s[i + 1] - s[i]);
                let rhs = ((q[i + 1] - q[i]) / h1 - (q[i] - q[i - 1]) / h0) * 6.0;
                let mut diagonal = 2.0 * (h0 + h1);
                if i == 1 {
                    diagonal += h0;
                }
                if i == n - 2 {
                    diagonal += h1;
                }
                let lower = if i == 1 { 0.0 } else { h0 };
                let pivot = diagonal - lower * upper[i - 1];
                upper[i] = if i == n - 2 { 0.0 } else { h1 / pivot };
                m[i] = (rhs - m[i - 1] * lower) / pivot;
            }
            for i in (1..n - 2).rev() {
                let known = m[i + 1] * upper[i];
                m[i] -= known;
            }
            m[0] = m[1];
            m[n - 1] = m[n - 2];
        }
        Self { s, q, m }
    }

    /// Parameters of the waypoints.
    pub fn parameters(&self) -> &[f64] {
        &self.s
    }

    /// Waypoints.
    pub fn waypoints(&self) -> &[JointVector] {
        &self.q
    }

    /// Parameter of the last waypoint.
    pub fn end(&self) -> f64 {
        self.s[self.s.len() - 1]
    }

    /// The spline at `s` (clamped to its range). `cursor` remembers the interval, for walks forward; start with 0.
    pub fn at(&self, s: f64, cursor: &mut usize) -> SplinePoint {
        let last = self.s.len() - 2;
        let s = s.clamp(self.s[0], self.end());
        let mut i = (*cursor).min(last);
        if self.s[i] > s {
            i = self.s.partition_point(|x| *x <= s).saturating_sub(1).min(last);
        }
        while i < last && self.s[i + 1] < s {
            i += 1;
        }
        *cursor = i;
        let h = self.s[i + 1] - self.s[i];
        let b = (s - self.s[i]) / h;
        let a = 1.0 - b;
        let (q0, q1, m0, m1) = (&self.q[i], &self.q[i + 1], &self.m[i], &self.m[i + 1]);
        SplinePoint {
            q: q0 * a + q1 * b + (m0 * (a * a * a - a) + m1 * (b * b * b - b)) * (h * h / 6.0),
            d1: (q1 - q0) / h + (m1 * (3.0 * b * b - 1.0) - m0 * (3.0 * a * a - 1.0)) * (h / 6.0),
            d2: m0 * a + m1 * b,
            d3: (m1 - m0) / h,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_reproduced_on_uneven_waypoints() {
        let f = |s: f64| JointVector::repeat(1.0 - 2.0 * s + 3.0 * s * s);
        let s = vec![0.0, 0.1, 0.15, 0.4, 0.9, 1.0];
        let spline = JointSpline::new(s.clone(), s.iter().map(|s| f(*s)).collect());
        let mut cursor = 0;
        for i in 0..=100 {
            let s = f64::from(i) * 0.01;
            let p = spline.at(s, &mut cursor);
            assert!((p.q - f(s)).norm() < 1e-12 && (p.d1[0] - (6.0 * s - 2.0)).abs() < 1e-11);
            assert!((p.d2[0] - 6.0).abs() < 1e-9);
        }
    }

    #[test]
    fn derivatives_are_continuous_across_waypoints() {
        let s: Vec<f64> = (0..30).map(|i| f64::from(i) * 0.01 + 0.002 * f64::from(i % 3)).collect();
        let q = s.iter().map(|s| JointVector::from_fn(|j, _| (9.0 * s + j as f64).sin())).collect();
        let spline = JointSpline::new(s.clone(), q);
        for s in &s[1..29] {
            let (l, r) = (spline.at(s - 1e-9, &mut 0), spline.at(s + 1e-9, &mut 0));
            assert!((l.q - r.q).norm() < 1e-6 && (l.d1 - r.d1).norm() < 1e-4 && (l.d2 - r.d2).norm() < 1e-2);
        }
        for i in 0..290 {
            let s = 0.005 + f64::from(i) * 1e-3;
            let p = spline.at(s, &mut 0);
            assert!((p.q[2] - (9.0 * s + 2.0).sin()).abs() < 1e-4);
        }
    }
}
