//! Square roots of covariances: R with R Rᵀ = C, block by block.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::symmetric::{scale, scaled};

/// Share of the largest variance below which the variance of a direction counts as zero.
pub const EXACT: f64 = 1e-14;

/// Square root of a positive semidefinite covariance by Cholesky's method with pivoting. Directions
/// whose variance is below `least` of the largest one are left out, so the root has one column per
/// remaining direction.
#[must_use]
pub fn root(covariance: &DMatrix<f64>, least: f64) -> DMatrix<f64> {
    root_with_pivots(covariance, least).0
}

/// Root D S, with the standard deviations D and the symmetric root S of the correlations. It is
/// continuous in the covariance, and so are draws made with it. With [`root`] a small difference of
/// two variances may change the order of the pivots, and with it every draw.
#[must_use]
pub fn continuous_root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let correlations = scaled(covariance, &scale(covariance));
    let deviations = covariance.diagonal().map(|v| v.max(0.0).sqrt());
    DMatrix::from_diagonal(&deviations) * symmetric_root(correlations)
}

/// The symmetric root, S S = C.
#[must_use]
fn symmetric_root(matrix: DMatrix<f64>) -> DMatrix<f64> {
    if matrix.is_empty() {
        return matrix;
    }
    let eigen = matrix.symmetric_eigen();
    let roots = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
    let vectors = &eigen.eigenvectors;
    vectors * DMatrix::from_diagonal(&roots) * vectors.transpose()
}

/// Root of a covariance of all quantities from that of a few. `covariance` is between all
/// quantities and the few, `places` has the indices of the few among all. The rows of the few are
/// their own root; all rows times these rows give `covariance`.
#[must_use]
pub fn root_of_some(covariance: &DMatrix<f64>, places: &[usize], least: f64) -> DMatrix<f64> {
    pivoted(covariance, places, least).0
}

/// Root as by [`root`], with the row of each column's pivot. These rows are a lower triangular
/// matrix, the exact root of their own covariance.
#[must_use]
fn root_with_pivots(covariance: &DMatrix<f64>, least: f64) -> (DMatrix<f64>, Vec<usize>) {
    let all: Vec<usize> = (0..covariance.nrows()).collect();
    pivoted(covariance, &all, least)
}

fn pivoted(covariance: &DMatrix<f64>, places: &[usize], least: f64) -> (DMatrix<f64>, Vec<usize>) {
    let own = places.iter().enumerate().map(|(j, i)| covariance[(*i, j)]);
    let mut rest = DVector::from_iterator(places.len(), own);
    let limit = least * rest.amax();
    let mut root = DMatrix::<f64>::zeros(covariance.nrows(), places.len());
    let mut pivots = Vec::new();
    while pivots.len() < places.len() {
        let (pivot, rank) = (rest.imax(), pivots.len());
        if rest[pivot] <= limit {
            break;
        }
        let mut column = covariance.column(pivot).into_owned();
        for k in 0..rank {
            column.axpy(-root[(places[pivot], k)], &root.column(k), 1.0);
        }
        column /= rest[pivot].sqrt();
        for (rest, place) in rest.iter_mut().zip(places) {
            *rest -= column[*place] * column[*place];
        }
        rest[pivot] = 0.0;
        root.set_column(rank, &column);
        pivots.push(places[pivot]);
    }
    (root.resize_horizontally(pivots.len(), 0.0), pivots)
}

/// Root of a block diagonal covariance.
#[derive(Clone, Debug, Default)]
pub struct BlockRoot {
    /// Roots of the blocks.
    blocks: Vec<DMatrix<f64>>,
}

impl BlockRoot {
    /// Appends a block.
    pub fn push(&mut self, root: DMatrix<f64>) {
        self.blocks.push(root);
    }

    /// Number of columns.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.blocks.iter().map(DMatrix::ncols).sum()
    }

    /// Blocks with their rows and columns.
    fn places(&self) -> impl Iterator<Item = (&DMatrix<f64>, Range<usize>, Range<usize>)> {
        let (mut row, mut column) = (0, 0);
        self.blocks.iter().map(move |block| {
            let rows = row..row + block.nrows();
            let columns = column..column + block.ncols();
            (row, column) = (rows.end, columns.end);
            (block, rows, columns)
        })
    }

    /// Rᵀ M.
    #[must_use]
    pub fn left(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        let mut product = DMatrix::zeros(self.rank(), matrix.ncols());
        for (block, rows, columns) in self.places() {
            let mut own = product.rows_range_mut(columns);
            own.gemm(1.0, &block.transpose(), &matrix.rows_range(rows), 0.0);
        }
        product
    }

    /// Rᵀ v.
    #[must_use]
    pub fn left_of(&self, vector: &DVector<f64>) -> DVector<f64> {
        let mut product = DVector::zeros(self.rank());
        for (block, rows, columns) in self.places() {
            let own = block.tr_mul(&vector.rows_range(rows));
            product.rows_range_mut(columns).copy_from(&own);
        }
        product
    }

    /// R v.
    #[must_use]
    pub fn times(&self, vector: &DVector<f64>) -> DVector<f64> {
        let count = self.blocks.iter().map(DMatrix::nrows).sum();
        let mut product = DVector::zeros(count);
        for (block, rows, columns) in self.places() {
            let own = block * vector.rows_range(columns);
            product.rows_range_mut(rows).copy_from(&own);
        }
        product
    }

    /// Lower triangle of Rᵀ M R, from `half` = Rᵀ M for a symmetric M. Above the diagonal are zeros and
    /// parts of the product.
    #[must_use]
    pub fn lower_product(&self, half: &DMatrix<f64>) -> DMatrix<f64> {
        let mut product = DMatrix::zeros(self.rank(), self.rank());
        for (block, rows, columns) in self.places() {
            let below = columns.start..half.nrows();
            let mut own = product.view_range_mut(below.clone(), columns);
            own.gemm(1.0, &half.view_range(below, rows), block, 0.0);
        }
        product
    }

    /// Staircase of Rᵀ: the first row of each column's block, above which the column is zero.
    #[must_use]
    pub fn first_rows(&self) -> Vec<usize> {
        let blocks = self.places();
        let first = blocks.flat_map(|(_, rows, columns)| rows.map(move |_| columns.start));
        first.collect()
    }

    /// Rᵀ.
    #[must_use]
    pub fn transposed(&self) -> DMatrix<f64> {
        let count = self.blocks.iter().map(DMatrix::nrows).sum();
        let mut whole = DMatrix::zeros(self.rank(), count);
        for (block, rows, columns) in self.places() {
            let shape = (columns.len(), rows.len());
            let mut own = whole.view_mut((columns.start, rows.start), shape);
            own.copy_from(&block.transpose());
        }
        whole
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn covariance() -> DMatrix<f64> {
        DMatrix::from_row_slice(3, 3, &[4.0, 2.0, 0.6, 2.0, 5.0, 1.0, 0.6, 1.0, 2.0])
    }

    #[test]
    fn the_square_of_the_root_is_the_covariance() {
        let root = root(&covariance(), EXACT);
        assert_relative_eq!(&root * root.transpose(), covariance(), epsilon = 1e-13);
    }

    #[test]
    fn the_square_of_a_continuous_root_is_the_covariance() {
        let root = continuous_root(&covariance());
        assert_relative_eq!(&root * root.transpose(), covariance(), epsilon = 1e-13);
        let singular =
            DMatrix::from_row_slice(3, 3, &[0.0, 0.0, 0.0, 0.0, 4.0, 6.0, 0.0, 6.0, 9.0]);
        let root = continuous_root(&singular);
        assert_relative_eq!(&root * root.transpose(), singular, epsilon = 1e-13);
        assert!(continuous_root(&DMatrix::zeros(0, 0)).is_empty());
    }

    #[test]
    fn a_continuous_root_moves_as_little_as_the_covariance_and_a_pivoted_one_does_not() {
        // 1e-9 decides which of two variances is the larger.
        let covariance = |by: f64| DMatrix::from_row_slice(2, 2, &[1.0 + by, 0.5, 0.5, 1.0 - by]);
        let (more, less) = (covariance(1e-9), covariance(-1e-9));
        assert!((root(&more, EXACT) - root(&less, EXACT)).amax() > 0.4);
        assert_relative_eq!(
            continuous_root(&more),
            continuous_root(&less),
            epsilon = 1e-8
        );
    }

    #[test]
    fn a_direction_without_variance_has_no_column() {
        let singular = [0.0, 0.0, 0.0, 0.0, 4.0, 4.0, 0.0, 4.0, 4.0];
        let covariance = DMatrix::from_row_slice(3, 3, &singular);
        let root = root(&covariance, EXACT);
        assert_eq!(root.ncols(), 1);
        assert_relative_eq!(&root * root.transpose(), covariance, epsilon = 1e-14);
    }

    #[test]
    fn a_root_of_some_gives_their_covariance_with_all() {
        let some = [2, 0];
        let between = covariance().select_columns(&some);
        let root = root_of_some(&between, &some, EXACT);
        assert_relative_eq!(
            &root * root.select_rows(&some).transpose(),
            between,
            epsilon = 1e-14
        );
    }

    #[test]
    fn what_is_left_out_of_a_root_is_less_than_asked_for() {
        let nodes = DMatrix::from_fn(40, 40, |i, j| (-(i as f64 - j as f64).powi(2) / 50.0).exp());
        let root = root(&nodes, 1e-6);
        assert!(root.ncols() < 25);
        let rest = nodes - &root * root.transpose();
        assert!(rest.diagonal().amax() <= 1e-6 && rest.diagonal().min() > -1e-12);
    }

    #[test]
    fn products_with_blocks_are_those_with_the_whole_matrix() {
        let mut blocks = BlockRoot::default();
        blocks.push(root(&covariance(), EXACT));
        blocks.push(DMatrix::from_element(2, 1, 3.0));
        let whole = blocks.transposed();
        assert_eq!(whole.shape(), (4, 5));
        let matrix = DMatrix::from_fn(5, 5, |i, j| (3 * i + j) as f64);
        assert_relative_eq!(blocks.left(&matrix), &whole * &matrix, epsilon = 1e-12);
        let symmetric = &matrix + matrix.transpose();
        let product = blocks.lower_product(&blocks.left(&symmetric));
        assert_relative_eq!(
            product.lower_triangle(),
            (&whole * symmetric * whole.transpose()).lower_triangle(),
            epsilon = 1e-12
        );
        assert_eq!(blocks.first_rows(), [0, 0, 0, 3, 3]);
        let vector = matrix.column(2).into_owned();
        assert_relative_eq!(blocks.left_of(&vector), &whole * &vector, epsilon = 1e-12);
        let seen = blocks.left_of(&vector);
        let back = whole.tr_mul(&seen);
        assert_relative_eq!(blocks.times(&seen), back, epsilon = 1e-12);
    }
}
