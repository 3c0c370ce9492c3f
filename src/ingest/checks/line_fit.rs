//! Line fits of a kinematic relation: measured side against predicted side, one point per window.

use super::windows::WindowPair;
use crate::numerics::statistics::order_statistics::{upper_median, weighted_median};

/// Least-squares line through the origin, measured over predicted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineFit {
    pub slope: f64,
    pub standard_error: f64,
    pub correlation: f64,
    /// Root mean square of the predicted side.
    pub predicted_rms: f64,
    /// Root mean square of measured minus predicted, over that of the larger side. Windows in
    /// which the record jumps count.
    pub misfit: f64,
}

/// Median of the windows' slopes, weighted with their predicted sides. No weight exceeds the median
/// of the predicted sides: a jump of the predicted side would otherwise decide alone.
pub fn median_slope(pairs: &[WindowPair]) -> f64 {
    let most = upper_median(pairs.iter().map(|p| p.predicted.abs())).unwrap_or_default();
    let moved = pairs.iter().filter(|p| p.predicted != 0.0);
    let slopes = moved.map(|p| (p.measured / p.predicted, p.predicted.abs().min(most)));
    weighted_median(slopes.collect()).unwrap_or(f64::NAN)
}

/// Fits the windows without jumps; the misfit is that of `all` windows. `None` if a side is zero
/// throughout.
pub fn fit(pairs: &[WindowPair], all: &[WindowPair]) -> Option<LineFit> {
    let (xx, yy) = (sum(pairs, |x, _| x * x), sum(pairs, |_, y| y * y));
    let xy = sum(pairs, |x, y| x * y);
    let slope = xy / xx;
    let residual = sum(pairs, |x, y| (y - slope * x).powi(2));
    let (all_xx, all_yy) = (sum(all, |x, _| x * x), sum(all, |_, y| y * y));
    let difference = sum(all, |x, y| (y - x).powi(2));
    let fit = LineFit {
        slope,
        standard_error: (residual / (pairs.len() - 1) as f64 / xx).sqrt(),
        correlation: xy / (xx * yy).sqrt(),
        predicted_rms: (xx / pairs.len() as f64).sqrt(),
        misfit: (difference / all_xx.max(all_yy)).sqrt(),
    };
    [fit.slope, fit.standard_error, fit.correlation, fit.misfit]
        .iter()
        .all(|v| v.is_finite())
        .then_some(fit)
}

/// Sum over windows of a term of the predicted and the measured side.
fn sum(pairs: &[WindowPair], term: impl Fn(f64, f64) -> f64) -> f64 {
    pairs.iter().map(|p| term(p.predicted, p.measured)).sum()
}
