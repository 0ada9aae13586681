//! The drawing of a run: read, generated or made from a picture; and what it would look like.

mod error;
mod make;
mod part;
mod pens;
mod picture_art;
mod preview;

pub use error::ArtworkError;
pub use part::{Part, PartError};

pub use make::{Made, make};
pub(crate) use pens::pens;
pub(crate) use preview::{Likenesses, desired_trace, estimated_time, pen_change_time};
