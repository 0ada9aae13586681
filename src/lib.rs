//! Calamus: a physics-simulation digital twin of a robotic pen-drawing system.
//!
//! A picture ([`picture`], [`art`]), a vector file or a recording becomes pen strokes on a sheet ([`drawing`]), the strokes
//! are laid on a believed canvas ([`surface`]), an arm is planned along them ([`plan`]), a simulated arm draws them on the true
//! canvas under Cartesian impedance control ([`twin`], [`control`]), and ink appears where the pen presses ([`ink`]). Pictures
//! ([`render`]), figures ([`measure`]) and files ([`report`]) are made from what was drawn, never from the plan.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

// A crate for each concept: what is known and what is true can't be mixed up. One set of paths.
pub use calamus_drawing::{art, drawing, picture, tour};
pub use calamus_geometry::{diagnostic, files, math, mesh};
pub use calamus_robot::{control, pen, plan, reconstruct, robot, skill, surface, tool};
pub use calamus_twin::{camera, ink, truth, twin};

pub mod artwork;
pub mod canvas;
pub mod cover;
pub mod exec;
pub mod experiment;
pub mod inputs;
pub mod measure;
pub mod progress;
pub mod reach;
pub mod render;
pub mod report;
pub mod run;
pub mod scenario;
pub mod verdict;

pub mod cli;
