//! What is summed up over trials: a figure of each, or whether each meets a condition.
use crate::diagnostic;
use crate::measure::MetricPath;

use super::row::{Row, kept};

/// The rate of trials that ended well.
pub(super) const SUCCESS: &str = "success";

/// A condition on a figure of one trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Rate {
    /// Name.
    pub name: String,
    /// The condition in words, `line.coverage >= 0.99`; empty for `success`.
    pub words: String,
    condition: Option<(&'static MetricPath, Comparison, f64)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Comparison {
    AtLeast,
    AtMost,
    Above,
    Below,
}

impl Rate {
    /// The rate of trials that could be done at all.
    pub(super) fn success() -> Self {
        Self { name: SUCCESS.into(), words: String::new(), condition: None }
    }

    /// Reads a condition; the error says what would be right.
    pub(super) fn parse(name: &str, words: &str) -> Result<Self, String> {
        const SIGNS: [(&str, Comparison); 4] = [
            (">=", Comparison::AtLeast),
            ("<=", Comparison::AtMost),
            (">", Comparison::Above),
            ("<", Comparison::Below),
        ];
        let wrong = || format!("`{words}` should be a figure, >=, <=, > or <, and a number");
        let found = SIGNS.iter().find_map(|(sign, c)| words.split_once(sign).map(|(a, b)| (a.trim(), *c, b.trim())));
        let (path, comparison, number) = found.ok_or_else(wrong)?;
        let number = number.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(wrong)?;
        Ok(Self { name: name.into(), words: words.into(), condition: Some((metric(path)?, comparison, number)) })
    }

    /// Whether a trial meets it; one that failed, or has no such figure, doesn't.
    pub(super) fn is_met(&self, row: &Row) -> bool {
        let Some((metric, comparison, bound)) = self.condition else { return row.is_ok() };
        row.metrics.get(&metric.path).is_some_and(|x| match comparison {
            Comparison::AtLeast => *x >= bound,
            Comparison::AtMost => *x <= bound,
            Comparison::Above => *x > bound,
            Comparison::Below => *x < bound,
        })
    }
}

/// A figure that trials keep, by its path; the error says what would be right.
fn metric(path: &str) -> Result<&'static MetricPath, String> {
    match MetricPath::find(path) {
        Some(m) if kept(path) => Ok(m),
        Some(_) => Err(format!("`{path}` isn't kept of trials: it is about the computer, or about pictures")),
        None => Err(match diagnostic::nearest(path, MetricPath::all().iter().map(|m| m.path.as_str())) {
            Some(near) => format!("no metric `{path}`: did you mean `{near}`?"),
            None => format!("no metric `{path}`: the metrics are explained in GUIDE.md"),
        }),
    }
}

/// A figure or a rate.
#[derive(Clone, Debug, PartialEq)]
pub enum Quantity {
    /// A figure of each trial.
    Metric(&'static MetricPath),
    /// Whether each trial meets a condition.
    Rate(Rate),
}

impl Quantity {
    /// By its name: a figure's path, or `rate.NAME`.
    pub(super) fn parse(name: &str, rates: &[Rate]) -> Result<Self, String> {
        let Some(rate) = name.strip_prefix("rate.") else { return Ok(Quantity::Metric(metric(name)?)) };
        match rates.iter().find(|r| r.name == rate) {
            Some(found) => Ok(Quantity::Rate(found.clone())),
            None => Err(match diagnostic::nearest(rate, rates.iter().map(|r| r.name.as_str())) {
                Some(near) => format!("no rate `{rate}`: did you mean `rate.{near}`?"),
                None => format!("no rate `{rate}`: [rate] should say what it is"),
            }),
        }
    }

    /// Its name in files.
    pub fn name(&self) -> String {
        match self {
            Quantity::Metric(m) => m.path.clone(),
            Quantity::Rate(r) => format!("rate.{}", r.name),
        }
    }

    /// What it says, for people.
    pub fn meaning(&self) -> String {
        match self {
            Quantity::Metric(m) => m.meaning.clone(),
            Quantity::Rate(r) if r.words.is_empty() => "Share of trials that could be done".into(),
            Quantity::Rate(r) => format!("Share of trials with {}", r.words),
        }
    }

    /// Its name and unit, as an axis has them.
    pub fn label(&self) -> String {
        match self {
            Quantity::Metric(m) if !m.unit.is_empty() => format!("{}, {}", m.path, m.unit),
            other => other.name(),
        }
    }

    /// Its value in a trial; `None` where a figure is absent.
    pub(super) fn value(&self, row: &Row) -> Option<f64> {
        match self {
            Quantity::Metric(m) => row.metrics.get(&m.path).copied(),
            Quantity::Rate(r) => Some(f64::from(u8::from(r.is_met(row)))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_are_read_and_mistakes_named() {
        let met = |words: &str, x: f64| {
            let row = Row { metrics: [("line.coverage".to_string(), x)].into(), ..Row::default() };
            Rate::parse("r", words).unwrap().is_met(&row)
        };
        assert!(met("line.coverage >= 0.99", 0.99) && !met("line.coverage > 0.99", 0.99));
        assert!(met("line.coverage<=1", 1.0) && !met("line.coverage < 1", 1.0));
        assert!(!met("line.excess >= 0", 1.0), "an absent figure meets nothing");
        for (words, part) in [
            ("line.coverag >= 1", "did you mean `line.coverage`"),
            ("line.coverage = 1", "should be a figure"),
            ("line.coverage >= x", "should be a figure"),
            ("line.coverage >= inf", "should be a figure"),
            ("sim.wall_s <= 3", "isn't kept"),
        ] {
            assert!(Rate::parse("r", words).unwrap_err().contains(part), "{words}");
        }
    }
}
