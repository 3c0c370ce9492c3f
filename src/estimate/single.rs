//! Estimation of one maneuver by itself.

use super::context::Context;
use super::estimated::{Covariance, Estimated};
use super::second_opinion::add_second_opinion;
use super::settings::Hold;
use super::task::{Task, values_by_name};
use crate::aero::Axis;
use crate::dynamics::{Equations, Lateral, Longitudinal};
use crate::flight::Record;
use crate::maneuver::{Class, Maneuver};
use crate::output_error::{consider, equation_error};

/// Estimates one maneuver. The outcome has any failure.
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
        Hold::Table => task.estimate_by_class(),
        Hold::Evidence => task.estimate_by_evidence(),
    }
}

impl Task<'_> {
    /// Estimates with the derivatives held that the class holds.
    fn estimate_by_class(&self) -> Estimated {
        let estimated = match self.class.axis {
            Axis::Longitudinal => self.estimate::<3, Longitudinal>(),
            Axis::Lateral => self.estimate::<4, Lateral>(),
        };
        estimated.unwrap_or_else(|reason| self.rejected(reason))
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

    fn estimate<const NX: usize, E: Equations<NX>>(&self) -> Result<Estimated, String> {
        let prepared = self.prepare::<NX, E>(self.class_model()?)?;
        let case = &prepared.case;
        let (mut fit, start) = self.fit(case)?;
        if self.context.settings.hold == Hold::Evidence {
            fit.reason
                .push_str(&self.undetermined_without_tunnel(case, &fit));
        }
        let with_held_free = self.with_held_free(&prepared);
        let values = values_by_name(&prepared.model, &case.names, &fit.values);
        let uncertainties = self.held_uncertainties(&prepared.model);
        consider::consider(case, &with_held_free, &values, &uncertainties, &mut fit);
        let second = equation_error::regression(case, &with_held_free, &uncertainties);
        self.add_calibration_errors(&prepared, &mut fit);
        let history = self.history(
            &case.measurements,
            &fit,
            &prepared.window,
            &prepared.surfaces,
        );
        let mut estimated = Estimated {
            estimates: self.estimate_rows(Some((&case.names, &fit))),
            combined: self.combined_rows(&case.names, &fit),
            covariance: Covariance::of_fit(&case.names, &fit),
            correlations: vec![],
            history: Some(history),
            fit: self.fit_row(&fit, prepared.left_out, start.into()),
        };
        add_second_opinion(&case.names, &second, &mut estimated.estimates);
        self.add_diagnostics(
            case,
            &prepared.window,
            &prepared.model,
            &fit,
            &mut estimated,
        );
        Ok(estimated)
    }
}
