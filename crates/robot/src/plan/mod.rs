//! A drawing on a believed surface and a robot, to timed joint motion.

mod assembly;
pub mod cover;
mod depth;
mod error;
mod field;
mod ik;
mod motion;
mod options;
mod path;
mod planner;
mod reach;
mod reach_grid;
mod reachability;
mod rectangle;
mod redundancy;
mod sag;
mod schedule;
mod segment;
mod separation;
mod spline;
mod stepwise;
mod stroke;
mod surroundings;
mod timing;
mod trajectory;
mod visit_order;
mod waypoint;
mod zone;

pub use assembly::PlanStatistics;
pub use depth::{DepthProfile, DepthSample, PressDepths};
pub use error::PlanError;
pub use ik::{AXIS_TOLERANCE, IkFailure, IkSolution, IkSolver, POSITION_TOLERANCE, PenTarget, Posture, dexterity};
pub use options::{MotionLimits, PlanOptions};
pub use planner::{PlanJob, Planned, plan};
pub use reach::{Obstruction, ReachReport, Unreachable};
pub use reach_grid::{GridError, MOST_NODES, ReachGrid};
pub use reachability::{Reach, ReachMap, ReachProbe};
pub use rectangle::{Mask, Slice, largest, slices};
pub use sag::{HandStiffness, SagModel};
pub use schedule::{Piece, Schedule, Turn, schedule};
pub use segment::{ArmPlan, Plan, Segment, SegmentKind};
pub use separation::{Motion, Nearest, nearest};
pub use spline::{JointSpline, SplinePoint};
pub use stepwise::{Descent, DrawnPiece, StepPlanner};
pub use surroundings::{Clearance, CollisionPair, PenUse, Surroundings};
pub use trajectory::{Knot, MotionPeaks, MotionSample, Trajectory};
pub use visit_order::VisitOrder;
pub use zone::{Space, Sweep, Zone};

#[cfg(test)]
mod arms;
#[cfg(test)]
mod drawing_tests;
