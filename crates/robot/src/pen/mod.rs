//! Pens: what a robot knows of them. What one does under its hand is in `docs/ink.md`.

mod layer;
mod model;

pub use layer::LayerPen;
pub use model::{Drying, NibSpring, PenModel, TipShape};
