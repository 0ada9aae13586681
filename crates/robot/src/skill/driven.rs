//! Drawing from place to place: a base drives, finds out where it stands, and its arm draws what is to be drawn from there.
use std::sync::Arc;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::looking::{Alignment, AlignmentState, Surrounds};
use super::policy::{restored, saved};
use super::{Aligned, BaseBelief, Drawer, LookOptions, Move, Outcome, Policy, PolicyError, Task, TaskFailure};
use crate::control::{DriveOptions, DrivePath};
use crate::drawing::StrokeRef;
use crate::math::Pose;
use crate::mesh::TriMesh;
use crate::plan::{
    self, DepthProfile, HandStiffness, PlanError, PlanJob, PlanOptions, ReachReport, SagModel, Segment, SegmentKind,
    StepPlanner, Trajectory,
};
use crate::robot::{ArmModel, BaseModel, BasePose, JointVector};
use crate::surface::{BelievedCanvas, SurfaceDrawing};

/// Times that a base drives on to the same place when it finds that it hasn't come near enough.
const TRIES: u32 = 3;

/// A place to stand at, and what is drawn from there.
#[derive(Clone, Debug)]
pub struct DrivenPlace {
    /// The way there: stops one after another, the last of them the place.
    pub way: Vec<BasePose>,
    /// What is drawn from it, on the believed canvas; strokes keep the indices of the whole drawing.
    pub drawing: SurfaceDrawing,
}

/// A drawing on a wall, and the arm on a base that draws it.
pub struct DriveJob {
    /// Number of the arm in the cell.
    pub arm_index: usize,
    /// The arm as it believes itself to be, wherever it stands.
    pub arm: ArmModel,
    /// Where it begins and ends drawing at a place, rad.
    pub home: JointVector,
    /// The base as it believes itself to be.
    pub base: BaseModel,
    /// In the order of drawing.
    pub places: Vec<DrivenPlace>,
    /// The believed canvas.
    pub canvas: Arc<BelievedCanvas>,
    /// What stands round it, world.
    pub obstacles: Arc<Vec<TriMesh>>,
    /// Margins and limits of planning.
    pub options: Arc<PlanOptions>,
    /// How the base drives.
    pub drive: DriveOptions,
    /// How far from its place the base may stand, m: farther, and it drives again.
    pub tolerance: f64,
    /// Share of the sag of its springs that is foretold and corrected for; 0 for none.
    pub sag_known: f64,
    /// How the law lets the hand give way; `None` where it doesn't.
    pub hand: Option<HandStiffness>,
    /// How it aligns itself by looking and feeling; `None` where it draws by its sensor alone.
    pub look: Option<LookOptions>,
}

/// Drives to each place in turn and draws there.
pub struct DrivenStrokes {
    job: DriveJob,
    /// What is planned for the place at which the base stands. It follows from the state, and is made anew after a restart.
    planned: Option<Vec<Segment>>,
    alignment: Option<Alignment>,
    state: State,
}

/// All that changes in it.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    place: usize,
    phase: Phase,
    /// Drives to the present place so far.
    tries: u32,
    /// Where the base stands, as believed.
    stands: Pose,
    /// Layer of the pen in the holder; `None` before the first.
    pen: Option<usize>,
    /// The next segment of the plan for this place.
    segment: usize,
    reach: ReachReport,
    /// Time taken by planning, s: a figure, and no part of what is done.
    #[serde(skip)]
    planning: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Phase {
    /// The way to the place is next.
    Driving,
    /// The base has stopped: the law is to learn where.
    Arriving,
    /// It stands where it is believed to.
    Standing,
    /// It finds out better where, by looking and feeling.
    Aligning,
    /// The law is to learn what was found out.
    Aligned,
    /// Strokes are to be planned.
    Planning,
    /// Strokes are drawn.
    Drawing,
    /// All is drawn here: it looks back before it leaves.
    Leaving,
}

impl State {
    /// What surrounds an alignment, of a job that has one.
    fn around<'a>(&self, job: &'a DriveJob) -> Option<Surrounds<'a>> {
        let options = job.look.as_ref()?;
        let first = || {
            let layers = &job.places.get(self.place)?.drawing.layers;
            layers.iter().position(|l| !l.strokes.is_empty())
        };
        let layer = self.pen.or_else(first).unwrap_or(0);
        let calibrated = options.calibrated();
        Some(Surrounds { job, options, place: self.place, stands: self.stands, layer, calibrated })
    }
}

impl DrivenStrokes {
    /// Carries out a job.
    pub fn new(job: DriveJob) -> Self {
        let state = State {
            place: 0,
            phase: Phase::Driving,
            tries: 0,
            stands: job.base.start.pose(),
            pen: None,
            segment: 0,
            reach: ReachReport::default(),
            planning: 0.0,
        };
        let alignment = job.look.as_ref().map(|options| Alignment::new(options, &job.base.transport));
        Self { job, planned: None, alignment, state }
    }

    /// What could be drawn so far.
    pub fn reach(&self) -> &ReachReport {
        &self.state.reach
    }

    /// Time taken by planning so far, s.
    pub fn planning(&self) -> f64 {
        self.state.planning
    }

    /// What it found out about where it stands, place after place.
    pub fn aligned(&self) -> &[Aligned] {
        self.alignment.as_ref().map_or(&[], Alignment::done)
    }

    /// The next task of the alignment, if it is at work.
    fn align(&mut self) -> Result<Option<Task>, PolicyError> {
        let around = self.state.around(&self.job);
        let (Some(alignment), Some(around)) = (&mut self.alignment, around) else { return Ok(None) };
        alignment.next(&around)
    }

    /// What the alignment has found out of where the base stands.
    fn found_out(&mut self) -> Option<Pose> {
        let around = self.state.around(&self.job)?;
        self.alignment.as_mut()?.conclude(&around)
    }

    /// Goes on to the next place.
    fn leave(&mut self) {
        self.planned = None;
        self.state.place += 1;
        (self.state.phase, self.state.tries) = (Phase::Driving, 0);
    }

    /// The next drive: along the whole way at first, then straight to the place.
    fn drive(&self) -> Task {
        let way = &self.job.places[self.state.place].way;
        let stops = if self.state.tries == 0 { way.clone() } else { way[way.len() - 1..].to_vec() };
        Task::Drive(DrivePath { stops, options: self.job.drive.clone() })
    }

    /// How far the base stands from its place, m.
    fn distance(&self) -> f64 {
        let (at, way) = (BasePose::of(&self.state.stands), &self.job.places[self.state.place].way);
        way.last().map_or(0.0, |place| (place.x - at.x).hypot(place.y - at.y))
    }

    /// All motion at the present place, from the folded posture and back to it, with what became of its strokes.
    fn plan(&self) -> Result<(Vec<Segment>, ReachReport), PolicyError> {
        let DriveJob { base, home, canvas, options, obstacles, .. } = &self.job;
        let folded = base.transport;
        let mut arm = self.job.arm.clone();
        arm.world_from_base = self.state.stands * base.base_from_arm;
        let mut drawing = self.job.places[self.state.place].drawing.clone();
        order(&mut drawing, self.state.pen);
        let job = PlanJob {
            arm_index: self.job.arm_index,
            arm: &arm,
            home,
            service: &folded,
            drawing: &drawing,
            canvas,
            obstacles,
        };
        let planned = plan::plan(&job, options, &mut |_| ())?;
        let Some(first) = planned.plan.segments.first().map(|s| s.layer) else {
            return Ok((Vec::new(), planned.reach));
        };
        let name = arm.name.clone();
        let planner = StepPlanner::new(&Arc::new(arm), home, &[], canvas, obstacles, options);
        let out = planner.travel(canvas, &folded, home);
        let out = out.ok_or(PlanError::NoWay { arm: name, leg: "to where drawing begins" })?;
        let mut segments = Vec::new();
        let mut time = 0.0;
        let mut push = |s: Segment| {
            let start = time;
            time += s.trajectory.duration();
            segments.push(Segment { start, ..s });
        };
        let alone = |kind, trajectory| {
            let depth = DepthProfile::default();
            Segment { kind, layer: first, stroke: None, start: 0.0, trajectory, depth }
        };
        if self.state.pen.is_some_and(|pen| pen != first) {
            push(alone(SegmentKind::ChangePen, Trajectory::rest(folded, options.pen_change)));
        }
        push(alone(SegmentKind::Travel, out));
        planned.plan.segments.into_iter().for_each(&mut push);
        if self.job.sag_known > 0.0 {
            let DriveJob { arm, sag_known, hand, .. } = &self.job;
            segments = SagModel::new(base, arm, &folded, *sag_known, *hand).correct(segments);
        }
        Ok((segments, planned.reach))
    }
}

/// Draws with the pen in the holder first, if it is one of those needed: the inks in their order, or the other way round.
fn order(drawing: &mut SurfaceDrawing, pen: Option<usize>) {
    let used: Vec<usize> = (0..drawing.layers.len()).filter(|l| !drawing.layers[*l].strokes.is_empty()).collect();
    if !plan::cover::turned_round(&used, pen) {
        return;
    }
    let strokes = |l: usize| {
        drawing.layers[l].strokes.iter().map(move |s| StrokeRef { layer: l, stroke: s.index }).collect::<Vec<_>>()
    };
    drawing.order = used.iter().rev().flat_map(|l| strokes(*l)).collect();
}

impl Policy for DrivenStrokes {
    fn next(&mut self) -> Result<Option<Task>, PolicyError> {
        loop {
            if self.state.place == self.job.places.len() {
                return Ok(None);
            }
            match self.state.phase {
                Phase::Driving => return Ok(Some(self.drive())),
                Phase::Arriving => return Ok(Some(Task::BelieveBase(self.state.stands))),
                Phase::Standing if self.distance() > self.job.tolerance && self.state.tries < TRIES => {
                    self.state.phase = Phase::Driving;
                }
                Phase::Standing => {
                    self.state.phase = match &mut self.alignment {
                        Some(alignment) => {
                            alignment.begin(self.state.place, false, &self.job.base.transport);
                            Phase::Aligning
                        }
                        None => Phase::Planning,
                    };
                }
                Phase::Aligning => match self.align()? {
                    Some(task) => return Ok(Some(task)),
                    None => {
                        self.state.phase = match self.found_out() {
                            Some(stands) => {
                                self.state.stands = stands;
                                Phase::Aligned
                            }
                            None => Phase::Planning,
                        };
                    }
                },
                Phase::Aligned => return Ok(Some(Task::BelieveBase(self.state.stands))),
                Phase::Leaving => match self.align()? {
                    Some(task) => return Ok(Some(task)),
                    None => {
                        self.found_out();
                        self.leave();
                    }
                },
                Phase::Planning => {
                    let started = Instant::now();
                    let (segments, reach) = self.plan()?;
                    self.state.planning += started.elapsed().as_secs_f64();
                    self.state.reach.length += reach.length;
                    self.state.reach.reachable_length += reach.reachable_length;
                    self.state.reach.unreachable.extend(reach.unreachable);
                    self.planned = Some(segments);
                    (self.state.phase, self.state.segment) = (Phase::Drawing, 0);
                }
                Phase::Drawing => {
                    if self.planned.is_none() {
                        self.planned = Some(self.plan()?.0);
                    }
                    let segments = self.planned.as_deref().unwrap_or_default();
                    let (at, count) = (self.state.segment, segments.len());
                    let Some(segment) = segments.get(at).cloned() else {
                        self.state.pen = segments.last().map(|s| s.layer).or(self.state.pen);
                        let looks_back = self.job.look.as_ref().is_some_and(|l| l.look_back);
                        match &mut self.alignment {
                            Some(alignment) if looks_back && self.state.place + 1 < self.job.places.len() => {
                                alignment.begin(self.state.place, true, &self.job.base.transport);
                                self.state.phase = Phase::Leaving;
                            }
                            _ => self.leave(),
                        }
                        continue;
                    };
                    self.state.segment += 1;
                    let (begins, ends) = (at == 0, at + 1 == count);
                    return Ok(Some(Task::of(Move { segment, begins, ends, planned: None, visit: None })));
                }
            }
        }
    }

    fn ended(&mut self, task: &Task, outcome: &Outcome) -> Result<(), PolicyError> {
        match task {
            Task::Drive(_) => {
                if let Some(BaseBelief { by_wheels, measured }) = outcome.base {
                    self.state.stands = measured.unwrap_or_else(|| by_wheels.pose());
                }
                self.state.tries += 1;
                self.state.phase = Phase::Arriving;
            }
            Task::BelieveBase(_) if self.state.phase == Phase::Aligned => self.state.phase = Phase::Planning,
            Task::BelieveBase(_) => self.state.phase = Phase::Standing,
            _ if matches!(self.state.phase, Phase::Aligning | Phase::Leaving) => {
                let around = self.state.around(&self.job);
                if let (Some(alignment), Some(around)) = (&mut self.alignment, around) {
                    alignment.ended(&around, outcome);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn gives_up(&self, _: &Task, outcome: &Outcome) -> bool {
        !matches!(outcome.failure, None | Some(TaskFailure::MetNothing))
    }

    fn save(&self) -> Vec<u8> {
        saved(&(&self.state, self.alignment.as_ref().map(|a| &a.state)))
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), PolicyError> {
        let planning = self.state.planning;
        let (state, aligned): (State, Option<AlignmentState>) = restored(bytes)?;
        self.state = state;
        (self.state.planning, self.planned) = (planning, None);
        if let (Some(alignment), Some(aligned)) = (&mut self.alignment, aligned) {
            alignment.restore(aligned);
        }
        Ok(())
    }
}

impl Drawer for DrivenStrokes {
    fn clear_of(&self) -> Result<Arc<BelievedCanvas>, PolicyError> {
        Ok(Arc::clone(&self.job.canvas))
    }

    fn driven(&self) -> Option<&DrivenStrokes> {
        Some(self)
    }
}
