//! Posterior of a coefficient's differences from the tunnel, given scales and weights: a Gaussian.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector};

use super::flight_data::{FlightData, Information};
use super::unknowns::Unknowns;
use crate::model::prior::scale_prior::Scale;
use crate::model::prior::term::PosteriorTerm;
use crate::numerics::linear_algebra::root::{BlockRoot, EXACT};
use crate::numerics::linear_algebra::symmetric::{square, staircase_square};
use crate::numerics::linear_algebra::triangular::{
    cholesky, solve_lower, solve_staircase, subtract_square,
};

/// Share of the information that may be lost by rounding: with data a million times more accurate
/// than the prior, matrices stay positive definite.
const ROUNDING: f64 = 1e-13;

/// Gaussian of all unknowns of a coefficient.
#[derive(Clone, Debug)]
pub struct Gaussian {
    pub mean: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

/// Normal equations of all flights, in their order.
#[must_use]
pub fn information(flights: &[FlightData], weights: &[f64], unknowns: usize) -> Information {
    let mut sums = Information::none(unknowns);
    for flight in flights {
        flight.add_to(weights, &mut sums);
    }
    sums
}

/// Posterior of the unknowns for a prior covariance given by its root R.
///
/// Let Λ and η be the information matrix and vector of the data ([`Information`]). With the prior
/// covariance R Rᵀ, the posterior covariance is P = R (I + Rᵀ Λ R)⁻¹ Rᵀ and the mean P η.
pub struct SolvedPosterior<'a> {
    root: &'a BlockRoot,
    /// Cholesky factor L of I + Rᵀ Λ R = L Lᵀ.
    lower: DMatrix<f64>,
    /// Whitened vector L⁻¹ Rᵀ η.
    vector: DVector<f64>,
}

/// Information of the data on the whitened unknowns R⁻¹ z.
#[derive(Clone, Debug)]
pub struct WhitenedInformation<'a> {
    root: &'a BlockRoot,
    /// Lower triangle of Rᵀ Λ R.
    inner: DMatrix<f64>,
    /// Rᵀ η.
    vector: DVector<f64>,
}

impl<'a> WhitenedInformation<'a> {
    #[must_use]
    pub fn new(root: &'a BlockRoot, information: &Information) -> WhitenedInformation<'a> {
        WhitenedInformation {
            root,
            inner: root.lower_product(&root.left(&information.matrix)),
            vector: root.left_of(&information.vector),
        }
    }

    /// Removes rows that the data had added, each flight's as columns over the unknowns, with their
    /// differences.
    pub fn remove(&mut self, added: &[(DMatrix<f64>, DVector<f64>)]) {
        let Some(columns) = side_by_side(added.iter().map(|(rows, _)| rows)) else {
            return;
        };
        let differences = added.iter().flat_map(|(_, own)| own.iter().copied());
        let differences = DVector::from_iterator(columns.ncols(), differences);
        let rows = self.root.left(&columns);
        self.vector.gemv(-1.0, &rows, &differences, 1.0);
        subtract_square(&rows, &rows.transpose(), &mut self.inner.as_view_mut());
    }

    /// Posterior; `None` if the data are not finite.
    #[must_use]
    pub fn solved(self) -> Option<SolvedPosterior<'a>> {
        let lower = inner_root(self.inner)?;
        let mut vector = self.vector;
        lower.solve_lower_triangular_mut(&mut vector);
        Some(SolvedPosterior {
            root: self.root,
            lower,
            vector,
        })
    }
}

impl SolvedPosterior<'_> {
    /// Product L⁻¹ Rᵀ A for some columns A over the unknowns, from which Aᵀ P A follows as its
    /// square.
    fn whitened_columns(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let mut halves = self.root.left(columns);
        solve_lower(self.lower.as_view(), halves.as_view_mut());
        halves
    }

    /// Covariance P of the unknowns, the square of L⁻¹ Rᵀ.
    fn covariance(&self) -> DMatrix<f64> {
        let (mut halves, first_rows) = (self.root.transposed(), self.root.first_rows());
        solve_staircase(&self.lower, &mut halves, &first_rows);
        staircase_square(&halves, &first_rows)
    }

    /// Means and covariance that the posterior gives for the rows of each flight; none without a row.
    /// The columns of all flights are solved together: those of one alone are too few for the blocks.
    #[must_use]
    pub fn images(
        &self,
        flights: &[FlightData],
        unknowns: usize,
    ) -> Vec<(DVector<f64>, DMatrix<f64>)> {
        let own: Vec<DMatrix<f64>> = flights.iter().map(|f| f.columns(unknowns)).collect();
        let Some(columns) = side_by_side(own.iter()) else {
            return vec![];
        };
        let halves = self.whitened_columns(&columns);
        let mut first = 0;
        let image = |own: &DMatrix<f64>| {
            let halves = halves.columns(first, own.ncols()).into_owned();
            first += own.ncols();
            (halves.tr_mul(&self.vector), square(&halves))
        };
        own.iter().map(image).collect()
    }
}

/// Columns of some matrices side by side; `None` without a column.
fn side_by_side<'m>(matrices: impl Iterator<Item = &'m DMatrix<f64>>) -> Option<DMatrix<f64>> {
    let columns: Vec<_> = matrices.flat_map(DMatrix::column_iter).collect();
    (!columns.is_empty()).then(|| DMatrix::from_columns(&columns))
}

/// Cholesky factor L of I + Rᵀ Λ R = L Lᵀ, from the lower triangle of `inner` = Rᵀ Λ R.
#[must_use]
pub fn inner_root(mut inner: DMatrix<f64>) -> Option<DMatrix<f64>> {
    for j in 0..inner.nrows() {
        inner[(j, j)] += 1.0 + ROUNDING * inner[(j, j)];
    }
    cholesky(inner)
}

/// Gaussian with a prior covariance R Rᵀ. `None` if the data are not finite.
#[must_use]
pub fn gaussian(root: &BlockRoot, information: &Information) -> Option<Gaussian> {
    let covariance = WhitenedInformation::new(root, information)
        .solved()?
        .covariance();
    let mean = &covariance * &information.vector;
    mean.iter()
        .all(|v| v.is_finite())
        .then_some(Gaussian { mean, covariance })
}

/// Normal equations of the differences from the tunnel, with the other unknowns marginalised.
#[must_use]
pub fn of_differences(information: &Information, unknowns: &Unknowns) -> Option<Information> {
    let (n, all) = (unknowns.differences, unknowns.count);
    let (matrix, vector) = (&information.matrix, &information.vector);
    let of_others = Information {
        matrix: matrix.view((n, n), (all - n, all - n)).into_owned(),
        vector: vector.rows(n, all - n).into_owned(),
    };
    let root = unknowns.root_of_others(EXACT);
    let others = WhitenedInformation::new(&root, &of_others).solved()?;
    let cross = matrix.view((n, 0), (all - n, n)).into_owned();
    let halves = others.whitened_columns(&cross);
    Some(Information {
        matrix: matrix.view((0, 0), (n, n)).into_owned() - square(&halves),
        vector: vector.rows(0, n) - halves.tr_mul(&others.vector),
    })
}

/// Differences of rows that were left out from their prediction by the other rows, with the
/// covariance of these differences.
#[derive(Clone, Debug)]
pub struct LeaveOneOutDifference {
    pub differences: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

/// Predictions of a flight's rows from all other data, in closed form.
///
/// | symbol | quantity |
/// |---|---|
/// | y, A | differences of the flight's estimates from the tunnel, and their rows over the unknowns |
/// | m, P | mean and covariance of the posterior from all data |
/// | r = y − A m | residual of the rows |
/// | Σ | covariance of the errors of y |
/// | F = A P Aᵀ | covariance of the fitted values A m |
/// | V | covariance of y less its prediction from the other data |
///
/// With the flight left out, the difference between y and its prediction has the precision V⁻¹ =
/// Σ⁻¹ − Σ⁻¹ F Σ⁻¹ and the value V Σ⁻¹ r. If only some of its rows are left out, their blocks of
/// V⁻¹ and Σ⁻¹ r replace the whole ones.
#[derive(Clone, Debug)]
pub struct LeaveOneOut {
    /// Precision V⁻¹.
    precision: DMatrix<f64>,
    /// Weighted residual Σ⁻¹ r.
    weighted: DVector<f64>,
}

impl LeaveOneOut {
    /// Prepares the predictions for a flight; `None` unless its covariances are positive definite.
    #[must_use]
    pub fn new(
        flight: &FlightData,
        weights: &[f64],
        all_flights: &Gaussian,
    ) -> Option<LeaveOneOut> {
        let (predicted, predicted_covariance) =
            flight.image(&all_flights.mean, &all_flights.covariance);
        let inverse = flight.cholesky(weights)?.inverse();
        Some(LeaveOneOut {
            precision: &inverse - &inverse * predicted_covariance * &inverse,
            weighted: inverse * (&flight.differences - predicted),
        })
    }

    /// Difference of all rows of the flight from their prediction by the other flights.
    #[must_use]
    pub fn flight(&self) -> Option<LeaveOneOutDifference> {
        self.rows(&(0..self.weighted.len()))
    }

    /// Difference of some rows from their prediction by all other rows.
    #[must_use]
    pub fn rows(&self, rows: &Range<usize>) -> Option<LeaveOneOutDifference> {
        let start = (rows.start, rows.start);
        let precision = self.precision.view(start, (rows.len(), rows.len()));
        let covariance = Cholesky::new(precision.into_owned())?.inverse();
        Some(LeaveOneOutDifference {
            differences: &covariance * self.weighted.rows_range(rows.clone()),
            covariance,
        })
    }
}

/// Weights of the maneuvers by Student's t: a maneuver far from its prediction by all others has a
/// lower weight.
///
/// A weight w below one has added 1/w − 1 times the maneuver's noise to the covariance of its
/// difference. This part is subtracted before the comparison, so each maneuver is compared at full
/// weight.
#[must_use]
pub fn reweighted(
    flights: &[FlightData],
    weights: &[f64],
    all_flights: &Gaussian,
    degrees_of_freedom: f64,
) -> Vec<f64> {
    let mut next = weights.to_vec();
    for flight in flights {
        let Some(leaving_out) = LeaveOneOut::new(flight, weights, all_flights) else {
            continue;
        };
        for (i, (place, rows)) in flight.maneuvers.iter().enumerate() {
            let Some(alone) = leaving_out.rows(rows) else {
                continue;
            };
            let added = flight.noise(i) * (1.0 / weights[*place] - 1.0);
            if let Some(cholesky) = Cholesky::new(&alone.covariance - added) {
                let distance = alone.differences.dot(&cholesky.solve(&alone.differences));
                let expected = degrees_of_freedom + rows.len() as f64;
                next[*place] = (expected / (degrees_of_freedom + distance)).min(1.0);
            }
        }
    }
    next
}

/// Prior covariance of the differences of all terms.
#[must_use]
pub fn prior_covariance_of_terms(
    unknowns: &Unknowns,
    terms: &[PosteriorTerm],
    scales: &[Scale],
) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(unknowns.differences, unknowns.differences);
    for ((term, scale), &start) in terms.iter().zip(scales).zip(&unknowns.starts) {
        let covariance = term.prior.covariance.for_scale(scale);
        all.view_mut((start, start), covariance.shape())
            .copy_from(&covariance);
    }
    all
}
