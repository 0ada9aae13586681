//! A drawing on a believed surface and a robot, to timed joint motion.

mod ik;
mod options;
mod segment;
mod spline;
mod trajectory;

pub use ik::{AXIS_TOLERANCE, IkFailure, IkSolution, IkSolver, POSITION_TOLERANCE, PenTarget, Posture, dexterity};
pub use options::{MotionLimits, PlanOptions};
pub use segment::{ArmPlan, Plan, Segment, SegmentKind};
pub use spline::{JointSpline, SplinePoint};
pub use trajectory::{Knot, MotionSample, Trajectory};

#[cfg(test)]
mod arms;
