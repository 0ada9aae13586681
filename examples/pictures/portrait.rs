//! A bust of a girl in a turban with a pearl, three-quarter view. Units are centimetres of a life-sized head.
use nalgebra::Rotation3;

use crate::field::{
    V3, ball, carve, chain, clouds, ellipsoid, grey, hex, join, meet, mix, noise, rod, smoothstep, turn, v,
};
use crate::march::{Camera, Light, Material, Scene};

/// Head coordinates: x to the subject's left, y up from the eyes, z out of the face; the origin is between the ears.
pub struct Portrait {
    world_from_head: Rotation3<f64>,
    world_from_body: Rotation3<f64>,
    /// Where the eyes look, head coordinates.
    gaze: V3,
    light: Light,
}

#[derive(Clone, Copy, PartialEq)]
enum Part {
    Skin,
    Eye,
    Turban,
    Tail,
    Coat,
    Collar,
    Pearl,
}

const EYE: V3 = V3::new(3.15, 0.0, 7.0);
const EYE_RADIUS: f64 = 1.28;

/// Height of the lids' edges above the eye's centre, `along` from its middle towards the temple.
fn lids(along: f64) -> (f64, f64) {
    let bow = 1.0 - (along / 1.62) * (along / 1.62);
    let tilt = 0.06 * along;
    (0.60 * bow + tilt, -0.50 * bow + tilt)
}

/// Front of the face at the mouth: the lips lie on this.
fn mouth_curve(x: f64) -> (f64, f64) {
    let x = x.abs();
    (-7.15 + 0.03 * x * x - 0.16 * (-(x / 0.6) * (x / 0.6)).exp(), 9.95 - 0.19 * x * x)
}

impl Portrait {
    pub fn new() -> Portrait {
        let world_from_head = turn(-36.0, 4.0, 4.0);
        let gaze = (world_from_head.inverse() * v(-0.06, 0.0, 1.0)).normalize();
        let light = Light {
            sun: v(-0.75, 0.52, 0.50).normalize(),
            sun_colour: v(1.12, 1.04, 0.92) * 1.12,
            hardness: 5.5,
            sky: v(0.22, 0.23, 0.25) * 0.65,
            ground: v(0.16, 0.11, 0.08) * 0.6,
            rim: v(0.85, 0.35, -0.55).normalize(),
            rim_colour: v(0.75, 0.68, 0.6) * 1.5,
            occlusion: 3.5,
        };
        Portrait { world_from_head, world_from_body: turn(-58.0, 0.0, 0.0), gaze, light }
    }

    pub fn camera() -> Camera {
        Camera { eye: v(0.0, 1.0, 150.0), target: v(0.8, -5.2, 0.0), view: 0.305, near: 100.0, far: 220.0 }
    }

    fn skin(&self, p: V3) -> f64 {
        // both halves at once, without a crease in the middle
        let q = v(p.x.hypot(0.25), p.y, p.z);
        let mut d = ellipsoid(p, v(0.0, 3.0, -1.0), v(7.2, 8.2, 9.2));
        d = join(d, ellipsoid(p, v(0.0, -2.4, 2.4), v(6.0, 8.2, 6.5)), 2.5);
        // jaw, chin, cheekbones
        d = join(d, rod(q, v(4.7, -5.6, 0.8), v(1.4, -9.4, 6.6), 1.5, 1.5), 3.0);
        d = join(d, ball(p, v(0.0, -9.6, 7.25), 1.75), 2.0);
        d = join(d, ellipsoid(q, v(4.1, -2.6, 5.2), v(2.2, 1.9, 2.2)), 2.2);
        d = join(d, ellipsoid(q, v(3.0, -5.2, 6.2), v(2.2, 2.6, 2.2)), 2.5);
        // brows and sockets
        d = join(d, rod(q, v(1.4, 1.75, 7.9), v(4.6, 1.6, 5.9), 0.9, 0.9), 2.2);
        d = carve(d, ellipsoid(q, v(3.1, -0.1, 9.3), v(2.15, 1.35, 1.7)), 1.5);
        // muzzle and lips
        d = join(d, ellipsoid(p, v(0.0, -7.0, 7.4), v(2.9, 2.4, 2.2)), 2.0);
        d = self.lips(p, d);
        // nose
        let nose = rod(p, v(0.0, 1.2, 8.1), v(0.0, -3.5, 10.45), 0.55, 0.60);
        d = join(d, nose, 1.7);
        d = join(d, ellipsoid(p, v(0.0, -3.95, 10.75), v(0.80, 0.74, 0.85)), 1.0);
        d = join(d, ellipsoid(q, v(1.05, -4.3, 9.6), v(0.52, 0.55, 0.8)), 0.8);
        d = carve(d, ellipsoid(q, v(0.52, -4.9, 10.0), v(0.30, 0.25, 0.5)), 0.35);
        // groove under the nose
        d = carve(d, rod(p, v(0.0, -5.5, 10.35), v(0.0, -6.2, 10.55), 0.3, 0.35), 0.7);
        // lids
        let e = q - EYE;
        let (upper, lower) = lids(e.x);
        let lid = |r: f64| e.norm() - EYE_RADIUS - r;
        let top = meet(lid(0.20), (upper - e.y) * 0.8, 0.12);
        let bottom = meet(lid(0.15), (e.y - lower) * 0.8, 0.12);
        d = carve(d, meet(ball(q, EYE, EYE_RADIUS + 0.12), ((e.y - upper).max(lower - e.y)) * 0.8, 0.1), 0.1);
        d = join(d, top, 0.35);
        d = join(d, bottom, 0.45);
        // ear
        let ear = turn(18.0, 0.0, 0.0) * (q - v(7.0, -1.4, -1.2));
        let mut shell = ellipsoid(ear, v(0.0, 0.0, 0.0), v(0.75, 2.9, 1.7));
        shell = carve(shell, ellipsoid(ear, v(0.7, 0.4, 0.15), v(0.65, 1.9, 0.95)), 0.4);
        shell = join(shell, ball(ear, v(0.1, -2.5, 0.6), 0.7), 0.6);
        d = join(d, shell, 0.5);
        // neck
        join(d, rod(p, v(0.0, -5.0, -2.4), v(-0.5, -20.0, -5.0), 4.8, 5.6), 2.2)
    }

    fn lips(&self, p: V3, skin: f64) -> f64 {
        let x = p.x.abs();
        let (y, z) = mouth_curve(x);
        let taper = (1.0 - (x / 2.6) * (x / 2.6)).max(0.0);
        let bow = 0.12 * (-((x - 0.55) / 0.45).powi(2)).exp();
        let end = (x - 2.5).max(0.0);
        let upper =
            v(end, p.y - (y + 0.36 * taper), p.z - (z - 0.12 - 0.5 * (1.0 - taper))).norm() - (0.50 + bow) * taper;
        let lower = v(end, p.y - (y - 0.50 * taper), p.z - (z - 0.20 - 0.5 * (1.0 - taper))).norm() - 0.62 * taper;
        let crease = v((x - 2.3).max(0.0), p.y - y, p.z - (z + 0.15)).norm() - 0.14 * taper;
        let mut d = join(skin, upper * 0.9, 0.5);
        d = join(d, lower * 0.9, 0.45);
        carve(d, crease, 0.3 * taper + 0.02)
    }

    /// Height above the rim of the turban, which falls from the forehead to the nape.
    fn above_rim(p: V3) -> f64 {
        (p - v(0.0, 4.9, 8.0)).dot(&v(-0.06, 0.84, -0.54)) + 0.25 * (p.x * 0.5 + 0.6).sin()
    }

    /// Two wraps of cloth, whose strands cross: `(coordinate across the strands, is the lower wrap)`.
    fn strands(p: V3) -> [f64; 2] {
        let rise = Self::above_rim(p);
        let around = p.x.atan2(p.z + 1.6);
        [rise + 1.1 * (around + 0.2).sin() + 0.12 * (5.0 * around).sin(), rise * 0.9 - 2.6 * (around - 0.5).sin()]
    }

    fn turban(&self, p: V3) -> (f64, bool) {
        let bound = ball(p, v(0.0, 5.5, -1.5), 12.5);
        if bound > 5.0 {
            return (bound, true);
        }
        let rise = Self::above_rim(p);
        let [low, high] = Self::strands(p);
        let fold = |s: f64, rate: f64| (s * rate).sin().abs().powf(0.6);
        let core = ellipsoid(p, v(0.0, 4.4, -1.8), v(7.9, 8.0, 9.6));
        let roll = 1.5 * (1.0 - ((rise - 2.7) / 3.0).powi(2)).max(0.0).sqrt();
        let lower = meet(core - roll - 0.34 * fold(low, 1.75) - 0.1 * (low * 5.3).sin(), -rise, 0.5);
        let upper = meet(core - 0.55 - 0.42 * fold(high, 1.15) - 0.12 * (high * 4.1).sin(), 2.5 - rise, 0.5);
        (join(lower, upper, 0.25) * 0.62, lower < upper)
    }

    fn tail(&self, p: V3) -> f64 {
        let bound = ball(p, v(1.0, -2.0, -12.0), 19.0);
        if bound > 3.0 {
            return bound;
        }
        let nodes = [
            (v(-0.4, 12.1, -1.2), 1.9),
            (v(0.6, 12.3, -5.0), 2.7),
            (v(1.2, 10.5, -9.0), 2.8),
            (v(2.0, 3.5, -12.0), 2.1),
            (v(2.6, -8.0, -12.5), 2.9),
            (v(3.0, -18.0, -12.5), 3.8),
        ];
        let d = chain(p, &nodes, 2.5);
        let along = (p.z + 12.0).atan2(p.x - 2.2);
        let folds = 0.55 * (along * 3.5 + 0.5 * (p.y * 0.30).sin() + 0.3).sin().abs().powf(0.7);
        (d - folds * smoothstep(12.0, 6.0, p.y)) * 0.8
    }

    fn coat(&self, body: V3) -> f64 {
        let mut d = ellipsoid(body, v(0.0, -34.0, -3.0), v(20.5, 17.5, 10.5));
        d = join(d, ellipsoid(body, v(0.0, -21.5, -3.5), v(9.5, 5.0, 7.0)), 5.0);
        // folds hang from the shoulders, of uneven width, and slacken upwards
        let fan = body.x.atan2(body.z + 14.0) * 3.6 + 0.9 * noise(v(body.x * 0.10, body.y * 0.07, 3.0)) - 0.05 * body.y;
        let ridge = |s: f64| (-(s.sin() / 0.6).powi(2)).exp();
        let fall = smoothstep(-17.0, -25.0, body.y);
        (d - fall * (1.7 * ridge(fan) + 0.7 * ridge(fan * 2.3 + 0.9 + 0.06 * body.y))) * 0.55
    }

    fn collar(&self, body: V3) -> f64 {
        let q = turn(0.0, 14.0, 0.0) * (body - v(0.0, -17.3, -3.6));
        let (radial, along) = ((q.x * 0.95).hypot(q.z) - 6.6 - 0.35 * q.y, q.y);
        let band = radial.hypot((along.abs() - 1.6).max(0.0)) - 0.55;
        band * 0.85
    }

    fn nearest(&self, p: V3) -> (f64, Part) {
        let head = self.world_from_head.inverse() * p;
        let body = self.world_from_body.inverse() * p;
        let q = v(head.x.abs(), head.y, head.z);
        let (turban, _) = self.turban(head);
        let tail = self.tail(head);
        let cloth = if turban < tail { (turban, Part::Turban) } else { (tail, Part::Tail) };
        let blended = join(turban, tail, 0.8);
        let parts = [
            (self.skin(head), Part::Skin),
            (ball(q, EYE, EYE_RADIUS), Part::Eye),
            (blended, cloth.1),
            (self.coat(body), Part::Coat),
            (self.collar(body), Part::Collar),
            (ball(head, v(7.25, -6.1, 0.3), 1.1), Part::Pearl),
        ];
        parts.into_iter().fold((f64::INFINITY, Part::Skin), |a, b| if b.0 < a.0 { b } else { a })
    }

    fn skin_colour(&self, p: V3) -> Material {
        let q = v(p.x.abs(), p.y, p.z);
        let mut colour = hex(0xe6b592);
        let blush = (-(q - v(4.0, -3.4, 6.5)).norm_squared() / 6.0).exp();
        colour = mix(colour, hex(0xd9826a), 0.5 * blush);
        let tip = (-(q - v(0.0, -4.2, 10.8)).norm_squared() / 2.0).exp();
        colour = mix(colour, hex(0xd98a70), 0.35 * tip);
        // lips
        let (y, _) = mouth_curve(p.x);
        let taper = (1.0 - (p.x / 2.6) * (p.x / 2.6)).max(0.0);
        let bow = 0.16 * (-((q.x - 0.55) / 0.4).powi(2)).exp();
        let top = y + (0.78 + bow) * taper;
        let bottom = y - 1.08 * taper;
        let inside = (top - p.y).min(p.y - bottom);
        let lips = smoothstep(-0.10, 0.18, inside) * f64::from(u8::from(p.z > 7.0 && q.x < 2.6));
        colour = mix(colour, hex(0xb4393a), 0.9 * lips);
        let line = (-((p.y - y) / 0.10).powi(2)).exp() * smoothstep(2.7, 2.0, q.x) * f64::from(u8::from(p.z > 7.0));
        colour = mix(colour, hex(0x4a1416), 0.8 * line);
        // brows
        let arch = 2.35 + 0.42 * (1.0 - ((q.x - 3.6) / 2.3).powi(2));
        let thick = 0.33 * smoothstep(5.9, 3.0, q.x) + 0.04;
        let brow = smoothstep(thick + 0.2, thick - 0.16, (q.y - arch).abs())
            * smoothstep(1.1, 2.6, q.x)
            * smoothstep(5.9, 5.0, q.x);
        colour = mix(colour, hex(0x4a2c1a), 0.75 * brow * f64::from(u8::from(p.z > 2.0)));
        // lashes along the edge of the lids
        let e = q - EYE;
        if e.norm() < EYE_RADIUS + 0.5 && e.z > 0.0 {
            let (upper, lower) = lids(e.x);
            let lash = smoothstep(0.26, 0.10, (e.y - upper - 0.08).abs()) * smoothstep(1.75, 1.5, e.x.abs());
            colour = mix(colour, hex(0x24130c), 0.92 * lash);
            let under = smoothstep(0.16, 0.05, (e.y - lower + 0.06).abs()) * smoothstep(1.7, 1.3, e.x.abs());
            colour = mix(colour, hex(0x7a3b2c), 0.6 * under);
        }
        Material { albedo: colour, gloss: 0.05 + 0.25 * lips, shine: 16.0, wrap: v(0.29, 0.18, 0.13), label: 0 }
    }

    fn eye_colour(&self, p: V3) -> Material {
        let side = p.x.signum();
        let e = v(p.x - side * EYE.x, p.y - EYE.y, p.z - EYE.z) / EYE_RADIUS;
        let angle = e.dot(&self.gaze).clamp(-1.0, 1.0).acos() * EYE_RADIUS;
        let mut colour = mix(hex(0xefe6da), hex(0xd9b9a6), smoothstep(0.7, 1.3, e.x.abs()));
        let iris = mix(hex(0x6b4a2a), hex(0x2a1a10), smoothstep(0.45, 0.7, angle));
        colour = mix(colour, iris, smoothstep(0.76, 0.68, angle));
        colour = mix(colour, hex(0x080606), smoothstep(0.36, 0.30, angle));
        // catch light, where the window mirrors
        let spark = (e - (self.gaze + v(-0.05, 0.28, 0.0))).norm() * EYE_RADIUS;
        colour = mix(colour, grey(2.5), smoothstep(0.17, 0.10, spark));
        Material { albedo: colour, gloss: 0.3, shine: 90.0, wrap: grey(0.15), label: 0 }
    }
}

impl Scene for Portrait {
    fn distance(&self, p: V3) -> f64 {
        self.nearest(p).0
    }

    fn material(&self, p: V3, normal: V3) -> Material {
        let head = self.world_from_head.inverse() * p;
        let body = self.world_from_body.inverse() * p;
        match self.nearest(p).1 {
            Part::Skin => self.skin_colour(head),
            Part::Eye => self.eye_colour(head),
            Part::Turban => {
                let lower = self.turban(head).1;
                let strand = Self::strands(head)[usize::from(!lower)];
                let light = 0.5 + 0.5 * (strand * if lower { 1.75 } else { 1.15 }).sin();
                let dye = if lower {
                    mix(hex(0x2d5fb4), hex(0x4f8ad6), light)
                } else {
                    mix(hex(0x4c84c8), hex(0x86b6e6), light)
                };
                Material::matt(dye).glossy(0.10, 9.0)
            }
            Part::Tail => {
                let band = smoothstep(-14.2, -13.8, head.y) * smoothstep(-11.8, -12.2, head.y);
                let dye = mix(hex(0xffc64a), hex(0x3f74c4), band);
                Material { wrap: grey(0.5), ..Material::matt(dye).glossy(0.15, 12.0) }
            }
            Part::Coat => {
                let weave = 1.0 + 0.10 * clouds(body * 0.35, 2);
                Material::matt(hex(0xad6a2c) * weave).glossy(0.06, 8.0)
            }
            Part::Collar => Material::matt(hex(0xf1ead9)),
            Part::Pearl => {
                // the window above and the collar below are mirrored in it, shaded or not
                let window = smoothstep(0.50, 0.28, (normal - v(-0.42, 0.52, 0.74)).norm());
                let collar = smoothstep(0.75, 0.25, (normal - v(-0.25, -0.75, 0.60)).norm());
                let lit = mix(mix(hex(0x9aa0a4), hex(0xf2ece0), 0.8 * collar), grey(7.0), window);
                Material { wrap: grey(0.5), ..Material::matt(lit).glossy(0.4, 30.0) }
            }
        }
    }

    /// Darker behind the lit side, lighter behind the shaded one, so that both edges of the head show.
    fn backdrop(&self, u: f64, v: f64, _direction: V3) -> (V3, u8) {
        let across = smoothstep(-0.1, 1.05, u * 0.85 + v * 0.25);
        (mix(hex(0x2e4a4c), hex(0xa9b8a6), across), 0)
    }

    fn light(&self) -> &Light {
        &self.light
    }
}
