//! report.html of an experiment: what was asked, what came out, the plots, and the worst trials with their pictures.
use std::fmt::Write as _;

use crate::measure::MetricPath;
use crate::report::{document, escape};

use super::axis::words;
use super::estimate::Estimate;
use super::row::Row;
use super::spec::Experiment;
use super::summary::{Group, Summary};

/// A trial that is shown with pictures.
pub(super) struct Shown {
    /// Its row.
    pub row: Row,
    /// Why it is shown.
    pub why: String,
    /// Its folder beside the page.
    pub folder: String,
    /// Pictures in that folder.
    pub pictures: Vec<String>,
}

/// Figures that the table of groups has, where they were measured.
const COLUMNS: [&str; 8] = [
    "line.error_mean_mm",
    "line.coverage",
    "line.excess",
    "contact.force_mean_n",
    "contact.force_max_n",
    "contact.contact_fraction",
    "shape.aspect_deviation",
    "shape.angle_deviation",
];

/// The page as text; `plots` are file names without extension, and titles.
pub(super) fn page(
    experiment: &Experiment,
    summary: &Summary,
    rows: &[Row],
    plots: &[(String, String)],
    shown: &[Shown],
    files: &[(&str, &str)],
) -> String {
    let mut html = format!(
        "<header><h1>{}</h1><p>{}</p><p>Calamus {} &middot; seed {} &middot; {} trials, {} failed</p></header>\n",
        escape(&experiment.name),
        escape(&experiment.description),
        escape(&summary.calamus_version),
        experiment.seed,
        summary.trials,
        summary.failures,
    );
    html += &verdicts(summary);
    for (file, title) in plots {
        let _ = writeln!(
            html,
            "<figure style=\"margin:1.2rem 0\"><a href=\"{file}.png\"><img src=\"{file}.svg\" alt=\"{}\"></a></figure>",
            escape(title)
        );
    }
    html += &groups(experiment, summary);
    html += &worst(experiment, shown);
    html += &failures(rows);
    html += "<h2>Files</h2>\n<table>\n";
    for (file, meaning) in files {
        let _ = writeln!(
            html,
            "<tr><td><a href=\"{file}\"><code>{file}</code></a></td><td class=\"meaning\">{meaning}</td></tr>"
        );
    }
    let _ = writeln!(
        html,
        "</table>\n<h2>Experiment</h2>\n<details><summary>the file</summary>\n<pre>{}</pre></details>",
        escape(experiment.text())
    );
    document(&experiment.name, &html)
}

fn verdicts(summary: &Summary) -> String {
    if summary.accept.is_empty() {
        return String::new();
    }
    let mut html = String::from("<h2>Bounds</h2>\n<table>\n");
    for verdict in &summary.accept {
        let (mark, color) = if verdict.met { ("kept", "#3f7d4e") } else { ("missed", "#b5382f") };
        let _ = writeln!(
            html,
            "<tr><td style=\"color:{color}\"><b>{mark}</b></td><td>{}</td></tr>",
            escape(&verdict.to_string())
        );
    }
    html + "</table>\n"
}

/// Mean, and its interval below it.
fn cell(estimate: Option<&Estimate>, scale: f64) -> String {
    let Some(e) = estimate else { return "<td class=\"value\">-</td>".into() };
    let interval = e.low.zip(e.high).map_or_else(String::new, |(low, high)| {
        format!("<br><small>{} to {}</small>", figure(low * scale), figure(high * scale))
    });
    format!("<td class=\"value\">{}{interval}</td>", figure(e.mean * scale))
}

/// Four digits, whole numbers whole.
pub(super) fn figure(x: f64) -> String {
    if x == x.trunc() && x.abs() < 1e15 {
        return format!("{x:.0}");
    }
    let digits = (3 - x.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{x:.digits$}")
}

fn groups(experiment: &Experiment, summary: &Summary) -> String {
    let groups = summary.groups();
    let measured = COLUMNS.iter().filter_map(|path| MetricPath::find(path));
    let columns: Vec<&MetricPath> =
        measured.filter(|m| groups.iter().any(|g| g.metrics.contains_key(&m.path))).collect();
    let has_cases = experiment.cases.len() > 1;
    let mut html = String::from("<h2>Results</h2>\n<table>\n<tr>");
    if has_cases {
        html += "<th>case</th>";
    }
    for axis in &experiment.axes {
        let _ = write!(html, "<th>{}</th>", escape(&axis.label()));
    }
    html += "<th style=\"text-align:right\">trials</th><th style=\"text-align:right\">failed</th>";
    for rate in &experiment.rates {
        let _ = write!(html, "<th style=\"text-align:right\">{}, %</th>", escape(&rate.name));
    }
    for m in &columns {
        let unit = if m.unit.is_empty() { String::new() } else { format!(", {}", m.unit) };
        let _ = write!(html, "<th style=\"text-align:right\" title=\"{}\">{}{unit}</th>", escape(&m.meaning), m.path);
    }
    html += "</tr>\n";
    for group in groups {
        html += "<tr>";
        if has_cases {
            let _ = write!(html, "<td>{}</td>", escape(&group.case));
        }
        for axis in &experiment.axes {
            let index = group.axes.get(&axis.key).and_then(|v| axis.values.iter().position(|x| x == v));
            let _ = write!(html, "<td>{}</td>", escape(&index.map_or_else(String::new, |i| axis.words(i))));
        }
        let _ = write!(html, "<td class=\"value\">{}</td><td class=\"value\">{}</td>", group.n, group.failures);
        html += &row_of(group, experiment, &columns);
    }
    html += "</table>\n<p class=\"key\">Means over trials, and their 95 % intervals: bootstrap, and Wilson's for rates. \
             summary.csv has every figure.</p>\n";
    html + &contrasts(summary)
}

fn row_of(group: &Group, experiment: &Experiment, columns: &[&MetricPath]) -> String {
    let rates = experiment.rates.iter().map(|r| cell(group.rates.get(&r.name), 100.0));
    let figures = columns.iter().map(|m| cell(group.metrics.get(&m.path), 1.0));
    rates.chain(figures).collect::<String>() + "</tr>\n"
}

fn contrasts(summary: &Summary) -> String {
    let mut html = String::new();
    for contrast in &summary.contrasts {
        let _ = writeln!(html, "<h2>{} less {}</h2>\n<table>", escape(&contrast.case), escape(&contrast.against));
        for m in COLUMNS.iter().filter_map(|path| MetricPath::find(path)) {
            if let Some(e) = contrast.metrics.get(&m.path) {
                let _ = writeln!(
                    html,
                    "<tr><td><code>{}</code></td>{}<td>{}</td><td class=\"meaning\">{}</td></tr>",
                    m.path,
                    cell(Some(e), 1.0),
                    m.unit,
                    escape(&m.meaning)
                );
            }
        }
        html += "</table>\n<p class=\"key\">Mean difference of trials that met the same randomness, and its 95 % interval.</p>\n";
    }
    html
}

fn worst(experiment: &Experiment, shown: &[Shown]) -> String {
    let Some(worst) = experiment.worst.as_ref().filter(|_| !shown.is_empty()) else { return String::new() };
    let kinds = if worst.each.is_empty() { "" } else { ", and one of each kind" };
    let mut html = format!("<h2>Worst trials: {}{kinds}</h2>\n", escape(&worst.quantity.meaning()));
    for Shown { row, why, folder, pictures } in shown {
        let _ = writeln!(
            html,
            "<h3>Trial {}{}: {}</h3>\n<p class=\"key\">{} &middot; <a href=\"{folder}/report.html\">everything about it</a></p>\n<div class=\"pictures\">",
            row.trial,
            if row.case.is_empty() { String::new() } else { format!(", {}", escape(&row.case)) },
            escape(why),
            escape(&settings(row)),
        );
        for picture in pictures {
            let path = format!("{folder}/{picture}");
            let _ = writeln!(
                html,
                "<figure><a href=\"{path}\"><img src=\"{path}\" alt=\"{picture}\"></a><figcaption>{picture}</figcaption></figure>"
            );
        }
        html += "</div>\n";
    }
    html
}

/// What a trial was, in words.
fn settings(row: &Row) -> String {
    let values = row.axes.iter().chain(&row.draws).map(|(k, v)| format!("{k} = {}", words(v)));
    values.chain([format!("seed {}", row.seed)]).collect::<Vec<_>>().join(", ")
}

fn failures(rows: &[Row]) -> String {
    const SHOWN: usize = 20;
    let failed: Vec<&Row> = rows.iter().filter(|r| !r.is_ok()).collect();
    if failed.is_empty() {
        return String::new();
    }
    let mut html = String::from("<h2>Failed trials</h2>\n<table>\n");
    for row in failed.iter().take(SHOWN) {
        let _ = writeln!(
            html,
            "<tr><td class=\"value\">{}</td><td>{}</td><td class=\"meaning\">{}</td></tr>",
            row.trial,
            escape(&row.reason),
            escape(&[row.case.clone(), settings(row)].join(" "))
        );
    }
    html += "</table>\n";
    if failed.len() > SHOWN {
        let _ = writeln!(html, "<p class=\"key\">and {} more: results.csv has them all</p>", failed.len() - SHOWN);
    }
    html
}
