//! Drawing on a canvas that nobody has seen: touch, learn, plan the next piece, draw it.
//!
//! Section V.A.1 of the dissertation. What is planned on is [`TouchedCanvas`] alone.
use std::sync::Arc;
use std::time::Instant;

use nalgebra::{Point2, Point3, Vector3};
use serde::{Deserialize, Serialize};

use super::policy::{restored, saved};
use super::probing::{pieces, probe_places};
use super::{Drawer, Felt, Move, Outcome, Policy, PolicyError, Task, TaskFailure};
use crate::drawing::{Drawing, InkLayer, Stroke, StrokeRef};
use crate::mesh::TriMesh;
use crate::plan::{
    Descent, MotionSample, Obstruction, PlanError, PlanOptions, ReachReport, Segment, SegmentKind, StepPlanner,
    Trajectory, Unreachable,
};
use crate::robot::{ArmModel, JointVector};
use crate::surface::{BelievedCanvas, Projection, SurfaceTarget, TouchedCanvas, map_drawing};

/// How long the pen rests where a guarded motion met something, s.
const DWELL: f64 = 0.12;
/// Touches of that rest that are averaged.
const AVERAGED: usize = 6;
/// Room under the lowest place that a probe may reach, m: what keeps the arm off a canvas that it doesn't know.
const UNDER: f64 = 0.02;
/// How often a piece of a stroke is begun anew before its rest is given up.
const MOST_TRIES: u32 = 6;

/// Settings of drawing by touch.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchOptions {
    /// Where the canvas is sought, m over the sheet's plane: lowest and highest.
    pub range: [f64; 2],
    /// Probes along each side of the drawing.
    pub probes: usize,
    /// Speed of a probe, m/s.
    pub probe_speed: f64,
    /// Force along the pen that means contact, N.
    pub contact_force: f64,
    /// Longest piece of a stroke that is planned at once, m.
    pub piece: f64,
    /// Room between travels and the surface as it is believed, m.
    pub clearance: f64,
    /// How far below the believed surface a landing seeks it, m.
    pub seek: f64,
    /// Spacing of the points of a mapped stroke, m.
    pub step: f64,
}

/// How far from where it was expected a stroke met the canvas.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrokeTouches {
    /// Index of the layer.
    pub layer: usize,
    /// Index of the stroke.
    pub stroke: usize,
    /// When the stroke ended, s.
    pub time: f64,
    /// Touches known before it.
    pub known: usize,
    /// Predicted less met height, m, touch by touch.
    pub errors: Vec<f64>,
}

/// What is to be drawn by touch, and with what.
pub struct TouchJob {
    /// The drawing.
    pub drawing: Drawing,
    /// What is known of the canvas: where its sheet nominally lies, and nothing of its heights.
    pub canvas: TouchedCanvas,
    /// The arm, as it believes itself to be.
    pub arm: Arc<ArmModel>,
    /// Where it begins at rest, rad.
    pub home: JointVector,
    /// Where pens are changed, and where it ends, rad.
    pub service: JointVector,
    /// What is kept clear of besides the canvas, world.
    pub obstacles: Arc<Vec<TriMesh>>,
    /// Settings of the planner.
    pub options: Arc<PlanOptions>,
    /// Settings of touching.
    pub touch: TouchOptions,
    /// Stiffness of each layer's nib, N/m, as the robot knows its pens.
    pub springs: Vec<f64>,
    /// Whether a person puts in each layer's pen; else whoever carries the tasks out has it fetched.
    pub by_hand: bool,
}

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

/// What comes next, or what is under way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Phase {
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
struct Line {
    segment: Segment,
    /// Index of the last target that it reaches.
    reached: usize,
    /// Why it reaches no farther, if it doesn't reach the last.
    stopped: Option<Obstruction>,
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

    /// Goes on from a phase that waits for nothing: the task that it gives, or `None` where another phase follows.
    fn advance(&mut self) -> Result<Option<Task>, PolicyError> {
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
    fn heard(&mut self, met: bool, felt: &[Felt]) {
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

    fn begin_stroke(&mut self) -> Result<(), PolicyError> {
        let place = self.order[self.state.done];
        let stroke = &self.drawing.layers[place.layer].strokes[place.stroke];
        self.state.stroke = StrokeState {
            before: Some(self.state.canvas.clone()),
            pieces: pieces(stroke, self.touch.piece),
            ..StrokeState::default()
        };
        self.begin_piece()
    }

    /// Guarded moves at places of the drawing spread over a grid.
    fn probe(&mut self, i: usize) -> Result<Option<Task>, PolicyError> {
        let [low, high] = self.touch.range;
        let middle = 0.5 * (low + high);
        let Some(place) = self.places.get(i).copied() else {
            if self.state.met_probes == 0 {
                return Err(PolicyError::NothingMet {
                    probes: self.places.len(),
                    range_mm: self.touch.range.map(|m| m * 1e3),
                });
            }
            self.state.probed = Some(self.state.canvas.clone());
            self.planner = None;
            self.state.phase = Phase::NextStroke;
            return Ok(None);
        };
        // the air ends at the top of the range
        let (clear, under) = (self.flat(high)?, self.flat(low - UNDER)?);
        let top = high + self.options.hover - middle;
        let descent = Descent { high: top, slow_from: top, low: low - middle, speed: self.touch.probe_speed };
        let at = self.state.last.q;
        self.planner()?;
        let started = Instant::now();
        let way = self.planner()?.approach(&under, &clear, &place, None, &at, &descent);
        self.state.planning += started.elapsed().as_secs_f64();
        Ok(match way {
            Ok([over, down]) => {
                self.state.phase = Phase::Approaching(down);
                self.state.stroke.piece = i;
                Some(self.alone(SegmentKind::Travel, over))
            }
            Err(_) => {
                self.state.phase = Phase::Probing(i + 1);
                None
            }
        })
    }

    /// After a landing, met or not.
    fn landed(&mut self, met: bool) -> Result<Option<Task>, PolicyError> {
        if self.state.probed.is_none() {
            self.state.met_probes += usize::from(met);
            // back up to where the surface can't be
            let frame = self.state.canvas.sheet().world_from_sheet;
            let tip = self.arm.kinematics(&self.state.last.q).world_from_tip().translation.vector;
            let over = frame.inverse_transform_point(&Point3::from(tip)).z;
            let i = self.state.stroke.piece;
            let height = self.touch.range[1] + self.options.hover - over;
            return self.lift(height, Phase::LeavingProbe(i)).map(Some);
        }
        if !met {
            self.state.stroke.why = Some(Obstruction::NothingMet);
            return self.lift(self.options.hover + self.touch.seek, Phase::LeavingGap).map(Some);
        }
        self.state.stroke.down = true;
        // where it touched tells more of the surface
        self.state.stroke.targets = self.mapped_piece()?;
        self.state.phase = Phase::Piece;
        Ok(None)
    }

    fn next_stroke(&mut self) -> Result<Option<Task>, PolicyError> {
        let Some(place) = self.order.get(self.state.done).copied() else {
            return self.travel_to_service(Phase::GoingHome).map(Some);
        };
        if place.layer == self.state.layer {
            self.state.phase = Phase::StrokeBegins;
            return Ok(None);
        }
        self.travel_to_service(Phase::ToService).map(Some)
    }

    fn begin_piece(&mut self) -> Result<(), PolicyError> {
        let targets = self.mapped_piece()?;
        let s = &mut self.state.stroke;
        s.whole = length(&targets);
        s.targets = targets;
        (s.first, s.tries, s.why) = (0, 0, None);
        self.state.phase = Phase::Piece;
        Ok(())
    }

    /// The rest of a piece: more than once where the arm has to lift the pen within it.
    fn piece(&mut self) -> Result<Option<Task>, PolicyError> {
        let s = &mut self.state.stroke;
        let n = s.targets.len();
        if !(s.first + 1 < n || (n == 1 && s.first == 0)) {
            self.state.phase = Phase::PieceDone;
            return Ok(None);
        }
        s.tries += 1;
        if s.tries > MOST_TRIES {
            s.why = s.why.take().or(Some(Obstruction::NoApproach));
            self.state.phase = Phase::PieceDone;
            return Ok(None);
        }
        let (down, rest, layer, at) = (s.down, s.targets[s.first..].to_vec(), self.state.layer, self.state.last.q);
        self.planner()?;
        let started = Instant::now();
        let canvas = self.believed()?;
        if !down {
            let clear = self.clear()?;
            let descent = Descent {
                high: self.options.hover,
                slow_from: self.touch.clearance,
                low: -self.touch.seek,
                speed: self.options.landing_speed,
            };
            let planner = self.planner()?;
            let way = planner
                .posture(&canvas, &rest, layer)
                .and_then(|q| planner.approach(&canvas, &clear, &rest[0], Some(&q), &at, &descent));
            self.state.planning += started.elapsed().as_secs_f64();
            return Ok(match way {
                Ok([over, down]) => {
                    self.state.phase = Phase::Approaching(down);
                    Some(self.alone(SegmentKind::Travel, over))
                }
                Err(reason) => {
                    self.state.stroke.why = Some(reason);
                    self.state.phase = Phase::PieceDone;
                    None
                }
            });
        }
        let planned = self.planner()?.piece(&canvas, &rest, layer, &at);
        self.state.planning += started.elapsed().as_secs_f64();
        match planned {
            Ok(Some(drawn)) => {
                let stroke = self.stroke_index();
                let segment =
                    |kind, start, trajectory, depth| Segment { kind, layer, stroke, start, trajectory, depth };
                let enter = segment(SegmentKind::Press, 0.0, drawn.enter, Default::default());
                let draw = segment(SegmentKind::Draw, enter.end(), drawn.draw, drawn.depth);
                let line = Line { segment: draw, reached: drawn.reached, stopped: drawn.stopped };
                self.state.phase = Phase::Entering(Box::new(line));
                Ok(Some(Task::Press(Move { segment: enter, begins: true, ends: false, planned: None, visit: None })))
            }
            other => {
                self.state.stroke.down = false;
                if let Err(reason) = other {
                    self.state.stroke.why = Some(reason);
                }
                self.lift(self.off_the_canvas(), Phase::LeavingPiece).map(Some)
            }
        }
    }

    fn learn_line(&mut self, felt: &[Felt]) {
        for f in felt.iter().filter(|f| f.kind == SegmentKind::Draw) {
            let point = self.surface_point(f);
            self.state.stroke.met.push(point);
            self.state.canvas.learn(&point);
        }
    }

    /// Learns the place where the pen rests on the canvas. False when it feels nothing there.
    fn learn_landing(&mut self, felt: &[Felt]) -> bool {
        let points: Vec<Point3<f64>> = felt.iter().rev().take(AVERAGED).map(|f| self.surface_point(f)).collect();
        if points.is_empty() {
            return false;
        }
        let sum: Vector3<f64> = points.iter().map(|p| p.coords).sum();
        self.state.canvas.learn(&Point3::from(sum / points.len() as f64));
        true
    }

    /// The point of the surface that a touch tells of: the nib gives way by its spring.
    fn surface_point(&self, felt: &Felt) -> Point3<f64> {
        felt.tip - felt.axis * (felt.force / self.springs[self.state.layer])
    }

    /// Books a piece that is drawn up to target `first`.
    fn book(&mut self) {
        let place = self.order[self.state.done];
        let layer = &self.drawing.layers[place.layer];
        let (s, reach) = (&mut self.state.stroke, &mut self.state.reach);
        let missing = if s.first >= s.targets.len() { 0.0 } else { length(&s.targets[s.first..]) };
        reach.length += s.whole;
        reach.reachable_length += (s.whole - missing).max(0.0);
        if s.first < s.targets.len() {
            reach.unreachable.push(Unreachable {
                layer: place.layer,
                layer_name: layer.name.clone(),
                stroke: place.stroke,
                first: s.first,
                last: s.targets.len() - 1,
                sheet: s.targets[s.first].sheet,
                length: missing,
                reason: s.why.take().unwrap_or(Obstruction::NoApproach),
            });
        }
    }

    fn end_stroke(&mut self) {
        let place = self.order[self.state.done];
        let Some(before) = self.state.stroke.before.take() else { return };
        let surface = before.surface();
        let frame = before.sheet().world_from_sheet;
        let error = |p: &Point3<f64>| {
            let p = frame.inverse_transform_point(p);
            surface.height(&p.xy()) - p.z
        };
        self.state.touches.push(StrokeTouches {
            layer: place.layer,
            stroke: place.stroke,
            time: self.state.time,
            known: before.touches(),
            errors: self.state.stroke.met.iter().map(error).collect(),
        });
    }

    /// The present piece of the stroke on the canvas as it is believed now.
    fn mapped_piece(&self) -> Result<Vec<SurfaceTarget>, PolicyError> {
        let layer = &self.drawing.layers[self.order[self.state.done].layer];
        let piece = self.state.stroke.pieces[self.state.stroke.piece].clone();
        let alone = InkLayer { strokes: vec![piece], ..layer.clone() };
        let alone = Drawing::new(self.drawing.width, self.drawing.height, vec![alone]);
        let believed = self.believed()?;
        let mut mapped = map_drawing(&alone, &Projection::new(&believed), self.touch.step)?;
        Ok(mapped.layers.remove(0).strokes.into_iter().next().map(|s| s.targets).unwrap_or_default())
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

/// Length of the line through targets, m.
fn length(targets: &[SurfaceTarget]) -> f64 {
    targets.windows(2).map(|w| (w[1].position - w[0].position).norm()).sum()
}
