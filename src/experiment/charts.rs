//! Plots of an experiment: curves, histograms, heatmaps.
use crate::math::stats::mean;
use crate::report::{Figure, Frame, Plot, WIDTH, heat_color, series_color};

use super::axis::Axis;
use super::estimate::Estimate;
use super::file::PlotKind;
use super::row::Row;
use super::spec::{Experiment, PlotSpec};

const LEFT: f64 = 74.0;
const RIGHT: f64 = WIDTH - 24.0;
/// Height of a curve's axes, px.
const CURVE: f64 = 330.0;
/// Height of a histogram's, px.
const PANEL: f64 = 130.0;
/// Panels of a heatmap beside each other at most.
const COLUMNS: usize = 3;
/// Below an axis: its ticks and its label, px.
const FOOT: f64 = 52.0;

/// The plot over all trials.
pub(super) fn chart(experiment: &Experiment, spec: &PlotSpec, rows: &[Row]) -> Figure {
    match spec.kind {
        PlotKind::Curve => curve(experiment, spec, rows),
        PlotKind::Histogram => histogram(experiment, spec, rows),
        PlotKind::Heatmap => heatmap(experiment, spec, rows),
    }
}

/// A range with air at both ends, and from 0 where 0 is near.
fn aired(low: f64, high: f64) -> (f64, f64) {
    let span = high - low;
    let air = match (span > 1e-9 * high.abs(), high != 0.0) {
        (true, _) => 0.06 * span,
        // one value: room to see that it is one
        (false, true) => 0.1 * high.abs(),
        (false, false) => 1.0,
    };
    let from_zero = low == 0.0 || (low > 0.0 && low < 0.5 * high);
    (if from_zero { 0.0 } else { low - air }, high + air)
}

/// Ticks of an axis whose values aren't numbers: their words.
fn word_ticks(axis: &Axis) -> Option<Vec<(f64, String)>> {
    axis.number(0).is_none().then(|| (0..axis.values.len()).map(|i| (i as f64, shortened(&axis.words(i)))).collect())
}

/// Words that fit under a tick.
fn shortened(words: &str) -> String {
    const MOST: usize = 18;
    if words.chars().count() <= MOST { words.into() } else { words.chars().take(MOST - 1).chain(['…']).collect() }
}

/// The mean along an axis, with the 95 % interval: a line a case, over all values of other axes.
fn curve(experiment: &Experiment, spec: &PlotSpec, rows: &[Row]) -> Figure {
    let axis = &experiment.axes[spec.axis];
    let mut lines: Vec<Vec<(f64, Estimate)>> = Vec::new();
    for case in &experiment.cases {
        let at = |i: usize| {
            let here: Vec<&Row> =
                rows.iter().filter(|r| r.case == case.name && experiment.cell_values(r.cell)[spec.axis] == i).collect();
            let place = format!("curve {} {} {i}", case.name, axis.key);
            Some((axis.place(i), Estimate::of(&spec.quantity, &here, experiment.seed, &place)?))
        };
        let mut line: Vec<(f64, Estimate)> = (0..axis.values.len()).filter_map(at).collect();
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
        lines.push(line);
    }
    let all = || lines.iter().flatten();
    let low = all().map(|(_, e)| e.low.unwrap_or(e.mean)).fold(f64::INFINITY, f64::min);
    let high = all().map(|(_, e)| e.high.unwrap_or(e.mean)).fold(f64::NEG_INFINITY, f64::max);
    let places = (0..axis.values.len()).map(|i| axis.place(i));
    let (first, last) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    let ratio = (last / first).powf(0.03);
    let x = if spec.log {
        (first / ratio, last * ratio)
    } else {
        (first - 0.03 * (last - first), last + 0.03 * (last - first))
    };

    let mut figure = Figure::new(&spec.title, Figure::HEAD + CURVE + FOOT);
    let frame = Frame { left: LEFT, top: Figure::HEAD, right: RIGHT, bottom: Figure::HEAD + CURVE };
    let mut plot = Plot::within(frame, x, aired(low, high));
    if spec.log {
        plot = plot.log_x();
    }
    if let Some(ticks) = word_ticks(axis) {
        plot = plot.with_x_ticks(ticks);
    }
    for (i, line) in lines.iter().enumerate() {
        let color = series_color(i);
        let interval = |(x, e): &(f64, Estimate)| Some((*x, e.low?, e.high?));
        let band: Vec<_> = line.iter().filter_map(interval).collect();
        if word_ticks(axis).is_none() {
            plot.band(color, &band);
        }
        band.iter().for_each(|(x, low, high)| plot.error_bar(color, *x, *low, *high));
        plot.curve(color, &line.iter().map(|(x, e)| (*x, e.mean)).collect::<Vec<_>>());
        let name = &experiment.cases[i].name;
        figure.legend(color, if name.is_empty() { "mean and its 95 % interval" } else { name });
    }
    figure.add(&plot, &axis.label(), &spec.quantity.label());
    figure
}

/// How often which values come: a panel a case over one x axis.
fn histogram(experiment: &Experiment, spec: &PlotSpec, rows: &[Row]) -> Figure {
    let of_case = |name: &str| -> Vec<f64> {
        rows.iter().filter(|r| r.case == name).filter_map(|r| spec.quantity.value(r)).collect()
    };
    let values: Vec<Vec<f64>> = experiment.cases.iter().map(|c| of_case(&c.name)).collect();
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    values.iter().flatten().for_each(|x| (low, high) = (low.min(*x), high.max(*x)));
    if low >= high {
        // one value: a bar as wide as the value's own last digits
        let half = 0.5 * (low.abs() * 1e-3).max(1e-6);
        (low, high) = (low - half, high + half);
    }
    let bins = spec.bins as usize;
    let width = (high - low) / bins as f64;
    let counts: Vec<Vec<u64>> = values
        .iter()
        .map(|v| {
            let mut counts = vec![0; bins];
            v.iter().for_each(|x| counts[(((x - low) / width) as usize).min(bins - 1)] += 1);
            counts
        })
        .collect();
    let most = counts.iter().flatten().copied().max().unwrap_or(0) as f64;
    let panels = experiment.cases.len() as f64;
    let mut figure = Figure::new(&spec.title, 44.0 + panels * (PANEL + 34.0) + FOOT - 16.0);
    for (i, case) in experiment.cases.iter().enumerate() {
        let top = 44.0 + i as f64 * (PANEL + 34.0);
        let frame = Frame { left: LEFT, top, right: RIGHT, bottom: top + PANEL };
        let mut plot = Plot::within(frame, (low, high), (0.0, (most * 1.2).max(1.0)));
        for (b, n) in counts[i].iter().enumerate().filter(|(_, n)| **n > 0) {
            let x = low + b as f64 * width;
            plot.bar(series_color(i), x, x + width, *n as f64);
        }
        if let Some(mean) = mean(&values[i]) {
            plot.mark(mean, &format!("mean {mean:.4}"));
        }
        let trials = format!("{} trials", values[i].len());
        plot.caption(&if case.name.is_empty() { trials } else { format!("{}: {trials}", case.name) });
        let is_last = i + 1 == experiment.cases.len();
        figure.add(&plot, if is_last { spec.quantity.label() } else { String::new() }.as_str(), "trials");
    }
    figure
}

/// The mean over two axes: a panel a case, one scale of colours for all.
fn heatmap(experiment: &Experiment, spec: &PlotSpec, rows: &[Row]) -> Figure {
    let (across, up) = (&experiment.axes[spec.axis], &experiment.axes[spec.axis_y]);
    let value = |case: &str, i: usize, j: usize| {
        let is_here = |r: &&Row| {
            let at = experiment.cell_values(r.cell);
            r.case == case && at[spec.axis] == i && at[spec.axis_y] == j
        };
        let here: Vec<f64> = rows.iter().filter(is_here).filter_map(|r| spec.quantity.value(r)).collect();
        mean(&here)
    };
    let all: Vec<Vec<(usize, usize, Option<f64>)>> = experiment
        .cases
        .iter()
        .map(|c| {
            let cells = (0..across.values.len()).flat_map(|i| (0..up.values.len()).map(move |j| (i, j)));
            cells.map(|(i, j)| (i, j, value(&c.name, i, j))).collect()
        })
        .collect();
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    all.iter().flatten().filter_map(|c| c.2).for_each(|x| (low, high) = (low.min(x), high.max(x)));
    if low == high {
        high = low + low.abs().max(1e-9);
    }

    let columns = experiment.cases.len().min(COLUMNS);
    let lines = experiment.cases.len().div_ceil(columns);
    let pitch = (WIDTH - 90.0) / columns as f64;
    let side = (pitch - LEFT - 20.0).min(380.0);
    let height = if columns == 1 { 340.0 } else { side };
    let width = if columns == 1 { pitch - LEFT - 20.0 } else { side };
    let top = |line: usize| 72.0 + line as f64 * (height + 30.0 + FOOT);
    let mut figure = Figure::new(&spec.title, top(lines) - 30.0);
    let digits = |x: f64| {
        (2 - high.abs().max(low.abs()).max(1e-300).log10().floor() as i32).clamp(0, 6).min(if x == x.trunc() {
            3
        } else {
            6
        }) as usize
    };
    let room = width / across.values.len() as f64 > 44.0 && height / up.values.len() as f64 > 16.0;
    let ticks =
        |axis: &Axis| (0..axis.values.len()).map(|i| (i as f64 + 0.5, shortened(&axis.words(i)))).collect::<Vec<_>>();
    for (k, case) in experiment.cases.iter().enumerate() {
        let (left, top) = (LEFT + (k % columns) as f64 * pitch, top(k / columns));
        let frame = Frame { left, top, right: left + width, bottom: top + height };
        let mut plot = Plot::within(frame, (0.0, across.values.len() as f64), (0.0, up.values.len() as f64))
            .with_x_ticks(ticks(across))
            .with_y_ticks(ticks(up));
        for (i, j, value) in &all[k] {
            let (x, y) = (*i as f64, *j as f64);
            let Some(value) = value else { continue };
            let label = if room { format!("{value:.0$}", digits(*value)) } else { String::new() };
            plot.cell(heat_color((value - low) / (high - low)), (x, x + 1.0), (y, y + 1.0), &label);
        }
        plot.heading(&case.name);
        figure.add(&plot, &across.label(), &up.label());
    }
    if low.is_finite() {
        let frame = Frame { left: WIDTH - 36.0, top: top(0), right: WIDTH - 20.0, bottom: top(0) + height };
        let mut bar = Plot::within(frame, (0.0, 1.0), (low, high)).with_x_ticks(Vec::new());
        const STRIPES: usize = 128;
        for i in 0..STRIPES {
            let at = |i: usize| low + (high - low) * i as f64 / STRIPES as f64;
            bar.cell(heat_color((i as f64 + 0.5) / STRIPES as f64), (0.0, 1.0), (at(i), at(i + 1)), "");
        }
        figure.add(&bar, "", "");
    }
    figure
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path;

    use super::*;

    const TEXT: &str = "scenario = 'grid_plane'\ntrials = 2\n[vary]\n'pen.press_depth_mm' = [1, 10]\n'pen.kind' = ['marker', 'felt_tip']\n\
        [[case]]\nname = 'a <&> b'\n[[case]]\nname = 'c'\n[[plot]]\nkind = 'curve'\nmetric = 'line.coverage'\naxis = 'pen.press_depth_mm'\nlog = true\n\
        [[plot]]\nkind = 'curve'\nmetric = 'rate.success'\naxis = 'pen.kind'\n[[plot]]\nkind = 'histogram'\nmetric = 'line.coverage'\n\
        [[plot]]\nkind = 'heatmap'\nmetric = 'line.coverage'\naxis = 'pen.kind'\naxis_y = 'pen.press_depth_mm'\n";

    fn rows(experiment: &Experiment, value: impl Fn(&super::super::Trial) -> Option<f64>) -> Vec<Row> {
        let row = |i| {
            let t = experiment.trial(i).unwrap();
            let metrics: BTreeMap<String, f64> =
                value(&t).map(|x| ("line.coverage".to_string(), x)).into_iter().collect();
            let case = experiment.cases[t.case].name.clone();
            Row { trial: i, case, cell: t.cell, repeat: t.repeat, axes: t.axes, metrics, ..Row::default() }
        };
        (0..experiment.total()).map(row).collect()
    }

    #[test]
    fn axes_begin_at_zero_where_it_is_near() {
        assert_eq!([aired(0.0, 0.0), aired(2.0, 2.0)], [(0.0, 1.0), (1.8, 2.2)]);
        assert_eq!((aired(0.2, 1.0).0, aired(0.0, 1.0).0), (0.0, 0.0));
        assert!(aired(0.9, 1.0).0 > 0.89 && aired(-1.0, 1.0).0 < -1.0);
    }

    #[test]
    fn all_kinds_are_drawn_of_any_values() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/experiments/x.toml");
        let experiment = Experiment::parse(TEXT, &file, None).unwrap();
        let nothing = rows(&experiment, |_| None);
        let one = rows(&experiment, |_| Some(0.0));
        let some = rows(&experiment, |t| (t.repeat == 0).then_some(t.index as f64 * 1e-7 - 3.0));
        for rows in [&nothing, &one, &some] {
            for spec in &experiment.plots {
                let figure = chart(&experiment, spec, rows);
                let svg = figure.svg();
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{:?}: {svg}", spec.kind);
                assert!(!svg.contains("a <&> b"), "names are escaped");
                figure.png().unwrap();
            }
        }
        // a curve's dots are where the means are
        let figure = chart(&experiment, &experiment.plots[0], &some);
        assert_eq!(figure.svg().matches("<circle").count(), 4);
    }
}
