//! metrics.json, and the same in ten lines for a terminal.
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::math::sensible;
use crate::measure::Metrics;

/// metrics.json: pretty, in the order of [`Metrics`].
pub fn metrics_json(metrics: &Metrics) -> Result<String, serde_json::Error> {
    Ok(serde_json::to_string_pretty(metrics)? + "\n")
}

/// A time for people: `4.1 s`, `3 min 20 s`, `2 h 05 min`.
pub fn duration(seconds: f64) -> String {
    if !(seconds.is_finite() && seconds >= 0.0) {
        return "-".into();
    }
    let whole = seconds.round() as u64;
    match whole {
        0..60 => format!("{seconds:.1} s"),
        60..3600 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole % 3600 / 60),
    }
}

/// What a run came to, a line a stage; stages that did not run have none. `files` are the files written.
pub fn summary(metrics: &Metrics, files: &[PathBuf]) -> String {
    let mut text = String::new();
    let mut line = |name: &str, parts: Vec<Option<String>>| {
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        if !parts.is_empty() {
            let _ = writeln!(text, "{name:<10} {}", sensible(&parts.join(", ")));
        }
    };
    line("scenario", vec![Some(metrics.scenario.clone()), Some(format!("seed {}", metrics.seed))]);
    if let Some(d) = &metrics.drawing {
        let (strokes, inks) = (counted(d.strokes, "stroke"), counted(d.inks, "ink"));
        let changes = (d.ink_changes > 0).then(|| counted(d.ink_changes, "change") + " of ink");
        let time = d.estimated_s.map(|s| format!("roughly {} at the robot", duration(s)));
        line("drawing", vec![Some(strokes), Some(inks), Some(format!("{:.2} m of line", d.length_m)), changes, time]);
    }
    if let Some(m) = &metrics.mapping {
        let area = m.area_ratio_p05.zip(m.area_ratio_p95).map(|(a, b)| format!("area times {a:.2} to {b:.2}"));
        let angle = m.angle_error_mean.map(|a| format!("angles off by {a:.1} deg on average"));
        let length = m.length_error_max.map(|e| format!("lengths of strokes change by up to {}", percent(e)));
        line("canvas", vec![Some(m.kind.clone()), area, angle, length]);
    }
    if let Some(p) = &metrics.plan {
        let changes = p.tool_changes.map(|n| counted(n, "pen change"));
        let time = p.estimated_s.map(|s| format!("{} at the robot", duration(s)));
        let failures = (!p.failures.is_empty()).then(|| counted(p.failures.len(), "place") + " out of reach");
        line("plan", vec![Some(format!("{} reachable", percent(p.reachable_fraction))), changes, time, failures]);
    }
    if let Some(s) = &metrics.sim {
        let factor = s.real_time_factor.map(|f| format!("{f:.0} times real time"));
        let time = format!("{} in {}", duration(s.simulated_s), duration(s.wall_s));
        line("simulated", vec![Some(time), factor, Some(s.plant.clone()).filter(|p| !p.is_empty())]);
    }
    if let Some(c) = &metrics.contact {
        let mean = c.force_mean_n.map(|f| match c.force_target_n {
            Some(target) => format!("{f:.2} N of {target:.2} N"),
            None => format!("{f:.2} N"),
        });
        let touching = c.contact_fraction.map(|f| format!("touching {} of the time", percent(f)));
        let sd = c.force_sd_n.map(|f| format!("spread {f:.2} N"));
        line("force", vec![mean, sd, c.force_max_n.map(|f| format!("at most {f:.1} N")), touching]);
    }
    if let Some(l) = &metrics.line {
        let mean = l.error_mean_mm.map(|e| format!("{e:.3} mm off on average"));
        let p95 = l.error_p95_mm.map(|e| format!("95 % within {e:.3} mm"));
        line("line", vec![mean, p95, l.error_max_mm.map(|e| format!("at most {e:.2} mm"))]);
        let coverage = l.coverage.map(|c| format!("{} of the line drawn", percent(c)));
        line("ink", vec![coverage, l.excess.map(|e| format!("{} astray", percent(e)))]);
    }
    if let Some(i) = &metrics.image {
        let likeness =
            |ssim: Option<f64>, psnr: Option<f64>| ssim.zip(psnr).map(|(s, p)| format!("likeness {s:.2}, {p:.1} dB"));
        let preview = likeness(i.preview_ssim, i.preview_psnr_db).map(|l| format!("preview {l}"));
        line("picture", vec![likeness(i.ssim, i.psnr_db), preview]);
    }
    let why = metrics.render.as_ref().and_then(|r| r.views_absent.clone());
    line("views", vec![why.map(|w| format!("none: {w}"))]);
    let folder = files.first().and_then(|f| f.parent()).unwrap_or(Path::new(""));
    let names: Vec<_> = files.iter().filter_map(|f| f.file_name()).map(|n| n.to_string_lossy().into_owned()).collect();
    if !names.is_empty() {
        line("files", vec![Some(format!("{}: {}", folder.display(), names.join(" ")))]);
    }
    text
}

/// `1 stroke`, `2 strokes`.
fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// A share in percent, with as many digits as tell it from none and all.
fn percent(share: f64) -> String {
    // below a part in a million it is rounding, not a figure
    let share = if share.abs() < 1e-6 { 0.0 } else { share };
    let text = format!("{:.1}", share * 100.0);
    let rounded_away = (text == "100.0" && share < 1.0) || (text == "0.0" && share > 0.0);
    if rounded_away { format!("{:.3} %", share * 100.0) } else { format!("{} %", text.trim_end_matches(".0")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::{DrawingMetrics, LineMetrics};

    #[test]
    fn stages_that_did_not_run_have_no_line() {
        let drawing = DrawingMetrics { strokes: 1, inks: 3, length_m: 1.234, ..DrawingMetrics::default() };
        let metrics = Metrics { drawing: Some(drawing), line: Some(LineMetrics::default()), ..Metrics::new("x", 1) };
        let text = summary(&metrics, &[PathBuf::from("out/x/a.svg"), PathBuf::from("out/x/b.json")]);
        assert_eq!(
            text,
            "scenario   x, seed 1\ndrawing    1 stroke, 3 inks, 1.23 m of line\nfiles      out/x: a.svg b.json\n"
        );
    }

    #[test]
    fn times_and_shares_read_well() {
        assert_eq!([duration(4.12), duration(200.0), duration(7500.0)], ["4.1 s", "3 min 20 s", "2 h 05 min"]);
        assert_eq!(
            [percent(1.0), percent(0.9999), percent(0.0), percent(0.123)],
            ["100 %", "99.990 %", "0 %", "12.3 %"]
        );
    }
}
