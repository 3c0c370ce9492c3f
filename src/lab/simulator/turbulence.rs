//! Dryden turbulence (MIL-F-8785C): gusts along the body axes.
//!
//! White noise through σ√(2T)/(1 + Ts) for u and σ√T (1 + √3 Ts)/(1 + Ts)² for v and w, T = L/V,
//! discretised exactly.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::random::RandomStream;

/// Intensity and scale length of the turbulence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Turbulence {
    /// Standard deviation of the gusts in each axis.
    pub sigma_ft_s: f64,
    /// Scale length L of the three axes; 1750 ft above 2000 ft (MIL-F-8785C).
    #[serde(default = "default_length")]
    pub length_ft: f64,
}

fn default_length() -> f64 {
    1750.0
}

/// States of the transverse filter, split into √3/(1+Ts) + (1−√3)/(1+Ts)².
#[derive(Clone, Copy, Debug, Default)]
struct TransverseFilter {
    first: f64,
    second: f64,
}

/// Draws `count` gusts in body axes, ft/s, at multiples of `step_s`, from the stationary
/// distribution.
#[must_use]
pub fn gusts(
    turbulence: &Turbulence,
    speed_ft_s: f64,
    step_s: f64,
    count: usize,
    seed: u64,
) -> Vec<Vector3<f64>> {
    let step = step_s * speed_ft_s / turbulence.length_ft;
    let sigma = turbulence.sigma_ft_s;
    let along = longitudinal(step, count, &mut RandomStream::new(seed, "gust along"));
    let side = transverse(step, count, &mut RandomStream::new(seed, "gust across"));
    let down = transverse(step, count, &mut RandomStream::new(seed, "gust down"));
    along
        .into_iter()
        .zip(side)
        .zip(down)
        .map(|((u, v), w)| Vector3::new(u, v, w) * sigma)
        .collect()
}

/// Unit gusts of the longitudinal filter; `step` in time constants.
fn longitudinal(step: f64, count: usize, random: &mut RandomStream) -> Vec<f64> {
    let decay = (-step).exp();
    let innovation = (1.0 - decay * decay).sqrt();
    let mut value = random.normal();
    let mut gusts = Vec::with_capacity(count);
    for _ in 0..count {
        gusts.push(value);
        value = decay * value + innovation * random.normal();
    }
    gusts
}

/// Covariance of the two filter states that unit white noise builds up in `step` time constants:
/// variance, covariance, variance.
fn covariance(step: f64) -> [f64; 3] {
    let decay = (-2.0 * step).exp();
    [
        (1.0 - decay) / 2.0,
        (1.0 - decay * (1.0 + 2.0 * step)) / 4.0,
        (1.0 - decay * (1.0 + 2.0 * step + 2.0 * step * step)) / 4.0,
    ]
}

/// Draws two correlated deviates: the Cholesky factor of the covariance times two independent ones.
fn draw([a, b, c]: [f64; 3], random: &mut RandomStream) -> TransverseFilter {
    let first = a.sqrt();
    let (x, y) = (random.normal(), random.normal());
    TransverseFilter {
        first: first * x,
        second: b / first * x + (c - b * b / a).max(0.0).sqrt() * y,
    }
}

/// Unit gusts of the transverse filter; `step` in time constants.
fn transverse(step: f64, count: usize, random: &mut RandomStream) -> Vec<f64> {
    let root = 3.0_f64.sqrt();
    let decay = (-step).exp();
    let mut state = draw([0.5, 0.25, 0.25], random);
    let mut gusts = Vec::with_capacity(count);
    for _ in 0..count {
        gusts.push(root * state.first + (1.0 - root) * state.second);
        let innovation = draw(covariance(step), random);
        state = TransverseFilter {
            first: decay * state.first + innovation.first,
            second: decay * (state.second + step * state.first) + innovation.second,
        };
    }
    gusts
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Variance and correlation at a lag of each axis over many scale lengths.
    fn statistics(step_s: f64, lag: usize) -> [(f64, f64); 3] {
        let gusts = gusts(
            &Turbulence {
                sigma_ft_s: 5.0,
                length_ft: 500.0,
            },
            500.0,
            step_s,
            400_000,
            3,
        );
        [0, 1, 2].map(|axis| {
            let values: Vec<f64> = gusts.iter().map(|g| g[axis]).collect();
            let product = |lag: usize| {
                let pairs = values.iter().zip(&values[lag..]);
                pairs.map(|(a, b)| a * b).sum::<f64>() / (values.len() - lag) as f64
            };
            (product(0), product(lag) / product(0))
        })
    }

    #[test]
    fn gusts_have_the_variance_and_correlation_of_the_specification_at_any_step() {
        // Correlation over r scale lengths: e^(-r) along, e^(-r)(1 - r/2) across.
        for (step_s, lag) in [(0.05, 10), (0.1, 5)] {
            let [along, side, down] = statistics(step_s, lag);
            let r = 0.5_f64;
            for ((variance, correlation), expected) in [
                (along, (-r).exp()),
                (side, (-r).exp() * (1.0 - r / 2.0)),
                (down, (-r).exp() * (1.0 - r / 2.0)),
            ] {
                assert_relative_eq!(variance, 25.0, max_relative = 0.04);
                assert_relative_eq!(correlation, expected, max_relative = 0.04);
            }
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_gusts() {
        let draw_gusts = |seed| {
            gusts(
                &Turbulence {
                    sigma_ft_s: 5.0,
                    length_ft: 500.0,
                },
                300.0,
                0.0125,
                50,
                seed,
            )
        };
        assert_eq!(draw_gusts(1), draw_gusts(1));
        assert_ne!(draw_gusts(1), draw_gusts(2));
    }
}
