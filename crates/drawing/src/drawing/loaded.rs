//! A drawing that was read, and what of its artwork it doesn't show.
use super::Drawing;

/// A drawing and what of its artwork could not be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The drawing.
    pub drawing: Drawing,
    /// What was left out or changed, in a fixed order; empty when everything is drawn as the artwork shows it.
    pub warnings: Vec<Warning>,
}

/// Something of the artwork that is not drawn, or not as the artwork shows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// 1-based line of the first such place, where one is known.
    pub line: Option<usize>,
    /// What, how often, and what to do about it.
    pub message: String,
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.line {
            Some(line) => write!(f, "line {line}: {}", self.message),
            None => f.write_str(&self.message),
        }
    }
}
