//! A nautilus shell on a draped cloth, for grey tones. Units are decimetres of a shell 2 wide.
use std::f64::consts::{PI, TAU};

use nalgebra::Rotation3;

use crate::field::{V3, ball, carve, clouds, grey, join, meet, mix, noise, smoothstep, turn, v};
use crate::march::{Camera, Light, Material, Scene};

/// Growth of the spiral in one radian: a nautilus triples its radius in a turn.
const GROWTH: f64 = 0.178;
/// Angle at which the shell opens.
const MOUTH: f64 = -0.30;

pub struct Shell {
    world_from_shell: Rotation3<f64>,
    centre: V3,
    light: Light,
}

#[derive(Clone, Copy, PartialEq)]
enum Part {
    Outside,
    Inside,
    Cloth,
}

impl Shell {
    pub fn new() -> Shell {
        Shell {
            world_from_shell: turn(36.0, 14.0, 0.0),
            centre: v(-0.05, 1.03, 0.1),
            light: Light {
                sun: v(-0.60, 0.62, 0.70).normalize(),
                sun_colour: grey(1.3),
                hardness: 5.0,
                sky: grey(0.22),
                ground: grey(0.18),
                rim: v(0.8, 0.3, -0.5).normalize(),
                rim_colour: grey(0.5),
                occlusion: 0.7,
            },
        }
    }

    pub fn camera() -> Camera {
        Camera { eye: v(0.0, 2.5, 9.0), target: v(-0.05, 0.95, 0.0), view: 0.335, near: 4.0, far: 18.0 }
    }

    /// Shell coordinates: mirrored, so that the mouth opens towards the light.
    fn shell_frame(&self, p: V3) -> V3 {
        let q = self.world_from_shell.inverse() * (p - self.centre);
        v(-q.x, q.y, q.z)
    }

    /// The outer wall: whorls whose centre line is a logarithmic spiral in the plane z = 0.
    fn shell(p: V3) -> (f64, bool) {
        let r = p.x.hypot(p.y).max(1e-4);
        let angle = p.y.atan2(p.x);
        let behind = (MOUTH - angle).rem_euclid(TAU);
        // distance to the whorl whose middle is `theta` before the mouth, and the whorl's scale
        let whorl = |theta: f64| {
            let scale = (-GROWTH * theta).exp();
            ((r - 0.80 * scale).hypot(p.z * 1.04) - 0.52 * scale, scale)
        };
        // the living chamber is hollow for a third of a turn and ends in a bowl; the whorl is cut off at the mouth
        let beyond = whorl(behind - TAU).0;
        let lip = beyond.max((TAU - behind) * r);
        let (outer, _) = whorl(behind);
        let hollow =
            meet(outer + 0.045, (behind - 1.9) * r.max(0.2), 0.3).min((beyond + 0.045).max((TAU - behind) * r - 0.12));
        let mut d = carve(outer.min(lip), hollow, 0.03);
        // the whorl before it stays whole
        d = d.min(outer.max((PI - behind) * r));
        for turns in 1..4 {
            let (inner, scale) = whorl(behind + TAU * f64::from(turns));
            d = join(d, inner, 0.05 * scale);
        }
        (d, hollow < 0.012 && (behind < 2.6 || outer > 0.02))
    }

    /// A drape that hangs from a pin at the upper right and runs out over the table.
    fn cloth(p: V3) -> f64 {
        let ridge = |s: f64| (-(s.sin() / 0.6).powi(2)).exp();
        let pin = v(2.6, 5.2, 0.0);
        let fan = (pin.x - p.x).atan2(pin.y - p.y.max(-0.5));
        let reach = v(p.x - pin.x, p.y - pin.y, 0.0).norm();
        let hang = fan * 7.5 + 0.25 * (reach * 1.1).sin();
        let deep = 0.11 * reach.min(4.0) * (0.8 * ridge(hang) + 0.35 * ridge(hang * 2.1 + 0.8 + 0.2 * reach));
        let back = (p.z + 2.1 - deep) * 0.7;
        let bend =
            p.x * 0.9 - p.z * 0.55 + 0.45 * (p.z * 0.9 + p.x * 0.4).sin() + 0.3 * noise(v(p.x * 0.7, 1.0, p.z * 0.7));
        let calm = smoothstep(0.4, 1.9, v((p.x + 0.1) * 0.8, 0.0, p.z - 0.1).norm());
        let height = calm * (0.34 * ridge(bend * 1.35 + 0.2) + 0.16 * ridge(bend * 2.9 + 0.6 * p.z + 1.3));
        let floor = (p.y - height) * 0.75;
        join(back, floor, 1.1)
    }

    fn nearest(&self, p: V3) -> (f64, Part) {
        let cloth = Self::cloth(p) * 0.8;
        let q = self.shell_frame(p);
        let bound = ball(q, V3::zeros(), 1.4);
        // far enough that the bound casts no penumbra of its own
        if bound > 1.4 {
            return if cloth < bound { (cloth, Part::Cloth) } else { (bound, Part::Outside) };
        }
        let (d, inside) = Self::shell(q);
        if cloth < d * 0.75 {
            (cloth, Part::Cloth)
        } else {
            (d * 0.75, if inside { Part::Inside } else { Part::Outside })
        }
    }
}

impl Scene for Shell {
    fn distance(&self, p: V3) -> f64 {
        self.nearest(p).0
    }

    fn material(&self, p: V3, _normal: V3) -> Material {
        let q = self.shell_frame(p);
        match self.nearest(p).1 {
            Part::Cloth => Material::matt(grey(0.36) * (1.0 + 0.03 * clouds(p * 6.0, 2))),
            Part::Inside => Material::matt(grey(0.72)).glossy(0.5, 20.0),
            Part::Outside => {
                let angle = q.y.atan2(q.x);
                let growth = (angle / TAU + 0.5) * 26.0 + 2.2 * q.z.abs() + 0.5 * noise(q * 3.0);
                let behind = (MOUTH - angle).rem_euclid(TAU);
                let stripe = smoothstep(0.15, 0.5, (growth * PI * 0.8).sin()) * smoothstep(2.0, 3.2, behind);
                Material::matt(mix(grey(0.85), grey(0.20), stripe)).glossy(0.5, 30.0)
            }
        }
    }

    fn backdrop(&self, u: f64, v: f64, _direction: V3) -> (V3, u8) {
        (mix(grey(0.10), grey(0.42), smoothstep(0.0, 1.1, u * 0.8 + 0.3 * v)), 0)
    }

    fn light(&self) -> &Light {
        &self.light
    }
}
