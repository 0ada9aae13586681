//! One arm and one timeline of motion, from start to record: for who needs no more.
use std::sync::Arc;
use std::time::Instant;

use crate::control::LawOptions;
use crate::ink::TraceInk;
use crate::plan::Segment;
use crate::skill::Move;
use crate::twin::{ArmSetup, ArmStory, Record, Simulation, TrueScene, TwinError, TwinOptions};

/// Carries out `segments`, whose starts are counted from the first and follow one another, on the true arm and canvas.
///
/// # Errors
/// The physics blew up.
pub fn simulate(
    setup: ArmSetup,
    segments: &[Segment],
    scene: &Arc<TrueScene>,
    law: LawOptions,
    options: &TwinOptions,
) -> Result<Record, TwinError> {
    let started = Instant::now();
    let (name, colors) = (setup.model.name.clone(), setup.colors.clone());
    let joints = setup.model.joints.iter().map(|j| j.name.clone()).collect();
    let mut simulation = Simulation::new(setup, Arc::clone(scene), law, options)?;
    for (i, segment) in segments.iter().enumerate() {
        let (begins, ends) = (i == 0, i + 1 == segments.len());
        let movement = Move { segment: segment.clone(), begins, ends, planned: None, visit: None };
        while simulation.execute(&movement, None, u64::MAX, None)?.is_none() {}
    }
    let log = simulation.take_log();
    let story = ArmStory { name, joints, sample_period: options.sample_period, log, ending: simulation.ending() };
    let inks = scene.pens.iter().zip(colors).map(|(p, color)| TraceInk { name: p.ink.clone(), color });
    Ok(Record::of(vec![story], inks.collect(), started.elapsed().as_secs_f64()))
}
