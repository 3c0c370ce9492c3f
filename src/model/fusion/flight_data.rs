//! Evidence of a flight's maneuvers about one coefficient. Calibration errors are common to the flight.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::observation::Observation;
use super::unknowns::{SparseRow, Unknowns, is_of_campaign};
use crate::model::prior::scale_prior::Scale;
use crate::model::prior::term::PosteriorTerm;
use crate::numerics::linear_algebra::symmetric::square;
use crate::numerics::linear_algebra::triangular::solve_lower;
use crate::output_error::error_effect::SharedError;

/// Evidence of a flight, y = A z + K u + e.
///
/// | symbol | quantity |
/// |---|---|
/// | z | unknowns of the coefficient |
/// | A | rows of the estimates over z |
/// | u | calibration errors of the flight, each with unit variance |
/// | K | effects of the calibration errors |
/// | e | remaining errors |
#[derive(Clone, Debug)]
pub struct FlightData {
    /// Index of each maneuver in the evidence, and its rows.
    pub maneuvers: Vec<(usize, Range<usize>)>,
    /// Differences y of the estimates from the tunnel.
    pub differences: DVector<f64>,
    /// Rows A, one per estimate.
    pub rows: Vec<SparseRow>,
    /// Covariance of e, maneuver by maneuver. It is the whole noise once that is set.
    noise: Vec<DMatrix<f64>>,
    /// Covariance K Kᵀ from the calibration errors.
    calibration: DMatrix<f64>,
}

/// Normal equations of the unknowns, summed over the flights: Λ = Σ_flights Aᵀ Σ⁻¹ A and η =
/// Σ_flights Aᵀ Σ⁻¹ y, with Σ the covariance of K u + e ([`FlightData::covariance`]).
#[derive(Clone, Debug)]
pub struct Information {
    pub matrix: DMatrix<f64>,
    pub vector: DVector<f64>,
}

impl Information {
    #[must_use]
    pub fn none(unknowns: usize) -> Information {
        Information {
            matrix: DMatrix::zeros(unknowns, unknowns),
            vector: DVector::zeros(unknowns),
        }
    }

    /// `true` for an unknown on which the data depend.
    #[must_use]
    pub fn is_about(&self, unknown: usize) -> bool {
        self.matrix[(unknown, unknown)] != 0.0
    }
}

/// Evidence of one maneuver: index in the evidence, class, and observation.
pub type Observed<'a> = (usize, usize, &'a Observation);

impl FlightData {
    /// Evidence of one flight's maneuvers.
    #[must_use]
    pub fn new(observed: &[Observed], terms: &[PosteriorTerm], unknowns: &Unknowns) -> FlightData {
        let count = observed.iter().map(|(_, _, o)| o.terms.len()).sum();
        let mut data = FlightData {
            maneuvers: vec![],
            differences: DVector::zeros(count),
            rows: vec![],
            noise: vec![],
            calibration: DMatrix::zeros(count, count),
        };
        let mut effects: BTreeMap<&SharedError, DVector<f64>> = BTreeMap::new();
        for &(place, class, observation) in observed {
            let first = data.rows.len();
            data.rows.extend(unknowns.rows(terms, class, observation));
            let range = first..data.rows.len();
            let differences = data.differences.rows_range_mut(range.clone());
            { differences }.copy_from(&observation.differences);
            let of_flight = observation.calibration.iter();
            for (error, change) in of_flight.filter(|(e, _)| !is_of_campaign(e)) {
                let effect = effects
                    .entry(error)
                    .or_insert_with(|| DVector::zeros(count));
                effect.rows_range_mut(range.clone()).copy_from(change);
            }
            data.noise.push(observation.noise.clone());
            data.maneuvers.push((place, range));
        }
        for effect in effects.values() {
            data.calibration += effect * effect.transpose();
        }
        data
    }

    /// Sets each maneuver's noise to the whole noise of its observation.
    pub fn set_noise(&mut self, observed: &[Observed], terms: &[PosteriorTerm], scales: &[Scale]) {
        for (noise, (_, _, observation)) in self.noise.iter_mut().zip(observed) {
            *noise = observation.whole_noise(terms, scales);
        }
    }

    /// Evidence of some of the maneuvers, by their indices in this flight, in this order.
    #[must_use]
    pub fn of_maneuvers(&self, kept: &[usize]) -> FlightData {
        let places: Vec<usize> = kept
            .iter()
            .flat_map(|&i| self.maneuvers[i].1.clone())
            .collect();
        let mut first = 0;
        let maneuvers = kept.iter().map(|&i| {
            let (place, rows) = &self.maneuvers[i];
            let range = first..first + rows.len();
            first = range.end;
            (*place, range)
        });
        FlightData {
            maneuvers: maneuvers.collect(),
            differences: self.differences.select_rows(&places),
            rows: places.iter().map(|&i| self.rows[i].clone()).collect(),
            noise: kept.iter().map(|&i| self.noise[i].clone()).collect(),
            calibration: self
                .calibration
                .select_rows(&places)
                .select_columns(&places),
        }
    }

    /// Covariance of the errors that a maneuver shares with no other; `maneuver` is its index in
    /// this flight.
    #[must_use]
    pub fn noise(&self, maneuver: usize) -> &DMatrix<f64> {
        &self.noise[maneuver]
    }

    /// Covariance Σ of the errors K u + e. A maneuver of weight w has 1/w times its own noise.
    #[must_use]
    pub fn covariance(&self, weights: &[f64]) -> DMatrix<f64> {
        let mut covariance = self.calibration.clone();
        for ((place, rows), noise) in self.maneuvers.iter().zip(&self.noise) {
            let mut of_maneuver = covariance.view_mut((rows.start, rows.start), noise.shape());
            of_maneuver += noise / weights[*place];
        }
        covariance
    }

    /// Adds the flight to the normal equations. A covariance that is not positive definite adds
    /// nothing.
    pub fn add_to(&self, weights: &[f64], sums: &mut Information) {
        let active = self.active();
        let Some((rows, differences)) = self.whitened(&active, weights) else {
            return;
        };
        let (matrix, vector) = (square(&rows), rows.tr_mul(&differences));
        for (j, &column) in active.iter().enumerate() {
            sums.vector[column] += vector[j];
            for (i, &row) in active.iter().enumerate() {
                sums.matrix[(row, column)] += matrix[(i, j)];
            }
        }
    }

    /// Rows and differences by which some maneuvers, by their indices in this flight, add to the normal
    /// equations of its other maneuvers; the rows are columns over all unknowns. `None` if the flight adds
    /// nothing ([`FlightData::add_to`]).
    #[must_use]
    pub fn added_by(
        &self,
        maneuvers: &[usize],
        weights: &[f64],
        unknowns: usize,
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let others = (0..self.maneuvers.len()).filter(|i| !maneuvers.contains(i));
        let order: Vec<usize> = others.chain(maneuvers.iter().copied()).collect();
        let count = maneuvers.iter().map(|&i| self.maneuvers[i].1.len()).sum();
        // The last rows of a Cholesky factor leave those before them as they are.
        let ordered = self.of_maneuvers(&order);
        let active = ordered.active();
        let (rows, differences) = ordered.whitened(&active, weights)?;
        let first = rows.nrows() - count;
        let mut columns = DMatrix::zeros(unknowns, count);
        for (own, place) in rows.column_iter().zip(active) {
            columns
                .row_mut(place)
                .tr_copy_from(&own.rows_range(first..));
        }
        Some((columns, differences.rows_range(first..).into_owned()))
    }

    /// Rows L⁻¹ A over the active unknowns and differences L⁻¹ y, with the covariance Σ = L Lᵀ. `None`
    /// unless Σ is positive definite.
    fn whitened(&self, active: &[usize], weights: &[f64]) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let cholesky = self.cholesky(weights)?;
        let lower = cholesky.l_dirty();
        let mut rows = self.dense(active);
        solve_lower(lower.as_view(), rows.as_view_mut());
        let mut differences = self.differences.clone();
        lower.solve_lower_triangular_mut(&mut differences);
        Some((rows, differences))
    }

    #[must_use]
    pub fn cholesky(&self, weights: &[f64]) -> Option<Cholesky<f64, Dyn>> {
        Cholesky::new(self.covariance(weights))
    }

    /// Unknowns on which the flight's rows depend, ascending.
    fn active(&self) -> Vec<usize> {
        let observed = self.rows.iter().flatten().map(|(place, _)| *place);
        observed.collect::<BTreeSet<_>>().into_iter().collect()
    }

    fn dense(&self, active: &[usize]) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(self.rows.len(), active.len());
        for (i, row) in self.rows.iter().enumerate() {
            for (place, value) in row {
                if let Ok(column) = active.binary_search(place) {
                    dense[(i, column)] += value;
                }
            }
        }
        dense
    }

    /// Transposed rows Aᵀ, over all unknowns.
    #[must_use]
    pub fn columns(&self, unknowns: usize) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(unknowns, self.rows.len());
        for (row, mut column) in self.rows.iter().zip(columns.column_iter_mut()) {
            for (place, value) in row {
                column[*place] += value;
            }
        }
        columns
    }

    /// Mean A m and covariance A P Aᵀ of the rows, from mean m and covariance P of the unknowns.
    #[must_use]
    pub fn image(
        &self,
        mean: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> (DVector<f64>, DMatrix<f64>) {
        let active = self.active();
        let dense = self.dense(&active);
        let of_active = DMatrix::from_fn(active.len(), active.len(), |i, j| {
            covariance[(active[i], active[j])]
        });
        (
            &dense * mean.select_rows(&active),
            &dense * of_active * dense.transpose(),
        )
    }
}
