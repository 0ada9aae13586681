//! Settings of a simulation.

/// Which plant answers the torques.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlantKind {
    /// rapier's reduced-coordinate multibody.
    #[default]
    Rapier,
    /// Calamus's own articulated-body integrator: faster, and independent of rapier.
    Articulated,
}

/// Settings of a simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct TwinOptions {
    /// Which plant answers the torques.
    pub plant: PlantKind,
    /// Physics and control step, s.
    pub dt: f64,
    /// Seconds between recorded samples.
    pub sample_period: f64,
    /// Standard deviation of the noise of each joint-torque sensor, N m; the torque loop passes it on to the joint.
    pub torque_noise: f64,
    /// Time from measuring to acting, s, rounded to whole steps.
    pub delay: f64,
    /// Seed of the run.
    pub seed: u64,
}

impl Default for TwinOptions {
    fn default() -> Self {
        Self { plant: PlantKind::Rapier, dt: 0.001, sample_period: 0.01, torque_noise: 0.0, delay: 0.0, seed: 1 }
    }
}
