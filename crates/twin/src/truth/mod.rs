//! The canvas as it is, and how it differs from the nominal one.

mod canvas;
mod carried;
mod perturbed;

pub use canvas::TrueCanvas;
pub use carried::Carried;
pub use perturbed::{PlankKind, TruthError, TruthOptions, TruthReport, perturb, unshaped};
