//! All that needs the whole program, as one binary: it is linked once, and its tests share what they simulate.
mod architecture;
mod cli;
mod cover;
mod determinism;
mod driving;
mod executive;
mod experiments;
mod grasp;
mod guide;
mod physics;
mod pictures;
mod robot_reference;
mod scenarios;
mod support;
mod tools;
mod touch;
mod widths;
