//! The true base: wheels that hold the floor and slip on it, springs, and base and arm as one chain of bodies.
mod drive;
mod floating;
mod mobile;
mod undercarriage;
mod wheel;

#[cfg(test)]
mod tests;

pub(crate) use drive::DriveState;
pub use mobile::MobilePlant;
pub use undercarriage::Undercarriage;
pub use wheel::{Wheel, WheelCommand};
