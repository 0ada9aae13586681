//! A recording of a stylus that signs "Calamus" and underlines it, as a tablet of 200 samples a second would give it.
use std::fmt::Write;

use crate::field::{lattice, smoothstep};

/// Size of the tablet, px.
const TABLET: (f64, f64) = (2000.0, 900.0);
/// Samples a second.
const RATE: f64 = 200.0;
/// Standard deviation of the sensor's jitter, px.
const JITTER: f64 = 0.15;
/// Height of a small letter, px, and where the word begins.
const X_HEIGHT: f64 = 150.0;
const ORIGIN: (f64, f64) = (85.0, 545.0);
/// Sideways lean of the hand: x per height.
const SLANT: f64 = 0.42;

/// The word in one stroke: points of the hand's path in units of the small letters, upright, y up from the base line.
const WORD: [(f64, f64); 82] = [
    // C
    (1.38, 1.72),
    (1.62, 1.95),
    (1.66, 2.28),
    (1.38, 2.46),
    (0.92, 2.28),
    (0.46, 1.70),
    (0.24, 0.92),
    (0.44, 0.24),
    (0.95, -0.02),
    (1.50, 0.20),
    (1.95, 0.62),
    // a
    (2.38, 0.97),
    (2.74, 0.90),
    (2.44, 0.99),
    (2.10, 0.72),
    (2.04, 0.26),
    (2.30, 0.00),
    (2.62, 0.26),
    (2.84, 0.96),
    (2.78, 0.42),
    (2.90, 0.04),
    (3.12, 0.10),
    (3.40, 0.52),
    // l
    (3.72, 1.28),
    (3.84, 2.05),
    (3.68, 2.40),
    (3.50, 2.05),
    (3.44, 1.20),
    (3.47, 0.42),
    (3.64, 0.02),
    (3.88, 0.12),
    (4.12, 0.54),
    // a
    (4.54, 0.97),
    (4.90, 0.90),
    (4.60, 0.99),
    (4.26, 0.72),
    (4.20, 0.26),
    (4.46, 0.00),
    (4.78, 0.26),
    (5.00, 0.96),
    (4.94, 0.42),
    (5.06, 0.04),
    (5.26, 0.10),
    (5.50, 0.50),
    // m
    (5.74, 0.92),
    (5.91, 0.97),
    (5.98, 0.72),
    (5.95, 0.02),
    (6.02, 0.48),
    (6.24, 0.90),
    (6.44, 0.97),
    (6.51, 0.72),
    (6.48, 0.02),
    (6.55, 0.48),
    (6.77, 0.90),
    (6.97, 0.97),
    (7.05, 0.70),
    (7.03, 0.24),
    (7.16, 0.02),
    (7.36, 0.12),
    (7.58, 0.52),
    // u
    (7.78, 0.98),
    (7.73, 0.42),
    (7.83, 0.06),
    (8.02, 0.02),
    (8.26, 0.34),
    (8.46, 0.98),
    (8.41, 0.42),
    (8.52, 0.04),
    (8.72, 0.10),
    (8.95, 0.50),
    // s, and out
    (9.20, 1.10),
    (9.22, 0.86),
    (9.40, 0.52),
    (9.40, 0.18),
    (9.18, -0.02),
    (8.98, 0.06),
    (9.06, 0.22),
    (9.40, 0.16),
    (10.00, 0.08),
    (10.70, 0.28),
    (11.45, 0.82),
];

/// The flourish below it.
const FLOURISH: [(f64, f64); 15] = [
    (11.20, -0.28),
    (9.60, -0.50),
    (7.20, -0.72),
    (4.60, -0.86),
    (2.40, -0.86),
    (1.05, -0.66),
    (0.80, -0.36),
    (1.20, -0.20),
    (1.75, -0.48),
    (2.60, -1.02),
    (4.40, -1.34),
    (6.90, -1.36),
    (9.20, -1.14),
    (11.00, -0.80),
    (12.00, -0.40),
];

/// A path on the tablet, px, with its length from the start at each point.
struct Path {
    points: Vec<(f64, f64)>,
    length: Vec<f64>,
}

impl Path {
    /// A centripetal Catmull-Rom spline through the nodes, in steps of about 1 px.
    fn through(nodes: &[(f64, f64)]) -> Path {
        let at: Vec<(f64, f64)> =
            nodes.iter().map(|&(x, y)| (ORIGIN.0 + X_HEIGHT * (x + SLANT * y), ORIGIN.1 - X_HEIGHT * y)).collect();
        let mut points = Vec::new();
        for i in 0..at.len() - 1 {
            let (b, c) = (at[i], at[i + 1]);
            // the ends go straight on
            let a = if i == 0 { (2.0 * b.0 - c.0, 2.0 * b.1 - c.1) } else { at[i - 1] };
            let d = at.get(i + 2).copied().unwrap_or((2.0 * c.0 - b.0, 2.0 * c.1 - b.1));
            let knots = [a, b, c, d];
            let mut t = [0.0; 4];
            for k in 1..4 {
                let gap = (knots[k].0 - knots[k - 1].0).hypot(knots[k].1 - knots[k - 1].1);
                t[k] = t[k - 1] + gap.max(1e-6).sqrt();
            }
            let steps = (c.0 - b.0).hypot(c.1 - b.1).ceil().max(4.0) as usize;
            for s in 0..steps {
                let u = t[1] + (t[2] - t[1]) * s as f64 / steps as f64;
                points.push(pyramid(&knots, &t, u));
            }
        }
        points.push(at[at.len() - 1]);
        let mut length = vec![0.0];
        for pair in points.windows(2) {
            length.push(length[length.len() - 1] + (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1));
        }
        Path { points, length }
    }

    fn total(&self) -> f64 {
        self.length[self.length.len() - 1]
    }

    fn at(&self, s: f64) -> (f64, f64) {
        let i = self.length.partition_point(|&l| l <= s).clamp(1, self.points.len() - 1);
        let span = (self.length[i] - self.length[i - 1]).max(1e-9);
        let t = ((s - self.length[i - 1]) / span).clamp(0.0, 1.0);
        let (a, b) = (self.points[i - 1], self.points[i]);
        (a.0 + (b.0 - a.0) * t, a.1 + (b.1 - a.1) * t)
    }

    /// Unit tangent over a span of 12 px.
    fn heading(&self, s: f64) -> (f64, f64) {
        let (a, b) = (self.at(s - 6.0), self.at(s + 6.0));
        let norm = (b.0 - a.0).hypot(b.1 - a.1).max(1e-9);
        ((b.0 - a.0) / norm, (b.1 - a.1) / norm)
    }

    /// Speed, px/s: the two-thirds power law (fast where straight, slow where it curls), and a bell over the whole
    /// stroke, that starts and ends slowly.
    fn speed(&self, s: f64) -> f64 {
        let (a, b) = (self.heading(s - 9.0), self.heading(s + 9.0));
        let bend = (a.0 * b.1 - a.1 * b.0).atan2(a.0 * b.0 + a.1 * b.1).abs() / 18.0;
        let law = 300.0 * (bend + 0.0008).powf(-1.0 / 3.0);
        let ends = smoothstep(-30.0, 160.0, s) * smoothstep(-30.0, 160.0, self.total() - s);
        law * (0.12 + 0.88 * ends)
    }

    /// Pressure 0..1: firm where the pen goes down, light where it goes up, thin at the ends.
    fn pressure(&self, s: f64) -> f64 {
        let down = (-4..=4).map(|k| self.heading(s + 7.0 * f64::from(k)).1).sum::<f64>() / 9.0;
        let ends = smoothstep(-6.0, 70.0, s) * smoothstep(-6.0, 110.0, self.total() - s);
        (0.45 + 0.38 * down) * (0.10 + 0.90 * ends)
    }
}

/// Barry and Goldman's evaluation of a Catmull-Rom segment with knots `t`.
fn pyramid(p: &[(f64, f64); 4], t: &[f64; 4], u: f64) -> (f64, f64) {
    let blend = |a: (f64, f64), b: (f64, f64), from: f64, to: f64| {
        let w = (u - from) / (to - from);
        (a.0 + (b.0 - a.0) * w, a.1 + (b.1 - a.1) * w)
    };
    let a = [0, 1, 2].map(|i| blend(p[i], p[i + 1], t[i], t[i + 1]));
    let b = [0, 1].map(|i| blend(a[i], a[i + 1], t[i], t[i + 2]));
    blend(b[0], b[1], t[1], t[2])
}

/// A normal deviate: twelve uniform ones less six.
fn jitter(sample: usize, axis: i64) -> f64 {
    JITTER * ((0..12).map(|k| lattice(sample as i64, axis, k)).sum::<f64>() - 6.0)
}

/// The recording: JSON lines, a header first; samples of pressure 0 are above the tablet.
pub fn recording() -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{{\"width\":{},\"height\":{},\"unit\":\"px\"}}", TABLET.0, TABLET.1);
    let mut sample = 0;
    let mut put = |(x, y): (f64, f64), pressure: f64| {
        let (x, y) = (x + jitter(sample, 0), y + jitter(sample, 1));
        // levels of a pen of 13 bits
        let pressure = (pressure.clamp(0.0, 1.0) * 8191.0).round() / 8191.0;
        let t = sample as f64 / RATE;
        let _ = writeln!(text, "{{\"x\":{x:.2},\"y\":{y:.2},\"pressure\":{pressure:.4},\"t\":{t:.3}}}");
        sample += 1;
    };
    let strokes = [Path::through(&WORD), Path::through(&FLOURISH)];
    let mut hover = strokes[0].at(0.0);
    hover = (hover.0 - 60.0, hover.1 - 50.0);
    for stroke in &strokes {
        // the pen comes down along a smooth reach of a quarter of a second
        let first = stroke.at(0.0);
        for k in 0..50 {
            let w = smoothstep(0.0, 50.0, f64::from(k));
            put((hover.0 + (first.0 - hover.0) * w, hover.1 + (first.1 - hover.1) * w), 0.0);
        }
        let mut s = 0.0;
        while s < stroke.total() {
            put(stroke.at(s), stroke.pressure(s).max(0.01));
            s += stroke.speed(s) / RATE;
        }
        hover = stroke.at(stroke.total());
        put(hover, 0.01);
        put(hover, 0.0);
    }
    text
}
