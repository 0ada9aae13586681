//! Plots as SVG: axes with round ticks, and what is drawn between them.
use std::fmt::Write as _;

use crate::math::Rgb;

use super::html::escape;

/// Outer width of a plot by itself and of a figure, px; the page scales it to its column.
pub const WIDTH: f64 = 960.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 44.0;
/// Colours of series, in their order: apart in hue and in lightness.
const COLORS: [&str; 8] = ["#2a5d9f", "#b5382f", "#3f7d4e", "#a06a1b", "#6b4c9a", "#1f8a8a", "#c05c8e", "#5f6368"];

/// The colour of the `index`th series.
pub fn series_color(index: usize) -> &'static str {
    COLORS[index % COLORS.len()]
}

/// Where a plot's axes lie on its picture, px from the upper left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Left end of the x axis.
    pub left: f64,
    /// Upper end of the y axis.
    pub top: f64,
    /// Right end of the x axis.
    pub right: f64,
    /// Lower end of the y axis.
    pub bottom: f64,
}

/// A plot being drawn: data coordinates on two axes. Colours of marks with a class come from `plot.css`.
pub struct Plot {
    frame: Frame,
    x: (f64, f64),
    y: (f64, f64),
    log_x: bool,
    x_ticks: Option<Vec<(f64, String)>>,
    y_ticks: Option<Vec<(f64, String)>>,
    body: String,
}

impl Plot {
    /// A plot by itself, `height` px high: axes that hold the ranges `x` and `y`, widened to be neither empty nor unbounded.
    pub(super) fn new(height: f64, x: (f64, f64), y: (f64, f64)) -> Self {
        let frame = Frame { left: LEFT, top: TOP, right: WIDTH - RIGHT, bottom: height - BOTTOM };
        Self::within(frame, x, y)
    }

    /// Axes in a frame of a figure that hold the ranges `x` and `y`, widened to be neither empty nor unbounded.
    pub fn within(frame: Frame, x: (f64, f64), y: (f64, f64)) -> Self {
        let sane = |(low, high): (f64, f64)| match (low.is_finite() && high.is_finite(), high > low) {
            (true, true) => (low, high),
            (true, false) => (low, low + 1.0),
            (false, _) => (0.0, 1.0),
        };
        Self { frame, x: sane(x), y: sane(y), log_x: false, x_ticks: None, y_ticks: None, body: String::new() }
    }

    /// Makes the x axis logarithmic, when its range is above 0.
    pub fn log_x(mut self) -> Self {
        self.log_x = self.x.0 > 0.0;
        self
    }

    /// Ticks of one's own on the x axis, and no others.
    pub fn with_x_ticks(mut self, ticks: Vec<(f64, String)>) -> Self {
        self.x_ticks = Some(ticks);
        self
    }

    /// Ticks of one's own on the y axis, and no others.
    pub fn with_y_ticks(mut self, ticks: Vec<(f64, String)>) -> Self {
        self.y_ticks = Some(ticks);
        self
    }

    fn px(&self, x: f64) -> f64 {
        let share = if self.log_x {
            (x / self.x.0).max(f64::MIN_POSITIVE).ln() / (self.x.1 / self.x.0).ln()
        } else {
            (x - self.x.0) / (self.x.1 - self.x.0)
        };
        self.frame.left + share * (self.frame.right - self.frame.left)
    }

    fn py(&self, y: f64) -> f64 {
        let share = (y.clamp(self.y.0, self.y.1) - self.y.0) / (self.y.1 - self.y.0);
        self.frame.bottom - share * (self.frame.bottom - self.frame.top)
    }

    /// The area between `low` and `high` along x: `(x, low, high)`.
    pub fn band(&mut self, color: &str, points: &[(f64, f64, f64)]) {
        let finite = points.iter().filter(|(x, a, b)| x.is_finite() && a.is_finite() && b.is_finite());
        let finite: Vec<_> = finite.collect();
        let mut path = String::new();
        let lower = finite.iter().rev().map(|(x, low, _)| (*x, *low));
        for (x, y) in finite.iter().map(|(x, _, high)| (*x, *high)).chain(lower) {
            let _ = write!(path, "{}{:.1} {:.1}", if path.is_empty() { "M" } else { "L" }, self.px(x), self.py(y));
        }
        if finite.len() > 1 {
            let _ = writeln!(self.body, r#"<path fill="{color}" fill-opacity="0.16" d="{path}Z"/>"#);
        }
    }

    /// A line through every point, a dot on each.
    pub fn curve(&mut self, color: &str, points: &[(f64, f64)]) {
        let (mut path, mut dots) = (String::new(), String::new());
        for (x, y) in points.iter().filter(|(x, y)| x.is_finite() && y.is_finite()) {
            let (px, py) = (self.px(*x), self.py(*y));
            let _ = write!(path, "{}{px:.1} {py:.1}", if path.is_empty() { "M" } else { "L" });
            let _ = write!(dots, r#"<circle fill="{color}" cx="{px:.1}" cy="{py:.1}" r="3"/>"#);
        }
        let _ = writeln!(self.body, r#"<path fill="none" stroke="{color}" stroke-width="2" d="{path}"/>{dots}"#);
    }

    /// Lines through points that are `scale` times as large in data coordinates, `width` px wide.
    pub fn polyline<'a>(&mut self, color: &str, width: f64, lines: impl Iterator<Item = &'a [(f64, f64)]>, scale: f64) {
        let mut path = String::new();
        for line in lines {
            for (i, (x, y)) in line.iter().filter(|(x, y)| x.is_finite() && y.is_finite()).enumerate() {
                let _ = write!(
                    path,
                    "{}{:.1} {:.1}",
                    if i == 0 { "M" } else { "L" },
                    self.px(x * scale),
                    self.py(y * scale)
                );
            }
        }
        let _ = writeln!(self.body, r#"<path fill="none" stroke="{color}" stroke-width="{width}" d="{path}"/>"#);
    }

    /// An upright mark from `low` to `high` with short ends.
    pub fn error_bar(&mut self, color: &str, x: f64, low: f64, high: f64) {
        if x.is_finite() && low.is_finite() && high.is_finite() {
            let (px, a, b) = (self.px(x), self.py(low), self.py(high));
            let (l, r) = (px - 4.0, px + 4.0);
            let _ = writeln!(
                self.body,
                r#"<path fill="none" stroke="{color}" d="M{px:.1} {a:.1}V{b:.1}M{l:.1} {a:.1}H{r:.1}M{l:.1} {b:.1}H{r:.1}"/>"#
            );
        }
    }

    /// A bar from the foot of the plot to `y` between `x0` and `x1`.
    pub fn bar(&mut self, color: &str, x0: f64, x1: f64, y: f64) {
        let (a, b, top) = (self.px(x0), self.px(x1), self.py(y));
        let (width, height) = ((b - a - 1.0).max(0.5), (self.frame.bottom - top).max(0.0));
        let _ = writeln!(
            self.body,
            r#"<rect fill="{color}" fill-opacity="0.75" x="{:.1}" y="{top:.1}" width="{width:.1}" height="{height:.1}"/>"#,
            a + 0.5
        );
    }

    /// A dashed upright line at `x` with a label beside its top.
    pub fn mark(&mut self, x: f64, label: &str) {
        if !x.is_finite() {
            return;
        }
        let (px, top, bottom) = (self.px(x), self.frame.top, self.frame.bottom);
        // on the side where there is room
        let (anchor, at) =
            if px < (self.frame.left + self.frame.right) / 2.0 { ("start", px + 6.0) } else { ("end", px - 6.0) };
        let _ = writeln!(
            self.body,
            r#"<path class="mark" d="M{px:.1} {top:.1}V{bottom:.1}"/><text class="mark" x="{at:.1}" y="{:.1}" text-anchor="{anchor}">{}</text>"#,
            top + 13.0,
            escape(label)
        );
    }

    /// A filled rectangle with a label in its middle.
    pub fn cell(&mut self, Rgb([r, g, b]): Rgb, x: (f64, f64), y: (f64, f64), label: &str) {
        let (left, right, top, bottom) = (self.px(x.0), self.px(x.1), self.py(y.1), self.py(y.0));
        let light = 0.3 * f64::from(r) + 0.59 * f64::from(g) + 0.11 * f64::from(b) > 140.0;
        let ink = if light { "#1b2a41" } else { "#ffffff" };
        let _ = writeln!(
            self.body,
            r##"<rect shape-rendering="crispEdges" fill="#{r:02x}{g:02x}{b:02x}" x="{left:.2}" y="{top:.2}" width="{:.2}" height="{:.2}"/>"##,
            right - left + 0.3,
            bottom - top + 0.3,
        );
        if !label.is_empty() {
            let (x, y) = ((left + right) / 2.0, (top + bottom) / 2.0 + 4.0);
            let label = escape(label);
            let _ = writeln!(
                self.body,
                r#"<text style="fill:{ink}" x="{x:.1}" y="{y:.1}" text-anchor="middle">{label}</text>"#
            );
        }
    }

    /// Words in the upper right corner, inside.
    pub fn caption(&mut self, text: &str) {
        let (x, y) = (self.frame.right - 6.0, self.frame.top + 14.0);
        let _ = writeln!(
            self.body,
            r#"<text class="caption" x="{x:.1}" y="{y:.1}" text-anchor="end">{}</text>"#,
            escape(text)
        );
    }

    /// Words over the frame, at its left end.
    pub fn heading(&mut self, text: &str) {
        let (x, y) = (self.frame.left, self.frame.top - 7.0);
        let _ = writeln!(self.body, r#"<text class="caption" x="{x:.1}" y="{y:.1}">{}</text>"#, escape(text));
    }

    /// A long series as the area between its least and largest value in each pixel column; a gap in x longer than
    /// `gap` breaks it.
    pub(super) fn envelope(&mut self, class: &str, points: impl Iterator<Item = (f64, f64)>, gap: f64) {
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
    pub(super) fn line(&mut self, class: &str, points: impl Iterator<Item = (f64, f64)>) {
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
    pub(super) fn level(&mut self, y: f64, label: &str) {
        let (left, right, py) = (self.frame.left, self.frame.right, self.py(y));
        let _ = writeln!(
            self.body,
            r#"<path class="level" d="M{left} {py:.1}H{right}"/><text class="level" x="{right}" y="{:.1}" text-anchor="end">{label}</text>"#,
            py - 5.0
        );
    }

    /// A thin upright mark from `low` to `high` with a dot at `at`.
    pub(super) fn whisker(&mut self, x: f64, at: f64, high: f64) {
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
    pub(super) fn strip(&mut self, class: &str, x0: f64, x1: f64) {
        let (a, b) = (self.px(x0), self.px(x1));
        let y = self.frame.bottom + 3.0;
        let width = (b - a).max(0.3);
        let _ = writeln!(self.body, r#"<rect class="{class}" x="{a:.1}" y="{y:.1}" width="{width:.1}" height="7"/>"#);
    }

    /// The plot with its axes as a picture by itself.
    pub(super) fn svg(&self, title: &str, x_label: &str, y_label: &str) -> String {
        let height = self.frame.bottom + BOTTOM;
        let inside = self.group(x_label, y_label);
        format!("<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{title}\">\n{inside}</svg>\n")
    }

    /// The plot with its axes as a part of a picture.
    pub(super) fn group(&self, x_label: &str, y_label: &str) -> String {
        let mut axes = String::new();
        let Frame { left, top, right, bottom } = self.frame;
        let own = |own: &Option<Vec<(f64, String)>>, round: Vec<f64>| {
            own.clone().unwrap_or_else(|| round.into_iter().map(|t| (t, number(t))).collect())
        };
        let rows = ((bottom - top) / 45.0).clamp(2.0, 6.0) as u32;
        for (y, label) in own(&self.y_ticks, ticks(self.y, rows)) {
            let py = self.py(y);
            if self.y_ticks.is_none() {
                let _ = write!(axes, r#"<path class="grid" d="M{left} {py:.1}H{right}"/>"#);
            }
            let (x, y) = (left - 6.0, py + 4.0);
            let _ = writeln!(axes, r#"<text x="{x}" y="{y:.1}" text-anchor="end">{}</text>"#, escape(&label));
        }
        let columns = ((right - left) / 100.0).clamp(2.0, 8.0) as u32;
        let round = if self.log_x { log_ticks(self.x) } else { ticks(self.x, columns) };
        for (x, label) in own(&self.x_ticks, round) {
            let px = self.px(x);
            let (y, label) = (bottom + 24.0, escape(&label));
            let _ = writeln!(axes, r#"<text x="{px:.1}" y="{y:.1}" text-anchor="middle">{label}</text>"#);
        }
        let (middle, label_x) = ((top + bottom) / 2.0, left - 50.0);
        format!(
            r#"{axes}{body}<path class="axis" d="M{left} {bottom}H{right}"/>
<text class="label" x="{right}" y="{y}" text-anchor="end">{x_label}</text>
<text class="label" transform="translate({label_x} {middle}) rotate(-90)" text-anchor="middle">{y_label}</text>
"#,
            body = self.body,
            y = bottom + 40.0,
            x_label = escape(x_label),
            y_label = escape(y_label),
        )
    }
}

/// Round numbers on a logarithmic axis: 1, 2 and 5 of each decade, or linear ones where those are too few.
fn log_ticks((low, high): (f64, f64)) -> Vec<f64> {
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let steps: &[f64] = if high / low > 2e3 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let all = decades.flat_map(|d| steps.iter().map(move |m| m * 10f64.powi(d)));
    let inside: Vec<f64> = all.filter(|t| (low * 0.999..=high * 1.001).contains(t)).collect();
    if inside.len() < 3 { ticks((low, high), 5) } else { inside }
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
    if x != 0.0 && !(1e-4..1e7).contains(&x.abs()) {
        let text = format!("{x:.3e}");
        return text
            .split_once('e')
            .map_or(text.clone(), |(m, e)| format!("{}e{e}", m.trim_end_matches('0').trim_end_matches('.')));
    }
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
        assert_eq!([number(2e-5), number(1.5e8), number(0.0)], ["2e-5", "1.5e8", "0"]);
        assert_eq!(log_ticks((20.0, 1000.0)), [20.0, 50.0, 100.0, 200.0, 500.0, 1000.0]);
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
