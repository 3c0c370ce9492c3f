//! Differences from the tunnel of the values that a maneuver holds, by the posterior of the other
//! flights.

use nalgebra::{DMatrix, DVector};

use super::other_flights::OtherFlights;
use super::posterior::Gaussian;
use super::unknowns::Unknowns;
use crate::aero::WindTunnel;
use crate::model::evidence::ManeuverResults;
use crate::model::prior::scale_prior::Scale;
use crate::model::prior::term::{PosteriorTerm, between_points};
use crate::output_error::error_effect::{ErrorEffect, SharedError};

/// Differences from the tunnel of the derivatives of one coefficient that a maneuver holds, with
/// their covariance.
#[derive(Clone, Debug)]
pub struct HeldDifferences {
    pub derivatives: Vec<String>,
    pub values: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

/// Terms of a coefficient with their scales and their posterior.
#[derive(Clone, Copy, Debug)]
pub struct TermsPosterior<'a> {
    pub terms: &'a [PosteriorTerm],
    pub scales: &'a [Scale],
    pub gaussian: &'a Gaussian,
}

impl ManeuverResults<'_> {
    /// Effects of the derivatives that the maneuver holds, by name.
    pub fn held_effects(&self) -> impl Iterator<Item = (&str, &ErrorEffect)> {
        let effects = self.covariance.shared_errors.iter();
        effects.filter_map(|effect| match &effect.error {
            SharedError::Held(name) if effect.deviation > 0.0 => Some((name.as_str(), effect)),
            _ => None,
        })
    }

    /// Differences from the tunnel of the values that the maneuver holds, by the other flights;
    /// `None` if it holds nothing of the coefficient.
    #[must_use]
    pub fn held_differences(
        &self,
        posterior: &TermsPosterior,
        unknowns: &Unknowns,
        others: &OtherFlights,
        tunnel: &WindTunnel,
    ) -> Option<HeldDifferences> {
        let TermsPosterior { terms, scales, .. } = *posterior;
        let effects = self.held_effects().map(|(name, _)| name);
        let names: Vec<&str> = effects
            .filter(|name| terms.iter().any(|t| t.derivative == *name))
            .collect();
        if names.is_empty() {
            return None;
        }
        let condition = self.maneuver.condition(tunnel);
        let design = self.design_of(terms, &names);
        let rows = unknowns.difference_rows(terms, &design, &condition);
        let (values, covariance) = others.means_and_covariance(&rows);
        let between = between_points(terms, scales, &design, &condition);
        Some(HeldDifferences {
            derivatives: names.into_iter().map(str::to_owned).collect(),
            values,
            covariance: covariance + between,
        })
    }

    /// Weights of the terms in the differences of derivatives, one row per derivative.
    fn design_of(&self, terms: &[PosteriorTerm], names: &[&str]) -> DMatrix<f64> {
        let mut design = DMatrix::zeros(names.len(), terms.len());
        for (i, name) in names.iter().enumerate() {
            self.add_derivative(terms, name, 1.0, i, &mut design);
        }
        design
    }
}
