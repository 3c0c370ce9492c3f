//! Products of matrices of a few rows whose sizes are compile-time constants. From six rows on, the
//! library's product packs and allocates, which costs more than the product.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use nalgebra::{ArrayStorage, SMatrix};

/// a b, with fused multiplication.
#[inline(always)]
#[must_use]
pub(crate) fn product<const N: usize, const M: usize, const P: usize>(
    a: &SMatrix<f64, N, M>,
    b: &SMatrix<f64, M, P>,
) -> SMatrix<f64, N, P> {
    product_with(a, |k, j| b.data.0[j][k])
}

/// a bᵀ, with fused multiplication.
#[inline(always)]
#[must_use]
pub(crate) fn product_transposed<const N: usize, const M: usize, const P: usize>(
    a: &SMatrix<f64, N, M>,
    b: &SMatrix<f64, P, M>,
) -> SMatrix<f64, N, P> {
    product_with(a, |k, j| b.data.0[k][j])
}

/// Product of a with the matrix whose entry in row k and column j is `b(k, j)`.
#[inline(always)]
fn product_with<const N: usize, const M: usize, const P: usize>(
    a: &SMatrix<f64, N, M>,
    b: impl Fn(usize, usize) -> f64,
) -> SMatrix<f64, N, P> {
    let mut columns = [[0.0; N]; P];
    for (j, column) in columns.iter_mut().enumerate() {
        for (k, a) in a.data.0.iter().enumerate() {
            let entry = b(k, j);
            for (sum, a) in column.iter_mut().zip(a) {
                *sum = a.mul_add(entry, *sum);
            }
        }
    }
    SMatrix::from_array_storage(ArrayStorage(columns))
}

/// a b aᵀ, with fused multiplication.
#[inline(always)]
#[must_use]
pub(crate) fn sandwich<const N: usize, const M: usize>(
    a: &SMatrix<f64, N, M>,
    b: &SMatrix<f64, M, M>,
) -> SMatrix<f64, N, N> {
    product_transposed(&product(a, b), a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn products_are_those_of_the_definition() {
        let a = SMatrix::<f64, 3, 4>::from_fn(|i, k| (1.3 * i as f64 - 0.7 * k as f64).sin());
        let b = SMatrix::<f64, 4, 5>::from_fn(|k, j| (0.9 * k as f64 + 2.1 * j as f64).cos());
        let square = SMatrix::<f64, 4, 4>::from_fn(|k, j| (k * k + 3 * j) as f64);
        let entry = |i: usize, j: usize| -> f64 { (0..4).map(|k| a[(i, k)] * b[(k, j)]).sum() };
        let whole = product(&a, &b);
        for (i, j) in (0..3).flat_map(|i| (0..5).map(move |j| (i, j))) {
            assert_relative_eq!(whole[(i, j)], entry(i, j), epsilon = 1e-14);
        }
        assert_eq!(product_transposed(&a, &b.transpose()), whole);
        assert_relative_eq!(
            sandwich(&a, &square),
            a * square * a.transpose(),
            epsilon = 1e-12
        );
    }
}
