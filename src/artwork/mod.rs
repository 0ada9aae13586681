//! The drawing of a run: read, generated or made from a picture; and what it would look like.

mod error;
mod make;
mod pens;
mod picture_art;
mod preview;

pub use error::ArtworkError;

pub(crate) use make::{Made, make};
pub(crate) use pens::pens;
pub(crate) use preview::{Likenesses, desired_trace, estimated_time};
