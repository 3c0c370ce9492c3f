//! Means of a derivative at the flown angles of attack, where the maneuvers are too few for a
//! trend.
//!
//! The mean of the maneuvers of one flown α has weights 1/(b² + τ²), with b their bounds. The
//! scatter τ² between maneuvers is chosen so that the weighted sum of squared residuals equals
//! their degrees of freedom, as for a trend. For two estimates y₁ and y₂ it is ((y₁ − y₂)² − b₁² −
//! b₂²)/2, or zero if that is negative. The interval is the normal one: bounds are standard
//! deviations, and no variance is estimated from one or two values alone.

use super::point::TrendPoint;

/// Mean of the maneuvers of one flown angle of attack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mean {
    pub alpha_deg: f64,
    pub value: f64,
    /// Standard error from bounds and scatter, without errors that the maneuvers share.
    pub standard_error: f64,
    /// Scatter τ between the maneuvers.
    pub scatter: f64,
    /// Standard deviation of one more maneuver's estimate: bound and scatter.
    pub one_more: f64,
    pub maneuvers: usize,
}

impl Mean {
    /// Mean of the points of one flown α.
    fn of(points: &[TrendPoint]) -> Mean {
        let scatter2 = match points {
            [a, b] => {
                let apart2 = (a.value - b.value).powi(2);
                (0.5 * (apart2 - a.bound.powi(2) - b.bound.powi(2))).max(0.0)
            }
            _ => 0.0,
        };
        let weights = points.iter().map(|p| 1.0 / (p.bound.powi(2) + scatter2));
        let total: f64 = weights.clone().sum();
        let weighted = |value: fn(&TrendPoint) -> f64| {
            let products = points
                .iter()
                .zip(weights.clone())
                .map(|(p, w)| w * value(p));
            products.sum::<f64>() / total
        };
        Mean {
            alpha_deg: weighted(|p| p.alpha_deg),
            value: weighted(|p| p.value),
            standard_error: total.powf(-0.5),
            scatter: scatter2.sqrt(),
            one_more: (points.len() as f64 / total).sqrt(),
            maneuvers: points.len(),
        }
    }
}

/// Means of at most two maneuvers: one, or one at each of two flown angles of attack.
///
/// The points are sorted by α.
pub(super) fn means(points: &[TrendPoint]) -> Vec<Mean> {
    points
        .chunk_by(|a, b| a.flown == b.flown)
        .map(Mean::of)
        .collect()
}
