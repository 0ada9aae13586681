//! Ink: pen contact to ink trace, ink trace to picture.

mod trace;

pub use trace::{InkPoint, InkStroke, InkTrace, StrokeId, TraceInk};
