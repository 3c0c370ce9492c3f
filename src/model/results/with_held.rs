//! Estimates of a maneuver with the values that it holds taken from the posterior of the other
//! flights.
//!
//! Let G be the change of the estimates with the held derivatives. Let f and C be mean and
//! covariance of the held derivatives' differences from the tunnel, by the other flights. The
//! estimates move by −G f, and in their covariance G C Gᵀ replaces the tunnel's part.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::campaign_model::Model;
use crate::aero::Combined;
use crate::maneuver::Status;
use crate::model::evidence::ManeuverResults;
use crate::model::fusion::held_values::HeldDifferences;
use crate::model::fusion::unknowns::{SparseRow, covariance_between, weighted_sum};
use crate::output_error::error_effect::ErrorEffect;
use crate::tables::EstimateRow;

/// Change of a maneuver's results if the values that it holds are taken from the posterior of the
/// other flights.
#[derive(Clone, Debug)]
pub struct WithHeld<'a> {
    evidence: &'a ManeuverResults<'a>,
    /// Differences of the held derivatives from the tunnel.
    held: BTreeMap<&'a str, f64>,
    /// Change of each estimated parameter due to the new held values.
    change: DVector<f64>,
    /// Change of the parameters' covariance.
    covariance: DMatrix<f64>,
}

impl Model {
    /// Change of a maneuver's results if the values that it holds are taken from the posterior of
    /// the other flights.
    #[must_use]
    pub fn with_held<'a>(&'a self, evidence: &'a ManeuverResults<'a>) -> WithHeld<'a> {
        let parameters = evidence.covariance.names.len();
        let mut with = WithHeld {
            evidence,
            held: BTreeMap::new(),
            change: DVector::zeros(parameters),
            covariance: DMatrix::zeros(parameters, parameters),
        };
        let effects: BTreeMap<&str, &ErrorEffect> = evidence.held_effects().collect();
        let id = &evidence.maneuver.maneuver_id;
        for (_, coefficient) in &self.coefficients {
            if let Some(differences) = coefficient.held.get(id) {
                with.add(differences, &effects);
            }
        }
        with
    }
}

impl<'a> WithHeld<'a> {
    fn add(&mut self, differences: &'a HeldDifferences, effects: &BTreeMap<&str, &ErrorEffect>) {
        let names = || differences.derivatives.iter().map(String::as_str);
        let effects_of_held: Vec<&ErrorEffect> =
            names().filter_map(|n| effects.get(n).copied()).collect();
        if effects_of_held.len() != differences.derivatives.len() {
            return;
        }
        let change = |e: &ErrorEffect| DVector::from_column_slice(&e.change);
        let gains: Vec<DVector<f64>> = effects_of_held
            .iter()
            .map(|e| change(e) / e.deviation)
            .collect();
        let gains = DMatrix::from_columns(&gains);
        self.change -= &gains * &differences.values;
        self.covariance += &gains * &differences.covariance * gains.transpose();
        for effect in effects_of_held {
            let change = change(effect);
            self.covariance -= &change * change.transpose();
        }
        self.held
            .extend(names().zip(differences.values.iter().copied()));
    }

    /// Row of the maneuver's estimates, or of its sums, after the change.
    #[must_use]
    pub fn row(&self, row: &EstimateRow, sums: &[Combined]) -> EstimateRow {
        let mut new = row.clone();
        match row.status {
            Status::Held => {
                let difference = self.held.get(row.derivative.as_str());
                new.value = row.value.zip(difference).map(|(v, d)| v + d).or(row.value);
            }
            Status::Estimated => {
                if let Some(weights) = self.weights(&row.derivative, sums) {
                    let change = weighted_sum(&weights, &self.change);
                    let variance = covariance_between(&weights, &weights, &self.covariance);
                    let bound = |b: Option<f64>| b.map(|b| (b * b + variance).max(0.0).sqrt());
                    new.value = row.value.map(|v| v + change);
                    new.bound = bound(row.bound);
                    new.bound_held = bound(row.bound_held);
                    new.bound_corrected = bound(row.bound_corrected);
                }
            }
            Status::Inactive => {}
        }
        new
    }

    /// Weights of the maneuver's parameters in an estimate or a sum.
    fn weights(&self, name: &str, sums: &[Combined]) -> Option<SparseRow> {
        let names = &self.evidence.covariance.names;
        let place = |name: &str| names.iter().position(|n| n == name);
        if let Some(place) = place(name) {
            return Some(vec![(place, 1.0)]);
        }
        let sum = sums.iter().find(|sum| sum.name == name)?;
        let alpha_deg = self.evidence.maneuver.alpha_deg;
        Some(vec![
            (place(&sum.constant)?, 1.0),
            (place(&sum.slope)?, alpha_deg),
        ])
    }
}
