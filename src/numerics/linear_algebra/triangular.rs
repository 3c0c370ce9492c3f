//! Cholesky's method and triangular systems by blocks. Most of the work is products of matrices,
//! which run several times as fast as the columns of the plain methods.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use nalgebra::{Cholesky, DMatrix, DMatrixView, DMatrixViewMut, Matrix};

use super::BLOCK;
use crate::numerics::vectors::simd::vectorised;

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
fn subtract_square(lower: &DMatrix<f64>, above: &DMatrix<f64>, from: &mut DMatrixViewMut<f64>) {
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
        vectorised(
            #[inline(always)]
            || solve_plain(lower, right.as_view_mut()),
        );
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

/// Columns that the plain method solves together; a single column would wait for its own divisions.
const SIDE_BY_SIDE: usize = 4;

/// [`solve_lower`] column by column.
#[inline(always)]
fn solve_plain(lower: DMatrixView<f64>, mut right: DMatrixViewMut<f64>) {
    let mut columns = right.column_iter_mut();
    loop {
        let mut own: [_; SIDE_BY_SIDE] = std::array::from_fn(|_| columns.next());
        let whole = own.each_mut().map(|c| c.as_mut().map(Matrix::as_mut_slice));
        match whole {
            [Some(a), Some(b), Some(c), Some(d)] => solve_columns(lower, [a, b, c, d]),
            rest => {
                rest.into_iter()
                    .flatten()
                    .for_each(|column| solve_columns(lower, [column]));
                return;
            }
        }
    }
}

/// Solves some columns, one element of each after the other.
#[inline(always)]
fn solve_columns<const N: usize>(lower: DMatrixView<f64>, mut rest: [&mut [f64]; N]) {
    for (i, lower) in lower.column_iter().enumerate() {
        let [diagonal, lower @ ..] = &lower.as_slice()[i..] else {
            return;
        };
        for column in &mut rest {
            let Some((first, below)) = std::mem::take(column).split_first_mut() else {
                continue;
            };
            *first /= diagonal;
            for (value, l) in below.iter_mut().zip(lower) {
                *value -= *first * l;
            }
            *column = below;
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
            let mut right = DMatrix::from_fn(n, 7, |i, j| (i * j) as f64 - 3.0);
            let given = right.clone();
            solve_lower(plain.as_view(), right.as_view_mut());
            assert_relative_eq!(&plain * right, given, epsilon = 1e-9);
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
