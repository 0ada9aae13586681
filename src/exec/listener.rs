//! Who hears how a run goes on, and may stop it.
use std::sync::atomic::{AtomicBool, Ordering};

use crate::skill::{Outcome, Task};
use crate::twin::{ArmLog, Simulation};

/// Whether a run goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// It does.
    Continue,
    /// Every arm stops where its pen is next off the canvas; what was drawn is kept.
    Stop,
}

/// What has happened to one arm.
pub enum News<'a> {
    /// A task begins.
    Begins(&'a Task),
    /// A second of a task has passed.
    Passes(&'a Task),
    /// A task has ended, and this is what happened in it.
    Ended(&'a Task, &'a Outcome, &'a ArmLog),
}

/// Hears how a run goes on. Calls come from the threads of the arms.
pub trait Listener: Sync {
    /// Something has happened to an arm, whose simulation stands as given.
    fn hear(&self, news: &News, arm: &Simulation) -> Flow;
}

/// Every listener hears; one that stops the run is enough.
impl Listener for [&dyn Listener] {
    fn hear(&self, news: &News, arm: &Simulation) -> Flow {
        let stops = self.iter().filter(|l| l.hear(news, arm) == Flow::Stop).count();
        if stops > 0 { Flow::Stop } else { Flow::Continue }
    }
}

/// Stops a run once it is raised, as by a signal.
#[derive(Debug, Default)]
pub struct StopFlag(AtomicBool);

impl StopFlag {
    /// Stops the run at the next safe point.
    pub fn raise(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it was raised.
    pub fn is_raised(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl Listener for StopFlag {
    fn hear(&self, _: &News, _: &Simulation) -> Flow {
        if self.is_raised() { Flow::Stop } else { Flow::Continue }
    }
}
