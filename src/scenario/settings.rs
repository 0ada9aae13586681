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
    /// Share of each joint's speed limit that may be used, in (0, 1].
    pub joint_speed_fraction: f64,
    /// Largest joint acceleration, rad/s2.
    pub joint_acceleration_rad_s2: f64,
    /// Largest joint jerk, rad/s3.
    pub joint_jerk_rad_s3: f64,
    /// Largest acceleration of the pen along its path, mm/s2.
    pub acceleration_mm_s2: f64,
    /// Height of the nib above the canvas when it is lifted, mm.
    pub hover_mm: f64,
    /// Largest distance between two neighbouring targets on the canvas, mm.
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
    /// Which law moves the arm: `impedance` or `position`.
    pub law: LawKind,
    /// Natural frequency of every joint under position control, Hz.
    pub position_hz: f64,
    /// Translational stiffness in the pen frame, N/m; z is the pen axis.
    pub stiffness_n_m: [f64; 3],
    /// Rotational stiffness in the pen frame, N m/rad.
    pub stiffness_nm_rad: [f64; 3],
    /// Damping ratio of the designed impedance; 1 is critical.
    pub damping_ratio: f64,
    /// Speed of the pen while drawing, mm/s.
    pub speed_mm_s: f64,
    /// Highest speed of the pen where it may touch the canvas, mm/s; pressing on may be twice as fast.
    pub landing_speed_mm_s: f64,
    /// Highest speed of the pen while it travels, mm/s.
    pub travel_speed_mm_s: f64,
    /// Stiffness of the posture in the nullspace, N m/rad.
    pub nullspace_stiffness_nm_rad: f64,
    /// Damping ratio of the posture in the nullspace.
    pub nullspace_damping_ratio: f64,
    /// Push along the stroke by the friction that the pen will feel, so that the line doesn't lag.
    pub friction_feedforward: bool,
    /// Coulomb friction between nib and canvas that the robot believes in.
    pub believed_friction: f64,
    /// Standard deviation of the noise on measured joint torques, N m.
    pub torque_noise_nm: f64,
    /// Age of the state that the law sees, ms.
    pub delay_ms: f64,
    /// Largest change of a commanded torque, N m each ms.
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
    /// What integrates the dynamics.
    pub plant: PlantKind,
    /// Samples kept a simulated second, Hz; at most 1000, the rate of the physics.
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
    /// Longest side of drawing.png, pixels.
    pub drawing_px: u32,
    /// Views of the scene to render, each to `view-NAME.png`: `front`, `hero`, `top`, `side`,
    /// `canvas`. The cameras below are rendered too.
    pub views: Vec<String>,
    /// Width and height of the views, pixels.
    pub view_px: [u32; 2],
    /// Render the first tool changes too, a picture a stage, to `stage-....png`.
    pub tool_stages: bool,
    /// Cameras of one's own; each is rendered.
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
    /// Where the eye is, mm, world.
    pub eye_mm: [f64; 3],
    /// What it looks at, mm, world.
    pub target_mm: [f64; 3],
    /// Vertical angle of view, degrees.
    #[serde(default = "Camera::default_fov_deg")]
    pub fov_deg: f64,
}

impl Camera {
    fn default_fov_deg() -> f64 {
        35.0
    }
}
