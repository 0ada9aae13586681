//! What an arm has felt at its pen.
use nalgebra::{Point3, Vector3};

use crate::drawing::StrokeId;
use crate::plan::SegmentKind;

/// A touch as the robot knows of it: where its own kinematics put the tip, and what its force sensor tells.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Felt {
    /// Time, s.
    pub time: f64,
    /// What the plan was doing.
    pub kind: SegmentKind,
    /// Stroke at the time.
    pub stroke: Option<StrokeId>,
    /// The pen's tip by the measured joints, m, world.
    pub tip: Point3<f64>,
    /// The pen's axis, unit, world; it points out of the tip.
    pub axis: Vector3<f64>,
    /// Force that pushes the pen back along its axis, N.
    pub force: f64,
}
