//! report.html: one page that tells a person what happened, without anything from outside its folder.
use std::fmt::Write as _;

use crate::measure::Metrics;
use crate::plan::SegmentKind;
use crate::twin::{ArmRecord, EventKind, Record};

use super::html::{document, escape};
use super::plot::Plot;
use super::summary::duration;

/// What a page is made of.
pub struct Page<'a> {
    /// Title: the scenario's name.
    pub title: &'a str,
    /// What the run shows.
    pub description: &'a str,
    /// Its figures.
    pub metrics: &'a Metrics,
    /// What happened, when it was simulated.
    pub record: Option<&'a Record>,
    /// Pictures: file name beside the page, and caption.
    pub pictures: &'a [(String, String)],
    /// Other files: file name beside the page, and what is in it.
    pub files: &'a [(String, String)],
    /// The resolved scenario.
    pub scenario_toml: &'a str,
}

/// The page as text.
pub fn report_html(page: &Page) -> String {
    let mut html = format!(
        "<header><h1>{}</h1><p>{}</p><p>Calamus {} &middot; seed {}{}</p></header>\n",
        escape(page.title),
        escape(page.description),
        escape(&page.metrics.calamus_version),
        page.metrics.seed,
        page.metrics.digest.as_ref().map_or(String::new(), |d| format!(" &middot; digest <code>{}</code>", escape(d))),
    );
    html += &tiles(page.metrics);
    html += &pictures(page);
    if let Some(record) = page.record {
        for arm in &record.arms {
            html += &plots(arm, record.simulated, page.metrics);
        }
    }
    html += &failures(page.metrics);
    html += &table(page.metrics);
    if let Some(record) = page.record {
        html += &pen_changes(record);
    }
    html += &files(page.files);
    let _ = write!(
        html,
        "<h2>Scenario</h2>\n<details><summary>every setting of this run</summary>\n<pre>{}</pre></details>\n",
        escape(page.scenario_toml)
    );
    document(page.title, &html)
}

/// The few figures one looks at first.
fn tiles(metrics: &Metrics) -> String {
    let line = metrics.line.as_ref();
    let contact = metrics.contact.as_ref();
    let force = contact.and_then(|c| c.force_mean_n.zip(c.force_sd_n));
    let tiles = [
        (line.and_then(|l| l.error_mean_mm).map(|e| format!("{e:.3} mm")), "mean distance from the desired line"),
        (line.and_then(|l| l.coverage).map(|c| format!("{:.2} %", c * 100.0)), "of the desired line drawn"),
        (force.map(|(mean, sd)| format!("{mean:.2} &plusmn; {sd:.2} N")), "force of the pen"),
        (
            metrics.drawing.as_ref().map(|d| format!("{} / {:.2} m", d.strokes, d.length_m)),
            "strokes / length of the artwork",
        ),
        (metrics.sim.as_ref().map(|s| duration(s.simulated_s)), "at the robot"),
    ];
    let mut html = String::from("<div class=\"tiles\">\n");
    for (value, meaning) in tiles {
        if let Some(value) = value {
            let _ = writeln!(html, "<div class=\"tile\"><b>{value}</b><span>{meaning}</span></div>");
        }
    }
    html + "</div>\n"
}

fn pictures(page: &Page) -> String {
    let mut html = String::from("<div class=\"pictures\">\n");
    for (file, caption) in page.pictures {
        let (file, caption) = (escape(file), escape(caption));
        let _ = writeln!(
            html,
            "<figure><a href=\"{file}\"><img src=\"{file}\" alt=\"{caption}\"></a><figcaption>{caption}</figcaption></figure>"
        );
    }
    html += "</div>\n";
    if let Some(why) = page.metrics.render.as_ref().and_then(|r| r.views_absent.as_ref()) {
        let _ = writeln!(html, "<p class=\"warning\">No views of the scene: {}</p>", escape(why));
    }
    html
}

/// Force and error of one arm over time.
fn plots(arm: &ArmRecord, end: f64, metrics: &Metrics) -> String {
    let drawing = || arm.samples.iter().filter(|s| s.segment == SegmentKind::Draw);
    let target = metrics.contact.as_ref().and_then(|c| c.force_target_n);
    let top = drawing().filter_map(|s| s.normal_force).fold(target.unwrap_or(0.0), f64::max);
    let mut force = Plot::new(280.0, (0.0, end), (0.0, top * 1.15));
    force.envelope("force", drawing().filter_map(|s| Some((s.time, s.normal_force?))), 1.5 * arm.sample_period);
    if let Some(target) = target {
        force.level(target, &format!("target {target:.2} N"));
    }
    for (kind, start, end) in spans(arm) {
        force.strip(kind, start, end);
    }
    let worst = arm.strokes.iter().map(|s| s.lateral_error.max * 1e3).fold(0.0, f64::max);
    let mut error = Plot::new(240.0, (0.0, end), (0.0, worst * 1.1));
    for s in &arm.strokes {
        error.whisker(0.5 * (s.start + s.end), s.lateral_error.mean * 1e3, s.lateral_error.max * 1e3);
    }
    let angles = || arm.samples.iter().flat_map(|s| &s.q).map(|q| q.to_degrees());
    let range = (angles().fold(f64::INFINITY, f64::min), angles().fold(f64::NEG_INFINITY, f64::max));
    let mut joints = Plot::new(280.0, (0.0, end), range);
    let mut key = String::new();
    for (j, name) in arm.joints.iter().enumerate() {
        joints.line(&format!("j{j}"), arm.samples.iter().filter_map(|s| s.q.get(j).map(|q| (s.time, q.to_degrees()))));
        let _ = write!(
            key,
            "<svg style=\"display:inline;border:0;width:1em;height:.7em;margin:0 .3em 0 .9em\" viewBox=\"0 0 10 7\"><path class=\"line j{j}\" style=\"stroke-width:3\" d=\"M0 4H10\"/></svg>{}",
            escape(name)
        );
    }
    format!(
        "<h2>Force of the pen: {}</h2>\n{}<p class=\"key\">along the time axis: \
         <i style=\"background:var(--blue)\"></i>drawing <i style=\"background:#d8d3c6\"></i>pen up \
         <i style=\"background:var(--red)\"></i>pen change</p>\n\
         <h2>Distance of the nib from its set point, by stroke</h2>\n{}<p class=\"key\">dot: mean; top of the mark: largest; \
         across the pen axis</p>\n<h2>Joints</h2>\n{}<p class=\"key\">{key}</p>\n",
        escape(&arm.name),
        force.svg("normal force over time", "time, s", "normal force, N"),
        error.svg("lateral error of each stroke", "time, s", "distance, mm"),
        joints.svg("joint positions over time", "time, s", "position, deg"),
    )
}

/// Runs of equal activity in the samples: class, start, end.
fn spans(arm: &ArmRecord) -> Vec<(&'static str, f64, f64)> {
    let mut spans: Vec<(&'static str, f64, f64)> = Vec::new();
    for s in &arm.samples {
        let class = match s.segment {
            SegmentKind::Draw => "draw",
            SegmentKind::ChangePen | SegmentKind::ChangeTool => "change_pen",
            _ => "travel",
        };
        match spans.last_mut() {
            Some((last, _, end)) if *last == class => *end = s.time + arm.sample_period,
            _ => spans.push((class, s.time, s.time + arm.sample_period)),
        }
    }
    spans
}

fn failures(metrics: &Metrics) -> String {
    let Some(plan) = metrics.plan.as_ref().filter(|p| !p.failures.is_empty()) else { return String::new() };
    let mut html = String::from("<h2>Out of reach</h2>\n<table>\n");
    for f in &plan.failures {
        let point = f.point.map_or(String::new(), |p| format!(", point {p}"));
        let _ = writeln!(
            html,
            "<tr><td>layer {}, stroke {}{point}</td><td class=\"meaning\">{}</td></tr>",
            f.layer,
            f.stroke,
            escape(&f.reason)
        );
    }
    html + "</table>\n"
}

/// Every figure there is, with its plain words.
fn table(metrics: &Metrics) -> String {
    let mut html = String::from("<h2>Figures</h2>\n<table>\n");
    let mut section = "";
    for (metric, value) in metrics.values() {
        let (head, name) = metric.path.split_once('.').unwrap_or(("", &metric.path));
        if head != section {
            section = head;
            let _ = writeln!(html, "<tr><th colspan=\"3\">{head}</th></tr>");
        }
        let _ = writeln!(
            html,
            "<tr><td><code>{name}</code></td><td class=\"value\">{} {}</td><td class=\"meaning\">{}</td></tr>",
            figure(value),
            metric.unit,
            escape(&metric.meaning)
        );
    }
    html + "</table>\n"
}

/// Four digits, whole numbers whole.
fn figure(x: f64) -> String {
    if x == x.trunc() && x.abs() < 1e15 {
        return format!("{x:.0}");
    }
    let digits = (3 - x.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{x:.digits$}")
}

fn pen_changes(record: &Record) -> String {
    let mut html = String::new();
    for event in &record.events {
        if let EventKind::PenChanged { ink } | EventKind::PenFetched { ink } = &event.kind {
            let arm = record.arms.get(event.arm).map_or("", |a| a.name.as_str());
            let _ = writeln!(
                html,
                "<tr><td class=\"value\">{:.1} s</td><td>{}</td><td>{}</td></tr>",
                event.time,
                escape(arm),
                escape(ink)
            );
        }
    }
    if html.is_empty() { html } else { format!("<h2>Pen changes</h2>\n<table>\n{html}</table>\n") }
}

fn files(files: &[(String, String)]) -> String {
    if files.is_empty() {
        return String::new();
    }
    let mut html = String::from("<h2>Files</h2>\n<table>\n");
    for (file, meaning) in files {
        let (file, meaning) = (escape(file), escape(meaning));
        let _ = writeln!(
            html,
            "<tr><td><a href=\"{file}\"><code>{file}</code></a></td><td class=\"meaning\">{meaning}</td></tr>"
        );
    }
    html + "</table>\n"
}

#[cfg(test)]
mod tests {
    use super::super::sample::record;
    use super::*;
    use crate::measure::{ContactMetrics, LineMetrics, RenderMetrics};

    fn page(record: Option<&Record>) -> String {
        let contact =
            ContactMetrics { force_target_n: Some(1.05), force_mean_n: Some(1.04), ..ContactMetrics::default() };
        let line = LineMetrics { error_mean_mm: Some(0.0512), coverage: Some(0.999), ..LineMetrics::default() };
        let render = RenderMetrics { views_absent: Some("no driver".into()), ..RenderMetrics::default() };
        let metrics = Metrics {
            contact: Some(contact),
            line: Some(line),
            render: Some(render),
            ..Metrics::new("a <b> & \"c\"", 3)
        };
        report_html(&Page {
            title: "a <b> & \"c\"",
            description: "four strokes",
            metrics: &metrics,
            record,
            pictures: &[("drawing.png".into(), "what was drawn".into())],
            files: &[("record.mcap".into(), "joints and forces".into())],
            scenario_toml: "name = 'x'\n",
        })
    }

    #[test]
    fn the_page_needs_nothing_from_outside_and_escapes_names() {
        let record = record();
        let html = page(Some(&record));
        assert!(!html.contains("http") && !html.contains("<script") && !html.contains("url("));
        assert!(html.contains("a &lt;b&gt; &amp; &quot;c&quot;") && html.contains("blue &amp; &lt;grey&gt;"));
        assert!(html.contains("0.05120 mm") && html.contains("target 1.05 N") && html.contains("no driver"));
        assert!(!html.contains("NaN"));
    }

    #[test]
    fn a_page_without_a_record_has_no_plots() {
        assert!(!page(None).contains("<svg"));
    }
}
