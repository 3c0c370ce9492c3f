//! Estimation of one maneuver by itself.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::assessment::credibility::{Credibility, ExplainedMotion};
use super::assessment::diagnostics::Diagnostics;
use super::assessment::second_opinion::add_second_opinion;
use super::calibration_effect::add_calibration_errors;
use super::context::Context;
use super::estimated::{Covariance, Estimated};
use super::fitting::{StartingPoints, fit_output_error};
use super::holding::held_by_evidence::{choose_held, undetermined_without_tunnel};
use super::holding::maneuver_class::class_of_maneuver;
use super::moving_air::air_motion::{Air, Filtered, needs_filter};
use super::moving_air::filter_minimum::NoMinimum;
use super::moving_air::whiteness::{is_white, lag_one, largest_correlation};
use super::prepared_case::PreparedCase;
use super::rows::RowMaker;
use super::settings::Hold;
use super::task::{Task, values_by_name};
use crate::aero::Axis;
use crate::dynamics::{
    Equations, InGusts, Lateral, LateralInGusts, Longitudinal, LongitudinalInGusts,
};
use crate::flight::Record;
use crate::maneuver::{Class, Maneuver};
use crate::output_error::equation_error::{self, Regression};
use crate::output_error::{Case, Fit, Measurements, Outcome, consider, cost, estimation};
use crate::tables::{EstimationMethod, StartingValues};

/// Remark on a fit by output error that is kept because its residuals are coloured noise of the
/// sensors, and not gusts.
const OF_SENSORS: &str = "; the residuals are coloured noise of the sensors";

/// Estimates one maneuver. A failure is reported in the outcome.
#[must_use]
pub fn maneuver(
    record: &Record,
    maneuver: &Maneuver,
    class: &Class,
    context: &Context,
) -> Estimated {
    let task = Task {
        record,
        maneuver,
        class,
        context,
    };
    if maneuver.is_rejected() {
        return RowMaker::new(&task).rejected(maneuver.quality.reason.clone());
    }
    let (class, reasons) = class_of_maneuver(&task);
    let task = Task {
        class: &class,
        ..task
    };
    let mut estimated = match context.settings.hold {
        Hold::Table => estimate_by_class(&task),
        Hold::Evidence => estimate_by_evidence(&task),
    };
    for row in &mut estimated.estimates {
        let reason = reasons.get(&row.derivative).cloned();
        row.held_because = reason.or_else(|| row.held_because.take());
    }
    estimated
}

/// Estimates with the derivatives held that the class holds.
fn estimate_by_class(task: &Task) -> Estimated {
    let estimated = match task.class.axis {
        Axis::Longitudinal => estimate::<3, Longitudinal, 4, LongitudinalInGusts>(task),
        Axis::Lateral => estimate::<4, Lateral, 6, LateralInGusts>(task),
    };
    estimated.unwrap_or_else(|reason| RowMaker::new(task).rejected(reason))
}

/// Estimates with the derivatives held that the maneuver's own evidence holds.
fn estimate_by_evidence(task: &Task) -> Estimated {
    let choice = match task.class.axis {
        Axis::Longitudinal => choose_held::<3, Longitudinal>(task),
        Axis::Lateral => choose_held::<4, Lateral>(task),
    };
    let choice = match choice {
        Ok(choice) => choice,
        Err(reason) => return RowMaker::new(task).rejected(reason),
    };
    let class = choice.applied_to(task.class);
    let task = Task {
        class: &class,
        ..*task
    };
    let mut estimated = estimate_by_class(&task);
    for row in &mut estimated.estimates {
        row.held_because = choice.reasons.get(&row.derivative).cloned();
    }
    estimated
}

/// Estimates by output error, and by filter error if the method or the residuals require it.
fn estimate<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
    task: &Task,
) -> Result<Estimated, String> {
    let prepared = PreparedCase::<NX, E>::new(task, task.class_model()?)?;
    let single = SingleEstimation::new(task, prepared);
    let SingleEstimation { prepared, wide, .. } = &single;
    let starts = StartingPoints::from_regression(task, &prepared.case, &single.second_opinion)?;
    let (mut fit, start) = fit_output_error(task, &prepared.case, &starts)?;
    let measurements = &prepared.case.measurements;
    if needs_filter(task.context.settings.method, measurements, &fit) {
        match Air::estimate::<NX, E, NG, G>(task, prepared, wide, starts.implied, &fit) {
            Air::Moves(filtered) => return Ok(single.estimated_in_gusts(&filtered)),
            Air::IsStill => fit.reason.push_str(OF_SENSORS),
            Air::Unknown(why) => discard_in_gusts(measurements, &why, &mut fit),
        }
    }
    single.add_bounds(&mut fit);
    Ok(single.estimated_in_still_air(&fit, start.into()))
}

/// A prepared maneuver, with everything that bounds and rows of its fit need.
struct SingleEstimation<'t, 'a, const NX: usize, E: Equations<NX>> {
    task: &'t Task<'a>,
    prepared: PreparedCase<'a, NX, E>,
    /// The case with the held derivatives free as well.
    wide: Case<NX, E>,
    /// Standard uncertainties of the held values by derivative.
    held_uncertainties: BTreeMap<&'a str, f64>,
    /// Estimates by equation error.
    second_opinion: Regression,
}

impl<'t, 'a, const NX: usize, E: Equations<NX>> SingleEstimation<'t, 'a, NX, E> {
    fn new(task: &'t Task<'a>, prepared: PreparedCase<'a, NX, E>) -> Self {
        let wide = prepared.with_held_free(task.context.aircraft);
        let held_uncertainties = task.held_uncertainties(&prepared.model);
        SingleEstimation {
            second_opinion: equation_error::regression(&prepared.case, &wide, &held_uncertainties),
            task,
            prepared,
            wide,
            held_uncertainties,
        }
    }

    /// Adds the covariances to a fit by output error: of the noise, of the held values and of
    /// calibration.
    fn add_bounds(&self, fit: &mut Fit) {
        let (context, prepared) = (self.task.context, &self.prepared);
        let case = &prepared.case;
        estimation::add_bounds(case, fit, &context.settings.iteration);
        if context.settings.hold == Hold::Evidence {
            fit.reason
                .push_str(&undetermined_without_tunnel(self.task, case, fit));
        }
        let values = values_by_name(&prepared.model, &case.names, &fit.values);
        consider::consider(case, &self.wide, &values, &self.held_uncertainties, fit);
        add_calibration_errors(self.task, prepared, fit);
    }

    /// Rows of a fit by output error.
    fn estimated_in_still_air(&self, fit: &Fit, start: StartingValues) -> Estimated {
        let information = fit
            .final_cost
            .map(|_| cost::sums(&fit.response, &fit.weights).information);
        let explanation = ExplainedMotion {
            outputs: fit.final_cost.map(|_| &*fit.response.outputs),
            attitude_drifts: false,
            second_opinion: &self.second_opinion,
        };
        let mut estimated = self.estimated(fit, start, information.as_ref(), explanation);
        estimated.fit.method = Some(EstimationMethod::OutputError);
        let measurements = &self.prepared.case.measurements;
        estimated.fit.autocorrelation =
            largest_correlation(lag_one(measurements, &fit.response.outputs));
        estimated
    }

    /// Rows of a fit by filter error.
    fn estimated_in_gusts(&self, filtered: &Filtered) -> Estimated {
        let second = filtered.second_opinion.as_ref();
        let explanation = ExplainedMotion {
            outputs: filtered.outputs_along_air.as_deref(),
            attitude_drifts: filtered.attitude_drifts,
            second_opinion: second.unwrap_or(&self.second_opinion),
        };
        let start = StartingValues::EquationError;
        let information = Some(&filtered.information);
        let mut estimated = self.estimated(&filtered.fit, start, information, explanation);
        filtered.add_gusts(self.task, self.prepared.case.step_s, &mut estimated.fit);
        estimated.noise = Some(filtered.noise);
        estimated
    }

    /// Rows of a fit with its diagnostics and its credibility.
    fn estimated(
        &self,
        fit: &Fit,
        start: StartingValues,
        information: Option<&DMatrix<f64>>,
        explanation: ExplainedMotion,
    ) -> Estimated {
        let (task, case) = (self.task, &self.prepared.case);
        let mut estimated = self.make_rows(fit, start);
        add_second_opinion(
            &case.names,
            explanation.second_opinion,
            &mut estimated.estimates,
        );
        let diagnostics = Diagnostics {
            task,
            case,
            signals: &self.prepared.signals,
            model: &self.prepared.model,
        };
        diagnostics.add_to(information, &mut estimated);
        let credibility = Credibility {
            task,
            case,
            fit,
            explanation,
        };
        credibility.add_to(&mut estimated);
        estimated
    }

    /// Rows of a fit by itself.
    fn make_rows(&self, fit: &Fit, start: StartingValues) -> Estimated {
        let PreparedCase {
            case,
            signals,
            surfaces,
            left_out,
            ..
        } = &self.prepared;
        let row_maker = RowMaker::new(self.task);
        Estimated {
            estimates: row_maker.estimate_rows(Some((&case.names, fit))),
            combined: row_maker.combined_rows(&case.names, fit),
            covariance: Covariance::of_fit(&case.names, fit),
            correlations: vec![],
            history: Some(row_maker.history(&case.measurements, fit, signals, surfaces)),
            fit: row_maker.fit_row(fit, *left_out, start),
            fit_outputs: vec![],
            noise: None,
            means: None,
        }
    }
}

/// Discards a fit by output error in moving air, since it charges the gusts to the derivatives.
fn discard_in_gusts(measurements: &Measurements, why: &NoMinimum, fit: &mut Fit) {
    if fit.outcome == Outcome::Converged && !is_white(measurements, fit) {
        fit.outcome = Outcome::NotConverged;
        fit.reason = format!("{why}, and the residuals of output error show that the air moved");
    }
}
