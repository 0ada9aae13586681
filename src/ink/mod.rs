//! Ink: pen contact to ink trace, ink trace to picture.

mod pen;
mod trace;

pub use pen::{NibSpring, PenModel, TipShape};
pub use trace::{InkPoint, InkStroke, InkTrace, StrokeId, TraceInk};
