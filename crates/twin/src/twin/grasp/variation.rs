//! How a trial's truth differs from what the robot believes, and how well it senses.
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

use crate::math::{Pose, standard_normal, stream};
use crate::skill::{Carrier, HandModel, HandState};
use crate::tool::ToolSet;

/// What is true of hand and tool but not known to the robot. The default changes nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation {
    /// Friction between tool and fingers, in units of the believed one.
    pub friction_fingers: f64,
    /// Friction between tool and dock, in units of the believed one.
    pub friction_dock: f64,
    /// Mass of the tool, in units of the believed one.
    pub mass: f64,
    /// Strength of all fingers, in units of the believed one.
    pub strength: f64,
    /// True pose of the grip frame in the believed one: how badly the hand is calibrated on its flange.
    pub hand_error: Pose,
    /// How well the robot senses.
    pub noise: SensorNoise,
}

/// Standard deviations of white noise on what is sensed in every step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorNoise {
    /// Of each component of the wrist's force, N.
    pub force: f64,
    /// Of each component of the wrist's torque, N m.
    pub torque: f64,
    /// Of each finger joint, rad.
    pub fingers: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for Variation {
    fn default() -> Self {
        Self {
            friction_fingers: 1.0,
            friction_dock: 1.0,
            mass: 1.0,
            strength: 1.0,
            hand_error: Pose::identity(),
            noise: SensorNoise::default(),
        }
    }
}

impl Variation {
    /// The true tool and dock.
    pub(super) fn set(&self, believed: &ToolSet) -> ToolSet {
        let mut set = believed.clone();
        set.tool.friction_fingers *= self.friction_fingers;
        set.tool.friction_dock *= self.friction_dock;
        set.tool.mass *= self.mass;
        set
    }

    /// The true hand.
    pub(super) fn hand(&self, believed: &HandModel) -> HandModel {
        let mut hand = believed.clone();
        for finger in &mut hand.fingers {
            finger.strength *= self.strength;
        }
        hand
    }

    /// The carrier with the hand where it truly is.
    pub(super) fn carrier(&self, believed: &Carrier) -> Carrier {
        let mut carrier = believed.clone();
        carrier.plant.last_from_tip *= self.hand_error;
        carrier
    }
}

/// Noise as it stands in one step.
pub(super) struct NoiseSource {
    sd: SensorNoise,
    rng: ChaCha8Rng,
    /// On the wrist's force, N, and torque, N m.
    pub wrench: [Vector3<f64>; 2],
    fingers: [[f64; 3]; 3],
}

impl NoiseSource {
    pub fn new(sd: SensorNoise) -> Self {
        let rng = stream(sd.seed, "grasp_senses", 0);
        Self { sd, rng, wrench: [Vector3::zeros(); 2], fingers: [[0.0; 3]; 3] }
    }

    /// Draws the next step's.
    pub fn draw(&mut self) {
        let SensorNoise { force, torque, fingers, .. } = self.sd;
        if force == 0.0 && torque == 0.0 && fingers == 0.0 {
            return;
        }
        let rng = &mut self.rng;
        for (v, sd) in self.wrench.iter_mut().zip([force, torque]) {
            *v = Vector3::from_fn(|_, _| sd * standard_normal(rng));
        }
        for q in self.fingers.iter_mut().flatten() {
            *q = fingers * standard_normal(rng);
        }
    }

    /// The finger joints as they are read.
    pub fn read(&self, mut state: HandState) -> HandState {
        for (q, noise) in state.q.iter_mut().flatten().zip(self.fingers.iter().flatten()) {
            *q += noise;
        }
        state
    }
}
