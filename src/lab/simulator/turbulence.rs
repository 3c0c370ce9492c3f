//! Continuous turbulence: gusts along the body axes and the turning of the air, as white noise
//! through shaping filters.
//!
//! With T = L/V, b the span and unit white noise:
//!
//! | gust | Dryden (MIL-F-8785C) | von Kármán (MIL-STD-1797A, rational) |
//! |---|---|---|
//! | u | σ√(2T) / (1 + Ts) | σ√(2T) (1 + 0.25Ts) / (1 + 1.357Ts + 0.1987(Ts)²) |
//! | v, w | σ√T (1 + √3 Ts) / (1 + Ts)² | σ√T (1 + 2.7478Ts + 0.3398(Ts)²) / (1 + 2.9958Ts + 1.9754(Ts)² + 0.1539(Ts)³) |
//! | `p_g` | σ√(0.8π/V) (π/4b)^⅙ L^−⅓ / (1 + 4b/(πV) s) | the same |
//! | `q_g` | −(s/V) / (1 + 4b/(πV) s) of w | the same |
//! | `r_g` | (s/V) / (1 + 3b/(πV) s) of v | the same |
//!
//! The rates follow from gusts that the aircraft meets as it advances: ẇ = V ∂w/∂x. MIL-STD-1797A
//! writes 2L for the transverse gusts and takes L half as long. The rational filters have 3 % less
//! variance than the spectrum of von Kármán, all of it above 20 V/L.

use std::f64::consts::PI;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::gust::{Gust, GustPath};
use super::shaping_filter::ShapingFilter;
use crate::numerics::statistics::random::RandomStream;

/// Form of the spectra.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TurbulenceModel {
    #[default]
    Dryden,
    VonKarman,
}

/// Form, intensity and scale length of the turbulence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Turbulence {
    #[serde(default)]
    pub model: TurbulenceModel,
    /// Standard deviation of the gusts in each axis.
    pub sigma_ft_s: f64,
    /// Scale length L of the three axes. Default: that of MIL-F-8785C above 2000 ft, 1750 ft for
    /// Dryden and 2500 ft for von Kármán.
    #[serde(default)]
    pub length_ft: Option<f64>,
}

/// Shaping filters at one airspeed.
struct GustFilters {
    along: ShapingFilter,
    /// v and `r_g`.
    across: ShapingFilter,
    /// w and `q_g`.
    down: ShapingFilter,
    roll: ShapingFilter,
}

impl Turbulence {
    /// Scale length L.
    #[must_use]
    pub fn scale_length_ft(&self) -> f64 {
        self.length_ft.unwrap_or(match self.model {
            TurbulenceModel::Dryden => 1750.0,
            TurbulenceModel::VonKarman => 2500.0,
        })
    }

    /// Checks intensity and scale length.
    ///
    /// # Errors
    /// The message for the first one that is wrong.
    pub fn check(&self) -> Result<(), String> {
        if !(self.sigma_ft_s >= 0.0 && self.sigma_ft_s.is_finite()) {
            return Err("`sigma_ft_s` must not be negative".into());
        }
        if !(self.scale_length_ft() > 0.0 && self.scale_length_ft().is_finite()) {
            return Err("`length_ft` must be positive".into());
        }
        Ok(())
    }

    /// Draws the gusts along a path from the stationary distribution.
    #[must_use]
    pub fn gusts(&self, path: &GustPath, seed: u64) -> Vec<Gust> {
        let filters = self.filters(path.speed_ft_s, path.span_ft);
        let draw = |filter: &ShapingFilter, name: &str| {
            filter.draw(path.step_s, path.count, &mut RandomStream::new(seed, name))
        };
        let along = draw(&filters.along, "gust along");
        let across = draw(&filters.across, "gust across");
        let down = draw(&filters.down, "gust down");
        let roll = draw(&filters.roll, "gust roll");
        (0..path.count)
            .map(|k| Gust {
                velocity: Vector3::new(along[k][0], across[k][0], down[k][0]),
                rates: Vector3::new(roll[k][0], down[k][1], across[k][1]),
            })
            .collect()
    }

    fn filters(&self, speed_ft_s: f64, span_ft: f64) -> GustFilters {
        let (sigma, length) = (self.sigma_ft_s, self.scale_length_ft());
        let time_s = length / speed_ft_s;
        let along = self.model.along();
        let across = self.model.across();
        let across = ShapingFilter::rational(sigma * time_s.sqrt(), time_s, across.0, across.1);
        let wing_s = 4.0 * span_ft / (PI * speed_ft_s);
        let roll_gain =
            sigma * (0.8 * PI / speed_ft_s).sqrt() * (PI / (4.0 * span_ft)).powf(1.0 / 6.0)
                / length.cbrt();
        GustFilters {
            along: ShapingFilter::rational(sigma * (2.0 * time_s).sqrt(), time_s, along.0, along.1),
            down: across.clone().with_lagged_rate(-1.0 / speed_ft_s, wing_s),
            across: across.with_lagged_rate(1.0 / speed_ft_s, 0.75 * wing_s),
            roll: ShapingFilter::rational(roll_gain, wing_s, &[1.0], &[1.0, 1.0]),
        }
    }
}

/// Numerator and denominator of a filter, in rising powers of Ts.
type Polynomials = (&'static [f64], &'static [f64]);

impl TurbulenceModel {
    /// Filter of u over σ√(2T).
    fn along(self) -> Polynomials {
        match self {
            TurbulenceModel::Dryden => (&[1.0], &[1.0, 1.0]),
            TurbulenceModel::VonKarman => (&[1.0, 0.25], &[1.0, 1.357, 0.1987]),
        }
    }

    /// Filter of v and w over σ√T.
    fn across(self) -> Polynomials {
        match self {
            TurbulenceModel::Dryden => (&[1.0, ROOT_3], &[1.0, 2.0, 1.0]),
            TurbulenceModel::VonKarman => (&[1.0, 2.7478, 0.3398], &[1.0, 2.9958, 1.9754, 0.1539]),
        }
    }
}

/// √3.
const ROOT_3: f64 = 1.732_050_807_568_877_2;

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    const SPEED: f64 = 500.0;
    const SPAN: f64 = 37.4;
    const LENGTH: f64 = 700.0;
    const SIGMA: f64 = 5.0;

    fn turbulence(model: TurbulenceModel) -> Turbulence {
        Turbulence {
            model,
            sigma_ft_s: SIGMA,
            length_ft: Some(LENGTH),
        }
    }

    /// Spectra of u and of v and w over the spatial frequency Ω, rad/ft, one-sided: ∫₀^∞ Φ dΩ = σ².
    fn spectra(model: TurbulenceModel, frequency: f64) -> (f64, f64) {
        let size = SIGMA * SIGMA * LENGTH / PI;
        match model {
            TurbulenceModel::Dryden => {
                let x2 = (LENGTH * frequency).powi(2);
                (
                    2.0 * size / (1.0 + x2),
                    size * (1.0 + 3.0 * x2) / (1.0 + x2).powi(2),
                )
            }
            TurbulenceModel::VonKarman => {
                let x2 = (1.339 * LENGTH * frequency).powi(2);
                (
                    2.0 * size / (1.0 + x2).powf(5.0 / 6.0),
                    size * (1.0 + 8.0 / 3.0 * x2) / (1.0 + x2).powf(11.0 / 6.0),
                )
            }
        }
    }

    /// Correlations of u and of v and w over a distance.
    fn correlations(model: TurbulenceModel, distance_ft: f64) -> (f64, f64) {
        let r = distance_ft / LENGTH;
        match model {
            TurbulenceModel::Dryden => ((-r).exp(), (-r).exp() * (1.0 - r / 2.0)),
            TurbulenceModel::VonKarman => {
                let x = r / 1.339;
                let size = 2.0_f64.powf(2.0 / 3.0) / GAMMA_THIRD * x.cbrt();
                let along = size * bessel_k(1.0 / 3.0, x);
                (along, along - size * 0.5 * x * bessel_k(2.0 / 3.0, x))
            }
        }
    }

    /// Γ(⅓).
    const GAMMA_THIRD: f64 = 2.678_938_534_707_747_6;

    /// Modified Bessel function of the second kind: ∫₀^∞ e^(−x cosh t) cosh νt dt.
    fn bessel_k(order: f64, x: f64) -> f64 {
        let step = 1e-3;
        let value = |k: u32| {
            let t = step * f64::from(k);
            (-x * t.cosh()).exp() * (order * t).cosh()
        };
        step * (0.5 * value(0) + (1..20_000).map(value).sum::<f64>())
    }

    const MODELS: [TurbulenceModel; 2] = [TurbulenceModel::Dryden, TurbulenceModel::VonKarman];

    #[test]
    fn filters_have_the_spectra_of_the_specifications() {
        for model in MODELS {
            let filters = turbulence(model).filters(SPEED, SPAN);
            // The rational filters of von Kármán are fitted to 3 % up to ten scale lengths.
            let tolerance = if model == TurbulenceModel::Dryden {
                1e-9
            } else {
                0.035
            };
            for waves in [0.05, 0.5, 2.0, 10.0] {
                let frequency = waves / LENGTH;
                let (along, across) = spectra(model, frequency);
                // Of unit white noise, |H|² is π times the spectrum over Ω, and dω = V dΩ.
                let gain = |filter: &ShapingFilter, output: usize| {
                    filter.squared_gain(output, SPEED * frequency) * SPEED / PI
                };
                assert_relative_eq!(gain(&filters.along, 0), along, max_relative = tolerance);
                assert_relative_eq!(gain(&filters.down, 0), across, max_relative = tolerance);
                let pitch =
                    frequency.powi(2) * across / (1.0 + (4.0 * SPAN / PI * frequency).powi(2));
                let yaw =
                    frequency.powi(2) * across / (1.0 + (3.0 * SPAN / PI * frequency).powi(2));
                let roll = SIGMA.powi(2) / LENGTH * 0.8 * (PI * LENGTH / (4.0 * SPAN)).cbrt()
                    / (1.0 + (4.0 * SPAN / PI * frequency).powi(2));
                assert_relative_eq!(gain(&filters.down, 1), pitch, max_relative = tolerance);
                assert_relative_eq!(gain(&filters.across, 1), yaw, max_relative = tolerance);
                assert_relative_eq!(gain(&filters.roll, 0), roll, max_relative = 1e-9);
            }
        }
    }

    #[test]
    fn gusts_have_the_variance_and_correlation_of_the_closed_forms() {
        for model in MODELS {
            let filters = turbulence(model).filters(SPEED, SPAN);
            // The rational filters lose variance at distances far below a tenth of the scale length.
            let (lost, error) = match model {
                TurbulenceModel::Dryden => (1e-9, 1e-9),
                TurbulenceModel::VonKarman => (0.04, 0.01),
            };
            let step_s = 0.0125;
            for filter in [&filters.along, &filters.across, &filters.down] {
                let variance = filter.covariance(0, step_s, 0);
                assert_relative_eq!(variance, SIGMA.powi(2), max_relative = lost);
            }
            for lag in [10, 50, 100, 200] {
                let (along, across) = correlations(model, SPEED * step_s * f64::from(lag));
                for (filter, expected) in [
                    (&filters.along, along),
                    (&filters.across, across),
                    (&filters.down, across),
                ] {
                    let correlation = filter.covariance(0, step_s, lag) / SIGMA.powi(2);
                    assert_abs_diff_eq!(correlation, expected, epsilon = error);
                }
            }
        }
    }

    /// Path at the speed and span of these tests.
    fn path(step_s: f64, count: usize) -> GustPath {
        GustPath {
            speed_ft_s: SPEED,
            span_ft: SPAN,
            step_s,
            count,
        }
    }

    #[test]
    fn drawn_gusts_have_the_variance_and_correlation_of_their_filters() {
        let model = turbulence(TurbulenceModel::VonKarman);
        let filters = model.filters(SPEED, SPAN);
        for (step_s, lag) in [(0.1_f64, 8_u32), (0.2, 4)] {
            let gusts = model.gusts(&path(step_s, 60_000), 3);
            for (axis, filter) in [
                (0, &filters.along),
                (1, &filters.across),
                (2, &filters.down),
            ] {
                let values: Vec<f64> = gusts.iter().map(|g| g.velocity[axis]).collect();
                let (variance, correlation) = statistics(&values, lag as usize);
                let expected = filter.covariance(0, step_s, 0);
                assert_relative_eq!(variance, expected, max_relative = 0.08);
                let expected = filter.covariance(0, step_s, lag) / expected;
                assert_abs_diff_eq!(correlation, expected, epsilon = 0.03);
            }
        }
    }

    /// Variance, and correlation at a lag.
    fn statistics(values: &[f64], lag: usize) -> (f64, f64) {
        let product = |lag: usize| {
            let pairs = values.iter().zip(&values[lag..]);
            pairs.map(|(a, b)| a * b).sum::<f64>() / (values.len() - lag) as f64
        };
        (product(0), product(lag) / product(0))
    }

    #[test]
    fn the_air_turns_as_the_gusts_change_along_the_path() {
        // A downdraught that grows ahead pitches the air about the c.g. nose down: q_g = −ẇ/V.
        // Yawing, r_g = v̇/V. The roll rate is independent.
        let gusts = turbulence(TurbulenceModel::Dryden).gusts(&path(0.01, 100_000), 8);
        let mut sums = [0.0; 4];
        for pair in gusts.windows(2) {
            let rate = (pair[1].velocity - pair[0].velocity) / 0.01;
            let turn = (pair[0].rates + pair[1].rates) * 0.5;
            sums[0] += -rate.z / SPEED * turn.y;
            sums[1] += turn.y * turn.y;
            sums[2] += rate.y / SPEED * turn.z;
            sums[3] += turn.z * turn.z;
        }
        // The lag of the turn leaves its projection on the gusts' own rate at one.
        assert_relative_eq!(sums[0] / sums[1], 1.0, max_relative = 0.05);
        assert_relative_eq!(sums[2] / sums[3], 1.0, max_relative = 0.05);
        // ∫₀^∞ Φ_p dΩ.
        let variance =
            SIGMA.powi(2) / LENGTH * 0.8 * (PI * LENGTH / (4.0 * SPAN)).cbrt() * PI.powi(2)
                / (8.0 * SPAN);
        let rolls: Vec<f64> = gusts.iter().map(|g| g.rates.x).collect();
        assert_relative_eq!(statistics(&rolls, 0).0, variance, max_relative = 0.05);
    }

    #[test]
    fn the_same_seed_gives_the_same_gusts() {
        let draw = |seed| turbulence(TurbulenceModel::VonKarman).gusts(&path(0.0125, 50), seed);
        assert_eq!(draw(1), draw(1));
        assert_ne!(draw(1), draw(2));
    }
}
