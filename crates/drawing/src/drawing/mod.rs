//! Drawings: 2D strokes on a sheet, one layer per ink; and what makes them from files and patterns.

mod bezier_fit;
mod clip;
mod encoding;
mod error;
mod hatch;
mod load;
mod loaded;
pub mod pattern;
mod sheet;
mod size;
mod stroke_id;
pub mod stroke_order;
pub mod stroke_text;
pub mod stylus;
mod stylus_clean;
pub mod svg;
mod svg_css;
mod svg_geometry;
mod svg_names;
mod svg_rewrite;
mod svg_selector;
mod svg_shape;
mod svg_survey;
#[cfg(test)]
mod svg_tests;
mod svg_value;
mod svg_walk;
pub mod svg_write;
pub mod tidy;

pub use error::DrawingError;
pub use load::{load, sources};
pub use loaded::{Loaded, Warning};
pub use pattern::{Figure, Pattern};
pub use sheet::{Drawing, InkLayer, Stroke, StrokeRef};
pub use size::Size;
pub use stroke_id::StrokeId;
pub use stylus::StylusOptions;
pub use svg::{Fill, SvgOptions};
pub use tidy::{TidyOptions, TidyReport, tidy};
