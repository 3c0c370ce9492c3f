//! Model: one posterior of every derivative over the flight condition for the whole campaign. The
//! tunnel is the prior, and the maneuvers are the evidence.
//!
//! Each coefficient is one Gaussian problem. Its unknowns are the differences of its derivatives
//! from the tunnel at the points of a grid ([`prior::derivative_prior`]), linear between them. A
//! maneuver counts with its whole corrected covariance, the exact effect of its held values, and
//! the calibration errors that it shares with its flight ([`fusion::observation`]). Sizes and
//! lengths of the differences are the most probable ones ([`fusion::scales`]); their remaining
//! uncertainty is added to the covariance ([`fusion::open_scales`]). A maneuver that the others
//! contradict has a lower weight ([`fusion::posterior`]).

mod prior;
mod fusion;
mod results;
mod settings;
mod evidence;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use crate::aero::{AeroModel, Axis, Coefficient, WindTunnel};
use evidence::in_order;
use fusion::coefficient::CoefficientPosterior;
use prior::term::TermSources;

pub use evidence::ManeuverResults;
pub use results::campaign_model::{Failure, MOST_POINTS, Model};
pub use results::draws::CorrelatedDerivatives;
pub use results::lift_and_drag::PublishedManeuver;
pub use results::local::{LocalKind, LocalPosterior, LocalValue};
pub use results::outlook::{Outlook, OutlookPoint, PlannedRows, PointQuantity};
pub use settings::Settings;

/// Computes the posterior of every derivative. The order of the evidence within a flight, and of the
/// flights, is that of their ids.
#[must_use]
pub fn model(
    evidence: &[ManeuverResults],
    aero_model: &AeroModel,
    tunnel: &WindTunnel,
    settings: &Settings,
) -> Model {
    let evidence = in_order(evidence);
    let tunnel = tunnel.clamped();
    let basis = TermSources {
        aero_model,
        tunnel: &tunnel,
        settings,
    };
    let all = [Axis::Longitudinal, Axis::Lateral].map(Axis::coefficients);
    let all: Vec<Coefficient> = all.into_iter().flatten().collect();
    let posterior_of = |coefficient: Coefficient| {
        let points = basis.count_points(coefficient, &evidence);
        if points > MOST_POINTS {
            return Some((coefficient, Err(Failure::TooManyPoints(points))));
        }
        let terms = basis.terms(coefficient, &evidence);
        let has_terms = !terms.is_empty();
        let posterior =
            has_terms.then(|| CoefficientPosterior::from_terms(terms, &evidence, &basis))?;
        let rows = posterior.as_ref().map(|p| p.rows(coefficient, &evidence));
        Some((coefficient, posterior.zip(rows).ok_or(Failure::NotFinite)))
    };
    let results: Vec<_> = all.into_par_iter().filter_map(posterior_of).collect();
    let mut model = Model::default();
    for (coefficient, result) in results {
        match result {
            Ok((posterior, rows)) => {
                model.rows.append(rows);
                model.coefficients.push((coefficient, posterior));
            }
            Err(failure) => model.failed.push((coefficient, failure)),
        }
    }
    model
}
