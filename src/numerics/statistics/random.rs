//! Reproducible random numbers: one stream per seed and name, identical on every machine and for any
//! number of threads.
//!
//! Uniform deviates: `SplitMix64` (Steele, Lea and Flood 2014). Normal deviates: Box and Muller.
//! Streams of different names are independent, so adding a sensor leaves the noise of the others
//! unchanged.

use nalgebra::{DMatrix, DVector};

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct RandomStream {
    state: u64,
}

/// Derives the seed of a named part of a simulation.
#[must_use]
pub fn derived_seed(seed: u64, name: &str) -> u64 {
    RandomStream::new(seed, name).bits()
}

impl RandomStream {
    /// Starts the stream of a name under a seed.
    #[must_use]
    pub fn new(seed: u64, name: &str) -> RandomStream {
        // FNV-1a of the name separates the starting states of a seed's streams.
        let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325, |h: u64, b| {
            (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3)
        });
        let mut stream = RandomStream {
            state: seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ hash,
        };
        stream.state = stream.bits();
        stream
    }

    fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Draws a uniform deviate from (0, 1).
    pub fn uniform(&mut self) -> f64 {
        let bits = self.bits() >> 11;
        (bits as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Draws a normal deviate of mean 0 and variance 1.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (2.0 * std::f64::consts::PI * self.uniform()).cos()
    }

    /// Draws deviations with the covariance R Rᵀ of a root R.
    pub fn deviations(&mut self, root: &DMatrix<f64>) -> DVector<f64> {
        root * DVector::from_fn(root.ncols(), |_, _| self.normal())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn normal_deviates_have_mean_0_variance_1_and_normal_tails() {
        let mut noise = RandomStream::new(7, "q_deg_s");
        let n = 200_000;
        let values: Vec<f64> = (0..n).map(|_| noise.normal()).collect();
        let moment = |power: i32| values.iter().map(|v| v.powi(power)).sum::<f64>() / f64::from(n);
        assert_abs_diff_eq!(moment(1), 0.0, epsilon = 0.01);
        assert_abs_diff_eq!(moment(2), 1.0, epsilon = 0.02);
        assert_abs_diff_eq!(moment(4), 3.0, epsilon = 0.1);
    }

    #[test]
    fn streams_of_other_names_and_seeds_are_uncorrelated() {
        let draw = |seed, name| {
            let mut noise = RandomStream::new(seed, name);
            (0..20_000).map(|_| noise.normal()).collect::<Vec<f64>>()
        };
        let first = draw(1, "p_deg_s");
        assert_eq!(first, draw(1, "p_deg_s"));
        for other in [draw(2, "p_deg_s"), draw(1, "q_deg_s")] {
            let correlation: f64 =
                first.iter().zip(&other).map(|(a, b)| a * b).sum::<f64>() / 20_000.0;
            assert_abs_diff_eq!(correlation, 0.0, epsilon = 0.03);
        }
    }
}
