//! What happened to one arm, piece by piece, and the pieces put together as the record of a run.
use serde::{Deserialize, Serialize};

use crate::ink::{InkStroke, TraceInk};
use crate::math::{Digest, Pose};
use crate::twin::grasp::{ChangeRecord, Snapshot};
use crate::twin::{ArmRecord, ArmSample, BaseSample, BaseStand, Event, Record, StrokeRecord};

/// What happened since the log was last taken. Times are those of the run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ArmLog {
    /// Samples in time order.
    pub samples: Vec<ArmSample>,
    /// Strokes that ended.
    pub strokes: Vec<StrokeRecord>,
    /// Events in time order.
    pub events: Vec<Event>,
    /// Lines that ended.
    pub ink: Vec<InkStroke>,
    /// Tool changes.
    pub changes: Vec<ChangeRecord>,
    /// Pens that were lost after their fetch: how hand and tool stood when they had fallen.
    pub lost: Vec<Snapshot>,
    /// Where the base stood, of an arm on one, in time order.
    pub base: Vec<BaseSample>,
    /// Places at which the base came to believe that it stands.
    pub stands: Vec<BaseStand>,
}

/// Sums and extremes over an arm's whole run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Totals {
    /// Largest change of a joint position in one step, rad.
    pub max_joint_step: f64,
    /// Largest normal force in any step, drawing or not, N.
    pub max_force: f64,
    /// Steps with ink while the plan had the pen up.
    pub pen_up_contact_steps: u64,
    /// Physics steps simulated.
    pub steps: u64,
}

/// How an arm stood when its work ended.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ArmEnding {
    /// Time, s.
    pub time: f64,
    /// Joint positions, rad.
    pub q: Vec<f64>,
    /// Joint speeds, rad/s.
    pub qd: Vec<f64>,
    /// Sums and extremes until then.
    pub totals: Totals,
    /// Lines that hadn't ended.
    pub ink: Vec<InkStroke>,
    /// The stroke that was being drawn.
    pub stroke: Option<StrokeRecord>,
    /// Where the base stood, world, of an arm on one.
    pub base: Option<Pose>,
}

impl ArmLog {
    /// Adds what happened later.
    pub fn append(&mut self, mut later: ArmLog) {
        self.samples.append(&mut later.samples);
        self.strokes.append(&mut later.strokes);
        self.events.append(&mut later.events);
        self.ink.append(&mut later.ink);
        self.changes.append(&mut later.changes);
        self.lost.append(&mut later.lost);
        self.base.append(&mut later.base);
        self.stands.append(&mut later.stands);
    }
}

/// All that is known of one arm at the end of a run.
pub struct ArmStory {
    /// Its name.
    pub name: String,
    /// Names of its joints.
    pub joints: Vec<String>,
    /// Seconds between samples.
    pub sample_period: f64,
    /// What happened.
    pub log: ArmLog,
    /// How it stood at the end.
    pub ending: ArmEnding,
}

impl Record {
    /// The record of a run of these arms with these inks. Events are in time order, lines in the order in which they were begun; what
    /// happened at the same time stands in the order of the arms.
    pub fn of(stories: Vec<ArmStory>, inks: Vec<TraceInk>, wall: f64) -> Self {
        let mut record = Record { wall, ..Record::default() };
        record.ink.inks = inks;
        let many = stories.len() > 1;
        for story in stories {
            let ArmStory { name, joints, sample_period, mut log, ending } = story;
            log.strokes.extend(ending.stroke);
            log.ink.extend(ending.ink);
            record.events.append(&mut log.events);
            record.ink.strokes.append(&mut log.ink);
            let ArmEnding { time, q, qd, totals, base, .. } = ending;
            record.steps += totals.steps;
            record.simulated = record.simulated.max(time);
            record.arms.push(ArmRecord {
                name,
                joints,
                sample_period,
                samples: log.samples,
                strokes: log.strokes,
                max_joint_step: totals.max_joint_step,
                max_force: totals.max_force,
                pen_up_contact_steps: totals.pen_up_contact_steps,
                final_q: q,
                final_qd: qd,
                base: log.base,
                stands: log.stands,
                final_base: base,
            });
        }
        if many {
            record.events.sort_by(|a, b| a.time.total_cmp(&b.time));
        }
        let begun = |s: &InkStroke| s.points.first().map_or(0.0, |p| p.time);
        record.ink.strokes.sort_by(|a, b| begun(a).total_cmp(&begun(b)));
        let mut digest = Digest::new();
        for r in &record.arms {
            digest.numbers(&r.final_q).numbers(&r.final_qd).numbers([&r.max_force]);
            if let Some(base) = &r.final_base {
                digest.numbers(base.translation.vector.iter()).numbers(base.rotation.coords.iter());
            }
        }
        record.ink.digest(&mut digest);
        record.digest = digest.hex();
        record
    }
}
