//! Poses, rotation logarithms, statistics, seeds, digests, units in names, plain text and sparse systems: what every other room may use.

mod color;
mod digest;
mod interval;
mod plain_text;
mod pose;
mod seed;
pub mod stats;
mod unit_name;

pub use calamus_sparse::{Cholesky, SparseError};
pub use color::{PAPER, Rgb, SrgbTable, light_of_srgb, linear_from_srgb, srgb_from_linear};
pub use digest::Digest;
pub use interval::{bootstrap_mean, wilson};
pub use plain_text::{exactly, figure, plain, sensible};
pub use pose::{Pose, frame_from_axes, rotation_vector};
pub use seed::{standard_normal, stream, unit};
pub use unit_name::unit_of_name;
