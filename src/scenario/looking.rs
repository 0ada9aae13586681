//! `[looking]`: how a base that drives finds out by looking and feeling where it stands.
use nalgebra::{Point2, Translation3, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::camera::HandCameraOptions;
use crate::drawing::{Drawing, InkLayer, Stroke};
use crate::math::{Pose, Rgb};
use crate::skill::{CameraModel, FeelOptions, LookOptions};
use crate::surface::SurfaceDrawing;

/// `[looking]`: a camera on the hand, and what a base finds out with it and with its pen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LookingSettings {
    /// Columns and rows of a picture.
    #[schemars(inner(range(min = 64, max = 4096)))]
    pub camera_px: [usize; 2],
    /// Horizontal angle of view, degrees.
    #[schemars(range(min = 5, max = 120))]
    pub field_of_view_deg: f64,
    /// Where the lens sits, mm, in the flange's frame: z goes along the pen. By default beside the pen, which isn't in its view.
    #[schemars(inner(range(min = -1000, max = 1000)))]
    pub mount_mm: [f64; 3],
    /// How the camera is turned from the flange's axes, degrees about them, as a rotation vector; it looks along its z.
    #[schemars(inner(range(min = -360, max = 360)))]
    pub mount_deg: [f64; 3],
    /// Standard deviation of how far it sits from where it is calibrated to, along each axis, mm; drawn once a run.
    #[schemars(range(min = 0, max = 100))]
    pub mount_error_mm: f64,
    /// The same of its angle about each axis, degrees.
    #[schemars(range(min = 0, max = 10))]
    pub mount_error_deg: f64,
    /// Standard deviation of the lens's blur, px.
    #[schemars(range(min = 0, max = 20))]
    pub blur_px: f64,
    /// Standard deviation of a pixel's noise, per cent of the full scale.
    #[schemars(range(min = 0, max = 50))]
    pub noise_percent: f64,
    /// Share of the light that doesn't come from the lamp at the lens, per cent.
    #[schemars(range(min = 0, max = 100))]
    pub ambient_percent: f64,
    /// Distance from which it looks at the canvas, mm.
    #[schemars(range(min = 150, max = 2000))]
    pub distance_mm: f64,
    /// Time for which the arm stands before a picture, s.
    #[schemars(range(min = 0.1, max = 60))]
    pub settle_s: f64,
    /// How far off the sensor may be, along the wall and off it, mm: lines are sought so far, and the wall felt for.
    #[schemars(range(min = 0.5, max = 50))]
    pub search_mm: f64,
    /// The same of the heading, degrees.
    #[schemars(range(min = 0.01, max = 5))]
    pub search_deg: f64,
    /// Before it leaves a place, look back at what was drawn there, to learn how the camera truly sits.
    pub look_back: bool,
    /// Feel for the wall with the pen at three points of each place, at five where it isn't flat; leaves a dot on a line at each.
    pub feel: bool,
    /// Force along the pen that means contact, N.
    #[schemars(range(min = 0.1, max = 20))]
    pub feel_n: f64,
    /// Speed at which the pen comes down to feel, mm/s.
    #[schemars(range(min = 0.5, max = 50))]
    pub feel_speed_mm_s: f64,
    /// Standard deviation of the noise of each reading of the force sensor, N.
    #[schemars(range(min = 0, max = 10))]
    pub force_noise_n: f64,
    /// Middles of crosses that are printed on the canvas and known to the robot, mm, sheet.
    #[schemars(inner(inner(range(min = -1e5, max = 1e5))))]
    pub marks_mm: Vec<[f64; 2]>,
    /// Length of a cross's arms from end to end, mm.
    #[schemars(range(min = 5, max = 200))]
    pub mark_size_mm: f64,
}

impl Default for LookingSettings {
    fn default() -> Self {
        Self {
            camera_px: [1280, 960],
            field_of_view_deg: 45.0,
            mount_mm: [0.0, 80.0, 30.0],
            mount_deg: [0.0; 3],
            mount_error_mm: 0.3,
            mount_error_deg: 0.05,
            blur_px: 0.7,
            noise_percent: 1.0,
            ambient_percent: 30.0,
            distance_mm: 300.0,
            settle_s: 1.0,
            search_mm: 20.0,
            search_deg: 1.0,
            look_back: true,
            feel: true,
            feel_n: 0.5,
            feel_speed_mm_s: 15.0,
            force_noise_n: 0.05,
            marks_mm: Vec::new(),
            mark_size_mm: 30.0,
        }
    }
}

impl LookingSettings {
    /// The printed crosses as a drawing on a sheet of this size (m); `None` where none is printed.
    pub fn marks(&self, [width, height]: [f64; 2]) -> Option<Drawing> {
        let half = 0.5 * self.mark_size_mm * 1e-3;
        let arms =
            self.marks_mm.iter().map(|m| Point2::new(m[0] * 1e-3, m[1] * 1e-3)).flat_map(|p| {
                [Vector2::x(), Vector2::y()].map(|way| Stroke::new(vec![p - way * half, p + way * half]))
            });
        let strokes: Vec<Stroke> = arms.collect();
        let layer = InkLayer { name: "marks".into(), color: Rgb([0; 3]), width_hint: None, strokes };
        (!layer.strokes.is_empty()).then(|| Drawing::new(width, height, vec![layer]))
    }

    /// The camera as it is calibrated, on the last link of an arm whose flange is at `last_from_flange`.
    pub fn camera(&self, last_from_flange: &Pose) -> CameraModel {
        let turn = Vector3::from(self.mount_deg.map(f64::to_radians));
        let place = Translation3::from(Vector3::from(self.mount_mm) * 1e-3);
        let flange_from_camera = place * Pose::new(Vector3::zeros(), turn);
        CameraModel::new(self.camera_px, self.field_of_view_deg.to_radians(), last_from_flange * flange_from_camera)
    }

    /// The camera as it is built.
    pub fn built(&self, last_from_flange: &Pose) -> HandCameraOptions {
        HandCameraOptions {
            model: self.camera(last_from_flange),
            error: [self.mount_error_mm * 1e-3, self.mount_error_deg.to_radians()],
            blur_px: self.blur_px,
            noise: self.noise_percent * 1e-2,
            ambient: self.ambient_percent * 1e-2,
        }
    }

    /// What the robot knows of it, with the `widths` (m) and the `springs` (N/m) of its pens, a layer each.
    pub fn options(
        &self,
        last_from_flange: &Pose,
        widths: Vec<f64>,
        springs: Vec<f64>,
        marks: Option<SurfaceDrawing>,
    ) -> LookOptions {
        let feel = FeelOptions { force: self.feel_n, speed: self.feel_speed_mm_s * 1e-3, springs };
        LookOptions {
            camera: self.camera(last_from_flange),
            mount: [self.mount_error_mm * 1e-3, self.mount_error_deg.to_radians()],
            distance: self.distance_mm * 1e-3,
            settle: self.settle_s,
            search: [self.search_mm * 1e-3, self.search_deg.to_radians()],
            look_back: self.look_back,
            feel: self.feel.then_some(feel),
            widths,
            marks,
        }
    }
}
