//! The camera on the hand: what it sees of the true wall and of the ink on it.
//!
//! A pinhole camera beside the pen, with a lamp at its lens. Ink is seen where it truly lies: each piece of a line is a capsule in the
//! plane that touches the canvas there, and every pixel looks at it along 4 x 4 rays. Light falls off with the square of the
//! distance and the cosine of the incidence, and with the fourth power of the cosine of the angle off the lens's axis; the lens blurs,
//! the pixels are noisy, and they count light in 255 steps.
use nalgebra::{Point2, Point3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;
use serde::{Deserialize, Serialize};

use crate::ink::{InkPoint, InkStroke, optics::absorbance};
use crate::math::{PAPER, Pose, Rgb, standard_normal, stream};
use crate::mesh::TriMesh;
use crate::skill::CameraModel;

/// Rays a pixel, along each side.
const SIDE: usize = 4;
/// Side of the blocks at whose corners the light on the wall is worked out, px.
const BLOCK: usize = 16;
/// The lightest place of a picture, share of the full scale: the exposure is set so.
const LIGHTEST: f64 = 0.8;
/// Nearer than this to the ink nothing hides it, m.
const SEEN: f64 = 2e-3;
/// Nothing farther than this is seen, m.
const FAR: f64 = 5.0;

/// A camera on the hand, as it is built.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HandCameraOptions {
    /// The camera as its calibration has it.
    pub model: CameraModel,
    /// Standard deviations of its calibration along (m) and about (rad) each of its axes; drawn once a run.
    pub error: [f64; 2],
    /// Standard deviation of the blur, px.
    pub blur_px: f64,
    /// Standard deviation of the noise of a pixel, share of the full scale.
    pub noise: f64,
    /// Share of the light that doesn't come from the lamp at the lens: it falls evenly.
    pub ambient: f64,
}

/// A camera on the hand, and what of it changes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct HandCamera {
    options: HandCameraOptions,
    /// Where it truly sits on the last link.
    last_from_camera: Pose,
    seed: u64,
    index: u64,
    taken: u64,
    /// What is printed on the canvas.
    marks: Vec<InkStroke>,
}

/// What a picture is taken of.
pub struct Sight<'a> {
    /// The true canvas.
    pub canvas: &'a TriMesh,
    /// Colours of the inks.
    pub colors: &'a [Rgb],
    /// All ink on the canvas.
    pub ink: Vec<&'a InkStroke>,
}

impl HandCamera {
    /// A camera whose calibration errs once and for all; `seed` and the arm's `index` say how. `marks` are printed on the canvas in black.
    pub fn new(options: HandCameraOptions, marks: Vec<InkStroke>, seed: u64, index: u64) -> Self {
        let mut rng = stream(seed, "hand camera's mount", index);
        let mut three = |sd: f64| Vector3::from_fn(|_, _| sd * standard_normal(&mut rng));
        let [shift, turn] = options.error;
        let last_from_camera = options.model.last_from_camera * Pose::new(three(shift), three(turn));
        Self { options, last_from_camera, seed, index, taken: 0, marks }
    }

    /// Columns and rows of its pictures.
    pub fn size_px(&self) -> [usize; 2] {
        self.options.model.size_px
    }

    /// Pictures taken so far.
    pub fn taken(&self) -> u64 {
        self.taken
    }

    /// Takes a picture with the last link at `world_from_last`: red, green and blue of each pixel, row by row.
    pub fn take(&mut self, sight: &Sight, world_from_last: &Pose) -> Vec<u8> {
        let eye = world_from_last * self.last_from_camera;
        let mut light = Light::new(&self.options.model, eye);
        for stroke in &self.marks {
            light.absorb(stroke, absorbance(Rgb([0; 3]), PAPER), sight.canvas);
        }
        for stroke in &sight.ink {
            let color = sight.colors.get(stroke.ink as usize).copied().unwrap_or(Rgb([0; 3]));
            light.absorb(stroke, absorbance(color, PAPER), sight.canvas);
        }
        light.fall(sight.canvas, self.options.ambient);
        light.blur(self.options.blur_px);
        let name = format!("hand camera {}", self.index);
        let mut rng = stream(self.seed, &name, self.taken);
        self.taken += 1;
        let noise = self.options.noise * 255.0;
        let count = |v: f32, rng: &mut ChaCha8Rng| {
            (f64::from(v) * 255.0 + noise * nearly_normal(rng)).round().clamp(0.0, 255.0) as u8
        };
        light.values.iter().flatten().map(|v| count(*v, &mut rng)).collect()
    }
}

/// A number of mean 0 and deviation 1 from eight random bytes: their sum is nearly normal (Irwin and Hall), and soon drawn.
fn nearly_normal(rng: &mut ChaCha8Rng) -> f64 {
    let sum: u32 = rng.next_u64().to_le_bytes().iter().map(|b| u32::from(*b)).sum();
    // eight even numbers from 0 to 255
    (f64::from(sum) - 8.0 * 127.5) / (8.0 * (256.0 * 256.0 - 1.0) / 12.0f64).sqrt()
}

/// The light of a picture as it comes about, red, green and blue of each pixel.
struct Light<'a> {
    camera: &'a CameraModel,
    world_from_camera: Pose,
    values: Vec<[f32; 3]>,
    /// Rays of each pixel that meet the present stroke, a bit each, and its density there.
    wet: Vec<(u16, f32)>,
    touched: Vec<usize>,
}

impl<'a> Light<'a> {
    fn new(camera: &'a CameraModel, world_from_camera: Pose) -> Self {
        let count = camera.size_px[0] * camera.size_px[1];
        Self {
            camera,
            world_from_camera,
            values: vec![[1.0; 3]; count],
            wet: vec![(0, 0.0); count],
            touched: Vec::new(),
        }
    }

    fn eye(&self) -> Point3<f64> {
        Point3::from(self.world_from_camera.translation.vector)
    }

    /// Where a point of ink is in the picture, px; `None` where it can't be seen.
    fn see(&self, p: &InkPoint, canvas: &TriMesh) -> Option<Point2<f64>> {
        let at = self.camera.project(&(self.world_from_camera.inverse() * p.position))?;
        let margin = -self.camera.focal_px * p.width;
        let eye = self.eye();
        let way = p.position - eye;
        let distance = way.norm();
        let faces = way.dot(&p.normal) < 0.0 && self.camera.sees(&at, margin.max(-200.0));
        (faces && canvas.cast_ray(&eye, &(way / distance), distance - SEEN).is_none()).then_some(at)
    }

    /// Lets a line take its share of the light.
    fn absorb(&mut self, stroke: &InkStroke, absorbance: [f64; 3], canvas: &TriMesh) {
        let mut last: Option<(&InkPoint, Option<Point2<f64>>)> = None;
        for (i, p) in stroke.points.iter().enumerate() {
            // points nearer to each other than half a pixel are one
            if let Some((before, _)) = last {
                let depth = (p.position - self.eye()).norm().max(1e-3);
                let apart = (p.position - before.position).norm() / depth * self.camera.focal_px;
                if apart < 0.5 && i + 1 < stroke.points.len() {
                    continue;
                }
            }
            let seen = self.see(p, canvas);
            let (from, from_seen) = last.unwrap_or((p, seen));
            if let (Some(a), Some(b)) = (from_seen, seen) {
                self.lay([from, p], [a, b]);
            }
            last = Some((p, seen));
        }
        for i in std::mem::take(&mut self.touched) {
            let (rays, density) = std::mem::take(&mut self.wet[i]);
            let cover = rays.count_ones() as f32 / (SIDE * SIDE) as f32;
            for (light, a) in self.values[i].iter_mut().zip(absorbance) {
                *light *= 1.0 - cover * (1.0 - (-density * a as f32).exp());
            }
        }
    }

    /// Finds the rays that meet a piece of line whose ends are seen at `at` (px).
    fn lay(&mut self, ends: [&InkPoint; 2], at: [Point2<f64>; 2]) {
        let [w, h] = self.camera.size_px;
        let camera_from_world = self.world_from_camera.inverse();
        let [a, b] = ends.map(|p| camera_from_world * p.position);
        let normal = camera_from_world * ends[0].normal;
        let reach = 0.5 * ends[0].width.max(ends[1].width) / a.z.min(b.z) * self.camera.focal_px * 1.5 + 1.0;
        let range = |x: f64, y: f64, most: usize| {
            let low = (x.min(y) - reach).floor().clamp(0.0, most as f64) as usize;
            low..(x.max(y) + reach).ceil().clamp(0.0, most as f64) as usize
        };
        let way = b - a;
        let length2 = way.norm_squared().max(1e-18);
        let level = normal.dot(&a.coords);
        for v in range(at[0].y, at[1].y, h) {
            for u in range(at[0].x, at[1].x, w) {
                let mut rays = 0u16;
                let mut share = 0.0;
                for k in 0..SIDE * SIDE {
                    let part = |i: usize| (i as f64 + 0.5) / SIDE as f64;
                    let ray = self.camera.ray(&Point2::new(u as f64 + part(k % SIDE), v as f64 + part(k / SIDE)));
                    let hit = ray * (level / normal.dot(&ray));
                    let along = ((hit - a.coords).dot(&way) / length2).clamp(0.0, 1.0);
                    let radius = 0.5 * (ends[0].width + along * (ends[1].width - ends[0].width));
                    if (hit - a.coords - way * along).norm_squared() <= radius * radius {
                        (rays, share) = (rays | 1 << k, along);
                    }
                }
                if rays == 0 {
                    continue;
                }
                let density = (ends[0].density + share * (ends[1].density - ends[0].density)) as f32;
                let i = v * w + u;
                if self.wet[i].0 == 0 {
                    self.touched.push(i);
                }
                let wet = &mut self.wet[i];
                *wet = (wet.0 | rays, wet.1.max(density));
            }
        }
    }

    /// Lets the light fall on the canvas: nothing where there is none.
    fn fall(&mut self, canvas: &TriMesh, ambient: f64) {
        let [w, h] = self.camera.size_px;
        let [columns, rows] = [w, h].map(|s| s.div_ceil(BLOCK) + 1);
        let eye = self.eye();
        // the lamp's light comes back over the distance to the middle as 1
        let straight = self.world_from_camera * Vector3::z();
        let middle = canvas.cast_ray(&eye, &straight, FAR).map_or(FAR, |hit| (hit.position - eye).norm());
        let at = |i: usize| {
            let ray = self.camera.ray(&Point2::new((i % columns * BLOCK) as f64, (i / columns * BLOCK) as f64));
            let direction = self.world_from_camera * ray.normalize();
            let Some(hit) = canvas.cast_ray(&eye, &direction, FAR) else { return 0.0 };
            let incidence = direction.dot(&hit.normal).abs();
            let lamp = incidence * middle * middle / (hit.position - eye).norm_squared();
            let lens = (1.0 / ray.norm()).powi(4);
            (ambient + (1.0 - ambient) * lamp) * lens
        };
        let nodes: Vec<f64> = (0..columns * rows).map(at).collect();
        let lightest = nodes.iter().copied().fold(1e-9, f64::max);
        for (i, value) in self.values.iter_mut().enumerate() {
            let (x, y) = ((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
            let (u, v) = (x / BLOCK as f64, y / BLOCK as f64);
            let (c, r) = (u as usize, v as usize);
            let (u, v) = (u - c as f64, v - r as f64);
            let row = |r: usize| nodes[r * columns + c] * (1.0 - u) + nodes[r * columns + c + 1] * u;
            let light = (LIGHTEST / lightest * (row(r) * (1.0 - v) + row(r + 1) * v)) as f32;
            value.iter_mut().for_each(|channel| *channel *= light);
        }
    }

    /// Blurs the picture by a Gaussian bell of this deviation, px.
    fn blur(&mut self, deviation: f64) {
        if deviation <= 0.0 {
            return;
        }
        let [w, h] = self.camera.size_px;
        let reach = (3.0 * deviation).ceil() as usize;
        let bell: Vec<f32> =
            (0..=2 * reach).map(|i| (-0.5 * ((i as f64 - reach as f64) / deviation).powi(2)).exp() as f32).collect();
        let sum: f32 = bell.iter().sum();
        let mean = |from: &[[f32; 3]], at: usize, step: usize, place: usize, count: usize| {
            let mut value = [0.0f32; 3];
            for (k, weight) in bell.iter().enumerate() {
                // beyond the edge it goes on as it ends
                let other = (place + k).saturating_sub(reach).min(count - 1);
                let pixel = &from[at + other * step - place * step];
                (0..3).for_each(|c| value[c] += weight / sum * pixel[c]);
            }
            value
        };
        let along: Vec<[f32; 3]> = (0..w * h).map(|i| mean(&self.values, i, 1, i % w, w)).collect();
        self.values = (0..w * h).map(|i| mean(&along, i, w, i / w, h)).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    /// A wall in the plane z = 0, and a camera 0.3 m over it that looks down on it, 10 mm aside.
    fn wall() -> TriMesh {
        shapes::rectangle(1.0, 1.0, 0.01, 0.1).expect("a mesh")
    }

    fn camera(error: [f64; 2], noise: f64) -> HandCamera {
        let model = CameraModel::new([640, 480], 0.8, Pose::identity());
        HandCamera::new(HandCameraOptions { model, error, blur_px: 0.7, noise, ambient: 0.3 }, Vec::new(), 5, 0)
    }

    fn from_above() -> Pose {
        Pose::from_parts(
            nalgebra::Translation3::new(0.01, 0.0, 0.3),
            nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI),
        )
    }

    fn line(points: &[[f64; 2]]) -> InkStroke {
        let point = |p: &[f64; 2]| InkPoint {
            position: Point3::new(p[0], p[1], 0.0),
            normal: Vector3::z(),
            sheet: Point2::new(p[0], p[1]),
            width: 8e-4,
            density: 1.0,
            time: 0.0,
        };
        InkStroke { ink: 0, stroke: None, arm: 0, points: points.iter().map(point).collect() }
    }

    fn take(camera: &mut HandCamera, ink: &[InkStroke]) -> Vec<u8> {
        let sight = Sight { canvas: &wall(), colors: &[Rgb([0; 3])], ink: ink.iter().collect() };
        camera.take(&sight, &from_above())
    }

    #[test]
    fn a_known_line_is_where_the_pinhole_puts_it_to_an_eighth_of_a_pixel() {
        for x in [0.0, 0.0031, -0.0523, 0.0777] {
            let mut camera = camera([0.0; 2], 0.0);
            let pixels = take(&mut camera, &[line(&[[x, -0.08], [x, 0.08]])]);
            // the camera's x is the world's
            let desired = 320.0 + camera.options.model.focal_px * (x - 0.01) / 0.3;
            let row = &pixels[3 * 640 * 240..3 * 640 * 241];
            let at = desired as usize;
            let bare = 0.5 * (f64::from(row[3 * (at - 12)]) + f64::from(row[3 * (at + 12)]));
            let (mut dark, mut moment) = (0.0, 0.0);
            for u in (desired as usize).saturating_sub(8)..(desired as usize + 9) {
                let d = (1.0 - f64::from(row[3 * u]) / bare).max(0.0);
                let d = if d < 0.02 { 0.0 } else { d };
                dark += d;
                moment += d * (u as f64 + 0.5);
            }
            // four rays lie across a pixel: an edge is told to an eighth of it
            assert!((moment / dark - desired).abs() < 0.125, "{} {desired}", moment / dark);
            // and as broad as it is, in px
            let width = 8e-4 / 0.3 * camera.options.model.focal_px;
            assert!((dark - width).abs() < 0.25, "{dark} {width}");
        }
    }

    #[test]
    fn light_falls_off_to_the_corners_and_noise_is_as_large_as_said() {
        let pixels = take(&mut camera([0.0; 2], 0.0), &[]);
        let at = |u: usize, v: usize| f64::from(pixels[3 * (v * 640 + u)]);
        assert!((at(320, 240) - 0.8 * 255.0).abs() < 1.5, "{}", at(320, 240));
        let off = (0.4f64.tan().powi(2) + (0.4f64.tan() * 0.75).powi(2)).sqrt();
        let cosine = 1.0 / (1.0 + off * off).sqrt();
        let desired = (0.3 + 0.7 * cosine.powi(3)) * cosine.powi(4);
        assert!((at(0, 0) / at(320, 240) - desired).abs() < 0.02, "{} {desired}", at(0, 0) / at(320, 240));
        let noisy = take(&mut camera([0.0; 2], 0.02), &[]);
        let n = (noisy.len() / 2) as f64;
        let apart =
            noisy.iter().zip(&pixels).take(noisy.len() / 2).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
        assert!(((apart.sum::<f64>() / n).sqrt() / (0.02 * 255.0) - 1.0).abs() < 0.03);
    }

    #[test]
    fn what_is_hidden_is_not_seen_and_a_seed_takes_the_same_picture() {
        let ink = [line(&[[0.0, -0.08], [0.0, 0.08]])];
        let bare = take(&mut camera([0.0; 2], 0.0), &[]);
        let lid = shapes::cuboid(&Vector3::new(0.05, 0.3, 0.01), 0.05).expect("a mesh");
        let lid = lid.transformed(&Pose::translation(0.0, 0.0, 0.1));
        let sight = Sight { canvas: &lid, colors: &[Rgb([0; 3])], ink: ink.iter().collect() };
        let hidden = camera([0.0; 2], 0.0).take(&sight, &from_above());
        let without = Sight { canvas: &lid, colors: &[], ink: Vec::new() };
        assert!(hidden == camera([0.0; 2], 0.0).take(&without, &from_above()));
        assert!(take(&mut camera([0.0; 2], 0.0), &ink) != bare);
        let mut one = camera([3e-4, 1e-3], 0.01);
        let first = take(&mut one, &ink);
        assert!(first == take(&mut camera([3e-4, 1e-3], 0.01), &ink));
        // its calibration moves the line, and no two pictures have the same noise
        assert!(first != take(&mut one, &ink) && one.taken() == 2);
    }
}
