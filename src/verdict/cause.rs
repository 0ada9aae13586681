//! What most likely lies behind a run that didn't come to a drawing: the setting that is farthest beyond what does no harm.
use std::fmt;

use crate::control::LawKind;
use crate::measure::Metrics;
use crate::robot::Arm;
use crate::scenario::{BeliefKind, Scenario};

/// Age of the state that the law bears without swinging, ms.
const BORNE_DELAY_MS: f64 = 8.0;
/// Noise of the torques that a drawing bears, N m.
const BORNE_NOISE_NM: f64 = 0.5;
/// How far friction may hold the pen from where it is wanted, mm.
const BORNE_STICTION_MM: f64 = 2.0;
/// How far a canvas may lie sideways from where it is believed, mm.
const BORNE_OFFSET_MM: f64 = 2.0;

/// Fastest landing that no pen minds, mm/s.
const BORNE_LANDING_MM_S: f64 = 10.0;

/// The likely cause, in words with its numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cause(String);

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Cause {
    /// The cause that stands out most in what a scenario asks, a robot is, and a run was.
    /// `peak` says that nothing but the force of a landing is too much; `takes` is the force that the pens take, N.
    pub(super) fn of(scenario: &Scenario, arms: &[Arm], metrics: &Metrics, takes: f64, peak: bool) -> Self {
        let c = &scenario.control;
        let mut suspects = vec![
            (
                c.delay_ms / BORNE_DELAY_MS,
                format!("the law sees the arm {} ms late (control.delay_ms) and swings", c.delay_ms),
            ),
            (
                c.torque_noise_nm / BORNE_NOISE_NM,
                format!("noise of {} N m on every joint (control.torque_noise_nm) shakes the pen", c.torque_noise_nm),
            ),
        ];
        if peak {
            let words = format!("the pen lands at up to {} mm/s (control.landing_speed_mm_s)", c.landing_speed_mm_s);
            suspects.push((c.landing_speed_mm_s / BORNE_LANDING_MM_S, words));
        }
        suspects.extend(displaced(scenario, metrics));
        suspects.extend(mistaken(scenario, metrics));
        suspects.extend(
            metrics
                .base
                .as_ref()
                .and_then(|b| b.pose_error_mm)
                .map(|off| (off / BORNE_OFFSET_MM, format!("the base stood {off:.1} mm from where it believed to be"))),
        );
        suspects.extend(metrics.plan.as_ref().map(|p| {
            let reached = p.reachable_fraction;
            (0.6 / reached.max(1e-3), format!("the robot reaches only {:.0} % of the line", 100.0 * reached))
        }));
        suspects.extend(metrics.contact.as_ref().and_then(|c| c.force_target_n).map(|asked| {
            let depth = scenario.pen.press_depth_mm;
            let words = format!("pen.press_depth_mm = {depth} asks for {asked:.1} N, and the pen takes {takes:.1} N");
            (asked / takes, words)
        }));
        if c.law == LawKind::Impedance {
            suspects.extend(arms.iter().filter_map(|arm| stiction(arm, c.stiffness_n_m)));
        }
        let worst = suspects.into_iter().filter(|s| s.0 >= 1.0).max_by(|a, b| a.0.total_cmp(&b.0));
        Self(match worst {
            Some((_, words)) => format!("likely because {words}"),
            None => "no setting stands out as the cause; report.html shows where it went wrong".into(),
        })
    }
}

/// A canvas that isn't where the robot believes, against what the press depth makes up for.
fn displaced(scenario: &Scenario, metrics: &Metrics) -> Option<(f64, String)> {
    // who looks or feels where the canvas is doesn't mind
    let truth = metrics.truth.as_ref().filter(|_| scenario.canvas.belief == BeliefKind::Mesh)?;
    let (offset, shape) = (truth.offset_mm.unwrap_or(0.0), truth.hausdorff_mm.unwrap_or(0.0));
    let turn = truth.turn_deg.unwrap_or(0.0);
    let words = if offset.max(shape) > 0.0 || turn == 0.0 {
        format!(
            "the canvas lies {offset:.1} mm from where the robot believes, and its shape is up to {shape:.1} mm off, where the pen \
             presses {} mm deep",
            scenario.pen.press_depth_mm
        )
    } else {
        format!("the canvas is turned by {turn:.1} deg against what the robot believes")
    };
    Some((((offset + shape) / BORNE_OFFSET_MM).max(turn), words))
}

/// A canvas that was scanned or touched, and is believed to be where it isn't.
fn mistaken(scenario: &Scenario, metrics: &Metrics) -> Option<(f64, String)> {
    let belief = metrics.belief.as_ref()?;
    let off = belief.error_p95_mm?;
    let words = format!(
        "the believed canvas is {off:.1} mm from the true one (belief.error_p95_mm), and the pen presses {} mm deep",
        scenario.pen.press_depth_mm
    );
    Some((off / scenario.pen.press_depth_mm, words))
}

/// Friction in the joints against the stiffness of the law: a joint moves only once the pen is so far from where it is wanted that the
/// law's force, at the joint's lever, `k e r`, is more than the friction.
fn stiction(arm: &Arm, stiffness: [f64; 3]) -> Option<(f64, String)> {
    let jacobian = arm.model.kinematics(&arm.home).jacobian();
    let soft = stiffness.into_iter().fold(f64::INFINITY, f64::min);
    let joints = arm.model.joints.iter().enumerate().filter_map(|(i, joint)| {
        let lever = jacobian.column(i).fixed_rows::<3>(0).norm();
        // a joint that hardly moves the tip is moved by the law's turning stiffness
        (lever > 0.05).then(|| (joint.friction / (soft * lever) * 1e3, joint, lever))
    });
    let (held, joint, lever) = joints.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let words = format!(
        "friction of {:.2} N m in joint {} holds the pen until it is {held:.1} mm off: {soft:.0} N/m (control.stiffness_n_m) on a lever \
         of {lever:.2} m; see friction_rejection in the robot's file",
        joint.friction, joint.name
    );
    Some((held / BORNE_STICTION_MM, words))
}
