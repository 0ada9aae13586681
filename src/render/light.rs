//! Where the studio's light comes from, and the shadow layers that sample it.
//!
//! The key light is an area: 64 points of a disc, each with its own shadow layer, whose mean is the soft shadow itself,
//! sharp where things touch and wide where they are far. The sky is 48 directions over the upper half space.
use std::f64::consts::TAU;

use bytemuck::{Pod, Zeroable};
use nalgebra::{Point3, Vector3};

/// Shadow layers of the key light.
pub(super) const KEY_LAYERS: usize = 64;
/// Shadow layers of the sky.
pub(super) const DOME_LAYERS: usize = 48;
/// Edge of a key layer, texels.
pub(super) const KEY_SIZE: u32 = 768;
/// Edge of a sky layer, texels.
pub(super) const DOME_SIZE: u32 = 384;
/// Radius of the key light seen from the scene, as the tangent of its angle.
const KEY_RADIUS: f64 = 0.09;

/// Rows that lead from the world to a layer's u, v and depth (0..=1), and the direction to the light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Layer {
    pub u: [f32; 4],
    pub v: [f32; 4],
    pub depth: [f32; 4],
    toward: [f32; 4],
}

/// The layers of the sky, as the shaders read them.
pub(super) type Dome = [Layer; DOME_LAYERS];

/// The lights of one scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lighting {
    /// Layers of the key light's points.
    pub key: [Layer; KEY_LAYERS],
    /// The layer of its middle, of which the others are shears about half depth.
    pub key_middle: Layer,
    /// Layers of the sky.
    pub dome: Dome,
    /// Where the lights are.
    pub studio: Studio,
    /// How far a point on the key light's rim shears its layer, in u and v for each unit of depth.
    pub key_shear: [f64; 2],
    /// Width of the key light's penumbra, m for each unit of depth between what casts it and where it falls.
    pub penumbra: f64,
    /// Edge of a key texel, m.
    pub key_texel: f64,
    /// Edge of the coarsest sky texel, m.
    pub dome_texel: f64,
}

/// Directions of the lights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Studio {
    /// Unit direction to the key light: high, on the right of one who faces the scene.
    pub key: Vector3<f64>,
    /// Unit direction to the fill light: low, on the left.
    pub fill: Vector3<f64>,
}

impl Studio {
    /// Lights for a scene that is mostly seen from the horizontal direction `facing` (any length; +x when it is none).
    pub fn facing(facing: &Vector3<f64>) -> Self {
        let azimuth = if facing.xy().norm() > 1e-9 { facing.y.atan2(facing.x) } else { 0.0 };
        let toward = |turn_deg: f64, elevation_deg: f64| {
            let (s, c) = (azimuth + turn_deg.to_radians()).sin_cos();
            let (up, out) = elevation_deg.to_radians().sin_cos();
            Vector3::new(out * c, out * s, up)
        };
        Studio { key: toward(35.0, 50.0), fill: toward(-75.0, 25.0) }
    }
}

impl Lighting {
    /// Layers that just hold all `casters` (m, world).
    pub fn around(casters: &[Point3<f32>], studio: Studio) -> Self {
        let l = studio.key;
        let (x, y) = axes(&l);
        let (_, depth) = extent(casters, |p| -p.dot(&l), 0.0, |_| 0.0);
        let middle = -0.5 * (depth[0] + depth[1]);
        let spread = |p: &Vector3<f64>| KEY_RADIUS * (p.dot(&l) - middle).abs();
        let (_, across) = extent(casters, |p| p.dot(&x), 2.5 / f64::from(KEY_SIZE), spread);
        let (_, along) = extent(casters, |p| p.dot(&y), 2.5 / f64::from(KEY_SIZE), spread);
        let at = |[sx, sy]: [f64; 2]| {
            let (u, v) = ((x - l * sx, middle * sx, across), (y - l * sy, middle * sy, along));
            layer(u, v, (-l, depth), (l + x * sx + y * sy).normalize())
        };
        let key = std::array::from_fn(|i| at(disc(i).map(|c| c * KEY_RADIUS)));
        let mut dome_texel = 0.0f64;
        let dome = std::array::from_fn(|i| {
            let l = sky(i);
            let (x, y) = axes(&l);
            let margin = 6.0 / f64::from(DOME_SIZE);
            let (width, across) = extent(casters, |p| p.dot(&x), margin, |_| 0.0);
            let (height, along) = extent(casters, |p| p.dot(&y), margin, |_| 0.0);
            let (_, depth) = extent(casters, |p| -p.dot(&l), 0.0, |_| 0.0);
            dome_texel = dome_texel.max(width.max(height) / f64::from(DOME_SIZE));
            layer((x, 0.0, across), (y, 0.0, along), (-l, depth), l)
        });
        let key_texel = (across[1] - across[0]).max(along[1] - along[0]) / f64::from(KEY_SIZE);
        let shear = KEY_RADIUS * (depth[1] - depth[0]);
        let key_shear = [shear / (across[1] - across[0]), shear / (along[1] - along[0])];
        let penumbra = 2.0 * shear;
        Lighting { key, key_middle: at([0.0, 0.0]), dome, studio, key_shear, penumbra, key_texel, dome_texel }
    }
}

/// Smallest and largest value over the casters, each pushed out by its `spread`, then both by a share of the whole.
fn extent(
    casters: &[Point3<f32>],
    value: impl Fn(&Vector3<f64>) -> f64,
    margin: f64,
    spread: impl Fn(&Vector3<f64>) -> f64,
) -> (f64, [f64; 2]) {
    let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
    for p in casters {
        let p = p.coords.cast::<f64>();
        let (at, s) = (value(&p), spread(&p));
        lo = lo.min(at - s);
        hi = hi.max(at + s);
    }
    if lo > hi {
        (lo, hi) = (-1.0, 1.0);
    }
    let more = margin * (hi - lo) + 1e-4;
    (hi - lo + 2.0 * more, [lo - more, hi + more])
}

fn layer(
    u: (Vector3<f64>, f64, [f64; 2]),
    v: (Vector3<f64>, f64, [f64; 2]),
    depth: (Vector3<f64>, [f64; 2]),
    toward: Vector3<f64>,
) -> Layer {
    let row = |(a, shift, [lo, hi]): (Vector3<f64>, f64, [f64; 2])| {
        let s = 1.0 / (hi - lo);
        [a.x * s, a.y * s, a.z * s, (shift - lo) * s].map(|c| c as f32)
    };
    Layer {
        u: row(u),
        v: row(v),
        depth: row((depth.0, 0.0, depth.1)),
        toward: [toward.x as f32, toward.y as f32, toward.z as f32, 0.0],
    }
}

fn axes(l: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let x = if l.z.abs() < 0.99 { Vector3::z().cross(l) } else { Vector3::y().cross(l) }.normalize();
    (x, l.cross(&x))
}

/// Point `i` of the key light's unit disc: a golden-angle spiral, as `shaders/key.wgsl` walks it.
fn disc(i: usize) -> [f64; 2] {
    let r = ((i as f64 + 0.5) / KEY_LAYERS as f64).sqrt();
    let (s, c) = (i as f64 * TAU * 0.618_033_988_75).sin_cos();
    [r * c, r * s]
}

/// Direction `i` of the sky: a golden-angle spiral of equal solid angles.
fn sky(i: usize) -> Vector3<f64> {
    let z = (i as f64 + 0.5) / DOME_LAYERS as f64;
    let (s, c) = (i as f64 * TAU * 0.618_033_988_75).sin_cos();
    let r = (1.0 - z * z).sqrt();
    Vector3::new(r * c, r * s, z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_layer_holds_every_caster() {
        let casters: Vec<Point3<f32>> =
            (0..8).map(|i| Point3::new((i & 1) as f32, (i >> 1 & 1) as f32 * 0.4, (i >> 2) as f32 * 1.3)).collect();
        let lighting = Lighting::around(&casters, Studio::facing(&Vector3::x()));
        for layer in lighting.key.iter().chain(&lighting.dome) {
            for p in &casters {
                for row in [layer.u, layer.v, layer.depth] {
                    let at = row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3];
                    assert!((0.0..=1.0).contains(&at), "{at}");
                }
            }
        }
    }

    #[test]
    fn key_layers_are_shears_of_the_middle_one() {
        // what the shader relies on when it finds its way to a layer
        let casters = [Point3::new(0.0, 0.1, 0.0), Point3::new(0.7, -0.4, 1.1), Point3::new(-0.3, 0.2, 0.6)];
        let lighting = Lighting::around(&casters, Studio::facing(&Vector3::x()));
        let dot = |row: [f32; 4], p: &Point3<f32>| row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3];
        for (i, layer) in lighting.key.iter().enumerate() {
            for p in &casters {
                let depth = f64::from(dot(lighting.key_middle.depth, p));
                let rows = [(layer.u, lighting.key_middle.u), (layer.v, lighting.key_middle.v)];
                for (k, (row, middle)) in rows.into_iter().enumerate() {
                    let walked = f64::from(dot(middle, p)) + disc(i)[k] * lighting.key_shear[k] * (depth - 0.5);
                    assert!((f64::from(dot(row, p)) - walked).abs() < 1e-5);
                }
            }
        }
    }
}
