//! Disturbance of a relation by gusts: the error of its slope, and its least correlation.

use super::gusts::Gusts;
use super::relations::{Relation, Selection};
use super::windows::WindowPair;
use crate::numerics::statistics::order_statistics::{SIGMA_PER_MAD, upper_median};

/// Number of standard deviations that gusts reach in one of many windows: normal gusts in one of 370, about as
/// many as a flight has.
const GUST_DEVIATIONS: f64 = 3.0;

/// Effect of gusts on one kinematic relation, in the unit of the relation's measured and predicted
/// side.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disturbance {
    /// Root mean square of the gusts on the measured side.
    pub gust: f64,
    /// Root mean square of the predicted side that may be the aircraft's response to gusts.
    pub response: f64,
}

impl Disturbance {
    /// Error of a slope that gusts may cause. The response correlates with the gust, at most
    /// entirely (Cauchy and Schwarz), and no number of windows averages it out.
    pub fn slope_error(self, predicted_rms: f64) -> f64 {
        self.gust * self.response.min(predicted_rms) / (predicted_rms * predicted_rms)
    }

    /// Least correlation that a right relation has in gusts, where windows are selected by a level.
    ///
    /// The measured side is the predicted one, p, and the gust, g. With a mean c of −p g the
    /// correlation is (p² − c)/(p √(p² − 2 c + g²)). It is least at c = g². Gusts that reach the
    /// level select the windows in which they do.
    pub fn least_correlation(self, predicted_rms: f64, level: f64) -> f64 {
        let gust = if GUST_DEVIATIONS * self.gust > level {
            self.gust.max(level)
        } else {
            self.gust
        };
        let square = predicted_rms * predicted_rms;
        let common = gust * self.response.min(predicted_rms).min(gust);
        if common < square {
            (square - common) / (square * (square - 2.0 * common + gust * gust)).sqrt()
        } else {
            0.0
        }
    }
}

/// Disturbance of a relation by the gusts of a flight; `pairs` are all its windows.
///
/// Most windows are quiet, so in them the predicted side moves as the aircraft responds to gusts.
/// If the largest windows are selected, they may be those of the strongest gusts: all of their
/// motion counts as response.
pub fn disturbance(relation: &Relation, pairs: &[WindowPair], gusts: &Gusts) -> Disturbance {
    let Some((_, per_ft_s2)) = relation.disturbed_by_gusts() else {
        return Disturbance::default();
    };
    let response = match relation.selection {
        Selection::Above(_) => robust_deviation(pairs.iter().map(|p| p.predicted)),
        Selection::Largest { .. } => f64::INFINITY,
    };
    Disturbance {
        gust: per_ft_s2 * gusts.largest_change_ft_s2(),
        response,
    }
}

/// Robust standard deviation.
fn robust_deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let middle = upper_median(values.clone()).unwrap_or_default();
    SIGMA_PER_MAD * upper_median(values.map(|v| (v - middle).abs())).unwrap_or_default()
}
