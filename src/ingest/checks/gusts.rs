//! Gusts of a flight, from the difference between its motion through the air and its inertial
//! motion.
//!
//! The measured side of an acceleration relation is the acceleration relative to the air, the
//! predicted side the inertial one. Their difference is −ġ, the change of the gust's velocity in a
//! step. Sums over steps return g without a constant and without a trend, which biases make. Second
//! differences of g over a lag have neither:
//!
//! - vanes' noise of variance s², white: V = 6 s² at any lag
//! - gusts over a lag that is short against their scale, a random walk of a² per step: V(l) = 2 l
//!   a²
//! - gusts over a lag that is long against their scale, of variance σ²: V = 6 σ²
//!
//! A step is a block. With lags of one and two, s² = (2 V(1) − V(2))/6; gusts that change entirely
//! within a step are mistaken for noise. With the lag of a window of the checks, V − 6 s² is twice
//! the mean square of the gusts' change in it, or more.

use super::relations::{BODY_AXES, Relation};
use super::windows::{RelationPairs, WindowPair};
use crate::numerics::series::sample_count::whole_steps;
use crate::numerics::statistics::order_statistics::quantile;

/// Share of the second differences below the one from which their variance is computed. Maneuvers
/// disturb fewer than a quarter; gusts in a quarter of the flight are detected.
const SHARE: f64 = 0.75;

/// Standard deviations of a normal distribution in its magnitude at [`SHARE`]: Φ⁻¹(⅞).
const DEVIATIONS: f64 = 1.150_349;

/// Variance of a second difference x₁ − 2 x₂ + x₃ of white noise over the noise's: 1² + 2² + 1².
const SECOND_DIFFERENCE_VARIANCE: f64 = 6.0;

/// Lag over which gusts lose their correlation, s. The scale of turbulence above 2000 ft is 1750 ft
/// (MIL-F-8785C), which takes 2 to 8 s at 900 to 220 ft/s.
const LONG_S: f64 = 8.0;

/// Least number of second differences for a variance: its standard deviation is then about half
/// of it.
const LEAST: usize = 20;

/// Largest possible ratio of the gusts of two axes. Turbulence is isotropic at scales that an
/// aircraft crosses in a second (Kolmogorov); its spectra across and along the flight differ by
/// 4/3.
const ISOTROPY: f64 = 1.5;

/// Gusts along one body axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisGusts {
    /// Root mean square of their velocity's change in a window of the checks, ft/s²; a bound where their
    /// scale is as short as the window.
    pub change_ft_s2: f64,
    /// Root mean square of their velocity, ft/s; `None` for a short record.
    pub rms_ft_s: Option<f64>,
}

/// Gusts of a flight along the body axes; `None` if the record is too short.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gusts(pub [Option<AxisGusts>; BODY_AXES]);

impl Gusts {
    /// Estimates the gusts of a record from the relations that they disturb, in steps of `step_s`.
    pub fn of(
        relations: &[Relation],
        pairs: &[RelationPairs],
        (step_s, window_s): (f64, f64),
    ) -> Gusts {
        let mut gusts = Gusts::default();
        for (relation, pairs) in relations.iter().zip(pairs) {
            if let Some((axis, per_ft_s2)) = relation.disturbed_by_gusts()
                && gusts.0[axis].is_none()
            {
                let runs = runs(&pairs.steps, step_s / per_ft_s2);
                gusts.0[axis] = of_axis(&runs, step_s, window_s);
            }
        }
        gusts
    }

    /// Largest change of the gust velocity in a window that the weather explains in any axis, root
    /// mean square, ft/s². Zero with fewer than two axes.
    ///
    /// A faulty channel disturbs one or two axes, the weather all axes alike, so the calmest axis
    /// decides.
    pub fn largest_change_ft_s2(&self) -> f64 {
        let axes: Vec<f64> = self.0.iter().flatten().map(|g| g.change_ft_s2).collect();
        if axes.len() < 2 {
            return 0.0;
        }
        ISOTROPY * axes.into_iter().fold(f64::INFINITY, f64::min)
    }
}

/// Sums of the differences between the sides over consecutive steps, ft/s: one run between two that are
/// missing.
fn runs(pairs: &[WindowPair], factor: f64) -> Vec<Vec<f64>> {
    let mut runs: Vec<Vec<f64>> = Vec::new();
    let mut next = None;
    for pair in pairs {
        if next != Some(pair.window) {
            runs.push(vec![0.0]);
        }
        next = Some(pair.window + 1);
        if let Some(run) = runs.last_mut() {
            let sum = run.last().copied().unwrap_or_default();
            run.push(sum + factor * (pair.measured - pair.predicted));
        }
    }
    runs
}

/// Gusts of an axis from runs with `step_s` between two values.
fn of_axis(runs: &[Vec<f64>], step_s: f64, window_s: f64) -> Option<AxisGusts> {
    let variance = |lag_s: f64| {
        let lag = whole_steps(lag_s, step_s).max(1);
        variance_of_second_differences(runs, lag)
    };
    let (one, two) = (variance(step_s)?, variance(2.0 * step_s)?);
    let noise = ((2.0 * one - two) / SECOND_DIFFERENCE_VARIANCE).max(0.0);
    let without_noise = |variance: f64| (variance - SECOND_DIFFERENCE_VARIANCE * noise).max(0.0);
    Some(AxisGusts {
        change_ft_s2: (without_noise(variance(window_s)?) / 2.0).sqrt() / window_s,
        rms_ft_s: variance(LONG_S)
            .map(|long| (without_noise(long) / SECOND_DIFFERENCE_VARIANCE).sqrt()),
    })
}

/// Variance of x(k + lag) − 2 x(k) + x(k − lag), from a quantile of the magnitudes.
fn variance_of_second_differences(runs: &[Vec<f64>], lag: usize) -> Option<f64> {
    let second = |w: &[f64]| (w[2 * lag] - 2.0 * w[lag] + w[0]).abs();
    let magnitudes: Vec<f64> = runs
        .iter()
        .flat_map(|run| run.windows(2 * lag + 1).map(second))
        .collect();
    if magnitudes.len() < LEAST {
        return None;
    }
    let deviation = quantile(magnitudes, SHARE)? / DEVIATIONS;
    Some(deviation * deviation)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Deviates of a normal distribution, from a linear congruential generator.
    fn normal(count: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 + 1e-12
        };
        let deviate = |(): ()| {
            let (u, v) = (uniform(), uniform());
            (-2.0 * u.ln()).sqrt() * (2.0 * std::f64::consts::PI * v).cos()
        };
        std::iter::repeat_n((), count).map(deviate).collect()
    }

    /// First-order gusts with a time constant of 4 windows, beside a trend that a bias makes.
    fn gusts(sigma: f64) -> Vec<f64> {
        let decay = (-0.25_f64).exp();
        let mut value = 0.0;
        let step = |(k, noise): (usize, f64)| {
            value = decay * value + (1.0 - decay * decay).sqrt() * sigma * noise;
            value + 0.3 * k as f64
        };
        normal(20_000, 7)
            .into_iter()
            .enumerate()
            .map(step)
            .collect()
    }

    #[test]
    fn gusts_have_their_size_beside_a_bias_and_noise() {
        let noise = normal(20_000, 3);
        let run: Vec<f64> = gusts(6.0)
            .iter()
            .zip(&noise)
            .map(|(g, n)| g + 0.3 * n)
            .collect();
        let found = of_axis(&[run], 1.0, 1.0).unwrap();
        // The change within a step of a fourth of the time constant: 2 σ² (1 − ρ), less what passes for noise.
        let change = 6.0 * (2.0 * (1.0 - (-0.25_f64).exp())).sqrt();
        assert!(
            (1.0..1.08).contains(&(found.change_ft_s2 / change)),
            "{found:?} {change}"
        );
        assert!(
            (found.rms_ft_s.unwrap() / 6.0 - 1.0).abs() < 0.12,
            "{found:?}"
        );
    }

    #[test]
    fn gusts_that_change_within_a_window_of_the_checks_are_bounded() {
        // A time constant of 0.8 s, of which the runs have values every 0.2 s.
        let found = of_axis(&[gusts(6.0)], 0.2, 1.0).unwrap();
        let change = 6.0 * (2.0 * (1.0 - (-1.0 / 0.8_f64).exp())).sqrt();
        let ratio = found.change_ft_s2 / change;
        assert!((1.0..1.25).contains(&ratio), "{found:?} {change}");
    }

    #[test]
    fn noise_of_a_vane_is_no_gust_and_a_short_record_has_none() {
        let found = of_axis(&[normal(20_000, 5)], 1.0, 1.0).unwrap();
        assert!(found.change_ft_s2 < 0.2, "{found:?}");
        assert!(found.rms_ft_s.unwrap() < 0.2, "{found:?}");
        assert_eq!(of_axis(&[normal(20, 5)], 1.0, 1.0), None);
    }

    #[test]
    fn the_calmest_axis_bounds_the_gusts_of_all() {
        let axis = |change_ft_s2| {
            Some(AxisGusts {
                change_ft_s2,
                rms_ft_s: None,
            })
        };
        let largest = |axes| Gusts(axes).largest_change_ft_s2();
        assert!((largest([axis(3.0), axis(40.0), axis(2.0)]) - 3.0).abs() < 1e-12);
        assert!(largest([None, axis(40.0), None]).abs() < 1e-12);
    }
}
