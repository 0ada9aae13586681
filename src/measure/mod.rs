//! Figures of a run: from the drawn ink and the recorded force, never from the plan.

mod line;
mod segments;

pub use line::{LineFit, line_fit};
