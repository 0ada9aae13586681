//! Who draws: robots and their plans ([`robot`], [`plan`]), their control ([`control`]), pens and their holders ([`ink`], [`tool`]), the physics of all of
//! them ([`twin`]), and figures of what they drew ([`measure`]). A part of Calamus: use it through the crate `calamus`.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod control;
pub mod ink;
pub mod measure;
pub mod plan;
pub mod robot;
pub mod tool;
pub mod twin;

// rooms below, by the paths that they have in every part
pub(crate) use calamus_strokes::{config, drawing, math, mesh, picture, surface};
