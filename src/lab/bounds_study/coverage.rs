//! Bias and scatter of the estimates of one maneuver, and coverage of their intervals.

use rayon::prelude::*;

use super::recordings::{Realisation, StudyManeuver};
use crate::error::Problem;
use crate::maneuver::Status;
use crate::numerics::statistics::mean::mean;
use crate::numerics::statistics::normal::NORMAL_95;
use crate::numerics::statistics::random::derived_seed;
use crate::output_error::Outcome;
use crate::tables::{CoverageRow, EstimateRow};

/// Two-sided 68 % quantile of the normal distribution.
const NORMAL_68: f64 = 0.994_457_883_209_753;

/// Estimates of one maneuver under one condition.
pub struct MeasuredPoint {
    pub class: String,
    pub realisations: Vec<Realisation>,
}

impl MeasuredPoint {
    /// Estimates a maneuver from many recordings. Also returns the problem of the first record
    /// whose flight departs; such records are left out.
    pub fn measure(
        maneuver: &StudyManeuver,
        count: usize,
        seed: u64,
    ) -> (MeasuredPoint, Option<Problem>) {
        let results: Vec<Result<Realisation, Problem>> = (0..count)
            .into_par_iter()
            .map(|i| maneuver.realise(derived_seed(seed, &format!("realisation {i}"))))
            .collect();
        let mut realisations = Vec::with_capacity(count);
        let mut first_problem = None;
        for result in results {
            match result {
                Ok(realisation) => realisations.push(realisation),
                Err(problem) => {
                    first_problem.get_or_insert(problem);
                }
            }
        }
        let class = maneuver.class.name.clone();
        (
            MeasuredPoint {
                class,
                realisations,
            },
            first_problem,
        )
    }

    /// Realisations whose estimation converged.
    pub fn converged(&self) -> impl Iterator<Item = &Realisation> {
        let realisations = self.realisations.iter();
        realisations.filter(|r| r.estimated.fit.outcome == Outcome::Converged)
    }

    /// A row per estimated derivative.
    pub fn rows(&self, condition: &str) -> Vec<CoverageRow> {
        let Some(first) = self.realisations.first() else {
            return Vec::new();
        };
        let derivatives = first.truth.iter();
        derivatives
            .filter_map(|d| self.row(condition, &d.derivative, d.unit))
            .collect()
    }

    fn row(&self, condition: &str, derivative: &str, unit: &str) -> Option<CoverageRow> {
        let estimates: Vec<TrueAndEstimated> = self
            .converged()
            .flat_map(Realisation::estimates)
            .filter(|e| e.row.derivative == derivative)
            .collect();
        if estimates.is_empty() {
            return None;
        }
        let errors: Vec<f64> = estimates
            .iter()
            .filter_map(TrueAndEstimated::error)
            .collect();
        let statistics = ErrorStatistics::of(&errors);
        let bounds = estimates.iter().map(|e| e.row.bound);
        let white = Intervals::new(&errors, &statistics, bounds);
        let bounds = estimates.iter().map(|e| e.row.bound_corrected);
        let corrected = Intervals::new(&errors, &statistics, bounds);
        Some(CoverageRow {
            class: self.class.clone(),
            alpha_deg: mean(self.realisations.iter().map(|r| r.alpha_deg)),
            condition: condition.to_owned(),
            derivative: derivative.to_owned(),
            unit: unit.to_owned(),
            truth: mean(estimates.iter().map(|e| e.truth)),
            realisations: self.realisations.len(),
            converged: self.converged().count(),
            bias: statistics.mean,
            scatter: statistics.deviation,
            bias_over_scatter: statistics.mean / statistics.deviation,
            scatter_over_bound: white.ratio,
            coverage_68: white.share_68,
            coverage_95: white.share_95,
            scatter_over_corrected: corrected.ratio,
            corrected_coverage_68: corrected.share_68,
            corrected_coverage_95: corrected.share_95,
        })
    }
}

/// An estimated derivative with its true value.
pub struct TrueAndEstimated<'a> {
    pub row: &'a EstimateRow,
    pub truth: f64,
}

impl TrueAndEstimated<'_> {
    pub fn error(&self) -> Option<f64> {
        Some(self.row.value? - self.truth)
    }
}

impl Realisation {
    /// Estimated derivatives, in the order of the truth.
    pub fn estimates(&self) -> impl Iterator<Item = TrueAndEstimated<'_>> {
        self.truth.iter().filter_map(|truth| {
            let rows = &self.estimated.estimates;
            let row = rows
                .iter()
                .find(|r| r.derivative == truth.derivative && r.status == Status::Estimated)?;
            Some(TrueAndEstimated {
                row,
                truth: truth.value,
            })
        })
    }
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
            share_68: within(NORMAL_68),
            share_95: within(NORMAL_95),
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
