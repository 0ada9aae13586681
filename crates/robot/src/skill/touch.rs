//! Drawing on a canvas that nobody has seen: touch, learn, plan the next piece, draw it.
//!
//! Section V.A.1 of the dissertation. What is planned on is [`TouchedCanvas`] alone.
mod job;
mod phase;
mod piece;
mod probe;

use std::sync::Arc;
use std::time::Instant;

use nalgebra::{Point2, Point3, Vector3};
use serde::{Deserialize, Serialize};

use super::policy::{restored, saved};
use super::probing::probe_places;
use super::{Drawer, Outcome, Policy, PolicyError, Task, TaskFailure};
use crate::drawing::{Drawing, Stroke, StrokeRef};
use crate::mesh::TriMesh;
use crate::plan::{
    MotionSample, Obstruction, PlanError, PlanOptions, ReachReport, SegmentKind, StepPlanner, Trajectory,
};
use crate::robot::{ArmModel, JointVector};
use crate::surface::{BelievedCanvas, Projection, SurfaceTarget, TouchedCanvas, map_drawing};

pub use job::{StrokeTouches, TouchJob, TouchOptions};

use phase::Phase;

/// Room under the lowest place that a probe may reach, m: what keeps the arm off a canvas that it doesn't know.
const UNDER: f64 = 0.02;

/// Draws strokes, learning the canvas by touch.
pub struct TouchStrokes {
    drawing: Drawing,
    order: Vec<StrokeRef>,
    arm: Arc<ArmModel>,
    home: JointVector,
    service: JointVector,
    obstacles: Arc<Vec<TriMesh>>,
    options: Arc<PlanOptions>,
    touch: TouchOptions,
    /// Stiffness of each layer's nib, N/m, as the robot knows its pens.
    springs: Vec<f64>,
    /// Whether a person puts in each layer's pen.
    by_hand: bool,
    places: Vec<SurfaceTarget>,
    planner: Option<StepPlanner>,
    state: State,
}

/// All that changes.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    canvas: TouchedCanvas,
    /// What was known when the strokes' planner was made.
    probed: Option<TouchedCanvas>,
    phase: Phase,
    layer: usize,
    /// Where the desired motion rests, and its last sample.
    last: MotionSample,
    met_probes: usize,
    /// How many strokes of the order are done.
    done: usize,
    stroke: StrokeState,
    reach: ReachReport,
    touches: Vec<StrokeTouches>,
    /// Wall-clock time of planning, s.
    planning: f64,
    time: f64,
}

/// The stroke under way.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct StrokeState {
    /// What was known before it.
    before: Option<TouchedCanvas>,
    pieces: Vec<Stroke>,
    piece: usize,
    targets: Vec<SurfaceTarget>,
    whole: f64,
    first: usize,
    tries: u32,
    why: Option<Obstruction>,
    down: bool,
    met: Vec<Point3<f64>>,
}

impl TouchStrokes {
    /// Draws `job.drawing`; probes come first.
    ///
    /// # Errors
    /// The planner's options can't be used.
    pub fn new(job: TouchJob) -> Result<Self, PolicyError> {
        let TouchJob { drawing, canvas, arm, home, service, obstacles, options, touch, springs, by_hand } = job;
        if let Some((name, value, wanted)) = options.invalid() {
            return Err(PlanError::Option { name, value, wanted }.into());
        }
        let order = drawing.sequence();
        let layer = order.first().map_or(0, |r| r.layer);
        let [low, high] = touch.range;
        let middle = 0.5 * (low + high);
        let frame = canvas.sheet().world_from_sheet;
        let target = |p: &Point2<f64>| SurfaceTarget {
            position: frame * Point3::new(p.x, p.y, middle),
            normal: frame.rotation * Vector3::z(),
            sheet: *p,
            width: None,
        };
        let places = probe_places(&drawing, layer, touch.probes).iter().map(target).collect();
        let state = State {
            canvas,
            probed: None,
            phase: Phase::Probing(0),
            layer,
            last: MotionSample { q: home, qd: JointVector::zeros(), qdd: JointVector::zeros() },
            met_probes: 0,
            done: 0,
            stroke: StrokeState::default(),
            reach: ReachReport::default(),
            touches: Vec::new(),
            planning: 0.0,
            time: 0.0,
        };
        Ok(Self {
            drawing,
            order,
            arm,
            home,
            service,
            obstacles,
            options,
            touch,
            springs,
            by_hand,
            places,
            planner: None,
            state,
        })
    }

    /// What was drawn and what was not.
    pub fn reach(&self) -> &ReachReport {
        &self.state.reach
    }

    /// How well heights were predicted, stroke by stroke.
    pub fn touches(&self) -> &[StrokeTouches] {
        &self.state.touches
    }

    /// How many probes met the canvas.
    pub fn met_probes(&self) -> usize {
        self.state.met_probes
    }

    /// How many touches are known.
    pub fn known(&self) -> usize {
        self.state.canvas.touches()
    }

    /// Wall-clock time of planning, s.
    pub fn planning(&self) -> f64 {
        self.state.planning
    }

    /// The canvas as it is believed now.
    ///
    /// # Errors
    /// Too little was touched for a surface.
    pub fn believed(&self) -> Result<BelievedCanvas, PolicyError> {
        self.raised(0.0)
    }

    fn raised(&self, raise: f64) -> Result<BelievedCanvas, PolicyError> {
        self.state.canvas.believed(raise).map_err(PolicyError::Touched)
    }

    /// What travels keep clear of.
    fn clear(&self) -> Result<BelievedCanvas, PolicyError> {
        self.raised(self.touch.clearance)
    }

    fn flat(&self, height: f64) -> Result<BelievedCanvas, PolicyError> {
        self.state.canvas.flat(height).map_err(PolicyError::Touched)
    }

    fn planner_for(&self, targets: &[SurfaceTarget], canvas: &BelievedCanvas) -> StepPlanner {
        StepPlanner::new(&self.arm, &self.home, targets, canvas, &self.obstacles, &self.options)
    }

    /// The planner of what comes now: for probes over places in the air, then for strokes on what the probes met.
    fn planner(&mut self) -> Result<&StepPlanner, PolicyError> {
        if self.planner.is_none() {
            let started = Instant::now();
            let planner = match &self.state.probed {
                // the surface may be anywhere in the range: the pen alone goes under its top
                None => self.planner_for(&self.places, &self.flat(self.touch.range[0] - UNDER)?),
                Some(probed) => {
                    let believed = probed.believed(0.0).map_err(PolicyError::Touched)?;
                    let mapped = map_drawing(&self.drawing, &Projection::new(&believed), self.touch.step)?;
                    let strokes = mapped.layers.iter().flat_map(|l| &l.strokes);
                    let all: Vec<SurfaceTarget> = strokes.flat_map(|s| s.targets.iter().copied()).collect();
                    self.planner_for(&all, &believed)
                }
            };
            self.state.planning += started.elapsed().as_secs_f64();
            self.planner = Some(planner);
        }
        self.planner.as_ref().ok_or(PolicyError::Saved(postcard::Error::DeserializeUnexpectedEnd))
    }

    /// The stroke that is under way, as an index for records; none while probing.
    fn stroke_index(&self) -> Option<usize> {
        self.state.probed.as_ref().and_then(|_| self.order.get(self.state.done)).map(|r| r.stroke)
    }

    fn alone(&self, kind: SegmentKind, trajectory: Trajectory) -> Task {
        let of_stroke = matches!(kind, SegmentKind::Press | SegmentKind::Draw | SegmentKind::Lift);
        Task::alone(kind, self.state.layer, self.stroke_index().filter(|_| of_stroke), trajectory)
    }

    fn lift(&mut self, height: f64, next: Phase) -> Result<Task, PolicyError> {
        let at = self.state.last.q;
        let up = self.planner()?.retreat(&at, height);
        self.state.phase = next;
        Ok(self.alone(SegmentKind::Lift, up))
    }

    /// How far a pen is lifted that was pressed in.
    fn off_the_canvas(&self) -> f64 {
        self.options.hover + self.options.press.largest()
    }

    fn travel_to_service(&mut self, next: Phase) -> Result<Task, PolicyError> {
        let (at, service) = (self.state.last.q, self.service);
        self.planner()?;
        let started = Instant::now();
        let (clear, canvas) = (self.clear()?, self.believed()?);
        let planner = self.planner()?;
        let way = planner.travel(&clear, &at, &service).or_else(|| planner.travel(&canvas, &at, &service));
        let way = way.ok_or_else(|| PlanError::NoWay { arm: self.arm.name.clone(), leg: "to the service pose" })?;
        self.state.planning += started.elapsed().as_secs_f64();
        self.state.phase = next;
        Ok(self.alone(SegmentKind::Travel, way))
    }
}

impl Policy for TouchStrokes {
    fn next(&mut self) -> Result<Option<Task>, PolicyError> {
        while self.state.phase != Phase::Done {
            if let Some(task) = self.advance()? {
                return Ok(Some(task));
            }
        }
        Ok(None)
    }

    fn ended(&mut self, _: &Task, outcome: &Outcome) -> Result<(), PolicyError> {
        self.state.last = outcome.reference;
        self.state.time = outcome.time;
        let met = outcome.failure.is_none();
        self.heard(met, &outcome.felt);
        Ok(())
    }

    fn gives_up(&self, _: &Task, outcome: &Outcome) -> bool {
        !matches!(outcome.failure, None | Some(TaskFailure::MetNothing))
    }

    fn save(&self) -> Vec<u8> {
        saved(&self.state)
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), PolicyError> {
        self.state = restored(bytes)?;
        self.planner = None;
        Ok(())
    }
}

impl Drawer for TouchStrokes {
    fn clear_of(&self) -> Result<Arc<BelievedCanvas>, PolicyError> {
        let known = self.state.probed.is_some();
        Ok(Arc::new(if known { self.clear()? } else { self.flat(self.touch.range[1])? }))
    }

    fn touched(&self) -> Option<&TouchStrokes> {
        Some(self)
    }
}
