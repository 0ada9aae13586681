//! Layered depth painting.
mod canvas;
mod contour;
mod error;
mod estimate;
mod form;
mod lab;
mod layered;
mod majority;
mod plates;
mod regions;
mod semantics;
mod superpixels;
mod trace;

pub use error::SemanticsError;
pub use estimate::estimate;
pub use layered::{LayeredOptions, layered_depth};
pub use semantics::{Kind, MAX_SEGMENTS, Segment, Semantics};
pub use superpixels::{SlicOptions, Superpixel, Superpixels, slic};
