//! Points of a trend.

use crate::numerics::mean::mean;

/// One maneuver's estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub alpha_deg: f64,
    pub value: f64,
    pub bound: f64,
    /// Index of its class among those of the trend.
    pub class: usize,
    /// Index of its flown α among those of the trend.
    pub flown: usize,
}

impl Point {
    pub(super) fn key(&self) -> (f64, f64, f64, usize) {
        (self.alpha_deg, self.value, self.bound, self.class)
    }
}

/// Counts the flown α of points sorted by α: one spans half a step of the published grid.
pub(super) fn count_flown<'a>(points: impl Iterator<Item = &'a mut Point>, step_deg: f64) {
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

/// The flown α, deg, ascending: each the mean of its maneuvers, to a tenth.
pub(super) fn flown_alphas(points: &[Point]) -> Vec<f64> {
    let mean_alpha_deg = |own: &[Point]| mean(own.iter().map(|p| p.alpha_deg));
    points
        .chunk_by(|a, b| a.flown == b.flown)
        .map(|own| (10.0 * mean_alpha_deg(own)).round() / 10.0)
        .collect()
}
