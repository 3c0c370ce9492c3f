//! Rows of the tables from a fit.

use nalgebra::DMatrix;

use super::estimated::{Estimated, rejected_fit};
use super::task::Task;
use crate::aero::{Combined, Output};
use crate::dynamics::motion::ManeuverSignals;
use crate::maneuver::Status;
use crate::output_error::theil::OutputAgreement;
use crate::output_error::{Fit, Measurements};
use crate::tables::{AgreementRow, EstimateRow, FitRow, History, HistoryOutput, StartingValues};
use crate::units::Unit;

/// A derivative or bias of the axis with its status in the class.
struct Term<'a> {
    name: &'a str,
    unit: &'static str,
    status: Status,
}

/// Makes the rows of a maneuver.
pub(super) struct RowMaker<'t, 'a> {
    task: &'t Task<'a>,
}

impl<'t, 'a> RowMaker<'t, 'a> {
    pub fn new(task: &'t Task<'a>) -> Self {
        RowMaker { task }
    }

    /// Derivatives and biases of the axis.
    fn terms(&self) -> Vec<Term<'a>> {
        let (aero_model, axis) = (self.task.context.aero_model, self.task.class.axis);
        let derivatives = aero_model
            .derivatives_of(axis)
            .map(|d| (d.name.as_str(), d.unit().name()));
        let biases = aero_model
            .biases_of(axis)
            .map(|b| (b.name.as_str(), b.unit().name()));
        derivatives
            .chain(biases)
            .map(|(name, unit)| Term {
                name,
                unit,
                status: self.task.status(name).unwrap_or(Status::Inactive),
            })
            .collect()
    }

    /// One row per derivative and bias of the axis.
    pub fn estimate_rows(&self, fit: Option<(&Vec<String>, &Fit)>) -> Vec<EstimateRow> {
        let place_of = |name: &str| fit.and_then(|(names, _)| names.iter().position(|n| n == name));
        let deviation = |matrix: Option<&DMatrix<f64>>, j: usize| matrix.map(|m| m[(j, j)].sqrt());
        let mut rows = Vec::new();
        for term in self.terms() {
            let mut row = self.estimate_row(term.name, term.unit, term.status);
            match (term.status, place_of(term.name), fit) {
                (Status::Estimated, Some(j), Some((_, fit))) => {
                    row.value = Some(fit.values[j]);
                    row.bound = deviation(fit.covariance.as_ref(), j);
                    row.bound_held = deviation(fit.covariance_held.as_ref(), j);
                    row.bound_calibration = deviation(fit.covariance_calibration.as_ref(), j);
                    row.bound_corrected = deviation(fit.covariance_corrected.as_ref(), j);
                }
                (Status::Held, ..) => row.value = row.wind_tunnel,
                _ => {}
            }
            rows.push(row);
        }
        rows
    }

    /// Rows of the sums whose parts were both estimated.
    pub fn combined_rows(&self, names: &[String], fit: &Fit) -> Vec<EstimateRow> {
        let place_of = |name: &str| names.iter().position(|n| n == name);
        let sums = self.task.context.aero_model.combined.iter();
        sums.filter_map(|c| self.combined_row(c, place_of(&c.constant)?, place_of(&c.slope)?, fit))
            .collect()
    }

    /// Row of a sum `constant + slope α` of parameters `i` and `j`.
    fn combined_row(
        &self,
        combined: &Combined,
        i: usize,
        j: usize,
        fit: &Fit,
    ) -> Option<EstimateRow> {
        let alpha = self.task.maneuver.alpha_deg;
        let variance =
            |m: &DMatrix<f64>| m[(i, i)] + 2.0 * alpha * m[(i, j)] + alpha * alpha * m[(j, j)];
        let deviation = |m: &DMatrix<f64>| variance(m).max(0.0).sqrt();
        let unit = self.task.context.aero_model.unit_of(&combined.name)?.name();
        Some(EstimateRow {
            value: Some(fit.values[i] + alpha * fit.values[j]),
            bound: fit.covariance.as_ref().map(deviation),
            bound_held: fit.covariance_held.as_ref().map(deviation),
            bound_calibration: fit.covariance_calibration.as_ref().map(deviation),
            bound_corrected: fit.covariance_corrected.as_ref().map(deviation),
            ..self.estimate_row(&combined.name, unit, Status::Estimated)
        })
    }

    /// Row without results.
    fn estimate_row(&self, name: &str, unit: &str, status: Status) -> EstimateRow {
        EstimateRow {
            wind_tunnel: self.task.tunnel_value(name),
            ..EstimateRow::without_results(self.task.maneuver, name, unit, status)
        }
    }

    /// Row of `fits`.
    pub fn fit_row(&self, fit: &Fit, left_out: f64, start: StartingValues) -> FitRow {
        FitRow {
            reason: fit.reason.clone(),
            start: Some(start),
            iterations: fit.iterations,
            initial_cost: fit.initial_cost,
            final_cost: fit.final_cost,
            condition_number: fit.condition_number,
            left_out: Some(left_out),
            ..FitRow::without_numbers(
                &self.task.maneuver.maneuver_id,
                &self.task.class.name,
                fit.outcome,
            )
        }
    }

    /// Rows of the recorded outputs' agreements with computed ones, in the order of the axis.
    pub fn agreement_rows(&self, agreements: &[OutputAgreement]) -> Vec<AgreementRow> {
        let outputs = self.task.class.axis.outputs().into_iter();
        let recorded = outputs
            .zip(agreements)
            .filter(|(output, _)| !self.task.is_absent(*output));
        recorded
            .map(|(output, agreement)| self.agreement_row(output, agreement))
            .collect()
    }

    /// Row of an output's agreement with a computed one.
    fn agreement_row(&self, output: Output, agreement: &OutputAgreement) -> AgreementRow {
        let theil = agreement.theil();
        AgreementRow {
            maneuver_id: self.task.maneuver.maneuver_id.clone(),
            class: self.task.class.name.clone(),
            alpha_deg: self.task.maneuver.alpha_deg,
            output,
            unit: Unit::of_signal(output.signal()).name.to_owned(),
            samples: agreement.samples,
            root_mean_square: agreement.root_mean_square(),
            theil: theil.map(|t| t.coefficient),
            theil_bias: theil.map(|t| t.bias),
            theil_variance: theil.map(|t| t.variance),
            theil_covariance: theil.map(|t| t.covariance),
            r_squared: agreement.r_squared(),
        }
    }

    /// Result of a maneuver that is rejected, with the reason.
    pub fn rejected(&self, reason: String) -> Estimated {
        Estimated::without_fit(
            rejected_fit(self.task.maneuver, reason),
            self.estimate_rows(None),
        )
    }

    /// Measured and computed outputs, and the motion of the surfaces.
    pub fn history(
        &self,
        measured: &Measurements,
        fit: &Fit,
        signals: &ManeuverSignals,
        surfaces: &[&str],
    ) -> History {
        let outputs = self.task.class.axis.outputs().into_iter().enumerate();
        let recorded = outputs.filter(|(_, output)| !self.task.is_absent(*output));
        let outputs = recorded.map(|(o, output)| HistoryOutput {
            label: output.signal().to_owned(),
            unit: Unit::of_signal(output.signal()).name.to_owned(),
            measured: measured.values.iter().map(|z| z[o]).collect(),
            computed: fit.response.outputs.iter().map(|y| y[o]).collect(),
            marked: measured.used.iter().map(|used| !used[o]).collect(),
        });
        let mut names: Vec<&str> = surfaces.to_vec();
        names.sort_unstable();
        names.dedup();
        let control = |name: &str| {
            (
                name.to_owned(),
                signals.signal(name).iter().step_by(2).copied().collect(),
            )
        };
        History {
            maneuver_id: self.task.maneuver.maneuver_id.clone(),
            class: self.task.class.name.clone(),
            alpha_deg: self.task.maneuver.alpha_deg,
            time_s: (0..measured.values.len())
                .map(|k| k as f64 * signals.step_s)
                .collect(),
            outputs: outputs.collect(),
            controls: names.into_iter().map(control).collect(),
        }
    }
}
