//! Values of an experiment: fixed, spread over a range, or drawn for each trial.
use std::collections::BTreeMap;

use rand_chacha::ChaCha8Rng;
use serde_json::{Map, Value};

use crate::diagnostic;
use crate::math::unit;

/// Names of the distributions.
const DISTRIBUTIONS: [&str; 5] = ["uniform", "normal", "log_uniform", "integer", "choice"];
/// Most steps of a range.
const MOST_STEPS: u64 = 10_000;

/// A random value.
#[derive(Clone, Debug, PartialEq)]
pub enum Distribution {
    /// Evenly from the first to the second.
    Uniform(f64, f64),
    /// Gaussian of mean and standard deviation.
    Normal(f64, f64),
    /// Evenly in the logarithm from the first to the second.
    LogUniform(f64, f64),
    /// A whole number from the first to the second, both included.
    Integer(i64, i64),
    /// Any of these, all as likely.
    Choice(Vec<Value>),
}

impl Distribution {
    /// The next value of `rng`.
    fn draw(&self, rng: &mut ChaCha8Rng) -> Value {
        match self {
            Distribution::Uniform(low, high) => (low + (high - low) * unit(rng)).into(),
            // Box and Muller (doi:10.1214/aoms/1177706645); 1 - u is never 0
            Distribution::Normal(mean, sd) => {
                let radius = (-2.0 * (1.0 - unit(rng)).ln()).sqrt();
                (mean + sd * radius * (std::f64::consts::TAU * unit(rng)).cos()).into()
            }
            Distribution::LogUniform(low, high) => (low.ln() + (high.ln() - low.ln()) * unit(rng)).exp().into(),
            Distribution::Integer(low, high) => {
                let count = (high - low + 1) as f64;
                (low + ((unit(rng) * count) as i64).min(high - low)).into()
            }
            Distribution::Choice(values) => {
                let at = (unit(rng) * values.len() as f64) as usize;
                values.get(at).cloned().unwrap_or(Value::Null)
            }
        }
    }

    fn parse(name: &str, value: &Value) -> Result<Self, String> {
        let pair = |meaning: &str| {
            let wrong = || format!("`{name}` takes two numbers, {meaning}");
            let [a, b] = value.as_array().map_or(&[][..], Vec::as_slice) else { return Err(wrong()) };
            a.as_f64().zip(b.as_f64()).ok_or_else(wrong)
        };
        match name {
            "choice" => match value.as_array() {
                Some(values) if !values.is_empty() => Ok(Distribution::Choice(values.clone())),
                _ => Err("`choice` takes a list of values".into()),
            },
            "integer" => {
                const MOST: i64 = 1 << 40;
                let whole = |v: &Value| v.as_i64().filter(|x| x.abs() <= MOST);
                match value.as_array().map_or(&[][..], Vec::as_slice) {
                    [a, b] => match whole(a).zip(whole(b)) {
                        Some((low, high)) if low <= high => Ok(Distribution::Integer(low, high)),
                        Some((low, high)) => Err(format!("`integer` goes from low to high, not from {low} to {high}")),
                        None => Err("`integer` takes two whole numbers, [low, high]".into()),
                    },
                    _ => Err("`integer` takes two whole numbers, [low, high]".into()),
                }
            }
            "normal" => {
                let (mean, sd) = pair("[mean, standard deviation]")?;
                if sd < 0.0 {
                    return Err(format!("a standard deviation can't be below 0, as {sd} is"));
                }
                Ok(Distribution::Normal(mean, sd))
            }
            _ => {
                let (low, high) = pair("[low, high]")?;
                if low > high {
                    return Err(format!("`{name}` goes from low to high, not from {low} to {high}"));
                }
                match name {
                    "uniform" => Ok(Distribution::Uniform(low, high)),
                    _ if low > 0.0 => Ok(Distribution::LogUniform(low, high)),
                    _ => Err(format!("`log_uniform` is for numbers above 0, not {low}")),
                }
            }
        }
    }
}

/// A value in which parts may be drawn for each trial.
#[derive(Clone, Debug, PartialEq)]
pub enum Template {
    /// As it stands.
    Fixed(Value),
    /// Sampled from a distribution.
    Sampled(Distribution),
    /// A list of which an item is drawn.
    List(Vec<Template>),
    /// A table of which a value is drawn.
    Table(BTreeMap<String, Template>),
}

impl Template {
    /// Reads a value; the error says what is wrong with it and what would be right.
    pub(super) fn parse(value: &Value) -> Result<Self, String> {
        let template = match value {
            Value::Null => return Err("must be a finite number".into()),
            Value::Array(items) => Template::List(items.iter().map(Self::parse).collect::<Result<_, _>>()?),
            Value::Object(table) => match distribution(table)? {
                Some(drawn) => return Ok(Template::Sampled(drawn)),
                None => {
                    let entries = table.iter().map(|(k, v)| Ok((k.clone(), Self::parse(v)?)));
                    Template::Table(entries.collect::<Result<_, String>>()?)
                }
            },
            plain => return Ok(Template::Fixed(plain.clone())),
        };
        Ok(if template.is_drawn() { template } else { Template::Fixed(value.clone()) })
    }

    /// Whether any of it is drawn.
    fn is_drawn(&self) -> bool {
        match self {
            Template::Fixed(_) => false,
            Template::Sampled(_) => true,
            Template::List(items) => items.iter().any(Template::is_drawn),
            Template::Table(entries) => entries.values().any(Template::is_drawn),
        }
    }

    /// The value of one trial. `stream` gives the random stream of each name; what is drawn is added to `draws` under its name:
    /// `key`, or `key[2]` and `key.name` inside.
    pub(super) fn draw(
        &self,
        name: &str,
        stream: &dyn Fn(&str) -> ChaCha8Rng,
        draws: &mut BTreeMap<String, Value>,
    ) -> Value {
        match self {
            Template::Fixed(value) => value.clone(),
            Template::Sampled(distribution) => {
                let value = distribution.draw(&mut stream(name));
                draws.insert(name.to_string(), value.clone());
                value
            }
            Template::List(items) => {
                let item = |(i, t): (usize, &Template)| t.draw(&format!("{name}[{i}]"), stream, draws);
                items.iter().enumerate().map(item).collect()
            }
            Template::Table(entries) => {
                let entry = |(k, t): (&String, &Template)| (k.clone(), t.draw(&format!("{name}.{k}"), stream, draws));
                Value::Object(entries.iter().map(entry).collect())
            }
        }
    }
}

/// The distribution that a table is, if it is one.
fn distribution(table: &Map<String, Value>) -> Result<Option<Distribution>, String> {
    for (key, value) in table {
        if DISTRIBUTIONS.contains(&key.as_str()) {
            if table.len() > 1 {
                return Err(format!("`{key}` is a distribution by itself: nothing stands beside it"));
            }
            return Distribution::parse(key, value).map(Some);
        }
    }
    // a misspelt one would else be taken for a table of settings
    match table.iter().next() {
        Some((key, Value::Array(_))) if table.len() == 1 => match diagnostic::nearest(key, DISTRIBUTIONS) {
            Some(near) => Err(format!("no distribution `{key}`: did you mean `{near}`?")),
            None => Ok(None),
        },
        _ => Ok(None),
    }
}

/// Whether a table is a distribution or a range: what a search for settings in tables stops at.
pub(super) fn is_spread(table: &Map<String, Value>) -> bool {
    table.contains_key("from") || table.contains_key("steps") || !matches!(distribution(table), Ok(None))
}

/// The values of an axis: a list, or `{ from, to, steps }`. `None` where the value is neither.
pub(super) fn axis(value: &Value) -> Result<Option<Vec<Value>>, String> {
    match value {
        Value::Array(values) if values.is_empty() => Err("an axis needs values".into()),
        Value::Array(values) => {
            if values.iter().any(|v| v.is_null()) {
                return Err("must be finite numbers".into());
            }
            if let Some(twice) = values.iter().enumerate().find(|(i, v)| values[..*i].contains(v)) {
                return Err(format!("has the value {} twice", twice.1));
            }
            Ok(Some(values.clone()))
        }
        Value::Object(table) if table.contains_key("from") || table.contains_key("steps") => range(table).map(Some),
        _ => Ok(None),
    }
}

fn range(table: &Map<String, Value>) -> Result<Vec<Value>, String> {
    if let Some(other) = table.keys().find(|k| !["from", "to", "steps"].contains(&k.as_str())) {
        return Err(format!("unknown key `{other}`: a range is {{ from, to, steps }}"));
    }
    let number = |key: &str| {
        let value = table.get(key).ok_or_else(|| format!("a range {{ from, to, steps }} needs `{key}`"))?;
        value.as_f64().ok_or_else(|| format!("`{key}` must be a finite number"))
    };
    let (from, to, _) = (number("from")?, number("to")?, number("steps")?);
    let steps = table["steps"].as_u64().filter(|n| (2..=MOST_STEPS).contains(n));
    let steps = steps.ok_or_else(|| format!("`steps` counts the values, 2 to {MOST_STEPS}"))?;
    if from == to {
        return Err("a range goes from one number to another".into());
    }
    let values: Vec<f64> = (0..steps).map(|i| from + (to - from) * i as f64 / (steps - 1) as f64).collect();
    // whole numbers stay whole where the file has whole ones: a count of squares can be a range
    let whole = table["from"].is_i64() && table["to"].is_i64() && values.iter().all(|x| x.fract() == 0.0);
    Ok(values.into_iter().map(|x| if whole { (x as i64).into() } else { x.into() }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{stats, stream};
    use serde_json::json;

    fn draws(value: Value, n: u64) -> Vec<f64> {
        let template = Template::parse(&value).unwrap();
        let one = |i| template.draw("x", &|name| stream(1, name, i), &mut BTreeMap::new()).as_f64().unwrap();
        (0..n).map(one).collect()
    }

    #[test]
    fn distributions_have_their_moments() {
        let moments = |x: Vec<f64>| {
            let mut r = stats::Running::default();
            x.iter().for_each(|v| r.push(*v));
            (r.mean, r.sd())
        };
        let (mean, sd) = moments(draws(json!({"uniform": [2, 6]}), 4000));
        assert!((mean - 4.0).abs() < 0.08 && (sd - 4.0 / 12f64.sqrt()).abs() < 0.05, "{mean} {sd}");
        let (mean, sd) = moments(draws(json!({"normal": [-1, 0.5]}), 4000));
        assert!((mean + 1.0).abs() < 0.04 && (sd - 0.5).abs() < 0.03, "{mean} {sd}");
        let logs = draws(json!({"log_uniform": [1e-3, 1e3]}), 4000).iter().map(|x| x.log10()).collect();
        let (mean, sd) = moments(logs);
        assert!(mean.abs() < 0.15 && (sd - 6.0 / 12f64.sqrt()).abs() < 0.08, "{mean} {sd}");
        let whole = draws(json!({"integer": [3, 5]}), 4000);
        assert!(whole.iter().all(|x| [3.0, 4.0, 5.0].contains(x)));
        let (mean, sd) = moments(whole);
        assert!((mean - 4.0).abs() < 0.05 && (sd - (2f64 / 3.0).sqrt()).abs() < 0.03, "{mean} {sd}");
        let (mean, _) = moments(draws(json!({"choice": [0, 1, 5]}), 4000));
        assert!((mean - 2.0).abs() < 0.15, "{mean}");
    }

    #[test]
    fn parts_are_drawn_by_themselves_and_named() {
        let template = Template::parse(&json!([1, {"uniform": [0, 1]}, {"uniform": [0, 1]}])).unwrap();
        let mut drawn = BTreeMap::new();
        let value = template.draw("k", &|name| stream(1, name, 0), &mut drawn);
        assert_eq!(drawn.keys().collect::<Vec<_>>(), ["k[1]", "k[2]"]);
        assert_eq!((value[0].clone(), value[1].clone()), (json!(1), drawn["k[1]"].clone()));
        assert_ne!(value[1], value[2]);
        assert_eq!(Template::parse(&json!([1, 2])).unwrap(), Template::Fixed(json!([1, 2])));
    }

    #[test]
    fn ranges_reach_both_ends_and_keep_whole_numbers() {
        assert_eq!(axis(&json!({"from": 1, "to": 5, "steps": 3})).unwrap(), Some(vec![json!(1), json!(3), json!(5)]));
        let values = axis(&json!({"from": 0.0, "to": 0.3, "steps": 4})).unwrap().unwrap();
        assert_eq!(values[3], json!(0.3));
        assert_eq!(axis(&json!({"uniform": [0, 1]})).unwrap(), None);
    }

    #[test]
    fn mistakes_are_named() {
        let wrong = |v: Value| Template::parse(&v).unwrap_err();
        assert_eq!(wrong(json!({"unifrom": [1, 2]})), "no distribution `unifrom`: did you mean `uniform`?");
        assert!(wrong(json!({"uniform": [2, 1]})).contains("from low to high"));
        assert!(wrong(json!({"log_uniform": [0, 1]})).contains("above 0"));
        assert!(wrong(json!({"normal": [0, -1]})).contains("below 0"));
        assert!(wrong(json!({"normal": [0]})).contains("two numbers"));
        assert!(wrong(json!({"integer": [0, 1.5]})).contains("whole"));
        assert!(wrong(json!({"integer": [2, 1]})).contains("from low to high"));
        assert!(wrong(json!({"choice": []})).contains("list"));
        for (value, words) in [
            (json!([]), "needs values"),
            (json!([1, 2, 1]), "twice"),
            (json!({"from": 1, "to": 2}), "needs `steps`"),
            (json!({"from": 1, "to": 2, "steps": 1}), "2 to"),
            (json!({"from": 1, "to": 1, "steps": 2}), "one number to another"),
            (json!({"from": 1, "to": 2, "steps": 2, "by": 1}), "`by`"),
        ] {
            assert!(axis(&value).unwrap_err().contains(words), "{value}");
        }
    }
}
