//! What a robot knows and decides: the canvas as it believes it to be ([`surface`], [`reconstruct`]), itself ([`robot`]), its pens and their holders ([`pen`],
//! [`tool`]), its plans ([`plan`]), its control ([`control`]), and what it does with its hand ([`skill`]). Nothing here knows what is true. A part of
//! Calamus: use it through the crate `calamus`.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod control;
pub mod pen;
pub mod plan;
pub mod reconstruct;
pub mod robot;
pub mod skill;
pub mod surface;
pub mod tool;

// rooms below, by the paths that they have in every part
pub(crate) use calamus_drawing::drawing;
pub(crate) use calamus_geometry::{diagnostic, files, math, mesh};
