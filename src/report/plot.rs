//! Plots as inline SVG: axes with round ticks, envelopes of long series, dots and level lines.
use std::fmt::Write as _;

/// Outer width of a plot, px; the page scales it to its column.
const WIDTH: f64 = 960.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 44.0;

/// A plot being drawn: data coordinates on two linear axes. Colours come from the page's classes.
pub(super) struct Plot {
    height: f64,
    x: (f64, f64),
    y: (f64, f64),
    body: String,
}

impl Plot {
    /// Axes that hold the ranges `x` and `y`, widened to be neither empty nor unbounded.
    pub fn new(height: f64, x: (f64, f64), y: (f64, f64)) -> Self {
        let sane = |(low, high): (f64, f64)| match (low.is_finite() && high.is_finite(), high > low) {
            (true, true) => (low, high),
            (true, false) => (low, low + 1.0),
            (false, _) => (0.0, 1.0),
        };
        Self { height, x: sane(x), y: sane(y), body: String::new() }
    }

    fn px(&self, x: f64) -> f64 {
        LEFT + (x - self.x.0) / (self.x.1 - self.x.0) * (WIDTH - LEFT - RIGHT)
    }

    fn py(&self, y: f64) -> f64 {
        let share = (y.clamp(self.y.0, self.y.1) - self.y.0) / (self.y.1 - self.y.0);
        self.height - BOTTOM - share * (self.height - TOP - BOTTOM)
    }

    /// A long series as the area between its least and largest value in each pixel column; a gap in x longer than
    /// `gap` breaks it.
    pub fn envelope(&mut self, class: &str, points: impl Iterator<Item = (f64, f64)>, gap: f64) {
        let mut runs: Vec<Vec<(f64, f64, f64)>> = Vec::new();
        let mut last = f64::NEG_INFINITY;
        for (x, y) in points.filter(|(x, y)| x.is_finite() && y.is_finite()) {
            if x - last > gap || runs.is_empty() {
                runs.push(Vec::new());
            }
            last = x;
            let column = self.px(x).floor();
            let Some(run) = runs.last_mut() else { continue };
            match run.last_mut() {
                Some((c, low, high)) if *c == column => (*low, *high) = (low.min(y), high.max(y)),
                _ => run.push((column, y, y)),
            }
        }
        for run in runs {
            let mut path = String::new();
            let lower = run.iter().rev().map(|(c, low, _)| (*c, self.py(*low) + 0.6));
            for (c, y) in run.iter().map(|(c, _, high)| (*c, self.py(*high) - 0.6)).chain(lower) {
                let _ = write!(path, "{}{c:.0} {y:.1}", if path.is_empty() { "M" } else { "L" });
            }
            let _ = writeln!(self.body, r#"<path class="{class}" d="{path}Z"/>"#);
        }
    }

    /// A line through points, thinned to one in a pixel column.
    pub fn line(&mut self, class: &str, points: impl Iterator<Item = (f64, f64)>) {
        let (mut path, mut last) = (String::new(), f64::NEG_INFINITY);
        for (x, y) in points.filter(|(x, y)| x.is_finite() && y.is_finite()) {
            let px = self.px(x);
            if px - last >= 1.0 {
                last = px;
                let _ = write!(path, "{}{px:.1} {:.1}", if path.is_empty() { "M" } else { "L" }, self.py(y));
            }
        }
        let _ = writeln!(self.body, r#"<path class="line {class}" d="{path}"/>"#);
    }

    /// A level line at `y` with a label at its right end.
    pub fn level(&mut self, y: f64, label: &str) {
        let (right, py) = (WIDTH - RIGHT, self.py(y));
        let _ = writeln!(
            self.body,
            r#"<path class="level" d="M{LEFT} {py:.1}H{right}"/><text class="level" x="{right}" y="{:.1}" text-anchor="end">{label}</text>"#,
            py - 5.0
        );
    }

    /// A thin upright mark from `low` to `high` with a dot at `at`.
    pub fn whisker(&mut self, x: f64, at: f64, high: f64) {
        if !(x.is_finite() && at.is_finite() && high.is_finite()) {
            return;
        }
        let (px, dot, top) = (self.px(x), self.py(at), self.py(high));
        let _ = writeln!(
            self.body,
            r#"<path class="whisker" d="M{px:.1} {dot:.1}V{top:.1}"/><circle class="dot" cx="{px:.1}" cy="{dot:.1}" r="2"/>"#
        );
    }

    /// A filled strip along the foot of the plot from `x0` to `x1`.
    pub fn strip(&mut self, class: &str, x0: f64, x1: f64) {
        let (a, b) = (self.px(x0), self.px(x1));
        let y = self.height - BOTTOM + 3.0;
        let width = (b - a).max(0.3);
        let _ = writeln!(self.body, r#"<rect class="{class}" x="{a:.1}" y="{y:.1}" width="{width:.1}" height="7"/>"#);
    }

    /// The plot with its axes.
    pub fn svg(&self, title: &str, x_label: &str, y_label: &str) -> String {
        let mut axes = String::new();
        let (bottom, right) = (self.height - BOTTOM, WIDTH - RIGHT);
        for y in ticks(self.y, 5) {
            let py = self.py(y);
            let _ = writeln!(
                axes,
                r#"<path class="grid" d="M{LEFT} {py:.1}H{right}"/><text x="{}" y="{:.1}" text-anchor="end">{}</text>"#,
                LEFT - 6.0,
                py + 4.0,
                number(y)
            );
        }
        for x in ticks(self.x, 8) {
            let px = self.px(x);
            let _ = writeln!(
                axes,
                r#"<text x="{px:.1}" y="{:.1}" text-anchor="middle">{}</text>"#,
                bottom + 24.0,
                number(x)
            );
        }
        let (height, middle) = (self.height, (TOP + bottom) / 2.0);
        format!(
            r#"<svg viewBox="0 0 {WIDTH} {height}" role="img" aria-label="{title}">
{axes}{body}<path class="axis" d="M{LEFT} {bottom}H{right}"/>
<text class="label" x="{x}" y="{y}" text-anchor="end">{x_label}</text>
<text class="label" transform="translate(14 {middle}) rotate(-90)" text-anchor="middle">{y_label}</text>
</svg>
"#,
            body = self.body,
            x = right,
            y = self.height - 4.0,
        )
    }
}

/// About `count` round numbers within a range.
fn ticks((low, high): (f64, f64), count: u32) -> Vec<f64> {
    let raw = (high - low) / f64::from(count);
    let power = 10f64.powf(raw.log10().floor());
    let step = [5.0, 2.0, 1.0].into_iter().map(|m| m * power).find(|s| *s <= raw * 1.001).unwrap_or(power);
    let first = (low / step - 1e-9).ceil();
    (0..=2 * count).map(|i| (first + f64::from(i)) * step).take_while(|t| *t <= high + 1e-9 * step).collect()
}

/// A tick's number, without the noise of binary fractions.
fn number(x: f64) -> String {
    let text = format!("{x:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks((0.0, 1.0), 5), [0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]);
        assert_eq!(ticks((-3.0, 250.0), 5), [0.0, 50.0, 100.0, 150.0, 200.0, 250.0]);
        assert_eq!(number(0.6000000000000001), "0.6");
    }

    #[test]
    fn nothing_to_plot_is_a_plot_without_nan() {
        let mut plot = Plot::new(200.0, (f64::NAN, 0.0), (3.0, 3.0));
        plot.envelope("force", [(f64::NAN, 1.0), (0.5, f64::INFINITY)].into_iter(), 1.0);
        plot.whisker(f64::NAN, 0.0, 0.0);
        let svg = plot.svg("empty", "x", "y");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }
}
