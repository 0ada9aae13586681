//! Drawing by a plan made ahead: its segments, one after another.
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::policy::{restored, saved};
use super::{Drawer, Move, Outcome, Policy, PolicyError, Task};
use crate::plan::Segment;
use crate::surface::BelievedCanvas;

/// Does what was planned beforehand.
pub struct PlannedStrokes {
    /// Segments that follow one another without rest: an entry a timeline.
    timelines: Vec<Vec<Segment>>,
    canvas: Arc<BelievedCanvas>,
    state: State,
}

/// All that changes: which timeline and which segment of it come next, and how many segments have been given.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct State {
    timeline: usize,
    segment: usize,
    given: usize,
}

impl PlannedStrokes {
    /// Carries out `timelines`, planned on `canvas`: in each the starts of segments are counted from its first, without gaps.
    pub fn new(mut timelines: Vec<Vec<Segment>>, canvas: Arc<BelievedCanvas>) -> Self {
        timelines.retain(|t| !t.is_empty());
        Self { timelines, canvas, state: State::default() }
    }
}

impl Policy for PlannedStrokes {
    fn next(&mut self) -> Result<Option<Task>, PolicyError> {
        let State { timeline, segment, given } = self.state;
        let Some(segments) = self.timelines.get(timeline) else { return Ok(None) };
        let (begins, ends) = (segment == 0, segment + 1 == segments.len());
        self.state.given += 1;
        (self.state.timeline, self.state.segment) = if ends { (timeline + 1, 0) } else { (timeline, segment + 1) };
        let segment = segments[segment].clone();
        Ok(Some(Task::of(Move { segment, begins, ends, planned: Some(given), visit: None })))
    }

    fn ended(&mut self, _: &Task, _: &Outcome) -> Result<(), PolicyError> {
        Ok(())
    }

    fn save(&self) -> Vec<u8> {
        saved(&self.state)
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), PolicyError> {
        self.state = restored(bytes)?;
        Ok(())
    }
}

impl Drawer for PlannedStrokes {
    fn clear_of(&self) -> Result<Arc<BelievedCanvas>, PolicyError> {
        Ok(Arc::clone(&self.canvas))
    }
}
