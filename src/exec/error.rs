//! Why a run can't go on.
use super::JournalError;
use crate::skill::PolicyError;
use crate::twin::TwinError;

/// Why a run can't go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExecError {
    /// The next task can't be found.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// The simulation failed.
    #[error(transparent)]
    Twin(#[from] TwinError),
    /// What was done can't be kept.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// A task was given that can't begin.
    #[error("arm {arm} can't begin a task at {time:.3} s: {why}")]
    Precondition {
        /// Name of the arm.
        arm: String,
        /// Time, s.
        time: f64,
        /// What doesn't hold.
        why: String,
    },
    /// The thread of an arm ended in a way that it never should.
    #[error("the simulation of an arm ended in a fault of the program")]
    Panicked,
}
