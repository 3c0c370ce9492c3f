//! Random numbers from a seed and a name: the same on every machine and whatever the number of
//! threads.
//!
//! A stream is `SplitMix64` (Steele, Lea and Flood 2014); normal deviates are Box and Muller's.
//! Streams of different names do not touch each other, so a sensor's noise does not depend on which
//! others there are.

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct Noise {
    state: u64,
}

/// A seed of its own for a part of what a seed decides.
#[must_use]
pub fn seed_of(seed: u64, name: &str) -> u64 {
    Noise::new(seed, name).bits()
}

impl Noise {
    /// The stream of a name under a seed.
    #[must_use]
    pub fn new(seed: u64, name: &str) -> Noise {
        // FNV-1a of the name, so that the streams of a seed start far from each other.
        let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325, |h: u64, b| {
            (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3)
        });
        let mut noise = Noise {
            state: seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ hash,
        };
        noise.state = noise.bits();
        noise
    }

    fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in (0, 1), all alike.
    pub fn uniform(&mut self) -> f64 {
        let bits = self.bits() >> 11;
        (bits as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// A normal deviate of mean 0 and variance 1.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (2.0 * std::f64::consts::PI * self.uniform()).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn normal_deviates_have_mean_0_variance_1_and_normal_tails() {
        let mut noise = Noise::new(7, "q_deg_s");
        let n = 200_000;
        let values: Vec<f64> = (0..n).map(|_| noise.normal()).collect();
        let moment = |power: i32| values.iter().map(|v| v.powi(power)).sum::<f64>() / f64::from(n);
        assert_abs_diff_eq!(moment(1), 0.0, epsilon = 0.01);
        assert_abs_diff_eq!(moment(2), 1.0, epsilon = 0.02);
        assert_abs_diff_eq!(moment(4), 3.0, epsilon = 0.1);
    }

    #[test]
    fn streams_of_other_names_and_seeds_are_unrelated() {
        let draw = |seed, name| {
            let mut noise = Noise::new(seed, name);
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
