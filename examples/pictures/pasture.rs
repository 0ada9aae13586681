//! A shepherd, a dog and three sheep before a house, trees and hills. Units are metres.
use std::f64::consts::PI;

use crate::field::{
    V3, ball, block, chain, clouds, ellipsoid, grey, hex, join, lattice, meet, mix, noise, rod, smoothstep, turn, v,
};
use crate::march::{Camera, Light, Material, Scene};

/// Numbers in the label picture.
mod label {
    pub const SKY: u8 = 1;
    pub const HILLS: u8 = 2;
    pub const GRASS: u8 = 3;
    pub const TREES: u8 = 4;
    pub const HOUSE: u8 = 5;
    pub const ROOF: u8 = 6;
    pub const PERSON: u8 = 7;
    pub const DOG: u8 = 8;
    pub const SHEEP: [u8; 3] = [9, 10, 11];
}

/// What the labels mean, as JSON: things with the confidence of a recogniser, stuff in the order in which it is drawn.
pub fn labels() -> String {
    let stuff = [
        (label::HOUSE, "house"),
        (label::ROOF, "roof"),
        (label::TREES, "trees"),
        (label::GRASS, "grass"),
        (label::HILLS, "hills"),
        (label::SKY, "sky"),
    ];
    let things = [
        (label::PERSON, "person", 0.98),
        (label::SHEEP[0], "sheep", 0.97),
        (label::DOG, "dog", 0.95),
        (label::SHEEP[1], "sheep", 0.93),
        (label::SHEEP[2], "sheep", 0.88),
    ];
    let things = things.map(|(label, name, confidence)| {
        format!(r#"{{"label": {label}, "name": "{name}", "class": "thing", "confidence": {confidence}}}"#)
    });
    let stuff: Vec<String> = stuff
        .iter()
        .enumerate()
        .map(|(i, (label, name))| {
            format!(r#"{{"label": {label}, "name": "{name}", "class": "stuff", "order": {}}}"#, i + 1)
        })
        .collect();
    let all: Vec<String> = things.into_iter().chain(stuff).collect();
    format!("{{\n  \"segments\": [\n    {}\n  ]\n}}\n", all.join(",\n    "))
}

#[derive(Clone, Copy, PartialEq)]
enum Part {
    Ground,
    Hill,
    Crown,
    Trunk,
    Wall,
    Roof,
    Cloak,
    Skin,
    Beard,
    Hat,
    Boot,
    Crook,
    Dog,
    Wool(usize),
    Face(usize),
}

/// Place on the ground, heading (degrees; 0 looks to the right), size.
const FLOCK: [(f64, f64, f64, f64); 3] = [(1.55, 0.5, 22.0, 1.0), (-2.55, 1.0, 14.0, 0.88), (4.0, -2.8, 160.0, 1.0)];
const TREES: [(f64, f64, f64); 5] =
    [(-7.6, -11.0, 1.15), (-5.0, -13.5, 0.95), (8.6, -11.5, 1.2), (10.8, -15.0, 1.3), (-10.6, -15.0, 1.35)];
const PERSON: V3 = V3::new(-1.35, 0.0, -0.4);
const DOG: V3 = V3::new(-0.15, 0.0, 1.25);
const HOUSE: V3 = V3::new(3.4, 0.0, -13.0);

pub struct Pasture {
    light: Light,
}

fn ground(x: f64, z: f64) -> f64 {
    0.10 * (x * 0.45 + 0.7).sin() + 0.08 * (z * 0.6 + x * 0.2).sin() + 0.04 * (-z - 4.0).max(0.0)
}

impl Pasture {
    pub fn new() -> Pasture {
        Pasture {
            light: Light {
                sun: v(-0.62, 0.55, 0.46).normalize(),
                sun_colour: v(1.55, 1.34, 0.98),
                hardness: 12.0,
                sky: v(0.26, 0.34, 0.48),
                ground: v(0.14, 0.15, 0.07),
                rim: v(0.7, 0.5, -0.5).normalize(),
                rim_colour: v(0.4, 0.38, 0.3),
                occlusion: 0.9,
            },
        }
    }

    pub fn camera() -> Camera {
        Camera { eye: v(0.0, 2.15, 10.5), target: v(0.0, 1.62, 0.0), view: 0.54, near: 4.0, far: 90.0 }
    }

    fn sheep(p: V3, index: usize) -> (f64, Part) {
        let (x, z, heading, size) = FLOCK[index];
        let at = v(x, ground(x, z), z);
        let q = turn(heading, 0.0, 0.0).inverse() * ((p - at) / size);
        let bound = ball(q, v(0.1, 0.6, 0.0), 1.15);
        if bound > 0.5 {
            return (bound * size, Part::Wool(index));
        }
        let grazing = index == 1;
        let mut wool = ellipsoid(q, v(0.0, 0.72, 0.0), v(0.66, 0.40, 0.38));
        wool = join(wool, ball(q, v(0.52, 0.86, 0.0), 0.22), 0.2);
        let curl = q * 9.0;
        let warp = curl + grey(1.2) * noise(q * 4.0);
        wool -=
            0.035 * warp.x.sin() * warp.y.sin() * warp.z.sin() + 0.035 * noise(q * 8.0).abs() + 0.012 * noise(q * 20.0);
        let (poll, nose) =
            if grazing { (v(0.82, 0.55, 0.0), v(0.98, 0.22, 0.04)) } else { (v(0.72, 1.05, 0.0), v(0.98, 0.90, 0.03)) };
        let neck = v(0.52, 0.86, 0.0);
        wool = join(wool, rod(q, neck, poll, 0.2, 0.15) - 0.02 * noise(q * 12.0), 0.12);
        wool = join(wool, ball(q, poll + v(-0.04, 0.10, 0.0), 0.10), 0.06);
        wool = join(wool, chain(q, &[(v(-0.62, 0.85, 0.0), 0.09), (v(-0.74, 0.62, 0.0), 0.06)], 0.05), 0.08);
        let mut face = rod(q, poll, nose, 0.125, 0.085);
        let m = v(q.x, q.y, q.z.abs());
        face = join(face, ellipsoid(m, poll + v(-0.05, 0.03, 0.20), v(0.06, 0.05, 0.13)), 0.03);
        for (lx, swing) in [(0.38, 0.05), (-0.40, -0.05)] {
            face = face.min(rod(m, v(lx, 0.5, 0.18), v(lx + swing, -0.02, 0.18), 0.055, 0.036));
        }
        let (d, part) = if wool < face { (wool, Part::Wool(index)) } else { (face, Part::Face(index)) };
        (d * size * 0.8, part)
    }

    fn person(p: V3) -> (f64, Part) {
        let at = PERSON + v(0.0, ground(PERSON.x, PERSON.z), 0.0);
        let q = turn(28.0, 0.0, 0.0).inverse() * (p - at);
        let bound = rod(q, v(0.1, 0.3, 0.2), v(0.1, 1.7, 0.2), 0.75, 0.7);
        if bound > 0.5 {
            return (bound, Part::Cloak);
        }
        let around = q.x.atan2(q.z);
        let r = v(q.x, 0.0, q.z * 1.15).norm();
        let flare = 0.20 + 0.26 * smoothstep(1.5, 0.35, q.y);
        let fold = 0.035 * smoothstep(1.4, 0.5, q.y) * ((around * 7.0 + q.y).sin().abs().sqrt() - 0.5);
        let mut cloak = meet((r - flare - fold) * 0.8, (q.y - 0.92).abs() - 0.60, 0.12);
        cloak = join(cloak, ellipsoid(q, v(0.0, 1.42, 0.0), v(0.30, 0.17, 0.20)), 0.12);
        // the right arm holds the crook
        cloak = join(
            cloak,
            chain(q, &[(v(0.27, 1.42, 0.05), 0.11), (v(0.42, 1.18, 0.14), 0.10), (v(0.48, 1.22, 0.38), 0.085)], 0.1),
            0.08,
        );
        let mut best = (cloak, Part::Cloak);
        let mut offer = |d: f64, part: Part| {
            if d < best.0 {
                best = (d, part);
            }
        };
        let head =
            join(ellipsoid(q, v(0.0, 1.73, 0.02), v(0.115, 0.145, 0.13)), ball(q, v(0.0, 1.71, 0.155), 0.025), 0.05);
        offer(head.min(ball(q, v(0.48, 1.24, 0.46), 0.065)), Part::Skin);
        let beard = join(
            ellipsoid(q, v(0.0, 1.63, 0.10), v(0.085, 0.10, 0.06)),
            rod(v(q.x.abs(), q.y, q.z), v(0.10, 1.76, 0.0), v(0.07, 1.66, 0.08), 0.03, 0.035),
            0.05,
        );
        offer(beard + 0.01 * noise(q * 22.0), Part::Beard);
        offer(ball(v(q.x.abs(), q.y, q.z), v(0.045, 1.745, 0.135), 0.017), Part::Boot);
        let hat = join(
            ellipsoid(q, v(0.0, 1.90, 0.0), v(0.14, 0.13, 0.15)),
            ellipsoid(q, v(0.0, 1.865 + 0.05 * q.x.abs() + 0.06 * q.z, 0.0), v(0.28, 0.035, 0.28)),
            0.06,
        );
        offer(hat, Part::Hat);
        let m = v(q.x.abs(), q.y, q.z);
        offer(
            chain(m, &[(v(0.11, 0.45, 0.0), 0.09), (v(0.12, 0.06, 0.0), 0.075), (v(0.13, 0.05, 0.14), 0.06)], 0.04),
            Part::Boot,
        );
        let stick = [
            (v(0.52, 0.0, 0.52), 0.022),
            (v(0.47, 1.78, 0.44), 0.022),
            (v(0.45, 1.92, 0.46), 0.022),
            (v(0.36, 1.98, 0.48), 0.022),
            (v(0.28, 1.91, 0.50), 0.022),
            (v(0.30, 1.82, 0.50), 0.026),
        ];
        offer(chain(q, &stick, 0.02), Part::Crook);
        (best.0 * 0.85, best.1)
    }

    fn dog(p: V3) -> f64 {
        let at = DOG + v(0.0, ground(DOG.x, DOG.z), 0.0);
        let q = turn(-150.0, 0.0, 0.0).inverse() * (p - at);
        let bound = ball(q, v(0.05, 0.4, 0.0), 0.85);
        if bound > 0.4 {
            return bound;
        }
        let m = v(q.x, q.y, q.z.abs());
        // sits: haunches low, chest high
        let mut d = rod(q, v(-0.22, 0.20, 0.0), v(0.10, 0.48, 0.0), 0.19, 0.155);
        d = join(d, ellipsoid(m, v(-0.20, 0.17, 0.13), v(0.20, 0.17, 0.10)), 0.08);
        d = join(d, rod(m, v(0.12, 0.42, 0.09), v(0.17, 0.05, 0.10), 0.075, 0.05), 0.06);
        d = join(d, ellipsoid(m, v(0.22, 0.04, 0.10), v(0.08, 0.045, 0.05)), 0.03);
        d = join(d, ellipsoid(m, v(-0.02, 0.05, 0.17), v(0.13, 0.045, 0.05)), 0.03);
        d = join(d, rod(q, v(0.12, 0.52, 0.0), v(0.19, 0.72, 0.0), 0.12, 0.10), 0.1);
        d = join(d, ball(q, v(0.21, 0.77, 0.0), 0.125), 0.06);
        d = join(d, rod(q, v(0.27, 0.75, 0.0), v(0.42, 0.71, 0.0), 0.07, 0.05), 0.05);
        d = join(d, rod(m, v(0.16, 0.85, 0.08), v(0.10, 0.97, 0.10), 0.05, 0.015), 0.03);
        d = join(
            d,
            chain(q, &[(v(-0.36, 0.12, 0.0), 0.06), (v(-0.56, 0.08, 0.10), 0.06), (v(-0.66, 0.12, 0.24), 0.03)], 0.05),
            0.06,
        );
        (d - 0.012 * noise(q * 14.0)) * 0.85
    }

    fn trees(p: V3) -> (f64, Part) {
        let mut best = (f64::INFINITY, Part::Crown);
        for (i, &(x, z, size)) in TREES.iter().enumerate() {
            let q = (p - v(x, ground(x, z), z)) / size;
            let bound = ball(q, v(0.0, 3.2, 0.0), 3.4);
            if bound > 1.0 {
                best.0 = best.0.min(bound * size);
                continue;
            }
            let mut crown = f64::INFINITY;
            for k in 0..14i64 {
                let r = |c: i64| lattice(k, c, i as i64) - 0.5;
                let at = v(2.9 * r(1), 3.5 + 2.7 * r(2), 2.2 * r(3));
                crown = join(crown, ball(q, at, 0.85 + 0.5 * r(4)), 0.25);
            }
            crown -= 0.16 * noise(q * 3.1) + 0.10 * noise(q * 7.0) + 0.05 * noise(q * 15.0);
            let trunk = rod(q, v(0.0, -0.2, 0.0), v(0.1, 3.0, 0.0), 0.28, 0.18);
            if crown * size * 0.7 < best.0 {
                best = (crown * size * 0.7, Part::Crown);
            }
            if trunk * size < best.0 {
                best = (trunk * size, Part::Trunk);
            }
        }
        best
    }

    fn house(p: V3) -> (f64, Part) {
        let q = turn(-24.0, 0.0, 0.0).inverse() * (p - HOUSE - v(0.0, ground(HOUSE.x, HOUSE.z), 0.0));
        let bound = ball(q, v(0.0, 2.2, 0.0), 5.0);
        if bound > 1.0 {
            return (bound, Part::Wall);
        }
        let mut wall = block(q, v(0.0, 0.75, 0.0), v(3.0, 1.4, 1.9), 0.03);
        // gable under the roof
        let slope = v(0.0, 0.66, 0.75);
        let m = v(q.x, q.y - 4.25, q.z.abs());
        let under = m.dot(&slope);
        wall = wall.min(block(q, v(0.0, 2.8, 0.0), v(2.95, 1.6, 1.9), 0.0).max(under + 0.10));
        wall = wall.min(block(q, v(-1.7, 4.3, 0.4), v(0.32, 0.9, 0.32), 0.03));
        let down = (m.z * 0.66 - m.y * 0.75) * 3.0;
        let tiles = 0.035 * (down - down.floor()) + 0.012 * (q.x * 14.0 + PI * down.floor()).sin();
        let roof = (under.abs() - 0.13 - tiles).max(q.x.abs() - 3.35).max(m.z - 2.35);
        if wall < roof * 0.9 { (wall, Part::Wall) } else { (roof * 0.9, Part::Roof) }
    }

    fn hills(p: V3) -> f64 {
        let h = 2.6 + 1.9 * (p.x * 0.075 + 1.2).sin() + 0.9 * (p.x * 0.19).sin() + 0.15 * noise(p * 0.6);
        (p.y - h * smoothstep(-24.0, -42.0, p.z)) * 0.6
    }

    fn nearest(p: V3) -> (f64, Part) {
        let tufts = if p.z > -14.0 && p.y < 0.9 { 0.025 * noise(v(p.x * 9.0, 0.0, p.z * 5.0)) } else { 0.0 };
        let mut best = ((p.y - ground(p.x, p.z) - tufts) * 0.8, Part::Ground);
        if p.z < -16.0 {
            let hill = Self::hills(p);
            if hill < best.0 {
                best = (hill, Part::Hill);
            }
        } else {
            // rays must not jump over the hills' foot
            best.0 = best.0.min((p.z + 16.5).max(0.4));
        }
        let things = [
            Self::sheep(p, 0),
            Self::sheep(p, 1),
            Self::sheep(p, 2),
            Self::person(p),
            (Self::dog(p), Part::Dog),
            Self::trees(p),
            Self::house(p),
        ];
        things.into_iter().fold(best, |a, b| if b.0 < a.0 { b } else { a })
    }
}

impl Scene for Pasture {
    fn distance(&self, p: V3) -> f64 {
        Self::nearest(p).0
    }

    fn material(&self, p: V3, n: V3) -> Material {
        match Self::nearest(p).1 {
            Part::Ground => {
                let patch = 0.5 + 0.5 * clouds(v(p.x * 0.5, 0.0, p.z * 0.35), 2);
                let blade = 0.16 * noise(v(p.x * 14.0, 0.0, p.z * 5.0));
                let grass = mix(hex(0x6f9a35), hex(0xa9b84a), patch.clamp(0.0, 1.0)) * (1.0 + blade);
                Material::matt(grass).label(label::GRASS)
            }
            Part::Hill => {
                let woods = smoothstep(0.1, 0.3, clouds(p * 0.16, 3));
                Material::matt(mix(hex(0x8ea85e), hex(0x4f7a52), woods)).label(label::HILLS)
            }
            Part::Crown => {
                let leaf = 0.5 + 0.5 * clouds(p * 1.6, 2);
                Material::matt(mix(hex(0x2f5a2c), hex(0x6a8c34), leaf.clamp(0.0, 1.0))).label(label::TREES)
            }
            Part::Trunk => Material::matt(hex(0x5b4330)).label(label::TREES),
            Part::Wall => {
                let q = turn(-24.0, 0.0, 0.0).inverse() * (p - HOUSE - v(0.0, ground(HOUSE.x, HOUSE.z), 0.0));
                let pane = |x: f64, y: f64, w: f64, h: f64| (q.x - x).abs() < w && (q.y - y).abs() < h && q.z > 1.5;
                let dark = pane(0.3, 0.9, 0.5, 1.0) || pane(-1.7, 1.4, 0.5, 0.5) || pane(2.0, 1.4, 0.5, 0.5);
                let side = q.x.abs() > 2.9 && q.z.abs() < 0.55 && (q.y - 1.5).abs() < 0.5;
                let frame = pane(-1.7, 1.4, 0.62, 0.62) || pane(2.0, 1.4, 0.62, 0.62) || pane(0.3, 0.95, 0.62, 1.1);
                let mut colour = hex(0xefe4cb) * (1.0 + 0.05 * clouds(q * 1.5, 2));
                if frame {
                    colour = hex(0x9a6a3e);
                }
                if dark || side {
                    colour = hex(0x3a4650);
                }
                if q.y > 3.3 && n.y.abs() < 0.9 && q.x.abs() < 2.4 {
                    colour = hex(0x9c6a55);
                }
                Material::matt(colour).label(label::HOUSE)
            }
            Part::Roof => {
                Material::matt(mix(hex(0xb04a2c), hex(0xcf6a3e), 0.5 + 0.5 * noise(p * 2.5))).label(label::ROOF)
            }
            Part::Cloak => {
                Material::matt(mix(hex(0x8f2d2a), hex(0xb8443a), 0.5 + 0.5 * noise(p * 3.0))).label(label::PERSON)
            }
            Part::Skin => Material::matt(hex(0xd99a74)).label(label::PERSON),
            Part::Beard => Material::matt(hex(0xded6c8)).label(label::PERSON),
            Part::Hat => Material::matt(hex(0xd9b25a)).label(label::PERSON),
            Part::Boot => Material::matt(hex(0x3b2a20)).label(label::PERSON),
            Part::Crook => Material::matt(hex(0x5a3c22)).label(label::PERSON),
            Part::Dog => {
                let q = turn(-150.0, 0.0, 0.0).inverse() * (p - DOG - v(0.0, ground(DOG.x, DOG.z), 0.0));
                let chest = smoothstep(0.02, 0.14, q.x - 0.5 * (q.y - 0.45).abs() - 0.03);
                let blaze = smoothstep(0.05, 0.03, q.z.abs()) * smoothstep(0.6, 0.7, q.y);
                let white = chest.max(blaze).max(smoothstep(0.10, 0.06, q.y));
                let mut colour = mix(hex(0x2a221f), hex(0xf0e8da), white);
                if q.x > 0.44 {
                    colour = hex(0x17120f);
                }
                let eye = ball(v(q.x, q.y, q.z.abs()), v(0.315, 0.80, 0.06), 0.028);
                if eye < 0.0 {
                    colour = hex(0x100c0a);
                }
                Material::matt(colour).glossy(0.08, 10.0).label(label::DOG)
            }
            Part::Wool(i) => {
                let wool = [hex(0xf3ead6), hex(0xe9dcc2), hex(0xf0e6d2)][i];
                Material { wrap: grey(0.2), ..Material::matt(wool) }.label(label::SHEEP[i])
            }
            Part::Face(i) => Material::matt([hex(0x3a2f2a), hex(0x3a2f2a), hex(0x6a5546)][i]).label(label::SHEEP[i]),
        }
    }

    fn backdrop(&self, u: f64, v: f64, direction: V3) -> (V3, u8) {
        let high = (direction.y * 3.2 + 0.05).clamp(0.0, 1.0);
        let blue = mix(hex(0xf0dcb8), hex(0x4a88c6), high.sqrt());
        let cloud = clouds(V3::new(u * 4.5 + 0.3, v * 11.0, 2.0), 4);
        let cover = smoothstep(0.05, 0.7, cloud) * smoothstep(0.55, 0.25, v);
        (mix(blue, hex(0xfffaf0), 0.85 * cover), label::SKY)
    }

    fn light(&self) -> &Light {
        &self.light
    }

    fn air(&self, colour: V3, distance: f64, _direction: V3) -> V3 {
        mix(colour, hex(0xc9d8e0), 1.0 - (-(distance - 14.0).max(0.0) / 130.0).exp())
    }
}
