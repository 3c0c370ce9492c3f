//! Noise of one output as an autoregressive process: v_k + Σ a_j v_{k−j} = e_k with white e.
//!
//! Found from autocovariances by the recursion of Levinson and Durbin, in the order of least information criterion
//! (Akaike's, corrected for few samples). White noise is order 0.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

/// An autoregressive process.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Autoregression {
    /// a_1, a_2, …
    pub coefficients: Vec<f64>,
    /// Variance of e.
    pub innovation: f64,
}

impl Autoregression {
    /// The process that `samples` values with these autocovariances (at lags 0, 1, …) speak for.
    pub fn fitted(autocovariances: &[f64], samples: usize) -> Autoregression {
        let variance = autocovariances.first().copied().unwrap_or(0.0).max(0.0);
        let mut process = Autoregression { coefficients: vec![], innovation: variance };
        let mut best = process.clone();
        let mut least = process.criterion(samples);
        while let Some(longer) = process.longer(autocovariances) {
            process = longer;
            let criterion = process.criterion(samples);
            if criterion < least {
                (best, least) = (process.clone(), criterion);
            }
        }
        best
    }

    /// The process of the next order; none where no further autocovariance is given or no process can have it.
    fn longer(&self, autocovariances: &[f64]) -> Option<Autoregression> {
        let a = &self.coefficients;
        let next = autocovariances.get(a.len() + 1)?;
        let predicted: f64 = a.iter().zip(autocovariances[1..=a.len()].iter().rev()).map(|(a, c)| a * c).sum();
        let reflection = -(next + predicted) / self.innovation;
        let possible = reflection.abs() < 1.0;
        possible.then(|| Autoregression {
            coefficients: a
                .iter()
                .zip(a.iter().rev())
                .map(|(forward, backward)| forward + reflection * backward)
                .chain([reflection])
                .collect(),
            innovation: self.innovation * (1.0 - reflection * reflection),
        })
    }

    fn criterion(&self, samples: usize) -> f64 {
        let (n, parameters) = (samples as f64, self.coefficients.len() as f64 + 1.0);
        n * self.innovation.max(f64::MIN_POSITIVE).ln() + 2.0 * parameters * n / (n - parameters - 1.0).max(1.0)
    }

    /// Spectral density at frequency zero: the variance of the sum of many values, per value.
    pub fn long_run_variance(&self) -> f64 {
        let gain = 1.0 + self.coefficients.iter().sum::<f64>();
        self.innovation / (gain * gain)
    }

    /// Samples until the answer to one impulse has died away, at most `longest`.
    pub fn memory(&self, longest: usize) -> usize {
        const DEAD: f64 = 1e-3;
        let order = self.coefficients.len();
        let mut answer = vec![0.0; longest + 1];
        answer[0] = 1.0;
        self.filter(&mut answer, 1);
        let last = answer.iter().rposition(|h| h.abs() > DEAD).unwrap_or(0);
        if order == 0 { 0 } else { (last + order).min(longest) }
    }

    /// u = s/A of a series at rest before its first sample, `width` values a sample.
    #[inline(always)]
    pub fn filter(&self, series: &mut [f64], width: usize) {
        for k in 1..series.len() / width {
            let (past, now) = series.split_at_mut(k * width);
            for (a, past) in self.coefficients.iter().zip(past.rchunks_exact(width)) {
                for i in 0..width {
                    now[i] = (-a).mul_add(past[i], now[i]);
                }
            }
        }
    }

    /// The same backwards in time, at rest after the last sample.
    #[inline(always)]
    pub fn filter_back(&self, series: &mut [f64], width: usize) {
        for k in (1..series.len() / width).rev() {
            let (now, later) = series.split_at_mut(k * width);
            let now = &mut now[(k - 1) * width..];
            for (a, later) in self.coefficients.iter().zip(later.chunks_exact(width)) {
                for i in 0..width {
                    now[i] = (-a).mul_add(later[i], now[i]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// Autocovariances of v_k = c v_{k−1} + e_k with unit variance.
    fn first_order(c: f64, lags: i32) -> Vec<f64> {
        (0..=lags).map(|lag| c.powi(lag)).collect()
    }

    #[test]
    fn a_first_order_process_is_found_from_its_autocovariances_and_no_longer_one() {
        let process = Autoregression::fitted(&first_order(0.9, 8), 500);
        assert_eq!(process.coefficients.len(), 1);
        assert_relative_eq!(process.coefficients[0], -0.9, epsilon = 1e-12);
        assert_relative_eq!(process.innovation, 1.0 - 0.81, epsilon = 1e-12);
        assert_relative_eq!(process.long_run_variance(), 0.19 / 0.01, epsilon = 1e-9);
    }

    #[test]
    fn a_second_order_process_is_found_from_its_autocovariances() {
        // v_k = 1.2 v_{k−1} − 0.5 v_{k−2} + e_k: Yule-Walker gives ρ1 = 1.2/1.5, ρ_l = 1.2 ρ_{l−1} − 0.5 ρ_{l−2}.
        let mut covariances = vec![1.0, 0.8];
        (2..8).for_each(|l| covariances.push(1.2 * covariances[l - 1] - 0.5 * covariances[l - 2]));
        let process = Autoregression::fitted(&covariances, 500);
        assert_eq!(process.coefficients.len(), 2);
        assert_relative_eq!(process.coefficients[0], -1.2, epsilon = 1e-12);
        assert_relative_eq!(process.coefficients[1], 0.5, epsilon = 1e-12);
        assert_relative_eq!(process.innovation, 1.0 - 1.2 * 0.8 + 0.5 * (1.2 * 0.8 - 0.5), epsilon = 1e-12);
    }

    #[test]
    fn white_noise_has_order_zero_and_no_memory() {
        let process = Autoregression::fitted(&[2.0, 0.01, -0.02, 0.03], 500);
        assert_eq!(process, Autoregression { coefficients: vec![], innovation: 2.0 });
        assert_eq!(process.memory(100), 0);
    }

    #[test]
    fn autocovariances_that_no_process_can_have_end_the_recursion() {
        assert_eq!(Autoregression::fitted(&[1.0, 1.5, 3.0], 500).coefficients.len(), 0);
        assert_relative_eq!(Autoregression::fitted(&[0.0, 0.0], 500).innovation, 0.0);
        assert_relative_eq!(Autoregression::fitted(&[], 500).innovation, 0.0);
    }

    #[test]
    fn filtering_to_and_fro_multiplies_by_the_autocovariance_matrix() {
        let process = Autoregression { coefficients: vec![-0.8], innovation: 0.36 };
        let (samples, impulse) = (100, 40);
        let mut series = vec![0.0; samples];
        series[impulse] = 1.0;
        series.resize(samples + process.memory(samples), 0.0);
        process.filter(&mut series, 1);
        process.filter_back(&mut series, 1);
        for (k, value) in series.iter().take(samples).enumerate() {
            let covariance = 0.8_f64.powi(i32::try_from(k.abs_diff(impulse)).unwrap());
            assert_relative_eq!(process.innovation * value, covariance, epsilon = 1e-4);
        }
    }
}
