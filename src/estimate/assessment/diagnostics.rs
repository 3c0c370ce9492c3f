//! Diagnostics of a fit: excitation, correlations, variance inflation, near-collinear groups.

use nalgebra::DMatrix;

use crate::aero::{Derivative, Regressor};
use crate::dynamics::Equations;
use crate::dynamics::motion::ManeuverSignals;
use crate::estimate::estimated::Estimated;
use crate::estimate::task::Task;
use crate::flight::signal;
use crate::maneuver::Status;
use crate::output_error::identifiability::{Collinearity, collinearity, correlation, excitation};
use crate::output_error::{Case, Model};
use crate::tables::{CorrelationKind, CorrelationRow, EstimateRow};

/// History of a derivative's regressor.
struct RegressorHistory<'a> {
    derivative: &'a Derivative,
    /// Root mean square about the mean, deg or rad of a reduced rate; `None` for a constant.
    excitation: Option<f64>,
    /// Factor of the derivative, sample by sample.
    history: Vec<f64>,
}

/// A fit whose diagnostics are to be made.
pub(in crate::estimate) struct Diagnostics<'d, 'm, const NX: usize, E: Equations<NX>> {
    pub task: &'d Task<'m>,
    pub case: &'d Case<NX, E>,
    pub signals: &'d ManeuverSignals,
    pub model: &'d Model<'m>,
}

impl<'m, const NX: usize, E: Equations<NX>> Diagnostics<'_, 'm, NX, E> {
    /// Adds the diagnostics of the fit to its rows; `information` is that of its parameters.
    pub fn add_to(&self, information: Option<&DMatrix<f64>>, estimated: &mut Estimated) {
        let flown = self.regressor_histories();
        estimated.correlations = self.regressor_correlations(&flown);
        self.add_excitation(&flown, &mut estimated.estimates);
        if let Some(information) = information {
            self.add_collinearity(information, estimated);
        }
    }

    /// Adds variance inflation, the largest condition index, near-collinear groups and the
    /// correlations of the estimates.
    fn add_collinearity(&self, information: &DMatrix<f64>, estimated: &mut Estimated) {
        let settings = self.task.context.settings;
        let limits = &settings.identifiability;
        let Some(measured) =
            collinearity(information, settings.iteration.max_condition_number, limits)
        else {
            return;
        };
        let names = &self.case.names;
        for (name, inflation) in names.iter().zip(&measured.inflation) {
            let mut rows = estimated.estimates.iter_mut();
            if let Some(row) = rows.find(|row| row.derivative == *name) {
                row.variance_inflation = *inflation;
            }
        }
        estimated.fit.largest_condition_index =
            Some(measured.largest_index).filter(|index| index.is_finite());
        estimated.fit.confounded = groups_in_words(&measured, names);
        if let Some(matrix) = &measured.correlation {
            let correlations = self.estimate_correlations(matrix, limits.published_correlation);
            estimated.correlations.extend(correlations);
        }
    }

    /// Regressors of all derivatives that act in the maneuver, free and held.
    fn regressor_histories(&self) -> Vec<RegressorHistory<'m>> {
        let (signals, model) = (self.signals, self.model);
        let mut acting: Vec<&'m Derivative> = model
            .free
            .iter()
            .copied()
            .chain(model.held.iter().map(|(d, _)| *d))
            .collect();
        // In the order of the model, held or not, so that a pair has one name in all maneuvers.
        acting.sort_by_key(|d| {
            let mut derivatives = self.task.context.aero_model.derivatives.iter();
            derivatives.position(|other| other.name == d.name)
        });
        let all = Model {
            free: acting.clone(),
            held: vec![],
            ..model.clone()
        };
        let wide = self
            .case
            .with_model(self.task.context.aircraft, signals, &all);
        let flown = acting.into_iter().filter_map(|derivative| {
            let j = wide.names.iter().position(|n| *n == derivative.name)?;
            let history = wide.measured_regressor(j);
            let moved = match &derivative.regressor {
                Regressor::Constant => None,
                // In deg, not over q̄S.
                Regressor::Vane(name) => Some(excitation(&signals.samples_of(name))),
                _ => Some(excitation(&history)),
            };
            Some(RegressorHistory {
                derivative,
                excitation: moved,
                history,
            })
        });
        flown.collect()
    }

    /// Adds the excitation of each row, and its contribution to the motion of its coefficient.
    fn add_excitation(&self, flown: &[RegressorHistory], rows: &mut [EstimateRow]) {
        for one in flown {
            let name = one.derivative.name.as_str();
            let contribution = self.contribution_pct(one, flown, rows);
            if let Some(row) = rows.iter_mut().find(|r| r.derivative == name) {
                row.excitation = one.excitation;
                row.contribution_pct = one.excitation.and(contribution);
            }
        }
    }

    /// Rms of a derivative's term, percent of that of all terms of its coefficient together; `None`
    /// for a coefficient at rest.
    fn contribution_pct(
        &self,
        one: &RegressorHistory,
        flown: &[RegressorHistory],
        rows: &[EstimateRow],
    ) -> Option<f64> {
        let mut total = vec![0.0; one.history.len()];
        for other in flown
            .iter()
            .filter(|o| o.derivative.coefficient == one.derivative.coefficient)
        {
            let derivative = self.value_in_fit(&other.derivative.name, rows);
            total
                .iter_mut()
                .zip(&other.history)
                .for_each(|(sum, r)| *sum += derivative * r);
        }
        let term = self.value_in_fit(&one.derivative.name, rows).abs() * excitation(&one.history);
        let whole = excitation(&total);
        (whole > 0.0).then(|| 100.0 * term / whole)
    }

    /// Value of a derivative in the fit: as estimated, or the tunnel's.
    fn value_in_fit(&self, name: &str, rows: &[EstimateRow]) -> f64 {
        let row = rows.iter().find(|r| r.derivative == name);
        row.and_then(|r| r.value)
            .or_else(|| self.task.tunnel_value(name))
            .unwrap_or(0.0)
    }

    /// Correlations among the distinct regressors of the derivatives that the class estimates or
    /// holds.
    fn regressor_correlations(&self, flown: &[RegressorHistory]) -> Vec<CorrelationRow> {
        let mut distinct: Vec<(String, Vec<f64>)> = Vec::new();
        for one in flown {
            let active = matches!(
                self.task.status(&one.derivative.name),
                Some(Status::Estimated | Status::Held)
            );
            let Some((name, history)) = self.named_regressor(one) else {
                continue;
            };
            if active && !distinct.iter().any(|(other, _)| *other == name) {
                distinct.push((name, history));
            }
        }
        let row = |(i, j): (usize, usize)| {
            let ((first, a), (second, b)) = (&distinct[i], &distinct[j]);
            let coefficient = correlation(a, b)?;
            Some(self.correlation_row(CorrelationKind::Regressors, [first, second], coefficient))
        };
        pairs(distinct.len()).filter_map(row).collect()
    }

    /// Name and history of a regressor: of the signal where it is one; `None` for a constant.
    fn named_regressor(&self, one: &RegressorHistory) -> Option<(String, Vec<f64>)> {
        let of_signal = |name: &str| (name.to_owned(), self.signals.samples_of(name));
        Some(match &one.derivative.regressor {
            Regressor::Constant => return None,
            Regressor::Alpha => ("alpha".to_owned(), one.history.clone()),
            Regressor::Beta => ("beta".to_owned(), one.history.clone()),
            Regressor::RollRate => of_signal(signal::P),
            Regressor::PitchRate => of_signal(signal::Q),
            Regressor::YawRate => of_signal(signal::R),
            Regressor::Surface(name) | Regressor::Vane(name) => of_signal(name),
            other => (other.to_string(), one.history.clone()),
        })
    }

    /// Correlations among the estimates, from a published size on.
    fn estimate_correlations(&self, matrix: &DMatrix<f64>, least: f64) -> Vec<CorrelationRow> {
        let names = &self.case.names;
        pairs(names.len())
            .filter(|&(i, j)| matrix[(i, j)].abs() >= least)
            .map(|(i, j)| {
                let pair = [names[i].as_str(), names[j].as_str()];
                self.correlation_row(CorrelationKind::Estimates, pair, matrix[(i, j)])
            })
            .collect()
    }

    /// Row of the correlation of two regressors or estimates.
    fn correlation_row(
        &self,
        kind: CorrelationKind,
        [first, second]: [&str; 2],
        correlation: f64,
    ) -> CorrelationRow {
        CorrelationRow {
            maneuver_id: self.task.maneuver.maneuver_id.clone(),
            class: self.task.class.name.clone(),
            kind,
            first: first.to_owned(),
            second: second.to_owned(),
            correlation,
        }
    }
}

/// Pairs of the numbers below a count, each once.
fn pairs(count: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..count).flat_map(move |i| (i + 1..count).map(move |j| (i, j)))
}

/// Near-collinear groups by name, worst first, each group once.
fn groups_in_words(measured: &Collinearity, names: &[String]) -> Option<String> {
    let mut groups: Vec<String> = Vec::new();
    for group in &measured.groups {
        let members: Vec<&str> = group
            .parameters
            .iter()
            .filter_map(|&j| names.get(j))
            .map(String::as_str)
            .collect();
        let group = members.join(", ");
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    (!groups.is_empty()).then(|| groups.join("; "))
}
