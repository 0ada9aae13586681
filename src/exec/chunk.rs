//! What an arm did in one task, as a value that can be kept.
use serde::{Deserialize, Serialize};

use crate::plan::Segment;
use crate::twin::{ArmEnding, ArmLog};

/// A motion that was carried out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Made {
    /// One of a plan made ahead.
    Planned {
        /// Its index in the plan.
        index: usize,
        /// When it began, s from the start of the run.
        start: f64,
        /// When it ended, where that was before its time, s from the start of the run.
        until: Option<f64>,
    },
    /// One that was planned on the way; its start is counted from that of the run.
    Own(Segment),
}

/// An arm's stay over the canvas.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Visit {
    /// Its number, counted by arm.
    pub index: usize,
    /// First step.
    pub start: u64,
    /// The step after its last; `None` of one that hasn't ended.
    pub end: Option<u64>,
    /// Steps for which the arm stood waiting before.
    pub waited: u64,
}

/// What an arm did in one task, or in a part of a long one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Chunk {
    /// Step at which it began.
    pub start: u64,
    /// What happened.
    pub log: ArmLog,
    /// What was carried out.
    pub made: Vec<Made>,
    /// Visits to the canvas that began or ended before or with it.
    pub visits: Vec<Visit>,
    /// How the arm stood at its end; kept only where another arm may call the run off.
    pub ending: Option<ArmEnding>,
}
