//! What noise does to the gradient, Σ Sᵀ W R W S with R from the residuals' tapered autocorrelation (Morelli and Klein
//! 1997): one matrix for all parameters, whose parts serve every choice of free ones.
//!
//! The published bounds count besides what the parameters took of the noise (`coloured.rs`), which differs from choice to
//! choice; to compare choices this form does.

use nalgebra::DMatrix;

use super::case::Case;
use super::cost::{add_square, residuals};
use super::cramer_rao::variances;
use super::response::Response;
use crate::dynamics::{Equations, OUTPUTS};

/// What noise does to the gradient: its covariance for white residuals, and what their correlation adds to it.
#[derive(Clone, Debug, PartialEq)]
pub struct GradientCovariance {
    /// Σ Sᵀ W R̂ W S.
    pub white: DMatrix<f64>,
    pub coloured: DMatrix<f64>,
}

/// The gradient's covariance of one maneuver, from the residuals of its response.
pub(super) fn gradient_covariance<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    response: &Response,
    weights: &[f64; OUTPUTS],
) -> GradientCovariance {
    let residuals = residuals(&case.measurements, response);
    let variances = variances(&residuals, &case.used(), case.parameters());
    let n = case.parameters();
    let (mut white, mut extra) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    for o in 0..OUTPUTS {
        let w = weights[o];
        let correlation = autocorrelation(residuals.iter().map(|v| v[o]));
        for k in (0..case.samples()).filter(|&k| case.measurements.used[k][o]) {
            add_square(&mut white, w * w * variances[o], response.sensitivity(k, o));
        }
        extra += coloured(case, response, o, &correlation) * (w * w * variances[o]);
    }
    white.fill_upper_triangle_with_lower_triangle();
    GradientCovariance { white, coloured: extra }
}

/// Autocorrelation of residuals at lags 1, 2, … with a Bartlett taper to a fifth of the record, so that the sequence
/// stays positive semidefinite.
fn autocorrelation(residuals: impl Iterator<Item = f64>) -> Vec<f64> {
    let v: Vec<f64> = residuals.collect();
    let square: f64 = v.iter().map(|x| x * x).sum();
    let reach = v.len() / 5;
    (1..=reach)
        .map(|lag| {
            let product: f64 = v.iter().zip(&v[lag..]).map(|(a, b)| a * b).sum();
            let taper = 1.0 - lag as f64 / (reach + 1) as f64;
            if square > 0.0 { taper * product / square } else { 0.0 }
        })
        .collect()
}

/// Σ_{k≠l} ρ(k−l) s_k s_lᵀ of one output: what correlation adds to Σ s_k s_kᵀ.
fn coloured<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    response: &Response,
    output: usize,
    correlation: &[f64],
) -> DMatrix<f64> {
    let (n, samples) = (case.parameters(), case.samples());
    let used = |k: usize| case.measurements.used[k][output];
    let mut sum = DMatrix::zeros(n, n);
    let mut later = vec![0.0; n];
    for k in (0..samples).filter(|&k| used(k)) {
        later.fill(0.0);
        for (lag, rho) in (1..).zip(correlation).take_while(|(lag, _)| k + lag < samples) {
            if used(k + lag) {
                for (l, s) in later.iter_mut().zip(response.sensitivity(k + lag, output)) {
                    *l += rho * s;
                }
            }
        }
        for (j, mut column) in sum.column_iter_mut().enumerate() {
            for (m, s) in column.iter_mut().zip(response.sensitivity(k, output)) {
                *m += s * later[j];
            }
        }
    }
    &sum + sum.transpose()
}
