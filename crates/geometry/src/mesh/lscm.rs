//! Least squares conformal maps.
use nalgebra::{Complex, Point2};

use super::flat_error::FlatError;
use super::laplacian::{Laplacian, numbered};
use super::patch::Patch;
use crate::math::Cholesky;

/// Flattens a patch by least squares conformal maps (B. Levy et al., doi:10.1145/566654.566590), two vertices pinned, which lie
/// far apart on the boundary: by their distance in space.
///
/// The sum over triangles of `area |grad y - J grad x|^2 / 2` is the Dirichlet energy less the signed area of the map. With
/// `z = x + i y` it is `z^H (A - M) z / 2`, with the Laplacian `A` and, for each boundary edge from i to j,
/// `M_ij = -i / 2, M_ji = i / 2`: a Hermitian system half as large as the real one.
pub(super) fn least_squares(patch: &Patch) -> Result<Vec<Point2<f64>>, FlatError> {
    let laplacian = Laplacian::new(patch);
    let n = patch.vertices.len();
    let [p, q] = pins(patch);
    let (number, rest) = numbered(n, |i| i != p && i != q);
    let distance = Complex::from((patch.vertices[q] - patch.vertices[p]).norm());
    let known = |i: usize| if i == q { distance } else { Complex::from(0.0) };
    let mut entries = laplacian.lower(&number, Complex::from);
    let mut b = vec![Complex::from(0.0); rest];
    // what the pinned vertices do to the others, by both matrices
    let mut couple = |row: usize, col: usize, value: Complex<f64>| {
        if let (Some(place), None) = (number[row], number[col]) {
            b[place as usize] -= value * known(col);
        }
    };
    for &(i, j, v) in &laplacian.off_diagonal {
        couple(i as usize, j as usize, v.into());
        couple(j as usize, i as usize, v.into());
    }
    let half = Complex::new(0.0, 0.5);
    for (k, &i) in patch.boundary.iter().enumerate() {
        let j = patch.boundary[(k + 1) % patch.boundary.len()];
        couple(i as usize, j as usize, half);
        couple(j as usize, i as usize, -half);
        if let (Some(a), Some(b)) = (number[i as usize], number[j as usize]) {
            // -M_ij = i / 2 in row i, column j; its conjugate across the diagonal
            entries.push(if a > b { (a, b, half) } else { (b, a, -half) });
        }
    }
    if rest > 0 {
        Cholesky::factor(rest, &entries)?.solve(&mut b);
    }
    let z = |i: usize| number[i].map_or_else(|| known(i), |place| b[place as usize]);
    Ok((0..n).map(z).map(|z| Point2::new(z.re, z.im)).collect())
}

/// Two vertices of the boundary that are far apart: the farthest from the first, and the farthest from that.
fn pins(patch: &Patch) -> [usize; 2] {
    let farthest = |from: usize| {
        let distance = |b: u32| (patch.vertices[b as usize] - patch.vertices[from]).norm_squared();
        let mut best = (-1.0, 0);
        for &b in &patch.boundary {
            let d = distance(b);
            if d > best.0 {
                best = (d, b as usize);
            }
        }
        best.1
    };
    let q = farthest(patch.boundary[0] as usize);
    [q, farthest(q)]
}
