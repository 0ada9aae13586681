//! Sparse symmetric and Hermitian systems: factored once, solved many times.
//!
//! A crate of its own, because faer's kernels take long to compile: here they are compiled once, and not again with every change of
//! the program and its tests.
#![forbid(unsafe_code)]
#![warn(missing_docs)]

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMat, Triplet};
use faer::traits::ComplexField;
use faer::{Conj, MatMut, Par, Side};
use num_complex::Complex;

/// Why a system can't be solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SparseError {
    /// An entry lies outside of the matrix.
    #[error("an entry lies outside of the {size} x {size} matrix")]
    Shape {
        /// Rows of the matrix.
        size: usize,
    },
    /// A pivot is zero or negative, or an entry is not finite.
    #[error("the {size} x {size} matrix is not positive definite")]
    NotPositive {
        /// Rows of the matrix.
        size: usize,
    },
    /// The factor doesn't fit into memory.
    #[error("the factor of the {size} x {size} matrix doesn't fit into memory")]
    Memory {
        /// Rows of the matrix.
        size: usize,
    },
}

/// The Cholesky factor `P A P^T = L L^H` of a sparse positive definite matrix, real (`f64`) or Hermitian
/// (`Complex<f64>`). Computed on one thread, so that the bits don't depend on how many there are.
pub struct Cholesky<T: ComplexField> {
    size: usize,
    symbolic: SymbolicCholesky<usize>,
    values: Vec<T>,
}

/// The numbers that systems are made of: `f64` and `Complex<f64>`.
pub trait Scalar: ComplexField + Copy {
    /// See [`Cholesky::factor`].
    #[doc(hidden)]
    fn factor(size: usize, lower: &[(u32, u32, Self)]) -> Result<Cholesky<Self>, SparseError>;
    /// See [`Cholesky::solve`].
    #[doc(hidden)]
    fn solve(factor: &Cholesky<Self>, b: &mut [Self]);
}

impl Scalar for f64 {
    fn factor(size: usize, lower: &[(u32, u32, Self)]) -> Result<Cholesky<Self>, SparseError> {
        factor(size, lower)
    }
    fn solve(factor: &Cholesky<Self>, b: &mut [Self]) {
        solve(factor, b);
    }
}

impl Scalar for Complex<f64> {
    fn factor(size: usize, lower: &[(u32, u32, Self)]) -> Result<Cholesky<Self>, SparseError> {
        factor(size, lower)
    }
    fn solve(factor: &Cholesky<Self>, b: &mut [Self]) {
        solve(factor, b);
    }
}

impl<T: Scalar> Cholesky<T> {
    /// Factors the `size` x `size` matrix with the given entries (row, column, value) of its lower triangle and diagonal;
    /// entries of the same place are summed. Ordered by approximate minimum degree (Amestoy, Davis, Duff,
    /// doi:10.1137/S0895479894278952).
    ///
    /// # Errors
    /// An entry outside of the matrix, a matrix that is not positive definite, too little memory.
    pub fn factor(size: usize, lower: &[(u32, u32, T)]) -> Result<Self, SparseError> {
        T::factor(size, lower)
    }

    /// Rows of the matrix.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Replaces the right-hand side `b` of `A x = b` by `x`.
    ///
    /// # Panics
    /// When `b` has not as many rows as the matrix.
    pub fn solve(&self, b: &mut [T]) {
        T::solve(self, b);
    }
}

fn factor<T: ComplexField>(size: usize, lower: &[(u32, u32, T)]) -> Result<Cholesky<T>, SparseError> {
    let place = |&(row, col, ref value): &(u32, u32, T)| Triplet::new(row as usize, col as usize, value.clone());
    let entries: Vec<Triplet<usize, usize, T>> = lower.iter().map(place).collect();
    let matrix = SparseColMat::<usize, T>::try_new_from_triplets(size, size, &entries)
        .map_err(|_| SparseError::Shape { size })?;
    drop(entries);
    let memory = |_| SparseError::Memory { size };
    let symbolic =
        factorize_symbolic_cholesky(matrix.symbolic(), Side::Lower, SymmetricOrdering::Amd, Default::default())
            .map_err(|_| SparseError::Memory { size })?;
    let mut values = Vec::new();
    values.try_reserve_exact(symbolic.len_val()).map_err(|_| SparseError::Memory { size })?;
    values.resize(symbolic.len_val(), T::zero_impl());
    let scratch = symbolic.factorize_numeric_llt_scratch::<T>(Par::Seq, Default::default());
    let mut buffer = MemBuffer::try_new(scratch).map_err(memory)?;
    symbolic
        .factorize_numeric_llt::<T>(
            &mut values,
            matrix.as_ref(),
            Side::Lower,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut buffer),
            Default::default(),
        )
        .map_err(|_| SparseError::NotPositive { size })?;
    Ok(Cholesky { size, symbolic, values })
}

fn solve<T: ComplexField>(factor: &Cholesky<T>, b: &mut [T]) {
    assert_eq!(b.len(), factor.size, "rows of the right-hand side");
    let scratch = factor.symbolic.solve_in_place_scratch::<T>(1, Par::Seq);
    let mut buffer = MemBuffer::new(scratch);
    LltRef::<'_, usize, T>::new(&factor.symbolic, &factor.values).solve_in_place_with_conj(
        Conj::No,
        MatMut::from_column_major_slice_mut(b, factor.size, 1),
        Par::Seq,
        MemStack::new(&mut buffer),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_real_system_is_solved(n in 1..40usize, seed in prop::collection::vec((0..40u32, 0..40u32, -1.0..1.0f64), 0..120), x in prop::collection::vec(-1.0..1.0f64, 40)) {
            // diagonally dominant, so positive definite
            let mut entries: Vec<_> = seed.into_iter().map(|(i, j, v)| (i % n as u32, j % n as u32, v)).filter(|(i, j, _)| i > j).collect();
            entries.extend((0..n as u32).map(|i| (i, i, 130.0)));
            let mut b = vec![0.0; n];
            for &(i, j, v) in &entries {
                b[i as usize] += v * x[j as usize];
                if i != j { b[j as usize] += v * x[i as usize]; }
            }
            Cholesky::factor(n, &entries).unwrap().solve(&mut b);
            for (found, desired) in b.iter().zip(&x) {
                prop_assert!((found - desired).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn a_hermitian_system_is_solved() {
        let i = Complex::<f64>::i();
        // [2 -i; i 2] and x = (1, i): b = (2 + 1, i + 2 i)
        let entries = [(0, 0, Complex::from(2.0)), (1, 0, i), (1, 1, Complex::from(2.0))];
        let mut b = [Complex::from(3.0), i * 3.0];
        Cholesky::factor(2, &entries).unwrap().solve(&mut b);
        assert!((b[0] - Complex::from(1.0)).norm() < 1e-12 && (b[1] - i).norm() < 1e-12, "{b:?}");
    }

    #[test]
    fn what_has_no_factor_is_refused() {
        let refused = |entries: &[(u32, u32, f64)]| Cholesky::factor(2, entries).err();
        assert_eq!(refused(&[(0, 0, 1.0), (1, 1, -1.0)]), Some(SparseError::NotPositive { size: 2 }));
        assert_eq!(refused(&[(0, 0, 1.0), (1, 0, 2.0), (1, 1, 1.0)]), Some(SparseError::NotPositive { size: 2 }));
        assert_eq!(refused(&[(0, 0, 1.0), (1, 1, f64::NAN)]), Some(SparseError::NotPositive { size: 2 }));
        assert_eq!(refused(&[(2, 0, 1.0)]), Some(SparseError::Shape { size: 2 }));
    }
}
