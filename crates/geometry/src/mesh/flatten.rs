//! Flattening a patch into the plane, and mending what comes out turned over.
use nalgebra::{Point2, Vector2};

use super::bff::boundary_first;
use super::flat_error::FlatError;
use super::lscm::least_squares;
use super::patch::Patch;

/// Most rings of triangles round a turned-over one in which vertices are moved.
const RINGS: usize = 6;
/// Sweeps of smoothing for each size of that region.
const SWEEPS: usize = 60;

/// A way of flattening.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Flattening {
    /// Boundary first flattening: no pins, and the least variation of scale.
    #[default]
    BoundaryFirst,
    /// Least squares conformal map with two pinned vertices.
    LeastSquares,
}

/// Flattens a patch. Returns the places of its vertices in the plane, in the order of `patch.vertices`, all triangles
/// counter-clockwise, and how many had to be mended; scale, turn and shift are arbitrary.
///
/// # Errors
/// See [`FlatError`].
pub fn flatten(patch: &Patch, method: Flattening) -> Result<(Vec<Point2<f64>>, usize), FlatError> {
    let mut flat = match method {
        Flattening::BoundaryFirst => boundary_first(patch)?,
        Flattening::LeastSquares => least_squares(patch)?,
    };
    if flat.iter().any(|p| !(p.x.is_finite() && p.y.is_finite())) {
        return Err(FlatError::Collapsed);
    }
    let flipped = turned_over(&patch.triangles, &flat);
    let before = flipped.len();
    if before > 0 {
        mend(patch, &mut flat, flipped);
        let flips = turned_over(&patch.triangles, &flat).len();
        if flips > 0 {
            return Err(FlatError::Flips { flips, triangles: patch.triangles.len() });
        }
    }
    Ok((flat, before))
}

/// Twice the signed area of a triangle in the plane.
pub(super) fn double_area(flat: &[Point2<f64>], t: &[u32; 3]) -> f64 {
    let [a, b, c] = t.map(|i| flat[i as usize]);
    (b - a).perp(&(c - a))
}

/// The triangles that are not counter-clockwise in the plane.
fn turned_over(triangles: &[[u32; 3]], flat: &[Point2<f64>]) -> Vec<u32> {
    (0..triangles.len() as u32).filter(|&t| double_area(flat, &triangles[t as usize]) <= 0.0).collect()
}

/// Moves the inner vertices round turned-over triangles to the mean of their neighbours, in growing regions, until none is
/// left (W. T. Tutte, doi:10.1112/plms/s3-13.1.743: such means leave nothing turned over in a convex region).
fn mend(patch: &Patch, flat: &mut [Point2<f64>], mut flipped: Vec<u32>) {
    let n = patch.vertices.len();
    let mut movable = vec![true; n];
    for &b in &patch.boundary {
        movable[b as usize] = false;
    }
    for rings in 1..=RINGS {
        let mut region: Vec<bool> = vec![false; n];
        for &t in &flipped {
            for i in patch.triangles[t as usize] {
                region[i as usize] = true;
            }
        }
        for _ in 1..rings {
            let grown: Vec<u32> =
                patch.triangles.iter().filter(|t| t.iter().any(|i| region[*i as usize])).flatten().copied().collect();
            for i in grown {
                region[i as usize] = true;
            }
        }
        let near: Vec<[u32; 3]> =
            patch.triangles.iter().filter(|t| t.iter().any(|i| region[*i as usize])).copied().collect();
        for _ in 0..SWEEPS {
            let mut sum: std::collections::BTreeMap<u32, (Vector2<f64>, f64)> = std::collections::BTreeMap::new();
            for t in &near {
                for k in 0..3 {
                    let (i, j, l) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
                    if region[i as usize] && movable[i as usize] {
                        let entry = sum.entry(i).or_insert((Vector2::zeros(), 0.0));
                        entry.0 += flat[j as usize].coords + flat[l as usize].coords;
                        entry.1 += 2.0;
                    }
                }
            }
            for (i, (sum, count)) in sum {
                flat[i as usize] = Point2::from(sum / count);
            }
        }
        flipped = turned_over(&patch.triangles, flat);
        if flipped.is_empty() {
            return;
        }
    }
}
