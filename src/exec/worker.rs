//! One arm at work: it carries out its policy's tasks, one after another, in its simulation.
use serde::{Deserialize, Serialize};

use super::journal::{ArmJournal, Kept};
use super::{Chunk, ExecError, Flow, Journal, Listener, Made, News, Turns, Visit};
use crate::mesh::TriMesh;
use crate::plan::{MotionSample, Segment, SegmentKind, Trajectory};
use crate::robot::JointVector;
use crate::skill::{Outcome, PenPlace, Policy, SAME_POSTURE, Task, TaskFailure};
use crate::twin::grasp::ChangeRecord;
use crate::twin::{Adjust, ArmEnding, ArmLog, Ended, Holding, Simulation, SimulationState, ToolEnding};

/// Steps of a motion between two looks at whether to stop or to keep a state.
const SLICE: u64 = 1000;

/// An arm, what it is to do, and what it has done.
pub struct Worker<P> {
    simulation: Simulation,
    policy: P,
    /// How pens are held while they draw, where their loads allow it.
    holding: Holding,
    /// What a pen that is lost may fall on, world.
    ground: Vec<TriMesh>,
    state: WorkerState,
    /// The task under way, or to begin: it may be much larger than the state, and never changes.
    task: Option<Task>,
    chunks: Vec<Chunk>,
    /// Bytes of the journal's log after each chunk that is written.
    written: Vec<u64>,
}

/// All of a worker that changes, but for its task, its simulation and its policy.
#[derive(Clone, Default, Serialize, Deserialize)]
struct WorkerState {
    /// How many tasks there were, with the one under way.
    tasks: u64,
    began: u64,
    /// The visit to the canvas under way.
    visit: Option<usize>,
    /// Where the pen in the hand was fetched: from there it is done over, held by friction, if its grasp is loaded too much.
    fetched: Option<Box<Saved>>,
    /// Whether the pen in the hand is held by friction, whatever was wanted.
    by_friction: bool,
    /// How often pens were held by friction while they drew.
    held_by_friction: u64,
    stop: Option<ArmStop>,
}

/// All that changes, and how many chunks there were.
#[derive(Clone, Serialize, Deserialize)]
struct Saved {
    simulation: SimulationState,
    policy: Vec<u8>,
    worker: WorkerState,
    chunks: usize,
}

/// Why an arm stopped before all was done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArmStop {
    /// Name of the arm.
    pub arm: String,
    /// At which step.
    pub step: u64,
    /// Why.
    pub failure: TaskFailure,
    /// Where its tool is, if it had to do with one.
    pub tool: Option<ToolEnding>,
}

impl std::fmt::Display for ArmStop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let fallen = self.tool.as_ref().is_some_and(|t| t.dropped);
        write!(f, "{} {}{}", self.arm, self.failure, if fallen { "; the pen has fallen" } else { "" })
    }
}

/// What an arm did.
pub struct Done<P> {
    /// Its policy, which knows what became of the drawing.
    pub policy: P,
    /// What happened.
    pub log: ArmLog,
    /// How it stood at the end.
    pub ending: ArmEnding,
    /// What was carried out.
    pub made: Vec<Made>,
    /// Its visits to the canvas.
    pub visits: Vec<Visit>,
    /// Why it stopped before all was done, by its own doing.
    pub stop: Option<ArmStop>,
    /// Whether a listener stopped it.
    pub interrupted: bool,
    /// Pens held by friction while they drew.
    pub held_by_friction: u64,
    chunks: Vec<Chunk>,
}

/// Tells the others that an arm is gone, whatever becomes of its thread.
struct Leaves<'a> {
    arm: usize,
    turns: &'a Turns,
}

impl Drop for Leaves<'_> {
    fn drop(&mut self) {
        self.turns.leave(self.arm, None);
    }
}

/// How a worker's loop ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    /// All was done, or the arm gave up.
    Done,
    /// Another arm called the run off.
    CalledOff,
    /// A listener stopped it.
    Interrupted,
}

impl<P: Policy> Worker<P> {
    /// An arm that begins; `ground` is what a pen that it loses may fall on, world.
    pub fn new(simulation: Simulation, policy: P, holding: Holding, ground: Vec<TriMesh>) -> Self {
        let state = WorkerState::default();
        Self { simulation, policy, holding, ground, state, task: None, chunks: Vec::new(), written: Vec::new() }
    }

    /// Goes on from what a journal has kept of this arm, if it has anything.
    ///
    /// # Errors
    /// The journal can't be read.
    pub fn resume(&mut self, journal: &Journal) -> Result<(), ExecError> {
        let mut pages = journal.arm(self.simulation.index());
        let Some((Kept { state: saved, task }, pieces)) = pages.read::<Saved, Task, Chunk>()? else { return Ok(()) };
        (self.chunks, self.written) = pieces.into_iter().unzip();
        self.restore(saved)?;
        self.task = task.map(|(_, task)| task);
        Ok(())
    }

    /// Tells which visits have ended before a run goes on.
    pub(super) fn announce(&self, turns: &Turns) {
        for visit in self.chunks.iter().flat_map(|c| &c.visits) {
            if let Some(end) = visit.end {
                turns.end(self.simulation.index(), visit.index, end);
            }
        }
    }

    fn save(&self) -> Saved {
        Saved {
            simulation: self.simulation.state().clone(),
            policy: self.policy.save(),
            worker: self.state.clone(),
            chunks: self.chunks.len(),
        }
    }

    fn restore(&mut self, saved: Saved) -> Result<(), ExecError> {
        self.simulation.restore(saved.simulation);
        self.policy.restore(&saved.policy)?;
        (self.state, self.task) = (saved.worker, None);
        self.chunks.truncate(saved.chunks);
        self.written.truncate(saved.chunks);
        Ok(())
    }

    /// Carries out all tasks.
    pub(super) fn work(
        mut self,
        turns: &Turns,
        listener: &dyn Listener,
        journal: Option<&Journal>,
    ) -> Result<Done<P>, ExecError> {
        let arm = self.simulation.index();
        let mut pages = journal.map(|j| j.arm(arm));
        let _leaves = Leaves { arm, turns };
        let ended = self.run(turns, listener, &mut pages);
        let gave_up = self.state.stop.as_ref().map(|s| s.step);
        turns.leave(arm, gave_up);
        let end = ended?;
        if end == End::Interrupted {
            self.keep(&mut pages)?;
        }
        let ending = self.simulation.ending();
        Ok(Done {
            policy: self.policy,
            log: ArmLog::default(),
            ending,
            made: Vec::new(),
            visits: Vec::new(),
            stop: self.state.stop,
            interrupted: end == End::Interrupted,
            held_by_friction: self.state.held_by_friction,
            chunks: self.chunks,
        })
    }

    fn run(
        &mut self,
        turns: &Turns,
        listener: &dyn Listener,
        pages: &mut Option<ArmJournal>,
    ) -> Result<End, ExecError> {
        let mut safe = self.task.is_none();
        loop {
            if self.state.stop.is_some() {
                return Ok(End::Done);
            }
            if turns.is_stopping() && safe {
                return Ok(End::Interrupted);
            }
            let task = match self.task.take() {
                Some(task) => task,
                None => match self.next()? {
                    Some(task) => task,
                    None if self.state.stop.is_some() => continue,
                    None => {
                        self.leave_visit(turns);
                        return Ok(End::Done);
                    }
                },
            };
            self.task = Some(task.clone());
            if !self.enter_visit(task.visit(), turns) {
                return Ok(if turns.is_stopping() { End::Interrupted } else { End::CalledOff });
            }
            if turns.is_called_off(self.simulation.step()) {
                return Ok(End::CalledOff);
            }
            let hear = |news: &News, simulation: &Simulation| {
                if listener.hear(news, simulation) == Flow::Stop {
                    turns.stop();
                }
            };
            hear(&News::Begins(&task), &self.simulation);
            if self.carry_out(&task, &hear, pages)? {
                continue;
            }
            safe = task.ends_off_the_canvas();
            if turns.arms() > 1 {
                let ending = self.simulation.ending();
                if let Some(chunk) = self.chunks.last_mut() {
                    chunk.ending = Some(ending);
                }
            }
            if pages.as_ref().is_some_and(ArmJournal::is_due) {
                self.keep(pages)?;
            }
        }
    }

    /// The next task. What was drawn before a policy finds that it can't go on isn't thrown away: the arm stops there.
    fn next(&mut self) -> Result<Option<Task>, ExecError> {
        match self.policy.next() {
            Ok(task) => {
                self.state.tasks += u64::from(task.is_some());
                Ok(task)
            }
            Err(why) if self.chunks.iter().any(|c| !c.log.ink.is_empty()) => {
                self.give_up(TaskFailure::NoPlan { why: why.to_string() })?;
                Ok(None)
            }
            Err(why) => Err(why.into()),
        }
    }

    /// Carries out one task. True when all since a pen was fetched is to be done over.
    fn carry_out(
        &mut self,
        task: &Task,
        hear: &dyn Fn(&News, &Simulation),
        pages: &mut Option<ArmJournal>,
    ) -> Result<bool, ExecError> {
        let before = self.simulation.desired().q;
        if !self.simulation.is_under_way() {
            self.check(task)?;
            self.state.began = self.simulation.step();
        }
        let outcome = match task {
            Task::Fetch(place) => self.fetch(*place)?,
            Task::Return(place) => self.bring_back(*place)?,
            Task::Wait(time) => {
                let step = self.simulation.step() + (time / self.simulation.step_length()).round() as u64;
                self.simulation.stand_until(step);
                self.outcome(Vec::new(), None)
            }
            Task::Drive(_) => self.drive(task, hear, pages)?,
            Task::Look(settle) => self.look(*settle, task, hear, pages)?,
            Task::BelieveBase(pose) => {
                self.simulation.believe_base(pose);
                self.outcome(Vec::new(), None)
            }
            _ => match self.motion(task, hear, pages)? {
                Some(outcome) => outcome,
                None => return Ok(true),
            },
        };
        self.task = None;
        let log = self.simulation.take_log();
        hear(&News::Ended(task, &outcome, &log), &self.simulation);
        let made = self.made(task, &outcome, before);
        self.book(Chunk { start: self.state.began, log, made, ..Chunk::default() });
        self.policy.ended(task, &outcome)?;
        if self.policy.gives_up(task, &outcome)
            && let Some(failure) = outcome.failure
        {
            self.give_up(failure)?;
        }
        if matches!(task, Task::Fetch(_)) && self.state.stop.is_none() {
            self.after_fetch();
        }
        Ok(false)
    }

    /// Adds to the chunk of the present task.
    fn book(&mut self, chunk: Chunk) {
        self.chunks.push(chunk);
    }

    fn motion(
        &mut self,
        task: &Task,
        hear: &dyn Fn(&News, &Simulation),
        pages: &mut Option<ArmJournal>,
    ) -> Result<Option<Outcome>, ExecError> {
        let Some(movement) = task.movement() else { return Ok(Some(self.outcome(Vec::new(), None))) };
        let ended = loop {
            let period = self.policy.adjust_period();
            let policy = &mut self.policy;
            let mut correct = |reference, felt| policy.adjust(reference, felt);
            let adjust = period.map(|period| Adjust { period, correct: &mut correct });
            if let Some(ended) = self.simulation.execute(movement, task.guard(), SLICE, adjust)? {
                break ended;
            }
            self.pass(task, hear, pages)?;
        };
        if ended.overloaded
            && let Some(fetched) = self.state.fetched.take()
        {
            self.restore(*fetched)?;
            self.simulation.hold_by_friction(None);
            (self.state.by_friction, self.state.fetched) = (true, None);
            self.state.held_by_friction += 1;
            return Ok(None);
        }
        let Ended { stopped, lost, felt, .. } = ended;
        let failure = match task {
            _ if lost => Some(TaskFailure::PenLost),
            Task::Probe(..) if !stopped => Some(TaskFailure::MetNothing),
            _ => None,
        };
        Ok(Some(self.outcome(felt, failure)))
    }

    /// Between two slices of a task: others are heard, and what is done so far is kept when it is time.
    fn pass(
        &mut self,
        task: &Task,
        hear: &dyn Fn(&News, &Simulation),
        pages: &mut Option<ArmJournal>,
    ) -> Result<(), ExecError> {
        hear(&News::Passes(task), &self.simulation);
        if pages.as_ref().is_some_and(ArmJournal::is_due) {
            self.simulation.drain();
            let log = self.simulation.take_log();
            self.book(Chunk { start: self.state.began, log, ..Chunk::default() });
            self.keep(pages)?;
        }
        Ok(())
    }

    /// Drives the base, in slices between which others are heard.
    fn drive(
        &mut self,
        task: &Task,
        hear: &dyn Fn(&News, &Simulation),
        pages: &mut Option<ArmJournal>,
    ) -> Result<Outcome, ExecError> {
        let Task::Drive(path) = task else { return Ok(self.outcome(Vec::new(), None)) };
        let driven = loop {
            if let Some(driven) = self.simulation.drive(path, SLICE)? {
                break driven;
            }
            self.pass(task, hear, pages)?;
        };
        let failure = (!driven.arrived).then_some(TaskFailure::NotArrived);
        Ok(Outcome { base: Some(driven.belief), ..self.outcome(Vec::new(), failure) })
    }

    /// Stands until the arm is calm, in slices between which others are heard, and takes a picture.
    fn look(
        &mut self,
        settle: f64,
        task: &Task,
        hear: &dyn Fn(&News, &Simulation),
        pages: &mut Option<ArmJournal>,
    ) -> Result<Outcome, ExecError> {
        let picture = loop {
            let earlier = self.chunks.iter().flat_map(|c| &c.log.ink);
            if let Some(picture) = self.simulation.look(settle, SLICE, earlier)? {
                break picture;
            }
            self.pass(task, hear, pages)?;
        };
        Ok(Outcome { picture: Some(picture), ..self.outcome(Vec::new(), None) })
    }

    fn outcome(&self, felt: Vec<crate::skill::Felt>, failure: Option<TaskFailure>) -> Outcome {
        let time = self.simulation.time();
        let duration = time - self.state.began as f64 * self.simulation.step_length();
        Outcome { time, duration, reference: self.simulation.desired(), felt, base: None, picture: None, failure }
    }

    fn fetch(&mut self, place: PenPlace) -> Result<Outcome, ExecError> {
        let record = self.simulation.fetch(place, self.holding)?;
        Ok(self.changed(&record, "fetching a pen"))
    }

    fn bring_back(&mut self, place: PenPlace) -> Result<Outcome, ExecError> {
        let record = self.simulation.bring_back(place)?;
        (self.state.fetched, self.state.by_friction) = (None, false);
        Ok(self.changed(&record, "bringing a pen back"))
    }

    fn changed(&self, record: &ChangeRecord, doing: &str) -> Outcome {
        let failure = (!record.succeeded)
            .then(|| TaskFailure::ChangeGivenUp { doing: doing.to_string(), last: record.reports.last().cloned() });
        self.outcome(Vec::new(), failure)
    }

    /// Remembers how all stands with a pen that was just fetched and counts as one body with the hand.
    fn after_fetch(&mut self) {
        match self.holding {
            Holding::Rigid => self.state.fetched = Some(Box::new(self.save())),
            Holding::Friction(_) => self.state.held_by_friction += 1,
        }
    }

    fn give_up(&mut self, failure: TaskFailure) -> Result<(), ExecError> {
        if failure == TaskFailure::PenLost {
            self.simulation.let_fall(&self.ground)?;
            let log = self.simulation.take_log();
            self.book(Chunk { start: self.state.began, log, ..Chunk::default() });
        }
        let tool = self.simulation.tool_ending();
        let (arm, step) = (self.simulation.name().to_string(), self.simulation.step());
        self.state.stop = Some(ArmStop { arm, step, failure, tool });
        Ok(())
    }

    /// What a task has carried out, in the time of the run; the arm was commanded to stand at `before`.
    fn made(&self, task: &Task, outcome: &Outcome, before: JointVector) -> Vec<Made> {
        let Some(m) = task.movement() else {
            let (Task::Fetch(place) | Task::Return(place)) = task else { return Vec::new() };
            let trajectory = Trajectory::rest(before, outcome.duration);
            let (kind, start, depth) = (SegmentKind::ChangeTool, outcome.time - outcome.duration, Default::default());
            return vec![Made::Own(Segment { kind, layer: place.layer, stroke: None, start, trajectory, depth })];
        };
        let began = self.simulation.timeline_began();
        let passed = outcome.time - began;
        let until = (m.segment.end() > passed).then_some(passed - m.segment.start);
        let start = began + m.segment.start;
        vec![match m.planned {
            Some(index) => Made::Planned { index, start, until },
            None => Made::Own(cut(Segment { start, ..m.segment.clone() }, until)),
        }]
    }

    /// Refuses a task whose precondition doesn't hold: a policy's mistake.
    fn check(&self, task: &Task) -> Result<(), ExecError> {
        let needs = task.precondition();
        let refuse = |why: String| {
            let (arm, time) = (self.simulation.name().to_string(), self.simulation.time());
            Err(ExecError::Precondition { arm, time, why })
        };
        let MotionSample { q, .. } = self.simulation.desired();
        let begins = task.movement().is_some_and(|m| m.begins);
        if let Some(at) = needs.at.filter(|at| begins && (at - q).amax() > SAME_POSTURE) {
            let what = task
                .movement()
                .map_or_else(String::new, |m| format!("{:?} of layer {}", m.segment.kind, m.segment.layer));
            return refuse(format!("{what} begins {:.6} rad from where the arm was commanded to be", (at - q).amax()));
        }
        match needs.holds {
            Some(wanted) if self.simulation.fetches() && wanted != self.simulation.holds() => {
                refuse(format!("it needs pen {wanted:?} in the hand, which holds {:?}", self.simulation.holds()))
            }
            _ => Ok(()),
        }
    }

    /// Goes over to a visit to the canvas, or away from it; waits for its turn. False if that never comes.
    fn enter_visit(&mut self, visit: Option<usize>, turns: &Turns) -> bool {
        if visit == self.state.visit {
            return true;
        }
        self.leave_visit(turns);
        let Some(index) = visit else { return true };
        let (arm, ready) = (self.simulation.index(), self.simulation.step());
        let Some(turn) = turns.wait_for(arm, index) else { return false };
        self.state.visit = visit;
        self.state.began = ready;
        self.simulation.stand_until(turn);
        let start = self.simulation.step();
        let waiting = Visit { index, start, end: None, waited: start - ready };
        let log = self.simulation.take_log();
        self.book(Chunk { start: ready, log, visits: vec![waiting], ..Chunk::default() });
        true
    }

    fn leave_visit(&mut self, turns: &Turns) {
        let Some(index) = self.state.visit.take() else { return };
        let step = self.simulation.step();
        let left = Visit { index, start: 0, end: Some(step), waited: 0 };
        self.book(Chunk { start: step, visits: vec![left], ..Chunk::default() });
        turns.end(self.simulation.index(), index, step);
    }

    /// Keeps the present state, and what happened until then.
    fn keep(&mut self, pages: &mut Option<ArmJournal>) -> Result<(), ExecError> {
        let Some(pages) = pages else { return Ok(()) };
        let from = self.written.last().copied().unwrap_or(0);
        let task = self.task.as_ref().map(|t| (self.state.tasks, t));
        let ends = pages.write(from, &self.chunks[self.written.len()..], &Kept { state: self.save(), task })?;
        self.written.extend(ends);
        Ok(())
    }
}

/// A segment that lasted for `until` s, if that was less than it should.
pub fn cut(mut segment: Segment, until: Option<f64>) -> Segment {
    if let Some(until) = until {
        segment.trajectory = segment.trajectory.until(until);
    }
    segment
}

impl<P> Done<P> {
    /// The step at which the arm gave up.
    pub(super) fn gave_up_at(&self) -> Option<u64> {
        self.stop.as_ref().map(|s| s.step)
    }

    /// Leaves out what began at `end` or after.
    pub(super) fn cut(&mut self, end: u64) {
        let kept = self.chunks.iter().take_while(|c| c.start < end).count();
        if kept < self.chunks.len() {
            self.chunks.truncate(kept);
            self.stop = self.stop.take().filter(|s| s.step <= end);
            if let Some(ending) = self.chunks.iter().rev().find_map(|c| c.ending.clone()) {
                self.ending = ending;
            }
        }
    }

    /// Puts the chunks together.
    pub(super) fn gather(&mut self) {
        for chunk in self.chunks.drain(..) {
            self.log.append(chunk.log);
            self.made.extend(chunk.made);
            for visit in chunk.visits {
                match self.visits.iter_mut().find(|v| v.index == visit.index) {
                    Some(known) => known.end = visit.end,
                    None => self.visits.push(visit),
                }
            }
        }
    }
}
