//! Output error from two starting values.

use super::settings::Start;
use super::task::Task;
use crate::dynamics::Equations;
use crate::output_error::{Case, Fit, Outcome, equation_error, estimation};

/// Starting values of a maneuver.
#[derive(Clone)]
pub(super) struct StartingPoints {
    /// With the tunnel's derivatives.
    pub tunnel: Vec<f64>,
    /// With the derivatives that the measured accelerations imply.
    pub implied: Vec<f64>,
}

impl Task<'_> {
    /// Starting values; an error where nothing is free.
    pub(super) fn starting_points<const NX: usize, E: Equations<NX>>(
        &self,
        case: &Case<NX, E>,
    ) -> Result<StartingPoints, String> {
        if case.parameters() == 0 {
            return Err("nothing is free to be estimated".to_owned());
        }
        let tunnel = self.tunnel_start(case);
        Ok(StartingPoints {
            implied: equation_error::start(case, &tunnel),
            tunnel,
        })
    }

    /// Estimates, without bounds, from the configured starting values; if the iteration does not
    /// converge, from the other kind of starting values.
    pub(super) fn fit<const NX: usize, E: Equations<NX>>(
        &self,
        case: &Case<NX, E>,
        starts: &StartingPoints,
    ) -> Result<(Fit, Start), String> {
        let settings = self.context.settings;
        let StartingPoints { tunnel, implied } = starts.clone();
        let (first, second, other_start) = match settings.start {
            Start::EquationError => (implied, tunnel, Start::WindTunnel),
            Start::WindTunnel => (tunnel, implied, Start::EquationError),
        };
        let resolution = self.resolution();
        let weights = self.weights()?;
        let from = |start| {
            estimation::estimate_values(
                case,
                start,
                weights,
                settings.weights,
                resolution,
                &settings.iteration,
            )
        };
        let fit = from(first);
        if fit.outcome == Outcome::Converged {
            return Ok((fit, settings.start));
        }
        let other = from(second);
        Ok(if other.outcome == Outcome::Converged {
            (other, other_start)
        } else {
            (fit, settings.start)
        })
    }
}
