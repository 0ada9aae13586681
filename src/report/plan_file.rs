//! plan.json and plan-armN.npy: what the robot means to do.
use serde::Serialize;

use crate::plan::{ArmPlan, Plan, SegmentKind};

use super::npy::npy_header;

#[derive(Serialize)]
struct PlanJson<'a> {
    schema: u32,
    duration_s: f64,
    arms: Vec<ArmJson<'a>>,
}

#[derive(Serialize)]
struct ArmJson<'a> {
    arm: usize,
    joints: &'a [String],
    path: String,
    duration_s: f64,
    drawing_s: f64,
    travel_s: f64,
    changing_pen_s: f64,
    segments: Vec<SegmentJson>,
}

#[derive(Serialize)]
struct SegmentJson {
    kind: SegmentKind,
    layer: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    stroke: Option<usize>,
    start_s: f64,
    duration_s: f64,
    knots: [usize; 2],
}

/// Name of the file with the joint path of an arm.
fn npy_name(arm: usize) -> String {
    format!("plan-arm{arm}.npy")
}

/// plan.json: the segments of every arm; `knots` are the first row and the row past the last of the arm's
/// plan-armN.npy. `joints` names the joints of each arm.
pub fn plan_json(plan: &Plan, joints: &[Vec<String>]) -> String {
    let arms = plan.arms.iter().enumerate().map(|(i, arm)| arm_json(arm, joints.get(i).map_or(&[], Vec::as_slice)));
    let file = PlanJson { schema: 1, duration_s: plan.duration(), arms: arms.collect() };
    // numbers, names and unit variants only: serialising can't fail, and an empty text would be seen at once
    serde_json::to_string_pretty(&file).unwrap_or_default() + "\n"
}

fn arm_json<'a>(arm: &ArmPlan, joints: &'a [String]) -> ArmJson<'a> {
    let changes = |k| matches!(k, SegmentKind::ChangePen | SegmentKind::ChangeTool);
    let time_in = |wanted: &dyn Fn(SegmentKind) -> bool| -> f64 {
        arm.segments.iter().filter(|s| wanted(s.kind)).fold(0.0, |sum, s| sum + s.trajectory.duration())
    };
    let mut row = 0;
    let segments = arm.segments.iter().map(|s| {
        let first = row;
        row += s.trajectory.knots().len();
        SegmentJson {
            kind: s.kind,
            layer: s.layer,
            stroke: s.stroke,
            start_s: s.start,
            duration_s: s.trajectory.duration(),
            knots: [first, row],
        }
    });
    ArmJson {
        arm: arm.arm,
        joints,
        path: npy_name(arm.arm),
        duration_s: arm.segments.last().map_or(0.0, |s| s.end()),
        drawing_s: time_in(&|k| k == SegmentKind::Draw),
        travel_s: time_in(&|k| !matches!(k, SegmentKind::Draw | SegmentKind::Wait) && !changes(k)),
        changing_pen_s: time_in(&changes),
        segments: segments.collect(),
    }
}

/// plan-armN.npy, with its name: the knots of an arm's motion as a NumPy array (format 1.0, `<f8`, C order) of shape
/// (knots, 1 + joints): seconds from the start of the plan, then joint positions, rad. Where two segments meet, the
/// knot stands twice.
pub fn plan_npy(arm: &ArmPlan, joints: usize) -> (String, Vec<u8>) {
    let rows: usize = arm.segments.iter().map(|s| s.trajectory.knots().len()).sum();
    let mut bytes = npy_header("<f8", &[rows, 1 + joints]);
    for segment in &arm.segments {
        for knot in segment.trajectory.knots() {
            bytes.extend_from_slice(&(segment.start + knot.time).to_le_bytes());
            for q in knot.q.iter().take(joints) {
                bytes.extend_from_slice(&q.to_le_bytes());
            }
        }
    }
    (npy_name(arm.arm), bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{DepthProfile, Segment, Trajectory};
    use crate::robot::JointVector;

    fn plan() -> Plan {
        let rest = |kind, stroke, start, q| Segment {
            kind,
            layer: 0,
            stroke,
            start,
            trajectory: Trajectory::rest(JointVector::repeat(q), 1.5),
            depth: DepthProfile::constant(3e-3),
        };
        let segments = vec![rest(SegmentKind::Travel, None, 0.0, 0.25), rest(SegmentKind::Draw, Some(3), 1.5, 0.5)];
        Plan { arms: vec![ArmPlan { arm: 0, segments }] }
    }

    #[test]
    fn knots_point_into_the_array() {
        let names: Vec<String> = (1..=7).map(|i| format!("a{i}")).collect();
        let json: serde_json::Value = serde_json::from_str(&plan_json(&plan(), &[names])).unwrap();
        let arm = &json["arms"][0];
        assert_eq!(arm["segments"][1]["knots"], serde_json::json!([2, 4]));
        assert_eq!(arm["segments"][1]["stroke"], 3);
        assert_eq!((arm["drawing_s"].as_f64(), json["duration_s"].as_f64()), (Some(1.5), Some(3.0)));
    }

    #[test]
    fn the_array_has_the_shape_it_says() {
        let (name, bytes) = plan_npy(&plan().arms[0], 7);
        assert_eq!(name, "plan-arm0.npy");
        let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert_eq!((10 + length) % 64, 0);
        assert!(std::str::from_utf8(&bytes[10..10 + length]).unwrap().contains("(4, 8)"));
        let data = &bytes[10 + length..];
        assert_eq!(data.len(), 4 * 8 * 8);
        let number = |i: usize| f64::from_le_bytes(data[8 * i..8 * i + 8].try_into().unwrap());
        assert_eq!((number(8), number(9), number(24), number(31)), (1.5, 0.25, 3.0, 0.5));
    }
}
