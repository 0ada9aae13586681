//! Solids of revolution.
use nalgebra::{Point3, Vector3};

use crate::Mesh;

/// Turns a profile of (radius, height) pairs, mm, about the axis through `origin` along `axis` (unit), in `segments`
/// steps. Heights run along the axis; the profile goes from low to high on the outside, so that triangles face out.
/// Corners of the profile stay sharp when shaded if they bend by more than 40 degrees.
pub fn turn(profile: &[(f64, f64)], origin: Point3<f64>, axis: Vector3<f64>, segments: u32) -> Mesh {
    let x = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let x = (x - axis * axis.dot(&x)).normalize();
    let y = axis.cross(&x);
    let mut mesh = Mesh::default();
    let mut rings: Vec<Vec<u32>> = Vec::new();
    for (radius, height) in profile {
        let n = if *radius < 1e-9 { 1 } else { segments };
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend((0..n).map(|i| {
            let (s, c) = (std::f64::consts::TAU * f64::from(i) / f64::from(segments)).sin_cos();
            origin + axis * *height + (x * c + y * s) * *radius
        }));
        rings.push((0..segments).map(|i| first + if n == 1 { 0 } else { i }).collect());
    }
    for pair in rings.windows(2) {
        let (low, high) = (&pair[0], &pair[1]);
        for i in 0..segments as usize {
            let j = (i + 1) % segments as usize;
            let quads = [[low[i], low[j], high[j]], [low[i], high[j], high[i]]];
            mesh.triangles.extend(quads.into_iter().filter(|[a, b, c]| a != b && b != c && c != a));
        }
    }
    mesh
}

/// A band of rectangular section: radii `inner`..`outer`, heights `low`..`high`.
pub fn band(inner: f64, outer: f64, low: f64, high: f64, origin: Point3<f64>, axis: Vector3<f64>) -> Mesh {
    turn(&[(inner, low), (outer, low), (outer, high), (inner, high)], origin, axis, 32)
}

/// A slightly domed lid of `radius` that stands `height` proud of `origin` along `axis`.
pub fn lid(radius: f64, height: f64, origin: Point3<f64>, axis: Vector3<f64>) -> Mesh {
    let edge = (height * 0.5).min(4.0);
    let profile = [
        (radius, -8.0),
        (radius, height - edge),
        (radius - edge * 0.3, height - edge * 0.3),
        (radius - edge, height),
        (0.0, height + radius * 0.04),
    ];
    turn(&profile, origin, axis, 32)
}
