//! The executive: one loop carries out the tasks of every robot, whatever policy gives them.
//!
//! Each arm is a [`Worker`] with a clock of its own that agrees with the others' where they wait for each other: an order between visits
//! to the canvas ([`Turns`]) is kept whatever the visits really take, so results don't depend on threads. [`Listener`]s hear what
//! happens and may stop the run; a [`Journal`] keeps what is done, so that a killed run goes on from there.
mod chunk;
mod counter;
mod distances;
mod error;
mod journal;
mod listener;
mod timeline;
mod turns;
mod worker;

pub use chunk::{Chunk, Made, Visit};
pub use counter::{Both, Counter};
pub use distances::Distances;
pub use error::ExecError;
pub use journal::{Journal, JournalError};
pub use listener::{Flow, Listener, News, StopFlag};
pub use turns::Turns;
pub use worker::{ArmStop, Done, Worker, cut};

use crate::plan::VisitOrder;
use crate::skill::Policy;

/// Carries out what the policies of all arms give, until they have no more, an arm gives up, or a listener stops the run. One entry an
/// arm comes back, in their order.
///
/// # Errors
/// The first of the arms' errors, in their order.
pub fn execute<P: Policy>(
    workers: Vec<Worker<P>>,
    order: &VisitOrder,
    listener: &dyn Listener,
    journal: Option<&Journal>,
) -> Result<Vec<Done<P>>, ExecError> {
    let turns = Turns::new(order.clone());
    for worker in &workers {
        worker.announce(&turns);
    }
    let work = |worker: Worker<P>| worker.work(&turns, listener, journal);
    let mut done = if workers.len() < 2 {
        workers.into_iter().map(work).collect::<Result<Vec<_>, _>>()?
    } else {
        // an arm that waits for another blocks its thread: each has one of its own, and none of a pool that others need
        let ended: Vec<_> = std::thread::scope(|scope| {
            let work = &work;
            let threads: Vec<_> = workers.into_iter().map(|w| scope.spawn(move || work(w))).collect();
            threads.into_iter().map(std::thread::ScopedJoinHandle::join).collect()
        });
        ended.into_iter().map(|e| e.unwrap_or(Err(ExecError::Panicked))).collect::<Result<Vec<_>, _>>()?
    };
    // an arm that gave up calls the whole off: what others began after that is not part of the run
    let end = done.iter().filter_map(Done::gave_up_at).min();
    for d in &mut done {
        if let Some(end) = end {
            d.cut(end);
        }
        d.gather();
    }
    Ok(done)
}
