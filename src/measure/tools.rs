//! Figures of tool changes: contract of metrics.json.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Tool changes by grippers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ToolMetrics {
    /// Pens fetched or brought back by the robot.
    pub changes: u64,
    /// Pens fetched by the robot.
    pub fetches: u64,
    /// Fetches that were simulated each by itself: copies of one simulation count once.
    pub fetches_distinct: u64,
    /// Share of the distinct fetches that worked, with what became of the pen until it was back.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub success_rate: Option<f64>,
    /// Lower end of the 95 % interval of `success_rate` (Wilson).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub success_rate_low: Option<f64>,
    /// Upper end of the 95 % interval of `success_rate` (Wilson).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub success_rate_high: Option<f64>,
    /// Largest jump of a joint where one plant takes over from another.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub handover_jump_rad: Option<f64>,
    /// Longest time in which all came to rest before a fetch began.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settling_s: Option<f64>,
    /// Attempts at fetching or bringing back a pen.
    pub attempts: u64,
    /// Pen changes that worked.
    pub successes: u64,
    /// Pen changes that didn't work, of whatever kind.
    pub failed: u64,
    /// Times that a pen was drawn with which friction held all the while.
    pub held_by_friction: u64,
    /// Pens dropped.
    pub dropped: u64,
    /// Fetches given up, the pen left standing in its dock.
    pub pick_given_up: u64,
    /// Returns given up, the pen left in the hand or in its dock.
    pub return_given_up: u64,
    /// Fetched pens more than 1 mm or 1 degree off in the hand that the robot took for good.
    pub bad_pose: u64,
    /// Returned pens more than 1 mm off their seat that the robot took for good.
    pub not_seated: u64,
    /// How far a fetched pen's tip is off in the hand; 95 % are below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_error_mm_p95: Option<f64>,
    /// How far a fetched pen's tip is off in the hand, at most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_error_mm_max: Option<f64>,
    /// How far a fetched pen leans in the hand; 95 % are below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_error_deg_p95: Option<f64>,
    /// The first fetched pen's tip in the hand, against a perfect grasp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tip: Option<ToolPose>,
    /// The tool in the hand at the end of each stage of the first fetch.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stages: Option<ToolStages>,
    /// Physics steps of all pen changes.
    pub steps: u64,
    /// Who waited for whom.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub schedule: Option<ScheduleMetrics>,
}

/// How the tool sits in the hand, against the design, at the end of each stage of a fetch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ToolStages {
    /// The tool in the hand after the approach.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub approach: Option<ToolPose>,
    /// The tool in the hand after the half-grasp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_grasp: Option<ToolPose>,
    /// The tool in the hand after the lift.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lift: Option<ToolPose>,
    /// The tool in the hand after the full grasp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub full_grasp: Option<ToolPose>,
}

/// How a tool sits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ToolPose {
    /// Out of the palm.
    pub x_mm: f64,
    /// Across, from the thumb to the fingers.
    pub y_mm: f64,
    /// Up.
    pub z_mm: f64,
    /// Roll, about x.
    pub roll_deg: f64,
    /// Pitch, about y.
    pub pitch_deg: f64,
    /// Yaw, about z.
    pub yaw_deg: f64,
}

impl ToolPose {
    /// From an offset (m) and roll, pitch and yaw (rad).
    pub fn of(xyz: [f64; 3], rpy: [f64; 3]) -> Self {
        let ([x_mm, y_mm, z_mm], [roll_deg, pitch_deg, yaw_deg]) = (xyz.map(|v| v * 1e3), rpy.map(f64::to_degrees));
        Self { x_mm, y_mm, z_mm, roll_deg, pitch_deg, yaw_deg }
    }
}

/// Arms that share a canvas.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ScheduleMetrics {
    /// How long the whole run takes.
    pub duration_s: f64,
    /// How long arms stood waiting for the canvas, over all arms.
    pub waiting_s: f64,
    /// Time in which more than one arm is over the canvas.
    pub together_s: f64,
    /// How long one arm would take for the same work: no one waits, nothing is done at the same time.
    pub one_arm_s: f64,
    /// Share of the time of one arm that was saved.
    pub saved_fraction: f64,
    /// Least distance of two arms in the plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance_planned_mm: Option<f64>,
    /// Least distance of two arms as simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance_mm: Option<f64>,
}
