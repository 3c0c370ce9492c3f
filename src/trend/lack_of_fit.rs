//! Lack of fit of a trend: its systematic error at the flown α, beside the maneuvers' own
//! deviations.

use nalgebra::DVector;

use super::point::TrendPoint;
use super::scatter::scatter_squared;

/// Variance of the residuals beyond the bounds, in two parts.
pub(super) struct LackOfFit {
    /// Squared lack of fit λ²: variance of the derivative about the curve.
    pub lack2: f64,
    /// Variance of the maneuvers' own deviations, from maneuvers of one flown α.
    pub own2: f64,
}

impl LackOfFit {
    pub(super) fn from_residuals(
        points: &[TrendPoint],
        residuals: &DVector<f64>,
        variances: &[f64],
        coefficients: usize,
    ) -> LackOfFit {
        let about = about_their_means(points, residuals, variances);
        let every: Vec<usize> = (0..points.len()).collect();
        let own2 = scatter_squared(&about.residuals, variances, &about.freedom, &every);
        let total: Vec<f64> = variances.iter().map(|bound2| bound2 + own2).collect();
        let about = about_their_means(points, residuals, &total);
        let alphas = about.means.len();
        let freedom = alphas.saturating_sub(coefficients) as f64 / alphas as f64;
        let every: Vec<usize> = (0..alphas).collect();
        let means = DVector::from_vec(about.means);
        let lack2 = scatter_squared(&means, &about.variances, &vec![freedom; alphas], &every);
        LackOfFit { lack2, own2 }
    }
}

/// Residuals of the maneuvers of each flown α about their weighted mean.
struct AboutMeans {
    /// Residual of each maneuver.
    residuals: DVector<f64>,
    /// One minus each maneuver's share in its mean.
    freedom: Vec<f64>,
    /// Mean residual of each flown α.
    means: Vec<f64>,
    /// Variance of each mean.
    variances: Vec<f64>,
}

fn about_their_means(
    points: &[TrendPoint],
    residuals: &DVector<f64>,
    variances: &[f64],
) -> AboutMeans {
    let mut about = AboutMeans {
        residuals: residuals.clone(),
        freedom: Vec::with_capacity(points.len()),
        means: Vec::new(),
        variances: Vec::new(),
    };
    let mut first = 0;
    for own in points.chunk_by(|a, b| a.flown == b.flown) {
        let members = first..first + own.len();
        first = members.end;
        let total: f64 = members.clone().map(|i| 1.0 / variances[i]).sum();
        let mean = members
            .clone()
            .map(|i| residuals[i] / variances[i])
            .sum::<f64>()
            / total;
        for i in members {
            about.residuals[i] -= mean;
            about.freedom.push(1.0 - 1.0 / (variances[i] * total));
        }
        about.means.push(mean);
        about.variances.push(1.0 / total);
    }
    about
}
