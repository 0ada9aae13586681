//! The cotangent Laplacian of a patch, and its curvatures.
use std::f64::consts::{PI, TAU};

use super::patch::Patch;
use super::triangle::Triangle;

/// `sum over edges of w_ij (x_i - x_j)^2 / 2`, the Dirichlet energy of a function linear on triangles, as a matrix:
/// `w_ij = (cot a + cot b) / 2` over the angles opposite the edge (Pinkall and Polthier, doi:10.1080/10586458.1993.10504266).
pub(super) struct Laplacian {
    /// One entry a half-edge, (row, column, value) with row > column; the value is `-cot / 2` of the opposite angle.
    pub off_diagonal: Vec<(u32, u32, f64)>,
    /// The sum of the weights round each vertex.
    pub diagonal: Vec<f64>,
    /// Angle defect `2 pi - sum of angles` of each inner vertex, `pi - sum of angles` of each boundary vertex, rad.
    pub curvature: Vec<f64>,
}

impl Laplacian {
    pub fn new(patch: &Patch) -> Self {
        let n = patch.vertices.len();
        let mut off_diagonal = Vec::with_capacity(3 * patch.triangles.len());
        let mut diagonal = vec![0.0; n];
        let mut curvature = vec![TAU; n];
        for &b in &patch.boundary {
            curvature[b as usize] = PI;
        }
        for t in &patch.triangles {
            let angles = Triangle::of(&patch.vertices, t).angles();
            for k in 0..3 {
                curvature[t[k] as usize] -= angles[k];
                let (i, j) = (t[(k + 1) % 3], t[(k + 2) % 3]);
                let half_cot = 0.5 / angles[k].tan();
                off_diagonal.push((i.max(j), i.min(j), -half_cot));
                diagonal[i as usize] += half_cot;
                diagonal[j as usize] += half_cot;
            }
        }
        Self { off_diagonal, diagonal, curvature }
    }

    /// Entries of the lower triangle of the rows and columns that `number` keeps (it gives their new numbers).
    pub fn lower<T>(&self, number: &[Option<u32>], value: impl Fn(f64) -> T) -> Vec<(u32, u32, T)> {
        let off = self.off_diagonal.iter().filter_map(|&(i, j, v)| {
            let (i, j) = (number[i as usize]?, number[j as usize]?);
            Some((i.max(j), i.min(j), value(v)))
        });
        let diagonal = self.diagonal.iter().zip(number).filter_map(|(v, i)| Some(((*i)?, (*i)?, value(*v))));
        off.chain(diagonal).collect()
    }

    /// The matrix times `x`.
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut y: Vec<f64> = self.diagonal.iter().zip(x).map(|(d, x)| d * x).collect();
        for &(i, j, v) in &self.off_diagonal {
            y[i as usize] += v * x[j as usize];
            y[j as usize] += v * x[i as usize];
        }
        y
    }
}

/// New numbers of the vertices for which `keep` holds, and how many there are.
pub(super) fn numbered(count: usize, keep: impl Fn(usize) -> bool) -> (Vec<Option<u32>>, usize) {
    let mut kept = 0;
    let number = (0..count)
        .map(|i| {
            keep(i).then(|| {
                kept += 1;
                kept - 1
            })
        })
        .collect();
    (number, kept as usize)
}
