//! Cholesky's method and triangular systems by blocks. Most of the work is products of matrices,
//! which run several times as fast as the columns of the plain methods.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::{Cholesky, DMatrix, DMatrixView, DMatrixViewMut};
use pulp::{Arch, Simd, WithSimd};

use super::BLOCK;
use crate::numerics::vectors::lanes::Lanes;
use crate::numerics::vectors::simd::VECTOR;

/// Size up to which the plain methods are as fast.
const PLAIN: usize = 48;

/// Lower triangular L with L Lᵀ = A; the part above its diagonal is not defined. `None` unless A is
/// positive definite.
#[must_use]
pub fn cholesky(mut matrix: DMatrix<f64>) -> Option<DMatrix<f64>> {
    factorise(matrix.as_view_mut()).then_some(matrix)
}

fn factorise(mut matrix: DMatrixViewMut<f64>) -> bool {
    let n = matrix.nrows();
    if n <= PLAIN {
        let Some(plain) = Cholesky::new(matrix.clone_owned()) else {
            return false;
        };
        matrix.copy_from(plain.l_dirty());
        return true;
    }
    let half = n / 2;
    if !factorise(matrix.view_mut((0, 0), (half, half))) {
        return false;
    }
    let mut above = matrix.view((half, 0), (n - half, half)).transpose();
    solve_lower(matrix.view((0, 0), (half, half)), above.as_view_mut());
    let lower = above.transpose();
    matrix.view_mut((half, 0), lower.shape()).copy_from(&lower);
    let mut rest = matrix.view_mut((half, half), (n - half, n - half));
    subtract_square(&lower, &above, &mut rest);
    factorise(rest)
}

/// Subtracts L Lᵀ on and below the diagonal, by blocks of columns; `above` is Lᵀ.
pub fn subtract_square(lower: &DMatrix<f64>, above: &DMatrix<f64>, from: &mut DMatrixViewMut<f64>) {
    let n = lower.nrows();
    for start in (0..n).step_by(BLOCK) {
        let width = BLOCK.min(n - start);
        let mut block = from.view_mut((start, start), (n - start, width));
        let columns = above.columns(start, width);
        block.gemm(-1.0, &lower.rows_range(start..), &columns, 1.0);
    }
}

/// Replaces B by L⁻¹ B for a lower triangular L.
pub fn solve_lower(lower: DMatrixView<f64>, mut right: DMatrixViewMut<f64>) {
    let n = lower.nrows();
    if n <= PLAIN {
        Arch::new().dispatch(PlainSolution {
            upper: lower.transpose(),
            right,
        });
        return;
    }
    let half = n / 2;
    let (mut first, mut second) = right.rows_range_pair_mut(..half, half..);
    solve_lower(lower.view((0, 0), (half, half)), first.as_view_mut());
    second.gemm(-1.0, &lower.view((half, 0), (n - half, half)), &first, 1.0);
    solve_lower(
        lower.view((half, half), (n - half, n - half)),
        second.as_view_mut(),
    );
}

/// Replaces B by L⁻¹ B for a lower triangular L and a staircase B: column j is zero above its row
/// `first_rows[j]`, which does not fall with j.
pub fn solve_staircase(lower: &DMatrix<f64>, right: &mut DMatrix<f64>, first_rows: &[usize]) {
    for start in (0..right.ncols()).step_by(BLOCK) {
        let width = BLOCK.min(right.ncols() - start);
        let first = first_rows[start];
        let rows = lower.nrows() - first;
        let lower = lower.view((first, first), (rows, rows));
        solve_lower(lower, right.view_mut((first, start), (rows, width)));
    }
}

/// Vectors of columns that the plain method solves together; one alone would wait for its own sums.
const TOGETHER: usize = 4;

/// [`solve_lower`] row by row, with columns side by side in the lanes of vectors.
struct PlainSolution<'a> {
    /// Lᵀ, so that a row of L is contiguous.
    upper: DMatrix<f64>,
    right: DMatrixViewMut<'a, f64>,
}

impl WithSimd for PlainSolution<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let mut rows = [0.0; PLAIN * TOGETHER * VECTOR];
        let mut column = 0;
        while column + (TOGETHER - 1) * S::F64_LANES < self.right.ncols() {
            self.solve_columns::<S, TOGETHER>(simd, column, &mut rows);
            column += TOGETHER * S::F64_LANES;
        }
        while column < self.right.ncols() {
            self.solve_columns::<S, 1>(simd, column, &mut rows);
            column += S::F64_LANES;
        }
    }
}

impl PlainSolution<'_> {
    /// Solves `N` vectors of columns, or those that are left of them; `rows` is for their rows side by side.
    #[inline(always)]
    fn solve_columns<S: Simd, const N: usize>(&mut self, simd: S, first: usize, rows: &mut [f64]) {
        let (n, width) = (self.right.nrows(), N * S::F64_LANES);
        let last = (first + width).min(self.right.ncols());
        for column in first..last {
            let own = self.right.column(column);
            for (row, value) in own.as_slice().iter().enumerate() {
                rows[row * width + column - first] = *value;
            }
        }
        for row in 0..n {
            let upper = self.upper.column(row);
            let (diagonal, left) = (upper[row], &upper.as_slice()[..row]);
            let mut own = [Lanes::zero(simd); N];
            for v in 0..N {
                own[v] = Lanes::load(simd, rows, row * width + v * S::F64_LANES);
            }
            for k in 0..row {
                for v in 0..N {
                    let solved = Lanes::load(simd, rows, k * width + v * S::F64_LANES);
                    own[v] = own[v].plus(-left[k], solved);
                }
            }
            for v in 0..N {
                (own[v] * (1.0 / diagonal)).store(rows, row * width + v * S::F64_LANES);
            }
        }
        for column in first..last {
            let mut own = self.right.column_mut(column);
            for (row, value) in own.as_mut_slice().iter_mut().enumerate() {
                *value = rows[row * width + column - first];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn matrix(n: usize) -> DMatrix<f64> {
        DMatrix::from_fn(n, n, |i, j| {
            let apart = (i as f64 - j as f64).abs() / 9.0;
            (-apart).exp() + if i == j { 0.1 } else { 0.0 }
        })
    }

    #[test]
    fn blocks_give_what_the_plain_method_gives() {
        for n in [5, 48, 49, 131] {
            let plain = Cholesky::new(matrix(n)).unwrap().l();
            let blocked = cholesky(matrix(n)).unwrap().lower_triangle();
            assert_relative_eq!(blocked, plain, epsilon = 1e-12);
            for columns in [1, 7, 70] {
                let mut right = DMatrix::from_fn(n, columns, |i, j| (i * j % 11) as f64 - 3.0);
                let given = right.clone();
                solve_lower(plain.as_view(), right.as_view_mut());
                assert_relative_eq!(&plain * right, given, epsilon = 1e-9);
            }
        }
    }

    fn bits<S: Simd>(simd: S) -> Vec<u64> {
        let lower = Cholesky::new(matrix(PLAIN)).unwrap().l();
        let mut right = DMatrix::from_fn(PLAIN, 37, |i, j| (i * j % 11) as f64 - 3.0);
        let solution = PlainSolution {
            upper: lower.transpose(),
            right: right.as_view_mut(),
        };
        solution.with_simd(simd);
        right.iter().map(|v| v.to_bits()).collect()
    }

    #[test]
    fn every_vector_width_gives_the_same_bits() {
        let narrow = bits(pulp::Scalar);
        assert!(narrow.iter().all(|bits| f64::from_bits(*bits).is_finite()));
        #[cfg(target_arch = "x86_64")]
        {
            assert!(pulp::x86::V3::try_new().is_none_or(|simd| bits(simd) == narrow));
            assert!(pulp::x86::V4::try_new().is_none_or(|simd| bits(simd) == narrow));
        }
    }

    #[test]
    fn a_staircase_is_solved_as_the_whole_matrix_is() {
        let lower = Cholesky::new(matrix(100)).unwrap().l();
        let first_rows: Vec<usize> = (0..150).map(|j| j / 40 * 30).collect();
        let mut whole = DMatrix::from_fn(100, 150, |i, j| {
            let value = (i * j) as f64 - 3.0;
            if i < first_rows[j] { 0.0 } else { value }
        });
        let mut staircase = whole.clone();
        solve_staircase(&lower, &mut staircase, &first_rows);
        solve_lower(lower.as_view(), whole.as_view_mut());
        assert_relative_eq!(staircase, whole, epsilon = 1e-8);
    }

    #[test]
    fn an_indefinite_matrix_has_no_root() {
        for place in [3, 100] {
            let mut indefinite = matrix(120);
            indefinite[(place, place)] = -1.0;
            assert!(cholesky(indefinite).is_none());
        }
    }
}
