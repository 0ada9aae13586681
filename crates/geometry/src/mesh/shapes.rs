//! Generated shapes of well-shaped triangles of a desired size.
//!
//! The contact force that the twin computes is only as smooth as the triangles it rests on, so round shapes are built
//! from rings whose number of points follows their circumference: triangles stay near equilateral up to the poles.
//! Every shape is closed and winds outward, except the bare [`rectangle`].
use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Point3, Vector3};

use super::{MeshError, TriMesh};

/// Largest number of triangles that a shape may be asked for.
const MAX_TRIANGLES: f64 = 4e6;

/// A bumpy skin: how far a wall stands out (or in) from its mean radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bumps {
    /// Largest height over the mean radius, m.
    pub amplitude: f64,
    /// Distance from one bump to the next, m.
    pub wavelength: f64,
}

impl Bumps {
    /// Height, in `[-1, 1]` amplitudes, at angle `theta` (rad) and height `z` (m) of a wall of the given radius.
    ///
    /// Three waves whose weights sum to 1 and whose vertical lengths are not multiples of one another, so that the
    /// pattern does not repeat; whole numbers of waves go round.
    fn height(&self, radius: f64, theta: f64, z: f64) -> f64 {
        let waves = (TAU * radius / self.wavelength).round().max(1.0);
        let k = TAU / self.wavelength;
        0.5 * (waves * theta + 0.3).sin() * (0.9 * k * z + 1.1).sin()
            + 0.3 * ((waves + 1.0) * theta - 0.62 * k * z + 2.0).sin()
            + 0.2 * ((0.6 * waves).round() * theta + 0.47 * k * z).sin()
    }
}

/// A rectangle in the x-y plane, centred, facing +z; with a `thickness` above 0, a slab whose top face it is. Metres.
pub fn rectangle(width: f64, height: f64, thickness: f64, triangle_size: f64) -> Result<TriMesh, MeshError> {
    positive("width", width)?;
    positive("height", height)?;
    positive("triangle size", triangle_size)?;
    if thickness != 0.0 {
        let slab = cuboid(&Vector3::new(width, height, thickness), triangle_size)?;
        return Ok(slab.transformed(&nalgebra::Translation3::new(0.0, 0.0, -thickness / 2.0).into()));
    }
    limit(2.0 * (width / triangle_size + 1.0) * (height / triangle_size + 1.0))?;
    let (nx, ny) = (steps(width, triangle_size), steps(height, triangle_size));
    let mut vertices = Vec::with_capacity((nx + 1) * (ny + 1));
    for j in 0..=ny {
        for i in 0..=nx {
            let (u, v) = (i as f64 / nx as f64 - 0.5, j as f64 / ny as f64 - 0.5);
            vertices.push(Point3::new(u * width, v * height, 0.0));
        }
    }
    let mut triangles = Vec::with_capacity(2 * nx * ny);
    grid(nx, ny, |i, j| (j * (nx + 1) + i) as u32, &mut triangles);
    TriMesh::new(vertices, triangles)
}

/// A box, centred, edge lengths `size` (m) along x, y and z.
pub fn cuboid(size: &Vector3<f64>, triangle_size: f64) -> Result<TriMesh, MeshError> {
    positive("size along x", size.x)?;
    positive("size along y", size.y)?;
    positive("size along z", size.z)?;
    positive("triangle size", triangle_size)?;
    let cells = size.map(|s| s / triangle_size + 1.0);
    limit(4.0 * (cells.x * cells.y + cells.y * cells.z + cells.z * cells.x))?;
    let n = size.map(|s| steps(s, triangle_size));
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    // Faces don't share vertices: their edges are creases, where the mesh would split them anyway. Neighbouring faces
    // have the same points on their common edge, so nothing gapes.
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [-0.5, 0.5] {
            let first = vertices.len();
            for j in 0..=n[v] {
                for i in 0..=n[u] {
                    let mut p = Point3::origin();
                    p[axis] = side * size[axis];
                    p[u] = (i as f64 / n[u] as f64 - 0.5) * size[u];
                    p[v] = (j as f64 / n[v] as f64 - 0.5) * size[v];
                    vertices.push(p);
                }
            }
            let from = triangles.len();
            grid(n[u], n[v], |i, j| (first + j * (n[u] + 1) + i) as u32, &mut triangles);
            if side < 0.0 {
                triangles[from..].iter_mut().for_each(|t| t.swap(1, 2));
            }
        }
    }
    TriMesh::new(vertices, triangles)
}

/// A dome: the upper half (z >= 0) of a sphere about the origin, on a flat base. Metres.
pub fn dome(radius: f64, triangle_size: f64) -> Result<TriMesh, MeshError> {
    positive("radius", radius)?;
    let mut profile = Profile::new(triangle_size)?;
    profile.line_to(radius, 0.0);
    profile.arc(0.0, radius, 0.0, FRAC_PI_2);
    profile.revolve(|r, _, _| r)
}

/// A sphere about the origin. Metres.
pub fn sphere(radius: f64, triangle_size: f64) -> Result<TriMesh, MeshError> {
    positive("radius", radius)?;
    let mut profile = Profile::new(triangle_size)?;
    profile.arc(0.0, radius, -FRAC_PI_2, FRAC_PI_2);
    profile.revolve(|r, _, _| r)
}

/// A cylinder about the z axis from z = 0 to `height`. Metres.
pub fn cylinder(radius: f64, height: f64, triangle_size: f64) -> Result<TriMesh, MeshError> {
    frustum(radius, radius, height, triangle_size)
}

/// A cone about the z axis, cut off at the top: `bottom_radius` at z = 0, `top_radius` at z = `height`. Metres.
pub fn frustum(bottom_radius: f64, top_radius: f64, height: f64, triangle_size: f64) -> Result<TriMesh, MeshError> {
    positive("bottom radius", bottom_radius)?;
    positive("top radius", top_radius)?;
    positive("height", height)?;
    let mut profile = Profile::new(triangle_size)?;
    profile.line_to(bottom_radius, 0.0);
    profile.line_to(top_radius, height);
    profile.line_to(0.0, height);
    profile.revolve(|r, _, _| r)
}

/// A circular column about the z axis from z = 0 to `height`, whose wall has smooth bumps. Metres.
pub fn column(radius: f64, height: f64, bumps: &Bumps, triangle_size: f64) -> Result<TriMesh, MeshError> {
    positive("radius", radius)?;
    positive("height", height)?;
    positive("bump wavelength", bumps.wavelength)?;
    if !(0.0..radius / 2.0).contains(&bumps.amplitude) {
        return Err(MeshError::BadSize { name: "bump amplitude", value: bumps.amplitude });
    }
    let mut profile = Profile::new(triangle_size)?;
    profile.line_to(radius, 0.0);
    profile.line_to(radius, height);
    profile.line_to(0.0, height);
    // The end faces stretch along with the wall.
    profile.revolve(|r, theta, z| r * (1.0 + bumps.amplitude / radius * bumps.height(radius, theta, z)))
}

/// A bucket about the z axis, open at the top, its bottom at z = 0: a tapered wall of the given thickness, with a rim
/// that stands out by the thickness. Metres.
pub fn bucket(
    bottom_radius: f64,
    top_radius: f64,
    height: f64,
    wall: f64,
    triangle_size: f64,
) -> Result<TriMesh, MeshError> {
    positive("bottom radius", bottom_radius)?;
    positive("top radius", top_radius)?;
    positive("height", height)?;
    positive("wall", wall)?;
    let rim = 2.0 * wall;
    if wall >= bottom_radius.min(top_radius) / 2.0 || wall >= height / 4.0 {
        return Err(MeshError::BadSize { name: "wall", value: wall });
    }
    let mut profile = Profile::new(triangle_size)?;
    profile.line_to(bottom_radius, 0.0);
    profile.line_to(top_radius, height - rim);
    profile.line_to(top_radius + wall, height - rim);
    profile.line_to(top_radius + wall, height);
    profile.line_to(top_radius - wall, height);
    profile.line_to(bottom_radius - wall, wall);
    profile.line_to(0.0, wall);
    profile.revolve(|r, _, _| r)
}

/// A capsule about the z axis, centred: all points within `radius` of a segment of the given `length` (>= 0). Metres.
pub fn capsule(radius: f64, length: f64, triangle_size: f64) -> Result<TriMesh, MeshError> {
    positive("radius", radius)?;
    if !(0.0..=f64::MAX).contains(&length) {
        return Err(MeshError::BadSize { name: "length", value: length });
    }
    let mut profile = Profile::new(triangle_size)?;
    profile.arc(-length / 2.0, radius, -FRAC_PI_2, 0.0);
    profile.line_to(radius, length / 2.0);
    profile.arc(length / 2.0, radius, 0.0, FRAC_PI_2);
    profile.revolve(|r, _, _| r)
}

/// A half-section of a solid of revolution: points (r, z) from the axis at the bottom, outside round, to the axis at the top.
struct Profile {
    triangle_size: f64,
    points: Vec<(f64, f64)>,
    triangles: f64,
}

impl Profile {
    fn new(triangle_size: f64) -> Result<Self, MeshError> {
        positive("triangle size", triangle_size)?;
        Ok(Self { triangle_size, points: vec![], triangles: 0.0 })
    }

    /// Rows are as far apart as equilateral triangles are high.
    fn rows(&mut self, length: f64, largest_radius: f64) -> usize {
        let row = self.triangle_size * 3f64.sqrt() / 2.0;
        self.triangles += (length / row + 1.0) * 2.0 * (TAU * largest_radius / self.triangle_size + 6.0);
        if self.triangles > MAX_TRIANGLES { 1 } else { steps(length, row) }
    }

    /// A straight piece; the first starts on the axis at the height of its end.
    fn line_to(&mut self, r: f64, z: f64) {
        if self.points.is_empty() {
            self.points.push((0.0, z));
        }
        let (r0, z0) = self.points[self.points.len() - 1];
        let length = (r - r0).hypot(z - z0);
        if length == 0.0 {
            return;
        }
        let n = self.rows(length, r.max(r0));
        self.points.extend((1..=n).map(|i| {
            let t = i as f64 / n as f64;
            (r0 + (r - r0) * t, z0 + (z - z0) * t)
        }));
    }

    /// An arc about (0, `center`) from elevation `from` to `to`, rad.
    fn arc(&mut self, center: f64, radius: f64, from: f64, to: f64) {
        let n = self.rows(radius * (to - from), radius);
        let skip = usize::from(!self.points.is_empty());
        self.points.extend((skip..=n).map(|i| {
            let angle = from + (to - from) * i as f64 / n as f64;
            // The cosine at a pole is 6e-17, not 0.
            (if angle.abs() == FRAC_PI_2 { 0.0 } else { radius * angle.cos() }, center + radius * angle.sin())
        }));
    }

    /// Sweeps the profile round the z axis; `radius_at(r, theta, z)` may move the wall in and out.
    fn revolve(&self, radius_at: impl Fn(f64, f64, f64) -> f64) -> Result<TriMesh, MeshError> {
        limit(self.triangles)?;
        let mut vertices = Vec::new();
        let mut triangles = Vec::new();
        let mut below: Option<(usize, usize)> = None;
        for &(r, z) in &self.points {
            let first = vertices.len();
            let count = ring_count(r, self.triangle_size);
            vertices.extend((0..count).map(|i| {
                let theta = TAU * i as f64 / count as f64;
                let r = radius_at(r, theta, z);
                Point3::new(r * theta.cos(), r * theta.sin(), z)
            }));
            if let Some(below) = below {
                zip_rings(below, (first, count), &mut triangles);
            }
            below = Some((first, count));
        }
        TriMesh::new(vertices, triangles)
    }
}

/// Points on a ring of radius `r`: 1 on the axis, else the multiple of six that comes nearest to the desired spacing.
fn ring_count(r: f64, triangle_size: f64) -> usize {
    if r == 0.0 { 1 } else { 6 * (TAU * r / (6.0 * triangle_size)).round().max(1.0) as usize }
}

/// Joins ring `a` (first vertex, count) to ring `b` above it, always advancing on the ring that lags behind in angle.
fn zip_rings(a: (usize, usize), b: (usize, usize), triangles: &mut Vec<[u32; 3]>) {
    let vertex = |(first, count): (usize, usize), i: usize| (first + i % count) as u32;
    let (mut i, mut j) = (0, 0);
    // A ring of one point is a pole: it has no edges of its own.
    let (na, nb) = (if a.1 == 1 { 0 } else { a.1 }, if b.1 == 1 { 0 } else { b.1 });
    while i < na || j < nb {
        let advance_a = i < na && (j == nb || (2 * i + 1) * nb <= (2 * j + 1) * na);
        if advance_a {
            triangles.push([vertex(a, i), vertex(a, i + 1), vertex(b, j)]);
            i += 1;
        } else {
            triangles.push([vertex(a, i), vertex(b, j + 1), vertex(b, j)]);
            j += 1;
        }
    }
}

/// Two triangles a cell, with diagonals that alternate so that no direction is favoured.
fn grid(nx: usize, ny: usize, vertex: impl Fn(usize, usize) -> u32, triangles: &mut Vec<[u32; 3]>) {
    for j in 0..ny {
        for i in 0..nx {
            let (a, b, c, d) = (vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1));
            triangles.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
}

fn steps(length: f64, step: f64) -> usize {
    (length / step).ceil().max(1.0) as usize
}

fn positive(name: &'static str, value: f64) -> Result<(), MeshError> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(MeshError::BadSize { name, value }) }
}

fn limit(triangles: f64) -> Result<(), MeshError> {
    if triangles <= MAX_TRIANGLES { Ok(()) } else { Err(MeshError::TooFine { triangles, max: MAX_TRIANGLES }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Every directed edge between positions has exactly one partner in the other direction.
    fn is_watertight(mesh: &TriMesh) -> bool {
        let key = |v: u32| mesh.vertices()[v as usize].coords.map(|c| (c * 1e7).round() as i64);
        let mut edges = BTreeMap::new();
        for t in mesh.triangles() {
            for k in 0..3 {
                let (a, b) = (key(t[k]), key(t[(k + 1) % 3]));
                let (a, b) = ((a.x, a.y, a.z), (b.x, b.y, b.z));
                *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { 1000 };
            }
        }
        edges.values().all(|&n| n == 1001)
    }

    /// Smallest interior angle, rad.
    fn sharpest_angle(mesh: &TriMesh) -> f64 {
        let angles = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| mesh.vertices()[i as usize]);
            (b - a).angle(&(c - a)).min((a - b).angle(&(c - b))).min((a - c).angle(&(b - c)))
        };
        mesh.triangles().iter().map(angles).fold(f64::INFINITY, f64::min)
    }

    fn closed_shapes() -> Vec<(&'static str, TriMesh, f64)> {
        use std::f64::consts::PI;
        let third = PI / 3.0;
        let cone = third * 0.5 * (0.14f64.powi(2) + 0.14 * 0.03 + 0.03f64.powi(2));
        let bumps = Bumps { amplitude: 0.008, wavelength: 0.15 };
        vec![
            ("slab", rectangle(0.3, 0.4, 0.02, 0.005).unwrap(), 0.3 * 0.4 * 0.02),
            ("cuboid", cuboid(&Vector3::new(0.1, 0.2, 0.3), 0.02).unwrap(), 0.006),
            ("dome", dome(0.15, 0.005).unwrap(), 2.0 * third * 0.15f64.powi(3)),
            ("sphere", sphere(0.05, 0.003).unwrap(), 4.0 * third * 0.05f64.powi(3)),
            ("cylinder", cylinder(0.1, 0.3, 0.005).unwrap(), PI * 0.01 * 0.3),
            ("frustum", frustum(0.14, 0.03, 0.5, 0.005).unwrap(), cone),
            ("column", column(0.28, 0.6, &bumps, 0.01).unwrap(), PI * 0.28f64.powi(2) * 0.6),
            ("capsule", capsule(0.05, 0.2, 0.004).unwrap(), 4.0 * third * 0.05f64.powi(3) + PI * 0.05f64.powi(2) * 0.2),
        ]
    }

    #[test]
    fn closed_shapes_are_watertight_outward_and_of_the_right_volume() {
        for (name, mesh, volume) in closed_shapes() {
            assert!(is_watertight(&mesh), "{name} gapes");
            assert!((mesh.signed_volume() / volume - 1.0).abs() < 0.01, "{name}: {} {volume}", mesh.signed_volume());
        }
        let bucket = bucket(0.1, 0.14, 0.3, 0.003, 0.005).unwrap();
        assert!(is_watertight(&bucket) && bucket.signed_volume() > 0.0);
    }

    #[test]
    fn triangles_are_near_the_desired_size_and_never_slivers() {
        for (name, mesh, size) in [
            ("dome", dome(0.15, 0.005).unwrap(), 0.005),
            ("capsule", capsule(0.05, 0.2, 0.004).unwrap(), 0.004),
            ("frustum", frustum(0.14, 0.03, 0.5, 0.005).unwrap(), 0.005),
            ("plane", rectangle(0.3, 0.3, 0.0, 0.005).unwrap(), 0.005),
        ] {
            let angle = sharpest_angle(&mesh).to_degrees();
            assert!(angle > 25.0, "{name}: {angle} degrees");
            let mean = mesh.area() / mesh.triangles().len() as f64 / (size * size);
            assert!((0.3..0.6).contains(&mean), "{name}: mean area {mean} squares");
        }
    }

    #[test]
    fn normals_of_a_dome_are_radial() {
        let mesh = dome(0.15, 0.005).unwrap();
        for t in 0..mesh.triangles().len() as u32 {
            let s = mesh.point_at(t, [0.2, 0.5, 0.3]);
            if s.position.z > 0.01 {
                let radial = s.position.coords.normalize();
                assert!(s.normal.angle(&radial) < 0.01, "{} at {}", s.normal.angle(&radial), s.position);
                assert!((s.position.coords.norm() - 0.15).abs() < 5e-5);
            }
        }
    }

    #[test]
    fn sizes_without_sense_are_refused() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(dome(bad, 0.01).is_err() && dome(1.0, bad).is_err());
            assert!(cylinder(0.1, bad, 0.01).is_err() && rectangle(bad, 1.0, 0.0, 0.1).is_err());
            assert!(cuboid(&Vector3::new(1.0, bad, 1.0), 0.1).is_err());
            assert!(column(0.2, 0.5, &Bumps { amplitude: 0.01, wavelength: bad }, 0.01).is_err());
        }
        assert!(matches!(dome(1.0, 1e-9), Err(MeshError::TooFine { .. })));
        assert!(matches!(cuboid(&Vector3::new(1.0, 1.0, 1.0), 1e-9), Err(MeshError::TooFine { .. })));
        assert!(bucket(0.1, 0.1, 0.1, 0.2, 0.01).is_err());
    }
}
