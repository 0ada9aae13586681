//! The true base: wheels that hold the floor and slip on it, springs, and base and arm as one chain of bodies.
mod drive;
mod floating;
mod localiser;
mod mobile;
mod undercarriage;
mod wheel;

#[cfg(test)]
mod tests;

pub use drive::{BaseSetup, DriveState, Driven};
pub use localiser::{Localiser, LocaliserKind, LocaliserOptions};
pub use mobile::MobilePlant;
pub use undercarriage::Undercarriage;
pub use wheel::{Wheel, WheelCommand};
