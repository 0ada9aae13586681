//! Calamus: a physics-simulation digital twin of a robotic pen-drawing system.
//!
//! A picture ([`picture`], [`art`]), a vector file or a recording becomes pen strokes on a sheet ([`drawing`]), the strokes
//! are laid on a believed canvas ([`surface`]), an arm is planned along them ([`plan`]), a simulated arm draws them on the true
//! canvas under Cartesian impedance control ([`twin`], [`control`]), and ink appears where the pen presses ([`ink`]). Pictures
//! ([`render`]), figures ([`measure`]) and files ([`report`]) are made from what was drawn, never from the plan.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

// Three crates, so that a change is compiled again only where it matters and from there up; one set of paths.
pub use calamus_robots::{control, ink, measure, plan, robot, tool, twin};
pub use calamus_strokes::{art, config, drawing, math, mesh, picture, scan, surface, tour};

pub mod experiment;
pub mod render;
pub mod report;
pub mod run;
pub mod scenario;

pub mod cli;
