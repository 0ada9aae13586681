//! Layered depth painting: what a picture shows where and how near it is, and strokes in the order of that.
//!
//! [`Semantics`] come from files, from models (feature `onnx`), or from [`estimate`]; [`layered_depth`] paints by them.

mod canvas;
mod contour;
mod error;
mod estimate;
mod form;
mod layered;
#[cfg(feature = "onnx")]
mod onnx;
mod options;
mod painter;
mod plates;
mod regions;
mod semantics;
mod superpixels;
mod trace;

pub use error::SemanticsError;
pub use estimate::estimate;
pub use layered::layered_depth;
#[cfg(feature = "onnx")]
pub use onnx::{ModelOptions, depth_from_model, labels_from_model};
pub use options::LayeredOptions;
pub use semantics::{Kind, MAX_SEGMENTS, Segment, Semantics};
pub use superpixels::{SlicOptions, Superpixel, Superpixels, slic};
