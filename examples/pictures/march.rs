//! Sphere tracing: rays through a distance field, lit by one soft sun, a sky and a rim light.
use rayon::prelude::*;

use crate::field::{V3, grey, mix, smoothstep, v};

/// What a surface looks like where a ray meets it.
#[derive(Clone, Copy)]
pub struct Material {
    /// Linear reflectance.
    pub albedo: V3,
    /// Strength of the highlight.
    pub gloss: f64,
    /// Exponent of the highlight.
    pub shine: f64,
    /// How far light creeps past the terminator, per channel: skin is warm there.
    pub wrap: V3,
    /// Number in the label picture.
    pub label: u8,
}

impl Material {
    pub fn matt(albedo: V3) -> Material {
        Material { albedo, gloss: 0.03, shine: 12.0, wrap: V3::zeros(), label: 0 }
    }

    pub fn glossy(self, gloss: f64, shine: f64) -> Material {
        Material { gloss, shine, ..self }
    }

    pub fn label(self, label: u8) -> Material {
        Material { label, ..self }
    }
}

/// The light of a scene. Directions point to the light and are unit vectors.
pub struct Light {
    pub sun: V3,
    pub sun_colour: V3,
    /// Hardness of shadow edges: 4 is a large window, 40 the sun.
    pub hardness: f64,
    pub sky: V3,
    pub ground: V3,
    pub rim: V3,
    pub rim_colour: V3,
    /// Reach of ambient occlusion.
    pub occlusion: f64,
}

/// What is drawn.
pub trait Scene: Sync {
    /// Distance to the nearest surface (or a lower bound of it).
    fn distance(&self, p: V3) -> f64;
    fn material(&self, p: V3, normal: V3) -> Material;
    /// Linear colour and label behind everything, at the picture's `u`, `v` in 0..1 (v down).
    fn backdrop(&self, u: f64, v: f64, direction: V3) -> (V3, u8);
    fn light(&self) -> &Light;
    /// Colour after the air between: haze.
    fn air(&self, colour: V3, _distance: f64, _direction: V3) -> V3 {
        colour
    }
}

/// A pinhole camera.
pub struct Camera {
    pub eye: V3,
    pub target: V3,
    /// Height of the picture at unit distance.
    pub view: f64,
    /// Rays run from here to there.
    pub near: f64,
    pub far: f64,
}

/// A rendered picture: linear colour, distance along the axis (infinite for the backdrop), label.
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub colour: Vec<V3>,
    pub depth: Vec<f64>,
    pub label: Vec<u8>,
}

struct Ray {
    origin: V3,
    direction: V3,
    u: f64,
    v: f64,
    /// Cosine to the axis.
    along: f64,
}

struct Hit {
    colour: V3,
    depth: f64,
    label: u8,
}

impl Camera {
    fn ray(&self, u: f64, v: f64, aspect: f64) -> Ray {
        let forward = (self.target - self.eye).normalize();
        let right = forward.cross(&V3::y()).normalize();
        let up = right.cross(&forward);
        let (x, y) = ((u - 0.5) * self.view * aspect, (0.5 - v) * self.view);
        let direction = (forward + right * x + up * y).normalize();
        Ray { origin: self.eye, direction, u, v, along: direction.dot(&forward) }
    }
}

fn normal(scene: &impl Scene, p: V3, step: f64) -> V3 {
    let corners = [v(1.0, -1.0, -1.0), v(-1.0, -1.0, 1.0), v(-1.0, 1.0, -1.0), v(1.0, 1.0, 1.0)];
    let sum: V3 = corners.iter().map(|c| c * scene.distance(p + c * step)).sum();
    sum.try_normalize(1e-12).unwrap_or_else(V3::y)
}

/// Share of the sun that is seen, with a penumbra: the least angle between the ray and what it passes. A parabola
/// through three steps finds the least one between them, else the steps would show as ripples.
fn shadow(scene: &impl Scene, p: V3, to_light: V3, near: f64, far: f64, hardness: f64) -> f64 {
    let (mut t, mut seen) = (near, 1.0f64);
    let mut past = [(0.0, f64::INFINITY); 2];
    for _ in 0..150 {
        let d = scene.distance(p + to_light * t);
        let angle = hardness * d / t;
        let [(t0, a0), (t1, a1)] = past;
        let mut least = angle;
        if a0.is_finite() && a1 <= a0 && a1 <= angle {
            let (left, right) = ((a1 - a0) / (t1 - t0), (angle - a1) / (t - t1));
            let bend = (right - left) / (t - t0);
            let slope = left + bend * (t1 - t0);
            least = a1 - slope * slope / (4.0 * bend).max(1e-9);
        }
        seen = seen.min(least);
        past = [past[1], (t, angle)];
        t += (0.7 * d).clamp(near * 0.6 + t * 0.04, far * 0.05);
        if seen < -1.0 || t > far {
            break;
        }
    }
    let seen = seen.clamp(-1.0, 1.0);
    0.25 * (1.0 + seen) * (1.0 + seen) * (2.0 - seen)
}

/// Share of the sky that is seen from close by.
fn openness(scene: &impl Scene, p: V3, n: V3, reach: f64) -> f64 {
    let mut hidden = 0.0;
    let mut weight = 0.55;
    for i in 1..=5 {
        let h = reach * f64::from(i * i) / 25.0;
        hidden += (h - scene.distance(p + n * h)).max(0.0) / h * weight;
        weight *= 0.72;
    }
    (1.0 - hidden * 0.75).clamp(0.12, 1.0)
}

fn trace(scene: &impl Scene, camera: &Camera, ray: &Ray) -> Hit {
    let mut t = camera.near;
    // a ray that has run out of steps grazes something: only one that has left the scene sees the backdrop
    for _ in 0..260 {
        let d = scene.distance(ray.origin + ray.direction * t);
        t += d * 0.85;
        if d < 2e-4 * t * camera.view || t > camera.far {
            break;
        }
    }
    if t > camera.far {
        let (colour, label) = scene.backdrop(ray.u, ray.v, ray.direction);
        return Hit { colour, depth: f64::INFINITY, label };
    }
    // onto the surface itself: what is left of the distance would show as contour lines in the shadows
    for _ in 0..3 {
        t += scene.distance(ray.origin + ray.direction * t);
    }
    let light = scene.light();
    let p = ray.origin + ray.direction * t;
    let n = normal(scene, p, 5e-4 * t * camera.view);
    let m = scene.material(p, n);
    let lift = p + n * (light.occlusion * 0.02);
    let reach = light.occlusion;
    let visible = shadow(scene, lift, light.sun, reach * 0.02, reach * 12.0, light.hardness);
    let open = openness(scene, p, n, reach);

    let facing = n.dot(&light.sun);
    let sun = m.wrap.map(|w| ((facing + w) / (1.0 + w)).max(0.0));
    let visible = m.wrap.map(|w| visible.powf(1.0 / (1.0 + 1.5 * w)));
    let sky = mix(light.ground, light.sky, 0.5 + 0.5 * n.y) * open;
    let edge = 1.0 - n.dot(&-ray.direction).max(0.0);
    let rim = n.dot(&light.rim).max(0.0) * smoothstep(0.25, 1.0, edge) * open;
    let half = (light.sun - ray.direction).normalize();
    let spark = m.gloss * n.dot(&half).max(0.0).powf(m.shine) * facing.clamp(0.0, 1.0).sqrt();
    let fresnel = m.gloss * 0.6 * edge.powi(4) * open;

    let diffuse = light.sun_colour.component_mul(&sun).component_mul(&visible) + sky + light.rim_colour * rim;
    let colour =
        m.albedo.component_mul(&diffuse) + light.sun_colour.component_mul(&visible) * spark + light.sky * fresnel;
    let depth = t * ray.along;
    Hit { colour: scene.air(colour, t, ray.direction), depth, label: m.label }
}

/// One ray a pixel, then nine in each pixel that differs from a neighbour.
pub fn render(scene: &impl Scene, camera: &Camera, width: usize, height: usize) -> Picture {
    let aspect = width as f64 / height as f64;
    let at = |x: f64, y: f64| trace(scene, camera, &camera.ray(x / width as f64, y / height as f64, aspect));
    let first: Vec<Hit> =
        (0..width * height).into_par_iter().map(|i| at((i % width) as f64 + 0.5, (i / width) as f64 + 0.5)).collect();
    let seen: Vec<V3> = first.iter().map(|h| h.colour.map(|c| c.clamp(0.0, 1.5).sqrt())).collect();
    let colour = (0..width * height)
        .into_par_iter()
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let busy =
                [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)].iter().any(|&(dx, dy)| {
                    let (nx, ny) = (x as i64 + dx, y as i64 + dy);
                    let inside = nx >= 0 && ny >= 0 && nx < width as i64 && ny < height as i64;
                    inside && (seen[i] - seen[ny as usize * width + nx as usize]).amax() > 0.045
                });
            if !busy {
                return first[i].colour;
            }
            let mut sum = grey(0.0);
            for j in 0..9 {
                let (sx, sy) = (f64::from(j % 3), f64::from(j / 3));
                sum += at(x as f64 + (sx + 0.5) / 3.0, y as f64 + (sy + 0.5) / 3.0).colour.map(|c| c.min(1.5));
            }
            sum / 9.0
        })
        .collect();
    Picture {
        width,
        height,
        colour,
        depth: first.iter().map(|h| h.depth).collect(),
        label: first.iter().map(|h| h.label).collect(),
    }
}
