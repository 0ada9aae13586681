//! Signed distance fields: solids, smooth joins, noise. Lengths are in the scene's own unit.
use nalgebra::{Rotation3, Vector3};

/// A point, direction or linear RGB colour.
pub type V3 = Vector3<f64>;

pub fn v(x: f64, y: f64, z: f64) -> V3 {
    V3::new(x, y, z)
}

pub fn grey(value: f64) -> V3 {
    v(value, value, value)
}

/// Linear colour of an sRGB hexadecimal.
pub fn hex(rgb: u32) -> V3 {
    let channel = |shift: u32| {
        let c = ((rgb >> shift) & 255) as f64 / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    v(channel(16), channel(8), channel(0))
}

pub fn mix(a: V3, b: V3, t: f64) -> V3 {
    a + (b - a) * t
}

pub fn smoothstep(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Union that blends over a width of `k`.
pub fn join(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
}

/// Intersection that blends over a width of `k`.
pub fn meet(a: f64, b: f64, k: f64) -> f64 {
    -join(-a, -b, k)
}

/// `a` without `b`, blended over a width of `k`.
pub fn carve(a: f64, b: f64, k: f64) -> f64 {
    meet(a, -b, k)
}

pub fn ball(p: V3, centre: V3, radius: f64) -> f64 {
    (p - centre).norm() - radius
}

/// First-order distance to an ellipsoid with its axes along the coordinates.
pub fn ellipsoid(p: V3, centre: V3, radii: V3) -> f64 {
    let q = p - centre;
    let k0 = q.component_div(&radii).norm();
    let k1 = q.component_div(&radii.component_mul(&radii)).norm();
    if k1 < 1e-12 { -radii.min() } else { k0 * (k0 - 1.0) / k1 }
}

/// A rod with round ends of two radii.
pub fn rod(p: V3, a: V3, b: V3, radius_a: f64, radius_b: f64) -> f64 {
    let (pa, ba) = (p - a, b - a);
    let h = (pa.dot(&ba) / ba.norm_squared()).clamp(0.0, 1.0);
    (pa - ba * h).norm() - (radius_a + (radius_b - radius_a) * h)
}

/// A chain of rods through `(x, y, z, radius)`.
pub fn chain(p: V3, nodes: &[(V3, f64)], k: f64) -> f64 {
    let mut d = f64::INFINITY;
    for pair in nodes.windows(2) {
        let next = rod(p, pair[0].0, pair[1].0, pair[0].1, pair[1].1);
        d = if d.is_finite() { join(d, next, k) } else { next };
    }
    d
}

/// A rod of one radius along a cubic Bezier curve: the nearest chord, then two Newton steps.
pub fn curve(p: V3, [a, b, c, d]: [V3; 4], radius: f64) -> f64 {
    const PIECES: u32 = 12;
    let at = |t: f64| {
        let u = 1.0 - t;
        a * (u * u * u) + b * (3.0 * u * u * t) + c * (3.0 * u * t * t) + d * (t * t * t)
    };
    let ends = (0..=PIECES).map(|i| f64::from(i) / f64::from(PIECES));
    let start = ends.min_by(|&s, &t| (p - at(s)).norm_squared().total_cmp(&(p - at(t)).norm_squared()));
    let mut t = start.unwrap_or(0.0);
    for _ in 0..2 {
        let u = 1.0 - t;
        let slope = (b - a) * (3.0 * u * u) + (c - b) * (6.0 * u * t) + (d - c) * (3.0 * t * t);
        t = (t + (p - at(t)).dot(&slope) / slope.norm_squared().max(1e-12)).clamp(0.0, 1.0);
    }
    (p - at(t)).norm() - radius
}

/// A box with rounded edges: half sizes include the rounding.
pub fn block(p: V3, centre: V3, half: V3, round: f64) -> f64 {
    let q = (p - centre).abs() - half + grey(round);
    q.map(|c| c.max(0.0)).norm() + q.max().min(0.0) - round
}

/// Turns about y, then x, then z, degrees.
pub fn turn(yaw: f64, pitch: f64, roll: f64) -> Rotation3<f64> {
    let [yaw, pitch, roll] = [yaw, pitch, roll].map(f64::to_radians);
    Rotation3::from_axis_angle(&V3::z_axis(), roll)
        * Rotation3::from_axis_angle(&V3::x_axis(), pitch)
        * Rotation3::from_axis_angle(&V3::y_axis(), yaw)
}

/// A fixed pseudo-random number in 0..1 for a lattice point.
pub fn lattice(x: i64, y: i64, z: i64) -> f64 {
    let mut h = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
        ^ (z as u64).wrapping_mul(0x1656_67B1_9E37_79F9);
    h ^= h >> 31;
    h = h.wrapping_mul(0xBF58_476D_1CE4_E5B9);
    h ^= h >> 29;
    h = h.wrapping_mul(0x94D0_49BB_1331_11EB);
    h ^= h >> 32;
    (h >> 11) as f64 / (1u64 << 53) as f64
}

/// Value noise in -1..1, features of size 1.
pub fn noise(p: V3) -> f64 {
    let cell = p.map(f64::floor);
    let f = (p - cell).map(|t| t * t * (3.0 - 2.0 * t));
    let (i, j, k) = (cell.x as i64, cell.y as i64, cell.z as i64);
    let edge = |dy: i64, dz: i64| {
        let (a, b) = (lattice(i, j + dy, k + dz), lattice(i + 1, j + dy, k + dz));
        a + (b - a) * f.x
    };
    let face = |dz: i64| {
        let (a, b) = (edge(0, dz), edge(1, dz));
        a + (b - a) * f.y
    };
    let (a, b) = (face(0), face(1));
    2.0 * (a + (b - a) * f.z) - 1.0
}

/// Noise of `octaves` sizes, each half as large and half as strong as the one before.
pub fn clouds(p: V3, octaves: u32) -> f64 {
    let mut sum = 0.0;
    let mut scale = 1.0;
    for _ in 0..octaves {
        sum += noise(p * scale + grey(17.3 * scale)) / scale;
        scale *= 2.0;
    }
    sum
}
