//! Diagnostics of a fit: excitation, correlations, variance inflation, near-collinear groups.

use nalgebra::DMatrix;

use super::estimated::Estimated;
use super::task::Task;
use crate::aero::{Derivative, Regressor};
use crate::dynamics::Equations;
use crate::dynamics::motion::Window;
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

impl Task<'_> {
    /// Adds the diagnostics of a fit of `model` to its rows; `information` is that of its parameters.
    pub(super) fn add_diagnostics<const NX: usize, E: Equations<NX>>(
        &self,
        case: &Case<NX, E>,
        window: &Window,
        model: &Model,
        information: Option<&DMatrix<f64>>,
        estimated: &mut Estimated,
    ) {
        let flown = self.regressor_histories::<NX, E>(case, window, model);
        estimated.correlations = self.regressor_correlations(&flown, window);
        self.add_excitation(&flown, &mut estimated.estimates);
        let Some(information) = information else {
            return;
        };
        let settings = self.context.settings;
        let limits = &settings.identifiability;
        let Some(measured) =
            collinearity(information, settings.iteration.max_condition_number, limits)
        else {
            return;
        };
        for (name, inflation) in case.names.iter().zip(&measured.inflation) {
            if let Some(row) = estimated
                .estimates
                .iter_mut()
                .find(|row| row.derivative == *name)
            {
                row.variance_inflation = *inflation;
            }
        }
        estimated.fit.largest_condition_index =
            Some(measured.largest_index).filter(|index| index.is_finite());
        estimated.fit.confounded = groups_in_words(&measured, &case.names);
        if let Some(matrix) = &measured.correlation {
            estimated.correlations.extend(self.estimate_correlations(
                &case.names,
                matrix,
                limits.published_correlation,
            ));
        }
    }

    /// Regressors of all derivatives that act in the maneuver, free and held.
    fn regressor_histories<'m, const NX: usize, E: Equations<NX>>(
        &self,
        case: &Case<NX, E>,
        window: &Window,
        model: &Model<'m>,
    ) -> Vec<RegressorHistory<'m>> {
        let mut acting: Vec<&'m Derivative> = model
            .free
            .iter()
            .copied()
            .chain(model.held.iter().map(|(d, _)| *d))
            .collect();
        // In the order of the model, held or not, so that a pair has one name in all maneuvers.
        acting.sort_by_key(|d| {
            self.context
                .buildup
                .derivatives
                .iter()
                .position(|other| other.name == d.name)
        });
        let all = Model {
            free: acting.clone(),
            held: vec![],
            ..model.clone()
        };
        let wide = case.with_model(self.context.aircraft, window, &all);
        let flown = acting.into_iter().filter_map(|derivative| {
            let j = wide.names.iter().position(|n| *n == derivative.name)?;
            let history = wide.measured_regressor(j);
            let moved = match &derivative.regressor {
                Regressor::Constant => None,
                // In deg, not over q̄S.
                Regressor::Vane(name) => Some(excitation(&samples(window, name))),
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
        let value = |name: &str, rows: &[EstimateRow]| {
            let row = rows.iter().find(|r| r.derivative == name);
            row.and_then(|r| r.value)
                .or_else(|| self.tunnel_value(name))
                .unwrap_or(0.0)
        };
        for one in flown {
            let name = one.derivative.name.as_str();
            let mut total = vec![0.0; one.history.len()];
            for other in flown
                .iter()
                .filter(|o| o.derivative.coefficient == one.derivative.coefficient)
            {
                let derivative = value(&other.derivative.name, rows);
                total
                    .iter_mut()
                    .zip(&other.history)
                    .for_each(|(sum, r)| *sum += derivative * r);
            }
            let (part, whole) = (
                value(name, rows).abs() * excitation(&one.history),
                excitation(&total),
            );
            if let Some(row) = rows.iter_mut().find(|r| r.derivative == name) {
                row.excitation = one.excitation;
                row.contribution_pct = one
                    .excitation
                    .and((whole > 0.0).then(|| 100.0 * part / whole));
            }
        }
    }

    /// Correlations among the distinct regressors of the derivatives that the class estimates or
    /// holds.
    fn regressor_correlations(
        &self,
        flown: &[RegressorHistory],
        window: &Window,
    ) -> Vec<CorrelationRow> {
        let mut seen: Vec<(String, Vec<f64>)> = Vec::new();
        for one in flown {
            let active = matches!(
                self.status(&one.derivative.name),
                Some(Status::Estimated | Status::Held)
            );
            let (name, history) = match &one.derivative.regressor {
                Regressor::Constant => continue,
                Regressor::Alpha => ("alpha".to_owned(), one.history.clone()),
                Regressor::Beta => ("beta".to_owned(), one.history.clone()),
                Regressor::RollRate => (signal::P.to_owned(), samples(window, signal::P)),
                Regressor::PitchRate => (signal::Q.to_owned(), samples(window, signal::Q)),
                Regressor::YawRate => (signal::R.to_owned(), samples(window, signal::R)),
                Regressor::Surface(name) | Regressor::Vane(name) => {
                    (name.clone(), samples(window, name))
                }
                other => (other.to_string(), one.history.clone()),
            };
            if active && !seen.iter().any(|(other, _)| *other == name) {
                seen.push((name, history));
            }
        }
        let pairs = (0..seen.len()).flat_map(|i| (i + 1..seen.len()).map(move |j| (i, j)));
        let row = |(i, j): (usize, usize)| {
            let both = correlation(&seen[i].1, &seen[j].1)?;
            Some(self.correlation_row(CorrelationKind::Regressors, &seen[i].0, &seen[j].0, both))
        };
        pairs.filter_map(row).collect()
    }

    fn estimate_correlations(
        &self,
        names: &[String],
        matrix: &DMatrix<f64>,
        least: f64,
    ) -> Vec<CorrelationRow> {
        let pairs = (0..names.len()).flat_map(|i| (i + 1..names.len()).map(move |j| (i, j)));
        pairs
            .filter(|&(i, j)| matrix[(i, j)].abs() >= least)
            .map(|(i, j)| {
                self.correlation_row(
                    CorrelationKind::Estimates,
                    &names[i],
                    &names[j],
                    matrix[(i, j)],
                )
            })
            .collect()
    }

    fn correlation_row(
        &self,
        kind: CorrelationKind,
        first: &str,
        second: &str,
        correlation: f64,
    ) -> CorrelationRow {
        CorrelationRow {
            maneuver_id: self.maneuver.maneuver_id.clone(),
            class: self.class.name.clone(),
            kind,
            first: first.to_owned(),
            second: second.to_owned(),
            correlation,
        }
    }
}

/// A signal at the samples, without the interpolated points between them.
fn samples(window: &Window, name: &str) -> Vec<f64> {
    window.signal(name).iter().step_by(2).copied().collect()
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
