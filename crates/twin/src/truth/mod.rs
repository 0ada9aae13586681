//! What is true: in what the world differs from what the robot believes. All of it is made here, from the nominal scene and a seed.
//!
//! A crate boundary is the wall: nothing of the robot's own can name these types.

mod base;
mod canvas;
mod carried;
mod gripper;
mod gripper_error;
mod perturbed;

use std::sync::Arc;

pub use base::TrueBase;
pub use canvas::TrueCanvas;
pub use carried::Carried;
pub use gripper::{GripperTruth, TrueGripper};
pub use gripper_error::{DockError, ErrorRanges, SensorNoise, Variation};
pub use perturbed::{PlankKind, TruthError, TruthOptions, TruthReport, perturb};

use crate::skill::GripperKit;
use crate::surface::Canvas;
use perturbed::unshaped;

/// How truth may differ from belief in one run.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthSpec {
    /// Place, shape and size of the canvas.
    pub canvas: TruthOptions,
    /// Coulomb friction of the canvas.
    pub friction: f64,
    /// How far the canvas gives way to the pen, m/N.
    pub compliance: f64,
    /// Hands, docks and tools.
    pub gripper: GripperTruth,
    /// Seed of the run.
    pub seed: u64,
}

/// The world as it is. Only the physics, the ink and who measures may look.
#[derive(Clone)]
pub struct Truth {
    canvas: TrueCanvas,
    unshaped: Option<Canvas>,
    report: TruthReport,
    friction: f64,
    compliance: f64,
    grippers: Vec<Option<Arc<TrueGripper>>>,
}

impl Truth {
    /// The world in which `nominal` is what the robot believes of the canvas, and `kits` what it believes of the hands of its arms.
    ///
    /// # Errors
    /// The canvas can't be changed as asked.
    pub fn new(nominal: &Canvas, kits: &[Option<Arc<GripperKit>>], spec: &TruthSpec) -> Result<Self, TruthError> {
        let (canvas, report) = perturb(nominal, &spec.canvas, spec.seed)?;
        let gripper = |kit: &Option<Arc<GripperKit>>| {
            kit.as_ref().map(|kit| Arc::new(TrueGripper::new(Arc::clone(kit), spec.gripper.clone(), spec.seed)))
        };
        Ok(Self {
            canvas,
            unshaped: unshaped(nominal, &spec.canvas, spec.seed)?,
            report,
            friction: spec.friction,
            compliance: spec.compliance,
            grippers: kits.iter().map(gripper).collect(),
        })
    }

    /// The canvas.
    pub fn canvas(&self) -> &TrueCanvas {
        &self.canvas
    }

    /// The nominal canvas in the true one's place, where that has another shape.
    pub fn unshaped(&self) -> Option<&Canvas> {
        self.unshaped.as_ref()
    }

    /// How the canvas differs from the nominal one.
    pub fn report(&self) -> &TruthReport {
        &self.report
    }

    /// Coulomb friction of the canvas.
    pub fn friction(&self) -> f64 {
        self.friction
    }

    /// How far the canvas gives way to the pen, m/N.
    pub fn compliance(&self) -> f64 {
        self.compliance
    }

    /// The hand of an arm, its docks and tools; `None` of an arm without.
    pub fn gripper(&self, arm: usize) -> Option<&Arc<TrueGripper>> {
        self.grippers.get(arm).and_then(Option::as_ref)
    }
}
