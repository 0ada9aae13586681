//! What a hand is commanded to do.

/// First joints of an open hand, rad: a little off the stop, so that the stop's row stays quiet.
pub const OPEN: f64 = 0.054;

/// How the two scissored fingers stand (the gripper's register rMOD).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum GraspMode {
    /// Side by side.
    #[default]
    Basic,
    /// Tips together, for small things.
    Pinch,
    /// Spread, for round or large things.
    Wide,
    /// The two fingers close on each other sideways; the command's `close` moves them, and all bend no more than open.
    Scissor,
}

/// What the hand is to do: where its motors pull, how strongly and how fast.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct HandCommand {
    /// How the fingers stand.
    pub mode: GraspMode,
    /// Angle of the first joints, rad (70 degrees is closed); the distal phalanges turn back by as much.
    pub close: f64,
    /// Angle of the second joints, rad: 0 until the fingers wrap.
    pub wrap: f64,
    /// Grip force at a fingertip, N: 15 to 70 on the real hand.
    pub force: f64,
    /// Speed of a fingertip, m/s: 0.022 to 0.110 on the real hand.
    pub speed: f64,
}

impl HandCommand {
    /// Fingers open, at half speed.
    pub fn open() -> Self {
        Self { mode: GraspMode::Basic, close: OPEN, wrap: 0.0, force: 30.0, speed: 0.066 }
    }
}
