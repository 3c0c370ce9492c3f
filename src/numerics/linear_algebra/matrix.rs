//! Dense matrices whose rows are padded to whole vectors, and the products that the corrected
//! bounds take.
//!
//! Every sum has one order, so the width of the processor's vectors does not change a bit of it.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use std::ops::Range;

use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

use crate::numerics::vectors::row_products::StridedRows;
use crate::numerics::vectors::simd::{AlignedBuffer, VECTOR, load, store, vectorised};

/// Rows and lags that a loop computes side by side: enough independent sums to hide the latency of
/// one.
const ROWS_AT_ONCE: usize = 8;
/// Vectors and rows of a tile of a product: one load of a factor serves several vectors, and registers are left
/// for the factors.
const WIDE_TILE: usize = 2;
const ROWS_OF_WIDE_TILE: usize = 4;
/// Rows of the second matrix of a product that all tiles read before the next rows: they stay in the
/// processor's first cache.
const ROWS_IN_CACHE: usize = 64;
const LAGGED_ROWS_AT_ONCE: usize = 4;
const LAGS_AT_ONCE: usize = 7;
const ROWS_REACHED: usize = LAGGED_ROWS_AT_ONCE + LAGS_AT_ONCE - 1;
/// Longest lag of [`AlignedMatrix::lagged_products`].
pub(crate) const LONGEST_LAG: usize = 2 * LAGS_AT_ONCE - 1;
/// Zero rows after the last row: room for products and lags that are computed several at once.
const ZERO_ROWS: usize = LONGEST_LAG + LAGGED_ROWS_AT_ONCE;
const _: () = assert!(ZERO_ROWS >= ROWS_AT_ONCE);

/// Matrix in rows, each padded with zeros to whole vectors.
#[derive(Clone, Debug)]
pub(crate) struct AlignedMatrix {
    values: AlignedBuffer,
    rows: usize,
    columns: usize,
}

/// Columns rounded up to whole vectors.
fn width(columns: usize) -> usize {
    columns.max(1).next_multiple_of(VECTOR)
}

impl AlignedMatrix {
    pub fn zeros(rows: usize, columns: usize) -> AlignedMatrix {
        AlignedMatrix {
            values: AlignedBuffer::zeros((rows + ZERO_ROWS) * width(columns)),
            rows,
            columns,
        }
    }

    /// Matrix from rows that are padded already.
    pub fn from_padded_rows(padded: &[f64], columns: usize) -> AlignedMatrix {
        let mut rows = AlignedMatrix::zeros(padded.len() / width(columns), columns);
        rows.values_mut().copy_from_slice(padded);
        rows
    }

    /// Copy of a symmetric matrix.
    pub fn from_symmetric(matrix: &DMatrix<f64>) -> AlignedMatrix {
        let mut padded = AlignedMatrix::zeros(matrix.nrows(), matrix.ncols());
        padded
            .rows_mut()
            .zip(matrix.column_iter())
            .for_each(|(row, own)| {
                row.iter_mut()
                    .zip(own.iter())
                    .for_each(|(to, from)| *to = *from);
            });
        padded
    }

    /// Copy without padding.
    pub fn to_dense(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.rows, self.columns, |i, j| {
            self.values()[i * self.width() + j]
        })
    }

    /// Distance between the beginnings of two rows.
    pub fn width(&self) -> usize {
        width(self.columns)
    }

    pub fn columns(&self) -> usize {
        self.columns
    }

    pub fn values(&self) -> &[f64] {
        &self.values.slice()[..self.rows * self.width()]
    }

    pub fn values_mut(&mut self) -> &mut [f64] {
        let length = self.rows * self.width();
        &mut self.values.slice_mut()[..length]
    }

    pub fn rows_mut(&mut self) -> std::slice::ChunksExactMut<'_, f64> {
        let width = self.width();
        self.values_mut().chunks_exact_mut(width)
    }

    pub fn rows(&self) -> std::slice::ChunksExact<'_, f64> {
        self.values().chunks_exact(self.width())
    }

    /// Diagonal of a square matrix.
    pub fn diagonal(&self) -> impl Iterator<Item = f64> + '_ {
        self.rows().enumerate().map(|(i, row)| row[i])
    }

    /// Copy with zero rows appended.
    pub fn with_zero_rows(&self, rows: usize) -> AlignedMatrix {
        let mut longer = AlignedMatrix::zeros(self.rows + rows, self.columns);
        longer.values_mut()[..self.values().len()].copy_from_slice(self.values());
        longer
    }

    /// Keeps the first rows, up to a number.
    pub fn truncate(&mut self, rows: usize) {
        let from = rows.min(self.rows) * self.width();
        self.values_mut()[from..].fill(0.0);
        self.rows = rows.min(self.rows);
    }

    /// Σ a_ij b_ij over all entries, summed lane by lane.
    pub fn dot(&self, other: &AlignedMatrix) -> f64 {
        let (a, b) = (
            self.values().as_chunks::<VECTOR>().0,
            other.values().as_chunks::<VECTOR>().0,
        );
        let mut sums = [0.0; VECTOR];
        for (a, b) in a.iter().zip(b) {
            for i in 0..VECTOR {
                sums[i] += a[i] * b[i];
            }
        }
        sums.iter().sum()
    }

    /// Adds `factor` times another matrix.
    pub fn add_scaled(&mut self, other: &AlignedMatrix, factor: f64) {
        let (sums, values) = (self.values_mut(), other.values());
        vectorised(
            #[inline(always)]
            || {
                sums.iter_mut()
                    .zip(values)
                    .for_each(|(sum, v)| *sum += factor * v);
            },
        );
    }

    pub fn scaled_by(mut self, factor: f64) -> AlignedMatrix {
        let values = self.values_mut();
        vectorised(
            #[inline(always)]
            || values.iter_mut().for_each(|v| *v *= factor),
        );
        self
    }

    /// Product with another matrix.
    pub fn product(&self, matrix: &AlignedMatrix) -> AlignedMatrix {
        let mut to = AlignedMatrix::zeros(self.rows, matrix.columns);
        to.add_product(self, matrix);
        to
    }

    /// Adds the product of two matrices.
    pub fn add_product(&mut self, rows: &AlignedMatrix, matrix: &AlignedMatrix) {
        Arch::new().dispatch(Product::<false> {
            from: rows,
            matrix,
            to: self.values.slice_mut(),
        });
    }

    /// Product of the transpose with another matrix.
    pub fn transposed_product(&self, matrix: &AlignedMatrix) -> AlignedMatrix {
        let mut to = AlignedMatrix::zeros(self.columns, matrix.columns);
        Arch::new().dispatch(Product::<true> {
            from: self,
            matrix,
            to: to.values.slice_mut(),
        });
        to
    }

    /// self · inner · self, both symmetric.
    pub fn sandwich(&self, inner: &AlignedMatrix) -> AlignedMatrix {
        self.product(&inner.product(self))
    }

    /// Gram matrix Σ s sᵀ of the rows s.
    pub fn gram(&self) -> AlignedMatrix {
        let mut gram = AlignedMatrix::zeros(self.columns, self.columns);
        Arch::new().dispatch(Gram {
            of: self,
            to: gram.values.slice_mut(),
        });
        let width = gram.width();
        for i in 0..self.columns {
            for j in 0..i {
                gram.values.slice_mut()[j * width + i] = gram.values.slice()[i * width + j];
            }
        }
        gram
    }

    /// Σ_k a_k · b_{k+lag} over rows, at lags 0, 1, …
    pub fn lagged_products(&self, later: &AlignedMatrix, lags: usize) -> Vec<f64> {
        let mut sums = Arch::new()
            .dispatch(LaggedProducts { a: self, b: later })
            .to_vec();
        sums.truncate(lags);
        sums
    }

    /// Σ_k a_k b_{k+lag} over rows, column by column.
    pub fn lagged_products_by_column(&self, later: &AlignedMatrix, lag: usize) -> Vec<f64> {
        let mut sums = vec![0.0; self.width()];
        vectorised(
            #[inline(always)]
            || {
                for (a, b) in self.rows().zip(later.rows().skip(lag)) {
                    for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
                        *sum += a * b;
                    }
                }
            },
        );
        sums
    }

    /// Filters each column by 1/A forwards in time, A = 1 + Σ a_j z⁻ʲ.
    pub fn filter_columns(&mut self, coefficients: &[f64]) {
        let width = self.width();
        Arch::new().dispatch(RecursiveFilter {
            coefficients,
            series: self.values_mut(),
            width,
            back: false,
        });
    }

    /// Filters each column by 1/A backwards in time.
    pub fn filter_columns_backwards(&mut self, coefficients: &[f64]) {
        let width = self.width();
        Arch::new().dispatch(RecursiveFilter {
            coefficients,
            series: self.values_mut(),
            width,
            back: true,
        });
    }
}

struct Gram<'a> {
    of: &'a AlignedMatrix,
    to: &'a mut [f64],
}

impl WithSimd for Gram<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let AlignedMatrix { rows, columns, .. } = *self.of;
        let used: Vec<usize> = (0..columns)
            .step_by(VECTOR)
            .map(|first| (columns - first).min(VECTOR))
            .collect();
        let rows = StridedRows {
            values: self.of.values(),
            stride: width(columns),
            vector_stride: VECTOR,
            count: rows,
        };
        rows.add_gram(simd, &used, self.to, width(columns));
    }
}

/// Product of one matrix, or of its transpose, with another.
struct Product<'a, const TRANSPOSED: bool> {
    from: &'a AlignedMatrix,
    matrix: &'a AlignedMatrix,
    to: &'a mut [f64],
}

impl<const TRANSPOSED: bool> WithSimd for Product<'_, TRANSPOSED> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        for first in (0..self.matrix.rows).step_by(ROWS_IN_CACHE) {
            let last = self.matrix.rows.min(first + ROWS_IN_CACHE);
            self.add_rows(simd, first..last);
        }
    }
}

impl<const TRANSPOSED: bool> Product<'_, TRANSPOSED> {
    /// Adds the products with some rows of the second matrix.
    #[inline(always)]
    fn add_rows<S: Simd>(&mut self, simd: S, of: Range<usize>) {
        let (from, width) = (self.from, self.matrix.width());
        let rows = if TRANSPOSED { from.columns } else { from.rows };
        let mut lane = 0;
        while lane + WIDE_TILE * S::F64_LANES <= width {
            for row in (0..rows).step_by(ROWS_OF_WIDE_TILE) {
                self.add_tile::<S, ROWS_OF_WIDE_TILE, WIDE_TILE>(simd, &of, row, lane);
            }
            lane += WIDE_TILE * S::F64_LANES;
        }
        for lane in (lane..width).step_by(S::F64_LANES) {
            for row in (0..rows).step_by(ROWS_AT_ONCE) {
                self.add_tile::<S, ROWS_AT_ONCE, 1>(simd, &of, row, lane);
            }
        }
    }

    /// Adds to a tile of `T` rows and `C` vectors.
    #[inline(always)]
    fn add_tile<S: Simd, const T: usize, const C: usize>(
        &mut self,
        simd: S,
        of: &Range<usize>,
        row: usize,
        lane: usize,
    ) {
        let (from, width) = (self.from.width(), self.matrix.width());
        let values = self.from.values.slice();
        let mut sums = [[simd.splat_f64s(0.0); C]; T];
        for t in 0..T {
            for c in 0..C {
                sums[t][c] = load::<S>(self.to, (row + t) * width + lane + c * S::F64_LANES);
            }
        }
        let rows = &self.matrix.values()[of.start * width..of.end * width];
        for (i, entries) in of.clone().zip(rows.chunks_exact(width)) {
            let entries = S::as_simd_f64s(&entries[lane..][..C * S::F64_LANES]).0;
            // Factors of the row `i`, at equal distances.
            let (factors, distance) = if TRANSPOSED {
                (&values[i * from + row..][..T], 1)
            } else {
                (&values[row * from + i..][..=(T - 1) * from], from)
            };
            for t in 0..T {
                let factor = simd.splat_f64s(factors[t * distance]);
                for c in 0..C {
                    sums[t][c] = simd.mul_add_f64s(factor, entries[c], sums[t][c]);
                }
            }
        }
        for t in 0..T {
            for c in 0..C {
                store::<S>(
                    self.to,
                    (row + t) * width + lane + c * S::F64_LANES,
                    sums[t][c],
                );
            }
        }
    }
}

/// Recursive filter u = s/A of each column in place, starting from zero.
struct RecursiveFilter<'a> {
    coefficients: &'a [f64],
    series: &'a mut [f64],
    width: usize,
    back: bool,
}

impl WithSimd for RecursiveFilter<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let RecursiveFilter {
            coefficients,
            series,
            width,
            back,
        } = self;
        let rows = series.len() / width;
        for k in 1..rows {
            for lane in (0..width).step_by(S::F64_LANES) {
                let place = |k: usize| {
                    if back {
                        (rows - 1 - k) * width + lane
                    } else {
                        k * width + lane
                    }
                };
                let mut now = load::<S>(series, place(k));
                // The most recent value last: the sum depends on it.
                for j in (1..=coefficients.len().min(k)).rev() {
                    let factor = simd.splat_f64s(-coefficients[j - 1]);
                    now = simd.mul_add_f64s(factor, load::<S>(series, place(k - j)), now);
                }
                store::<S>(series, place(k), now);
            }
        }
    }
}

struct LaggedProducts<'a> {
    a: &'a AlignedMatrix,
    b: &'a AlignedMatrix,
}

impl WithSimd for LaggedProducts<'_> {
    type Output = [f64; LONGEST_LAG + 1];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut sums = [0.0; LONGEST_LAG + 1];
        for (group, sums) in sums.chunks_exact_mut(LAGS_AT_ONCE).enumerate() {
            sums.copy_from_slice(&self.sums_from_lag(simd, group * LAGS_AT_ONCE));
        }
        sums
    }
}

impl LaggedProducts<'_> {
    /// Sums at `LAGS_AT_ONCE` lags from one lag on. Eight partial sums are added in a fixed order.
    #[inline(always)]
    fn sums_from_lag<S: Simd>(&self, simd: S, lag: usize) -> [f64; LAGS_AT_ONCE] {
        let width = self.a.width();
        let (a, b) = (self.a.values.slice(), self.b.values.slice());
        let mut lanes = [[0.0; VECTOR]; LAGS_AT_ONCE];
        for part in (0..VECTOR).step_by(S::F64_LANES) {
            let mut sums = [simd.splat_f64s(0.0); LAGS_AT_ONCE];
            for lane in (part..width).step_by(VECTOR) {
                for k in (0..self.a.rows).step_by(LAGGED_ROWS_AT_ONCE) {
                    let a = &a[k * width..(k + LAGGED_ROWS_AT_ONCE) * width];
                    let b = &b[(k + lag) * width..(k + lag + ROWS_REACHED) * width];
                    let mut now = [simd.splat_f64s(0.0); LAGGED_ROWS_AT_ONCE];
                    for i in 0..LAGGED_ROWS_AT_ONCE {
                        now[i] = load::<S>(a, i * width + lane);
                    }
                    let mut later = [simd.splat_f64s(0.0); ROWS_REACHED];
                    for i in 0..ROWS_REACHED {
                        later[i] = load::<S>(b, i * width + lane);
                    }
                    for n in 0..LAGS_AT_ONCE {
                        for i in 0..LAGGED_ROWS_AT_ONCE {
                            sums[n] = simd.mul_add_f64s(now[i], later[i + n], sums[n]);
                        }
                    }
                }
            }
            for n in 0..LAGS_AT_ONCE {
                store::<S>(&mut lanes[n], part, sums[n]);
            }
        }
        lanes.map(|lanes| lanes.iter().sum())
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn sample_matrix(rows: usize, columns: usize) -> AlignedMatrix {
        let mut matrix = AlignedMatrix::zeros(rows, columns);
        for (k, row) in matrix.rows_mut().enumerate() {
            row[..columns]
                .iter_mut()
                .enumerate()
                .for_each(|(j, v)| *v = (1.3 * (k + k * k * j) as f64 + 0.7 * j as f64).sin());
        }
        matrix
    }

    #[test]
    fn products_gram_and_lags_match_plain_matrices_of_odd_sizes() {
        let (a, b) = (sample_matrix(29, 11), sample_matrix(29, 11));
        let (plain, square) = (a.to_dense(), sample_matrix(11, 11).to_dense());
        assert_relative_eq!(
            a.product(&sample_matrix(11, 11)).to_dense(),
            &plain * square,
            epsilon = 1e-12
        );
        let (long, tall) = (sample_matrix(11, 150), sample_matrix(150, 13));
        assert_relative_eq!(
            long.product(&tall).to_dense(),
            long.to_dense() * tall.to_dense(),
            epsilon = 1e-12
        );
        assert_relative_eq!(
            tall.transposed_product(&sample_matrix(150, 29)).to_dense(),
            tall.to_dense().tr_mul(&sample_matrix(150, 29).to_dense()),
            epsilon = 1e-12
        );
        assert_relative_eq!(
            a.gram().to_dense(),
            plain.transpose() * &plain,
            epsilon = 1e-12
        );
        for (lag, sum) in a
            .lagged_products(&b, LONGEST_LAG + 1)
            .into_iter()
            .enumerate()
        {
            let expected: f64 = (lag..29)
                .map(|k| plain.row(k - lag).dot(&plain.row(k)))
                .sum();
            assert_relative_eq!(sum, expected, epsilon = 1e-12);
        }
    }

    /// Bits of all products, computed with vectors of one width.
    fn bits<S: Simd>(simd: S) -> Vec<u64> {
        let (a, matrix) = (sample_matrix(29, 11), sample_matrix(11, 11));
        let (mut product, mut gram, mut series) = (
            AlignedMatrix::zeros(29, 11),
            AlignedMatrix::zeros(11, 11),
            sample_matrix(29, 11),
        );
        simd.vectorize(Product::<false> {
            from: &a,
            matrix: &matrix,
            to: product.values.slice_mut(),
        });
        simd.vectorize(Gram {
            of: &a,
            to: gram.values.slice_mut(),
        });
        let lagged = simd.vectorize(LaggedProducts { a: &a, b: &product });
        for back in [false, true] {
            simd.vectorize(RecursiveFilter {
                coefficients: &[-0.8, 0.3],
                series: series.values_mut(),
                width: a.width(),
                back,
            });
        }
        // Tiles reach differently far beyond the diagonal; the lower triangle counts.
        let gram = gram.rows().enumerate();
        let lower: Vec<f64> = gram.flat_map(|(i, row)| row[..=i].to_vec()).collect();
        let all = product
            .values()
            .iter()
            .chain(&lower)
            .chain(&lagged)
            .chain(series.values());
        all.map(|v| v.to_bits()).collect()
    }

    #[test]
    fn every_vector_width_gives_the_same_bits() {
        let narrow = bits(pulp::Scalar);
        assert!(narrow.iter().all(|bits| f64::from_bits(*bits).is_finite()));
        #[cfg(target_arch = "x86_64")]
        {
            assert!(
                pulp::x86::V3::try_new().is_none_or(|simd| bits(simd) == narrow),
                "four lanes"
            );
            assert!(
                pulp::x86::V4::try_new().is_none_or(|simd| bits(simd) == narrow),
                "eight lanes"
            );
        }
    }
}
