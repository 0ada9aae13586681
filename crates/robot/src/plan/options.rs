//! What a planner may be asked for: speeds, heights and margins.
use crate::plan::PressDepths;
use crate::robot::{ArmModel, JointVector};

/// How a drawing is turned into motion. SI units; the default draws slowly and keeps well clear, as the paper does
/// (40 mm/s, 20 % of the joints' speed, 3 mm press depth).
#[derive(Clone, Debug, PartialEq)]
pub struct PlanOptions {
    /// Speed of the pen along a stroke, m/s.
    pub pen_speed: f64,
    /// Highest speed of the pen where it may touch the canvas, m/s; pressing on may be twice as fast.
    pub landing_speed: f64,
    /// Highest speed of the tip while it travels, m/s.
    pub travel_speed: f64,
    /// Share of each joint's speed limit that is used, in (0, 1].
    pub joint_speed_fraction: f64,
    /// Highest joint acceleration, rad/s2 (m/s2 for sliding joints).
    pub joint_acceleration: f64,
    /// Highest joint jerk, rad/s3 (m/s3 for sliding joints).
    pub joint_jerk: f64,
    /// Highest acceleration of the tip along and across a stroke, m/s2.
    pub cartesian_acceleration: f64,
    /// Height of the tip above the canvas where a press starts and a lift ends, m.
    pub hover: f64,
    /// Press depth delta of equation 6.1: how far the set point lies under the believed surface.
    pub press: PressDepths,
    /// Most that the press depth may change along a stroke, m per m. What is desired to change faster is spread out.
    pub press_slope: f64,
    /// Most that the press depth may change in time on a stroke, m/s: the pen goes slower where it must.
    pub press_rate: f64,
    /// Largest distance between two planned poses along a stroke, m.
    pub step: f64,
    /// A change of direction above this is a corner: the pen stops there, rad.
    pub corner_angle: f64,
    /// Largest deviation of the joint path from the desired path between two poses, m.
    pub path_tolerance: f64,
    /// Distance kept from joint limits, rad (m for sliding joints).
    pub limit_margin: f64,
    /// Distance kept between the links and the canvas or the furniture, m.
    pub canvas_margin: f64,
    /// Distance kept between links of the arm, m.
    pub self_margin: f64,
    /// Smallest singular value of the five-row task Jacobian (m and rad, per rad) that is allowed.
    pub singularity_margin: f64,
    /// Time that a pen change takes at the service pose, s.
    pub pen_change: f64,
    /// Draw what can be reached, and report the rest, instead of refusing the drawing.
    pub partial: bool,
}

impl Default for PlanOptions {
    fn default() -> Self {
        Self {
            pen_speed: 0.04,
            landing_speed: 0.008,
            travel_speed: 0.25,
            joint_speed_fraction: 0.2,
            joint_acceleration: 2.0,
            joint_jerk: 40.0,
            cartesian_acceleration: 0.5,
            hover: 0.008,
            press: PressDepths::constant(0.003),
            press_slope: 2.0,
            press_rate: 0.03,
            step: 0.001,
            corner_angle: 20f64.to_radians(),
            path_tolerance: 5e-5,
            limit_margin: 0.03,
            canvas_margin: 0.005,
            self_margin: 0.010,
            singularity_margin: 0.02,
            pen_change: 20.0,
            partial: false,
        }
    }
}

impl PlanOptions {
    /// The first option that makes no sense: its name, its value and what would be right.
    pub fn invalid(&self) -> Option<(&'static str, f64, &'static str)> {
        let positive = [
            ("pen_speed", self.pen_speed),
            ("landing_speed", self.landing_speed),
            ("travel_speed", self.travel_speed),
            ("joint_acceleration", self.joint_acceleration),
            ("joint_jerk", self.joint_jerk),
            ("cartesian_acceleration", self.cartesian_acceleration),
            ("hover", self.hover),
            ("step", self.step),
            ("corner_angle", self.corner_angle),
            ("path_tolerance", self.path_tolerance),
            ("press_slope", self.press_slope),
            ("press_rate", self.press_rate),
        ];
        let not_negative = [
            ("limit_margin", self.limit_margin),
            ("canvas_margin", self.canvas_margin),
            ("self_margin", self.self_margin),
            ("singularity_margin", self.singularity_margin),
            ("pen_change", self.pen_change),
        ];
        if let Some(bad) = self.press.invalid() {
            return Some(("press_depth", bad, "zero or positive, at widths that rise"));
        }
        let fraction = self.joint_speed_fraction;
        if !(fraction > 0.0 && fraction <= 1.0) {
            return Some(("joint_speed_fraction", fraction, "above 0 and at most 1"));
        }
        let bad = positive.iter().find(|(_, v)| !(*v > 0.0 && v.is_finite())).map(|(n, v)| (*n, *v, "positive"));
        bad.or_else(|| {
            let bad = not_negative.iter().find(|(_, v)| !(*v >= 0.0 && v.is_finite()));
            bad.map(|(n, v)| (*n, *v, "zero or positive"))
        })
    }
}

/// Limits of a motion, one entry a joint (infinite past the chain's joints).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLimits {
    /// Joint speed, rad/s.
    pub speed: JointVector,
    /// Joint acceleration, rad/s2.
    pub acceleration: JointVector,
    /// Joint jerk, rad/s3.
    pub jerk: JointVector,
    /// Acceleration of the tip, m/s2.
    pub cartesian_acceleration: f64,
}

impl MotionLimits {
    /// The limits that `options` put on `arm`.
    pub fn new(arm: &ArmModel, options: &PlanOptions) -> Self {
        let per_joint =
            |f: &dyn Fn(usize) -> f64| JointVector::from_fn(|i, _| if i < arm.dof() { f(i) } else { f64::INFINITY });
        Self {
            speed: per_joint(&|i| arm.joints[i].velocity * options.joint_speed_fraction),
            acceleration: per_joint(&|_| options.joint_acceleration),
            jerk: per_joint(&|_| options.joint_jerk),
            cartesian_acceleration: options.cartesian_acceleration,
        }
    }
}
