//! Calamus: a physics-simulation digital twin of a robotic pen-drawing system.
//!
//! A picture ([`picture`], [`art`]), a vector file or a recording becomes pen strokes on a sheet ([`drawing`]), the strokes
//! are laid on a believed canvas ([`surface`]), an arm is planned along them ([`plan`]), a simulated arm draws them on the true
//! canvas under Cartesian impedance control ([`twin`], [`control`]), and ink appears where the pen presses ([`ink`]). Pictures
//! ([`render`]), figures ([`measure`]) and files ([`report`]) are made from what was drawn, never from the plan.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod art;
pub mod config;
pub mod control;
pub mod drawing;
pub mod experiment;
pub mod ink;
pub mod math;
pub mod measure;
pub mod mesh;
pub mod picture;
pub mod plan;
pub mod render;
pub mod report;
pub mod robot;
pub mod run;
pub mod scan;
pub mod scenario;
pub mod surface;
pub mod tool;
pub mod tour;
pub mod twin;

pub mod cli;
