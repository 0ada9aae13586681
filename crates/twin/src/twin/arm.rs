//! One simulated arm: its controller, its pen, and where it is in its plan.
use std::collections::{BTreeMap, VecDeque};

use nalgebra::{Point3, Vector3};
use rand_chacha::ChaCha8Rng;

use crate::control::{Controller, MeasuredState, Press, Reference};
use crate::drawing::StrokeId;
use crate::ink::{InkRecorder, NibContact};
use crate::math::standard_normal;
use crate::math::stats::Running;
use crate::pen::{LayerPen, NibSpring};
use crate::plan::{Segment, SegmentKind};
use crate::robot::{ArmModel, JointVector, Kinematics};
use crate::skill::Felt;
use crate::surface::Mapping;
use crate::truth::TrueCanvas;
use crate::twin::contact::{Contact, Nib};
use crate::twin::sense::TipSensor;
use crate::twin::{ArmRecord, ArmSample, Event, EventKind, StrokeRecord, TipForce, TipState};

/// An arm as the twin is given it.
pub struct TwinArm {
    /// The true arm: what the plant is made of.
    pub model: ArmModel,
    /// The controller, with its own belief of the arm.
    pub controller: Controller,
    /// Joint positions at the start, at rest.
    pub start: JointVector,
}

/// What surrounds the arms in truth.
pub struct Surroundings<'a> {
    /// The true canvas.
    pub canvas: &'a TrueCanvas,
    /// Coulomb friction of the canvas; that of a pen on it is the geometric mean of both.
    pub friction: f64,
    /// How far the canvas gives way to the pen, m/N.
    pub compliance: f64,
    /// Map between the true canvas and the sheet.
    pub mapping: &'a dyn Mapping,
    /// The pen of each layer.
    pub pens: &'a [LayerPen],
}

impl Surroundings<'_> {
    /// The nib of a layer's pen and the canvas as one spring: a canvas that gives way is in series with the nib.
    fn spring(&self, layer: usize) -> NibSpring {
        let nib = &self.pens[layer].pen.spring;
        if self.compliance <= 0.0 {
            return *nib;
        }
        NibSpring { stiffness: nib.stiffness / (1.0 + nib.stiffness * self.compliance), ..*nib }
    }
}

/// Running state of one arm.
pub(crate) struct ArmRun {
    index: usize,
    pub(crate) arm: TwinArm,
    /// When the segments that are executed began, s.
    began: f64,
    segment: usize,
    /// What was wished last; held where there is nothing to do.
    wish: Reference,
    sensor: Option<TipSensor>,
    entered: bool,
    cursor: usize,
    depth_cursor: usize,
    nib: Nib,
    recorder: InkRecorder,
    /// Pens that are put down, with the ink left in them, by layer.
    shelf: BTreeMap<usize, InkRecorder>,
    layer: usize,
    touching: bool,
    had_contact: bool,
    /// Largest normal force since `begin`, N.
    peak: f64,
    pending: VecDeque<JointVector>,
    delay_steps: usize,
    noise: Option<(ChaCha8Rng, f64)>,
    stroke: Option<StrokeRecord>,
    last_q: Option<JointVector>,
    pub(crate) record: ArmRecord,
}

/// What an arm does in one step.
pub(crate) struct ArmStep {
    pub(crate) torque: JointVector,
    pub(crate) force: TipForce,
}

impl ArmRun {
    pub(crate) fn new(
        index: usize,
        arm: TwinArm,
        layer: usize,
        pens: &[LayerPen],
        delay_steps: usize,
        noise: Option<(ChaCha8Rng, f64)>,
        sample_period: f64,
    ) -> Self {
        let record = ArmRecord {
            name: arm.model.name.clone(),
            joints: arm.model.joints.iter().map(|j| j.name.clone()).collect(),
            sample_period,
            samples: Vec::new(),
            strokes: Vec::new(),
            max_joint_step: 0.0,
            max_force: 0.0,
            pen_up_contact_steps: 0,
            final_q: Vec::new(),
            final_qd: Vec::new(),
        };
        Self {
            index,
            recorder: InkRecorder::new(pens[layer].pen.clone(), layer as u32, index as u32),
            wish: Reference::rest(arm.start),
            arm,
            began: 0.0,
            segment: 0,
            sensor: None,
            entered: false,
            cursor: 0,
            depth_cursor: 0,
            nib: Nib::default(),
            shelf: BTreeMap::new(),
            layer,
            touching: false,
            had_contact: false,
            peak: 0.0,
            pending: VecDeque::new(),
            delay_steps,
            noise,
            stroke: None,
            last_q: None,
            record,
        }
    }

    /// Sets out, at `time`, on segments whose own times start at 0.
    pub(crate) fn begin(&mut self, time: f64) {
        self.began = time;
        self.segment = 0;
        self.entered = false;
        self.peak = 0.0;
    }

    /// Ends what `begin` began: the wished motion, what was felt, and the largest normal force, N.
    pub(crate) fn end(&mut self) -> (Reference, Vec<Felt>, f64) {
        self.record.strokes.extend(self.stroke.take());
        let felt = self.sensor.as_mut().map(TipSensor::take).unwrap_or_default();
        (self.wish, felt, self.peak)
    }

    /// Lets the arm feel what it touches.
    pub(crate) fn feel(&mut self, sensor: TipSensor) {
        self.sensor = Some(sensor);
    }

    /// Force along the pen that the arm felt in the last step, N; 0 without a sensor.
    pub(crate) fn felt_force(&self) -> f64 {
        self.sensor.as_ref().map_or(0.0, TipSensor::force)
    }

    /// Moves on to the segment of `time`, closing and opening what hangs on segments.
    fn advance(&mut self, segments: &[Segment], time: f64, world: &Surroundings, events: &mut Vec<Event>) {
        while let Some(segment) = segments.get(self.segment) {
            if !self.entered {
                self.entered = true;
                (self.cursor, self.depth_cursor) = (0, 0);
                self.enter(segment, time, world, events);
            }
            if time - self.began < segment.end() || self.segment + 1 == segments.len() {
                return;
            }
            self.record.strokes.extend(self.stroke.take());
            self.segment += 1;
            self.entered = false;
        }
    }

    fn enter(&mut self, segment: &Segment, time: f64, world: &Surroundings, events: &mut Vec<Event>) {
        let stroke = stroke_id(segment);
        let mut event = |kind| events.push(Event { time, arm: self.index, stroke, kind });
        event(EventKind::Segment { kind: segment.kind });
        if segment.kind == SegmentKind::ChangePen && segment.layer != self.layer {
            event(EventKind::PenChanged { ink: world.pens[segment.layer].ink.clone() });
            self.take_pen(segment.layer, world.pens);
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

    /// Goes on as `arm`, at rest at its start, with the pen of `layer`.
    pub(crate) fn go_on_as(&mut self, arm: TwinArm, layer: usize, pens: &[LayerPen]) {
        self.take_pen(layer, pens);
        self.recorder.cap();
        self.wish = Reference::rest(arm.start);
        self.arm = arm;
        self.nib = Nib::default();
        self.pending.clear();
        self.last_q = None;
        self.had_contact = false;
    }

    /// The pen has been in the open for `time` s more.
    pub(crate) fn let_dry(&mut self, time: f64) {
        self.recorder.let_dry(time);
    }

    /// Records joints that something else moved from `time` on, `period` s apart.
    pub(crate) fn note_motion(&mut self, kind: SegmentKind, time: f64, period: f64, joints: &[JointVector]) {
        let n = self.arm.model.dof();
        for (i, q) in joints.iter().enumerate() {
            let tip = Point3::from(self.arm.model.kinematics(q).world_from_tip().translation.vector);
            self.record.samples.push(ArmSample {
                time: time + i as f64 * period,
                segment: kind,
                q: q.as_slice()[..n].to_vec(),
                torque: vec![0.0; n],
                tip,
                tip_desired: tip,
                force: Vector3::zeros(),
                normal_force: 0.0,
            });
        }
    }

    /// One control step at `time`: torques from the wished motion, the pen's contact, ink and records.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn step(
        &mut self,
        segments: &[Segment],
        time: f64,
        dt: f64,
        state: &MeasuredState,
        k: &Kinematics,
        true_tip: &TipState,
        world: &Surroundings,
        sample: bool,
        events: &mut Vec<Event>,
    ) -> ArmStep {
        self.advance(segments, time, world, events);
        let current = segments.get(self.segment);
        let stroke = current.and_then(stroke_id);
        let (kind, wish) = match current {
            Some(segment) => {
                let t = time - self.began - segment.start;
                let m = segment.trajectory.sample(t, &mut self.cursor);
                let nib = world.spring(self.layer).stiffness;
                let press = self.press(segment, t, nib);
                (segment.kind, Reference { q: m.q, qd: m.qd, qdd: m.qdd, press })
            }
            None => (SegmentKind::Travel, Reference::rest(self.wish.q)),
        };
        self.wish = wish;
        let tip = Point3::from(true_tip.pose.translation.vector);
        let axis = true_tip.pose.rotation * Vector3::z();
        let contact = self.touch(world, &tip, &axis, true_tip, dt);
        self.draw(time, dt, world, contact.as_ref(), stroke, events);

        // the law knows the joints, and the tip only where it believes it to be
        let tip_believed = &self.arm.controller.model().last_from_tip;
        let believed = (*tip_believed != self.arm.model.last_from_tip).then(|| k.with_tip(tip_believed));
        let command = self.arm.controller.torque(state, believed.as_ref().unwrap_or(k), &wish, dt);
        let torque = self.delayed(command.torque);
        let force = contact.map_or_else(TipForce::default, |c| TipForce { point: c.point, force: c.force });

        if let Some(sensor) = &mut self.sensor {
            let model = self.arm.controller.model();
            sensor.step(time, kind, stroke, model, &state.q, &force.force);
        }
        self.watch(kind, state, contact.as_ref(), &wish.press, command.saturated, k);
        if sample {
            let n = self.arm.model.dof();
            self.record.samples.push(ArmSample {
                time,
                segment: kind,
                q: state.q.as_slice()[..n].to_vec(),
                torque: torque.as_slice()[..n].to_vec(),
                tip,
                tip_desired: self.arm.controller.set_point(),
                force: force.force,
                normal_force: contact.map_or(0.0, |c| c.normal_force),
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
        let stiffness = self.arm.controller.press_stiffness(nib);
        Press { expected_force: stiffness * d.depth, rate: d.rate, acceleration: d.acceleration }
    }

    fn touch(
        &mut self,
        world: &Surroundings,
        tip: &Point3<f64>,
        axis: &Vector3<f64>,
        true_tip: &TipState,
        dt: f64,
    ) -> Option<Contact> {
        let spring = world.spring(self.layer);
        let friction = (spring.friction * world.friction).sqrt();
        let TipState { velocity, mass, .. } = true_tip;
        self.nib.touch(&spring, friction, &world.canvas.mesh, tip, axis, velocity, *mass, dt)
    }

    fn draw(
        &mut self,
        time: f64,
        dt: f64,
        world: &Surroundings,
        contact: Option<&Contact>,
        stroke: Option<StrokeId>,
        events: &mut Vec<Event>,
    ) {
        if contact.is_some() != self.touching {
            self.touching = contact.is_some();
            let kind = if self.touching { EventKind::Touch } else { EventKind::Leave };
            events.push(Event { time, arm: self.index, stroke, kind });
        }
        let nib = contact.map(|c| NibContact {
            position: c.at.position,
            normal: c.at.normal,
            normal_force: c.normal_force,
            slip_speed: c.slip.norm(),
        });
        self.recorder.step(dt, time, nib.as_ref(), stroke, |p| world.mapping.to_sheet(p));
    }

    fn watch(
        &mut self,
        kind: SegmentKind,
        state: &MeasuredState,
        contact: Option<&Contact>,
        press: &Press,
        saturated: bool,
        k: &Kinematics,
    ) {
        let r = &mut self.record;
        if let Some(last) = &self.last_q {
            r.max_joint_step = r.max_joint_step.max((state.q - last).amax());
        }
        self.last_q = Some(state.q);
        let had_contact = std::mem::replace(&mut self.had_contact, contact.is_some());
        let normal_force = contact.map_or(0.0, |c| c.normal_force);
        r.max_force = r.max_force.max(normal_force);
        self.peak = self.peak.max(normal_force);
        if contact.is_some() && matches!(kind, SegmentKind::Travel | SegmentKind::ChangePen | SegmentKind::Wait) {
            r.pen_up_contact_steps += 1;
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
            let wished = self.arm.controller.set_point();
            let off = k.world_from_tip().inverse() * wished;
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
            for i in 0..self.arm.model.dof() {
                acting[i] += *sd * standard_normal(rng);
            }
        }
        acting
    }

    /// Closes what is open and gives up the record and the recorders of all its pens.
    pub(crate) fn finish(mut self, state: &MeasuredState) -> (ArmRecord, Vec<InkRecorder>) {
        self.record.strokes.extend(self.stroke.take());
        let n = self.arm.model.dof();
        self.record.final_q = state.q.as_slice()[..n].to_vec();
        self.record.final_qd = state.qd.as_slice()[..n].to_vec();
        let recorders = self.shelf.into_values().chain([self.recorder]).collect();
        (self.record, recorders)
    }
}

fn stroke_id(segment: &Segment) -> Option<StrokeId> {
    Some(StrokeId { layer: segment.layer as u32, index: segment.stroke? as u32 })
}
