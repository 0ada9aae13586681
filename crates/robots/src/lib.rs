//! Who draws: robots and their plans ([`robot`], [`plan`]), their control ([`control`]), pens ([`ink`]), and the physics of all of
//! them ([`twin`]). A part of Calamus: use it through the crate `calamus`.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod control;
pub mod ink;
pub mod plan;
pub mod robot;
pub mod twin;

// rooms below, by the paths that they have in every part
pub(crate) use calamus_strokes::{config, drawing, math, mesh, picture, surface};
