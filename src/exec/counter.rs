//! Listeners that others are made of: one that counts, and two as one.
use std::sync::atomic::{AtomicU64, Ordering};

use super::{Flow, Listener, News};
use crate::progress::Progress;
use crate::skill::Task;
use crate::twin::Simulation;

/// Two listeners as one.
pub struct Both<'a>(pub [&'a dyn Listener; 2]);

impl Listener for Both<'_> {
    fn hear(&self, news: &News, arm: &Simulation) -> Flow {
        self.0.hear(news, arm)
    }
}

/// Tells how far a run has come: by planned time, or by strokes where nothing is planned ahead.
pub struct Counter<'a> {
    progress: &'a dyn Progress,
    by_time: bool,
    done: AtomicU64,
}

impl<'a> Counter<'a> {
    /// Counts planned motion, `seconds` in all, as the stage `name`.
    pub fn of_time(name: &str, seconds: f64, progress: &'a dyn Progress) -> Self {
        progress.stage(name, Some((seconds * 1e3) as u64));
        Self { progress, by_time: true, done: AtomicU64::new(0) }
    }

    /// Counts strokes.
    pub fn of_strokes(name: &str, strokes: u64, progress: &'a dyn Progress) -> Self {
        progress.stage(name, Some(strokes));
        Self { progress, by_time: false, done: AtomicU64::new(0) }
    }
}

impl Listener for Counter<'_> {
    fn hear(&self, news: &News, _: &Simulation) -> Flow {
        let more = match news {
            News::Passes(task) if self.by_time && task.movement().is_some_and(|m| m.planned.is_some()) => 1000,
            News::Ended(task, outcome, _) if self.by_time && task.movement().is_some_and(|m| m.planned.is_some()) => {
                (outcome.duration * 1e3) as u64 % 1000
            }
            News::Ended(Task::Draw(_), ..) if !self.by_time => 1,
            _ => 0,
        };
        if more > 0 {
            self.progress.advance(more + self.done.fetch_add(more, Ordering::Relaxed));
        }
        Flow::Continue
    }
}
