//! What comes next while a drawing is learned by touch.
use serde::{Deserialize, Serialize};

use super::TouchStrokes;
use crate::plan::{Obstruction, PlanError, Segment, SegmentKind, Trajectory};
use crate::skill::{Felt, Move, PolicyError, Task};

/// How long the pen rests where a guarded motion met something, s.
const DWELL: f64 = 0.12;

/// What comes next, or what is under way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Phase {
    /// Next is the probe of this index.
    Probing(usize),
    /// On the way to over a place, from where this motion leads down.
    Approaching(Trajectory),
    /// Next is the way down.
    OverPlace(Trajectory),
    /// On the way down.
    Descending,
    /// Next is a rest on what was met.
    Met,
    /// Resting there.
    Resting,
    /// Has landed, or has met nothing.
    Landed(bool),
    /// Coming up from the probe of this index.
    LeavingProbe(usize),
    /// Next is the next stroke.
    NextStroke,
    /// On the way to the service pose, where the stroke's pen is put in.
    ToService,
    /// Next is a change of the pen by hand.
    PenWanted,
    /// The pen is being changed.
    ChangingPen,
    /// Next is the first piece of the stroke.
    StrokeBegins,
    /// Next is the rest of the present piece.
    Piece,
    /// On the way to where the drawn line begins; it comes next.
    Entering(Box<Line>),
    /// Next is the line.
    Entered(Box<Line>),
    /// Along the line.
    Drawing(Box<Line>),
    /// The line ended early: next the pen is lifted.
    Interrupted,
    /// The pen comes off the canvas, to try the rest of the piece anew.
    LeavingPiece,
    /// The pen comes up from where it met nothing.
    LeavingGap,
    /// The present piece is done, as far as it can be.
    PieceDone,
    /// The pen comes off the canvas at the end of the stroke.
    LeavingStroke,
    /// The stroke is done.
    StrokeDone,
    /// On the way to the service pose for good.
    GoingHome,
    /// All is done.
    Done,
}

/// A line on the canvas as it is planned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Line {
    pub(super) segment: Segment,
    /// Index of the last target that it reaches.
    pub(super) reached: usize,
    /// Why it reaches no farther, if it doesn't reach the last.
    pub(super) stopped: Option<Obstruction>,
}

impl TouchStrokes {
    /// Goes on from a phase that waits for nothing: the task that it gives, or `None` where another phase follows.
    pub(super) fn advance(&mut self) -> Result<Option<Task>, PolicyError> {
        match self.state.phase.clone() {
            Phase::Probing(i) => self.probe(i),
            Phase::OverPlace(down) => {
                self.state.phase = Phase::Descending;
                let Task::Press(down) = self.alone(SegmentKind::Press, down) else { return Ok(None) };
                Ok(Some(Task::Probe(down, self.touch.contact_force)))
            }
            Phase::Met => {
                let last = self.state.last;
                let rest = self.planner()?.brake(&last, DWELL);
                self.state.phase = Phase::Resting;
                Ok(Some(self.alone(SegmentKind::Press, rest)))
            }
            Phase::Landed(met) => self.landed(met),
            Phase::NextStroke => self.next_stroke(),
            Phase::PenWanted => {
                let wait = Trajectory::rest(self.service, self.options.pen_change);
                self.state.phase = Phase::ChangingPen;
                Ok(Some(Task::alone(SegmentKind::ChangePen, self.state.layer, None, wait)))
            }
            Phase::StrokeBegins => self.begin_stroke().map(|()| None),
            Phase::Piece => self.piece(),
            Phase::Entered(line) => {
                let segment = line.segment.clone();
                self.state.phase = Phase::Drawing(line);
                Ok(Some(Task::Draw(Move { segment, begins: false, ends: true, planned: None, visit: None })))
            }
            Phase::Interrupted => self.lift(self.off_the_canvas(), Phase::LeavingPiece).map(Some),
            Phase::PieceDone => {
                self.book();
                self.state.stroke.piece += 1;
                if self.state.stroke.piece < self.state.stroke.pieces.len() {
                    self.begin_piece()?;
                } else if self.state.stroke.down {
                    return self.lift(self.off_the_canvas(), Phase::LeavingStroke).map(Some);
                } else {
                    self.state.phase = Phase::StrokeDone;
                }
                Ok(None)
            }
            Phase::StrokeDone => {
                self.end_stroke();
                if !self.options.partial && !self.state.reach.unreachable.is_empty() {
                    return Err(PlanError::Unreachable { report: Box::new(self.state.reach.clone()) }.into());
                }
                self.state.done += 1;
                self.state.phase = Phase::NextStroke;
                Ok(None)
            }
            waiting => {
                debug_assert!(waiting == Phase::Done, "{waiting:?} gives no task");
                self.state.phase = Phase::Done;
                Ok(None)
            }
        }
    }

    /// Goes on from a phase that waited for the end of a task.
    pub(super) fn heard(&mut self, met: bool, felt: &[Felt]) {
        self.state.phase = match std::mem::replace(&mut self.state.phase, Phase::Done) {
            Phase::Approaching(down) => Phase::OverPlace(down),
            Phase::Descending if met => Phase::Met,
            Phase::Descending => Phase::Landed(false),
            Phase::Resting => Phase::Landed(self.learn_landing(felt)),
            Phase::LeavingProbe(i) => Phase::Probing(i + 1),
            Phase::ToService => {
                self.state.layer = self.order[self.state.done].layer;
                if self.by_hand { Phase::PenWanted } else { Phase::StrokeBegins }
            }
            Phase::ChangingPen => Phase::StrokeBegins,
            Phase::Entering(line) => Phase::Entered(line),
            Phase::Drawing(line) => {
                self.learn_line(felt);
                let s = &mut self.state.stroke;
                match line.stopped {
                    None => {
                        s.first = s.targets.len();
                        Phase::PieceDone
                    }
                    stopped => {
                        s.first += line.reached;
                        (s.why, s.down) = (stopped, false);
                        Phase::Interrupted
                    }
                }
            }
            Phase::LeavingPiece => Phase::Piece,
            Phase::LeavingGap => Phase::PieceDone,
            Phase::LeavingStroke => Phase::StrokeDone,
            Phase::GoingHome => Phase::Done,
            same => same,
        };
    }
}
