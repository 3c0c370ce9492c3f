//! Estimation of one maneuver by itself.

use nalgebra::DMatrix;

use super::context::Context;
use super::doubt::Explanation;
use super::estimated::{Covariance, Estimated};
use super::filter_minimum::NoMinimum;
use super::in_gusts::{Air, Filtered};
use super::prepared_case::PreparedCase;
use super::second_opinion::add_second_opinion;
use super::settings::Hold;
use super::task::{Task, values_by_name};
use super::whiteness::is_white;
use crate::aero::Axis;
use crate::dynamics::{
    Equations, InGusts, Lateral, LateralInGusts, Longitudinal, LongitudinalInGusts,
};
use crate::flight::Record;
use crate::maneuver::{Class, Maneuver};
use crate::output_error::equation_error::{self, Regression};
use crate::output_error::{Fit, Measurements, Outcome, consider, cost, estimation};
use crate::tables::StartingValues;

/// Remark on a fit by output error that is kept because its residuals are coloured noise of the
/// sensors, and not gusts.
const OF_SENSORS: &str = "; the residuals are coloured noise of the sensors";

/// Reason why a derivative that the class estimates is inactive in a maneuver.
const RESTS: &str = "its surface rests";

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
        return task.rejected(maneuver.quality.reason.clone());
    }
    match context.settings.hold {
        Hold::Table => task.estimate_by_moving_surfaces(),
        Hold::Evidence => task.estimate_by_evidence(),
    }
}

impl Task<'_> {
    /// Estimates with the derivatives held that the class holds.
    fn estimate_by_class(&self) -> Estimated {
        let estimated = match self.class.axis {
            Axis::Longitudinal => self.estimate::<3, Longitudinal, 4, LongitudinalInGusts>(),
            Axis::Lateral => self.estimate::<4, Lateral, 6, LateralInGusts>(),
        };
        estimated.unwrap_or_else(|reason| self.rejected(reason))
    }

    /// Estimates as the class does, without the derivatives of surfaces that rest.
    fn estimate_by_moving_surfaces(&self) -> Estimated {
        let (class, resting) = self.class_of_moving_surfaces();
        let task = Task {
            class: &class,
            ..*self
        };
        let mut estimated = task.estimate_by_class();
        let rows = estimated.estimates.iter_mut();
        for row in rows.filter(|row| resting.contains(&row.derivative)) {
            row.held_because = Some(RESTS.to_owned());
        }
        estimated
    }

    /// Estimates with the derivatives held that the maneuver's own evidence holds.
    fn estimate_by_evidence(&self) -> Estimated {
        let choice = match self.class.axis {
            Axis::Longitudinal => self.choose_held::<3, Longitudinal>(),
            Axis::Lateral => self.choose_held::<4, Lateral>(),
        };
        let choice = match choice {
            Ok(choice) => choice,
            Err(reason) => return self.rejected(reason),
        };
        let class = choice.applied_to(self.class);
        let task = Task {
            class: &class,
            ..*self
        };
        let mut estimated = task.estimate_by_class();
        for row in &mut estimated.estimates {
            row.held_because = choice.reasons.get(&row.derivative).cloned();
        }
        estimated
    }

    fn estimate<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
        &self,
    ) -> Result<Estimated, String> {
        let prepared = self.prepare::<NX, E>(self.class_model()?)?;
        let case = &prepared.case;
        let starts = self.starting_points(case)?;
        let (mut fit, start) = self.fit(case, &starts)?;
        let with_held_free = self.with_held_free(&prepared);
        let uncertainties = self.held_uncertainties(&prepared.model);
        let second = equation_error::regression(case, &with_held_free, &uncertainties);
        if self.needs_filter(&case.measurements, &fit) {
            let implied = starts.implied;
            match self.filtered::<NX, E, NG, G>(&prepared, &with_held_free, implied, &fit) {
                Air::Moves(filtered) => {
                    return Ok(self.estimated_in_gusts(&prepared, &filtered, &second));
                }
                Air::IsStill => fit.reason.push_str(OF_SENSORS),
                Air::Unknown(why) => discard_in_gusts(&case.measurements, &why, &mut fit),
            }
        }
        estimation::add_bounds(case, &mut fit, &self.context.settings.iteration);
        if self.context.settings.hold == Hold::Evidence {
            fit.reason
                .push_str(&self.undetermined_without_tunnel(case, &fit));
        }
        let values = values_by_name(&prepared.model, &case.names, &fit.values);
        consider::consider(case, &with_held_free, &values, &uncertainties, &mut fit);
        self.add_calibration_errors(&prepared, &mut fit);
        let information = fit
            .final_cost
            .map(|_| cost::sums(&fit.response, &fit.weights).information);
        let explanation = Explanation {
            outputs: fit.final_cost.map(|_| &*fit.response.outputs),
            attitude_drifts: false,
            second_opinion: &second,
        };
        let mut estimated =
            self.estimated(&prepared, &fit, start.into(), information.as_ref(), &second);
        self.add_agreement(case, &fit, &explanation, &mut estimated);
        Self::add_still_air(&case.measurements, &fit, &mut estimated.fit);
        Ok(estimated)
    }

    fn estimated_in_gusts<const NX: usize, E: Equations<NX>>(
        &self,
        prepared: &PreparedCase<NX, E>,
        filtered: &Filtered,
        second: &Regression,
    ) -> Estimated {
        let start = StartingValues::EquationError;
        let information = Some(&filtered.information);
        let second = filtered.second_opinion.as_ref().unwrap_or(second);
        let mut estimated = self.estimated(prepared, &filtered.fit, start, information, second);
        self.add_gusts(filtered, prepared.case.step_s, &mut estimated.fit);
        estimated.noise = Some(filtered.noise);
        let explanation = Explanation {
            outputs: filtered.outputs_along_air.as_deref(),
            attitude_drifts: filtered.attitude_drifts,
            second_opinion: second,
        };
        self.add_agreement(&prepared.case, &filtered.fit, &explanation, &mut estimated);
        estimated
    }

    /// Rows of a fit with its diagnostics.
    fn estimated<const NX: usize, E: Equations<NX>>(
        &self,
        prepared: &PreparedCase<NX, E>,
        fit: &Fit,
        start: StartingValues,
        information: Option<&DMatrix<f64>>,
        second: &Regression,
    ) -> Estimated {
        let PreparedCase {
            case,
            window,
            model,
            surfaces,
            left_out,
        } = prepared;
        let mut estimated = Estimated {
            estimates: self.estimate_rows(Some((&case.names, fit))),
            combined: self.combined_rows(&case.names, fit),
            covariance: Covariance::of_fit(&case.names, fit),
            correlations: vec![],
            history: Some(self.history(&case.measurements, fit, window, surfaces)),
            fit: self.fit_row(fit, *left_out, start),
            fit_outputs: vec![],
            noise: None,
            means: None,
        };
        add_second_opinion(&case.names, second, &mut estimated.estimates);
        self.add_diagnostics(case, window, model, information, &mut estimated);
        estimated
    }
}

/// Discards a fit by output error in moving air, since it charges the gusts to the derivatives.
fn discard_in_gusts(measurements: &Measurements, why: &NoMinimum, fit: &mut Fit) {
    if fit.outcome == Outcome::Converged && !is_white(measurements, fit) {
        fit.outcome = Outcome::NotConverged;
        fit.reason = format!("{why}, and the residuals of output error show that the air moved");
    }
}
