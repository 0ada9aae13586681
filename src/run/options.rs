//! A scenario's settings in the terms of the stages: SI units.
use crate::control::ImpedanceOptions;
use crate::plan::PlanOptions;
use crate::scenario::Scenario;
use crate::twin::TwinOptions;

/// Settings of the planner.
pub(super) fn plan_options(s: &Scenario) -> PlanOptions {
    PlanOptions {
        pen_speed: s.control.speed_mm_s * 1e-3,
        landing_speed: s.control.landing_speed_mm_s * 1e-3,
        travel_speed: s.control.travel_speed_mm_s * 1e-3,
        joint_speed_fraction: s.plan.joint_speed_fraction,
        joint_acceleration: s.plan.joint_acceleration_rad_s2,
        joint_jerk: s.plan.joint_jerk_rad_s3,
        cartesian_acceleration: s.plan.acceleration_mm_s2 * 1e-3,
        hover: s.plan.hover_mm * 1e-3,
        press_depth: s.pen.press_depth_mm * 1e-3,
        step: s.plan.step_mm * 1e-3,
        pen_change: s.pen.change_s,
        partial: s.plan.partial,
        ..Default::default()
    }
}

/// Settings of the impedance law.
pub(super) fn control_options(s: &Scenario) -> ImpedanceOptions {
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

/// Normal force that stiffness along the pen and press depth ask for, N (eq. 6.1: `f = k delta`).
pub(super) fn drawing_force(s: &Scenario) -> f64 {
    s.control.stiffness_n_m[2] * s.pen.press_depth_mm * 1e-3
}
