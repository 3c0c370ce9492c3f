//! Results of a maneuver's estimation.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use crate::filter_error::noise::Noise;
use crate::maneuver::{Maneuver, Means};
use crate::output_error::Fit;
use crate::output_error::error_effect::ErrorEffect;
use crate::tables::{AgreementRow, CorrelationRow, EstimateRow, FitRow, History, Outcome};

/// Covariance of a maneuver's parameters in the units of the tables; initial states in rad and
/// rad/s.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Covariance {
    pub names: Vec<String>,
    /// For white residuals, row by row.
    pub white: Vec<f64>,
    /// Corrected as `bound_corrected`, row by row.
    pub corrected: Vec<f64>,
    /// Effects of errors that other maneuvers share; both covariances contain those of held values,
    /// `corrected` also those of calibration.
    pub shared_errors: Vec<ErrorEffect>,
}

impl Covariance {
    /// Covariance of a fit; `None` if the data determine none.
    pub(super) fn of_fit(names: &[String], fit: &Fit) -> Option<Covariance> {
        let rows = |m: &DMatrix<f64>| m.transpose().as_slice().to_vec();
        let (white, corrected) = (fit.covariance.as_ref()?, fit.covariance_corrected.as_ref()?);
        Some(Covariance {
            names: names.to_vec(),
            white: rows(white),
            corrected: rows(corrected),
            shared_errors: fit.shared_errors.clone(),
        })
    }
}

/// Results of a maneuver's estimation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimated {
    pub fit: FitRow,
    pub estimates: Vec<EstimateRow>,
    /// Sums that the tunnel tabulates, where both parts were estimated.
    pub combined: Vec<EstimateRow>,
    pub covariance: Option<Covariance>,
    /// Correlations among the regressors as flown, and among the estimates.
    pub correlations: Vec<CorrelationRow>,
    pub history: Option<History>,
    /// Agreement of each output with the maneuver's own fit.
    pub fit_outputs: Vec<AgreementRow>,
    /// Noise that filter error found; `None` for output error.
    pub noise: Option<Noise>,
    /// Means of the record; `None` before they are added, or where a signal is missing.
    pub means: Option<Means>,
}

impl Estimated {
    /// Result of a maneuver whose class the configuration does not have.
    #[must_use]
    pub fn unknown_class(maneuver: &Maneuver) -> Estimated {
        let reason = format!("the configuration has no class `{}`", maneuver.class);
        Estimated::without_fit(rejected_fit(maneuver, reason), vec![])
    }

    /// Result of a maneuver that was not fitted.
    pub(super) fn without_fit(fit: FitRow, estimates: Vec<EstimateRow>) -> Estimated {
        Estimated {
            fit,
            estimates,
            combined: vec![],
            covariance: None,
            correlations: vec![],
            history: None,
            fit_outputs: vec![],
            noise: None,
            means: None,
        }
    }
}

/// Row of `fits` of a maneuver that was not estimated.
pub(super) fn rejected_fit(maneuver: &Maneuver, reason: String) -> FitRow {
    FitRow {
        reason,
        ..FitRow::without_numbers(&maneuver.maneuver_id, &maneuver.class, Outcome::Rejected)
    }
}
