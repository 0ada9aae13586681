//! Cameras: where a picture is taken from, and the named ones that frame any scene.
use nalgebra::{Matrix4, Point3, UnitQuaternion, Vector3};

use super::RenderError;
use crate::math::Pose;

/// A perspective camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where the camera is, m, world.
    pub eye: Point3<f64>,
    /// What is in the middle of the picture, m, world.
    pub target: Point3<f64>,
    /// What points up in the picture, world; needn't be a unit vector nor at right angles to the line of sight.
    pub up: Vector3<f64>,
    /// Vertical field of view, degrees.
    pub fov_deg: f64,
    /// Width, px.
    pub width_px: u32,
    /// Height, px.
    pub height_px: u32,
}

/// The names that [`Framing::view`] knows.
pub const NAMED_VIEWS: [&str; 5] = ["front", "hero", "top", "side", "canvas"];

/// What the named views have to get into the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Framing {
    /// Axis-aligned bounds (lower, upper) of robot and canvas, m, world.
    pub bounds: (Point3<f64>, Point3<f64>),
    /// Points of the robot that a close view shows, m, world.
    pub landmarks: Vec<Point3<f64>>,
    /// Pose of the sheet's centre: x right and y up along the sheet, z out of the canvas.
    pub world_from_sheet: Pose,
    /// Width and height of the sheet, m.
    pub sheet: [f64; 2],
}

/// Nearest distance that is drawn, m.
pub(super) const NEAR: f64 = 0.01;
/// Vertical field of view of the named views, degrees.
const FOV_DEG: f64 = 28.0;
/// That of the hero: from so near what is in front, the drawing, is large against the robot behind it.
const HERO_FOV_DEG: f64 = 34.0;
/// How far the body of a link reaches from the frames at its ends, m.
const BODY: f64 = 0.11;

impl View {
    /// Rotation and translation from world to view axes: x right, y up, z towards the viewer.
    pub(super) fn view_from_world(&self) -> Result<Matrix4<f64>, RenderError> {
        let back = self.eye - self.target;
        let right = self.up.cross(&back);
        let usable = |v: &Vector3<f64>| v.norm() > 1e-9 && v.norm().is_finite();
        if !(usable(&back) && usable(&right) && self.fov_deg > 0.1 && self.fov_deg < 170.0) {
            return Err(RenderError::Camera {
                eye: self.eye.into(),
                target: self.target.into(),
                fov_deg: self.fov_deg,
            });
        }
        let (z, x) = (back.normalize(), right.normalize());
        let y = z.cross(&x);
        let at = |axis: &Vector3<f64>| -axis.dot(&self.eye.coords);
        Ok(Matrix4::new(x.x, x.y, x.z, at(&x), y.x, y.y, y.z, at(&y), z.x, z.y, z.z, at(&z), 0.0, 0.0, 0.0, 1.0))
    }

    /// Projection with depth running from 1 at [`NEAR`] to 0 at infinity, which keeps float depth precise everywhere.
    pub(super) fn clip_from_view(&self) -> Matrix4<f64> {
        let f = 1.0 / self.tan_half();
        let aspect = f64::from(self.width_px) / f64::from(self.height_px.max(1));
        let mut m = Matrix4::zeros();
        m[(0, 0)] = f / aspect;
        m[(1, 1)] = f;
        m[(2, 3)] = NEAR;
        m[(3, 2)] = -1.0;
        m
    }

    /// Tangent of half the vertical field of view.
    pub(super) fn tan_half(&self) -> f64 {
        (0.5 * self.fov_deg.to_radians()).tan()
    }

    /// Where a world point lands in the picture (px from the top left corner), or `None` behind the camera.
    pub fn pixel_of(&self, p: &Point3<f64>) -> Option<[f64; 2]> {
        let c = self.clip_from_view() * self.view_from_world().ok()? * p.to_homogeneous();
        let (w, h) = (f64::from(self.width_px), f64::from(self.height_px));
        (c.w > NEAR).then(|| [(0.5 + 0.5 * c.x / c.w) * w, (0.5 - 0.5 * c.y / c.w) * h])
    }

    /// The camera looking along `direction` (any length) with every one of `points` inside the picture, as near as
    /// that allows, with the share `margin` of the picture left free round them.
    pub fn fit(points: &[Point3<f64>], direction: Vector3<f64>, up: Vector3<f64>, margin: f64, size: [u32; 2]) -> Self {
        Self::fit_within(FOV_DEG, points, direction, up, margin, size)
    }

    /// The same with another field of view.
    fn fit_within(
        fov_deg: f64,
        points: &[Point3<f64>],
        direction: Vector3<f64>,
        up: Vector3<f64>,
        margin: f64,
        size: [u32; 2],
    ) -> Self {
        let tan_y = (0.5 * f64::to_radians(fov_deg)).tan() * (1.0 - margin);
        let tan_x = tan_y * f64::from(size[0]) / f64::from(size[1].max(1));
        let forward = direction.normalize();
        let x = forward.cross(&up).normalize();
        let y = x.cross(&forward);
        // Along x the camera must stay behind every line through a point at the field's slope: two half planes, met
        // where they cross; likewise along y. The farther of the two crossings is the distance.
        let axis = |a: &Vector3<f64>, tan: f64| {
            let line = |s: f64| {
                points.iter().map(|p| s * p.coords.dot(a) - tan * p.coords.dot(&forward)).fold(f64::MIN, f64::max)
            };
            let (right, left) = (line(1.0), line(-1.0));
            (0.5 * (right - left), -0.5 * (right + left) / tan)
        };
        let ((cx, back_x), (cy, back_y)) = (axis(&x, tan_x), axis(&y, tan_y));
        let eye = Point3::from(x * cx + y * cy + forward * back_x.min(back_y));
        let middle = points.iter().map(|p| (p - eye).dot(&forward)).sum::<f64>() / points.len().max(1) as f64;
        let target = eye + forward * middle.max(0.1);
        View { eye, target, up, fov_deg, width_px: size[0], height_px: size[1] }
    }
}

impl Framing {
    /// The view of one of [`NAMED_VIEWS`], `size` px wide and high.
    ///
    /// "canvas" looks straight at the sheet, "front" at robot and sheet from the side where the drawing is seen,
    /// "hero" closer, from a quarter to their side and above, "side" at right angles to "front", "top" from straight above.
    pub fn view(&self, name: &str, size: [u32; 2]) -> Result<View, RenderError> {
        let out = self.world_from_sheet.rotation * Vector3::z();
        let ahead = self.facing();
        let turned = |azimuth_deg: f64, elevation_deg: f64| {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), azimuth_deg.to_radians());
            let (s, c) = elevation_deg.to_radians().sin_cos();
            -(turn * ahead * c + Vector3::z() * s)
        };
        let upright = out.z.abs() > 0.5;
        let corners = self.corners();
        let up = Vector3::z();
        Ok(match name {
            // a robot in front of a wall would hide its drawing from straight ahead
            "front" => View::fit(&corners, turned(if upright { 0.0 } else { -25.0 }, 16.0), up, 0.08, size),
            "hero" => {
                let from = if upright { turned(-40.0, 34.0) } else { turned(-52.0, 18.0) };
                View::fit_within(HERO_FOV_DEG, &self.close(), from, up, 0.05, size)
            }
            "side" => View::fit(&corners, turned(90.0, 8.0), up, 0.08, size),
            "top" => View::fit(&corners, -Vector3::z(), -ahead, 0.08, size),
            "canvas" => {
                let sheet_up = self.world_from_sheet.rotation * Vector3::y();
                View::fit(&self.sheet_corners(), -out, sheet_up, 0.08, size)
            }
            _ => {
                return Err(RenderError::UnknownView { name: name.to_string(), known: NAMED_VIEWS.join(", ") });
            }
        })
    }

    /// Horizontal unit direction from the scene to a viewer who sees the drawing upright: out of a standing canvas,
    /// and below the foot of a lying one.
    pub fn facing(&self) -> Vector3<f64> {
        let flat = |v: Vector3<f64>| Vector3::new(v.x, v.y, 0.0);
        let out = flat(self.world_from_sheet.rotation * Vector3::z());
        let down = flat(self.world_from_sheet.rotation * -Vector3::y());
        let chosen = if out.norm() > 0.8 { out } else { down };
        if chosen.norm() > 1e-6 { chosen.normalize() } else { Vector3::x() }
    }

    fn corners(&self) -> Vec<Point3<f64>> {
        let (a, b) = self.bounds;
        let pick = |i: u32, k: u32, lo: f64, hi: f64| if i >> k & 1 == 0 { lo } else { hi };
        let corner = |i| Point3::new(pick(i, 0, a.x, b.x), pick(i, 1, a.y, b.y), pick(i, 2, a.z, b.z));
        (0..8).map(corner).chain(self.sheet_corners()).collect()
    }

    fn close(&self) -> Vec<Point3<f64>> {
        let sides = [Vector3::x(), Vector3::y(), Vector3::z()].map(|v| v * BODY);
        let around = |p: &Point3<f64>| sides.map(|s| [p - s, p + s]).into_iter().flatten().collect::<Vec<_>>();
        let middle = Point3::from(self.world_from_sheet.translation.vector);
        let margin = |p: Point3<f64>| middle + (p - middle) * 1.5;
        self.landmarks.iter().flat_map(around).chain(self.sheet_corners().into_iter().map(margin)).collect()
    }

    fn sheet_corners(&self) -> Vec<Point3<f64>> {
        let [w, h] = self.sheet;
        [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
            .map(|(x, y)| self.world_from_sheet * Point3::new(x * w, y * h, 0.0))
            .to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn framing(pose: Pose) -> Framing {
        Framing {
            bounds: (Point3::new(-0.3, -0.3, 0.0), Point3::new(0.9, 0.3, 1.2)),
            landmarks: vec![Point3::new(0.2, 0.0, 0.9), Point3::new(0.5, 0.0, 0.6)],
            world_from_sheet: pose,
            sheet: [0.3, 0.2],
        }
    }

    proptest! {
        #[test]
        fn named_views_hold_the_whole_scene(x in 0.3..0.8f64, y in -0.3..0.3f64, tilt in -1.7..1.7f64, turn in -3.1..3.1f64,
                                            w in 200u32..2000, h in 200u32..2000) {
            let rotation = UnitQuaternion::from_euler_angles(0.0, tilt, turn);
            let f = framing(Pose::from_parts(Vector3::new(x, y, 0.4).into(), rotation));
            for name in NAMED_VIEWS {
                let v = f.view(name, [w, h]).unwrap();
                let points = match name {
                    "canvas" => f.sheet_corners(),
                    "hero" => f.close(),
                    _ => f.corners(),
                };
                for p in points {
                    let [px, py] = v.pixel_of(&p).expect("before the camera");
                    prop_assert!(px >= 0.0 && py >= 0.0 && px <= f64::from(w) && py <= f64::from(h), "{name}: {px} {py}");
                }
            }
        }
    }

    #[test]
    fn the_canvas_view_is_upright_and_fills_the_picture() {
        let f = framing(Pose::translation(0.5, 0.0, 0.1));
        let v = f.view("canvas", [1500, 1000]).unwrap();
        let [l, t] = v.pixel_of(&(f.world_from_sheet * Point3::new(-0.15, 0.1, 0.0))).unwrap();
        let [r, b] = v.pixel_of(&(f.world_from_sheet * Point3::new(0.15, -0.1, 0.0))).unwrap();
        assert!(l < r && t < b);
        assert!((r - l) > 0.85 * 1500.0 && (b - t) > 0.85 * 1000.0);
    }

    #[test]
    fn a_camera_without_direction_is_refused() {
        let v = View {
            eye: Point3::origin(),
            target: Point3::new(0.0, 0.0, 1.0),
            up: Vector3::z(),
            fov_deg: 30.0,
            width_px: 10,
            height_px: 10,
        };
        assert!(matches!(v.view_from_world(), Err(RenderError::Camera { .. })));
        assert!(matches!(framing(Pose::identity()).view("frnt", [10, 10]), Err(RenderError::UnknownView { .. })));
    }
}
