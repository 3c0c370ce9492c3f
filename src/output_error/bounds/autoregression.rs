//! Noise of one output as an autoregressive process.
//!
//! The noise v at sample k depends on the earlier samples and on white noise e, with the
//! coefficients a_j: v_k + Σ a_j v_{k−j} = e_k.
//!
//! The process is fitted to autocovariances by the recursion of Levinson and Durbin. Its order has
//! the least information criterion (Akaike's, corrected for few samples). White noise has order 0.

/// Highest order of a process.
pub(super) const HIGHEST_ORDER: usize = 12;

/// Autoregressive process.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Autoregression {
    /// Coefficients a_1, a_2, …
    pub coefficients: Vec<f64>,
    /// Variance of the innovations e, in the square of the output's unit.
    pub innovation: f64,
}

impl Autoregression {
    /// White noise.
    pub fn white(variance: f64) -> Autoregression {
        Autoregression {
            coefficients: vec![],
            innovation: variance,
        }
    }

    pub fn is_white(&self) -> bool {
        self.coefficients.is_empty()
    }

    /// Process of best order for autocovariances (at lags 0, 1, …) of `samples` values.
    pub fn fitted(autocovariances: &[f64], samples: f64) -> Autoregression {
        let variance = autocovariances.first().copied().unwrap_or(0.0).max(0.0);
        let mut process = Autoregression::white(variance);
        let mut best = process.clone();
        let mut least = process.criterion(samples);
        while process.lengthen(autocovariances) {
            let criterion = process.criterion(samples);
            if criterion < least {
                best.clone_from(&process);
                least = criterion;
            }
        }
        best
    }

    /// Extends the process by one order. Returns `false` and leaves the process unchanged if there
    /// is no further autocovariance, or if no process can have it.
    fn lengthen(&mut self, autocovariances: &[f64]) -> bool {
        let a = &mut self.coefficients;
        let Some((next, past)) = autocovariances
            .get(1..a.len() + 2)
            .and_then(<[f64]>::split_last)
        else {
            return false;
        };
        let predicted: f64 = a.iter().zip(past.iter().rev()).map(|(a, c)| a * c).sum();
        let reflection = -(next + predicted) / self.innovation;
        let possible = reflection.abs() < 1.0;
        if possible {
            let last = a.len();
            for (i, j) in (0..last.div_ceil(2)).map(|i| (i, last - 1 - i)) {
                let (forward, backward) = (a[i], a[j]);
                (a[i], a[j]) = (
                    forward + reflection * backward,
                    backward + reflection * forward,
                );
            }
            a.push(reflection);
            self.innovation *= 1.0 - reflection * reflection;
        }
        possible
    }

    /// Log-likelihood that the process gains over white noise of the same variance, less the
    /// penalty of the information criterion for its coefficients.
    pub fn likelihood_gain(&self, variance: f64, samples: f64) -> f64 {
        0.5 * (Autoregression::white(variance).criterion(samples) - self.criterion(samples))
    }

    fn criterion(&self, samples: f64) -> f64 {
        let (n, parameters) = (samples, self.coefficients.len() as f64 + 1.0);
        n * self.innovation.max(f64::MIN_POSITIVE).ln()
            + 2.0 * parameters * n / (n - parameters - 1.0).max(1.0)
    }

    /// Spectral density at frequency zero: variance of a sum of many values, per value.
    pub fn long_run_variance(&self) -> f64 {
        let gain = 1.0 + self.coefficients.iter().sum::<f64>();
        self.innovation / (gain * gain)
    }

    /// Number of samples until the impulse response has decayed, at most `longest`.
    pub fn memory(&self, longest: usize) -> usize {
        const DEAD: f64 = 1e-3;
        /// Response below which the computation ends, because it cannot grow above `DEAD` again.
        const GONE: f64 = 1e-9;
        let order = self.coefficients.len();
        let (mut answer, mut last) = (vec![1.0], 0);
        while order > 0 && answer.len() <= longest {
            let now: f64 = -self
                .coefficients
                .iter()
                .zip(answer.iter().rev())
                .map(|(a, h)| a * h)
                .sum::<f64>();
            if now.abs() > DEAD {
                last = answer.len();
            }
            answer.push(now);
            if answer.iter().rev().take(order).all(|h| h.abs() < GONE) {
                break;
            }
        }
        if order == 0 {
            0
        } else {
            (last + order).min(longest)
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::numerics::linear_algebra::matrix::AlignedMatrix;

    /// Autocovariances of v_k = c v_{k−1} + e_k with unit variance.
    fn first_order(c: f64, lags: i32) -> Vec<f64> {
        (0..=lags).map(|lag| c.powi(lag)).collect()
    }

    #[test]
    fn a_first_order_process_is_found_from_its_autocovariances_and_no_longer_one() {
        let process = Autoregression::fitted(&first_order(0.9, 8), 500.0);
        assert_eq!(process.coefficients.len(), 1);
        assert_relative_eq!(process.coefficients[0], -0.9, epsilon = 1e-12);
        assert_relative_eq!(process.innovation, 1.0 - 0.81, epsilon = 1e-12);
        assert_relative_eq!(process.long_run_variance(), 0.19 / 0.01, epsilon = 1e-9);
    }

    #[test]
    fn a_second_order_process_is_found_from_its_autocovariances() {
        // v_k = 1.2 v_{k−1} − 0.5 v_{k−2} + e_k: Yule-Walker gives ρ1 = 1.2/1.5, ρ_l = 1.2 ρ_{l−1}
        // − 0.5 ρ_{l−2}.
        let mut covariances = vec![1.0, 0.8];
        (2..8).for_each(|l| covariances.push(1.2 * covariances[l - 1] - 0.5 * covariances[l - 2]));
        let process = Autoregression::fitted(&covariances, 500.0);
        assert_eq!(process.coefficients.len(), 2);
        assert_relative_eq!(process.coefficients[0], -1.2, epsilon = 1e-12);
        assert_relative_eq!(process.coefficients[1], 0.5, epsilon = 1e-12);
        assert_relative_eq!(
            process.innovation,
            1.0 - 1.2 * 0.8 + 0.5 * (1.2 * 0.8 - 0.5),
            epsilon = 1e-12
        );
    }

    #[test]
    fn white_noise_has_order_zero_and_no_memory() {
        let process = Autoregression::fitted(&[2.0, 0.01, -0.02, 0.03], 500.0);
        assert_eq!(
            process,
            Autoregression {
                coefficients: vec![],
                innovation: 2.0
            }
        );
        assert_eq!(process.memory(100), 0);
    }

    #[test]
    fn autocovariances_that_no_process_can_have_end_the_recursion() {
        assert_eq!(
            Autoregression::fitted(&[1.0, 1.5, 3.0], 500.0)
                .coefficients
                .len(),
            0
        );
        assert_relative_eq!(Autoregression::fitted(&[0.0, 0.0], 500.0).innovation, 0.0);
        assert_relative_eq!(Autoregression::fitted(&[], 500.0).innovation, 0.0);
    }

    #[test]
    fn filtering_to_and_fro_multiplies_by_the_autocovariance_matrix() {
        let process = Autoregression {
            coefficients: vec![-0.8],
            innovation: 0.36,
        };
        let (samples, impulse) = (100, 40);
        let mut series = AlignedMatrix::zeros(samples, 1);
        series
            .rows_mut()
            .skip(impulse)
            .take(1)
            .for_each(|row| row[0] = 1.0);
        let mut series = series.with_zero_rows(process.memory(samples));
        series.filter_columns(&process.coefficients);
        series.filter_columns_backwards(&process.coefficients);
        for (k, row) in series.rows().take(samples).enumerate() {
            let covariance = 0.8_f64.powi(i32::try_from(k.abs_diff(impulse)).unwrap());
            assert_relative_eq!(process.innovation * row[0], covariance, epsilon = 1e-4);
        }
    }
}
