//! Dutch roll of a maneuver: of the aircraft by the maneuver's own estimates, and of a simulator by
//! its model.
//!
//! Period, time to half and damping ratio follow from the same linear equations at the maneuver's
//! condition ([`crate::qualities`]), so that only the derivatives differ. A maneuver contains no
//! free decay over several cycles from which they could be read.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::derivative_table::DerivativeTable;
use crate::aero::{AeroModel, Axis, Derivative, Regressor, WindTunnel};
use crate::aircraft::Aircraft;
use crate::maneuver::{Maneuver, Means};
use crate::model::{LocalKind, LocalPosterior, LocalValue};
use crate::numerics::linear_algebra::root::continuous_root;
use crate::numerics::statistics::random::RandomStream;
use crate::qualities::{Controls, FlownConditions, LinearModel, SteadyFlight};
use crate::tables::MatchedQuantity;

/// Estimates of a maneuver.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct OwnEstimates {
    /// Name and value of each derivative, estimated or held.
    pub values: Vec<(String, f64)>,
    /// Names of the estimated ones, and their corrected covariance row by row.
    pub estimated: Vec<String>,
    pub covariance: Vec<f64>,
}

/// Dutch roll of an oscillation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DutchRoll {
    pub period_s: f64,
    /// Time to half amplitude, or to double where it grows.
    pub half_s: f64,
    pub damping: f64,
}

impl DutchRoll {
    /// Value of a quantity; `None` for a time history.
    #[must_use]
    pub fn value(&self, quantity: MatchedQuantity) -> Option<f64> {
        match quantity {
            MatchedQuantity::DutchRollPeriod => Some(self.period_s),
            MatchedQuantity::DutchRollHalving => Some(self.half_s),
            MatchedQuantity::DutchRollDamping => Some(self.damping),
            _ => None,
        }
    }
}

/// Quantity of the Dutch roll according to the estimates of repeat flights, to first order.
#[derive(Clone, Debug, PartialEq)]
pub struct RepeatQuantity {
    pub mean: f64,
    /// Slopes along the deviations, in their order.
    pub slopes: Vec<f64>,
    /// Standard deviation from the errors of the estimates.
    pub error: f64,
}

/// Lateral equations at a maneuver's condition, with the maneuver's own estimates.
#[derive(Clone, Debug)]
pub struct LateralModes {
    linear: LinearModel,
    /// Derivatives of the equations, by their index in the build-up.
    derivatives: Vec<usize>,
    /// Values of the derivatives by the maneuver's own estimates.
    own: DVector<f64>,
    /// Mask of the derivatives that the maneuver estimates; the others are held.
    estimated: Vec<bool>,
    /// Root of the covariance of the estimates' errors.
    errors: DMatrix<f64>,
    alpha_deg: f64,
    pub flight: DutchRoll,
}

impl LateralModes {
    /// Equations of a maneuver; `None` if a derivative has no value or there is no oscillation.
    #[must_use]
    pub fn new(
        (aircraft, aero_model, tunnel): (&Aircraft, &AeroModel, &WindTunnel),
        (maneuver, means): (&Maneuver, &Means),
        estimates: &OwnEstimates,
    ) -> Option<LateralModes> {
        let conditions = FlownConditions::new(&[(maneuver, means)], tunnel);
        let trim = conditions.trim(maneuver.alpha_deg, aircraft)?;
        let nothing = BTreeMap::new();
        let flight = SteadyFlight {
            aircraft,
            aero_model,
            trim: &trim,
            controls: Controls {
                feedback: &nothing_by_surface(),
                pitch: &nothing,
            },
        };
        let derivatives = of_motion(aero_model);
        let own = |i: &usize| estimates.value(&aero_model.derivatives[*i].name);
        let own: Option<Vec<f64>> = derivatives.iter().map(own).collect();
        let own = DVector::from_vec(own?);
        let values = derivatives.iter().map(|i| LocalValue {
            coefficient: aero_model.derivatives[*i].coefficient,
            derivative: aero_model.derivatives[*i].name.clone(),
            kind: LocalKind::Derivative,
            is_mach_slope: false,
        });
        let linear = flight.lateral(&LocalPosterior {
            values: values.collect(),
            mean: own.clone(),
            covariance: DMatrix::zeros(0, 0),
        });
        let names = derivatives
            .iter()
            .map(|i| aero_model.derivatives[*i].name.as_str());
        let names: Vec<&str> = names.collect();
        Some(LateralModes {
            flight: dutch_roll(&linear, &own)?,
            estimated: names
                .iter()
                .map(|name| estimates.index_of(name).is_some())
                .collect(),
            errors: continuous_root(&estimates.covariance_of(&names)),
            alpha_deg: maneuver.alpha_deg,
            linear,
            derivatives,
            own,
        })
    }

    /// Dutch roll of a model.
    #[must_use]
    pub fn of_model(&self, table: &DerivativeTable) -> Option<DutchRoll> {
        dutch_roll(&self.linear, &self.values(table))
    }

    fn values(&self, table: &DerivativeTable) -> DVector<f64> {
        let values = self.derivatives.iter();
        let values = values.map(|derivative| table.value(self.alpha_deg, *derivative));
        DVector::from_iterator(self.own.len(), values)
    }

    /// Quantity according to the estimates of repeat flights, about the mean of a posterior;
    /// `deviations` are indices in the build-up and standard deviations. `None` if the Dutch roll
    /// does not oscillate.
    #[must_use]
    pub fn of_repeats(
        &self,
        quantity: MatchedQuantity,
        mean: &DerivativeTable,
        deviations: &[(usize, f64)],
    ) -> Option<RepeatQuantity> {
        let values = self.values(mean);
        let at = |values: DVector<f64>| self.as_estimated(values)?.value(quantity);
        let effect = |by: DVector<f64>| Some(0.5 * (at(&values + &by)? - at(&values - &by)?));
        let slope = |(derivative, deviation): &(usize, f64)| {
            let own = self.derivatives.iter().position(|own| own == derivative);
            let Some(own) = own.filter(|_| *deviation > 0.0) else {
                return Some(0.0);
            };
            let mut by = DVector::zeros(values.len());
            by[own] = *deviation;
            Some(effect(by)? / deviation)
        };
        let slopes: Option<Vec<f64>> = deviations.iter().map(slope).collect();
        let errors = self
            .errors
            .column_iter()
            .map(|own| effect(own.into_owned()));
        let errors: Option<Vec<f64>> = errors.collect();
        Some(RepeatQuantity {
            mean: at(values.clone())?,
            slopes: slopes?,
            error: DVector::from_vec(errors?).norm(),
        })
    }

    /// Dutch roll by the estimates from a repeat flight. The estimates are the derivatives of an
    /// aircraft that deviates from a model, plus errors of estimation.
    #[must_use]
    pub fn of_repeat(
        &self,
        mean: &DerivativeTable,
        deviation: impl Fn(usize) -> f64,
        stream: &mut RandomStream,
    ) -> Option<DutchRoll> {
        let mut values = self.values(mean);
        for (value, derivative) in values.iter_mut().zip(&self.derivatives) {
            *value += deviation(*derivative);
        }
        values += stream.deviations(&self.errors);
        self.as_estimated(values)
    }

    /// Dutch roll of a repeat flight's values. Values that the maneuver holds are kept.
    fn as_estimated(&self, mut values: DVector<f64>) -> Option<DutchRoll> {
        for ((value, own), is_estimated) in values.iter_mut().zip(&self.own).zip(&self.estimated) {
            if !is_estimated {
                *value = *own;
            }
        }
        dutch_roll(&self.linear, &values)
    }
}

impl OwnEstimates {
    fn value(&self, name: &str) -> Option<f64> {
        let own = self.values.iter().find(|(own, _)| own == name);
        own.map(|(_, value)| *value)
    }

    fn index_of(&self, name: &str) -> Option<usize> {
        self.estimated.iter().position(|own| own == name)
    }

    /// Covariance of some derivatives; zero for those that are held.
    fn covariance_of(&self, names: &[&str]) -> DMatrix<f64> {
        let places: Vec<Option<usize>> = names.iter().map(|name| self.index_of(name)).collect();
        let count = self.estimated.len();
        let entry = |i: usize, j: usize| {
            let at = places[i]? * count + places[j]?;
            self.covariance.get(at).copied()
        };
        DMatrix::from_fn(names.len(), names.len(), |i, j| entry(i, j).unwrap_or(0.0))
    }
}

/// Lateral derivatives of the motion; surfaces are fixed.
fn of_motion(aero_model: &AeroModel) -> Vec<usize> {
    let is_of_motion = |d: &Derivative| {
        let is_motion = d.regressor.surface().is_none() && d.regressor != Regressor::Constant;
        is_motion && d.coefficient.axis() == Axis::Lateral
    };
    let derivatives = aero_model.derivatives.iter().enumerate();
    derivatives
        .filter(|(_, d)| is_of_motion(d))
        .map(|(i, _)| i)
        .collect()
}

fn nothing_by_surface() -> BTreeMap<String, BTreeMap<String, f64>> {
    BTreeMap::new()
}

/// Dutch roll of the equations at values of their derivatives; `None` if it does not oscillate.
fn dutch_roll(linear: &LinearModel, values: &DVector<f64>) -> Option<DutchRoll> {
    let pair = linear.modes(Axis::Lateral, values)?.fast_pair();
    let (frequency, damping) = (pair.frequency().value, pair.damping().value);
    let damped = frequency * (1.0 - damping * damping).sqrt();
    let found = DutchRoll {
        period_s: 2.0 * std::f64::consts::PI / damped,
        half_s: std::f64::consts::LN_2 / (damping * frequency).abs(),
        damping,
    };
    let is_finite = found.period_s.is_finite() && found.half_s.is_finite();
    is_finite.then_some(found)
}
