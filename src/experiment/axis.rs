//! An axis of an experiment's grid.
use serde_json::Value;

/// A setting that takes several values.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// The dotted key.
    pub key: String,
    /// Its values, in the file's order.
    pub values: Vec<Value>,
    /// Which component varies, when values are lists that differ in one.
    component: Option<usize>,
}

impl Axis {
    pub(super) fn new(key: &str, values: Vec<Value>) -> Self {
        let component = component(&values);
        Self { key: key.to_string(), values, component }
    }

    /// Its name for people: the key, and which component of it varies, as `control.stiffness_n_m[2]`.
    pub fn label(&self) -> String {
        self.component.map_or_else(|| self.key.clone(), |i| format!("{}[{i}]", self.key))
    }

    /// A value as a number, if every value is one, or is a list that differs from the others in one number.
    pub fn number(&self, index: usize) -> Option<f64> {
        let number = |v: &Value| self.component.map_or(v.as_f64(), |i| v.get(i)?.as_f64());
        self.values.iter().all(|v| number(v).is_some()).then(|| self.values.get(index).and_then(number))?
    }

    /// A value in words.
    pub fn words(&self, index: usize) -> String {
        let value = match (self.values.get(index), self.component) {
            (Some(value), Some(i)) => value.get(i),
            (value, _) => value,
        };
        value.map_or_else(String::new, words)
    }

    /// Whether all its values are numbers above 0.
    pub(super) fn is_positive(&self) -> bool {
        (0..self.values.len()).all(|i| self.number(i).is_some_and(|x| x > 0.0))
    }

    /// Where a value stands on a plot: its number, or its place in the list.
    pub(super) fn place(&self, index: usize) -> f64 {
        self.number(index).unwrap_or(index as f64)
    }
}

/// The one component in which lists of equal length differ.
fn component(values: &[Value]) -> Option<usize> {
    let lists: Vec<&Vec<Value>> = values.iter().filter_map(Value::as_array).collect();
    let first = *lists.first()?;
    if lists.len() < values.len() || lists.iter().any(|l| l.len() != first.len()) {
        return None;
    }
    let mut differing = (0..first.len()).filter(|i| lists.iter().any(|l| l[*i] != first[*i]));
    let one = differing.next()?;
    differing.next().is_none().then_some(one)
}

/// A value for people: text without quotes.
pub(super) fn words(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_string)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn lists_that_differ_in_one_number_are_that_number() {
        let axis = Axis::new("k", vec![json!([1500, 1500, 100]), json!([1500, 1500, 350.5])]);
        assert_eq!((axis.label().as_str(), axis.number(1), axis.words(0).as_str()), ("k[2]", Some(350.5), "100"));
        let both = Axis::new("k", vec![json!([1, 2]), json!([3, 4])]);
        assert_eq!((both.label().as_str(), both.number(0), both.words(1).as_str()), ("k", None, "[3,4]"));
        let text = Axis::new("pen.kind", vec![json!("marker"), json!("felt_tip")]);
        assert_eq!((text.number(0), text.place(1), text.words(1).as_str()), (None, 1.0, "felt_tip"));
    }
}
