//! The stages of a tool change, and how one fails.

/// What is desired.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Order {
    /// Take the tool out of its dock.
    Pick,
    /// Put the tool back.
    Return,
}

/// Where a tool change is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Stage {
    /// Open hand, from before the dock to round the tool.
    Approach,
    /// Fingers nearly close on the flat sides: turns the tool's yaw.
    HalfGrasp,
    /// Straight up: the plates settle on the fingers and level the tool.
    Lift,
    /// Fingers wrap round the bevels and press the back against the palm.
    FullGrasp,
    /// Down, until the nose is in the guide.
    Lower,
    /// Fingers let go of the bevels.
    HalfRelease,
    /// Down, until the nose stands in its seat and the plates are off the fingers.
    Seat,
    /// Fingers open.
    Release,
    /// Back off.
    Retreat,
}

/// Why a stage failed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ChangeError {
    /// The wrist felt more than it may.
    #[error("{stage:?}: {force:.1} N or {torque:.2} N m at the wrist, more than {force_limit} N or {torque_limit} N m")]
    Collision {
        /// The stage.
        stage: Stage,
        /// Force, N.
        force: f64,
        /// Torque, N m.
        torque: f64,
        /// Largest force, N.
        force_limit: f64,
        /// Largest torque, N m.
        torque_limit: f64,
    },
    /// Fingers didn't come to where the tool would let them.
    #[error("{stage:?}: a finger stands at {angle:.3} rad, expected {low:.3} to {high:.3}")]
    Fingers {
        /// The stage.
        stage: Stage,
        /// The joint that is farthest off, rad.
        angle: f64,
        /// Lower bound, rad.
        low: f64,
        /// Upper bound, rad.
        high: f64,
    },
    /// The wrist carries too little or too much.
    #[error("{stage:?}: the wrist carries {load:.2} N, expected {low:.2} to {high:.2}")]
    Load {
        /// The stage.
        stage: Stage,
        /// What it carries beyond the hand, N.
        load: f64,
        /// Lower bound, N.
        low: f64,
        /// Upper bound, N.
        high: f64,
    },
    /// The lowered pen can be moved sideways: it isn't in its dock.
    #[error("{stage:?}: {force:.2} N when pushed sideways, expected the dock's wall to hold with {least:.2} N")]
    NoWall {
        /// The stage.
        stage: Stage,
        /// Force against the push, N.
        force: f64,
        /// Least force, N.
        least: f64,
    },
}

impl ChangeError {
    /// The stage that failed.
    pub fn stage(&self) -> Stage {
        match self {
            Self::Collision { stage, .. }
            | Self::Fingers { stage, .. }
            | Self::Load { stage, .. }
            | Self::NoWall { stage, .. } => *stage,
        }
    }
}
