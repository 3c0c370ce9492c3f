//! Points of a trend.

use crate::numerics::statistics::mean::mean;

/// One maneuver's estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TrendPoint {
    pub alpha_deg: f64,
    pub value: f64,
    pub bound: f64,
    /// Index of the maneuver's class among the classes of the trend.
    pub class: usize,
    /// Index of the maneuver's flown α among the flown α of the trend.
    pub flown: usize,
}

impl TrendPoint {
    pub(super) fn key(&self) -> (f64, f64, f64, usize) {
        (self.alpha_deg, self.value, self.bound, self.class)
    }
}

/// Numbers the flown α of points sorted by α. Points within half a step of the published grid count
/// as one flown α.
pub(super) fn count_flown<'a>(points: impl Iterator<Item = &'a mut TrendPoint>, step_deg: f64) {
    let mut current: Option<(usize, f64)> = None;
    for point in points {
        let (flown, first) = match current {
            None => (0, point.alpha_deg),
            Some((flown, first)) if point.alpha_deg - first > 0.5 * step_deg => {
                (flown + 1, point.alpha_deg)
            }
            Some(same) => same,
        };
        current = Some((flown, first));
        point.flown = flown;
    }
}

/// Flown α, deg, ascending: each is the mean of its maneuvers, rounded to a tenth.
pub(super) fn flown_alphas(points: &[TrendPoint]) -> Vec<f64> {
    let mean_alpha_deg = |own: &[TrendPoint]| mean(own.iter().map(|p| p.alpha_deg));
    points
        .chunk_by(|a, b| a.flown == b.flown)
        .map(|own| (10.0 * mean_alpha_deg(own)).round() / 10.0)
        .collect()
}
