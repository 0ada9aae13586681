//! Poses, rotation logarithms, statistics, seeds and digests: what every other room may use.

mod color;
mod digest;
mod pose;
mod seed;
pub mod stats;

pub use color::Rgb;
pub use digest::Digest;
pub use pose::{Pose, frame_from_axes, rotation_vector};
pub use seed::stream;
