//! Quantisation step of a channel.

use super::update_rate::LEAST_CHANGES;

/// Changes of value from which the step is inferred, spread over the spell.
const MOST_CHANGES: usize = 512;

/// Neighbouring pairs searched for each change that is needed, since a channel may repeat values.
const PAIRS_PER_CHANGE: usize = 4;

/// Largest deviation of a change from a whole number of steps, in steps: the last digits of a
/// converted number.
const OFF_GRID: f64 = 0.05;

/// Largest change, in steps, that is compared with the grid. The smallest change is the estimate of
/// the step, and the error of a multiple grows with it. Up to this size a grid can be distinguished
/// from chance.
const MOST_STEPS: f64 = 40.0;

/// Share of changes that must be multiples of the step: one in twenty may be a spike. Of changes without a grid
/// one in ten fits (2 [`OFF_GRID`]), so the share is far from chance with [`LEAST_CHANGES`] and more.
const ON_GRID_SHARE: f64 = 0.95;

/// Relative change below which two values are equal: the last digits of a converted number.
const SAME_VALUE: f64 = 1e-9;

/// Estimates the quantisation step: the smallest change between neighbours, where all changes are
/// multiples of it.
pub fn quantisation(values: &[f64]) -> Option<f64> {
    let stride = (values.len() / (PAIRS_PER_CHANGE * MOST_CHANGES)).max(1);
    let change = |pair: &[f64]| (pair[1] - pair[0]).abs();
    let head = values.iter().take(MOST_CHANGES).filter(|v| v.is_finite());
    let finest = SAME_VALUE * head.fold(0.0_f64, |m, v| m.max(v.abs()));
    let changes: Vec<f64> = values
        .windows(2)
        .step_by(stride)
        .map(change)
        .filter(|c| *c > finest)
        .take(MOST_CHANGES)
        .collect();
    if changes.len() < LEAST_CHANGES {
        return None;
    }
    let smallest = changes.iter().copied().fold(f64::INFINITY, f64::min);
    let steps: Vec<f64> = changes
        .iter()
        .map(|c| c / smallest)
        .filter(|n| *n < MOST_STEPS)
        .collect();
    let is_on_grid = |n: &&f64| (**n - n.round()).abs() < OFF_GRID;
    let share = steps.iter().filter(is_on_grid).count() as f64 / steps.len().max(1) as f64;
    (steps.len() >= LEAST_CHANGES && share >= ON_GRID_SHARE).then_some(smallest)
}
