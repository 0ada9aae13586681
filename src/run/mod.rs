//! One scenario, from start to end.

mod progress;

use std::path::PathBuf;

use crate::measure::Metrics;
use crate::report::{OutputDir, OutputError};
use crate::scenario::{DrawingSpec, Scenario};

pub use progress::{Progress, Silent};

/// How far to go along the way from drawing to pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Until {
    /// To the drawing on its sheet.
    Drawing,
    /// To the drawing on the canvas.
    Mapping,
    /// To the timed joint motion.
    Plan,
    /// To the report.
    End,
}

/// Why a run couldn't be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// An output can't be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// This stage isn't there.
    #[error("the {stage} stage isn't built in")]
    Absent {
        /// Its name.
        stage: &'static str,
    },
}

/// What a run left.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Its figures.
    pub metrics: Metrics,
    /// The files written, in the order written.
    pub files: Vec<PathBuf>,
}

/// Runs a scenario as far as `until`, and writes the files of every stage that it passes into `out`.
pub fn run(
    _scenario: &Scenario,
    _until: Until,
    _out: &OutputDir,
    _progress: &dyn Progress,
) -> Result<Outcome, RunError> {
    Err(RunError::Absent { stage: "simulation" })
}

/// Reads and tidies a drawing, and writes the lines as wished to `drawing.svg`.
pub fn draw(_drawing: &DrawingSpec, _out: &OutputDir, _progress: &dyn Progress) -> Result<Outcome, RunError> {
    Err(RunError::Absent { stage: "drawing" })
}
