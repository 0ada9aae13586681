//! What comes next: a policy sees what the robot believes and senses, and nothing else.
use std::sync::Arc;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{DrivenStrokes, Outcome, Task, TouchStrokes};
use crate::control::Reference;
use crate::plan::PlanError;
use crate::surface::BelievedCanvas;

/// Says what an arm does, task by task. It lives on the robot's side of the wall: of the true scene it learns only by the outcomes of
/// its tasks.
pub trait Policy: Send {
    /// The next task; `None` when all is done.
    ///
    /// # Errors
    /// What the robot knows can't be planned.
    fn next(&mut self) -> Result<Option<Task>, PolicyError>;

    /// Hears how the task that it gave last has ended.
    ///
    /// # Errors
    /// What the robot knows now can't be used.
    fn ended(&mut self, task: &Task, outcome: &Outcome) -> Result<(), PolicyError>;

    /// Steps between two calls of [`adjust`](Self::adjust); `None` if the policy doesn't correct what is under way.
    fn adjust_period(&self) -> Option<u64> {
        None
    }

    /// Corrects the reference within a task, from what is felt there, N along the pen.
    fn adjust(&mut self, reference: Reference, felt: f64) -> Reference {
        let _ = felt;
        reference
    }

    /// All that changes in it, as bytes.
    fn save(&self) -> Vec<u8>;

    /// Goes on from what [`save`](Self::save) gave.
    ///
    /// # Errors
    /// The bytes aren't those of this policy.
    fn restore(&mut self, bytes: &[u8]) -> Result<(), PolicyError>;

    /// Whether it must not go on after a task failed in this way.
    fn gives_up(&self, task: &Task, outcome: &Outcome) -> bool {
        let _ = task;
        outcome.failure.is_some()
    }
}

/// A policy that draws strokes on a canvas.
pub trait Drawer: Policy {
    /// The canvas that travels through the air keep clear of, as it is believed now.
    ///
    /// # Errors
    /// What is known makes no surface.
    fn clear_of(&self) -> Result<Arc<BelievedCanvas>, PolicyError>;

    /// Who draws by touch, if somebody does.
    fn touched(&self) -> Option<&TouchStrokes> {
        None
    }

    /// Who draws from place to place, if somebody does.
    fn driven(&self) -> Option<&DrivenStrokes> {
        None
    }
}

impl<P: Policy + ?Sized> Policy for Box<P> {
    fn next(&mut self) -> Result<Option<Task>, PolicyError> {
        (**self).next()
    }
    fn ended(&mut self, task: &Task, outcome: &Outcome) -> Result<(), PolicyError> {
        (**self).ended(task, outcome)
    }
    fn adjust_period(&self) -> Option<u64> {
        (**self).adjust_period()
    }
    fn adjust(&mut self, reference: Reference, felt: f64) -> Reference {
        (**self).adjust(reference, felt)
    }
    fn save(&self) -> Vec<u8> {
        (**self).save()
    }
    fn restore(&mut self, bytes: &[u8]) -> Result<(), PolicyError> {
        (**self).restore(bytes)
    }
    fn gives_up(&self, task: &Task, outcome: &Outcome) -> bool {
        (**self).gives_up(task, outcome)
    }
}

impl<P: Drawer + ?Sized> Drawer for Box<P> {
    fn clear_of(&self) -> Result<Arc<BelievedCanvas>, PolicyError> {
        (**self).clear_of()
    }
    fn touched(&self) -> Option<&TouchStrokes> {
        (**self).touched()
    }
    fn driven(&self) -> Option<&DrivenStrokes> {
        (**self).driven()
    }
}

/// Why a policy can't go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PolicyError {
    /// A motion can't be planned.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The drawing doesn't fit on what is believed of the canvas.
    #[error(transparent)]
    Map(#[from] crate::surface::MapError),
    /// What was touched makes no surface.
    #[error("touched heights make no surface: {0}")]
    Touched(crate::mesh::MeshError),
    /// A tool or a dock makes no solid.
    #[error("the pen tool: {0}")]
    Tool(crate::mesh::MeshError),
    /// No probe met the canvas.
    #[error(
        "none of {probes} probes met the canvas between {} and {} mm over the sheet; widen `touch.range_mm`",
        range_mm[0],
        range_mm[1]
    )]
    NothingMet {
        /// Probes made.
        probes: usize,
        /// Where they sought, mm over the sheet's plane.
        range_mm: [f64; 2],
    },
    /// A hand can't stand before a dock.
    #[error("dock {dock} of arm {arm} is out of its reach: no posture puts the open hand before it; move the dock")]
    DockOutOfReach {
        /// Name of the arm.
        arm: String,
        /// Index of the dock.
        dock: usize,
    },
    /// A saved state isn't one of this policy.
    #[error("a saved state can't be read: {0}")]
    Saved(#[from] postcard::Error),
}

/// A value as bytes, for [`Policy::save`].
pub(super) fn saved<T: Serialize>(state: &T) -> Vec<u8> {
    // a policy's state holds nothing that has no such form
    postcard::to_stdvec(state).unwrap_or_default()
}

/// The value of such bytes.
pub(super) fn restored<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, PolicyError> {
    Ok(postcard::from_bytes(bytes)?)
}
