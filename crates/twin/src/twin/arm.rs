//! One simulated arm: its controller, its pen, and where it is in its motion. All of it that changes is [`ArmState`].
use std::collections::{BTreeMap, VecDeque};

use nalgebra::{Point3, Vector3};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::control::{Controller, MeasuredState, Press, Reference};
use crate::drawing::StrokeId;
use crate::ink::{InkRecorder, InkStroke, NibContact};
use crate::math::standard_normal;
use crate::math::stats::Running;
use crate::pen::LayerPen;
use crate::plan::{Segment, SegmentKind, Trajectory};
use crate::robot::{ArmModel, JointVector, Kinematics};
use crate::skill::Felt;
use crate::twin::contact::{Contact, Nib, Touching};
use crate::twin::log::{ArmEnding, ArmLog, Totals};
use crate::twin::scene::TrueScene;
use crate::twin::sense::TipSensor;
use crate::twin::{ArmSample, Event, EventKind, StrokeRecord, TipForce, TipState};

/// Time between two looks at whether a motion leads through a singular posture, s.
const SINGULAR_LOOK: f64 = 0.1;
/// Time in which the law goes over from the hand to the joints, s.
const GOING_OVER: f64 = 0.1;

/// An arm as the twin is given it.
#[derive(Clone, Debug)]
pub struct TwinArm {
    /// The true arm: what the plant is made of.
    pub model: ArmModel,
    /// The controller, with its own belief of the arm.
    pub controller: Controller,
}

/// All of an arm that changes, but for the plant.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ArmState {
    index: usize,
    pub(crate) model: ArmModel,
    pub(crate) controller: Controller,
    /// Whether the controller's model is the true arm's, so that both have the same kinematics.
    known: bool,
    /// When the timeline under way began, s, and at which step.
    began: f64,
    pub(crate) began_step: u64,
    /// What was desired last; held where there is nothing to do.
    desired: Reference,
    /// How far a policy has moved the reference, rad.
    correction: Option<JointVector>,
    sensor: Option<TipSensor>,
    /// Whether the present task's segment has begun.
    entered: bool,
    /// Whether that segment leads through a posture in which the law can't move the hand every way.
    singular: bool,
    cursor: usize,
    depth_cursor: usize,
    nib: Nib,
    recorder: InkRecorder,
    /// Pens that are put down, with the ink left in them, by layer.
    shelf: BTreeMap<usize, InkRecorder>,
    layer: usize,
    touching: bool,
    had_contact: bool,
    /// The torques that are still on their way to the motors.
    pending: VecDeque<JointVector>,
    delay_steps: usize,
    noise: Option<(ChaCha8Rng, f64)>,
    stroke: Option<StrokeRecord>,
    last_q: Option<JointVector>,
    pub(crate) totals: Totals,
}

/// How an arm's loop is delayed and disturbed.
pub(crate) struct Disturbance {
    /// Steps from measuring to acting.
    pub(crate) delay_steps: usize,
    /// Noise of each joint-torque sensor and its standard deviation, N m.
    pub(crate) noise: Option<(ChaCha8Rng, f64)>,
}

/// What an arm meets in one step.
pub(crate) struct Moment<'a> {
    pub(crate) segment: &'a Segment,
    /// Time, s, and the step's length, s.
    pub(crate) time: f64,
    pub(crate) dt: f64,
    pub(crate) state: &'a MeasuredState,
    pub(crate) kinematics: &'a Kinematics,
    pub(crate) tip: &'a TipState,
    pub(crate) scene: &'a TrueScene,
    /// Whether it is recorded.
    pub(crate) sample: bool,
}

/// What an arm does in one step.
pub(crate) struct ArmStep {
    pub(crate) torque: JointVector,
    pub(crate) force: TipForce,
}

impl ArmState {
    pub(crate) fn new(
        index: usize,
        arm: TwinArm,
        start: JointVector,
        layer: usize,
        pens: &[LayerPen],
        disturbance: Disturbance,
    ) -> Self {
        let TwinArm { model, controller } = arm;
        Self {
            index,
            known: same_chain(&model, controller.model()),
            model,
            controller,
            began: 0.0,
            began_step: 0,
            desired: Reference::rest(start),
            correction: None,
            sensor: None,
            entered: false,
            singular: false,
            cursor: 0,
            depth_cursor: 0,
            nib: Nib::default(),
            recorder: InkRecorder::new(pens[layer].pen.clone(), layer as u32, index as u32),
            shelf: BTreeMap::new(),
            layer,
            touching: false,
            had_contact: false,
            pending: VecDeque::new(),
            delay_steps: disturbance.delay_steps,
            noise: disturbance.noise,
            stroke: None,
            last_q: None,
            totals: Totals::default(),
        }
    }

    /// Index of the arm among those that draw.
    pub(crate) fn index(&self) -> usize {
        self.index
    }

    /// Whether a segment is under way.
    pub(crate) fn is_entered(&self) -> bool {
        self.entered
    }

    /// The motion that was desired last.
    pub(crate) fn desired(&self) -> &Reference {
        &self.desired
    }

    /// The layer whose pen the arm draws with.
    pub(crate) fn layer(&self) -> usize {
        self.layer
    }

    /// Lets the arm feel what it touches.
    pub(crate) fn feel(&mut self, sensor: TipSensor) {
        self.sensor = Some(sensor);
    }

    /// Force along the pen that the arm felt in the last step, N; 0 without a sensor.
    pub(crate) fn felt_force(&self) -> f64 {
        self.sensor.as_ref().map_or(0.0, TipSensor::force)
    }

    /// Begins a timeline at `time`: the starts of segments are counted from here.
    pub(crate) fn begin_timeline(&mut self, time: f64, step: u64) {
        (self.began, self.began_step) = (time, step);
    }

    /// Time since the timeline began, s.
    pub(crate) fn since(&self, time: f64) -> f64 {
        time - self.began
    }

    /// Begins a segment, unless it is under way.
    pub(crate) fn enter(&mut self, segment: &Segment, time: f64, scene: &TrueScene, log: &mut ArmLog) {
        if std::mem::replace(&mut self.entered, true) {
            return;
        }
        (self.cursor, self.depth_cursor) = (0, 0);
        self.correction = None;
        self.singular = segment.kind == SegmentKind::Travel && self.passes_singular(&segment.trajectory);
        let stroke = stroke_id(segment);
        let (arm, events) = (self.index, &mut log.events);
        let mut event = |kind| events.push(Event { time, arm, stroke, kind });
        event(EventKind::Segment { kind: segment.kind });
        if segment.kind == SegmentKind::ChangePen && segment.layer != self.layer {
            event(EventKind::PenChanged { ink: scene.pens[segment.layer].ink.clone() });
            self.take_pen(segment.layer, &scene.pens);
        }
        if let (SegmentKind::Draw, Some(stroke)) = (segment.kind, stroke) {
            self.stroke = Some(StrokeRecord {
                stroke,
                start: self.began + segment.start,
                end: self.began + segment.end(),
                steps: 0,
                contact_steps: 0,
                lost_contacts: 0,
                force: Running::default(),
                target: Running::default(),
                force_error: Running::default(),
                saturated_steps: 0,
                lateral_error: Running::default(),
            });
        }
    }

    /// Whether a motion leads through a posture in which the law can't move the hand every way, as far as the robot knows.
    fn passes_singular(&self, trajectory: &Trajectory) -> bool {
        let looks = (trajectory.duration() / SINGULAR_LOOK).ceil().max(1.0) as usize;
        let mut cursor = 0;
        (0..=looks).any(|i| {
            let time = trajectory.duration() * i as f64 / looks as f64;
            self.controller.is_singular(&trajectory.sample(time, &mut cursor).q)
        })
    }

    /// Ends the segment under way: what was felt in it.
    pub(crate) fn leave(&mut self, log: &mut ArmLog) -> Vec<Felt> {
        self.entered = false;
        log.strokes.extend(self.stroke.take());
        self.drain(log);
        self.sensor.as_mut().map(TipSensor::take).unwrap_or_default()
    }

    /// Moves the lines that have ended to the log.
    pub(crate) fn drain(&mut self, log: &mut ArmLog) {
        log.ink.append(&mut self.recorder.take_ended());
    }

    /// Takes up the pen of a layer, with the ink that is left in it, and puts the one before down.
    fn take_pen(&mut self, layer: usize, pens: &[LayerPen]) {
        if layer == self.layer {
            return;
        }
        let fresh = || InkRecorder::new(pens[layer].pen.clone(), layer as u32, self.index as u32);
        let taken = self.shelf.remove(&layer).unwrap_or_else(fresh);
        let mut put_down = std::mem::replace(&mut self.recorder, taken);
        put_down.cap();
        self.shelf.insert(self.layer, put_down);
        self.layer = layer;
    }

    /// The arm stands on a base that moves: the law never has the true arm's kinematics.
    pub(crate) fn stand_on_base(&mut self) {
        self.known = false;
    }

    /// Goes on as `arm` with the pen of `layer`: the same arm with something else in its hand, commanded to stand at `desired`.
    pub(crate) fn take_in_hand(&mut self, arm: TwinArm, desired: JointVector, layer: usize, pens: &[LayerPen]) {
        self.take_pen(layer, pens);
        self.recorder.cap();
        self.desired = Reference::rest(desired);
        self.known = same_chain(&arm.model, arm.controller.model());
        (self.model, self.controller) = (arm.model, arm.controller);
        self.nib = Nib::default();
        self.pending.clear();
        self.had_contact = false;
    }

    /// The joints go on from here, rad, as something else has moved them.
    pub(crate) fn moved_to(&mut self, q: JointVector) {
        self.last_q = Some(q);
    }

    /// The pen has been in the open for `time` s more.
    pub(crate) fn advance_drying(&mut self, time: f64) {
        self.recorder.advance_drying(time);
    }

    /// Adds `correction` to the desired joints until it is set anew, rad.
    pub(crate) fn correct(&mut self, correction: JointVector) {
        self.correction = Some(correction);
    }

    /// One control step: torques from the desired motion, the pen's contact, ink and records.
    pub(crate) fn step(&mut self, now: &Moment, log: &mut ArmLog) -> ArmStep {
        let Moment { segment, time, dt, state, kinematics: k, scene, .. } = *now;
        let stroke = stroke_id(segment);
        let t = time - self.began - segment.start;
        let m = segment.trajectory.sample(t, &mut self.cursor);
        let nib = scene.spring(self.layer).stiffness;
        let press = self.press(segment, t, nib);
        let by_joint = if self.singular { within(t, segment.trajectory.duration()) } else { 0.0 };
        let q = self.correction.map_or(m.q, |c| m.q + c);
        let desired = Reference { q, qd: m.qd, qdd: m.qdd, press, by_joint };
        self.desired = desired;

        let contact = self.touch(now);
        self.draw(now, contact.as_ref(), stroke, log);

        // the law knows the joints that its sensors tell, and by its own model where they put the tip
        let believed = self.controller.model();
        let own = (!self.known).then(|| believed.kinematics(&state.q));
        let command = self.controller.torque(state, own.as_ref().unwrap_or(k), &desired, dt);
        let torque = self.delayed(command.torque);
        let force = contact.map_or_else(TipForce::default, |c| TipForce { point: c.point, force: c.force });

        if let Some(sensor) = &mut self.sensor {
            let model = self.controller.model();
            sensor.step(time, segment.kind, stroke, model, &state.q, &force.force);
        }
        self.watch(now, contact.as_ref(), &desired.press, command.saturated);
        if now.sample {
            let n = self.model.dof();
            log.samples.push(ArmSample {
                time,
                segment: segment.kind,
                q: state.q.as_slice()[..n].to_vec(),
                qd: state.qd.as_slice()[..n].to_vec(),
                torque: Some(torque.as_slice()[..n].to_vec()),
                tip: Point3::from(now.tip.pose.translation.vector),
                tip_desired: Some(self.controller.set_point()),
                force: Some(force.force),
                normal_force: Some(contact.map_or(0.0, |c| c.normal_force)),
            });
        }
        ArmStep { torque, force }
    }

    /// The press that the plan asks for, `f = k delta` (eq. 6.1) with the stiffness along the pen.
    fn press(&mut self, segment: &Segment, time: f64, nib: f64) -> Press {
        if segment.kind != SegmentKind::Draw {
            return Press::default();
        }
        let d = segment.depth.at(time, &mut self.depth_cursor);
        let stiffness = self.controller.press_stiffness(nib);
        Press { expected_force: stiffness * d.depth, rate: d.rate, acceleration: d.acceleration }
    }

    fn touch(&mut self, now: &Moment) -> Option<Contact> {
        let spring = now.scene.spring(self.layer);
        let friction = (spring.friction * now.scene.friction).sqrt();
        let TipState { pose, velocity, mass } = *now.tip;
        let touching = Touching {
            tip: Point3::from(pose.translation.vector),
            axis: pose.rotation * Vector3::z(),
            velocity,
            mass,
            dt: now.dt,
        };
        self.nib.touch(&spring, friction, now.scene.canvas.mesh(), &touching)
    }

    fn draw(&mut self, now: &Moment, contact: Option<&Contact>, stroke: Option<StrokeId>, log: &mut ArmLog) {
        let time = now.time;
        if contact.is_some() != self.touching {
            self.touching = contact.is_some();
            let kind = if self.touching { EventKind::Touch } else { EventKind::Leave };
            log.events.push(Event { time, arm: self.index, stroke, kind });
        }
        let nib = contact.map(|c| NibContact {
            position: c.at.position,
            normal: c.at.normal,
            normal_force: c.normal_force,
            slip_speed: c.slip.norm(),
        });
        self.recorder.step(now.dt, time, nib.as_ref(), stroke, |p| now.scene.mapping.to_sheet(p));
    }

    fn watch(&mut self, now: &Moment, contact: Option<&Contact>, press: &Press, saturated: bool) {
        let (kind, q) = (now.segment.kind, now.state.q);
        let t = &mut self.totals;
        t.steps += 1;
        if let Some(last) = &self.last_q {
            t.max_joint_step = t.max_joint_step.max((q - last).amax());
        }
        self.last_q = Some(q);
        let had_contact = std::mem::replace(&mut self.had_contact, contact.is_some());
        let normal_force = contact.map_or(0.0, |c| c.normal_force);
        t.max_force = t.max_force.max(normal_force);
        if contact.is_some() && matches!(kind, SegmentKind::Travel | SegmentKind::ChangePen | SegmentKind::Wait) {
            t.pen_up_contact_steps += 1;
        }
        if let Some(s) = &mut self.stroke {
            s.steps += 1;
            s.force.push(normal_force);
            s.target.push(press.expected_force);
            s.force_error.push(normal_force - press.expected_force);
            s.saturated_steps += u64::from(saturated);
            if contact.is_some() {
                s.contact_steps += 1;
            } else if had_contact {
                s.lost_contacts += 1;
            }
            let desired = self.controller.set_point();
            let off = now.kinematics.world_from_tip().inverse() * desired;
            s.lateral_error.push(off.x.hypot(off.y));
        }
    }

    /// The torque that acts now: what was commanded `delay_steps` ago, with the torque sensors' noise on it.
    fn delayed(&mut self, torque: JointVector) -> JointVector {
        let mut acting = torque;
        if self.delay_steps > 0 {
            if self.pending.is_empty() {
                self.pending.extend(std::iter::repeat_n(torque, self.delay_steps));
            }
            self.pending.push_back(torque);
            acting = self.pending.pop_front().unwrap_or(torque);
        }
        if let Some((rng, sd)) = &mut self.noise {
            for i in 0..self.model.dof() {
                acting[i] += *sd * standard_normal(rng);
            }
        }
        acting
    }

    /// How the arm stands at `time`, and what of its lines and strokes hasn't ended.
    pub(crate) fn ending(&self, time: f64, state: &MeasuredState) -> ArmEnding {
        let n = self.model.dof();
        let ink: Vec<InkStroke> =
            self.shelf.values().chain([&self.recorder]).flat_map(|r| r.lines().iter().cloned()).collect();
        ArmEnding {
            time,
            q: state.q.as_slice()[..n].to_vec(),
            qd: state.qd.as_slice()[..n].to_vec(),
            totals: self.totals,
            ink,
            stroke: self.stroke.clone(),
            base: None,
        }
    }
}

/// How far within a motion of this duration a time is: 0 at its ends, 1 from [`GOING_OVER`] away from them.
fn within(time: f64, duration: f64) -> f64 {
    let u = (time.min(duration - time) / GOING_OVER).clamp(0.0, 1.0);
    u * u * (3.0 - 2.0 * u)
}

/// Whether two models are the same chain of joints with the same tip.
fn same_chain(a: &ArmModel, b: &ArmModel) -> bool {
    let joint = |j: &crate::robot::JointModel| (j.parent_from_joint, j.axis, j.kind);
    a.world_from_base == b.world_from_base
        && a.last_from_tip == b.last_from_tip
        && a.joints.len() == b.joints.len()
        && a.joints.iter().zip(&b.joints).all(|(a, b)| joint(a) == joint(b))
}

fn stroke_id(segment: &Segment) -> Option<StrokeId> {
    Some(StrokeId { layer: segment.layer as u32, index: segment.stroke? as u32 })
}
