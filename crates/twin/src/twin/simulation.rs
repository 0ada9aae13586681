//! The loop: control, contact, ink and physics at 1 kHz, for all arms of a cell.
use std::time::Instant;

use crate::control::{MeasuredState, Reference};
use crate::ink::{InkRecorder, InkTrace, TraceInk};
use crate::math::{Digest, Rgb, stream};
use crate::pen::LayerPen;
use crate::plan::{Plan, SegmentKind};
use crate::robot::{ArmModel, JointVector, Kinematics};
use crate::skill::Felt;
use crate::twin::arm::{ArmRun, Surroundings, TwinArm};
use crate::twin::sense::TipSensor;
use crate::twin::{
    ArticulatedPlant, Event, EventKind, Feeling, Plant, PlantKind, RapierPlant, Record, TipForce, TwinOptions,
};

/// Why a simulation ended early.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TwinError {
    /// The physics blew up.
    #[error("arm {arm} stopped being finite at {time:.3} s: its controller is unstable (stiffness or delay too high?)")]
    NotFinite {
        /// Index of the arm.
        arm: usize,
        /// Simulated time, s.
        time: f64,
    },
    /// rapier takes no such chain.
    #[error("rapier refused the robot's chain of joints")]
    Refused,
    /// The plan is for other arms.
    #[error("the plan is for {planned} arms, the cell has {arms}")]
    ArmCount {
        /// Arms in the plan.
        planned: usize,
        /// Arms in the cell.
        arms: usize,
    },
}

/// A guarded move: it ends when an arm feels something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guard {
    /// Force along the pen at which motion stops, N.
    pub force: f64,
}

/// How an execution ended.
#[derive(Clone, Debug)]
pub struct Executed {
    /// Time, s, from the start of the simulation.
    pub time: f64,
    /// The arm whose guard stopped it, if one did.
    pub stopped: Option<usize>,
    /// The arm that stopped it because it has lost its pen, if one did.
    pub lost: Option<usize>,
    /// One entry an arm.
    pub arms: Vec<ArmEnd>,
}

/// Where an arm is, and what it felt on the way there.
#[derive(Clone, Debug)]
pub struct ArmEnd {
    /// What was wished last: the next motion should go on from here.
    pub reference: Reference,
    /// What the joint sensors tell.
    pub measured: MeasuredState,
    /// Touches, in time order; empty unless the arms were told to feel.
    pub felt: Vec<Felt>,
    /// Largest normal force on the pen, N.
    pub peak: f64,
}

/// A simulation that goes on from plan to plan, so that later plans can follow from what earlier ones met.
pub struct Simulation<'a> {
    world: &'a Surroundings<'a>,
    models: Vec<ArmModel>,
    runs: Vec<ArmRun>,
    plant: Box<dyn Plant>,
    kinematics: Vec<Kinematics>,
    torques: Vec<JointVector>,
    forces: Vec<TipForce>,
    events: Vec<Event>,
    step: u64,
    stride: u64,
    options: TwinOptions,
    started: Instant,
}

impl<'a> Simulation<'a> {
    /// Arms at rest at their starts; each holds the pen of its layer in `layers`.
    pub fn new(
        arms: Vec<TwinArm>,
        layers: &[usize],
        world: &'a Surroundings<'a>,
        options: &TwinOptions,
    ) -> Result<Self, TwinError> {
        if layers.len() != arms.len() {
            return Err(TwinError::ArmCount { planned: layers.len(), arms: arms.len() });
        }
        let started = Instant::now();
        let dt = options.dt;
        let models: Vec<ArmModel> = arms.iter().map(|a| a.model.clone()).collect();
        let q0: Vec<JointVector> = arms.iter().map(|a| a.start).collect();
        let plant = plant(&models, &q0, options)?;
        let kinematics = models.iter().zip(&q0).map(|(m, q)| m.kinematics(q)).collect();
        let runs: Vec<ArmRun> = arms
            .into_iter()
            .zip(layers)
            .enumerate()
            .map(|(i, (arm, layer))| start(i, arm, *layer, world.pens, options))
            .collect();
        Ok(Self {
            world,
            plant,
            kinematics,
            torques: vec![JointVector::zeros(); runs.len()],
            forces: vec![TipForce::default(); runs.len()],
            models,
            runs,
            events: Vec::new(),
            step: 0,
            stride: ((options.sample_period / dt).round() as u64).max(1),
            options: options.clone(),
            started,
        })
    }

    /// Lets every arm feel what its pen touches; each has its own stream of noise.
    pub fn feel(&mut self, feeling: Feeling) {
        for (i, run) in self.runs.iter_mut().enumerate() {
            let name = format!("force noise of {}", run.arm.model.name);
            run.feel(TipSensor::new(feeling, stream(self.options.seed, &name, i as u64)));
        }
    }

    /// Time, s.
    pub fn time(&self) -> f64 {
        self.step as f64 * self.options.dt
    }

    /// Goes on with `twin` as arm `arm`, at rest at its start, with the pen of `layer`: the same arm with something else in its
    /// hand. The other arms stand still where they are.
    ///
    /// # Errors
    /// rapier refuses the chain.
    pub fn go_on_as(&mut self, arm: usize, twin: TwinArm, layer: usize) -> Result<(), TwinError> {
        let mut q: Vec<JointVector> = (0..self.runs.len()).map(|a| self.plant.state(a).q).collect();
        q[arm] = twin.start;
        self.models[arm] = twin.model.clone();
        self.plant = plant(&self.models, &q, &self.options)?;
        self.kinematics[arm] = twin.model.kinematics(&twin.start);
        self.runs[arm].go_on_as(twin, layer, self.world.pens);
        Ok(())
    }

    /// Goes on in another plant, in which every arm stands where it does in this one or as near as makes no difference.
    pub fn go_on_in(&mut self, plant: Box<dyn Plant>) {
        self.plant = plant;
    }

    /// Lets time pass in which arm `arm` is moved by something else, which is recorded: through `joints` (rad), `period` s apart.
    /// The others stand still.
    pub fn pass(&mut self, arm: usize, kind: SegmentKind, duration: f64, period: f64, joints: &[JointVector]) {
        let time = self.time();
        self.events.push(Event { time, arm, stroke: None, kind: EventKind::Segment { kind } });
        self.runs[arm].note_motion(kind, time, period, joints);
        self.step += (duration / self.options.dt).round() as u64;
    }

    /// Lets arm `arm` wait for `time` s with its pen in the open. Nothing else passes: the time is somebody else's.
    pub fn let_dry(&mut self, arm: usize, time: f64) {
        self.runs[arm].let_dry(time);
    }

    /// Executes a plan from here on; its own time starts at 0. Arms should be where it starts. With a `guard` it ends at the
    /// step after an arm felt the guard's force; and always when an arm loses its pen.
    pub fn execute(
        &mut self,
        plan: &Plan,
        guard: Option<Guard>,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Executed, TwinError> {
        if plan.arms.len() != self.runs.len() {
            return Err(TwinError::ArmCount { planned: plan.arms.len(), arms: self.runs.len() });
        }
        let dt = self.options.dt;
        let began = self.time();
        for run in &mut self.runs {
            run.begin(began);
        }
        let steps = (plan.duration() / dt).ceil() as u64 + 1;
        let (mut stopped, mut lost) = (None, None);
        for _ in 0..steps {
            let time = self.time();
            self.advance(plan, time)?;
            if self.step.is_multiple_of(1000) {
                progress(time);
            }
            self.step += 1;
            stopped = guard.and_then(|g| self.runs.iter().position(|r| r.felt_force() > g.force));
            lost = (0..self.runs.len()).find(|a| self.plant.has_lost(*a));
            if stopped.is_some() || lost.is_some() {
                break;
            }
        }
        let arms = self.runs.iter_mut().enumerate().map(|(a, run)| {
            let (reference, felt, peak) = run.end();
            ArmEnd { reference, measured: *self.plant.state(a), felt, peak }
        });
        let arms = arms.collect();
        Ok(Executed { time: self.time(), stopped, lost, arms })
    }

    /// One step of all arms.
    fn advance(&mut self, plan: &Plan, time: f64) -> Result<(), TwinError> {
        let dt = self.options.dt;
        for (a, run) in self.runs.iter_mut().enumerate() {
            let sample = self.step.is_multiple_of(self.stride);
            let (state, k) = (self.plant.state(a), &self.kinematics[a]);
            let tip = self.plant.tip(a, k, &state.qd);
            let out = run.step(&plan.arms[a].segments, time, dt, state, k, &tip, self.world, sample, &mut self.events);
            self.torques[a] = out.torque;
            self.forces[a] = out.force;
        }
        self.plant
            .step(&self.torques, &self.forces, &self.kinematics)
            .map_err(|arm| TwinError::NotFinite { arm, time })?;
        for (a, model) in self.models.iter().enumerate() {
            self.kinematics[a] = model.kinematics(&self.plant.state(a).q);
        }
        Ok(())
    }

    /// What happened. `colors` are those of the layers' inks.
    pub fn finish(self, colors: &[Rgb]) -> Record {
        let mut records = Vec::new();
        let mut spent: Vec<InkRecorder> = Vec::new();
        for (a, run) in self.runs.into_iter().enumerate() {
            let (record, recorders) = run.finish(self.plant.state(a));
            records.push(record);
            spent.extend(recorders);
        }
        let pens = self.world.pens.iter().zip(colors);
        let ink = InkTrace::merged(pens.map(|(p, c)| TraceInk { name: p.ink.clone(), color: *c }).collect(), spent);
        let mut digest = Digest::new();
        for r in &records {
            digest.numbers(&r.final_q).numbers(&r.final_qd).numbers([&r.max_force]);
        }
        ink.digest(&mut digest);
        Record {
            arms: records,
            events: self.events,
            ink,
            steps: self.step,
            simulated: self.step as f64 * self.options.dt,
            wall: self.started.elapsed().as_secs_f64(),
            digest: digest.hex(),
        }
    }
}

/// Runs `plan` on the true arms and canvas. `colors` are those of the layers' inks; `progress` is told the simulated
/// time (s) now and then.
pub fn simulate(
    arms: Vec<TwinArm>,
    plan: &Plan,
    world: &Surroundings,
    colors: &[Rgb],
    options: &TwinOptions,
    progress: &mut dyn FnMut(f64),
) -> Result<Record, TwinError> {
    let layers: Vec<usize> = plan.arms.iter().map(|a| a.segments.first().map_or(0, |s| s.layer)).collect();
    let mut simulation = Simulation::new(arms, &layers, world, options)?;
    simulation.execute(plan, None, progress)?;
    Ok(simulation.finish(colors))
}

fn plant(models: &[ArmModel], q0: &[JointVector], options: &TwinOptions) -> Result<Box<dyn Plant>, TwinError> {
    Ok(match options.plant {
        PlantKind::Rapier => Box::new(RapierPlant::new(models, q0, options.dt).ok_or(TwinError::Refused)?),
        PlantKind::Articulated => Box::new(ArticulatedPlant::new(models.to_vec(), q0, options.dt)),
    })
}

fn start(index: usize, arm: TwinArm, layer: usize, pens: &[LayerPen], options: &TwinOptions) -> ArmRun {
    let noise = (options.torque_noise > 0.0).then(|| {
        (stream(options.seed, &format!("torque noise of {}", arm.model.name), index as u64), options.torque_noise)
    });
    let delay_steps = (options.delay / options.dt).round().max(0.0) as usize;
    ArmRun::new(index, arm, layer, pens, delay_steps, noise, options.sample_period)
}
