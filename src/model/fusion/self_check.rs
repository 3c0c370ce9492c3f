//! Self-check of the model, without a truth: each flight is predicted from the others, and each
//! class from the other classes. Scales and weights are taken from all data.

use nalgebra::{Cholesky, DVector};

use super::flight_data::FlightData;
use super::posterior::{Gaussian, LeaveOneOut, LeaveOneOutDifference, WhitenedInformation};
use crate::numerics::statistics::normal::NORMAL_95;

/// Agreement of omitted data with their prediction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Number of estimates.
    pub estimates: usize,
    /// Number of estimates inside the 95 % interval of their prediction.
    pub inside: usize,
    /// Log density of the estimates, each in its own unit.
    pub log_density: f64,
}

impl std::ops::AddAssign for Agreement {
    fn add_assign(&mut self, other: Agreement) {
        self.estimates += other.estimates;
        self.inside += other.inside;
        self.log_density += other.log_density;
    }
}

impl LeaveOneOutDifference {
    /// Agreement of the rows with their joint prediction.
    #[must_use]
    pub fn agreement(&self) -> Agreement {
        let variances = self.covariance.diagonal();
        let pairs = self.differences.iter().zip(variances.iter());
        let inside = pairs.filter(|(d, variance)| d.abs() <= NORMAL_95 * variance.sqrt());
        let log_density = Cholesky::new(self.covariance.clone()).map_or(f64::NEG_INFINITY, |c| {
            let square = self.differences.dot(&c.solve(&self.differences));
            let roots: f64 = c.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
            let n = self.differences.len() as f64;
            -0.5 * square - roots - 0.5 * n * std::f64::consts::TAU.ln()
        });
        Agreement {
            estimates: self.differences.len(),
            inside: inside.count(),
            log_density,
        }
    }
}

/// Agreement of a flight with the other flights.
#[must_use]
pub fn flight(data: &FlightData, weights: &[f64], all_flights: &Gaussian) -> Option<Agreement> {
    let left_out = LeaveOneOut::new(data, weights, all_flights)?.flight()?;
    Some(left_out.agreement())
}

/// Agreement of some maneuvers with all others. The calibration errors of their flights are not
/// estimated from the others. `all` is the information of all flights.
#[must_use]
pub fn maneuvers(
    flights: &[FlightData],
    weights: &[f64],
    mut all: WhitenedInformation,
    unknowns: usize,
    is_left_out: impl Fn(usize) -> bool,
) -> Option<Agreement> {
    let left_out = |flight: &FlightData| -> Vec<usize> {
        let own = flight.maneuvers.iter().enumerate();
        own.filter(|(_, (place, _))| is_left_out(*place))
            .map(|(i, _)| i)
            .collect()
    };
    let flights = flights.iter().map(|flight| (flight, left_out(flight)));
    let flights: Vec<_> = flights
        .filter(|(_, left_out)| !left_out.is_empty())
        .collect();
    let added = flights.iter();
    let added = added.filter_map(|(flight, own)| flight.added_by(own, weights, unknowns));
    all.remove(&added.collect::<Vec<_>>());
    let rest = all.solved()?;
    let omitted = flights.iter();
    let omitted = omitted.map(|(flight, left_out)| flight.of_maneuvers(left_out));
    let omitted: Vec<FlightData> = omitted.collect();
    let mut sum = Agreement::default();
    let predictions = rest.images(&omitted, unknowns);
    for (omitted, (predicted, predicted_covariance)) in omitted.iter().zip(predictions) {
        let differences: DVector<f64> = &omitted.differences - predicted;
        let covariance = predicted_covariance + omitted.covariance(weights);
        let prediction = LeaveOneOutDifference {
            differences,
            covariance,
        };
        sum += prediction.agreement();
    }
    (sum.estimates > 0).then_some(sum)
}
