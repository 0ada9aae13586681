//! A scenario's settings in the terms of the stages: SI units.
use crate::control::{ImpedanceOptions, LawKind, LawOptions, PositionOptions};
use crate::pen::LayerPen;
use crate::plan::{HandStiffness, PlanOptions, PressDepths};
use crate::skill::{GripperOptions, TouchOptions};
use crate::truth::{ErrorRanges, GripperTruth, TruthSpec};
use crate::twin::TwinOptions;

use super::{Scenario, ToolSettings, TouchSettings};

/// How deep each layer's pen is pressed: as the scenario says, and for a desired width as the pen's force for it asks.
fn press_depths(s: &Scenario, pens: &[LayerPen]) -> PressDepths {
    let speed = s.control.speed_mm_s * 1e-3;
    // a stiff arm leaves all of the give to the nib
    let stiffness = |pen: &LayerPen| match s.control.law {
        LawKind::Impedance => s.control.stiffness_n_m[2],
        LawKind::Position => pen.pen.spring.stiffness,
    };
    PressDepths {
        default: s.pen.press_depth_mm * 1e-3,
        layers: pens.iter().map(|p| PressDepths::by_width(&p.pen, stiffness(p), speed)).collect(),
    }
}

/// Settings of the planner.
pub(crate) fn plan_options(s: &Scenario, pens: &[LayerPen]) -> PlanOptions {
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

/// The law that moves the arms.
pub(crate) fn law(s: &Scenario) -> LawOptions {
    match s.control.law {
        LawKind::Impedance => LawOptions::Impedance(impedance_options(s)),
        LawKind::Position => LawOptions::Position(PositionOptions {
            frequency: s.control.position_hz * std::f64::consts::TAU,
            torque_rate: s.control.torque_rate_nm_ms * 1e3,
            ..Default::default()
        }),
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

/// How the hand gives way under that law; `None` where it doesn't.
pub(crate) fn hand_stiffness(s: &Scenario) -> Option<HandStiffness> {
    let c = &s.control;
    (c.law == LawKind::Impedance)
        .then_some(HandStiffness { translational: c.stiffness_n_m, rotational: c.stiffness_nm_rad })
}

/// Settings of the simulation.
pub(crate) fn twin_options(s: &Scenario) -> TwinOptions {
    TwinOptions {
        plant: s.sim.plant,
        sample_period: 1.0 / s.sim.record_hz,
        torque_noise: s.control.torque_noise_nm,
        delay: s.control.delay_ms * 1e-3,
        seed: s.seed,
        ..Default::default()
    }
}

/// Settings of drawing by touch.
pub(crate) fn touch_options(s: &Scenario, touch: &TouchSettings) -> TouchOptions {
    TouchOptions {
        range: touch.range_mm.map(|mm| mm * 1e-3),
        probes: touch.probes as usize,
        probe_speed: touch.probe_speed_mm_s * 1e-3,
        contact_force: touch.contact_n,
        piece: touch.piece_mm * 1e-3,
        clearance: touch.clearance_mm * 1e-3,
        seek: touch.seek_mm * 1e-3,
        step: s.plan.step_mm * 1e-3,
    }
}

/// How the design of pen tools is changed, and how often a change is tried.
pub(crate) fn gripper_options(tools: &ToolSettings) -> GripperOptions {
    GripperOptions {
        plates: tools.plates,
        bevels: tools.bevels,
        finger_friction: tools.finger_friction,
        dock_friction: tools.dock_friction,
        plate_gap: tools.plate_gap_mm.map(|mm| mm * 1e-3),
        bevel: tools.bevel_deg.map(f64::to_radians),
        attempts: tools.attempts,
    }
}

/// How truth may differ from belief; `friction` is that of the canvas.
pub(crate) fn truth_spec(s: &Scenario, friction: f64) -> TruthSpec {
    let tools = s.tools.clone().unwrap_or_default();
    let docks = ErrorRanges {
        xy: tools.dock_xy_mm * 1e-3,
        z: tools.dock_z_mm * 1e-3,
        tilt: tools.dock_tilt_deg.to_radians(),
        yaw: tools.dock_yaw_deg.to_radians(),
    };
    TruthSpec {
        canvas: s.truth.options(),
        friction,
        compliance: s.truth.compliance_mm_n * 1e-3,
        gripper: GripperTruth {
            docks: docks.scaled(tools.error_scale),
            hand_place: tools.hand_mm * 1e-3,
            hand_angle: tools.hand_deg.to_radians(),
            friction_spread: tools.friction_spread,
            mass_spread: tools.mass_spread,
            strength_spread: tools.strength_spread,
            force_noise: tools.force_noise_n,
            finger_noise: tools.finger_noise_deg.to_radians(),
            repeatability: tools.repeatability_mm * 1e-3,
        },
        seed: s.seed,
    }
}
