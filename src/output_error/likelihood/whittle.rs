//! Linear regression on Fourier sums, weighted by the spectrum of its own residuals (Whittle).
//!
//! Fourier sums of stationary noise at the harmonics of the series' length are nearly uncorrelated,
//! and their variances follow the noise's spectrum. The spectrum is that of the residuals, smoothed
//! over neighbouring frequencies, and estimated in alternation with the parameters. Each complex
//! equation is two real ones, its real and its imaginary part, with the same variance (Klein and
//! Morelli 2006, chapter 7).

use nalgebra::{DMatrix, DVector};

use super::information::Identification;
use crate::numerics::linear_algebra::symmetric::raise_variances;
use crate::numerics::statistics::student::widening_95;

/// Rounds of parameters and spectrum. Simulated estimates and their coverage are the same after 3, 5
/// and 10.
const SPECTRUM_ROUNDS: usize = 3;
/// Condition number of the scaled normal matrix beyond which a regression has no result.
const MAX_CONDITION_NUMBER: f64 = 1e10;
/// Least number of degrees of freedom of the residuals, as for Student's t.
const FEWEST_FREE: f64 = 3.0;
/// Smallest spectrum, relative to the response's: rounding errors of an exact fit.
const ROUNDED_SPECTRUM: f64 = 1e-24;
/// Largest leverage for which variances are corrected. An equation with a larger one has no
/// residual of its own.
const MOST_LEVERAGE: f64 = 0.95;

/// Equations at several frequencies: real parts of all, then imaginary parts.
#[derive(Debug)]
pub(super) struct SpectralEquations<'a> {
    pub response: &'a DVector<f64>,
    pub regressors: &'a DMatrix<f64>,
    /// Half width of the triangle that smooths the spectrum, in frequencies.
    pub smoothing: f64,
    /// Share of the samples that count, and thus of the equations that are independent.
    pub independent: f64,
}

/// Parameters with their covariance.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct WhittleRegression {
    pub values: DVector<f64>,
    /// Larger of two covariances: by the spectrum, and by the residuals themselves (HC3). It is
    /// widened by Student's t, so that ±1.96 standard errors are an interval of 95 %.
    pub covariance: DMatrix<f64>,
    /// Inverse of the weighted normal matrix.
    inverse: DMatrix<f64>,
    /// Weighted regressors.
    weighted: DMatrix<f64>,
    /// Root of each equation's weight.
    roots: DVector<f64>,
}

impl SpectralEquations<'_> {
    /// Parameters of least weighted squares; `None` if the data do not determine them.
    pub fn solve(&self) -> Option<WhittleRegression> {
        let (equations, parameters) = self.regressors.shape();
        let free = self.independent * equations as f64 - parameters as f64;
        if parameters == 0 || free < FEWEST_FREE {
            return None;
        }
        let mut spectrum = vec![1.0; equations / 2];
        let mut last = self.fit(&spectrum)?;
        for _ in 1..SPECTRUM_ROUNDS {
            spectrum = self.smoothed_spectrum(&last);
            last = self.fit(&spectrum)?;
        }
        last.add_covariance(&self.residuals(&last.values), free);
        Some(last)
    }

    /// Weighted least squares with a spectrum.
    fn fit(&self, spectrum: &[f64]) -> Option<WhittleRegression> {
        let frequencies = spectrum.len();
        let roots = DVector::from_fn(2 * frequencies, |i, _| spectrum[i % frequencies].powf(-0.5));
        let mut weighted = self.regressors.clone();
        for mut column in weighted.column_iter_mut() {
            column.component_mul_assign(&roots);
        }
        let normal = weighted.tr_mul(&weighted);
        let Identification::Determined { inverse, .. } =
            Identification::identify(&normal, MAX_CONDITION_NUMBER)
        else {
            return None;
        };
        let right = weighted.tr_mul(&self.response.component_mul(&roots));
        let values = &inverse * right;
        values
            .iter()
            .all(|v| v.is_finite())
            .then(|| WhittleRegression {
                values,
                covariance: DMatrix::zeros(normal.nrows(), normal.nrows()),
                inverse,
                weighted,
                roots,
            })
    }

    fn residuals(&self, values: &DVector<f64>) -> DVector<f64> {
        self.response - self.regressors * values
    }

    /// Variance of an equation's residual at each frequency. A fit reduces the residuals by its
    /// leverage, so their squares are divided by the remaining share.
    fn smoothed_spectrum(&self, fit: &WhittleRegression) -> Vec<f64> {
        let residuals = self.residuals(&fit.values);
        let leverages = fit.leverages();
        let frequencies = residuals.len() / 2;
        let both = |v: &DVector<f64>, k: usize| v[k] + v[frequencies + k];
        let squares = residuals.map(|e| e * e);
        let least = ROUNDED_SPECTRUM * self.response.norm_squared() / residuals.len() as f64;
        let at = |k: usize| {
            let (mut sum, mut free) = (0.0, 0.0);
            for l in 0..frequencies {
                let weight = (1.0 - k.abs_diff(l) as f64 / self.smoothing).max(0.0);
                sum += weight * both(&squares, l);
                free += weight * (2.0 - both(&leverages, l));
            }
            let spectrum = (sum / free.max(2.0 * (1.0 - MOST_LEVERAGE))).max(least);
            if spectrum > 0.0 { spectrum } else { 1.0 }
        };
        (0..frequencies).map(at).collect()
    }
}

impl WhittleRegression {
    /// Leverage of each equation: share of its own response in its fitted value.
    fn leverages(&self) -> DVector<f64> {
        let spread = &self.weighted * &self.inverse;
        DVector::from_fn(self.weighted.nrows(), |i, _| {
            let leverage = spread.row(i).dot(&self.weighted.row(i));
            leverage.clamp(0.0, MOST_LEVERAGE)
        })
    }

    fn add_covariance(&mut self, residuals: &DVector<f64>, free: f64) {
        let leverages = self.leverages();
        let mut scores = self.weighted.clone();
        for mut column in scores.column_iter_mut() {
            for i in 0..column.len() {
                column[i] *= self.roots[i] * residuals[i] / (1.0 - leverages[i]);
            }
        }
        let own = &self.inverse * scores.tr_mul(&scores) * &self.inverse;
        let larger = raise_variances(own, &self.inverse);
        self.covariance = larger * widening_95(free).powi(2);
    }

    /// Change of the parameters per unit of a further term of the equations.
    pub fn change_by(&self, term: &DVector<f64>) -> DVector<f64> {
        -&self.inverse * self.weighted.tr_mul(&term.component_mul(&self.roots))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// A response of two regressors and further noise, at 40 frequencies.
    fn equations() -> (DVector<f64>, DMatrix<f64>) {
        let wave = |i: usize, k: f64| (k * i as f64).sin() + 0.3 * (2.7 * k * i as f64).cos();
        let regressors = DMatrix::from_fn(80, 2, |i, j| wave(i + 1, [0.71, 1.37][j]));
        let noise = DVector::from_fn(80, |i, _| 0.2 * wave(3 * i + 2, 2.11));
        (
            &regressors * DVector::from_vec(vec![2.0, -1.0]) + noise,
            regressors,
        )
    }

    fn of<'a>(response: &'a DVector<f64>, regressors: &'a DMatrix<f64>) -> SpectralEquations<'a> {
        SpectralEquations {
            response,
            regressors,
            smoothing: 10.0,
            independent: 1.0,
        }
    }

    #[test]
    fn the_values_minimise_the_residuals_squares_over_the_spectrum() {
        let (response, regressors) = equations();
        let equations = of(&response, &regressors);
        let spectrum: Vec<f64> = (0..40).map(|k| 0.1 + 0.05 * f64::from(k)).collect();
        let cost = |values: &DVector<f64>| -> f64 {
            let residuals = equations.residuals(values);
            let terms = residuals.iter().enumerate();
            terms.map(|(i, e)| e * e / spectrum[i % 40]).sum()
        };
        let fit = equations.fit(&spectrum).unwrap();
        let h = 1e-4;
        for j in 0..2 {
            let moved = |d: f64| {
                let mut values = fit.values.clone();
                values[j] += d;
                cost(&values)
            };
            let (up, at, down) = (moved(h), moved(0.0), moved(-h));
            assert_relative_eq!(up, down, max_relative = 1e-9);
            // The inverse is that of half the second gradient.
            let other = 1 - j;
            let conditional =
                fit.inverse[(j, j)] - fit.inverse[(j, other)].powi(2) / fit.inverse[(other, other)];
            assert_relative_eq!(
                (up - 2.0 * at + down) / (h * h),
                2.0 / conditional,
                max_relative = 1e-5
            );
        }
        let term = regressors.column(0) * 0.5 + regressors.column(1).map(f64::sin);
        let shifted = &response - &term * h;
        let change = (of(&shifted, &regressors).fit(&spectrum).unwrap().values - &fit.values) / h;
        assert_relative_eq!(fit.change_by(&term), change, max_relative = 1e-8);
    }

    #[test]
    fn the_spectrum_of_equal_squares_is_their_mean_over_what_the_fit_leaves() {
        let regressors = DMatrix::from_fn(80, 1, |i, _| if i == 3 { 1.0 } else { 0.0 });
        let response = DVector::from_element(80, 2.0);
        let equations = of(&response, &regressors);
        let fit = equations.fit(&[1.0; 40]).unwrap();
        // Equation 3 is fitted exactly: neither its square nor its degree of freedom counts.
        for spectrum in equations.smoothed_spectrum(&fit) {
            assert_relative_eq!(spectrum, 4.0, max_relative = 0.03);
        }
    }

    #[test]
    fn an_exact_response_has_no_error_and_too_few_equations_no_result() {
        let (_, regressors) = equations();
        let exact = &regressors * DVector::from_vec(vec![2.0, -1.0]);
        let regression = of(&exact, &regressors).solve().unwrap();
        assert_relative_eq!(regression.values[0], 2.0, max_relative = 1e-9);
        assert!(regression.covariance.diagonal().max() < 1e-18);
        let few = regressors.rows(0, 4).into_owned();
        assert_eq!(of(&exact.rows(0, 4).into_owned(), &few).solve(), None);
    }
}
