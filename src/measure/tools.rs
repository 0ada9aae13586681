//! Figures of tool changes: contract of metrics.json.
use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Tool changes by grippers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ToolMetrics {
    /// Fetches and returns.
    pub changes: u64,
    /// Fetches.
    pub fetches: u64,
    /// Fetches that were simulated each by itself: copies of one simulation count once.
    pub fetches_distinct: u64,
    /// Share of the distinct fetches that worked, with what became of the pen until it was back.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub success_rate: Option<f64>,
    /// Lower end of its 95 % interval (Wilson).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub success_rate_low: Option<f64>,
    /// Upper end of its 95 % interval (Wilson).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub success_rate_high: Option<f64>,
    /// Largest jump of a joint where one plant takes over from another, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub handover_jump_rad: Option<f64>,
    /// Longest time in which all came to rest before a fetch began, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settling_s: Option<f64>,
    /// Attempts at fetches and returns.
    pub attempts: u64,
    /// Those that worked.
    pub successes: u64,
    /// Those that didn't, of whatever kind.
    pub failed: u64,
    /// Times a pen was drawn with that contact and friction held all the while.
    pub held_by_friction: u64,
    /// Pens dropped.
    pub dropped: u64,
    /// Fetches given up, the pen left standing in its dock.
    pub pick_given_up: u64,
    /// Returns given up, the pen left in the hand or in its dock.
    pub return_given_up: u64,
    /// Fetches that the robot took for good with the pen more than 1 mm or 1 degree off in the hand.
    pub bad_pose: u64,
    /// Returns that the robot took for good with the pen more than 1 mm off its seat.
    pub not_seated: u64,
    /// 95th percentile of the pen tip's position error in the hand, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_error_mm_p95: Option<f64>,
    /// The largest, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_error_mm_max: Option<f64>,
    /// 95th percentile of the pen's angle error in the hand, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_error_deg_p95: Option<f64>,
    /// The pen tip of the first fetch in the hand, against a perfect grasp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tip: Option<ToolPose>,
    /// The tool in the hand at the end of each stage of the first fetch, against the design, by the stage's name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub stages: BTreeMap<String, ToolPose>,
    /// Physics steps of all changes.
    pub steps: u64,
    /// Who waited for whom.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub schedule: Option<ScheduleMetrics>,
}

/// How a tool sits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ToolPose {
    /// Out of the palm, mm.
    pub x_mm: f64,
    /// Across, from the thumb to the fingers, mm.
    pub y_mm: f64,
    /// Up, mm.
    pub z_mm: f64,
    /// About x, degrees.
    pub roll_deg: f64,
    /// About y, degrees.
    pub pitch_deg: f64,
    /// About z, degrees.
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
    /// The whole run, s.
    pub duration_s: f64,
    /// How long arms stood waiting for the canvas, s, over all arms.
    pub waiting_s: f64,
    /// Time in which more than one arm is over the canvas, s.
    pub together_s: f64,
    /// What one arm would take for all the same work, s: no one waits, nothing is done at the same time.
    pub one_arm_s: f64,
    /// Share of that time saved.
    pub saved_fraction: f64,
    /// The arms are never nearer than this in the plan, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance_planned_mm: Option<f64>,
    /// The arms never were nearer than this, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance_mm: Option<f64>,
}
