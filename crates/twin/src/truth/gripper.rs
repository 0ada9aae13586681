//! How an arm's hand, its docks and its tools are in truth.
use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;

use super::{DockError, ErrorRanges, Variation};
use crate::math::{Pose, Rgb, standard_normal, stream, unit};
use crate::mesh::MeshError;
use crate::robot::ArmModel;
use crate::skill::{GripperKit, holding_at, open_fingers, with_hand_at};

/// Pose repeatability of ISO 9283 is mean and three standard deviations of the distance from the mean pose; of a displacement whose
/// three components have the standard deviation `s` each, that is `(1.596 + 3 * 0.673) s`.
const REPEATABILITY_DEVIATIONS: f64 = 3.615;

/// How hands, docks and tools may differ from the design.
#[derive(Clone, Debug, PartialEq)]
pub struct GripperTruth {
    /// Errors of docks.
    pub docks: ErrorRanges,
    /// Largest error of the hand's place on the flange along each axis, m.
    pub hand_place: f64,
    /// Largest error of its angle about each axis, rad.
    pub hand_angle: f64,
    /// Friction by the design's is drawn from 1 -+ this.
    pub friction_spread: f64,
    /// Mass of the tool by the design's is drawn from 1 -+ this.
    pub mass_spread: f64,
    /// Strength of the fingers by the design's is drawn from 1 -+ this.
    pub strength_spread: f64,
    /// Standard deviation of each component of the wrist's force, N.
    pub force_noise: f64,
    /// Standard deviation of each finger angle that is read, rad.
    pub finger_noise: f64,
    /// Pose repeatability of the arm (ISO 9283), m: each approach is off by a displacement of its own.
    pub repeatability: f64,
}

/// One arm's hand, docks and tools as they are.
#[derive(Clone, Debug)]
pub struct TrueGripper {
    kit: Arc<GripperKit>,
    truth: GripperTruth,
    seed: u64,
}

impl TrueGripper {
    /// What belongs to the arm of `kit` in the run of this seed.
    pub fn new(kit: Arc<GripperKit>, truth: GripperTruth, seed: u64) -> Self {
        Self { kit, truth, seed }
    }

    /// What the robot knows of it.
    pub fn kit(&self) -> &Arc<GripperKit> {
        &self.kit
    }

    fn stream(&self, what: &str, index: usize) -> ChaCha8Rng {
        stream(self.seed, &format!("{what} of {}", self.kit.arm.name), index as u64)
    }

    /// A uniform sample in +-1, keyed by seed, words and index.
    fn uniform(&self, what: &str, index: usize) -> f64 {
        2.0 * unit(&mut self.stream(what, index)) - 1.0
    }

    fn hand_error(&self) -> Pose {
        let axes = |what: &str| Vector3::from([0, 1, 2].map(|i| self.uniform(what, i)));
        let turn = axes("hand angle") * self.truth.hand_angle;
        let place = axes("hand place") * self.truth.hand_place;
        Pose::from_parts(Translation3::from(place), UnitQuaternion::from_scaled_axis(turn))
    }

    /// How a dock, the tool in it and the hand that comes for it differ from the design.
    pub(crate) fn variation(&self, dock: usize) -> Variation {
        let t = &self.truth;
        let one = |what: &str, spread: f64| 1.0 + spread * self.uniform(what, dock);
        Variation {
            friction_fingers: one("friction of fingers", t.friction_spread),
            friction_dock: one("friction of docks", t.friction_spread),
            mass: one("tool's mass", t.mass_spread),
            strength: one("strength", t.strength_spread),
            hand_error: self.hand_error(),
            noise: super::SensorNoise { force: t.force_noise, torque: 0.0, fingers: t.finger_noise },
        }
    }

    /// How a dock stands off from where the robot believes it.
    pub(crate) fn dock_error(&self, dock: usize) -> DockError {
        self.truth.docks.draw(&mut self.stream("dock error", dock))
    }

    /// The stream of sensor noise in one tool change: `what` names it, `count` is how often this dock's pen was fetched before.
    pub(crate) fn senses(&self, what: &str, dock: usize, count: u64) -> ChaCha8Rng {
        let name = &self.kit.arm.name;
        stream(self.seed, &format!("senses of {name} in {what} at dock {dock}"), count)
    }

    /// How far the hand stands off in one approach from where the arm's joints tell, m, world.
    pub(crate) fn approach_error(&self, what: &str, dock: usize, count: u64) -> Vector3<f64> {
        let name = &self.kit.arm.name;
        let mut rng = stream(self.seed, &format!("repeatability of {name} in {what} at dock {dock}"), count);
        let sd = self.truth.repeatability / REPEATABILITY_DEVIATIONS;
        Vector3::from_fn(|_, _| sd * standard_normal(&mut rng))
    }

    /// The arm with an empty hand.
    pub fn bare(&self) -> ArmModel {
        let kit = &self.kit;
        with_hand_at(&kit.arm, &kit.hand, &self.hand_error(), &open_fingers())
    }

    /// The arm with a dock's tool in its hand: the tool at `last_from_tool`, with its own mass, the fingers at `fingers` (rad), a pen of
    /// the given colour.
    pub(crate) fn holding(
        &self,
        dock: usize,
        last_from_tool: &Isometry3<f64>,
        fingers: &[[f64; 3]; 3],
        pen: Rgb,
    ) -> Result<ArmModel, MeshError> {
        let (kit, variation) = (&self.kit, self.variation(dock));
        let arm = with_hand_at(&kit.arm, &kit.hand, &variation.hand_error, fingers);
        holding_at(arm, &variation.set(&kit.set), last_from_tool, pen)
    }
}
