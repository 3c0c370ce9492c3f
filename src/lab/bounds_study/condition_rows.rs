//! Coverage and error of all estimates of a condition: a row for each class, and one for all.

use std::collections::BTreeSet;

use super::coverage::{MeasuredPoint, TrueAndEstimated};
use super::recordings::Realisation;
use crate::aero::{AeroModel, Regressor, WindTunnel};
use crate::numerics::statistics::normal::NORMAL_95;
use crate::numerics::statistics::order_statistics::median;
use crate::tables::ConditionRow;

/// Class of the row of all classes.
pub const ALL_CLASSES: &str = "all";

/// True derivatives, for errors in percent of each derivative's root mean square, and the build-up,
/// which separates constants from slopes.
#[derive(Clone, Copy)]
pub struct Scales<'a> {
    pub aero_model: &'a AeroModel,
    /// Tables of the true derivatives.
    pub truth: &'a WindTunnel,
}

/// Rows of a condition: all classes together, then each.
#[must_use]
pub fn condition_rows(
    condition: &str,
    points: &[MeasuredPoint],
    scales: Scales,
) -> Vec<ConditionRow> {
    let classes: BTreeSet<&str> = points.iter().map(|p| p.class.as_str()).collect();
    let of_class = classes.into_iter().map(|class| {
        let own: Vec<&MeasuredPoint> = points.iter().filter(|p| p.class == class).collect();
        row(condition, class, &own, scales)
    });
    let all: Vec<&MeasuredPoint> = points.iter().collect();
    std::iter::once(row(condition, ALL_CLASSES, &all, scales))
        .chain(of_class)
        .collect()
}

fn row(condition: &str, class: &str, points: &[&MeasuredPoint], scales: Scales) -> ConditionRow {
    let converged = || points.iter().flat_map(|p| p.converged());
    let estimates: Vec<TrueAndEstimated> = converged()
        .flat_map(Realisation::estimates)
        .filter(|e| !scales.is_constant(&e.row.derivative))
        .collect();
    let covered = |bound: fn(&TrueAndEstimated) -> Option<f64>| {
        let holds = |e: &&TrueAndEstimated| match (e.error(), bound(e)) {
            (Some(error), Some(bound)) => error.abs() <= NORMAL_95 * bound,
            _ => false,
        };
        estimates.iter().filter(holds).count() as f64 / estimates.len() as f64
    };
    let over_size = |e: &TrueAndEstimated, value: Option<f64>| {
        Some(100.0 * value?.abs() / scales.truth.root_mean_square(&e.row.derivative))
    };
    ConditionRow {
        condition: condition.to_owned(),
        class: class.to_owned(),
        records: points.iter().map(|p| p.realisations.len()).sum(),
        converged: converged().count(),
        iterations: median(converged().map(|r| r.estimated.fit.iterations as f64)),
        estimates: estimates.len(),
        coverage_95: covered(|e| e.row.bound),
        corrected_coverage_95: covered(|e| e.row.bound_corrected),
        error_pct: median(estimates.iter().filter_map(|e| over_size(e, e.error()))),
        corrected_bound_pct: median(
            estimates
                .iter()
                .filter_map(|e| over_size(e, e.row.bound_corrected)),
        ),
        correction: median(
            estimates
                .iter()
                .filter_map(|e| Some(e.row.bound_corrected? / e.row.bound?)),
        ),
    }
}

impl Scales<'_> {
    /// `true` for a derivative without a regressor: its size depends on the choice of the axes, not
    /// on the maneuver.
    fn is_constant(&self, derivative: &str) -> bool {
        let mut derivatives = self.aero_model.derivatives.iter();
        derivatives.any(|d| d.name == derivative && d.regressor == Regressor::Constant)
    }
}
