//! Surface nets: a mesh through the zero set of a signed distance on a narrow band of a grid.
use std::collections::HashMap;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::ReconstructError;

/// Most cells of a band.
const MAX_CELLS: usize = 4_000_000;

/// A net: vertices m, and quads as pairs of triangles.
#[derive(Debug, Default)]
pub(super) struct Net {
    pub vertices: Vec<Point3<f64>>,
    pub triangles: Vec<[u32; 3]>,
}

/// Corners of a cell, as bits x y z.
const CORNERS: [[i64; 3]; 8] = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]];
/// Edges of a cell, as pairs of corners.
const EDGES: [[usize; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/// The zero set of `distance` near `points` (S. F. F. Gibson, doi:10.1007/BFb0056277): a vertex in each cell of edge `cell` (m) in which
/// the sign changes, at the mean of the changes on its edges, and a quad round each edge of the grid on which it does. The band reaches
/// `layers` cells from the points; triangles wind counter-clockwise seen from the positive side.
pub(super) fn surface_net(
    points: &[Point3<f64>],
    cell: f64,
    layers: i64,
    distance: impl Fn(&Point3<f64>) -> Option<f64> + Sync,
) -> Result<Net, ReconstructError> {
    let cells = band(points, cell, layers)?;
    let mut corners: Vec<[i64; 3]> = cells.iter().flat_map(|c| CORNERS.map(|o| add(c, &o))).collect();
    corners.par_sort_unstable();
    corners.dedup();
    let at = |c: &[i64; 3]| Point3::from(Vector3::from(c.map(|i| i as f64)) * cell);
    let values: Vec<Option<f64>> = corners.par_iter().map(|c| distance(&at(c))).collect();
    let value = |c: &[i64; 3]| corners.binary_search(c).ok().and_then(|i| values[i]);

    let mut net = Net::default();
    // only asked, never walked through
    let mut vertex_of: HashMap<[i64; 3], u32> = HashMap::new();
    let found: Vec<Option<Point3<f64>>> = cells
        .par_iter()
        .map(|c| {
            let mut values = [0.0; 8];
            for (v, o) in values.iter_mut().zip(&CORNERS) {
                *v = value(&add(c, o))?;
            }
            let (mut sum, mut count) = (Vector3::zeros(), 0.0);
            for [i, j] in EDGES {
                let (a, b) = (values[i], values[j]);
                if (a < 0.0) != (b < 0.0) {
                    let (p, q) =
                        (Vector3::from(CORNERS[i].map(|k| k as f64)), Vector3::from(CORNERS[j].map(|k| k as f64)));
                    sum += p + (q - p) * (a / (a - b));
                    count += 1.0;
                }
            }
            (count > 0.0).then(|| at(c) + sum / count * cell)
        })
        .collect();
    for (c, p) in cells.iter().zip(found) {
        if let Some(p) = p {
            vertex_of.insert(*c, net.vertices.len() as u32);
            net.vertices.push(p);
        }
    }
    for (corner, value_here) in corners.iter().zip(&values) {
        let Some(a) = value_here else { continue };
        for axis in 0..3 {
            let mut next = *corner;
            next[axis] += 1;
            let Some(b) = value(&next) else { continue };
            if (*a < 0.0) == (b < 0.0) {
                continue;
            }
            // the four cells round the edge, counter-clockwise seen from its far end
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let around = [[-1, -1], [0, -1], [0, 0], [-1, 0]].map(|[du, dv]| {
                let mut c = *corner;
                c[u] += du;
                c[v] += dv;
                vertex_of.get(&c).copied()
            });
            let [Some(p), Some(q), Some(r), Some(s)] = around else { continue };
            let quad = if *a < 0.0 { [p, q, r, s] } else { [p, s, r, q] };
            split(&quad, &net.vertices).into_iter().for_each(|t| net.triangles.push(t));
        }
    }
    Ok(net)
}

/// The two triangles of a quad, cut along its shorter diagonal.
fn split(&[p, q, r, s]: &[u32; 4], vertices: &[Point3<f64>]) -> [[u32; 3]; 2] {
    let length = |a: u32, b: u32| (vertices[a as usize] - vertices[b as usize]).norm_squared();
    if length(p, r) <= length(q, s) { [[p, q, r], [p, r, s]] } else { [[q, r, s], [q, s, p]] }
}

/// The cells within `layers` of those that hold points, sorted.
fn band(points: &[Point3<f64>], cell: f64, layers: i64) -> Result<Vec<[i64; 3]>, ReconstructError> {
    let too_fine = || ReconstructError::TooFine { triangle_mm: cell * 1e3, max: MAX_CELLS };
    let mut cells: Vec<[i64; 3]> = points.iter().map(|p| [p.x, p.y, p.z].map(|c| (c / cell).floor() as i64)).collect();
    cells.par_sort_unstable();
    cells.dedup();
    // one axis after the other, so that no list is longer than the band by more than a row
    for axis in 0..3 {
        if cells.len().saturating_mul(2 * layers as usize + 1) > 4 * MAX_CELLS {
            return Err(too_fine());
        }
        cells = cells
            .iter()
            .flat_map(|c| {
                (-layers..=layers).map(move |d| {
                    let mut c = *c;
                    c[axis] += d;
                    c
                })
            })
            .collect();
        cells.par_sort_unstable();
        cells.dedup();
        if cells.len() > MAX_CELLS {
            return Err(too_fine());
        }
    }
    Ok(cells)
}

fn add(a: &[i64; 3], b: &[i64; 3]) -> [i64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriMesh;

    #[test]
    fn a_ball_is_closed_and_faces_outward() {
        let shell: Vec<Point3<f64>> = (0..2000)
            .map(|k| {
                let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 2000.0;
                let (r, a) = ((1.0 - z * z).sqrt(), 2.399_963_229_728_653 * f64::from(k));
                Point3::new(r * a.cos(), r * a.sin(), z) * 0.1
            })
            .collect();
        let net = surface_net(&shell, 0.01, 2, |p| Some(p.coords.norm() - 0.1)).unwrap();
        let mesh = TriMesh::new(net.vertices, net.triangles).unwrap();
        let ball = 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
        assert!((mesh.signed_volume() / ball - 1.0).abs() < 0.03, "{}", mesh.signed_volume() / ball);
    }

    #[test]
    fn too_fine_a_grid_is_refused() {
        let points: Vec<Point3<f64>> =
            (0..200_000).map(|k| Point3::new(f64::from(k % 450), f64::from(k / 450), 0.0)).collect();
        assert!(matches!(surface_net(&points, 0.01, 3, |_| None), Err(ReconstructError::TooFine { .. })));
    }
}
