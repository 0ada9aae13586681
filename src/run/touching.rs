//! Drawing on a canvas that nobody has seen: touch, learn, plan the next piece, draw it.
//!
//! Section V.A.1 of the dissertation. What is planned on is [`TouchedCanvas`] alone; the true canvas is seen by the simulation.
use std::time::Instant;

use nalgebra::{Point2, Point3};

use crate::drawing::{Drawing, InkLayer, Stroke, StrokeRef};
use crate::measure::{BeliefMetrics, MappingMetrics, Metrics, PlanMetrics, StrokeHeights};
use crate::mesh::{self, TriMesh};
use crate::plan::{
    ArmPlan, Descent, MotionSample, Obstruction, Plan, PlanError, PlanOptions, ReachReport, Segment, SegmentKind, Step,
    StepPlanner, Trajectory, Unreachable,
};
use crate::progress::Progress;
use crate::report::{OutputDir, heights_csv, heights_figure};
use crate::robot::JointVector;
use crate::run::cast::Cast;
use crate::run::{RunError, Written, options};
use crate::scenario::{Scenario, TouchSettings};
use crate::skill::{Felt, pieces, probe_places};
use crate::surface::{BelievedCanvas, Mapping, Projection, SurfaceTarget, TouchedCanvas, map_drawing};
use crate::twin::{ArmEnd, Feeling, Guard, Record, Simulation, TwinArm};

/// Steps between two touches that the robot looks at: at drawing speed about half a millimetre.
const STRIDE: u64 = 10;
/// How long the pen rests where a guarded motion met something, s.
const DWELL: f64 = 0.12;
/// Touches of that rest that are averaged.
const AVERAGED: usize = 6;
/// Room under the lowest place that a probe may reach, m: what keeps the arm off a canvas that it doesn't know.
const UNDER: f64 = 0.02;

/// What a run by touch leaves.
pub(super) struct Touched {
    /// All motion, as it was executed.
    pub plan: Plan,
    /// What was drawn and what was not.
    pub reach: ReachReport,
    /// What happened.
    pub record: Record,
    /// How well heights were predicted, stroke by stroke.
    pub heights: Vec<StrokeHeights>,
    /// What is believed at the end.
    pub belief: BelievedCanvas,
    /// Its figures.
    pub metrics: BeliefMetrics,
    /// Wall-clock time of planning, s.
    pub planning: f64,
}

/// Draws `cast.drawing`, learning the canvas by touch. Of `cast` only the simulation sees the true canvas, and nothing sees
/// `cast.belief`.
pub(super) fn draw(
    scenario: &Scenario,
    touch: &TouchSettings,
    cast: &Cast,
    progress: &dyn Progress,
) -> Result<Touched, RunError> {
    let order = cast.drawing.sequence();
    progress.stage("drawing by touch", Some(order.len() as u64));
    let plan_options = options::plan_options(scenario, &cast.pens);
    if let Some((name, value, wanted)) = plan_options.invalid() {
        return Err(PlanError::Option { name, value, wanted }.into());
    }
    let obstacles = cast.obstacles()?;
    let arm = &cast.cell.arms[0];
    let truth = Projection::new(&cast.truth);
    let world = cast.surroundings(scenario, &truth);
    let twin =
        TwinArm { model: arm.model.clone(), controller: options::controller(scenario, &arm.model), start: arm.home };
    let first = order.first().map_or(0, |r| r.layer);
    let mut simulation = Simulation::new(vec![twin], &[first], &world, &options::twin_options(scenario))?;
    simulation.feel(Feeling { force_noise: touch.force_noise_n, contact_force: 0.5 * touch.contact_n, stride: STRIDE });
    let half = Point2::new(0.5 * cast.drawing.width, 0.5 * cast.drawing.height);
    let margin = nalgebra::Vector2::repeat(touch.margin_mm * 1e-3);
    let extent = [Point2::from(-half.coords - margin), Point2::from(half.coords + margin)];
    let canvas = TouchedCanvas::new(cast.scene.canvas.sheet.clone(), extent, touch.spacing_mm * 1e-3);
    let mut hand = Hand {
        simulation,
        canvas,
        springs: cast.pens.iter().map(|p| p.pen.spring.stiffness).collect(),
        touch,
        options: &plan_options,
        at: arm.home,
        last: MotionSample { q: arm.home, qd: JointVector::zeros(), qdd: JointVector::zeros() },
        layer: first,
        done: Vec::new(),
        reach: ReachReport::default(),
        heights: Vec::new(),
        planning: 0.0,
    };

    let probes = hand.probe(&cast.drawing, &arm.model, &arm.home, &obstacles)?;
    let believed = hand.believed(0.0)?;
    let step = scenario.plan.step_mm * 1e-3;
    let mapped = map_drawing(&cast.drawing, &Projection::new(&believed), step)?;
    let all: Vec<SurfaceTarget> =
        mapped.layers.iter().flat_map(|l| &l.strokes).flat_map(|s| s.targets.iter().copied()).collect();
    let started = Instant::now();
    let planner = StepPlanner::new(&arm.model, &arm.home, &all, &believed, &obstacles, &plan_options);
    hand.planning += started.elapsed().as_secs_f64();
    for (done, place) in order.iter().enumerate() {
        if place.layer != hand.layer {
            hand.change_pen(&planner, place.layer, &arm.service)?;
        }
        hand.stroke(&planner, &cast.drawing, *place, step)?;
        if !plan_options.partial && !hand.reach.unreachable.is_empty() {
            return Err(PlanError::Unreachable { report: Box::new(hand.reach) }.into());
        }
        progress.advance(done as u64 + 1);
    }
    hand.travel(&planner, &arm.service)?;

    let belief = hand.believed(0.0)?;
    let colors: Vec<_> = cast.drawing.layers.iter().map(|l| l.color).collect();
    let metrics = BeliefMetrics {
        points: Some(hand.canvas.touches()),
        probes: Some(probes),
        ..BeliefMetrics::of("touch", &cast.truth, &belief, [cast.drawing.width, cast.drawing.height])
    };
    Ok(Touched {
        plan: Plan { arms: vec![ArmPlan { arm: 0, segments: hand.done }] },
        reach: hand.reach,
        record: hand.simulation.finish(&colors),
        metrics: metrics.with_heights(&hand.heights),
        heights: hand.heights,
        belief,
        planning: hand.planning,
    })
}

impl Touched {
    /// Figures of belief, mapping and plan.
    pub fn measured(&self, scenario: &Scenario, cast: &Cast, metrics: &mut Metrics) -> Result<(), RunError> {
        let mapping = Projection::new(&self.belief);
        let started = Instant::now();
        let mapped = map_drawing(&cast.drawing, &mapping, scenario.plan.step_mm * 1e-3)?;
        let seconds = started.elapsed().as_secs_f64();
        metrics.belief = Some(self.metrics.clone());
        metrics.mapping = Some(MappingMetrics::of(mapping.kind(), &cast.drawing, &mapped, seconds));
        metrics.plan = Some(PlanMetrics::of(&self.plan, &self.reach, self.planning));
        Ok(())
    }

    /// Writes how belief grew, and what it came to.
    pub fn write(&self, out: &OutputDir, written: &mut Written) -> Result<(), RunError> {
        let csv = heights_csv(&self.heights);
        written.other(out.write("belief.csv", csv.as_bytes())?, "Predicted less met height, stroke by stroke");
        let content = "The canvas as the robot believes it to be in the end, m, world";
        written.other(out.write("belief.ply", &mesh::ply_bytes(&self.belief.mesh))?, content);
        let svg = heights_figure(&self.heights).svg();
        written.picture(
            out.write("belief.svg", svg.as_bytes())?,
            "How far the pen met the canvas from where it expected it",
        );
        Ok(())
    }
}

/// The arm at work, and what it has learned.
struct Hand<'a> {
    simulation: Simulation<'a>,
    canvas: TouchedCanvas,
    /// Stiffness of each layer's nib, N/m, as the robot knows its pens.
    springs: Vec<f64>,
    touch: &'a TouchSettings,
    options: &'a PlanOptions,
    /// Where the wished motion rests.
    at: JointVector,
    /// What was wished last.
    last: MotionSample,
    layer: usize,
    done: Vec<Segment>,
    reach: ReachReport,
    heights: Vec<StrokeHeights>,
    planning: f64,
}

impl Hand<'_> {
    fn believed(&self, raise: f64) -> Result<BelievedCanvas, RunError> {
        self.canvas.believed(raise).map_err(RunError::Touched)
    }

    /// What travels keep clear of.
    fn clear(&self) -> Result<BelievedCanvas, RunError> {
        self.believed(self.touch.clearance_mm * 1e-3)
    }

    /// Executes steps; returns what was felt, and whether the guard stopped them.
    fn execute(
        &mut self,
        stroke: Option<usize>,
        steps: Vec<Step>,
        guard: Option<Guard>,
    ) -> Result<(Vec<Felt>, bool), RunError> {
        let began = self.simulation.time();
        let plan = Plan::of_steps(self.layer, stroke, steps);
        let mut executed = self.simulation.execute(&plan, guard, &mut |_| ())?;
        let passed = executed.time - began;
        for arm in plan.arms {
            let arm = if executed.stopped.is_some() { arm.until(passed) } else { arm };
            for mut segment in arm.segments {
                segment.start += began;
                self.done.push(segment);
            }
        }
        let ArmEnd { reference, felt, .. } = executed.arms.remove(0);
        self.last = MotionSample { q: reference.q, qd: reference.qd, qdd: reference.qdd };
        self.at = reference.q;
        Ok((felt, executed.stopped.is_some()))
    }

    /// The point of the surface that a touch tells of: the nib gives way by its spring.
    fn surface_point(&self, felt: &Felt) -> Point3<f64> {
        felt.tip - felt.axis * (felt.force / self.springs[self.layer])
    }

    /// Goes over a place, and down until it meets the surface there, which it learns. False when it meets nothing.
    fn land(
        &mut self,
        planner: &StepPlanner,
        [over, down]: [Trajectory; 2],
        stroke: Option<usize>,
    ) -> Result<bool, RunError> {
        self.execute(stroke, vec![step(SegmentKind::Travel, over)], None)?;
        let guard = Guard { force: self.touch.contact_n };
        let (_, met) = self.execute(stroke, vec![step(SegmentKind::Press, down)], Some(guard))?;
        if !met {
            return Ok(false);
        }
        let rest = planner.brake(&self.last, DWELL);
        let (felt, _) = self.execute(stroke, vec![step(SegmentKind::Press, rest)], None)?;
        let points: Vec<Point3<f64>> = felt.iter().rev().take(AVERAGED).map(|f| self.surface_point(f)).collect();
        if points.is_empty() {
            return Ok(false);
        }
        let sum: nalgebra::Vector3<f64> = points.iter().map(|p| p.coords).sum();
        self.canvas.learn(&Point3::from(sum / points.len() as f64));
        Ok(true)
    }

    /// Straight back from the canvas.
    fn lift(&mut self, planner: &StepPlanner, stroke: Option<usize>, height: f64) -> Result<(), RunError> {
        let up = planner.retreat(&self.at, height);
        self.execute(stroke, vec![step(SegmentKind::Lift, up)], None).map(|_| ())
    }

    /// Guarded moves at places of the drawing spread over a grid. Returns how many met the canvas.
    fn probe(
        &mut self,
        drawing: &Drawing,
        arm: &crate::robot::ArmModel,
        home: &JointVector,
        obstacles: &[TriMesh],
    ) -> Result<usize, RunError> {
        let [low, high] = self.touch.range_mm.map(|mm| mm * 1e-3);
        let hover = self.options.hover;
        let middle = 0.5 * (low + high);
        let frame = self.canvas.sheet().world_from_sheet;
        let target = |p: &Point2<f64>| SurfaceTarget {
            position: frame * Point3::new(p.x, p.y, middle),
            normal: frame.rotation * nalgebra::Vector3::z(),
            sheet: *p,
            width: None,
        };
        let places: Vec<SurfaceTarget> =
            probe_places(drawing, self.layer, self.touch.probes as usize).iter().map(target).collect();
        let started = Instant::now();
        // the surface may be anywhere in the range: the air ends at its top, and the pen alone goes under that
        let flat = |height| self.canvas.flat(height).map_err(RunError::Touched);
        let (clear, under) = (flat(high)?, flat(low - UNDER)?);
        let planner = StepPlanner::new(arm, home, &places, &under, obstacles, self.options);
        self.planning += started.elapsed().as_secs_f64();
        let speed = self.touch.probe_speed_mm_s * 1e-3;
        let mut met = 0;
        for place in &places {
            let top = high + hover - middle;
            let descent = Descent { high: top, slow_from: top, low: low - middle, speed };
            let started = Instant::now();
            let way = planner.approach(&under, &clear, place, None, &self.at, &descent);
            self.planning += started.elapsed().as_secs_f64();
            let Ok(way) = way else { continue };
            if self.land(&planner, way, None)? {
                met += 1;
            }
            // back up to where the surface can't be
            let tip = arm.kinematics(&self.at).world_from_tip().translation.vector;
            let over = frame.inverse_transform_point(&Point3::from(tip)).z;
            self.lift(&planner, None, high + hover - over)?;
        }
        if met == 0 {
            return Err(RunError::NothingMet { probes: places.len(), range_mm: self.touch.range_mm });
        }
        Ok(met)
    }

    fn travel(&mut self, planner: &StepPlanner, to: &JointVector) -> Result<(), RunError> {
        let started = Instant::now();
        let (clear, canvas) = (self.clear()?, self.believed(0.0)?);
        let way = planner.travel(&clear, &self.at, to).or_else(|| planner.travel(&canvas, &self.at, to));
        self.planning += started.elapsed().as_secs_f64();
        let way = way.ok_or_else(|| PlanError::NoWay { arm: planner.arm().into(), leg: "to the service pose" })?;
        self.execute(None, vec![step(SegmentKind::Travel, way)], None).map(|_| ())
    }

    fn change_pen(&mut self, planner: &StepPlanner, layer: usize, service: &JointVector) -> Result<(), RunError> {
        self.travel(planner, service)?;
        self.layer = layer;
        let wait = Trajectory::rest(*service, self.options.pen_change);
        self.execute(None, vec![step(SegmentKind::ChangePen, wait)], None).map(|_| ())
    }

    /// Draws one stroke, piece by piece, each planned on what is believed by then.
    fn stroke(
        &mut self,
        planner: &StepPlanner,
        drawing: &Drawing,
        place: StrokeRef,
        step_length: f64,
    ) -> Result<(), RunError> {
        let layer = &drawing.layers[place.layer];
        let stroke = Some(place.stroke);
        let before = self.canvas.clone();
        let mut met: Vec<Point3<f64>> = Vec::new();
        let mut down = false;
        for piece in pieces(&layer.strokes[place.stroke], self.touch.piece_mm * 1e-3) {
            // the rest of this piece; more than once where the arm has to lift the pen within it
            let mut targets = self.map(drawing, layer, &piece, step_length)?;
            let whole = length(&targets);
            let (mut first, mut tries) = (0, 0);
            let mut why = None;
            while first + 1 < targets.len() || (targets.len() == 1 && first == 0) {
                let started = Instant::now();
                let canvas = self.believed(0.0)?;
                let rest = &targets[first..];
                tries += 1;
                if tries > 6 {
                    why = why.or(Some(Obstruction::NoApproach));
                    break;
                }
                if !down {
                    let clear = self.clear()?;
                    let descent = Descent {
                        high: self.options.hover,
                        slow_from: self.touch.clearance_mm * 1e-3,
                        low: -self.touch.seek_mm * 1e-3,
                        speed: self.options.landing_speed,
                    };
                    let way = planner
                        .posture(&canvas, rest, place.layer)
                        .and_then(|q| planner.approach(&canvas, &clear, &rest[0], Some(&q), &self.at, &descent));
                    self.planning += started.elapsed().as_secs_f64();
                    let way = match way {
                        Ok(way) => way,
                        Err(reason) => {
                            why = Some(reason);
                            break;
                        }
                    };
                    if !self.land(planner, way, stroke)? {
                        self.lift(planner, stroke, self.options.hover + self.touch.seek_mm * 1e-3)?;
                        why = Some(Obstruction::NothingMet);
                        break;
                    }
                    down = true;
                    // where it touched tells more of the surface
                    targets = self.map(drawing, layer, &piece, step_length)?;
                    continue;
                }
                let planned = planner.piece(&canvas, rest, place.layer, &self.at);
                self.planning += started.elapsed().as_secs_f64();
                match planned {
                    Ok(Some(drawn)) => {
                        let steps =
                            vec![step(SegmentKind::Press, drawn.enter), (SegmentKind::Draw, drawn.draw, drawn.depth)];
                        let (felt, _) = self.execute(stroke, steps, None)?;
                        for f in felt.iter().filter(|f| f.kind == SegmentKind::Draw) {
                            let point = self.surface_point(f);
                            met.push(point);
                            self.canvas.learn(&point);
                        }
                        if drawn.stopped.is_none() {
                            first = targets.len();
                            break;
                        }
                        first += drawn.reached;
                        (why, down) = (drawn.stopped, false);
                    }
                    Ok(None) => down = false,
                    Err(reason) => (why, down) = (Some(reason), false),
                }
                if !down {
                    self.lift(planner, stroke, self.options.hover + self.options.press.largest())?;
                }
            }
            self.book(layer, place, &targets, first, whole, why);
        }
        if down {
            self.lift(planner, stroke, self.options.hover + self.options.press.largest())?;
        }
        let surface = before.surface();
        let frame = before.sheet().world_from_sheet;
        let errors = met.iter().map(|p| {
            let p = frame.inverse_transform_point(p);
            surface.height(&p.xy()) - p.z
        });
        let time = self.simulation.time();
        self.heights.extend(StrokeHeights::of(place.layer, place.stroke, time, before.touches(), errors));
        Ok(())
    }

    /// Books a piece that is drawn up to target `first`.
    fn book(
        &mut self,
        layer: &InkLayer,
        place: StrokeRef,
        targets: &[SurfaceTarget],
        first: usize,
        whole: f64,
        why: Option<Obstruction>,
    ) {
        let missing = if first >= targets.len() { 0.0 } else { length(&targets[first..]) };
        self.reach.length += whole;
        self.reach.reachable_length += (whole - missing).max(0.0);
        if first < targets.len() {
            self.reach.unreachable.push(Unreachable {
                layer: place.layer,
                layer_name: layer.name.clone(),
                stroke: place.stroke,
                first,
                last: targets.len() - 1,
                sheet: targets[first].sheet,
                length: missing,
                reason: why.unwrap_or(Obstruction::NoApproach),
            });
        }
    }

    /// A piece of a stroke on the canvas as it is believed now.
    fn map(
        &self,
        drawing: &Drawing,
        layer: &InkLayer,
        piece: &Stroke,
        step: f64,
    ) -> Result<Vec<SurfaceTarget>, RunError> {
        let alone = InkLayer { strokes: vec![piece.clone()], ..layer.clone() };
        let alone = Drawing::new(drawing.width, drawing.height, vec![alone]);
        let believed = self.believed(0.0)?;
        let mut mapped = map_drawing(&alone, &Projection::new(&believed), step)?;
        Ok(mapped.layers.remove(0).strokes.into_iter().next().map(|s| s.targets).unwrap_or_default())
    }
}

fn step(kind: SegmentKind, trajectory: Trajectory) -> Step {
    (kind, trajectory, Default::default())
}

/// Length of the line through targets, m.
fn length(targets: &[SurfaceTarget]) -> f64 {
    targets.windows(2).map(|w| (w[1].position - w[0].position).norm()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Pose;
    use nalgebra::Vector3;

    /// A square on a bucket.
    const SQUARE: &str = "[drawing]\nwidth_mm = 24\n[drawing.pattern]\nkind = 'grid'\nn = 1\n[canvas]\nscene = 'bucket'\n\
        belief = 'touch'\n[touch]\nrange_mm = [-90, 10]\nprobes = 2\n[sim]\nplant = 'articulated'\n[plan]\nhover_mm = 10\n";

    #[test]
    fn a_wrong_mesh_in_beliefs_place_makes_no_difference() {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/square.toml");
        let scenario = Scenario::parse(SQUARE, &file, &[]).unwrap();
        let touch = scenario.touch.clone().unwrap();
        let sketch = crate::scenario::Sketch::from(&scenario);
        let drawing = crate::artwork::make(&sketch, &crate::progress::Silent).unwrap().drawing;
        let pens = crate::artwork::pens(&drawing, &sketch.pen).unwrap();
        let mut cast = Cast::load(&scenario, drawing, pens).unwrap();
        let honest = draw(&scenario, &touch, &cast, &crate::progress::Silent).unwrap();
        assert_eq!(honest.reach.fraction(), 1.0);
        assert!(honest.metrics.error_mean_mm.unwrap() < 0.5, "{:?}", honest.metrics);
        // the nominal canvas is a wall that stands elsewhere, and askew
        let wrong = Pose::new(Vector3::new(0.02, 0.01, 0.03), Vector3::new(0.1, 0.2, 0.0));
        cast.belief.0.mesh = cast.belief.0.mesh.transformed(&wrong);
        let misled = draw(&scenario, &touch, &cast, &crate::progress::Silent).unwrap();
        assert_eq!(honest.record.digest, misled.record.digest);
        assert!(honest.plan == misled.plan && honest.heights == misled.heights);
        // another truth is met, though
        cast.truth.0.mesh = cast.truth.0.mesh.transformed(&Pose::translation(0.01, 0.0, 0.0));
        let other = draw(&scenario, &touch, &cast, &crate::progress::Silent).unwrap();
        assert_ne!(honest.record.digest, other.record.digest);
        assert!(other.metrics.error_mean_mm.unwrap() < 0.5, "{:?}", other.metrics);
    }
}
