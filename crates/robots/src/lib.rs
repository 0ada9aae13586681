//! Who draws: robots and their plans ([`robot`], [`plan`]), their control ([`control`]), pens and their holders ([`ink`], [`tool`]), and the physics of all of
//! them ([`twin`]). A part of Calamus: use it through the crate `calamus`.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod control;
pub mod ink;
pub mod plan;
pub mod robot;
pub mod tool;
pub mod twin;

// rooms below, by the paths that they have in every part
pub(crate) use calamus_strokes::{config, math, mesh, picture, surface};
