//! Damping designed for the mass that the hand really has.
use nalgebra::{Matrix6, SymmetricEigen};

/// The damping matrix that gives every mode of `Lambda xdd + D xd + K x = 0` the same damping ratio.
///
/// Double diagonalisation (Albu-Schaeffer, Ott, Frese, Hirzinger 2003, doi:10.1109/ROBOT.2003.1242165): with
/// `Lambda = Q^T Q` and `K = Q^T B Q`, `D = 2 zeta Q^T B^(1/2) Q`. Computed as `2 zeta L S^(1/2) L^T` with
/// `Lambda = L L^T` and `S = L^-1 K L^-T`, which is the same and needs one symmetric square root.
///
/// `lambda` and `stiffness` are in the same axes; both symmetric, `lambda` positive definite. `None` when it isn't.
pub fn design_damping(lambda: &Matrix6<f64>, stiffness: &Matrix6<f64>, ratio: f64) -> Option<Matrix6<f64>> {
    let l = lambda.cholesky()?.unpack();
    let half = l.solve_lower_triangular(stiffness)?;
    let s = l.solve_lower_triangular(&half.transpose())?;
    let eigen = SymmetricEigen::new((s + s.transpose()) * 0.5);
    let roots = Matrix6::from_diagonal(&eigen.eigenvalues.map(|b| b.max(0.0).sqrt()));
    let root = eigen.eigenvectors * roots * eigen.eigenvectors.transpose();
    Some(l * root * l.transpose() * (2.0 * ratio))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;
    use proptest::prelude::*;

    proptest! {
        /// Every eigenvalue of the closed loop has the asked damping ratio.
        #[test]
        fn every_mode_has_the_asked_ratio(seed in proptest::array::uniform32(-1.0..1.0f64), ratio in 0.3..0.99f64) {
            let a = Matrix6::from_fn(|i, j| seed[(i * 6 + j) % 32] + if i == j { 2.0 } else { 0.0 });
            let lambda = a * a.transpose() + Matrix6::identity() * 0.1;
            let k = Matrix6::from_diagonal(&Vector6::new(1500.0, 1500.0, 350.0, 300.0, 300.0, 300.0));
            let d = design_damping(&lambda, &k, ratio).unwrap();
            let inverse = lambda.try_inverse().unwrap();
            let mut system = nalgebra::SMatrix::<f64, 12, 12>::zeros();
            system.fixed_view_mut::<6, 6>(0, 6).copy_from(&Matrix6::identity());
            system.fixed_view_mut::<6, 6>(6, 0).copy_from(&(-inverse * k));
            system.fixed_view_mut::<6, 6>(6, 6).copy_from(&(-inverse * d));
            for e in system.complex_eigenvalues().iter() {
                let zeta = -e.re / e.norm();
                prop_assert!((zeta - ratio).abs() < 1e-5, "{zeta} for {ratio}");
            }
        }
    }
}
