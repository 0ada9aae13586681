//! What a drive can do: torque limits, and how fast a torque may change.
use crate::control::TorqueCommand;
use crate::robot::{ArmModel, JointVector};

/// Holds torques within effort and rate limits; it remembers the last torques.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct TorqueLimits {
    last: Option<JointVector>,
}

impl TorqueLimits {
    /// The torques nearest to `tau` (N m) that `arm` can give after those of `dt` s ago, changing by `rate` N m/s at most.
    pub(super) fn hold(&mut self, arm: &ArmModel, mut tau: JointVector, rate: f64, dt: f64) -> TorqueCommand {
        let (n, step) = (arm.dof(), rate * dt);
        let mut saturated = false;
        for i in 0..n {
            let effort = arm.joints[i].effort;
            let mut t = tau[i].clamp(-effort, effort);
            if let Some(last) = &self.last {
                t = t.clamp(last[i] - step, last[i] + step);
            }
            saturated |= t != tau[i];
            tau[i] = t;
        }
        for i in n..tau.len() {
            tau[i] = 0.0;
        }
        self.last = Some(tau);
        TorqueCommand { torque: tau, saturated }
    }
}
