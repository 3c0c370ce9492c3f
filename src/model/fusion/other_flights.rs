//! Posterior of all flights but one.
//!
//! Let (m, P) be mean and covariance of the posterior from all flights. Let y, A and Σ be the
//! differences, rows and error covariance of the flight to be left out ([`FlightData`]). With K = Σ
//! − A P Aᵀ, the posterior of the other flights has
//!
//! mean m − P Aᵀ K⁻¹ (y − A m), covariance P + P Aᵀ K⁻¹ A P.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::flight_data::FlightData;
use super::posterior::Gaussian;
use super::unknowns::{SparseRow, covariance_between, weighted_sum};

/// Posterior of all flights other than one.
pub struct OtherFlights<'a> {
    all_flights: &'a Gaussian,
    left_out: Option<LeftOutRows<'a>>,
}

/// Rows of the flight that is left out: factor of K, and K⁻¹ (y − A m).
struct LeftOutRows<'a> {
    flight: &'a FlightData,
    root: Cholesky<f64, Dyn>,
    weighted: DVector<f64>,
}

impl<'a> OtherFlights<'a> {
    /// Leaves out `flight`; without a flight the posterior is of all flights. `None` if a covariance is
    /// not positive definite.
    #[must_use]
    pub fn new(
        all_flights: &'a Gaussian,
        flight: Option<&'a FlightData>,
        weights: &[f64],
    ) -> Option<OtherFlights<'a>> {
        let Some(flight) = flight else {
            return Some(OtherFlights {
                all_flights,
                left_out: None,
            });
        };
        let (predicted, predicted_covariance) =
            flight.image(&all_flights.mean, &all_flights.covariance);
        let root = Cholesky::new(flight.covariance(weights) - predicted_covariance)?;
        let weighted = root.solve(&(&flight.differences - predicted));
        let left_out = Some(LeftOutRows {
            flight,
            root,
            weighted,
        });
        Some(OtherFlights {
            all_flights,
            left_out,
        })
    }

    /// Means and covariance of weighted sums of the unknowns, one sum per row.
    #[must_use]
    pub fn means_and_covariance(&self, rows: &[SparseRow]) -> (DVector<f64>, DMatrix<f64>) {
        let Gaussian { mean, covariance } = self.all_flights;
        let sums = rows.iter().map(|row| weighted_sum(row, mean));
        let mut values = DVector::from_iterator(rows.len(), sums);
        let mut sum_covariance = DMatrix::from_fn(rows.len(), rows.len(), |i, j| {
            covariance_between(&rows[i], &rows[j], covariance)
        });
        if let Some(left_out) = &self.left_out {
            let own_rows = &left_out.flight.rows;
            let cross = DMatrix::from_fn(rows.len(), own_rows.len(), |i, j| {
                covariance_between(&rows[i], &own_rows[j], covariance)
            });
            values -= &cross * &left_out.weighted;
            sum_covariance += &cross * left_out.root.solve(&cross.transpose());
        }
        (values, sum_covariance)
    }
}
