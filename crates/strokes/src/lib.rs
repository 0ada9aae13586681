//! What is to be drawn, and on what: pictures become strokes ([`picture`], [`art`], [`drawing`], [`tour`]), and strokes are laid on
//! canvases ([`mesh`], [`surface`], [`scan`]). A part of Calamus: use it through the crate `calamus`.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod art;
pub mod config;
pub mod drawing;
pub mod math;
pub mod mesh;
pub mod picture;
pub mod scan;
pub mod surface;
pub mod tour;
