//! Drawing with pens that the hand fetches from docks and brings back.
use std::collections::VecDeque;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::policy::{restored, saved};
use super::{Drawer, GripperKit, Move, Outcome, PenPlace, Policy, PolicyError, Task, TouchStrokes};
use crate::math::Rgb;
use crate::mesh::TriMesh;
use crate::plan::{DepthProfile, PlanError, PlanOptions, Segment, SegmentKind, StepPlanner, Trajectory};
use crate::robot::{ArmModel, JointVector};
use crate::surface::BelievedCanvas;

/// How far a fetched tool is raised straight up from over its dock, m.
const RAISE: f64 = 0.05;

/// Has pens fetched for another policy: before each task of it that needs another pen, the pen in the hand is brought back, and the
/// one that is needed is fetched.
pub struct FetchedPens<P> {
    inner: P,
    kit: Arc<GripperKit>,
    /// The dock of each layer's pen.
    docks: Vec<usize>,
    /// What is kept clear of, but for this arm's own docks, world.
    obstacles: Vec<TriMesh>,
    options: Arc<PlanOptions>,
    /// The arm as it believes itself to be with an empty hand, and with a pen in it.
    bare: Arc<ArmModel>,
    full: Arc<ArmModel>,
    state: State,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    /// Where the desired motion rests, rad.
    at: JointVector,
    holds: Option<Held>,
    queue: VecDeque<Task>,
    /// The other policy's task that waits for its pen.
    pending: Option<Task>,
    /// Visits to the canvas begun.
    visits: usize,
    phase: Phase,
}

/// The pen in the hand, and the way from over its dock down to it.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Held {
    place: PenPlace,
    over: JointVector,
    down: Trajectory,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Phase {
    Working,
    Leaving,
    Done,
}

impl<P: Drawer> FetchedPens<P> {
    /// Has the pens of layers fetched from `docks` (an index a layer) of the kit's arm.
    ///
    /// # Errors
    /// The tool makes no solid.
    pub fn new(
        inner: P,
        kit: Arc<GripperKit>,
        docks: Vec<usize>,
        obstacles: Vec<TriMesh>,
        options: Arc<PlanOptions>,
    ) -> Result<Self, PolicyError> {
        // whichever pen it is: only its colour differs
        let full = Arc::new(kit.holding(Rgb([0; 3])).map_err(PolicyError::Tool)?);
        let bare = Arc::new(kit.bare.clone());
        let state = State {
            at: kit.home,
            holds: None,
            queue: VecDeque::new(),
            pending: None,
            visits: 0,
            phase: Phase::Working,
        };
        Ok(Self { inner, kit, docks, obstacles, options, bare, full, state })
    }

    /// The policy that draws.
    pub fn inner(&self) -> &P {
        &self.inner
    }

    /// From rest at `from` to rest at `to`, with an empty hand or a full one, clear of all docks and the tools in them but for the tool
    /// of `empty`.
    fn travel(
        &self,
        arm: &Arc<ArmModel>,
        [from, to]: [&JointVector; 2],
        empty: Option<usize>,
        leg: &'static str,
    ) -> Result<Trajectory, PolicyError> {
        let docks = self.kit.solids(empty).map_err(PolicyError::Tool)?;
        let way = self.way(arm, [from, to], [self.obstacles.as_slice(), &docks].concat())?;
        Ok(way.ok_or_else(|| PlanError::NoWay { arm: arm.name.clone(), leg })?)
    }

    fn way(
        &self,
        arm: &Arc<ArmModel>,
        [from, to]: [&JointVector; 2],
        obstacles: Vec<TriMesh>,
    ) -> Result<Option<Trajectory>, PolicyError> {
        let canvas = self.inner.clear_of()?;
        let planner = StepPlanner::new(arm, &self.kit.home, &[], &canvas, &Arc::new(obstacles), &self.options);
        Ok(planner.travel(&canvas, from, to))
    }

    /// Travels one after another without rest between them.
    fn enqueue(&mut self, layer: usize, ways: Vec<Trajectory>) {
        let (mut start, count) = (0.0, ways.len());
        for (i, trajectory) in ways.into_iter().enumerate() {
            let depth = DepthProfile::default();
            let segment = Segment { kind: SegmentKind::Travel, layer, stroke: None, start, trajectory, depth };
            start = segment.end();
            let (begins, ends) = (i == 0, i + 1 == count);
            self.state.queue.push_back(Task::Travel(Move { segment, begins, ends, planned: None, visit: None }));
        }
    }

    fn fetch(&mut self, layer: usize) -> Result<(), PolicyError> {
        let place = PenPlace { layer, dock: self.docks[layer] };
        let before = self.kit.before(place.dock)?;
        let way = self.travel(&self.bare, [&self.state.at, &before], None, "to a dock")?;
        self.enqueue(layer, vec![way]);
        self.state.queue.push_back(Task::Fetch(place));
        Ok(())
    }

    /// Up from over the dock and away, once the hand holds the pen and was last commanded to stand at `at`.
    fn leave_dock(&mut self, place: PenPlace, at: &JointVector) -> Result<(), PolicyError> {
        let canvas = self.inner.clear_of()?;
        let planner = StepPlanner::new(
            &self.full,
            &self.kit.home,
            &[],
            &canvas,
            &Arc::new(self.obstacles.clone()),
            &self.options,
        );
        let up = planner.retreat(at, RAISE);
        let over = end_of(&up);
        let away = self.travel(&self.full, [&over, &self.kit.home], Some(place.dock), "from a dock")?;
        self.state.holds = Some(Held { place, over, down: up.reversed() });
        self.enqueue(place.layer, vec![up, away]);
        Ok(())
    }

    fn bring_back(&mut self, held: &Held) -> Result<(), PolicyError> {
        let back = self.travel(&self.full, [&self.state.at, &held.over], Some(held.place.dock), "back to a dock")?;
        self.enqueue(held.place.layer, vec![back, held.down.clone()]);
        self.state.queue.push_back(Task::Return(held.place));
        Ok(())
    }

    /// From where the hand let go of the pen to where it begins to fetch: it is near the dock, and nothing else is.
    fn settle(&mut self, place: PenPlace, at: &JointVector) -> Result<(), PolicyError> {
        let before = self.kit.before(place.dock)?;
        let way = self.way(&self.bare, [at, &before], Vec::new())?;
        let leg = "away from a dock";
        let way = way.ok_or_else(|| PlanError::NoWay { arm: self.bare.name.clone(), leg })?;
        self.enqueue(place.layer, vec![way]);
        Ok(())
    }
}

impl<P: Drawer> Policy for FetchedPens<P> {
    fn next(&mut self) -> Result<Option<Task>, PolicyError> {
        loop {
            if let Some(task) = self.state.queue.pop_front() {
                return Ok(Some(task));
            }
            if self.state.phase == Phase::Done {
                return Ok(None);
            }
            if self.state.pending.is_none() && self.state.phase == Phase::Working {
                self.state.pending = self.inner.next()?;
            }
            let wanted = self.state.pending.as_ref().and_then(Task::movement).map(|m| m.segment.layer);
            let held = self.state.holds.clone();
            match (wanted, held) {
                (Some(layer), Some(held)) if held.place.layer == layer => {
                    let visit = self.state.visits.checked_sub(1);
                    return Ok(self.state.pending.take().map(|t| t.in_visit(visit)));
                }
                (_, Some(held)) => self.bring_back(&held)?,
                (Some(layer), None) => self.fetch(layer)?,
                (None, None) if self.state.phase == Phase::Working && self.state.visits > 0 => {
                    let way = self.travel(&self.bare, [&self.state.at, &self.kit.home], None, "home")?;
                    let layer = 0;
                    self.enqueue(layer, vec![way]);
                    self.state.phase = Phase::Leaving;
                }
                (None, None) => self.state.phase = Phase::Done,
            }
        }
    }

    fn ended(&mut self, task: &Task, outcome: &Outcome) -> Result<(), PolicyError> {
        match task {
            Task::Fetch(place) if outcome.failure.is_none() => {
                self.state.at = outcome.reference.q;
                self.state.visits += 1;
                self.leave_dock(*place, &outcome.reference.q)
            }
            Task::Return(place) if outcome.failure.is_none() => {
                self.state.at = outcome.reference.q;
                self.state.holds = None;
                self.settle(*place, &outcome.reference.q)
            }
            Task::Fetch(_) | Task::Return(_) => Ok(()),
            _ => {
                let ours = task.visit().is_none();
                if let Some(m) = task.movement() {
                    self.state.at = if ours { end_of(&m.segment.trajectory) } else { outcome.reference.q };
                }
                if ours { Ok(()) } else { self.inner.ended(task, outcome) }
            }
        }
    }

    fn gives_up(&self, task: &Task, outcome: &Outcome) -> bool {
        if task.visit().is_some() { self.inner.gives_up(task, outcome) } else { outcome.failure.is_some() }
    }

    fn save(&self) -> Vec<u8> {
        saved(&(&self.state, self.inner.save()))
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), PolicyError> {
        let (state, inner): (State, Vec<u8>) = restored(bytes)?;
        self.state = state;
        self.inner.restore(&inner)
    }
}

impl<P: Drawer> Drawer for FetchedPens<P> {
    fn clear_of(&self) -> Result<Arc<BelievedCanvas>, PolicyError> {
        self.inner.clear_of()
    }

    fn touched(&self) -> Option<&TouchStrokes> {
        self.inner.touched()
    }
}

fn end_of(trajectory: &Trajectory) -> JointVector {
    trajectory.knots().last().map_or_else(JointVector::zeros, |k| k.q)
}
