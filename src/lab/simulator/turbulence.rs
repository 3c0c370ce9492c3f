//! Turbulence after Dryden (MIL-F-8785C): gusts along the body axes as white noise through the
//! filters σ√(2T)/(1 + Ts) for u, T = `L_u`/V, and σ√T (1 + √3 Ts)/(1 + Ts)² for v and w, made in
//! discrete time without approximation.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::noise::Noise;

/// Intensity and scale of the turbulence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Turbulence {
    /// Standard deviation of the gusts in each axis.
    pub sigma_ft_s: f64,
    /// The scale length L of all three; 1750 ft above 2000 ft.
    #[serde(default = "default_length")]
    pub length_ft: f64,
}

fn default_length() -> f64 {
    1750.0
}

/// The second-order filter split into √3/(1+Ts) + (1−√3)/(1+Ts)²: the states of the two.
#[derive(Clone, Copy, Debug, Default)]
struct Across {
    first: f64,
    second: f64,
}

/// Gusts in body axes, ft/s, at the times k·`step_s`: `count` of them, from the stationary
/// distribution.
#[must_use]
pub fn gusts(
    turbulence: &Turbulence,
    speed_ft_s: f64,
    step_s: f64,
    count: usize,
    seed: u64,
) -> Vec<Vector3<f64>> {
    let part = step_s * speed_ft_s / turbulence.length_ft;
    let sigma = turbulence.sigma_ft_s;
    let along = first_order(part, count, &mut Noise::new(seed, "gust along"));
    let side = across(part, count, &mut Noise::new(seed, "gust across"));
    let down = across(part, count, &mut Noise::new(seed, "gust down"));
    along
        .into_iter()
        .zip(side)
        .zip(down)
        .map(|((u, v), w)| Vector3::new(u, v, w) * sigma)
        .collect()
}

fn first_order(part: f64, count: usize, noise: &mut Noise) -> Vec<f64> {
    let keep = (-part).exp();
    let fresh = (1.0 - keep * keep).sqrt();
    let mut value = noise.normal();
    let mut next = || {
        let now = value;
        value = keep * value + fresh * noise.normal();
        now
    };
    (0..count).map(|_| next()).collect()
}

/// Covariance of the two states that noise of unit strength leaves after `part` time constants.
fn covariance(part: f64) -> [f64; 3] {
    let gone = (-2.0 * part).exp();
    [
        (1.0 - gone) / 2.0,
        (1.0 - gone * (1.0 + 2.0 * part)) / 4.0,
        (1.0 - gone * (1.0 + 2.0 * part + 2.0 * part * part)) / 4.0,
    ]
}

/// Two correlated deviates of a covariance (its Cholesky factor times two free ones).
fn draw([a, b, c]: [f64; 3], noise: &mut Noise) -> Across {
    let first = a.sqrt();
    let (x, y) = (noise.normal(), noise.normal());
    Across {
        first: first * x,
        second: b / first * x + (c - b * b / a).max(0.0).sqrt() * y,
    }
}

fn across(part: f64, count: usize, noise: &mut Noise) -> Vec<f64> {
    let root = 3.0_f64.sqrt();
    let keep = (-part).exp();
    let mut state = draw([0.5, 0.25, 0.25], noise);
    let mut next = || {
        let now = root * state.first + (1.0 - root) * state.second;
        let fresh = draw(covariance(part), noise);
        state = Across {
            first: keep * state.first + fresh.first,
            second: keep * (state.second + part * state.first) + fresh.second,
        };
        now
    };
    (0..count).map(|_| next()).collect()
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
    fn gusts_have_dryden_s_variance_and_correlation_whatever_the_step() {
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
    fn the_same_seed_is_the_same_air() {
        let air = |seed| {
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
        assert_eq!(air(1), air(1));
        assert_ne!(air(1), air(2));
    }
}
