//! Evidence of a maneuver about a coefficient: differences of the maneuver's estimates from the
//! tunnel. They are linear functions of the coefficient's unknown differences and of errors that
//! maneuvers share.
//!
//! Let f be the differences of the derivatives at the maneuver's condition, and u the calibration
//! errors, each with unit variance. The estimates differ from the tunnel by
//!
//! y = (S + G) f + K u + e.
//!
//! S selects the estimated derivatives. G is the change of the estimates with the held values, and
//! K with the calibration errors. e has the rest of the corrected covariance. Nuisance parameters
//! of the maneuver are marginalised: only the rows and columns of its estimates of this coefficient
//! are used.

use nalgebra::{DMatrix, DVector};

use crate::aero::{Condition, WindTunnel};
use crate::maneuver::Status;
use crate::model::evidence::ManeuverResults;
use crate::model::prior::angle_noise::{ANGLE_SHARE, angle_noise};
use crate::model::prior::scale_prior::Scale;
use crate::model::prior::term::{PosteriorTerm, between_points};
use crate::numerics::linear_algebra::symmetric::{scale, scaled};
use crate::output_error::error_effect::{ErrorEffect, SharedError};

/// Least eigenvalue of a noise covariance scaled to unit diagonal, so that it stays invertible.
const LEAST_EIGENVALUE: f64 = 1e-6;

/// Evidence of a maneuver about one coefficient.
#[derive(Clone, Debug)]
pub struct Observation {
    pub condition: Condition,
    /// Standard deviation of the angle of attack to which an estimate belongs, deg.
    pub angle_deviation_deg: f64,
    /// Index of each row's term.
    pub terms: Vec<usize>,
    /// Estimates less the tunnel's values.
    pub differences: DVector<f64>,
    /// S + G: one row per estimate, one column per term.
    pub design: DMatrix<f64>,
    /// Covariance of the errors that no other maneuver shares.
    pub noise: DMatrix<f64>,
    /// Changes of the rows by one standard deviation of each calibration error.
    pub calibration: Vec<(SharedError, DVector<f64>)>,
}

/// One row of an observation: an estimate, or the sum that replaces a constant.
struct ObservationRow {
    term: usize,
    /// Weights of the maneuver's parameters in the row.
    of_parameters: Vec<(usize, f64)>,
    /// Estimate less the tunnel's value.
    difference: f64,
}

impl Observation {
    /// Covariance of the errors that no other maneuver shares, with the variation between the points
    /// of the grids and the uncertainty of the angle of attack.
    #[must_use]
    pub fn whole_noise(&self, terms: &[PosteriorTerm], scales: &[Scale]) -> DMatrix<f64> {
        let (design, at) = (&self.design, &self.condition);
        &self.noise
            + between_points(terms, scales, design, at)
            + angle_noise(terms, scales, design, at, self.angle_deviation_deg)
    }
}

impl ManeuverResults<'_> {
    /// Evidence about a coefficient's terms; `None` if the maneuver estimates none of them.
    #[must_use]
    pub fn about(&self, terms: &[PosteriorTerm], tunnel: &WindTunnel) -> Option<Observation> {
        let condition = self.maneuver.condition(tunnel);
        let rows: Vec<ObservationRow> = (0..terms.len())
            .filter_map(|i| self.row(terms, i, tunnel, &condition))
            .collect();
        if rows.is_empty() {
            return None;
        }
        let of_rows = self.matrix_of(&rows);
        let effects = &self.covariance.shared_errors;
        let design = self.design(terms, &rows, &of_rows);
        let calibration = effects.iter().filter(|e| !is_held(e));
        let is_shared = |e: &&ErrorEffect| match &e.error {
            SharedError::Held(name) => terms.iter().any(|t| t.derivative == *name),
            _ => true,
        };
        let shared = effects.iter().filter(is_shared);
        let noise = self.noise(&of_rows, shared)?;
        Some(Observation {
            condition,
            angle_deviation_deg: self.angle_deviation_deg(),
            terms: rows.iter().map(|r| r.term).collect(),
            differences: DVector::from_iterator(rows.len(), rows.iter().map(|r| r.difference)),
            design,
            noise,
            calibration: calibration
                .map(|e| {
                    (
                        e.error.clone(),
                        &of_rows * DVector::from_column_slice(&e.change),
                    )
                })
                .filter(|(_, change)| change.iter().any(|c| *c != 0.0))
                .collect(),
        })
    }

    /// Standard deviation of the angle of attack to which an estimate belongs, deg; zero where the
    /// sweep of the maneuver was not measured.
    fn angle_deviation_deg(&self) -> f64 {
        let sweep = self.maneuver.quality.alpha_rms_deg;
        ANGLE_SHARE * sweep.filter(|rms| rms.is_finite()).unwrap_or(0.0)
    }

    fn row(
        &self,
        terms: &[PosteriorTerm],
        i: usize,
        tunnel: &WindTunnel,
        at: &Condition,
    ) -> Option<ObservationRow> {
        let term = &terms[i];
        let (place, mut value) = self.estimated(&term.derivative)?;
        let mut of_parameters = vec![(place, 1.0)];
        if let Some(slope) = &term.slope {
            match self.estimated(slope) {
                Some((place, slope)) => {
                    of_parameters.push((place, at.alpha_deg));
                    value += at.alpha_deg * slope;
                }
                None => value += at.alpha_deg * self.held(slope)?,
            }
        }
        let tunnel_value = tunnel.at(&term.prior.name, at).map_or(0.0, |t| t.value);
        Some(ObservationRow {
            term: i,
            of_parameters,
            difference: value - tunnel_value,
        })
    }

    /// Index among the parameters and value of an estimated derivative; `None` if it is not
    /// estimated.
    fn estimated(&self, name: &str) -> Option<(usize, f64)> {
        let place = self.covariance.names.iter().position(|n| n == name)?;
        let row = self.estimates.iter().find(|e| e.derivative == name)?;
        let value = row.value.filter(|v| v.is_finite())?;
        (row.status == Status::Estimated).then_some((place, value))
    }

    /// Tunnel's value at which a derivative acted in the maneuver.
    fn held(&self, name: &str) -> Option<f64> {
        let row = self.estimates.iter().find(|e| e.derivative == name)?;
        row.wind_tunnel
    }

    fn matrix_of(&self, rows: &[ObservationRow]) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(rows.len(), self.covariance.names.len());
        for (i, row) in rows.iter().enumerate() {
            for &(parameter, weight) in &row.of_parameters {
                matrix[(i, parameter)] = weight;
            }
        }
        matrix
    }

    fn design(
        &self,
        terms: &[PosteriorTerm],
        rows: &[ObservationRow],
        of_rows: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let mut design = DMatrix::zeros(rows.len(), terms.len());
        for (i, row) in rows.iter().enumerate() {
            let term = &terms[row.term];
            design[(i, row.term)] += 1.0;
            if let Some(slope) = &term.slope
                && self.estimated(slope).is_none()
            {
                self.add_derivative(terms, slope, -self.maneuver.alpha_deg, i, &mut design);
            }
        }
        for effect in &self.covariance.shared_errors {
            if let SharedError::Held(name) = &effect.error
                && effect.deviation > 0.0
            {
                let gains = of_rows * DVector::from_column_slice(&effect.change) / effect.deviation;
                for (i, gain) in gains.iter().enumerate() {
                    self.add_derivative(terms, name, *gain, i, &mut design);
                }
            }
        }
        design
    }

    /// Adds the effect of a derivative's difference on a row. The difference of a constant is that of
    /// its sum less that of the slope times α.
    pub fn add_derivative(
        &self,
        terms: &[PosteriorTerm],
        name: &str,
        effect: f64,
        row: usize,
        design: &mut DMatrix<f64>,
    ) {
        let Some(place) = terms.iter().position(|t| t.derivative == name) else {
            return;
        };
        design[(row, place)] += effect;
        let slope = terms[place].slope.as_ref();
        if let Some(slope) = slope.and_then(|s| terms.iter().position(|t| t.derivative == *s)) {
            design[(row, slope)] -= effect * self.maneuver.alpha_deg;
        }
    }

    /// Corrected covariance of the rows without the effects that are modelled separately.
    fn noise<'e>(
        &self,
        of_rows: &DMatrix<f64>,
        shared: impl Iterator<Item = &'e ErrorEffect>,
    ) -> Option<DMatrix<f64>> {
        let n = self.covariance.names.len();
        let corrected = DMatrix::from_row_slice(n, n, &self.covariance.corrected);
        let mut unshared = corrected.clone();
        for effect in shared {
            let change = DVector::from_column_slice(&effect.change);
            unshared -= &change * change.transpose();
        }
        let corrected_of_rows = of_rows * corrected * of_rows.transpose();
        floored(
            &(of_rows * unshared * of_rows.transpose()),
            &corrected_of_rows,
        )
    }
}

fn is_held(effect: &ErrorEffect) -> bool {
    matches!(effect.error, SharedError::Held(_))
}

/// Raises eigenvalues of a covariance that are negative, or tiny beside the variances of `corrected`.
/// `None` unless both matrices are finite and the variances of `corrected` positive.
fn floored(covariance: &DMatrix<f64>, corrected: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let is_sound = covariance
        .iter()
        .chain(corrected.iter())
        .all(|v| v.is_finite())
        && corrected.diagonal().iter().all(|v| *v > 0.0);
    if !is_sound {
        return None;
    }
    let units = scale(corrected);
    let at_unit = scaled(covariance, &units);
    let mut eigen = at_unit.symmetric_eigen();
    eigen
        .eigenvalues
        .apply(|value| *value = value.max(LEAST_EIGENVALUE));
    let back = units.map(|unit| 1.0 / unit);
    Some(scaled(&eigen.recompose(), &back))
}
