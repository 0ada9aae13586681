//! How the tool sat in the hand, stage by stage, as a table.
use crate::measure::ToolPose;
use crate::skill::{Order, Stage};
use crate::twin::grasp::{ChangeRecord, Snapshot};

use super::cell::cell;

/// The name of a stage in files.
fn stage_name(stage: Stage) -> &'static str {
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
pub fn snapshot_name(snapshot: &Snapshot) -> String {
    match (snapshot.stage.map(stage_name), snapshot.failed) {
        (Some(stage), false) => stage.into(),
        (Some(stage), true) => format!("{stage}_failed"),
        (None, false) => "begin".into(),
        (None, true) => "lost".into(),
    }
}

/// A tool change and whose it is.
#[derive(Clone, Copy, Debug)]
pub struct StagesOf<'a> {
    /// Name of the arm.
    pub arm: &'a str,
    /// Name of the ink.
    pub ink: &'a str,
    /// What happened.
    pub record: &'a ChangeRecord,
    /// How all stood when the pen had been lost after it.
    pub lost: &'a [Snapshot],
}

/// A name as a field that may have commas and quotes in it.
fn quoted(name: &str) -> String {
    format!("\"{}\"", cell(name).replace('"', "\"\""))
}

/// Every stage of every tool change: time (s) at its end, and the tool in the hand against the design (mm, degrees).
pub fn stages_csv<'a>(changes: impl IntoIterator<Item = StagesOf<'a>>) -> String {
    let mut text =
        String::from("arm,ink,dock,change,attempts,stage,time_s,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n");
    for StagesOf { arm, ink, record, lost } in changes {
        let (arm, ink) = (if arm.contains([',', '"', '\n']) { quoted(arm) } else { cell(arm) }, quoted(ink));
        let (dock, start) = (record.place.dock, record.start);
        let order = match record.order {
            Order::Pick => "fetch",
            Order::Return => "return",
        };
        for s in record.snapshots.iter().chain(lost) {
            let p = ToolPose::of(s.in_hand.xyz, s.in_hand.rpy);
            let stage = snapshot_name(s);
            let (attempts, time) = (record.attempts, start + s.time);
            text.push_str(&format!(
                "{arm},{ink},{dock},{order},{attempts},{stage},{time:.3},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4}\n",
                p.x_mm, p.y_mm, p.z_mm, p.roll_deg, p.pitch_deg, p.yaw_deg
            ));
        }
    }
    text
}
