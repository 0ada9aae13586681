//! What a run must come to unless its scenario says otherwise: a failure never looks like success.
mod cause;

use std::fmt;

use crate::math::figure;
use crate::measure::Metrics;
use crate::robot::Arm;
use crate::scenario::{Scenario, told_apart};

pub use cause::Cause;

/// Least share of the line that has to be drawn.
const LEAST_COVERAGE: f64 = 0.5;
/// Largest share of the drawing steps in which torques may be cut.
const MOST_SATURATED: f64 = 0.05;
/// Farthest that ink, or the tip, may be from where it was to be, mm.
const FARTHEST_MM: f64 = 5.0;
/// The peak of a landing, a few milliseconds long, may be this many times what the pen takes for long: one and a half times are met where a
/// surface is some millimetres nearer than believed.
const PEAK: f64 = 2.0;

/// A figure beyond what any drawing that came about has.
#[derive(Clone, Debug, PartialEq)]
pub struct Shortcoming {
    /// Dotted path of the figure.
    pub path: &'static str,
    /// Its value.
    pub value: f64,
    /// What it should have kept to.
    pub limit: f64,
    unit: &'static str,
    low: bool,
}

impl fmt::Display for Shortcoming {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { path, value, limit, unit, low } = self;
        let than = if *low { "less" } else { "more" };
        write!(f, "{path} is {}{unit}, {than} than {}{unit}", told_apart(*value, *limit), figure(*limit))
    }
}

/// Why a run that went to its end didn't come to a drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Figures that are out of bounds; at least one.
    pub shortcomings: Vec<Shortcoming>,
    /// What most likely lies behind them.
    pub cause: Cause,
    /// Whether no ink came onto the canvas at all.
    pub blank: bool,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.blank {
            f.write_str("no ink came onto the canvas; ")?;
        }
        for (i, shortcoming) in self.shortcomings.iter().enumerate() {
            write!(f, "{}{shortcoming}", if i > 0 { "; " } else { "" })?;
        }
        write!(f, ": {}", self.cause)
    }
}

impl Verdict {
    /// What is beyond all reason in the figures of a run by `arms`, and the likely cause; of a `part` of the drawing, or of all. `takes`
    /// is the force that the strongest of its pens takes, N. `None` where the run came to a drawing.
    pub fn of(scenario: &Scenario, arms: &[Arm], takes: f64, metrics: &Metrics, part: bool) -> Option<Self> {
        let shortcomings = shortcomings(scenario, metrics, takes, part);
        if shortcomings.is_empty() {
            return None;
        }
        let blank = metrics.line.as_ref().is_some_and(|l| l.inked_length_m == Some(0.0));
        let peak = matches!(&shortcomings[..], [only] if only.path == PEAK_FORCE);
        let cause = Cause::of(scenario, arms, metrics, takes, peak);
        Some(Self { shortcomings, cause, blank })
    }

    /// Whether none of the line was drawn: no part of it either.
    pub fn is_of_nothing(&self) -> bool {
        self.shortcomings.iter().any(|s| s.path == COVERAGE && s.value == 0.0)
    }
}

const COVERAGE: &str = "line.coverage";
/// The figure of a landing's force.
const PEAK_FORCE: &str = "contact.force_max_n";

/// The figures of a run that are beyond all reason and that its `[accept]` doesn't speak of; of a `part` of the drawing, for which the
/// bounds weren't made, those that break these too. `takes` is the force that the strongest of its pens takes, N.
fn shortcomings(scenario: &Scenario, metrics: &Metrics, takes: f64, part: bool) -> Vec<Shortcoming> {
    let at_most = |path, value: Option<f64>, limit, unit| {
        value.filter(|x| *x > limit).map(|value| Shortcoming { path, value, limit, unit, low: false })
    };
    let (line, contact, sim) = (metrics.line.as_ref(), metrics.contact.as_ref(), metrics.sim.as_ref());
    let coverage = line.and_then(|l| l.coverage).filter(|c| *c < LEAST_COVERAGE);
    let found = [
        coverage.map(|value| Shortcoming { path: COVERAGE, value, limit: LEAST_COVERAGE, unit: "", low: true }),
        at_most(PEAK_FORCE, contact.and_then(|c| c.force_max_n), PEAK * takes, " N"),
        at_most("contact.force_mean_n", contact.and_then(|c| c.force_mean_n), takes, " N"),
        at_most("sim.saturated_fraction", sim.and_then(|s| s.saturated_fraction), MOST_SATURATED, ""),
        at_most("line.stroke_error_max_mm", line.and_then(|l| l.stroke_error_max_mm), FARTHEST_MM, " mm"),
        at_most("line.tip_error_max_mm", line.and_then(|l| l.tip_error_max_mm), FARTHEST_MM, " mm"),
    ];
    let unmet = scenario.unmet(metrics);
    let excused = |s: &Shortcoming| {
        // who bounds the largest force bounds the mean too
        let paths = [s.path, if s.path == "contact.force_mean_n" { PEAK_FORCE } else { s.path }];
        // who bounds the coverage and gets none of it is told why
        let insist = part || s.value == 0.0;
        paths.iter().any(|p| scenario.accept.contains_key(*p) && !(insist && unmet.iter().any(|u| u.path == *p)))
    };
    found.into_iter().flatten().filter(|s| !excused(s)).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::measure::{ContactMetrics, LineMetrics, SimMetrics};

    fn scenario(accept: &str) -> Scenario {
        let text =
            format!("[drawing.pattern]\nkind = 'grid'\nn = 1\n[canvas]\nscene = 'plane_table'\n[accept]\n{accept}");
        Scenario::parse(&text, Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/s.toml")), &[]).unwrap()
    }

    fn metrics(coverage: f64, force: f64, saturated: f64, off: f64) -> Metrics {
        Metrics {
            line: Some(LineMetrics { coverage: Some(coverage), stroke_error_max_mm: Some(off), ..Default::default() }),
            contact: Some(ContactMetrics { force_max_n: Some(force), ..Default::default() }),
            sim: Some(SimMetrics { saturated_fraction: Some(saturated), ..Default::default() }),
            ..Metrics::new("x", 1)
        }
    }

    fn paths(accept: &str, metrics: &Metrics, part: bool) -> Vec<&'static str> {
        shortcomings(&scenario(accept), metrics, 4.0, part).iter().map(|s| s.path).collect()
    }

    #[test]
    fn each_figure_has_its_limit() {
        let none: [&str; 0] = [];
        assert_eq!(paths("", &metrics(0.5, 8.0, 0.05, 5.0), false), none);
        assert_eq!(paths("", &metrics(0.49, 8.0, 0.05, 5.0), false), ["line.coverage"]);
        assert_eq!(paths("", &metrics(0.5, 8.1, 0.05, 5.0), false), ["contact.force_max_n"]);
        assert_eq!(paths("", &metrics(0.5, 8.0, 0.06, 5.0), false), ["sim.saturated_fraction"]);
        assert_eq!(paths("", &metrics(0.5, 8.0, 0.05, 5.1), false), ["line.stroke_error_max_mm"]);
    }

    #[test]
    fn a_bound_of_the_scenario_takes_a_limits_place() {
        let bad = metrics(0.2, 20.0, 0.0, 0.0);
        let bounds = "'line.coverage' = { min = 0.3 }\n'contact.force_max_n' = { max = 30 }\n";
        // that the coverage is below its bound is told as such
        assert!(paths(bounds, &bad, false).is_empty());
        // of a part of the drawing nobody else tells
        assert_eq!(paths(bounds, &bad, true), ["line.coverage"]);
    }
}
