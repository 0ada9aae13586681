//! One arm's work: it fetches a pen, draws what is to be drawn with it, brings it back, and fetches the next.
use crate::math::Pose;
use crate::math::Rgb;
use crate::mesh::TriMesh;
use crate::plan::schedule::Piece;
use crate::plan::{ArmPlan, DepthProfile, Plan, PlanError, PlanOptions, Segment, SegmentKind, StepPlanner, Trajectory};
use crate::robot::{ArmModel, JointVector};
use crate::run::tools::kit::Kit;
use crate::run::{RunError, options};
use crate::scenario::{Hold, Scenario, ToolSettings};
use crate::surface::BelievedCanvas;
use crate::twin::grasp::{ChangeRecord, LEFT, Session};
use crate::twin::{Record, Simulation, Surroundings, TwinArm, TwinOptions};

/// How far a fetched tool is raised straight up from over its dock, m.
const RAISE: f64 = 0.05;
/// Force on the pen's tip up to which a grasp as designed is as good as rigid, N: a minute's pull of 5 N across and 5 N along the pen
/// moves its tip by less than 0.01 mm (`examples/grip.rs`). It falls with the fingers' friction and strength. Where a pen is pressed
/// harder, its grasp is simulated.
const GRIP_BEARS: f64 = 7.0;
/// Friction of fingers with which that was measured.
const GRIP_FRICTION: f64 = 0.25;
/// How long a lost pen is followed, s.
const FALL: f64 = 1.0;

/// What an arm draws with one pen before it brings that back.
pub(super) struct Task {
    /// Index of the ink's layer.
    pub layer: usize,
    /// Index of the dock that its pen stands in.
    pub dock: usize,
    /// From the waiting pose and back to it.
    pub segments: Vec<Segment>,
}

/// A tool change and when it was.
pub(super) struct Change {
    /// Index of the ink's layer.
    pub layer: usize,
    /// Index of the dock.
    pub dock: usize,
    /// When it began, s, in the arm's own time.
    pub start: f64,
    pub record: ChangeRecord,
    /// Where the pen's tip is in the hand, seen from where a perfect grasp holds it; of a pick that succeeded.
    pub tip_error: Option<Pose>,
    /// How far the tool is from where it stood in its dock, m; of a return that succeeded.
    pub seat_gap: Option<f64>,
}

/// What an arm did, in its own time, in which it never waits.
pub(super) struct Worked {
    pub record: Record,
    pub pieces: Vec<Piece>,
    /// Start of each piece, s.
    pub starts: Vec<f64>,
    /// All motion as it was planned, in the arm's own time.
    pub segments: Vec<Segment>,
    pub changes: Vec<Change>,
    /// Tasks in which contact and friction held the pen while it drew.
    pub held_by_friction: u64,
    /// Why it stopped before all was done.
    pub stopped: Option<Stop>,
}

/// An arm that stopped.
pub(super) struct Stop {
    pub reason: String,
    /// Whether the pen isn't in its dock and not in the hand.
    pub dropped: bool,
    /// Whether it was lost after the hand had fetched it.
    pub lost: bool,
    /// Index of its ink's layer, index of its dock, and where it is, world.
    pub layer: usize,
    pub dock: usize,
    pub world_from_tool: Pose,
}

/// What an arm works in.
pub(super) struct Site<'a> {
    pub scenario: &'a Scenario,
    pub tools: &'a ToolSettings,
    pub world: &'a Surroundings<'a>,
    pub canvas: &'a BelievedCanvas,
    /// What is kept clear of, but for this arm's own docks.
    pub obstacles: &'a [TriMesh],
    /// What a pen may fall on.
    pub ground: &'a [TriMesh],
    pub plan: &'a PlanOptions,
    pub twin: &'a TwinOptions,
    /// Colour of each layer's ink.
    pub colors: &'a [Rgb],
}

/// Ways of an arm, with a pen or without, among obstacles.
struct Ways<'a> {
    planner: StepPlanner<'a>,
    canvas: &'a BelievedCanvas,
}

impl<'a> Ways<'a> {
    fn new(site: &'a Site, arm: &'a ArmModel, home: &JointVector, obstacles: &'a [TriMesh]) -> Self {
        Self { planner: StepPlanner::new(arm, home, &[], site.canvas, obstacles, site.plan), canvas: site.canvas }
    }

    fn travel(&self, from: &JointVector, to: &JointVector, leg: &'static str) -> Result<Trajectory, RunError> {
        let way = self.planner.travel(self.canvas, from, to);
        Ok(way.ok_or_else(|| PlanError::NoWay { arm: self.planner.arm().into(), leg })?)
    }
}

fn end_of(trajectory: &Trajectory) -> JointVector {
    trajectory.knots().last().map_or_else(JointVector::zeros, |k| k.q)
}

/// How a task ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ended {
    /// Well.
    Done,
    /// The arm gave up.
    Stopped,
    /// A pen that was taken to be held as one body with the hand was pressed harder than the grasp surely bears.
    Overloaded,
}

/// An arm at work.
struct Worker<'a> {
    site: &'a Site<'a>,
    kit: &'a Kit<'a>,
    simulation: Simulation<'a>,
    /// How long the arm stands waiting before each piece, s: nibs dry.
    waits: &'a [f64],
    done: Worked,
    /// Largest normal force on the pen in the motion before, N.
    peak: f64,
    /// Whether the hand has lost its pen in it.
    lost: bool,
    /// Where the wished motion rests, rad.
    at: JointVector,
}

impl Worker<'_> {
    /// Carries out motion. `over_canvas` pieces are the canvas's alone.
    fn motion(&mut self, plan: Plan, over_canvas: bool) -> Result<(), RunError> {
        let waited = self.waits.get(self.done.pieces.len()).copied().unwrap_or(0.0);
        self.simulation.let_dry(0, waited);
        let began = self.simulation.time();
        let executed = self.simulation.execute(&plan, None, &mut |_| ())?;
        self.peak = executed.arms.iter().map(|a| a.peak).fold(0.0, f64::max);
        self.lost = executed.lost.is_some();
        let passed = executed.time - began;
        for arm in plan.arms {
            let arm = if self.lost { arm.until(passed) } else { arm };
            for mut segment in arm.segments {
                self.at = end_of(&segment.trajectory);
                segment.start += began;
                self.done.segments.push(segment);
            }
        }
        self.piece(began, over_canvas);
        Ok(())
    }

    fn piece(&mut self, began: f64, over_canvas: bool) {
        self.done.starts.push(began);
        self.done.pieces.push(Piece { duration: self.simulation.time() - began, over_canvas });
    }

    fn travels(&mut self, layer: usize, ways: Vec<Trajectory>) -> Result<(), RunError> {
        let steps = ways.into_iter().map(|way| (SegmentKind::Travel, way, DepthProfile::default()));
        self.motion(Plan::of_steps(layer, None, steps.collect()), false)
    }

    /// Books a tool change that was simulated apart. False when it failed.
    fn changed(&mut self, task: &Task, record: ChangeRecord, tip_error: Option<Pose>, seat_gap: Option<f64>) -> bool {
        let began = self.simulation.time();
        let duration = record.duration();
        self.simulation.pass(0, SegmentKind::ChangeTool, duration, ChangeRecord::PERIOD, &record.joints);
        let trajectory = Trajectory::rest(self.at, duration);
        self.done.segments.push(Segment {
            kind: SegmentKind::ChangeTool,
            layer: task.layer,
            stroke: None,
            start: began,
            trajectory,
            depth: DepthProfile::default(),
        });
        self.piece(began, false);
        let succeeded = record.succeeded;
        self.done.changes.push(Change {
            layer: task.layer,
            dock: task.dock,
            start: began,
            record,
            tip_error,
            seat_gap,
        });
        succeeded
    }

    /// Books that the arm stops after a change that failed: `session` tells where the pen is.
    fn give_up(&mut self, doing: &str, task: &Task, session: &Session) -> Ended {
        let last = self.done.changes.last().and_then(|c| c.record.reports.last());
        let why = last.map_or_else(String::new, |w| format!(": {w}"));
        self.stop(&format!("gave up {doing}{why}"), false, task, session)
    }

    /// The same where the fingers tell that the pen has gone: the arm stands still, and the pen falls on what lies under it.
    fn lose(&mut self, task: &Task, session: &Session) -> Result<Ended, RunError> {
        let broken = |source| RunError::Grasp { arm: self.kit.arm.model.name.clone(), source };
        session.led_to(self.at);
        session.put_ground(self.site.ground).and_then(|()| session.stand(FALL)).map_err(broken)?;
        let now = self.simulation.time();
        if let Some(fetch) = self.done.changes.last_mut() {
            fetch.record.snapshots.push(session.lost(now - fetch.start + FALL));
        }
        Ok(self.stop("lost its pen while it drew with it", true, task, session))
    }

    fn stop(&mut self, what: &str, lost: bool, task: &Task, session: &Session) -> Ended {
        let dropped = session.from_seat() > LEFT && session.in_hand() > LEFT;
        let fallen = if dropped { "; the pen has fallen" } else { "" };
        let reason = format!("{} {what}{fallen}", self.kit.arm.model.name);
        let world_from_tool = session.world().world_from_tool();
        self.done.stopped = Some(Stop { reason, dropped, lost, layer: task.layer, dock: task.dock, world_from_tool });
        Ended::Stopped
    }

    /// One pen: fetched, drawn with, and brought back.
    fn task(&mut self, task: &Task, hold: Hold) -> Result<Ended, RunError> {
        let (site, kit) = (self.site, self.kit);
        let home = kit.arm.home;
        let broken = |source| RunError::Grasp { arm: kit.arm.model.name.clone(), source };
        let with = |own: Vec<TriMesh>| [site.obstacles, &own].concat();
        let (all, rest) = (with(kit.solids(None)?), with(kit.solids(Some(task.dock))?));

        // empty-handed before the dock
        let (setup, error) = kit.setup(task.dock, site.tools, site.scenario.seed)?;
        let empty = Ways::new(site, &kit.bare, &home, &all);
        let way = empty.travel(&self.at, &setup.carrier.home, "to a dock")?;
        self.travels(task.layer, vec![way])?;
        let (session, pick) = Session::fetch(&setup, &error).map_err(broken)?;

        let believed = kit.believed(site.colors[task.layer])?;
        let truly = kit.truly(&believed, &session.last_from_tool());
        let tip_error = pick.succeeded.then(|| kit.tip_error(&session.world().grip_from_tool()));
        if !self.changed(task, pick, tip_error, None) {
            return Ok(self.give_up("fetching a pen", task, &session));
        }
        // up from over the dock and away, with the pen as the grasp left it
        let [start, wish] = session.joints();
        let controller = options::controller(site.scenario, &believed);
        self.simulation.go_on_as(0, TwinArm { model: truly, controller, start }, task.layer)?;
        if hold == Hold::Physics {
            self.done.held_by_friction += 1;
            self.simulation.go_on_in(Box::new(session.plant(site.tools.open_after_s)));
        }
        let full = Ways::new(site, &believed, &home, &rest);
        let up = full.planner.retreat(&wish, RAISE);
        let over = end_of(&up);
        let down = up.reversed();
        let away = full.travel(&over, &home, "from a dock")?;
        self.travels(task.layer, vec![up, away])?;
        if !self.lost {
            self.motion(Plan { arms: vec![ArmPlan { arm: 0, segments: task.segments.clone() }] }, true)?;
        }
        let friction = setup.set.tool.friction_fingers * setup.variation.friction_fingers / GRIP_FRICTION;
        if hold == Hold::Rigid && self.peak > GRIP_BEARS * (friction * setup.variation.strength).min(1.0) {
            return Ok(Ended::Overloaded);
        }
        if !self.lost {
            let back = full.travel(&self.at, &over, "back to a dock")?;
            self.travels(task.layer, vec![back, down])?;
        }
        if self.lost {
            return self.lose(task, &session);
        }

        if hold == Hold::Physics {
            session.led_to(self.at);
        }
        let put = session.bring_back().map_err(broken)?;
        let gap = put.succeeded.then(|| session.from_seat());
        let seated = self.changed(task, put, None, gap);
        let [start, wish] = session.joints();
        let controller = options::controller(site.scenario, &kit.bare);
        self.simulation.go_on_as(0, TwinArm { model: kit.bare.clone(), controller, start }, task.layer)?;
        self.at = wish;
        if !seated {
            return Ok(self.give_up("bringing a pen back", task, &session));
        }
        let settle = Ways::new(site, &kit.bare, &home, &[]);
        let way = settle.travel(&wish, &setup.carrier.home, "away from a dock")?;
        self.travels(task.layer, vec![way])?;
        Ok(Ended::Done)
    }
}

/// Does an arm's tasks, one after another, from its waiting pose and back to it. Where a pen was
/// pressed harder than its grasp surely bears, all is done over with that pen's grasp simulated while it draws.
pub(super) fn work(
    site: &Site,
    kit: &Kit,
    tasks: &[Task],
    waits: &[f64],
    hear: &mut dyn FnMut(),
) -> Result<Worked, RunError> {
    let hold = if site.tools.open_after_s.is_some() { Hold::Physics } else { site.tools.hold };
    let mut holds = vec![hold; tasks.len()];
    loop {
        match attempt(site, kit, tasks, &holds, waits, hear)? {
            Ok(worked) => return Ok(worked),
            Err(overloaded) => holds[overloaded] = Hold::Physics,
        }
    }
}

/// The same with the pen of each task held as `holds` says; else the index of the first task that this isn't right for.
fn attempt(
    site: &Site,
    kit: &Kit,
    tasks: &[Task],
    holds: &[Hold],
    waits: &[f64],
    hear: &mut dyn FnMut(),
) -> Result<Result<Worked, usize>, RunError> {
    let home = kit.arm.home;
    let controller = options::controller(site.scenario, &kit.bare);
    let twin = TwinArm { model: kit.bare.clone(), controller, start: home };
    let first = tasks.first().map_or(0, |t| t.layer);
    let simulation = Simulation::new(vec![twin], &[first], site.world, site.twin)?;
    let done = Worked {
        record: Record::default(),
        pieces: Vec::new(),
        starts: Vec::new(),
        segments: Vec::new(),
        changes: Vec::new(),
        held_by_friction: 0,
        stopped: None,
    };
    let mut worker = Worker { site, kit, simulation, waits, done, peak: 0.0, lost: false, at: home };
    for (i, task) in tasks.iter().enumerate() {
        match worker.task(task, holds[i])? {
            Ended::Done => hear(),
            Ended::Stopped => break,
            Ended::Overloaded => return Ok(Err(i)),
        }
    }
    if worker.done.stopped.is_none() && !tasks.is_empty() {
        let all = [site.obstacles, &kit.solids(None)?].concat();
        let way = Ways::new(site, &kit.bare, &home, &all).travel(&worker.at, &home, "home")?;
        worker.travels(tasks[tasks.len() - 1].layer, vec![way])?;
    }
    let Worker { simulation, mut done, .. } = worker;
    done.record = simulation.finish(site.colors);
    Ok(Ok(done))
}
