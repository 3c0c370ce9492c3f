//! Rows of numbers padded to whole vectors, and the products of them that the corrected bounds
//! take. In each of them a number is summed in one order, whatever the width of the processor's
//! vectors.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

use super::row_products::Rows;
use super::simd::{Aligned, VECTOR, load, store};

/// Rows side by side in a product, and lags: as many sums as hide how long one of them waits for
/// itself.
const ROWS_AT_ONCE: usize = 8;
const SHIFTED_AT_ONCE: usize = 4;
const LAGS_AT_ONCE: usize = 7;
const REACHED: usize = SHIFTED_AT_ONCE + LAGS_AT_ONCE - 1;
/// The longest lag that can be asked for.
pub(crate) const LONGEST_LAG: usize = 2 * LAGS_AT_ONCE - 1;
/// Rows of zeros behind the last one, so that neither products nor lags end within what they do at
/// once.
const BEYOND: usize = LONGEST_LAG + SHIFTED_AT_ONCE;
const _: () = assert!(BEYOND >= ROWS_AT_ONCE);

/// Rows of as many columns each.
#[derive(Clone, Debug)]
pub(crate) struct Padded {
    values: Aligned,
    rows: usize,
    columns: usize,
}

/// Columns padded to whole vectors.
fn width(columns: usize) -> usize {
    columns.max(1).next_multiple_of(VECTOR)
}

impl Padded {
    pub fn zeros(rows: usize, columns: usize) -> Padded {
        Padded {
            values: Aligned::zeros((rows + BEYOND) * width(columns)),
            rows,
            columns,
        }
    }

    /// Rows that were padded before.
    pub fn of_rows(padded: &[f64], columns: usize) -> Padded {
        let mut rows = Padded::zeros(padded.len() / width(columns), columns);
        rows.values_mut().copy_from_slice(padded);
        rows
    }

    /// Numbers below each other.
    pub fn column(values: &[f64]) -> Padded {
        let mut column = Padded::zeros(values.len(), 1);
        column
            .rows_mut()
            .zip(values)
            .for_each(|(row, value)| row[0] = *value);
        column
    }

    /// A symmetric matrix.
    pub fn symmetric(matrix: &DMatrix<f64>) -> Padded {
        let mut padded = Padded::zeros(matrix.nrows(), matrix.ncols());
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

    /// The same without padding.
    pub fn matrix(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.rows, self.columns, |i, j| {
            self.values()[i * self.width() + j]
        })
    }

    /// Numbers from the beginning of a row to that of the next.
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

    /// Of a square matrix.
    pub fn diagonal(&self) -> impl Iterator<Item = f64> + '_ {
        self.rows().enumerate().map(|(i, row)| row[i])
    }

    /// The same followed by rows of zeros.
    pub fn followed_by(&self, rows: usize) -> Padded {
        let mut longer = Padded::zeros(self.rows + rows, self.columns);
        longer.values_mut()[..self.values().len()].copy_from_slice(self.values());
        longer
    }

    /// Leaves out what follows some rows.
    pub fn truncate(&mut self, rows: usize) {
        let from = rows.min(self.rows) * self.width();
        self.values_mut()[from..].fill(0.0);
        self.rows = rows.min(self.rows);
    }

    /// Σ of all numbers times those of another; lanes are summed apart, of which none waits for the
    /// others.
    pub fn dot(&self, other: &Padded) -> f64 {
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

    /// Adds another times a factor.
    pub fn add(&mut self, other: &Padded, factor: f64) {
        let (sums, values) = (self.values_mut(), other.values());
        Arch::new().dispatch(|| {
            sums.iter_mut()
                .zip(values)
                .for_each(|(sum, v)| *sum += factor * v)
        });
    }

    pub fn times(mut self, factor: f64) -> Padded {
        let values = self.values_mut();
        Arch::new().dispatch(|| values.iter_mut().for_each(|v| *v *= factor));
        self
    }

    /// Each row times a matrix.
    pub fn product(&self, matrix: &Padded) -> Padded {
        let mut to = Padded::zeros(self.rows, matrix.columns);
        to.add_product(self, matrix);
        to
    }

    /// Adds rows times a matrix.
    pub fn add_product(&mut self, rows: &Padded, matrix: &Padded) {
        Arch::new().dispatch(Product {
            from: rows,
            matrix,
            to: self.values.slice_mut(),
        });
    }

    /// Of symmetric matrices the product self · inner · self.
    pub fn about(&self, inner: &Padded) -> Padded {
        self.product(&inner.product(self))
    }

    /// The inverse of a symmetric matrix, by elimination; none of one that is not positive
    /// definite.
    pub fn inverse(mut self) -> Option<Padded> {
        let (width, size) = (self.width(), self.rows);
        let values = self.values_mut();
        let regular = Arch::new().dispatch(|| {
            for p in 0..size {
                let pivot = values[p * width + p];
                if pivot.is_nan() || pivot <= 0.0 {
                    return false;
                }
                values[p * width + p] = 1.0;
                values[p * width..(p + 1) * width]
                    .iter_mut()
                    .for_each(|v| *v /= pivot);
                let (before, from) = values.split_at_mut(p * width);
                let (row, after) = from.split_at_mut(width);
                for other in before
                    .chunks_exact_mut(width)
                    .chain(after.chunks_exact_mut(width))
                {
                    let factor = std::mem::replace(&mut other[p], 0.0);
                    other
                        .iter_mut()
                        .zip(&*row)
                        .for_each(|(v, r)| *v -= factor * r);
                }
            }
            true
        });
        regular.then_some(self)
    }

    /// Σ s sᵀ of the rows.
    pub fn squares(&self) -> Padded {
        let mut squares = Padded::zeros(self.columns, self.columns);
        Arch::new().dispatch(Squares {
            of: self,
            to: squares.values.slice_mut(),
        });
        let width = squares.width();
        for i in 0..self.columns {
            for j in 0..i {
                squares.values.slice_mut()[j * width + i] = squares.values.slice()[i * width + j];
            }
        }
        squares
    }

    /// Σ a_k · b_{k+lag} over rows at lags 0, 1, …
    pub fn lagged(&self, later: &Padded, lags: usize) -> Vec<f64> {
        let mut sums = Arch::new().dispatch(Lagged { a: self, b: later }).to_vec();
        sums.truncate(lags);
        sums
    }

    /// Σ a_k b_{k+lag} over rows, column by column.
    pub fn column_products(&self, later: &Padded, lag: usize) -> Vec<f64> {
        let mut sums = vec![0.0; self.width()];
        Arch::new().dispatch(|| {
            for (a, b) in self.rows().zip(later.rows().skip(lag)) {
                sums.iter_mut()
                    .zip(a.iter().zip(b))
                    .for_each(|(sum, (a, b))| *sum += a * b);
            }
        });
        sums
    }

    /// Each column filtered by a process.
    pub fn filter(&mut self, coefficients: &[f64]) {
        let width = self.width();
        Arch::new().dispatch(Filter {
            coefficients,
            series: self.values_mut(),
            width,
            back: false,
        });
    }

    /// The same backwards in time.
    pub fn filter_back(&mut self, coefficients: &[f64]) {
        let width = self.width();
        Arch::new().dispatch(Filter {
            coefficients,
            series: self.values_mut(),
            width,
            back: true,
        });
    }
}

struct Squares<'a> {
    of: &'a Padded,
    to: &'a mut [f64],
}

impl WithSimd for Squares<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Padded { rows, columns, .. } = *self.of;
        let used: Vec<usize> = (0..columns)
            .step_by(VECTOR)
            .map(|first| (columns - first).min(VECTOR))
            .collect();
        let rows = Rows {
            values: self.of.values(),
            stride: width(columns),
            samples: rows,
        };
        rows.add_squares(simd, &used, self.to, width(columns));
    }
}

struct Product<'a> {
    from: &'a Padded,
    matrix: &'a Padded,
    to: &'a mut [f64],
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (from, width) = (self.from.width(), self.matrix.width());
        for row in (0..self.from.rows).step_by(ROWS_AT_ONCE) {
            let rows = &self.from.values.slice()[row * from..(row + ROWS_AT_ONCE) * from];
            for lane in (0..width).step_by(S::F64_LANES) {
                let mut sums = [simd.splat_f64s(0.0); ROWS_AT_ONCE];
                for n in 0..ROWS_AT_ONCE {
                    sums[n] = load::<S>(self.to, (row + n) * width + lane);
                }
                for (i, matrix) in self.matrix.rows().enumerate() {
                    let entries = load::<S>(matrix, lane);
                    for n in 0..ROWS_AT_ONCE {
                        sums[n] = simd.mul_add_f64s(
                            simd.splat_f64s(rows[n * from + i]),
                            entries,
                            sums[n],
                        );
                    }
                }
                for n in 0..ROWS_AT_ONCE {
                    store::<S>(self.to, (row + n) * width + lane, sums[n]);
                }
            }
        }
    }
}

/// u = s/A of each column in place, at rest before its first row; backwards in time, at rest after
/// its last.
struct Filter<'a> {
    coefficients: &'a [f64],
    series: &'a mut [f64],
    width: usize,
    back: bool,
}

impl WithSimd for Filter<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Filter {
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
                // What is nearest last: it is what the sum would wait for.
                for j in (1..=coefficients.len().min(k)).rev() {
                    let factor = simd.splat_f64s(-coefficients[j - 1]);
                    now = simd.mul_add_f64s(factor, load::<S>(series, place(k - j)), now);
                }
                store::<S>(series, place(k), now);
            }
        }
    }
}

struct Lagged<'a> {
    a: &'a Padded,
    b: &'a Padded,
}

impl WithSimd for Lagged<'_> {
    type Output = [f64; LONGEST_LAG + 1];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut sums = [0.0; LONGEST_LAG + 1];
        for (group, sums) in sums.chunks_exact_mut(LAGS_AT_ONCE).enumerate() {
            sums.copy_from_slice(&self.from(simd, group * LAGS_AT_ONCE));
        }
        sums
    }
}

impl Lagged<'_> {
    /// Those from one lag on. Lanes are summed eight apart and then in one order, so that the width
    /// of vectors does not show.
    #[inline(always)]
    fn from<S: Simd>(&self, simd: S, lag: usize) -> [f64; LAGS_AT_ONCE] {
        let width = self.a.width();
        let (a, b) = (self.a.values.slice(), self.b.values.slice());
        let mut lanes = [[0.0; VECTOR]; LAGS_AT_ONCE];
        for part in (0..VECTOR).step_by(S::F64_LANES) {
            let mut sums = [simd.splat_f64s(0.0); LAGS_AT_ONCE];
            for lane in (part..width).step_by(VECTOR) {
                for k in (0..self.a.rows).step_by(SHIFTED_AT_ONCE) {
                    let a = &a[k * width..(k + SHIFTED_AT_ONCE) * width];
                    let b = &b[(k + lag) * width..(k + lag + REACHED) * width];
                    let mut now = [simd.splat_f64s(0.0); SHIFTED_AT_ONCE];
                    for i in 0..SHIFTED_AT_ONCE {
                        now[i] = load::<S>(a, i * width + lane);
                    }
                    let mut later = [simd.splat_f64s(0.0); REACHED];
                    for i in 0..REACHED {
                        later[i] = load::<S>(b, i * width + lane);
                    }
                    for n in 0..LAGS_AT_ONCE {
                        for i in 0..SHIFTED_AT_ONCE {
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

    fn rows(rows: usize, columns: usize) -> Padded {
        let mut padded = Padded::zeros(rows, columns);
        for (k, row) in padded.rows_mut().enumerate() {
            row[..columns]
                .iter_mut()
                .enumerate()
                .for_each(|(j, v)| *v = (1.3 * (k + k * k * j) as f64 + 0.7 * j as f64).sin());
        }
        padded
    }

    #[test]
    fn products_squares_and_lags_are_those_of_matrices_also_of_odd_sizes() {
        let (a, b) = (rows(29, 11), rows(29, 11));
        let (plain, square) = (a.matrix(), rows(11, 11).matrix());
        assert_relative_eq!(
            a.product(&rows(11, 11)).matrix(),
            &plain * square,
            epsilon = 1e-12
        );
        assert_relative_eq!(
            a.squares().matrix(),
            plain.transpose() * &plain,
            epsilon = 1e-12
        );
        for (lag, sum) in a.lagged(&b, LONGEST_LAG + 1).into_iter().enumerate() {
            let expected: f64 = (lag..29)
                .map(|k| plain.row(k - lag).dot(&plain.row(k)))
                .sum();
            assert_relative_eq!(sum, expected, epsilon = 1e-12);
        }
    }

    /// What the kernels give with vectors of a width, as bits.
    fn bits<S: Simd>(simd: S) -> Vec<u64> {
        let (a, matrix) = (rows(29, 11), rows(11, 11));
        let (mut product, mut squares, mut series) =
            (Padded::zeros(29, 11), Padded::zeros(11, 11), rows(29, 11));
        simd.vectorize(Product {
            from: &a,
            matrix: &matrix,
            to: product.values.slice_mut(),
        });
        simd.vectorize(Squares {
            of: &a,
            to: squares.values.slice_mut(),
        });
        let lagged = simd.vectorize(Lagged { a: &a, b: &product });
        for back in [false, true] {
            simd.vectorize(Filter {
                coefficients: &[-0.8, 0.3],
                series: series.values_mut(),
                width: a.width(),
                back,
            });
        }
        let all = product
            .values()
            .iter()
            .chain(squares.values())
            .chain(&lagged)
            .chain(series.values());
        all.map(|v| v.to_bits()).collect()
    }

    #[test]
    fn the_width_of_vectors_does_not_show_in_a_bit() {
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

    #[test]
    fn the_inverse_is_one_and_there_is_none_of_what_is_not_positive_definite() {
        let matrix = rows(29, 11).squares();
        let unit = matrix.matrix() * matrix.clone().inverse().unwrap().matrix();
        assert_relative_eq!(unit, DMatrix::identity(11, 11), epsilon = 1e-9);
        assert!(
            Padded::symmetric(&DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]))
                .inverse()
                .is_none()
        );
        assert!(
            Padded::symmetric(&DMatrix::from_element(2, 2, f64::NAN))
                .inverse()
                .is_none()
        );
    }
}
