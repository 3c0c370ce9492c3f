//! Coloured noise of the sensors, which filter error can mistake for motion of the air.
//!
//! Both explanations of coloured residuals have a likelihood. For moving air it is that of the
//! filter. For sensor noise it is that of output error with residuals that are an autoregressive
//! process, output by output. Gusts move all outputs together, so in moving air the filter explains
//! them better.

use super::whiteness::{are_white, white_cost};
use crate::dynamics::OUTPUTS;
use crate::filter_error::response::FilterResponse;
use crate::output_error::bounds::coloured;
use crate::output_error::{Fit, Measurements, Outcome};

/// Log-likelihood by which the sensors must explain the residuals better: very strong evidence (Kass and
/// Raftery 1995).
const VERY_STRONG: f64 = 5.0;

/// `true` if coloured noise of the sensors explains the residuals of output error better than
/// moving air does. It is never so if the innovations of the filter are white.
pub(in crate::estimate) fn explains(
    measurements: &Measurements,
    output_error: &Fit,
    filter: &FilterResponse,
) -> bool {
    if output_error.outcome != Outcome::Converged || are_white(measurements, &filter.predicted) {
        return false;
    }
    let colour = |computed: &[[f64; OUTPUTS]]| colour_gain(measurements, computed);
    let still = white_cost(measurements, output_error)
        .map(|cost| cost - colour(&output_error.response.outputs));
    let moving = filter.cost - colour(&filter.predicted);
    still.is_some_and(|still| still + VERY_STRONG < moving)
}

/// Gain in log-likelihood of coloured noise over white noise, summed over the outputs.
fn colour_gain(measurements: &Measurements, computed: &[[f64; OUTPUTS]]) -> f64 {
    let residuals = |o: usize| -> Vec<f64> {
        let pairs = measurements.values.iter().zip(computed);
        let counted = pairs.zip(&measurements.used);
        counted
            .map(|((z, y), used)| if used[o] { z[o] - y[o] } else { f64::NAN })
            .collect()
    };
    (0..OUTPUTS)
        .map(|o| coloured::likelihood_gain(&residuals(o)))
        .sum()
}
