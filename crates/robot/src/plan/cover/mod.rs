//! Where a base has to stand so that its arm draws all of a wall, and which strokes are drawn from where.
//!
//! The problem is that of section VII.A of the dissertation. The default method doesn't follow the one there: it asks the arm's
//! reach in space, over the ink alone, and solves the cover exactly (`sweep`); that one is in `circles`, to compare.

mod candidates;
mod circles;
mod cutting;
mod drive;
mod error;
mod floor;
mod ink;
mod options;
mod pen_reach;
mod place;
mod raise;
mod solve;
mod sweep;
mod union;
mod verify;

pub use error::CoverError;
pub use floor::outlines;
pub use options::{BasePose, CoverMethod, CoverOptions};
pub use pen_reach::PenReach;
pub use place::{Coverage, Cut, CutKind, Piece, Place, turned_round};
pub use solve::{CoverJob, MapMaker, cover};
