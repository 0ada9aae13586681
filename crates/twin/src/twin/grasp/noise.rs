//! What sensors add to what they measure.
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::math::standard_normal;
use crate::skill::HandState;
use crate::truth::SensorNoise;

/// Noise as it stands in one step.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct NoiseSource {
    sd: SensorNoise,
    rng: ChaCha8Rng,
    /// On the wrist's force, N, and torque, N m.
    pub wrench: [Vector3<f64>; 2],
    fingers: [[f64; 3]; 3],
}

impl NoiseSource {
    pub fn new(sd: SensorNoise, rng: ChaCha8Rng) -> Self {
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
