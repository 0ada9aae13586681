//! Joint position control, as industrial arms have: stiff, and deaf to what the pen touches.
use nalgebra::{Point3, Vector6};

use crate::control::limits::TorqueLimits;
use crate::control::{MeasuredState, Reference, TorqueCommand};
use crate::robot::{ArmModel, JointVector, Kinematics};

/// Steps between two looks at how stiff the hand is: it follows the slowly changing inertia.
const STIFFNESS_PERIOD: u64 = 10;

/// Gains and limits of joint position control.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PositionOptions {
    /// Natural frequency of every joint's error, rad/s.
    pub frequency: f64,
    /// Its damping ratio; 1 is critical.
    pub damping_ratio: f64,
    /// Largest change of a joint torque, N m/s.
    pub torque_rate: f64,
}

impl Default for PositionOptions {
    /// 20 Hz, critically damped: position loops of industrial arms have 15 to 25 Hz.
    fn default() -> Self {
        Self { frequency: 20.0 * std::f64::consts::TAU, damping_ratio: 1.0, torque_rate: 3000.0 }
    }
}

/// The position controller of one arm.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct PositionController {
    model: ArmModel,
    options: PositionOptions,
    set_point: Point3<f64>,
    limits: TorqueLimits,
    pen_stiffness: f64,
    step: u64,
}

impl PositionController {
    /// A controller that believes the arm to be `model`.
    pub fn new(model: ArmModel, options: PositionOptions) -> Self {
        Self {
            model,
            options,
            set_point: Point3::origin(),
            limits: TorqueLimits::default(),
            pen_stiffness: f64::INFINITY,
            step: 0,
        }
    }

    /// The robot's model of itself.
    pub fn model(&self) -> &ArmModel {
        &self.model
    }

    /// Where the law desired the pen tip to be at its last call, m, world.
    pub fn set_point(&self) -> Point3<f64> {
        self.set_point
    }

    /// Stiffness of the hand along the pen, N/m, as of the last steps: `1 / (a^T J (w^2 M)^-1 J^T a)` with the pen's axis `a`.
    /// Infinite before the first step.
    pub fn pen_stiffness(&self) -> f64 {
        self.pen_stiffness
    }

    /// Joint torques for this step (`dt` s long): the computed-torque law
    ///
    /// `tau = M (qdd_d + 2 zeta w (qd_d - qd) + w^2 (q_d - q)) + C qd + g`
    ///
    /// (Siciliano et al., Robotics, 2009, section 8.5.2, doi:10.1007/978-1-84628-642-1), held within effort and rate limits. The force
    /// at the tip is what comes of it: the set point's depth times the stiffness of arm and nib in series.
    pub fn torque(
        &mut self,
        measured: &MeasuredState,
        k: &Kinematics,
        reference: &Reference,
        dt: f64,
    ) -> TorqueCommand {
        let (mass, bias) = self.model.mass_and_bias(k, &measured.qd);
        let (w, zeta) = (self.options.frequency, self.options.damping_ratio);
        let desired = self.model.kinematics(&reference.q);
        self.set_point = Point3::from(desired.world_from_tip().translation.vector);
        if self.step.is_multiple_of(STIFFNESS_PERIOD) {
            let axis = k.world_from_tip().rotation * nalgebra::Vector3::z();
            let pull = k.jacobian().transpose() * Vector6::new(axis.x, axis.y, axis.z, 0.0, 0.0, 0.0);
            // joints that the arm hasn't have no inertia and no part in this
            let n = self.model.dof();
            let mut own = mass;
            for i in n..pull.len() {
                own.row_mut(i).fill(0.0);
                own.column_mut(i).fill(0.0);
                own[(i, i)] = 1.0;
            }
            if let Some(factor) = own.cholesky() {
                let give = pull.dot(&factor.solve(&pull)) / (w * w);
                self.pen_stiffness = 1.0 / give.max(f64::MIN_POSITIVE);
            }
        }
        self.step += 1;
        let error: JointVector = reference.q - measured.q;
        let rate: JointVector = reference.qd - measured.qd;
        let tau = mass * (reference.qdd + rate * (2.0 * zeta * w) + error * (w * w)) + bias;
        self.limits.hold(&self.model, tau, self.options.torque_rate, dt)
    }
}
