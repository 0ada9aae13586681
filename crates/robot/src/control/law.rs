//! The law that moves an arm: one of two.
use nalgebra::Point3;

use crate::control::{
    ImpedanceController, ImpedanceOptions, MeasuredState, PositionController, PositionOptions, Reference, TorqueCommand,
};
use crate::robot::{ArmModel, JointVector, Kinematics};

/// Which law moves the arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LawKind {
    /// The pen gives way like a spring: force follows from press depth and stiffness.
    #[default]
    Impedance,
    /// Joints are held where the plan wants them, whatever the pen touches.
    Position,
}

/// The controller of one arm.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[allow(clippy::large_enum_variant)]
pub enum Controller {
    /// Cartesian impedance.
    Impedance(ImpedanceController),
    /// Joint positions.
    Position(PositionController),
}

impl Controller {
    /// Joint torques for this step (`dt` s long), within effort and rate limits.
    pub fn torque(
        &mut self,
        measured: &MeasuredState,
        k: &Kinematics,
        reference: &Reference,
        dt: f64,
    ) -> TorqueCommand {
        match self {
            Self::Impedance(c) => c.torque(measured, k, reference, dt),
            Self::Position(c) => c.torque(measured, k, reference, dt),
        }
    }

    /// Whether the law can't move the hand every way with the joints at `q` (rad); one that moves joints always can.
    pub fn is_singular(&self, q: &JointVector) -> bool {
        match self {
            Self::Impedance(c) => c.is_singular(q),
            Self::Position(_) => false,
        }
    }

    /// Where the law desired the pen tip to be at its last call, m, world.
    pub fn set_point(&self) -> Point3<f64> {
        match self {
            Self::Impedance(c) => c.set_point(),
            Self::Position(c) => c.set_point(),
        }
    }

    /// The robot's model of itself.
    pub fn model(&self) -> &ArmModel {
        match self {
            Self::Impedance(c) => c.model(),
            Self::Position(c) => c.model(),
        }
    }

    /// Force by press depth, N/m, of a pen whose nib has the stiffness `nib` (N/m). An impedance law takes the nib's give out of the
    /// account (equation 6.1, whose stiffness is small against a nib's); under position control nib and arm are springs in series.
    pub fn press_stiffness(&self, nib: f64) -> f64 {
        match self {
            Self::Impedance(c) => c.options().stiffness[2],
            Self::Position(c) => 1.0 / (1.0 / nib + 1.0 / c.pen_stiffness()),
        }
    }
}

/// Which law, and its settings.
#[derive(Clone, Debug, PartialEq)]
pub enum LawOptions {
    /// Cartesian impedance.
    Impedance(ImpedanceOptions),
    /// Joint positions.
    Position(PositionOptions),
}

impl LawOptions {
    /// The controller of an arm that believes itself to be `model`.
    pub fn controller(&self, model: ArmModel) -> Controller {
        match self {
            Self::Impedance(options) => ImpedanceController::new(model, options.clone()).into(),
            Self::Position(options) => PositionController::new(model, options.clone()).into(),
        }
    }
}

impl From<ImpedanceController> for Controller {
    fn from(c: ImpedanceController) -> Self {
        Self::Impedance(c)
    }
}

impl From<PositionController> for Controller {
    fn from(c: PositionController) -> Self {
        Self::Position(c)
    }
}
