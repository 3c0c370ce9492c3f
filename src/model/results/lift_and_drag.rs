//! Lift and drag from a maneuver's normal and axial force.
//!
//! ```text
//! C_L = C_N cos α − C_A sin α        C_D = C_N sin α + C_A cos α
//! ```
//!
//! Coefficients and their slopes along each regressor are given at the maneuver's mean flight
//! condition. The axes turn with α, so ∂C_L/∂α also contains −C_D, and ∂C_D/∂α contains C_L, per
//! rad. All are weighted sums of the derivatives, with weights w_p of the estimated derivatives and
//! w_h of the held ones.
//!
//! Let Σ be the covariance of the estimates. Let C be the covariance of the held values: the
//! tunnel's uncertainty, or the covariance of the other flights' posterior. If the held values have
//! the error −f, the estimates have the error G f beside their own. A sum therefore has the
//! variance
//!
//! ```text
//! w_p' Σ w_p − 2 w_p' G C w_h + w_h' C w_h
//! ```

use nalgebra::{DMatrix, DVector, Matrix2, RowDVector};

use super::campaign_model::Model;
use crate::aero::{AeroModel, Axis, Coefficient, Derivative, DerivativeUnit, Regressor};
use crate::aircraft::Aircraft;
use crate::maneuver::{Maneuver, Means, Status};
use crate::model::evidence::ManeuverResults;
use crate::tables::{EstimateRow, LiftAndDragRow};
use crate::units::RAD;

/// Name of the regressor in the row that has the coefficients themselves instead of a slope.
const TOTAL: &str = "total";

/// Maneuver as it was flown, with its build-up.
#[derive(Clone, Copy, Debug)]
pub struct PublishedManeuver<'a> {
    pub evidence: &'a ManeuverResults<'a>,
    /// Rows of the estimates as they are published.
    pub estimates: &'a [EstimateRow],
    pub means: &'a Means,
    pub aircraft: &'a Aircraft,
    pub aero_model: &'a AeroModel,
}

/// Weights of all normal and axial derivatives in lift and drag.
#[derive(Clone, Debug)]
struct Weights {
    lift: RowDVector<f64>,
    drag: RowDVector<f64>,
}

/// Errors of the derivatives that a maneuver holds.
struct HeldErrors {
    names: Vec<String>,
    /// Change G of the estimates with the errors of the held values.
    gains: DMatrix<f64>,
    /// Covariance of held values that the maneuver's corrected covariance contains.
    assumed: DMatrix<f64>,
    /// Covariance C of the held values.
    covariance: DMatrix<f64>,
}

impl Model {
    /// Rows of one longitudinal maneuver: total C_L and C_D, then their slopes along each
    /// regressor. Empty unless the constants of CN and CA are estimated. Held derivatives have the
    /// posterior values of the other flights, or the tunnel's.
    #[must_use]
    pub fn lift_and_drag(
        &self,
        flown: &PublishedManeuver,
        held_by_posterior: bool,
    ) -> Vec<LiftAndDragRow> {
        let derivatives = flown.derivatives();
        let is_estimated = |c: Coefficient| {
            let mut of_coefficient = derivatives.iter().filter(|d| d.coefficient == c);
            of_coefficient.any(|d| d.regressor == Regressor::Constant && flown.is_estimated(d))
        };
        if !is_estimated(Coefficient::CN) || !is_estimated(Coefficient::CA) {
            return vec![];
        }
        let mut held = HeldErrors::with_tunnel_uncertainty(flown.evidence);
        if held_by_posterior {
            held.take_posterior(self, &flown.evidence.maneuver.maneuver_id);
        }
        let total = flown.total(&derivatives);
        let mut rows = vec![flown.row(TOTAL, DerivativeUnit::Number, &derivatives, &total, &held)];
        for regressor in simple_regressors(&derivatives) {
            let slope = flown.slope(&derivatives, regressor, &total);
            let has_estimate = derivatives.iter().enumerate().any(|(i, d)| {
                let weight = slope.lift[i].abs() + slope.drag[i].abs();
                weight > 0.0 && d.regressor != Regressor::Constant && flown.is_estimated(d)
            });
            if has_estimate {
                let unit = regressor.unit().unwrap_or(DerivativeUnit::Number);
                rows.push(flown.row(&regressor.to_string(), unit, &derivatives, &slope, &held));
            }
        }
        rows
    }
}

impl PublishedManeuver<'_> {
    fn derivatives(&self) -> Vec<&Derivative> {
        let longitudinal = self.aero_model.derivatives_of(Axis::Longitudinal);
        longitudinal
            .filter(|d| !d.coefficient.is_moment())
            .collect()
    }

    fn estimate(&self, derivative: &Derivative) -> Option<&EstimateRow> {
        let mut rows = self.estimates.iter();
        rows.find(|row| row.derivative == derivative.name)
    }

    fn is_estimated(&self, derivative: &Derivative) -> bool {
        let row = self.estimate(derivative);
        row.is_some_and(|row| row.status == Status::Estimated && row.value.is_some())
    }

    /// Value of a derivative: as estimated or held; the tunnel's for an inactive derivative.
    fn value(&self, derivative: &Derivative) -> f64 {
        let row = self.estimate(derivative);
        row.and_then(|row| row.value.or(row.wind_tunnel))
            .unwrap_or(0.0)
    }

    /// Mean of a regressor without products over the maneuver. Rates and sideslip count as zero,
    /// since their means are small.
    fn mean(&self, part: &Regressor) -> f64 {
        let maneuver = self.evidence.maneuver;
        match part {
            Regressor::Constant => 1.0,
            Regressor::Alpha => maneuver.alpha_deg,
            Regressor::Surface(_) if part.is_velocity() => maneuver.velocity_ft_s,
            Regressor::Surface(_) if part.is_mach() => maneuver.mach,
            Regressor::Surface(name) | Regressor::Vane(name) => {
                self.means.surfaces_deg.get(name).copied().unwrap_or(0.0)
            }
            _ => 0.0,
        }
    }

    /// Weights of the derivatives in lift and drag, from each one's regressor or its slope.
    fn weights_from_regressors(
        &self,
        derivatives: &[&Derivative],
        regressor: impl Fn(&Derivative) -> f64,
    ) -> Weights {
        let Maneuver {
            alpha_deg,
            qbar_psf,
            ..
        } = *self.evidence.maneuver;
        let (sin, cos) = (RAD * alpha_deg).sin_cos();
        let factor = |d: &Derivative| regressor(d) * d.coefficient_factor(self.aircraft, qbar_psf);
        let weight = |by_normal: f64, by_axial: f64| {
            let weights = derivatives.iter().map(|d| match d.coefficient {
                Coefficient::CN => by_normal * factor(d),
                _ => by_axial * factor(d),
            });
            RowDVector::from_iterator(derivatives.len(), weights)
        };
        Weights {
            lift: weight(cos, -sin),
            drag: weight(sin, cos),
        }
    }

    fn total(&self, derivatives: &[&Derivative]) -> Weights {
        self.weights_from_regressors(derivatives, |d| d.regressor.value(&|part| self.mean(part)))
    }

    fn slope(&self, derivatives: &[&Derivative], along: &Regressor, total: &Weights) -> Weights {
        let mut slope = self.weights_from_regressors(derivatives, |d| {
            d.regressor.slope(along, &|part| self.mean(part))
        });
        if *along == Regressor::Alpha {
            slope.lift -= RAD * &total.drag;
            slope.drag += RAD * &total.lift;
        }
        slope
    }

    fn row(
        &self,
        regressor: &str,
        unit: DerivativeUnit,
        derivatives: &[&Derivative],
        weights: &Weights,
        held: &HeldErrors,
    ) -> LiftAndDragRow {
        let values = derivatives.iter().map(|d| self.value(d));
        let values = DVector::from_iterator(derivatives.len(), values);
        let covariance = self.covariance(derivatives, weights, held);
        let bound = |i: usize| covariance[(i, i)].max(0.0).sqrt();
        let correlation = covariance[(0, 1)] / (bound(0) * bound(1));
        let maneuver = self.evidence.maneuver;
        LiftAndDragRow {
            maneuver_id: maneuver.maneuver_id.clone(),
            class: maneuver.class.clone(),
            alpha_deg: maneuver.alpha_deg,
            mach: maneuver.mach,
            regressor: regressor.to_owned(),
            unit: unit.name().to_owned(),
            lift: (&weights.lift * &values)[0],
            lift_bound: bound(0),
            drag: (&weights.drag * &values)[0],
            drag_bound: bound(1),
            correlation: Some(correlation).filter(|c| c.is_finite()),
        }
    }

    /// Covariance of lift and drag.
    fn covariance(
        &self,
        derivatives: &[&Derivative],
        weights: &Weights,
        held: &HeldErrors,
    ) -> Matrix2<f64> {
        let place = |name: &String| derivatives.iter().position(|d| d.name == *name);
        let weights_of = |names: &[String]| {
            DMatrix::from_fn(2, names.len(), |i, j| {
                let row = if i == 0 { &weights.lift } else { &weights.drag };
                place(&names[j]).map_or(0.0, |d| row[d])
            })
        };
        let covariance = self.evidence.covariance;
        let (estimated, held_weights) = (weights_of(&covariance.names), weights_of(&held.names));
        let n = covariance.names.len();
        let corrected = DMatrix::from_row_slice(n, n, &covariance.corrected);
        let change = &held.gains * (&held.covariance - &held.assumed) * held.gains.transpose();
        let from_estimates = &estimated * (corrected + change) * estimated.transpose();
        let cross = &estimated * &held.gains * &held.covariance * held_weights.transpose();
        let from_held = &held_weights * &held.covariance * held_weights.transpose();
        let sum = from_estimates - &cross - cross.transpose() + from_held;
        sum.fixed_view::<2, 2>(0, 0).into_owned()
    }
}

impl HeldErrors {
    /// Errors of the held values with the tunnel's uncertainty.
    fn with_tunnel_uncertainty(evidence: &ManeuverResults) -> HeldErrors {
        let effects: Vec<_> = evidence.held_effects().collect();
        let deviations = effects.iter().map(|(_, effect)| effect.deviation.powi(2));
        let variances = DVector::from_iterator(effects.len(), deviations);
        let assumed = DMatrix::from_diagonal(&variances);
        let n = evidence.covariance.names.len();
        let gain = |i: usize, j: usize| effects[j].1.change[i] / effects[j].1.deviation;
        HeldErrors {
            names: effects.iter().map(|(name, _)| (*name).to_owned()).collect(),
            gains: DMatrix::from_fn(n, effects.len(), gain),
            covariance: assumed.clone(),
            assumed,
        }
    }

    /// Replaces the tunnel's covariance by that of the other flights.
    fn take_posterior(&mut self, model: &Model, maneuver_id: &str) {
        for (_, coefficient) in &model.coefficients {
            let Some(differences) = coefficient.held.get(maneuver_id) else {
                continue;
            };
            let place = |name: &String| self.names.iter().position(|n| n == name);
            let places: Vec<Option<usize>> = differences.derivatives.iter().map(place).collect();
            for (i, row) in places.iter().enumerate() {
                for (j, column) in places.iter().enumerate() {
                    if let (Some(row), Some(column)) = (row, column) {
                        self.covariance[(*row, *column)] = differences.covariance[(i, j)];
                    }
                }
            }
        }
    }
}

/// Distinct regressors of the derivatives that are neither constant nor composed of other
/// regressors.
fn simple_regressors<'a>(derivatives: &[&'a Derivative]) -> Vec<&'a Regressor> {
    let mut leaves: Vec<&Regressor> = Vec::new();
    for leaf in derivatives.iter().flat_map(|d| d.regressor.leaves()) {
        if *leaf != Regressor::Constant && !leaves.contains(&leaf) {
            leaves.push(leaf);
        }
    }
    leaves
}
