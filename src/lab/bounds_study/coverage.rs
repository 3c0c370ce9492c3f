//! Bias and scatter of the estimates of one maneuver, and coverage of their intervals.

use rayon::prelude::*;

use super::recordings::{Scenario, StudyManeuver};
use crate::estimate::Estimated;
use crate::lab::simulator::TrueDerivative;
use crate::lab::simulator::random::derived_seed;
use crate::maneuver::Status;
use crate::output_error::Outcome;
use crate::tables::{CoverageRow, EstimateRow};

/// Half widths of the intervals that contain a normal deviate with probability 0.68 and 0.95.
const HALF_68: f64 = 0.994_458;
const HALF_95: f64 = 1.959_964;

/// Estimates a maneuver from many recordings: a row per estimated derivative.
#[must_use]
pub fn coverage(
    maneuver: &StudyManeuver,
    scenario: Scenario,
    realisations: usize,
    seed: u64,
) -> Vec<CoverageRow> {
    let estimated: Vec<Estimated> = (0..realisations)
        .into_par_iter()
        .map(|i| maneuver.estimate(scenario, derived_seed(seed, &format!("realisation {i}"))))
        .collect();
    let converged: Vec<&Estimated> = estimated
        .iter()
        .filter(|e| e.fit.outcome == Outcome::Converged)
        .collect();
    let row = |truth: &TrueDerivative| {
        let rows: Vec<&EstimateRow> = converged
            .iter()
            .filter_map(|e| row_of(e, &truth.derivative))
            .collect();
        (!rows.is_empty()).then(|| {
            let errors: Vec<f64> = rows
                .iter()
                .filter_map(|r| Some(r.value? - truth.value))
                .collect();
            let statistics = ErrorStatistics::of(&errors);
            let white = Intervals::new(&errors, &statistics, rows.iter().map(|r| r.bound));
            let corrected =
                Intervals::new(&errors, &statistics, rows.iter().map(|r| r.bound_corrected));
            CoverageRow {
                class: maneuver.class.name.clone(),
                alpha_deg: maneuver.flown.maneuver.alpha_deg,
                residuals: scenario.residuals,
                weights: scenario.weights,
                derivative: truth.derivative.clone(),
                unit: truth.unit.to_owned(),
                truth: truth.value,
                realisations,
                converged: converged.len(),
                bias: statistics.mean,
                scatter: statistics.deviation,
                bias_over_scatter: statistics.mean / statistics.deviation,
                scatter_over_bound: white.ratio,
                coverage_68: white.share_68,
                coverage_95: white.share_95,
                scatter_over_corrected: corrected.ratio,
                corrected_coverage_68: corrected.share_68,
                corrected_coverage_95: corrected.share_95,
            }
        })
    };
    maneuver.flown.truth.iter().filter_map(row).collect()
}

fn row_of<'a>(estimated: &'a Estimated, derivative: &str) -> Option<&'a EstimateRow> {
    estimated
        .estimates
        .iter()
        .find(|r| r.derivative == derivative && r.status == Status::Estimated)
}

/// Mean and standard deviation of errors.
struct ErrorStatistics {
    mean: f64,
    deviation: f64,
}

impl ErrorStatistics {
    fn of(errors: &[f64]) -> ErrorStatistics {
        let n = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / n;
        let square: f64 = errors.iter().map(|e| (e - mean) * (e - mean)).sum();
        ErrorStatistics {
            mean,
            deviation: (square / (n - 1.0).max(1.0)).sqrt(),
        }
    }
}

/// Comparison of one kind of bound with the errors.
struct Intervals {
    /// Standard deviation of the errors over the root mean square of the bounds.
    ratio: f64,
    /// Share of the 68% intervals that contain the truth.
    share_68: f64,
    /// Share of the 95% intervals that contain the truth.
    share_95: f64,
}

impl Intervals {
    /// Compares errors with bounds; a missing bound covers nothing.
    fn new(
        errors: &[f64],
        statistics: &ErrorStatistics,
        bounds: impl Iterator<Item = Option<f64>>,
    ) -> Intervals {
        let bounds: Vec<f64> = bounds.map(|b| b.unwrap_or(0.0)).collect();
        let n = bounds.len().max(1) as f64;
        let within = |half: f64| {
            errors
                .iter()
                .zip(&bounds)
                .filter(|(e, b)| e.abs() <= half * **b)
                .count() as f64
                / n
        };
        let square = bounds.iter().map(|b| b * b).sum::<f64>() / n;
        Intervals {
            ratio: statistics.deviation / square.sqrt(),
            share_68: within(HALF_68),
            share_95: within(HALF_95),
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn an_interval_covers_the_truth_if_the_error_is_within_its_half_width() {
        let errors = [0.5, -0.9, 1.5, -3.0];
        let statistics = ErrorStatistics::of(&errors);
        assert_relative_eq!(statistics.mean, -0.475);
        let found = Intervals::new(
            &errors,
            &statistics,
            [Some(1.0), Some(1.0), Some(1.0), None].into_iter(),
        );
        assert_relative_eq!(found.share_68, 0.5);
        assert_relative_eq!(found.share_95, 0.75);
        assert_relative_eq!(found.ratio, statistics.deviation / 0.75_f64.sqrt());
    }
}
