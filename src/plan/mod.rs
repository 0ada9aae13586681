//! A drawing on a believed surface and a robot, to timed joint motion.

mod segment;
mod trajectory;

pub use segment::{ArmPlan, Plan, Segment, SegmentKind};
pub use trajectory::{Knot, MotionSample, Trajectory};
