//! Ink: pen contact to ink trace, ink trace to picture.
//!
//! A [`PenModel`](crate::pen::PenModel) says what a nib does, an [`InkRecorder`] turns contact into an [`InkTrace`] step by step, and [`rasterise`]
//! makes a flat picture of the trace. `docs/ink.md` holds the formulas and where they come from.

mod error;
pub mod optics;
mod raster;
mod raster_options;
mod recorder;
mod segment;
mod tile;
mod trace;

pub use error::InkError;
pub use raster::rasterise;
pub use raster_options::RasterOptions;
pub use recorder::{InkRecorder, NibContact, PenState};
pub use trace::{InkPoint, InkStroke, InkTrace, TraceInk};
