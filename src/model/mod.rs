//! Model: one posterior of every derivative over the flight condition for the whole campaign. The
//! tunnel is the prior, and the maneuvers are the evidence.
//!
//! Each coefficient is one Gaussian problem. Its unknowns are the differences of its derivatives
//! from the tunnel at the points of a grid ([`prior`]), linear between them. A maneuver counts with
//! its whole corrected covariance, the exact effect of its held values, and the calibration errors
//! that it shares with its flight ([`observation`]). Sizes and lengths of the differences are the
//! most probable ones ([`scales`]); their remaining uncertainty is added to the covariance
//! ([`open_scales`]). A maneuver that the others contradict has a lower weight ([`posterior`]).

mod settings;
mod evidence;
mod grid;
mod scale_prior;
mod prior_covariance;
mod prior;
mod term;
mod observation;
mod unknowns;
mod flight_data;
mod posterior;
mod observed_differences;
mod scales;
mod open_scales;
mod self_check;
mod other_flights;
mod held_values;
mod coefficient;
mod published;
mod rows;
mod campaign_model;
mod with_held;
mod lift_and_drag;
mod draws;
mod local;
mod outlook;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use crate::aero::{AeroModel, Axis, Coefficient, WindTunnel};
use coefficient::CoefficientPosterior;
use evidence::in_order;
use term::TermSources;

pub use campaign_model::{Failure, MOST_POINTS, Model};
pub use draws::CorrelatedDerivatives;
pub use evidence::ManeuverResults;
pub use lift_and_drag::PublishedManeuver;
pub use local::{LocalKind, LocalPosterior, LocalValue};
pub use outlook::{Outlook, OutlookPoint, PlannedRows, PointQuantity};
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
