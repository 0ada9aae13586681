//! Drawings: 2D strokes on a sheet, one layer per ink; and what makes them from files and patterns.

mod sheet;

pub use sheet::{Drawing, InkLayer, Stroke};
