//! A scenario's settings in the terms of the stages: SI units.
use crate::control::{Controller, ImpedanceController, ImpedanceOptions, LawKind, PositionController, PositionOptions};
use crate::pen::LayerPen;
use crate::pen::PenModel;
use crate::plan::{PlanOptions, PressDepths};
use crate::robot::ArmModel;
use crate::scenario::Scenario;
use crate::twin::TwinOptions;

/// Widths for which a pen's press depth is worked out; between them it is interpolated.
const WIDTHS: usize = 16;

/// How deep each layer's pen is pressed: as the scenario says, and for a wished width as the pen's force for it asks,
/// `delta = f / k` (eq. 6.1).
fn press_depths(s: &Scenario, pens: &[LayerPen]) -> PressDepths {
    let table = |pen: &PenModel| -> Vec<(f64, f64)> {
        let [low, high] = pen.force_range();
        let speed = s.control.speed_mm_s * 1e-3;
        let [narrow, wide] = [low, high].map(|force| pen.line_width(force, speed));
        let widths = (0..WIDTHS).map(|i| narrow + (wide - narrow) * i as f64 / (WIDTHS - 1) as f64);
        // a stiff arm leaves all of the give to the nib
        let stiffness = match s.control.law {
            LawKind::Impedance => s.control.stiffness_n_m[2],
            LawKind::Position => pen.spring.stiffness,
        };
        let mut depths: Vec<_> = widths.map(|w| (w, pen.force_for_width(w, speed) / stiffness)).collect();
        // a pen whose line hardly changes has fewer widths than that
        depths.dedup_by(|b, a| b.0 <= a.0);
        depths
    };
    PressDepths { default: s.pen.press_depth_mm * 1e-3, layers: pens.iter().map(|p| table(&p.pen)).collect() }
}

/// Settings of the planner.
pub(super) fn plan_options(s: &Scenario, pens: &[LayerPen]) -> PlanOptions {
    PlanOptions {
        pen_speed: s.control.speed_mm_s * 1e-3,
        landing_speed: s.control.landing_speed_mm_s * 1e-3,
        travel_speed: s.control.travel_speed_mm_s * 1e-3,
        joint_speed_fraction: s.plan.joint_speed_fraction,
        joint_acceleration: s.plan.joint_acceleration_rad_s2,
        joint_jerk: s.plan.joint_jerk_rad_s3,
        cartesian_acceleration: s.plan.acceleration_mm_s2 * 1e-3,
        hover: s.plan.hover_mm * 1e-3,
        press: press_depths(s, pens),
        step: s.plan.step_mm * 1e-3,
        pen_change: s.pen.change_s,
        partial: s.plan.partial,
        ..Default::default()
    }
}

/// The controller of an arm, which believes the arm to be `model`.
pub(super) fn controller(s: &Scenario, model: &ArmModel) -> Controller {
    match s.control.law {
        LawKind::Impedance => ImpedanceController::new(model.clone(), impedance_options(s)).into(),
        LawKind::Position => {
            let options = PositionOptions {
                frequency: s.control.position_hz * std::f64::consts::TAU,
                torque_rate: s.control.torque_rate_nm_ms * 1e3,
                ..Default::default()
            };
            PositionController::new(model.clone(), options).into()
        }
    }
}

/// Settings of the impedance law.
fn impedance_options(s: &Scenario) -> ImpedanceOptions {
    let c = &s.control;
    ImpedanceOptions {
        stiffness: c.stiffness_n_m,
        rotational_stiffness: c.stiffness_nm_rad,
        damping_ratio: c.damping_ratio,
        nullspace_stiffness: c.nullspace_stiffness_nm_rad,
        nullspace_damping_ratio: c.nullspace_damping_ratio,
        friction_feedforward: c.friction_feedforward,
        believed_friction: c.believed_friction,
        torque_rate: c.torque_rate_nm_ms * 1e3,
    }
}

/// Settings of the simulation.
pub(super) fn twin_options(s: &Scenario) -> TwinOptions {
    TwinOptions {
        plant: s.sim.plant,
        sample_period: 1.0 / s.sim.record_hz,
        torque_noise: s.control.torque_noise_nm,
        delay: s.control.delay_ms * 1e-3,
        seed: s.seed,
        ..Default::default()
    }
}
