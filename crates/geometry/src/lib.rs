//! Where things are and what shape they have: poses, statistics and seeds ([`math`]), triangle meshes ([`mesh`]), the files that are
//! read ([`files`]), and what a user is told of a file that
//! isn't right ([`diagnostic`]). A part of Calamus: use it through the crate `calamus`.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod diagnostic;
pub mod files;
pub mod math;
pub mod mesh;
