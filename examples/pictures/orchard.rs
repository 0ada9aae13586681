//! A still life: pears, a lemon, grapes and a blue jug on a red cloth before a warm wall. Units are decimetres.
use crate::field::{
    V3, ball, carve, chain, clouds, curve, ellipsoid, hex, join, meet, mix, noise, rod, smoothstep, turn, v,
};
use crate::march::{Camera, Light, Material, Scene};

#[derive(Clone, Copy, PartialEq)]
enum Part {
    Cloth,
    Table,
    Jug,
    Inside,
    Pear(usize),
    Lemon,
    Plum,
    Stalk,
    Leaf,
}

/// Where a pear stands, how it leans (degrees: yaw, pitch, roll) and its size.
const PEARS: [(V3, [f64; 3], f64); 3] = [
    (V3::new(0.35, 0.0, 0.75), [20.0, 4.0, -8.0], 1.0),
    (V3::new(1.38, 0.0, 0.30), [140.0, 6.0, 10.0], 0.92),
    (V3::new(-0.62, 0.36, 1.25), [0.0, 70.0, 62.0], 0.88),
];
const LEMON: V3 = V3::new(1.42, 0.36, 1.42);
const PLUMS: [(V3, f64); 4] = [
    (V3::new(-1.72, 0.27, 0.95), 0.30),
    (V3::new(-1.25, 0.25, 0.62), 0.28),
    (V3::new(-2.08, 0.25, 0.50), 0.28),
    (V3::new(-1.52, 0.62, 0.70), 0.27),
];

pub struct Orchard {
    light: Light,
}

impl Orchard {
    pub fn new() -> Orchard {
        Orchard {
            light: Light {
                sun: v(-0.75, 0.62, 0.42).normalize(),
                sun_colour: v(1.30, 1.16, 0.94),
                hardness: 7.0,
                sky: v(0.22, 0.26, 0.34),
                ground: v(0.22, 0.12, 0.08),
                rim: v(0.8, 0.4, -0.5).normalize(),
                rim_colour: v(0.5, 0.45, 0.4),
                occlusion: 0.8,
            },
        }
    }

    pub fn camera() -> Camera {
        Camera { eye: v(0.0, 3.1, 11.0), target: v(-0.05, 1.02, 0.2), view: 0.44, near: 5.0, far: 22.0 }
    }

    /// A pear standing at the origin, about 1.5 high.
    fn pear(p: V3) -> f64 {
        let lean = v(p.x - 0.10 * (p.y - 0.5) * (p.y - 0.5) * f64::from(u8::from(p.y > 0.5)), p.y, p.z);
        let d = join(ball(lean, v(0.0, 0.50, 0.0), 0.52), ball(lean, v(0.0, 1.12, 0.0), 0.25), 0.62);
        let d = carve(d, ball(p, v(0.0, -0.12, 0.0), 0.12), 0.15);
        d + 0.012 * noise(p * 4.0)
    }

    fn stalk(p: V3) -> f64 {
        chain(p, &[(v(0.03, 1.30, 0.0), 0.035), (v(0.10, 1.50, 0.02), 0.028), (v(0.24, 1.66, 0.05), 0.042)], 0.03)
    }

    fn jug(p: V3) -> (f64, Part) {
        let q = p - v(-0.75, 0.0, -0.55);
        if ball(q, v(0.2, 1.3, 0.0), 1.6) > 1.2 {
            return (ball(q, v(0.2, 1.3, 0.0), 1.6), Part::Jug);
        }
        let lip = 0.16 * smoothstep(1.9, 2.45, q.y) * smoothstep(0.1, 0.9, -q.x);
        let r = (q.x + lip * 1.6).hypot(q.z);
        // radius of the body at each height: foot, belly, neck, mouth
        let belly = 0.93 * (-((q.y - 0.88) / 0.80).powi(2)).exp();
        let mouth = 0.30 * smoothstep(1.7, 2.5, q.y);
        let foot = 0.30 * smoothstep(0.30, 0.0, q.y);
        let profile = 0.30 + 0.65 * belly + mouth + foot + lip * 0.5;
        let solid = meet((r - profile) * 0.72, (q.y - 1.22).abs() - 1.22, 0.06);
        let hollow = ((r - profile + 0.07) * 0.72).max(0.9 - q.y);
        let body = carve(solid, hollow, 0.05);
        let handle = curve(q, [v(0.38, 2.16, 0.0), v(1.45, 2.75, 0.0), v(1.55, 1.35, 0.0), v(0.72, 0.98, 0.0)], 0.10);
        let inside = hollow < 0.01 && q.y < 2.42 && q.y > 0.9;
        (join(body, handle, 0.12), if inside { Part::Inside } else { Part::Jug })
    }

    /// Height of the cloth: folds run across the table and gather at the right.
    fn cloth_height(x: f64, z: f64) -> f64 {
        let along = x * 0.75 + z * 0.55;
        let across = -x * 0.45 + z * 0.9;
        let bend = along + 0.35 * (across * 1.1).sin() + 0.25 * noise(v(x * 0.8, 0.0, z * 0.8));
        let ridge = |s: f64| (-(s.sin() / 0.55).powi(2)).exp();
        let calm = smoothstep(1.3, 2.9, v((x + 0.2) * 0.85, 0.0, z - 0.6).norm());
        calm * (0.34 * ridge(bend * 1.35 + 0.4) + 0.16 * ridge(bend * 2.9 + across * 0.5 + 1.0)) + 0.02
    }

    /// The cloth covers the table's left front and hangs over its edge.
    fn cloth(p: V3) -> f64 {
        let edge = 2.35;
        let h = Self::cloth_height(p.x, p.z.min(edge));
        let hang = 0.22 * (p.x * 2.2 + 0.6 * (p.x * 0.9).sin()).sin() + 0.10 * (p.x * 5.1).sin();
        let front = p.z - edge - 0.12 - hang * smoothstep(0.15, -0.8, p.y);
        let sheet = meet(p.y - h, front, 0.3);
        let side = p.x - 2.55 - 0.35 * (p.z * 1.3).sin();
        meet(sheet, side, 0.1) * 0.55
    }

    fn nearest(p: V3) -> (f64, Part) {
        let mut best = (Self::cloth(p), Part::Cloth);
        let mut offer = |d: f64, part: Part| {
            if d < best.0 {
                best = (d, part);
            }
        };
        offer((p.y + 0.03).max(p.z - 2.0), Part::Table);
        let (jug, part) = Self::jug(p);
        offer(jug, part);
        for (i, &(at, [yaw, pitch, roll], size)) in PEARS.iter().enumerate() {
            let bound = (p - at - v(0.0, 0.6, 0.0)).norm() - 1.3;
            if bound > 0.9 {
                offer(bound, Part::Pear(i));
                continue;
            }
            let q = pear_frame(p, at, [yaw, pitch, roll], size, i);
            offer(Self::pear(q) * size * 0.85, Part::Pear(i));
            offer(Self::stalk(q) * size, Part::Stalk);
            if i == 0 {
                offer(leaf(q) * size, Part::Leaf);
            }
        }
        let q = turn(35.0, 10.0, 12.0) * (p - LEMON);
        let lemon = join(
            ellipsoid(q, V3::zeros(), v(0.47, 0.36, 0.36)),
            rod(q, v(-0.48, 0.0, 0.0), v(0.52, 0.0, 0.0), 0.07, 0.09),
            0.2,
        );
        offer(lemon + 0.008 * noise(q * 14.0), Part::Lemon);
        for (at, r) in PLUMS {
            offer(ball(p, at, r), Part::Plum);
        }
        best
    }
}

/// A standing pear turns about its foot, a lying one about its belly.
fn pear_frame(p: V3, at: V3, [yaw, pitch, roll]: [f64; 3], size: f64, index: usize) -> V3 {
    let pivot = if index == 2 { v(0.0, 0.5, 0.0) } else { V3::zeros() };
    turn(yaw, pitch, roll).inverse() * ((p - at) / size) + pivot
}

fn leaf(p: V3) -> f64 {
    let q = turn(0.0, 0.0, 28.0) * (p - v(0.18, 1.60, 0.05));
    let half = 0.20 * (1.0 - ((q.x - 0.42) / 0.45).powi(2)).max(0.0);
    let bend = q.y - 0.12 * (q.x * 3.0).sin() + 0.5 * q.z * q.z;
    ((q.z.abs() - half).max((q.x - 0.42).abs() - 0.45)).max(bend.abs() - 0.015) * 0.6
}

impl Scene for Orchard {
    fn distance(&self, p: V3) -> f64 {
        Self::nearest(p).0
    }

    fn material(&self, p: V3, n: V3) -> Material {
        match Self::nearest(p).1 {
            Part::Cloth => {
                let stripe = smoothstep(0.30, 0.26, ((p.x * 0.35 - p.z * 0.9 + 0.55).rem_euclid(2.1) - 0.5).abs());
                let fray = 1.0 + 0.06 * clouds(p * 3.0, 2);
                Material::matt(mix(hex(0xb5332a), hex(0xe9dcc0), 0.92 * stripe) * fray)
            }
            Part::Table => {
                let grain =
                    noise(v(p.x * 0.7, p.y * 6.0, p.z * 7.0)) * 0.5 + noise(v(p.x * 2.0, p.y * 9.0, p.z * 22.0)) * 0.25;
                Material::matt(mix(hex(0x7a4a26), hex(0xa9713c), 0.5 + grain)).glossy(0.15, 20.0)
            }
            Part::Jug => {
                let q = p - v(-0.75, 0.0, -0.55);
                let band = smoothstep(0.035, 0.02, (q.y - 1.62).abs().min((q.y - 1.50).abs() * 1.6))
                    * smoothstep(1.0, 0.9, q.x);
                let drip = smoothstep(0.40, 0.34, q.y + 0.07 * (q.x * 5.0).sin());
                let glaze = mix(hex(0x17609a), hex(0x2d8bbd), 0.5 + 0.5 * clouds(q * 1.3, 2));
                let colour = mix(mix(glaze, hex(0xe8e2cc), band), hex(0xb98a5e), drip);
                Material::matt(colour).glossy(0.9, 60.0)
            }
            Part::Inside => Material::matt(hex(0x7a6a55)),
            Part::Pear(i) => {
                let (at, angles, size) = PEARS[i];
                let q = pear_frame(p, at, angles, size, i);
                let ripe = [hex(0xe2b93a), hex(0xb9c24a), hex(0xdca63a)][i];
                let blush = smoothstep(0.0, 0.9, 0.6 * n.x + 0.35 * noise(q * 2.0) + 0.25);
                let mut colour = mix(ripe, hex(0xc4522c), blush * [0.75, 0.35, 0.8][i]);
                let crown = smoothstep(1.02, 1.34, q.y);
                colour = mix(colour, hex(0x8c9a3a), 0.6 * crown);
                let freckles = smoothstep(0.55, 0.75, noise(q * 16.0)) * 0.35;
                Material {
                    wrap: v(0.22, 0.16, 0.05),
                    ..Material::matt(mix(colour, hex(0x6e4a1c), freckles)).glossy(0.30, 28.0)
                }
            }
            Part::Lemon => Material { wrap: v(0.25, 0.2, 0.05), ..Material::matt(hex(0xf5d02a)).glossy(0.35, 30.0) },
            Part::Plum => {
                let bloom = 0.5 + 0.5 * noise(p * 5.0);
                Material::matt(mix(hex(0x35194a), hex(0x6a5a92), 0.55 * bloom)).glossy(0.35, 26.0)
            }
            Part::Stalk => Material::matt(hex(0x5a3a1e)),
            Part::Leaf => Material::matt(hex(0x4f8a3a)).glossy(0.2, 16.0),
        }
    }

    fn backdrop(&self, u: f64, v: f64, _direction: V3) -> (V3, u8) {
        let glow = (-((u - 0.78) / 0.42).powi(2) - ((v - 0.30) / 0.5).powi(2)).exp();
        let plaster = 0.05 * clouds(V3::new(u * 6.0, v * 6.0, 0.5), 3);
        let wall = mix(hex(0x35524c), hex(0xe3b873), 0.12 + 0.80 * glow);
        (wall * (1.0 + plaster), 0)
    }

    fn light(&self) -> &Light {
        &self.light
    }
}
