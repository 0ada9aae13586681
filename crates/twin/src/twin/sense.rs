//! What an arm feels at its pen, by its own sensors alone.
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

use crate::drawing::StrokeId;
use crate::math::standard_normal;
use crate::plan::SegmentKind;
use crate::robot::{ArmModel, JointVector};
use crate::skill::Felt;

/// How well an arm feels.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Feeling {
    /// Standard deviation of the noise of each reading of the force sensor, N.
    pub force_noise: f64,
    /// Force above which the arm takes it that it touches something, N.
    pub contact_force: f64,
    /// Steps between two touches that are kept.
    pub stride: u64,
}

/// Time constant of the low-pass on force readings, steps.
const SMOOTHING: f64 = 5.0;

/// A force sensor at the wrist, and the arm's own kinematics.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct TipSensor {
    feeling: Feeling,
    rng: ChaCha8Rng,
    force: f64,
    step: u64,
    felt: Vec<Felt>,
}

impl TipSensor {
    pub(crate) fn new(feeling: Feeling, rng: ChaCha8Rng) -> Self {
        Self { feeling, rng, force: 0.0, step: 0, felt: Vec::new() }
    }

    /// The filtered force along the pen, N.
    pub(crate) fn force(&self) -> f64 {
        self.force
    }

    pub(crate) fn take(&mut self) -> Vec<Felt> {
        std::mem::take(&mut self.felt)
    }

    /// One reading: `force` is what the sensor is pulled by, N, world; `model` and `q` are the robot's own.
    pub(crate) fn step(
        &mut self,
        time: f64,
        kind: SegmentKind,
        stroke: Option<StrokeId>,
        model: &ArmModel,
        q: &JointVector,
        force: &Vector3<f64>,
    ) {
        let pose = *model.kinematics(q).world_from_tip();
        let axis = pose.rotation * Vector3::z();
        let mut reading = -axis.dot(force);
        if self.feeling.force_noise > 0.0 {
            reading += self.feeling.force_noise * standard_normal(&mut self.rng);
        }
        self.force += (reading - self.force) / SMOOTHING;
        self.step += 1;
        if self.force > self.feeling.contact_force && self.step.is_multiple_of(self.feeling.stride.max(1)) {
            let tip = pose.translation.vector.into();
            self.felt.push(Felt { time, kind, stroke, tip, axis, force: self.force });
        }
    }
}
