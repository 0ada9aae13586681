//! Why a patch can't be flattened.
use crate::math::SparseError;

/// Why a patch can't be flattened.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FlatError {
    /// The equations have no solution.
    #[error("the surface can't be flattened: {0}")]
    Solve(#[from] SparseError),
    /// The solution is not finite or has no area.
    #[error("the surface can't be flattened: its triangles are too thin")]
    Collapsed,
    /// Triangles lie turned over in the plane, and smoothing them out didn't help.
    #[error(
        "{flips} of {triangles} triangles lie turned over after flattening: the surface is too crumpled for a flat drawing; a smoother mesh would do"
    )]
    Flips {
        /// How many.
        flips: usize,
        /// Of how many.
        triangles: usize,
    },
}
