//! Boundary first flattening with the boundary that keeps areas best.
use nalgebra::{Matrix2, Point2, Vector2};

use super::flat_error::FlatError;
use super::laplacian::{Laplacian, numbered};
use super::patch::Patch;
use crate::math::Cholesky;

/// Flattens a patch conformally (R. Sawhney, K. Crane, Boundary first flattening, doi:10.1145/3132705). The boundary keeps its
/// lengths, `u = 0` there, which of all conformal maps has the least variation of scale. No vertex is pinned.
///
/// - log scale inside: `A_II u_I = -K_I`, with the Laplacian `A` and the angle defects `K`;
/// - curvature of the flat boundary: `k* = k + A_BI u_I`, whose sum is `2 pi`;
/// - the boundary curve of these lengths and curvatures, closed by the least change of lengths;
/// - inside, x is harmonic with the boundary's x, and y is the conjugate of x: `(A y)_j = -(x_{j+1} - x_{j-1}) / 2` on the
///   boundary, 0 inside.
pub(super) fn boundary_first(patch: &Patch) -> Result<Vec<Point2<f64>>, FlatError> {
    let laplacian = Laplacian::new(patch);
    let n = patch.vertices.len();
    let mut on_boundary = vec![false; n];
    for &b in &patch.boundary {
        on_boundary[b as usize] = true;
    }
    let (number, inner) = numbered(n, |i| !on_boundary[i]);
    let inside = if inner > 0 { Some(Cholesky::factor(inner, &laplacian.lower(&number, |v| v))?) } else { None };
    // the values of a function inside, of which the values outside and the Laplacian inside are known
    let extend = |mut x: Vec<f64>, source: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let Some(factor) = &inside else { return x };
        let from_boundary = laplacian.times(&x);
        let mut b = vec![0.0; inner];
        for (i, place) in number.iter().enumerate() {
            if let Some(place) = place {
                b[*place as usize] = source(i) - from_boundary[i];
            }
        }
        factor.solve(&mut b);
        for (x, place) in x.iter_mut().zip(&number) {
            if let Some(place) = place {
                *x = b[*place as usize];
            }
        }
        x
    };
    let scale = extend(vec![0.0; n], &|i| -laplacian.curvature[i]);
    let flux = laplacian.times(&scale);
    let turns: Vec<f64> = patch.boundary.iter().map(|&b| laplacian.curvature[b as usize] + flux[b as usize]).collect();
    let lengths: Vec<f64> = (0..patch.boundary.len()).map(|i| patch.boundary_length(i)).collect();
    let curve = closed_curve(&lengths, &turns);

    let mut x = vec![0.0; n];
    for (&b, p) in patch.boundary.iter().zip(&curve) {
        x[b as usize] = p.x;
    }
    let x = extend(x, &|_| 0.0);
    // all but one vertex, since y is known but for a constant
    let pinned = patch.boundary[0] as usize;
    let (number, rest) = numbered(n, |i| i != pinned);
    let mut b = vec![0.0; rest];
    let count = patch.boundary.len();
    for (j, &vertex) in patch.boundary.iter().enumerate() {
        let (before, after) = (patch.boundary[(j + count - 1) % count], patch.boundary[(j + 1) % count]);
        if let Some(place) = number[vertex as usize] {
            b[place as usize] = -0.5 * (x[after as usize] - x[before as usize]);
        }
    }
    Cholesky::factor(rest, &laplacian.lower(&number, |v| v))?.solve(&mut b);
    let y = |i: usize| number[i].map_or(0.0, |place| b[place as usize]);
    Ok((0..n).map(|i| Point2::new(x[i], y(i))).collect())
}

/// The closed polygon whose edges have nearly the given lengths (m), and turn left by `turns[i]` (rad) at its corner `i`:
/// `l* = l - diag(l) T^T (T diag(l) T^T)^-1 T l`, with the directions `T` (2 x n) of the edges.
fn closed_curve(lengths: &[f64], turns: &[f64]) -> Vec<Point2<f64>> {
    let mut angle: f64 = 0.0;
    let directions: Vec<Vector2<f64>> = turns
        .iter()
        .enumerate()
        .map(|(i, turn)| {
            angle += if i == 0 { 0.0 } else { *turn };
            Vector2::new(angle.cos(), angle.sin())
        })
        .collect();
    let mut gap = Vector2::zeros();
    let mut spread = Matrix2::zeros();
    for (l, d) in lengths.iter().zip(&directions) {
        gap += d * *l;
        spread += d * d.transpose() * *l;
    }
    let pull = spread.try_inverse().map_or(Vector2::zeros(), |inverse| inverse * gap);
    let mut at = Point2::origin();
    lengths
        .iter()
        .zip(&directions)
        .map(|(l, d)| {
            let here = at;
            at += d * (l - l * d.dot(&pull));
            here
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    proptest! {
        #[test]
        fn the_boundary_closes(lengths in prop::collection::vec(0.5..2.0f64, 12)) {
            let turns = vec![TAU / 12.0; 12];
            let curve = closed_curve(&lengths, &turns);
            // the last edge leads back to the start, in its own direction
            let last = curve[0] - curve[11];
            let direction = Vector2::new((TAU * 11.0 / 12.0).cos(), (TAU * 11.0 / 12.0).sin());
            prop_assert!(direction.perp(&last).abs() < 1e-9);
        }
    }
}
