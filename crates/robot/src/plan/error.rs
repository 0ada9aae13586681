//! Why there is no plan.
use super::{Obstruction, ReachReport};

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// An option makes no sense.
    #[error("{name} is {value}, but must be {wanted}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// What it is.
        value: f64,
        /// What would be right.
        wanted: &'static str,
    },
    /// A pose that the arm starts from or waits in passes a joint limit.
    #[error("the {pose} pose of {arm} puts joint {joint} at {value:.3}, outside its limits {lower:.3} to {upper:.3}")]
    PoseOutsideLimits {
        /// Name of the arm.
        arm: String,
        /// `home` or `service`.
        pose: &'static str,
        /// Name of the joint.
        joint: String,
        /// Position asked for, rad.
        value: f64,
        /// Lower limit, rad.
        lower: f64,
        /// Upper limit, rad.
        upper: f64,
    },
    /// A pose that the arm starts from or waits in is not free.
    #[error("the {pose} pose of {arm} is not free: {reason}; move the pose, or what stands there")]
    PoseObstructed {
        /// Name of the arm.
        arm: String,
        /// `home` or `service`.
        pose: &'static str,
        /// What is in the way.
        reason: Obstruction,
    },
    /// There is no free way between two poses that must both be taken.
    #[error("no free way for {arm} {leg} was found; move the pose, or what stands between")]
    NoWay {
        /// Name of the arm.
        arm: String,
        /// From where to where.
        leg: &'static str,
    },
    /// Some of the drawing can't be reached.
    #[error("{report}; use partial = true to draw the rest")]
    Unreachable {
        /// All that can't be reached.
        report: Box<ReachReport>,
    },
}
