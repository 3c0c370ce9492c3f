//! Least squares on one coefficient in the frequency domain, with weights from the spectrum of its
//! own residuals (Whittle's likelihood).
//!
//! Unlike the regression of `output_error::likelihood::equation_error` it has priors and returns the
//! information on delays of the surfaces.

use nalgebra::{Complex, DMatrix, DVector};

use super::fourier::Spectrum;
use crate::numerics::linear_algebra::symmetric;

/// Half width of the band over which the residuals' power is averaged, Hz. Turbulence and sensor
/// noise change little over the band, and a maneuver of 15 s has 15 frequencies in it.
const SMOOTHED_HZ: f64 = 0.5;

/// Number of times that the weights are estimated anew.
const SPECTRUM_ROUNDS: usize = 3;

/// Least residual power, as a share of the mean power of the coefficient: rounding errors of the
/// sums.
const ROUNDING: f64 = 1e-16;

/// Prior of a derivative: value and standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    pub value: f64,
    pub deviation: f64,
}

/// Fitted derivatives of one coefficient.
#[derive(Clone, Debug)]
pub struct WeightedFit {
    pub values: DVector<f64>,
    pub covariance: DMatrix<f64>,
    /// Twice the inverse of the residuals' power at each frequency: information of a complex
    /// residual.
    weights: Vec<f64>,
    residuals: Spectrum,
}

impl WeightedFit {
    /// Fits `implied` by the columns; `None` unless the normal matrix is positive definite.
    pub fn new(
        frequencies_hz: &[f64],
        implied: &Spectrum,
        columns: &[Spectrum],
        priors: &[Prior],
    ) -> Option<WeightedFit> {
        let count = implied.len() as f64;
        let power: f64 = implied.iter().map(Complex::norm_sqr).sum::<f64>() / count;
        let least = ROUNDING * power + f64::MIN_POSITIVE;
        let mut weights = vec![2.0 / (power + least); implied.len()];
        let lost = 0.5 * columns.len() as f64;
        let freedom = count / (count - lost).max(count / 3.0);
        for _ in 0..SPECTRUM_ROUNDS {
            let (values, _) = solve(implied, columns, priors, &weights)?;
            let residuals = residuals(implied, columns, &values);
            weights = smoothed_power(frequencies_hz, &residuals)
                .map(|power| 2.0 / (freedom * power + least))
                .collect();
        }
        let (values, covariance) = solve(implied, columns, priors, &weights)?;
        let residuals = residuals(implied, columns, &values);
        Some(WeightedFit {
            values,
            covariance,
            weights,
            residuals,
        })
    }

    /// Information of the coefficient on further parameters of these columns, with the derivatives
    /// eliminated, and its gradient.
    pub fn eliminated(
        &self,
        columns: &[Spectrum],
        further: &[Spectrum],
    ) -> (DMatrix<f64>, DVector<f64>) {
        let own = products(further, further, &self.weights);
        let cross = products(further, columns, &self.weights);
        let gradient = further
            .iter()
            .map(|column| product(column, &self.residuals, &self.weights));
        // The derivatives are at their optimum: their own gradient is zero.
        (
            own - &cross * &self.covariance * cross.transpose(),
            DVector::from_iterator(further.len(), gradient),
        )
    }
}

/// Derivatives and their covariance at given weights.
fn solve(
    implied: &Spectrum,
    columns: &[Spectrum],
    priors: &[Prior],
    weights: &[f64],
) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let mut normal = products(columns, columns, weights);
    let mut right = DVector::from_iterator(
        columns.len(),
        columns.iter().map(|c| product(c, implied, weights)),
    );
    for (j, prior) in priors.iter().enumerate() {
        let information = prior.deviation.powi(-2);
        normal[(j, j)] += information;
        right[j] += information * prior.value;
    }
    let covariance = symmetric::inverse(&normal)?;
    let values = &covariance * right;
    values
        .iter()
        .all(|value| value.is_finite())
        .then_some((values, covariance))
}

fn residuals(implied: &Spectrum, columns: &[Spectrum], values: &DVector<f64>) -> Spectrum {
    let mut residuals = implied.clone();
    for (column, value) in columns.iter().zip(values.iter()) {
        for (residual, x) in residuals.iter_mut().zip(column) {
            *residual -= x * *value;
        }
    }
    residuals
}

/// Power of the residuals, averaged over neighbouring frequencies.
fn smoothed_power(frequencies_hz: &[f64], residuals: &Spectrum) -> impl Iterator<Item = f64> {
    frequencies_hz.iter().map(move |centre| {
        let near = frequencies_hz
            .iter()
            .zip(residuals)
            .filter(|(f, _)| (*f - centre).abs() <= SMOOTHED_HZ);
        let (sum, count) = near.fold((0.0, 0.0), |(sum, count), (_, r)| {
            (sum + r.norm_sqr(), count + 1.0)
        });
        sum / count
    })
}

fn products(a: &[Spectrum], b: &[Spectrum], weights: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(a.len(), b.len(), |i, j| product(&a[i], &b[j], weights))
}

/// Weighted real inner product of two spectra.
fn product(a: &Spectrum, b: &Spectrum, weights: &[f64]) -> f64 {
    let both = a.iter().zip(b).zip(weights);
    both.map(|((a, b), weight)| weight * (a.re * b.re + a.im * b.im))
        .sum()
}
