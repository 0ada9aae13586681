//! Settings of the impedance law.

/// Stiffness, damping and limits of the Cartesian impedance law, in the pen frame (z along the pen).
///
/// The defaults are the gains that the drawing robot of the dissertation's laboratory used with its iiwa (daeunSong,
/// iiwa_examples, BSD: 1500 N/m across the pen, 350 N/m along it, 300 N m/rad, damping ratio 0.7).
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ImpedanceOptions {
    /// Translational stiffness along x, y, z of the pen frame, N/m.
    pub stiffness: [f64; 3],
    /// Rotational stiffness about x, y, z of the pen frame, N m/rad.
    pub rotational_stiffness: [f64; 3],
    /// Damping ratio of every direction, 1 is critical.
    pub damping_ratio: f64,
    /// Stiffness with which joint motion that doesn't move the pen is held to the plan, N m/rad.
    pub nullspace_stiffness: f64,
    /// Damping ratio of that motion.
    pub nullspace_damping_ratio: f64,
    /// Adds the friction that the moving pen will feel, `mu F`, along the planned direction of motion.
    pub friction_feedforward: bool,
    /// The robot's belief of pen-canvas Coulomb friction, for the feed-forward.
    pub believed_friction: f64,
    /// Largest change of a joint torque, N m/s.
    pub torque_rate: f64,
}

impl Default for ImpedanceOptions {
    fn default() -> Self {
        Self {
            stiffness: [1500.0, 1500.0, 350.0],
            rotational_stiffness: [300.0; 3],
            damping_ratio: 0.7,
            nullspace_stiffness: 20.0,
            nullspace_damping_ratio: 0.7,
            friction_feedforward: true,
            believed_friction: 0.3,
            torque_rate: 3000.0,
        }
    }
}
