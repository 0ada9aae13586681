//! The sections of a scenario that mean what they say: every field has a default, none needs resolving.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::control::LawKind;
use crate::twin::PlantKind;

/// What becomes of the filled areas of an SVG.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fill {
    /// The pen draws their outline.
    #[default]
    Outline,
    /// They are left out.
    Ignore,
    /// The pen draws their outline and hatches them.
    Hatch,
}

/// What the robot knows of the canvas.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BeliefKind {
    /// Its nominal mesh.
    #[default]
    Mesh,
    /// A mesh through the points of a depth camera, as `[scan]` says.
    Scan,
    /// Nothing but where its surface may be: the pen finds it, as `[touch]` says.
    Touch,
}

/// `[plan]`: how strokes become joint motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlanSettings {
    /// Share of each joint's speed limit that may be used.
    #[schemars(range(min = 0.01, max = 1))]
    pub joint_speed_fraction: f64,
    /// Largest joint acceleration.
    #[schemars(range(min = 0.01, max = 1000))]
    pub joint_acceleration_rad_s2: f64,
    /// Largest joint jerk.
    #[schemars(range(min = 0.1, max = 1e6))]
    pub joint_jerk_rad_s3: f64,
    /// Largest acceleration of the pen along and across a stroke.
    #[schemars(range(min = 1, max = 1e5))]
    pub acceleration_mm_s2: f64,
    /// Height of the nib above the canvas when it is lifted.
    #[schemars(range(min = 1, max = 200))]
    pub hover_mm: f64,
    /// Largest distance between planned poses on a stroke.
    #[schemars(range(min = 0.05, max = 10))]
    pub step_mm: f64,
    /// Draw what can be reached when not everything can.
    pub partial: bool,
}

impl Default for PlanSettings {
    fn default() -> Self {
        Self {
            joint_speed_fraction: 0.2,
            joint_acceleration_rad_s2: 2.0,
            joint_jerk_rad_s3: 40.0,
            acceleration_mm_s2: 500.0,
            hover_mm: 8.0,
            step_mm: 1.0,
            partial: false,
        }
    }
}

/// `[control]`: the law that moves the arm and the speed of the pen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ControlSettings {
    /// Which law moves the arm.
    pub law: LawKind,
    /// Natural frequency of every joint under position control; it is critically damped.
    #[schemars(range(min = 1, max = 60))]
    pub position_hz: f64,
    /// Stiffness along x, y and z of the pen; z is the pen axis.
    #[schemars(inner(range(min = 1, max = 1e5)))]
    pub stiffness_n_m: [f64; 3],
    /// Stiffness about x, y and z of the pen.
    #[schemars(inner(range(min = 0.1, max = 1e4)))]
    pub stiffness_nm_rad: [f64; 3],
    /// Damping ratio of the designed impedance; 1 is critical.
    #[schemars(range(min = 0.01, max = 5))]
    pub damping_ratio: f64,
    /// Speed of the pen while drawing.
    #[schemars(range(min = 0.1, max = 1000))]
    pub speed_mm_s: f64,
    /// Highest speed of the pen where it may touch the canvas; pressing on may be twice as fast.
    #[schemars(range(min = 0.1, max = 1000))]
    pub landing_speed_mm_s: f64,
    /// Highest speed of the pen while it travels.
    #[schemars(range(min = 1, max = 5000))]
    pub travel_speed_mm_s: f64,
    /// Stiffness of the posture where it doesn't move the pen (the nullspace).
    #[schemars(range(min = 0, max = 1e4))]
    pub nullspace_stiffness_nm_rad: f64,
    /// Damping ratio of the posture in the nullspace.
    #[schemars(range(min = 0, max = 5))]
    pub nullspace_damping_ratio: f64,
    /// Push along the stroke by the friction that the pen will feel, so that the line doesn't lag.
    pub friction_feedforward: bool,
    /// Coulomb friction between nib and canvas that the robot believes in.
    #[schemars(range(min = 0, max = 2))]
    pub believed_friction: f64,
    /// Standard deviation of the noise on each joint-torque sensor.
    #[schemars(range(min = 0, max = 100))]
    pub torque_noise_nm: f64,
    /// Age of the state that the law sees.
    #[schemars(range(min = 0, max = 100))]
    pub delay_ms: f64,
    /// Largest change of a commanded torque, a millisecond.
    #[schemars(range(min = 0.01, max = 1e4))]
    pub torque_rate_nm_ms: f64,
}

impl Default for ControlSettings {
    fn default() -> Self {
        Self {
            law: LawKind::Impedance,
            position_hz: 20.0,
            stiffness_n_m: [1500.0, 1500.0, 350.0],
            stiffness_nm_rad: [300.0, 300.0, 300.0],
            damping_ratio: 0.7,
            speed_mm_s: 40.0,
            landing_speed_mm_s: 8.0,
            travel_speed_mm_s: 250.0,
            nullspace_stiffness_nm_rad: 20.0,
            nullspace_damping_ratio: 0.7,
            friction_feedforward: true,
            believed_friction: 0.3,
            torque_noise_nm: 0.0,
            delay_ms: 0.0,
            torque_rate_nm_ms: 3.0,
        }
    }
}

/// `[sim]`: the plant and what is kept of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SimSettings {
    /// What integrates the arm's dynamics.
    pub plant: PlantKind,
    /// Samples kept a simulated second; 1000 is the rate of physics and control.
    #[schemars(range(min = 0.1, max = 1000))]
    pub record_hz: f64,
}

impl Default for SimSettings {
    fn default() -> Self {
        Self { plant: PlantKind::Rapier, record_hz: 25.0 }
    }
}

/// Names of the views that need no `[[render.camera]]`.
pub const VIEWS: [&str; 5] = ["front", "hero", "top", "side", "canvas"];

/// `[render]`: pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RenderSettings {
    /// Longest side of drawing.png.
    #[schemars(range(min = 16, max = 32_768))]
    pub drawing_px: u32,
    /// Views of the scene, each to `view-NAME.png`: `front`, `hero`, `top`, `side`, `canvas`; `[]` for none.
    pub views: Vec<String>,
    /// Width and height of the views.
    #[schemars(inner(range(min = 16, max = 8192)))]
    pub view_px: [u32; 2],
    /// Show the first fetch and return of a pen, and the first change that fails, stage by stage, to `stage-....png`.
    pub tool_stages: bool,
    /// A view of one's own.
    #[serde(rename = "camera", skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<Camera>,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            drawing_px: 4096,
            views: vec!["hero".into(), "front".into()],
            view_px: [1600, 1200],
            tool_stages: false,
            cameras: Vec::new(),
        }
    }
}

/// `[[render.camera]]`: a view from a place of one's own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Name; the picture is `view-NAME.png`.
    pub name: String,
    /// Where the eye is, in the world, z up.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub eye_mm: [f64; 3],
    /// What it looks at, in the world.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub target_mm: [f64; 3],
    /// Vertical angle of view.
    #[schemars(range(min = 1, max = 120))]
    #[serde(default = "Camera::default_fov_deg")]
    pub fov_deg: f64,
}

impl Camera {
    fn default_fov_deg() -> f64 {
        35.0
    }
}
