//! Shaping filters: linear systems that turn white noise into processes of a given spectrum,
//! discretised exactly.
//!
//! ẋ = A x + b n, y = C x with white noise n of unit intensity. Over a step Δt,
//! `x_{k+1}` = Φ `x_k` + `w_k` with Φ = e^(AΔt) and cov w = Q = ∫₀^Δt e^(As) b bᵀ e^(Aᵀs) ds (Van
//! Loan 1978). The stationary covariance satisfies P = Φ P Φᵀ + Q.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::numerics::statistics::random::RandomStream;

/// A stable filter in continuous time.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapingFilter {
    system: DMatrix<f64>,
    input: DVector<f64>,
    /// One row per output.
    outputs: DMatrix<f64>,
}

/// The same filter over one time step.
struct DiscreteFilter {
    transition: DMatrix<f64>,
    /// Covariance of the noise that enters in a step.
    noise: DMatrix<f64>,
}

/// Doublings of the time over which the stationary covariance is summed: far more time constants
/// than its rounding.
const DOUBLINGS: usize = 40;

impl ShapingFilter {
    /// Filter g N(Ts)/D(Ts) with polynomials in rising powers of Ts; D has the higher degree, and its
    /// constant is one.
    #[must_use]
    pub fn rational(
        gain: f64,
        time_s: f64,
        numerator: &[f64],
        denominator: &[f64],
    ) -> ShapingFilter {
        let order = denominator.len() - 1;
        // Controllable form: each state is the rate of the one before, the last gets the noise.
        let leading = denominator[order];
        let rate_scale = |power: usize| time_s.powi(i32::try_from(power).unwrap_or(i32::MAX));
        let mut system = DMatrix::zeros(order, order);
        for i in 1..order {
            system[(i - 1, i)] = 1.0;
        }
        for (j, coefficient) in denominator[..order].iter().enumerate() {
            system[(order - 1, j)] = -coefficient * rate_scale(j) / (leading * rate_scale(order));
        }
        let mut input = DVector::zeros(order);
        input[order - 1] = gain / (leading * rate_scale(order));
        let outputs = DMatrix::from_fn(1, order, |_, j| {
            numerator.get(j).map_or(0.0, |n| n * rate_scale(j))
        });
        ShapingFilter {
            system,
            input,
            outputs,
        }
    }

    /// This filter with a second output: g s/(1 + Ts) of the first.
    #[must_use]
    pub fn with_lagged_rate(self, gain: f64, time_s: f64) -> ShapingFilter {
        let order = self.system.nrows();
        // The further state z follows the output y, ż = (y − z)/T; the rate is g (y − z)/T.
        let first = self.outputs.row(0).clone_owned();
        let mut system = self.system.resize(order + 1, order + 1, 0.0);
        let mut outputs = self.outputs.resize(2, order + 1, 0.0);
        for j in 0..order {
            system[(order, j)] = first[j] / time_s;
            outputs[(1, j)] = gain * first[j] / time_s;
        }
        system[(order, order)] = -1.0 / time_s;
        outputs[(1, order)] = -gain / time_s;
        ShapingFilter {
            system,
            input: self.input.resize_vertically(order + 1, 0.0),
            outputs,
        }
    }

    /// Draws `count` samples of the outputs from the stationary process.
    pub fn draw(&self, step_s: f64, count: usize, random: &mut RandomStream) -> Vec<DVector<f64>> {
        let discrete = self.discretised(step_s);
        let noise_root = root(&discrete.noise);
        let mut state = root(&discrete.stationary()) * self.normals(random);
        let mut samples = Vec::with_capacity(count);
        for _ in 0..count {
            samples.push(&self.outputs * &state);
            state = &discrete.transition * state + &noise_root * self.normals(random);
        }
        samples
    }

    fn normals(&self, random: &mut RandomStream) -> DVector<f64> {
        DVector::from_fn(self.system.nrows(), |_, _| random.normal())
    }

    /// Van Loan's exponential of [−A, b bᵀ; 0, Aᵀ] Δt: its right blocks are Φ⁻¹ Q and Φᵀ.
    fn discretised(&self, step_s: f64) -> DiscreteFilter {
        let n = self.system.nrows();
        let mut blocks = DMatrix::zeros(2 * n, 2 * n);
        blocks
            .view_mut((0, 0), (n, n))
            .copy_from(&(-&self.system * step_s));
        blocks
            .view_mut((0, n), (n, n))
            .copy_from(&(&self.input * self.input.transpose() * step_s));
        blocks
            .view_mut((n, n), (n, n))
            .copy_from(&(self.system.transpose() * step_s));
        let exponential = blocks.exp();
        let transition = exponential.view((n, n), (n, n)).transpose();
        let noise = &transition * exponential.view((0, n), (n, n));
        DiscreteFilter { transition, noise }
    }
}

impl DiscreteFilter {
    /// P = Σ Φᵏ Q Φᵏᵀ, by doubling.
    fn stationary(&self) -> DMatrix<f64> {
        let (mut covariance, mut transition) = (self.noise.clone(), self.transition.clone());
        for _ in 0..DOUBLINGS {
            covariance += &transition * &covariance * transition.transpose();
            transition = &transition * &transition;
        }
        covariance
    }
}

/// Symmetric root of a covariance; eigenvalues that rounding makes negative count as zero.
fn root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = SymmetricEigen::new((covariance + covariance.transpose()) * 0.5);
    let lengths = eigen.eigenvalues.map(|l| l.max(0.0).sqrt());
    &eigen.eigenvectors * DMatrix::from_diagonal(&lengths) * eigen.eigenvectors.transpose()
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use approx::assert_relative_eq;

    impl ShapingFilter {
        /// Squared magnitude of the response of an output at a frequency, rad/s.
        pub fn squared_gain(&self, output: usize, frequency: f64) -> f64 {
            let n = self.system.nrows();
            // (jω − A) x = b in real and imaginary parts.
            let mut blocks = DMatrix::zeros(2 * n, 2 * n);
            for (i, j, sign) in [(0, n, -1.0), (n, 0, 1.0)] {
                let frequencies = DMatrix::identity(n, n) * (sign * frequency);
                blocks.view_mut((i, j), (n, n)).copy_from(&frequencies);
            }
            for i in [0, n] {
                blocks.view_mut((i, i), (n, n)).copy_from(&-&self.system);
            }
            let right = self.input.clone().resize_vertically(2 * n, 0.0);
            let state = blocks.lu().solve(&right).unwrap();
            let row = self.outputs.row(output);
            let part = |from: usize| (row * state.rows(from, n))[0];
            part(0).powi(2) + part(n).powi(2)
        }

        /// Covariance of an output with itself at a lag of whole steps.
        pub fn covariance(&self, output: usize, step_s: f64, lag: u32) -> f64 {
            let discrete = self.discretised(step_s);
            let row = self.outputs.row(output);
            (row * discrete.transition.pow(lag) * discrete.stationary() * row.transpose())[0]
        }
    }

    #[test]
    fn a_first_order_filter_has_its_variance_correlation_and_gain() {
        // σ² e^(−t/T) for g = σ√(2T).
        let (sigma, time_s) = (3.0_f64, 0.4_f64);
        let filter =
            ShapingFilter::rational(sigma * (2.0 * time_s).sqrt(), time_s, &[1.0], &[1.0, 1.0]);
        for lag in [0, 7, 50] {
            let expected = sigma.powi(2) * (-0.01 * f64::from(lag) / time_s).exp();
            assert_relative_eq!(
                filter.covariance(0, 0.01, lag),
                expected,
                max_relative = 1e-9
            );
        }
        assert_relative_eq!(
            filter.squared_gain(0, 5.0),
            sigma.powi(2) * 2.0 * time_s / (1.0 + (5.0 * time_s).powi(2)),
            max_relative = 1e-12
        );
    }

    #[test]
    fn the_lagged_rate_is_the_rate_below_its_corner() {
        let filter = ShapingFilter::rational(1.0, 2.0, &[1.0, 0.5], &[1.0, 3.0, 1.5]);
        let with_rate = filter.clone().with_lagged_rate(-0.2, 0.1);
        for frequency in [0.1, 3.0, 40.0_f64] {
            let expected = filter.squared_gain(0, frequency) * (0.2 * frequency).powi(2)
                / (1.0 + (0.1 * frequency).powi(2));
            assert_relative_eq!(
                with_rate.squared_gain(1, frequency),
                expected,
                max_relative = 1e-10
            );
            assert_relative_eq!(
                with_rate.squared_gain(0, frequency),
                filter.squared_gain(0, frequency),
                max_relative = 1e-10
            );
        }
    }
}
