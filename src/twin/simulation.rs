//! The loop: control, contact, ink and physics at 1 kHz, for all arms of a cell.
use std::time::Instant;

use crate::ink::{InkRecorder, InkTrace, TraceInk};
use crate::math::{Digest, Rgb, stream};
use crate::plan::{ArmPlan, Plan};
use crate::robot::{ArmModel, JointVector, Kinematics};
use crate::twin::arm::{ArmRun, LayerPen, Surroundings, TwinArm};
use crate::twin::{ArticulatedPlant, Plant, PlantKind, RapierPlant, Record, TipForce, TwinOptions};

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
    if plan.arms.len() != arms.len() {
        return Err(TwinError::ArmCount { planned: plan.arms.len(), arms: arms.len() });
    }
    let started = Instant::now();
    let dt = options.dt;
    let models: Vec<ArmModel> = arms.iter().map(|a| a.model.clone()).collect();
    let q0: Vec<JointVector> = arms.iter().map(|a| a.start).collect();
    let mut plant: Box<dyn Plant> = match options.plant {
        PlantKind::Rapier => Box::new(RapierPlant::new(&models, &q0, dt).ok_or(TwinError::Refused)?),
        PlantKind::Articulated => Box::new(ArticulatedPlant::new(models.clone(), &q0, dt)),
    };
    let mut runs: Vec<ArmRun> = arms
        .into_iter()
        .zip(&plan.arms)
        .enumerate()
        .map(|(i, (arm, arm_plan))| start(i, arm, arm_plan, world.pens, options))
        .collect();

    let steps = (plan.duration() / dt).ceil() as u64 + 1;
    let stride = ((options.sample_period / dt).round() as u64).max(1);
    let mut events = Vec::new();
    let mut kinematics: Vec<Kinematics> = models.iter().zip(&q0).map(|(m, q)| m.kinematics(q)).collect();
    let mut torques = vec![JointVector::zeros(); runs.len()];
    let mut forces = vec![TipForce::default(); runs.len()];
    for step in 0..steps {
        let time = step as f64 * dt;
        for (a, run) in runs.iter_mut().enumerate() {
            let sample = step % stride == 0;
            let state = plant.state(a);
            let out = run.step(time, dt, state, &kinematics[a], world, sample, &mut events);
            torques[a] = out.torque;
            forces[a] = out.force;
        }
        plant.step(&torques, &forces, &kinematics).map_err(|arm| TwinError::NotFinite { arm, time })?;
        for (a, model) in models.iter().enumerate() {
            kinematics[a] = model.kinematics(&plant.state(a).q);
        }
        if step % 1000 == 0 {
            progress(time);
        }
    }

    let mut records = Vec::new();
    let mut spent: Vec<InkRecorder> = Vec::new();
    for (a, run) in runs.into_iter().enumerate() {
        let (record, recorders) = run.finish(plant.state(a));
        records.push(record);
        spent.extend(recorders);
    }
    let inks = world.pens.iter().zip(colors).map(|(p, c)| TraceInk { name: p.ink.clone(), color: *c }).collect();
    let ink = InkTrace::merged(inks, spent);
    let mut digest = Digest::new();
    for r in &records {
        digest.numbers(&r.final_q).numbers(&r.final_qd).numbers([&r.max_force]);
    }
    ink.digest(&mut digest);
    Ok(Record {
        arms: records,
        events,
        ink,
        steps,
        simulated: steps as f64 * dt,
        wall: started.elapsed().as_secs_f64(),
        digest: digest.hex(),
    })
}

fn start<'a>(index: usize, arm: TwinArm, plan: &'a ArmPlan, pens: &[LayerPen], options: &TwinOptions) -> ArmRun<'a> {
    let noise = (options.torque_noise > 0.0).then(|| {
        (stream(options.seed, &format!("torque noise of {}", arm.model.name), index as u64), options.torque_noise)
    });
    let delay_steps = (options.delay / options.dt).round().max(0.0) as usize;
    ArmRun::new(index, arm, plan, pens, delay_steps, noise, options.sample_period)
}
