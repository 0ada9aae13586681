//! How the tool sat in the hand, stage by stage, as a table.
use super::work::Change;
use crate::measure::ToolPose;
use crate::twin::grasp::{Order, Snapshot, Stage};

/// The name of a stage in files.
pub(super) fn stage_name(stage: Stage) -> &'static str {
    match stage {
        Stage::Approach => "approach",
        Stage::HalfGrasp => "half_grasp",
        Stage::Lift => "lift",
        Stage::FullGrasp => "full_grasp",
        Stage::Lower => "lower",
        Stage::HalfRelease => "half_release",
        Stage::Seat => "seat",
        Stage::Release => "release",
        Stage::Retreat => "retreat",
    }
}

/// What an instant of a tool change is called in files.
pub(super) fn snapshot_name(snapshot: &Snapshot) -> String {
    match (snapshot.stage.map(stage_name), snapshot.failed) {
        (Some(stage), false) => stage.into(),
        (Some(stage), true) => format!("{stage}_failed"),
        (None, false) => "begin".into(),
        (None, true) => "lost".into(),
    }
}

/// Every stage of every tool change: time (s) at its end, and the tool in the hand against the design (mm, degrees).
pub(super) fn stages_csv(changes: &[Vec<Change>], arms: &[&str], inks: &[&str]) -> String {
    let mut text =
        String::from("arm,ink,dock,change,attempts,stage,time_s,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n");
    for (list, arm) in changes.iter().zip(arms) {
        for c in list {
            let order = match c.record.order {
                Order::Pick => "fetch",
                Order::Return => "return",
            };
            for s in &c.record.snapshots {
                let p = ToolPose::of(s.in_hand.xyz, s.in_hand.rpy);
                let stage = snapshot_name(s);
                let (ink, time) = (inks[c.layer], c.start + s.time);
                text.push_str(&format!(
                    "{arm},{ink:?},{},{order},{},{stage},{time:.3},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4}\n",
                    c.dock, c.record.attempts, p.x_mm, p.y_mm, p.z_mm, p.roll_deg, p.pitch_deg, p.yaw_deg
                ));
            }
        }
    }
    text
}
