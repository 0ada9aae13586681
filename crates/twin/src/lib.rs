//! What is true: the canvas as it is ([`truth`]), what a camera sees of it ([`camera`]), the physics of arms and hands ([`twin`]), and the ink that they leave
//! ([`ink`]). A part of Calamus: use it through the crate `calamus`.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod camera;
pub mod ink;
pub mod truth;
pub mod twin;

// rooms below, by the paths that they have in every part
pub(crate) use calamus_drawing::{drawing, picture};
pub(crate) use calamus_geometry::{math, mesh};
pub(crate) use calamus_robot::{control, pen, plan, reconstruct, robot, skill, surface, tool};
