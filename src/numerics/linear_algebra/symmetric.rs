//! Symmetric positive definite matrices: scaling to unit diagonal, and the inverse.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use nalgebra::{Cholesky, DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};

use super::BLOCK;

/// 1/√H_jj of each parameter; one where the diagonal is not positive.
#[must_use]
pub fn scale(information: &DMatrix<f64>) -> DVector<f64> {
    information
        .diagonal()
        .map(|h| if h > 0.0 { 1.0 / h.sqrt() } else { 1.0 })
}

/// D H D with D the diagonal matrix of `scale`.
#[must_use]
pub fn scaled(information: &DMatrix<f64>, scale: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(information.nrows(), information.ncols(), |i, j| {
        information[(i, j)] * scale[i] * scale[j]
    })
}

/// Inverse, computed at unit diagonal without a condition check; `None` unless positive definite.
#[must_use]
pub fn inverse(information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = scale(information);
    let mut unit = scaled(information, &scale);
    // The columns of a symmetric matrix are its rows.
    let size = unit.nrows();
    let values = unit.as_mut_slice();
    Arch::new().dispatch(GaussJordan { values, size })?;
    Some(scaled(&unit.transpose(), &scale))
}

/// Gauss-Jordan elimination of a symmetric matrix, row by row in `values`, which leaves its inverse;
/// `None` unless positive definite.
struct GaussJordan<'a> {
    values: &'a mut [f64],
    size: usize,
}

impl WithSimd for GaussJordan<'_> {
    type Output = Option<()>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Option<()> {
        let GaussJordan { values, size } = self;
        for p in 0..size {
            let pivot = values[p * size + p];
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            values[p * size + p] = 1.0;
            values[p * size..(p + 1) * size]
                .iter_mut()
                .for_each(|v| *v /= pivot);
            let (before, from) = values.split_at_mut(p * size);
            let (row, after) = from.split_at_mut(size);
            for other in before
                .chunks_exact_mut(size)
                .chain(after.chunks_exact_mut(size))
            {
                let factor = std::mem::replace(&mut other[p], 0.0);
                other
                    .iter_mut()
                    .zip(&*row)
                    .for_each(|(v, r)| *v -= factor * r);
            }
        }
        Some(())
    }
}

/// Solution d of (H + damping · diag H) d = g, computed at unit diagonal; `None` unless positive definite.
#[must_use]
pub fn solve_damped(
    information: &DMatrix<f64>,
    right: &DVector<f64>,
    damping: f64,
) -> Option<DVector<f64>> {
    let unit = scale(information);
    let mut h = scaled(information, &unit);
    for i in 0..h.nrows() {
        h[(i, i)] += damping;
    }
    let solution = Cholesky::new(h)?.solve(&right.component_mul(&unit));
    Some(solution.component_mul(&unit))
}

/// Aᵀ A, by blocks of columns up to the diagonal. The library's `tr_mul` goes column by column, which takes
/// four times as long.
#[must_use]
pub fn square(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    staircase_square(matrix, &vec![0; matrix.ncols()])
}

/// Aᵀ A of a staircase A: column j is zero above its row `first_rows[j]`, which does not fall with j.
#[must_use]
pub fn staircase_square(matrix: &DMatrix<f64>, first_rows: &[usize]) -> DMatrix<f64> {
    let n = matrix.ncols();
    let transposed = matrix.transpose();
    let mut square = DMatrix::zeros(n, n);
    for start in (0..n).step_by(BLOCK) {
        let end = (start + BLOCK).min(n);
        let rows = first_rows[start]..matrix.nrows();
        let mut block = square.view_mut((0, start), (end, end - start));
        let left = transposed.view_range(..end, rows.clone());
        block.gemm(1.0, &left, &matrix.view_range(rows, start..end), 0.0);
    }
    square.fill_lower_triangle_with_upper_triangle();
    square
}

/// Raises the variances of a covariance that are below those of another one; correlations stay.
#[must_use]
pub fn raise_variances(mut covariance: DMatrix<f64>, other: &DMatrix<f64>) -> DMatrix<f64> {
    for j in 0..covariance.nrows() {
        let (variance, least) = (covariance[(j, j)], other[(j, j)]);
        if variance < least {
            if variance > 0.0 {
                let factor = (least / variance).sqrt();
                covariance.row_mut(j).scale_mut(factor);
                covariance.column_mut(j).scale_mut(factor);
            } else {
                covariance.row_mut(j).copy_from(&other.row(j));
                covariance.column_mut(j).copy_from(&other.column(j));
            }
            covariance[(j, j)] = least;
        }
    }
    covariance
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn only_positive_definite_matrices_have_an_inverse() {
        let root = DMatrix::from_fn(29, 11, |i, j| (1.3 * (i + i * i * j) as f64).sin());
        let matrix = root.tr_mul(&root) + DMatrix::identity(11, 11);
        let unit = &matrix * inverse(&matrix).unwrap();
        assert_relative_eq!(unit, DMatrix::identity(11, 11), epsilon = 1e-9);
        let indefinite = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]);
        assert!(inverse(&indefinite).is_none());
        assert!(inverse(&DMatrix::from_element(2, 2, f64::NAN)).is_none());
        assert!(inverse(&DMatrix::zeros(0, 0)).is_some());
    }

    #[test]
    fn the_square_is_the_product_with_the_transpose() {
        for n in [0, 1, 63, 64, 65, 150] {
            let matrix = DMatrix::from_fn(7, n, |i, j| (3.0 * i as f64 - 0.7 * j as f64).sin());
            let plain = matrix.transpose() * &matrix;
            assert_relative_eq!(square(&matrix), plain, epsilon = 1e-13);
        }
    }

    #[test]
    fn the_square_of_a_staircase_is_that_of_the_whole_matrix() {
        let first_rows: Vec<usize> = (0..150).map(|j| j / 40 * 3).collect();
        let matrix = DMatrix::from_fn(11, 150, |i, j| {
            let value = (3.0 * i as f64 - 0.7 * j as f64).sin();
            if i < first_rows[j] { 0.0 } else { value }
        });
        let whole = square(&matrix);
        assert_relative_eq!(
            staircase_square(&matrix, &first_rows),
            whole,
            epsilon = 1e-13
        );
    }
}
