//! The results of an experiment as text for a terminal: a table, and the bounds.
use std::fmt::Write as _;

use super::estimate::Estimate;
use super::spec::Experiment;
use super::summary::{Group, Summary};

/// Figures that the table has, where they were measured.
const FIGURES: [&str; 6] = [
    "line.error_mean_mm",
    "line.coverage",
    "contact.force_mean_n",
    "contact.force_max_n",
    "shape.aspect_deviation",
    "shape.angle_deviation",
];
/// Most lines of the table; of a larger grid only the cases are shown.
const LINES: usize = 30;

/// The table of groups, and a line a bound.
pub fn summary_text(experiment: &Experiment, summary: &Summary) -> String {
    let failed = if summary.failures > 0 { format!(", {} failed", summary.failures) } else { String::new() };
    let mut text = format!("{}: {} trials{failed}\n", summary.experiment, summary.trials);
    let all = summary.groups();
    let groups = if all.len() > LINES { &summary.cases } else { all };
    let rows = std::iter::once(head(experiment, groups)).chain(groups.iter().map(|g| line(experiment, groups, g)));
    text += &aligned(&rows.collect::<Vec<_>>());
    if groups.len() < all.len() {
        let _ = writeln!(text, "each of the {} points of the grid is in summary.csv", experiment.cells());
    }
    for verdict in &summary.accept {
        let _ = writeln!(text, "{} {verdict}", if verdict.met { "kept  " } else { "MISSED" });
    }
    text
}

/// The figures that any of the groups has.
fn figures(groups: &[Group]) -> impl Iterator<Item = &'static str> {
    FIGURES.into_iter().filter(|path| groups.iter().any(|g| g.metrics.contains_key(*path)))
}

fn head(experiment: &Experiment, groups: &[Group]) -> Vec<String> {
    let leaf = |key: &str| key.rsplit('.').next().unwrap_or(key).to_string();
    let mut cells = Vec::new();
    if experiment.cases.len() > 1 {
        cells.push("case".to_string());
    }
    if groups.iter().any(|g| !g.axes.is_empty()) {
        cells.extend(experiment.axes.iter().map(|a| leaf(&a.label())));
    }
    cells.push("trials".into());
    cells.extend(experiment.rates.iter().map(|r| r.name.clone()));
    cells.extend(figures(groups).map(leaf));
    cells
}

fn line(experiment: &Experiment, groups: &[Group], group: &Group) -> Vec<String> {
    let mut cells = Vec::new();
    if experiment.cases.len() > 1 {
        cells.push(group.case.clone());
    }
    if !group.axes.is_empty() {
        cells.extend(experiment.axes.iter().map(|axis| {
            let index = group.axes.get(&axis.key).and_then(|v| axis.values.iter().position(|x| x == v));
            index.map_or_else(String::new, |i| axis.words(i))
        }));
    }
    cells.push(group.n.to_string());
    let percent = |e: &Estimate| format!("{:.1} %", e.mean * 100.0);
    cells.extend(experiment.rates.iter().map(|r| group.rates.get(&r.name).map_or_else(|| "-".into(), percent)));
    cells.extend(figures(groups).map(|path| group.metrics.get(path).map_or_else(|| "-".into(), interval)));
    cells
}

/// The mean and half of its interval's width, with as many digits as that leaves sure.
fn interval(e: &Estimate) -> String {
    let half = e.low.zip(e.high).map(|(low, high)| 0.5 * (high - low));
    let scale = half.filter(|h| *h > 0.0).unwrap_or(e.mean.abs() * 1e-3);
    let digits = if scale > 0.0 { (1.0 - scale.log10().floor()).clamp(0.0, 5.0) as usize } else { 0 };
    match half {
        Some(half) => format!("{:.digits$} ± {half:.digits$}", e.mean),
        None => format!("{:.digits$}", e.mean),
    }
}

/// Cells in columns, right-aligned.
fn aligned(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| rows.iter().filter_map(|r| r.get(c)).map(|s| s.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:>width$}"));
        let _ = writeln!(text, "{}", cells.collect::<Vec<_>>().join("  "));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_the_digits_that_are_sure() {
        let of = |mean: f64, low: Option<f64>, high: Option<f64>| {
            interval(&Estimate { n: 2, mean, sd: 0.0, median: mean, low, high, min: mean, max: mean })
        };
        assert_eq!(of(0.022_47, Some(0.0213), Some(0.0241)), "0.0225 ± 0.0014");
        assert_eq!(of(3.443, Some(3.4356), Some(3.4514)), "3.4430 ± 0.0079");
        assert_eq!(of(1.0, Some(1.0), Some(1.0)), "1.0000 ± 0.0000");
        assert_eq!([of(0.0, None, None), of(2.5, None, None)], ["0", "2.5000"]);
    }

    #[test]
    fn columns_are_right_aligned() {
        let rows = [vec!["a".to_string(), "mean".into()], vec!["long".into(), "±1".into()]];
        assert_eq!(aligned(&rows), "   a  mean\nlong    ±1\n");
    }
}
