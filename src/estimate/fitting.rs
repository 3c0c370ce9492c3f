//! Output error from two starting values.

use std::collections::BTreeMap;

use super::settings::Start;
use super::task::Task;
use crate::dynamics::Equations;
use crate::output_error::equation_error::Regression;
use crate::output_error::{Case, Fit, Outcome, equation_error, estimation};

/// Starting values of a maneuver.
#[derive(Clone)]
pub(super) struct StartingPoints {
    /// With the tunnel's derivatives.
    pub tunnel: Vec<f64>,
    /// With the derivatives that the measured accelerations imply.
    pub implied: Vec<f64>,
}

impl StartingPoints {
    /// Starting values of a maneuver.
    ///
    /// # Errors
    /// Nothing is free to be estimated.
    pub fn new<const NX: usize, E: Equations<NX>>(
        task: &Task,
        case: &Case<NX, E>,
    ) -> Result<Self, String> {
        Self::from_regression(
            task,
            case,
            &equation_error::regression(case, case, &BTreeMap::new()),
        )
    }

    /// Starting values of a maneuver whose equation error is known.
    ///
    /// # Errors
    /// Nothing is free to be estimated.
    pub fn from_regression<const NX: usize, E: Equations<NX>>(
        task: &Task,
        case: &Case<NX, E>,
        regression: &Regression,
    ) -> Result<Self, String> {
        if case.parameters() == 0 {
            return Err("nothing is free to be estimated".to_owned());
        }
        let tunnel = start_from_tunnel(task, case);
        Ok(StartingPoints {
            implied: equation_error::start_from(case, &tunnel, regression),
            tunnel,
        })
    }
}

/// Starting values with the tunnel's derivatives at the maneuver's mean angle of attack and Mach
/// number; zero for one without a table.
fn start_from_tunnel<const NX: usize, E: Equations<NX>>(
    task: &Task,
    case: &Case<NX, E>,
) -> Vec<f64> {
    let maneuver = task.maneuver;
    case.starting_values(|name| {
        task.context
            .start
            .value(name, maneuver.alpha_deg, maneuver.mach)
            .map_or(0.0, |v| v.value)
    })
}

/// Estimates, without bounds, from the configured starting values; if the iteration does not
/// converge, from the other kind of starting values.
pub(super) fn fit_output_error<const NX: usize, E: Equations<NX>>(
    task: &Task,
    case: &Case<NX, E>,
    starts: &StartingPoints,
) -> Result<(Fit, Start), String> {
    let settings = task.context.settings;
    let StartingPoints { tunnel, implied } = starts.clone();
    let (first, second, other_start) = match settings.start {
        Start::EquationError => (implied, tunnel, Start::WindTunnel),
        Start::WindTunnel => (tunnel, implied, Start::EquationError),
    };
    let resolution = task.resolution();
    let weights = task.weights()?;
    let fit_from = |start| {
        estimation::estimate_values(
            case,
            start,
            weights,
            settings.weights,
            resolution,
            &settings.iteration,
        )
    };
    let fit = fit_from(first);
    if fit.outcome == Outcome::Converged {
        return Ok((fit, settings.start));
    }
    let other = fit_from(second);
    Ok(if other.outcome == Outcome::Converged {
        (other, other_start)
    } else {
        (fit, settings.start)
    })
}
