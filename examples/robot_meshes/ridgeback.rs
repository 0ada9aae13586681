//! The Ridgeback: a low body between four mecanum wheels, its deck, and the cabinet that carries the arm.
//!
//! Coordinates are those of the base's frame, which stands on the floor under its middle: x ahead, z up. Wheels are in their own
//! frames, the axle along y.
use nalgebra::{Point3, Rotation3, Vector3};

use crate::Mesh;
use crate::lathe::{band, lid, turn};
use crate::solid::at;

/// Half the length and half the width of the body, mm.
const HALF: [f64; 2] = [480.0, 396.5];
/// Distance of the axles from the middle and radius of a wheel, mm.
const AXLE: f64 = 319.0;
const RADIUS: f64 = 75.9;
/// Half the width of a wheel, mm.
const HALF_WIDTH: f64 = 39.5;
/// Rollers of a wheel.
const ROLLERS: usize = 10;
/// How far the body's corners are cut, and how far its sides lean in below, mm.
const CORNER: f64 = 100.0;
const LEAN: f64 = 62.0;

/// Every mesh of the base, by file name.
pub fn parts() -> Vec<(String, Mesh)> {
    let (y, z) = (Vector3::y(), Vector3::z());
    let o = at(0.0, 0.0, 0.0);
    let mut parts: Vec<(String, Mesh)> = Vec::new();
    let mut add = |name: &str, mesh: Mesh| parts.push((format!("ridgeback_{name}"), mesh));
    add("body", body());
    let belly = prism(&plan(462.0, 222.0, 30.0), 22.0, 150.0);
    add("trim", belly.with(prism(&plan(484.0, 400.5, CORNER), 206.0, 222.0)));
    let deck = prism(&plan(450.0, 368.0, 92.0), 244.0, 252.0);
    let riser = prism(&diamond(270.0), 246.0, 306.0);
    add("deck", deck.with(riser));
    let lights = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(sx, sy)| {
        let out = Vector3::new(sx, sy, 0.0).normalize();
        lid(20.0, 6.0, at(sx * 428.0, sy * 344.5, 182.0), out)
    });
    add("lights", lights.into_iter().fold(Mesh::default(), Mesh::with));
    add("cabinet", cabinet());
    add("cabinet_trim", cabinet_trim());
    add(
        "mount",
        turn(&[(0.0, 0.0), (150.0, 0.0), (150.0, 16.0), (147.0, 19.0), (0.0, 19.0)], at(120.0, 0.0, 712.0), z, 48),
    );
    let hub = turn(&[(0.0, -30.0), (34.0, -30.0), (34.0, 30.0), (0.0, 30.0)], o, y, 32);
    let plates = [-HALF_WIDTH, HALF_WIDTH - 4.0].map(|low| band(20.0, 60.0, low, low + 4.0, o, y));
    let [near, far] = plates;
    add("hub", hub.with(near).with(far));
    add("rollers_left", rollers(45f64.to_radians()));
    add("rollers_right", rollers(-45f64.to_radians()));
    parts
}

/// A rectangle of half sizes with its corners cut by `cut`, counter-clockwise seen from above.
fn plan(x: f64, y: f64, cut: f64) -> Vec<[f64; 2]> {
    vec![
        [x, -y + cut],
        [x, y - cut],
        [x - cut, y],
        [-x + cut, y],
        [-x, y - cut],
        [-x, -y + cut],
        [-x + cut, -y],
        [x - cut, -y],
    ]
}

/// A square on its corner.
fn diamond(half: f64) -> Vec<[f64; 2]> {
    vec![[half, 0.0], [0.0, half], [-half, 0.0], [0.0, -half]]
}

/// A convex outline raised from `low` to `high`.
fn prism(outline: &[[f64; 2]], low: f64, high: f64) -> Mesh {
    loft(&[
        outline.iter().map(|[x, y]| at(*x, *y, low)).collect(),
        outline.iter().map(|[x, y]| at(*x, *y, high)).collect(),
    ])
}

/// Rings of as many points each, joined one to the next and closed at both ends, which are convex.
fn loft(rings: &[Vec<Point3<f64>>]) -> Mesh {
    let n = rings[0].len() as u32;
    let mut mesh = Mesh { vertices: rings.iter().flatten().copied().collect(), triangles: Vec::new() };
    for ring in 0..rings.len() as u32 - 1 {
        for i in 0..n {
            let (a, b) = (ring * n + i, ring * n + (i + 1) % n);
            mesh.triangles.extend([[a, b, b + n], [a, b + n, a + n]]);
        }
    }
    let last = (rings.len() as u32 - 1) * n;
    for i in 1..n - 1 {
        mesh.triangles.extend([[0, i + 1, i], [last, last + i, last + i + 1]]);
    }
    mesh
}

/// The yellow body: sections across x, its underside arched over the wheels, its corners and upper edge cut.
fn body() -> Mesh {
    let arch = RADIUS + 22.0;
    let mut stations: Vec<f64> = vec![-HALF[0], HALF[0], -HALF[0] + CORNER, HALF[0] - CORNER];
    for side in [-1.0, 1.0] {
        stations.extend((0..=20).map(|i| side * AXLE + arch * (std::f64::consts::PI * f64::from(i) / 20.0).cos()));
    }
    stations.sort_by(f64::total_cmp);
    stations.dedup_by(|a, b| (*a - *b).abs() < 0.5);
    stations.retain(|x| x.abs() <= HALF[0]);
    let ring = |x: &f64| {
        let away = (x.abs() - AXLE).abs();
        let under = if away < arch { RADIUS + (arch * arch - away * away).sqrt() } else { 60.0 }.max(60.0);
        let half = HALF[1] - (x.abs() - (HALF[0] - CORNER)).max(0.0);
        let (top, cut, waist) = (246.0, 22.0, 150.0);
        let lean = |z: f64| LEAN * ((waist - z) / (waist - 60.0)).max(0.0);
        let edge = top - cut;
        vec![
            at(*x, -half + lean(under), under),
            at(*x, half - lean(under), under),
            at(*x, half, waist.max(under)),
            at(*x, half, edge),
            at(*x, half - cut, top),
            at(*x, -half + cut, top),
            at(*x, -half, edge),
            at(*x, -half, waist.max(under)),
        ]
    };
    loft(&stations.iter().map(ring).collect::<Vec<_>>())
}

/// The cabinet on the deck, with a chamfer round its top.
fn cabinet() -> Mesh {
    let outline = |inset: f64, z: f64| -> Vec<Point3<f64>> {
        plan(360.0 - inset, 280.0 - inset, 40.0).iter().map(|[x, y]| at(x - 60.0, *y, z)).collect()
    };
    loft(&[outline(0.0, 252.0), outline(0.0, 690.0), outline(22.0, 712.0)])
}

/// Seams, a handle and vents of the cabinet.
fn cabinet_trim() -> Mesh {
    let slab = |low: [f64; 3], high: [f64; 3]| {
        let outline = [[high[0], low[1]], [high[0], high[1]], [low[0], high[1]], [low[0], low[1]]];
        prism(&outline, low[2], high[2])
    };
    let mut trim = slab([-424.0, -242.0, 300.0], [304.0, 242.0, 308.0]);
    for side in [-1.0, 1.0] {
        let y = 280.0 * side;
        trim = trim.with(slab([-64.0, y - 3.0, 312.0], [-58.0, y + 3.0, 680.0]));
        for i in 0..6 {
            let z = 560.0 + 18.0 * f64::from(i);
            trim = trim.with(slab([-340.0, y - 3.0, z], [-160.0, y + 3.0, z + 8.0]));
        }
    }
    trim
}

/// The rollers of a wheel: barrels whose outline keeps to the wheel's circle, each turned by `angle` out of the axle's direction.
fn rollers(angle: f64) -> Mesh {
    let (ring, count) = (RADIUS - 15.5, ROLLERS as f64);
    let half = HALF_WIDTH / angle.cos().abs() * 0.94;
    let profile: Vec<(f64, f64)> = (0..=6)
        .map(|i| {
            let along = half * (f64::from(i) / 3.0 - 1.0);
            // seen along the axle, a point of the roller's axis is this far off the wheel's
            let off = ring.hypot(along * angle.sin());
            ((RADIUS - off).max(4.0), along)
        })
        .collect();
    let closed: Vec<(f64, f64)> = [(0.0, -half)].into_iter().chain(profile).chain([(0.0, half)]).collect();
    let mut mesh = Mesh::default();
    for i in 0..ROLLERS {
        let about = Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::TAU * i as f64 / count);
        let axis = about * Vector3::new(angle.sin(), angle.cos(), 0.0);
        let centre = Point3::from(about * Vector3::new(0.0, 0.0, ring));
        mesh = mesh.with(turn(&closed, centre, axis, 10));
    }
    mesh
}
