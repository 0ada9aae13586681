//! Random relief: a surface pushed in and out along its normals by a smooth random field.
use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Unit, Vector3};
use rand_chacha::rand_core::Rng;

use super::crease::CreaseDistance;
use super::hausdorff::hausdorff;
use super::{MeshError, TriMesh};
use crate::math;

/// Plane waves of a field: their sum is near to Gaussian.
const WAVES: usize = 64;
/// The relief has faded away at a sharp edge and is whole at this share of the wavelength from it, so that the faces of an edge don't
/// cut into each other.
const FADE: f64 = 0.25;
/// Cosine, to the direction from which a surface is looked at, at and below which it keeps its place, and from which on it has all
/// of the relief.
const FACING: [f64; 2] = [0.0, 0.35];
/// Relative error of the distance between rough and smooth surface at which the amplitude is right.
const CLOSE: f64 = 2e-3;
/// Amplitudes that are tried.
const TRIES: usize = 12;
/// Triangles have at least so many to a wavelength along an edge, so that the relief has a shape.
const EDGES_A_WAVE: f64 = 8.0;
/// A mesh isn't made finer than this for it.
const MAX_TRIANGLES: usize = 400_000;

/// A smooth random function of space, of mean 0 and variance 1 over its seeds, that knows no triangles: `sqrt(2 / N)` times the sum of
/// `cos(k x + phi)` over `N` waves of random directions and phases (spectral sampling of a Gaussian field; Shinozuka and Deodatis
/// 1991, doi:10.1115/1.3119501). Wavelengths are spread evenly, by wave number, from the given one to twice as long.
#[derive(Clone, Debug)]
pub struct RandomField {
    waves: Vec<(Vector3<f64>, f64)>,
}

impl RandomField {
    /// Draws a field whose shortest wave is `wavelength`, m.
    pub fn new(wavelength: f64, random: &mut impl Rng) -> Self {
        let mut unit = || math::unit(random);
        let waves = (0..WAVES).map(|_| {
            // a direction, evenly over the sphere (Archimedes)
            let (z, turn) = (2.0 * unit() - 1.0, TAU * unit());
            let r = (1.0 - z * z).max(0.0).sqrt();
            let k = PI / wavelength * (1.0 + unit());
            (Vector3::new(r * turn.cos(), r * turn.sin(), z) * k, TAU * unit())
        });
        Self { waves: waves.collect() }
    }

    /// The field at a point, m.
    pub fn at(&self, p: &Point3<f64>) -> f64 {
        let sum: f64 = self.waves.iter().map(|(k, phase)| (k.dot(&p.coords) + phase).cos()).sum();
        sum * (2.0 / WAVES as f64).sqrt()
    }
}

/// Why a surface can't be given a relief.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReliefError {
    /// The amplitude that is asked for folds the surface.
    #[error(
        "a relief of {distance_mm:.1} mm in waves of {wavelength_mm:.0} mm folds the surface; make it lower or its waves longer"
    )]
    Folded {
        /// Distance asked for, mm.
        distance_mm: f64,
        /// Shortest wave, mm.
        wavelength_mm: f64,
    },
    /// No part of the surface is far enough from sharp edges, or none faces the artist.
    #[error("the surface has no smooth part that faces the sheet, so it can have no relief")]
    NoRoom,
    /// The rough mesh is no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// The mesh with a random relief, so deep that the two-sided Hausdorff distance from the smooth one is `distance` (m) to within half a
/// per cent; and that distance as measured, m.
///
/// Every vertex moves along its smooth normal by the field at its place (relative to the middle of the mesh's bounds, axes of its
/// frame), which is scaled until the measured distance is right. Only what faces `outward` (unit) gets a relief, and it fades
/// towards sharp edges and turns of the surface. Coarse meshes are made finer first: relief needs triangles.
///
/// # Errors
/// A relief so deep and so short-waved that the surface folds, and a surface without room for one.
pub fn rough(
    mesh: &TriMesh,
    field: &RandomField,
    wavelength: f64,
    distance: f64,
    outward: &Unit<Vector3<f64>>,
) -> Result<(TriMesh, f64), ReliefError> {
    let fine = refined(mesh, wavelength / EDGES_A_WAVE)?;
    let (low, high) = mesh.bounds();
    let middle = nalgebra::center(&low, &high).coords;
    let creases = CreaseDistance::new(&fine);
    let mut shape: Vec<Vector3<f64>> = Vec::with_capacity(fine.vertices().len());
    let mut largest = 0.0f64;
    for (p, n) in fine.vertices().iter().zip(fine.vertex_normals()) {
        let [back, front] = FACING;
        let weight = smooth_step((n.dot(outward) - back) / (front - back));
        let weight = if weight > 0.0 { weight * smooth_step(creases.at(p) / (FADE * wavelength)) } else { 0.0 };
        let height = if weight > 0.0 { weight * field.at(&(p - middle)) } else { 0.0 };
        largest = largest.max(height.abs());
        shape.push(n * height);
    }
    if largest <= 0.0 {
        return Err(ReliefError::NoRoom);
    }
    let mut scale = distance / largest;
    let mut best: Option<(TriMesh, f64)> = None;
    for _ in 0..TRIES {
        let moved: Vec<Point3<f64>> = fine.vertices().iter().zip(&shape).map(|(p, d)| p + d * scale).collect();
        let rough = TriMesh::new(moved, fine.triangles().to_vec())?;
        let measured = hausdorff(&rough, mesh);
        if measured.is_nan() || measured <= 0.0 {
            return Err(ReliefError::NoRoom);
        }
        let off = |m: f64| (m / distance - 1.0).abs();
        if best.as_ref().is_none_or(|(_, b)| off(measured) < off(*b)) {
            best = Some((rough, measured));
        }
        if off(measured) < CLOSE {
            break;
        }
        // the distance grows nearly in proportion to the amplitude
        scale *= distance / measured;
    }
    let (wavelength_mm, distance_mm) = (wavelength * 1e3, distance * 1e3);
    let folded = ReliefError::Folded { wavelength_mm, distance_mm };
    let Some((rough, measured)) = best else { return Err(folded) };
    let folds = rough.triangles().len() != fine.triangles().len()
        || rough.face_normals().iter().zip(fine.face_normals()).any(|(a, b)| a.dot(b) < 0.2);
    if folds || (measured / distance - 1.0).abs() > 5e-3 {
        return Err(folded);
    }
    Ok((rough, measured))
}

/// A round dent, or a bump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dent {
    /// Its middle, m, in the mesh's frame.
    pub middle: Point3<f64>,
    /// Depth at the middle, m; a bump's is below 0.
    pub depth: f64,
    /// Radius at which the surface is as it was, m.
    pub radius: f64,
}

/// The mesh with dents: every vertex sinks along its smooth normal by `depth (1 - (r / radius)^2)^2` of the dent that is deepest
/// there. Dents fade at sharp edges as a relief does. Coarse meshes are made finer first.
pub fn dented(mesh: &TriMesh, dents: &[Dent]) -> Result<TriMesh, MeshError> {
    let narrowest = dents.iter().map(|d| d.radius).fold(f64::INFINITY, f64::min);
    if !narrowest.is_finite() {
        return Ok(mesh.clone());
    }
    let fine = refined(mesh, narrowest / 3.0)?;
    let creases = CreaseDistance::new(&fine);
    let sink = |p: &Point3<f64>| {
        let mut deepest = 0.0f64;
        for dent in dents {
            let share = (1.0 - (p - dent.middle).norm_squared() / dent.radius.powi(2)).max(0.0);
            let depth = dent.depth * share * share;
            deepest = if depth.abs() > deepest.abs() { depth } else { deepest };
        }
        if deepest == 0.0 { 0.0 } else { deepest * smooth_step(creases.at(p) / narrowest) }
    };
    let moved = fine.vertices().iter().zip(fine.vertex_normals()).map(|(p, n)| p - n * sink(p)).collect();
    TriMesh::new(moved, fine.triangles().to_vec())
}

/// 0 below 0, 1 above 1, with no kink between (`3 x^2 - 2 x^3`).
fn smooth_step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// The mesh with every triangle cut in four until no edge is longer than `edge` (m), or there are too many.
fn refined(mesh: &TriMesh, edge: f64) -> Result<TriMesh, MeshError> {
    let mut fine = mesh.clone();
    loop {
        let length = |i: u32, j: u32| (fine.vertices()[i as usize] - fine.vertices()[j as usize]).norm();
        let longest = fine
            .triangles()
            .iter()
            .map(|t| length(t[0], t[1]).max(length(t[1], t[2])).max(length(t[2], t[0])))
            .fold(0.0, f64::max);
        if longest <= edge || 4 * fine.triangles().len() > MAX_TRIANGLES {
            return Ok(fine);
        }
        let mut vertices = fine.vertices().to_vec();
        let mut edges: Vec<[u32; 2]> = Vec::with_capacity(3 * fine.triangles().len());
        let ordered = |i: u32, j: u32| [i.min(j), i.max(j)];
        for t in fine.triangles() {
            edges.extend([ordered(t[0], t[1]), ordered(t[1], t[2]), ordered(t[2], t[0])]);
        }
        edges.sort_unstable();
        edges.dedup();
        let first = vertices.len() as u32;
        for [i, j] in &edges {
            vertices.push(nalgebra::center(&vertices[*i as usize], &vertices[*j as usize]));
        }
        let middle = |i: u32, j: u32| first + edges.binary_search(&ordered(i, j)).unwrap_or(0) as u32;
        let mut triangles = Vec::with_capacity(4 * fine.triangles().len());
        for &[a, b, c] in fine.triangles() {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        fine = TriMesh::new(vertices, triangles)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::stream;
    use crate::mesh::shapes::{self, Bumps};

    fn field(seed: u64, wavelength: f64) -> RandomField {
        RandomField::new(wavelength, &mut stream(seed, "relief", 0))
    }

    #[test]
    fn a_field_has_mean_nought_and_variance_one_over_its_seeds() {
        let values: Vec<f64> = (0..2000).map(|s| field(s, 0.1).at(&Point3::new(0.3, -0.2, 0.1))).collect();
        let mean = values.iter().sum::<f64>() / 2000.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 2000.0;
        assert!(mean.abs() < 0.08 && (variance - 1.0).abs() < 0.12, "{mean} {variance}");
    }

    #[test]
    fn the_distance_is_the_prescribed_one_on_every_shape() {
        let bumps = Bumps { amplitude: 0.006, wavelength: 0.14 };
        let x = -Vector3::x_axis();
        for (name, mesh, outward) in [
            ("dome", shapes::dome(0.15, 0.006).unwrap(), Vector3::z_axis()),
            ("column", shapes::column(0.28, 0.8, &bumps, 0.02).unwrap(), x),
            ("sheet", shapes::rectangle(0.4, 0.5, 0.0, 0.01).unwrap(), Vector3::z_axis()),
            ("slab", shapes::rectangle(0.4, 0.5, 0.02, 0.3).unwrap(), Vector3::z_axis()),
        ] {
            let (low, high) = mesh.bounds();
            let size = (high - low).max();
            for (seed, share) in [(1, 0.035), (2, 0.01)] {
                let (rough, measured) =
                    rough(&mesh, &field(seed, size / 2.0), size / 2.0, share * size, &outward).unwrap();
                assert!((measured / (share * size) - 1.0).abs() < 0.01, "{name}: {measured}");
                assert!((hausdorff(&mesh, &rough) - measured).abs() < 1e-12, "{name}");
            }
        }
    }

    #[test]
    fn the_relief_is_the_same_on_finer_triangles() {
        let [coarse, fine] = [0.008, 0.003].map(|t| {
            let dome = shapes::dome(0.15, t).unwrap();
            rough(&dome, &field(5, 0.15), 0.15, 0.01, &Vector3::z_axis()).unwrap().0
        });
        let d = hausdorff(&coarse, &fine);
        assert!(d < 3e-4, "{d} m of 10 mm");
    }

    #[test]
    fn sharp_edges_and_what_faces_away_stay_where_they_are_and_seams_stay_shut() {
        let dome = shapes::dome(0.15, 0.006).unwrap();
        let (rough, _) = rough(&dome, &field(3, 0.15), 0.15, 0.0105, &Vector3::z_axis()).unwrap();
        assert_eq!(rough.triangles().len(), dome.triangles().len());
        for p in dome.vertices().iter().filter(|p| p.z <= 1e-9) {
            let off = (rough.closest_point(p).position - p).norm();
            assert!(off < 1e-6, "{p} has moved by {off}");
        }
        // volume of a closed surface is the same from any origin: nothing gapes
        let shifted = rough.transformed(&crate::math::Pose::translation(1.0, 2.0, 3.0));
        assert!((shifted.signed_volume() / rough.signed_volume() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_dent_is_as_deep_and_as_wide_as_asked() {
        let dome = shapes::dome(0.15, 0.005).unwrap();
        let top = Point3::new(0.0, 0.0, 0.15);
        let hollow = dented(&dome, &[Dent { middle: top, depth: 0.004, radius: 0.03 }]).unwrap();
        assert!((hausdorff(&dome, &hollow) - 0.004).abs() < 5e-5);
        let moved = dome.vertices().iter().zip(hollow.vertices()).filter(|(p, q)| p != q);
        assert!(moved.map(|(p, _)| (p - top).norm()).all(|r| r < 0.03));
        let bump = dented(&dome, &[Dent { middle: top, depth: -0.004, radius: 0.03 }]).unwrap();
        assert!((bump.bounds().1.z - 0.154).abs() < 1e-9);
    }

    #[test]
    fn a_relief_that_folds_is_refused() {
        let dome = shapes::dome(0.15, 0.006).unwrap();
        let e = rough(&dome, &field(1, 0.02), 0.02, 0.06, &Vector3::z_axis()).map(|r| r.1).unwrap_err();
        assert!(matches!(e, ReliefError::Folded { .. }), "{e}");
    }
}
