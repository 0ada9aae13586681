//! What a robot must take for granted where nothing was scanned.
use nalgebra::{Point3, Vector3};

use crate::mesh::{MeshError, TriMesh};
use crate::surface::SheetFrame;

/// Steepest rise of a skirt, m per m.
const STEEPEST: f64 = 1.0;
/// Radius of the neighbourhood whose slope counts, m: normals at the border are noisy.
const ROUND: f64 = 0.06;

/// A skirt of `width` (m) round the outer border of a scanned canvas: the surface as it might go on beyond the scan. It rises as
/// the border does, and where the border falls away it stays level with the sheet, so that what falls away faster than it
/// seems to, or not at all, is still under it. `None` for a closed surface.
///
/// # Errors
/// Of [`TriMesh::new`], for borders without extent.
pub fn skirt(scanned: &TriMesh, sheet: &SheetFrame, width: f64) -> Result<Option<TriMesh>, MeshError> {
    let up = sheet.world_from_sheet.rotation * Vector3::z();
    // the outer border is the longest; others go round holes
    let length = |border: &Vec<Point3<f64>>| -> f64 {
        border.iter().zip(border.iter().cycle().skip(1)).map(|(a, b)| (b - a).norm()).sum()
    };
    let loops = scanned.boundary_loops();
    let longest = loops.iter().max_by(|a, b| length(a).total_cmp(&length(b)));
    let Some(border) = longest else { return Ok(None) };
    let centre = sheet.world_from_sheet.translation.vector;
    let mut vertices: Vec<Point3<f64>> = Vec::with_capacity(2 * border.len());
    for place in border {
        // away from the sheet's middle: across the border itself would lead over the scan where the border is frayed
        let from_centre = place.coords - centre;
        let out = (from_centre - up * up.dot(&from_centre)).try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
        let slope = rise(scanned.vertices(), place, &out, &up).clamp(0.0, STEEPEST);
        vertices.extend([*place, place + (out + up * slope) * width]);
    }
    let count = vertices.len() as u32;
    // odd vertices lie farther out
    let quads = (0..count).step_by(2).map(|a| (a, (a + 2) % count));
    let triangles = quads.flat_map(|(a, b)| [[a, a + 1, b + 1], [a, b + 1, b]]).collect();
    TriMesh::new(vertices, triangles).map(Some)
}

/// How steeply the vertices round `place` rise along `along`, m per m, `up` being up: the slope of the least-squares line.
fn rise(vertices: &[Point3<f64>], place: &Point3<f64>, along: &Vector3<f64>, up: &Vector3<f64>) -> f64 {
    let near = vertices.iter().map(|v| v - place).filter(|d| d.norm_squared() < ROUND * ROUND);
    let (mut n, mut x, mut z, mut xx, mut xz) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for d in near {
        let (along, height) = (d.dot(along), d.dot(up));
        (n, x, z, xx, xz) = (n + 1.0, x + along, z + height, xx + along * along, xz + along * height);
    }
    let spread = xx - x * x / n;
    if spread > 1e-9 { (xz - x * z / n) / spread } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Pose;
    use crate::mesh::shapes;

    #[test]
    fn it_goes_on_level_and_covers_what_falls_away() {
        // the upper quarter of a dome
        let dome = shapes::dome(0.15, 0.01).unwrap();
        let kept: Vec<[u32; 3]> = dome
            .triangles()
            .iter()
            .filter(|t| t.iter().all(|i| dome.vertices()[*i as usize].z > 0.11))
            .copied()
            .collect();
        let mut used: Vec<u32> = kept.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let number = |i: &u32| used.binary_search(i).unwrap() as u32;
        let vertices = used.iter().map(|i| dome.vertices()[*i as usize]).collect();
        let triangles = kept.iter().map(|t| [number(&t[0]), number(&t[1]), number(&t[2])]).collect();
        let cap = TriMesh::new(vertices, triangles).unwrap();
        let sheet = SheetFrame { world_from_sheet: Pose::translation(0.0, 0.0, 0.2) };
        let skirt = skirt(&cap, &sheet, 0.2).unwrap().unwrap();
        let (low, high) = skirt.bounds();
        assert!(low.z > 0.105 && high.z < 0.125, "{low} {high}");
        assert!(low.x < -0.28 && high.x > 0.28 && low.y < -0.28 && high.y > 0.28);
        // from above, every place beyond the cap is met at the skirt, over the dome
        for angle in 0..24 {
            let (s, c) = (f64::from(angle) * 0.2618).sin_cos();
            let from = Point3::new(0.14 * c, 0.14 * s, 1.0);
            let hit = skirt.cast_ray(&from, &-Vector3::z(), 2.0).expect("the skirt is whole");
            assert!(hit.position.z > 0.1);
        }
    }

    #[test]
    fn a_closed_surface_has_none() {
        let ball = shapes::sphere(0.1, 0.03).unwrap();
        let sheet = SheetFrame { world_from_sheet: Pose::translation(0.0, 0.0, 0.2) };
        assert!(skirt(&ball, &sheet, 0.2).unwrap().is_none());
    }
}
