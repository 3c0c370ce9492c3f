//! White noise of the measured surfaces, and the coefficients that it reaches.

use super::model::Model;
use crate::aero::{Derivative, Regressor};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::ManeuverSignals;
use crate::flight::signal;
use crate::numerics::series::differences;
use crate::numerics::statistics::order_statistics::upper_median_of_magnitudes;
use crate::numerics::vectors::simd::vectorised;

/// Surface with noise on its measured deflection.
#[derive(Clone, Debug, PartialEq)]
pub struct NoisySurface {
    pub(crate) variance: f64,
    pub(crate) effects: Vec<DeflectionEffect>,
}

/// Effect of a deflection through one derivative.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DeflectionEffect {
    pub coefficient: usize,
    pub value: DerivativeValue,
    /// Coefficient per deflection and unit of the derivative, sample by sample; one throughout
    /// where empty.
    pub factors: Vec<f64>,
}

/// Value of a derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum DerivativeValue {
    /// Index of a parameter.
    Free(usize),
    Held(f64),
}

/// Surfaces of a model that have noise in a maneuver.
#[must_use]
pub fn noisy_surfaces(
    aircraft: &Aircraft,
    signals: &ManeuverSignals,
    model: &Model,
) -> Vec<NoisySurface> {
    let free = model.free_in_order().into_iter().enumerate();
    let mut derivatives: Vec<(&Derivative, DerivativeValue)> =
        free.map(|(j, d)| (d, DerivativeValue::Free(j))).collect();
    let held = model.held.iter();
    derivatives.extend(held.map(|(d, v)| (*d, DerivativeValue::Held(*v))));
    let surfaces = derivatives
        .iter()
        .filter_map(|(d, _)| d.regressor.surface());
    let mut surfaces: Vec<&str> = surfaces.collect();
    surfaces.sort_unstable();
    surfaces.dedup();
    let mut noisy = Vec::new();
    for surface in surfaces {
        let variance = white_variance(&signals.samples_of(surface));
        if variance > 0.0 {
            let own = derivatives
                .iter()
                .filter(|(d, _)| d.regressor.surface() == Some(surface));
            let effects = own.map(|(d, value)| DeflectionEffect::new(aircraft, signals, d, *value));
            noisy.push(NoisySurface {
                variance,
                effects: effects.collect(),
            });
        }
    }
    noisy
}

impl DeflectionEffect {
    fn new(
        aircraft: &Aircraft,
        signals: &ManeuverSignals,
        derivative: &Derivative,
        value: DerivativeValue,
    ) -> DeflectionEffect {
        let factors = match derivative.regressor {
            Regressor::Vane(_) => {
                let times_qbar = derivative.coefficient_factor(aircraft, 1.0);
                let qbar = signals.samples_of(signal::QBAR);
                qbar.iter().map(|qbar| times_qbar / qbar).collect()
            }
            _ => vec![],
        };
        DeflectionEffect {
            coefficient: derivative.coefficient.index(),
            value,
            factors,
        }
    }
}

/// Variance of the white noise on a signal that is otherwise smooth except for a few steps.
///
/// The median size of third differences ignores the steps.
#[must_use]
pub fn white_variance(samples: &[f64]) -> f64 {
    let size = |u: &[f64; 4]| differences::third(u).abs().to_bits();
    let mut sizes: Vec<u64> = vectorised(
        #[inline(always)]
        || samples.array_windows().map(size).collect(),
    );
    let median = upper_median_of_magnitudes(&mut sizes).unwrap_or(0.0);
    differences::noise_of_third(median).powi(2)
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::output_error::tests::Noise;

    #[test]
    fn doublets_and_feedback_do_not_count_as_white_noise() {
        let mut noise = Noise(5);
        let values: Vec<f64> = (0..800)
            .map(|k| {
                3.0 * f64::from(k / 100 % 2) + (0.1 * f64::from(k)).sin() + 0.05 * noise.gaussian()
            })
            .collect();
        assert_relative_eq!(white_variance(&values).sqrt(), 0.05, max_relative = 0.1);
        let smooth: Vec<f64> = (0..800)
            .map(|k| 3.0 * f64::from(k / 100 % 2) + (0.1 * f64::from(k)).sin())
            .collect();
        assert!(white_variance(&smooth).sqrt() < 1e-3);
        assert!(white_variance(&[]) == 0.0 && white_variance(&[f64::NAN; 9]) == 0.0);
    }
}
