//! What is to be drawn: pictures ([`picture`], [`art`]), vector files and recordings ([`drawing`]) become strokes on a sheet, in a good order ([`tour`]).
//! A part of Calamus: use it through the crate `calamus`.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod art;
pub mod drawing;
pub mod picture;
pub mod tour;

// rooms below, by the paths that they have in every part
pub(crate) use calamus_geometry::{files, math};
