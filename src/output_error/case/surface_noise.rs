//! White noise of the measured surfaces, and the coefficients that it acts on.

use pulp::Arch;

use super::regressors::surface_factor;
use crate::aero::{Derivative, Regressor};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::Window;
use crate::flight::signal;

/// A surface with noise: how much, and what it acts on.
#[derive(Clone, Debug, PartialEq)]
pub struct NoisySurface {
    pub(crate) variance: f64,
    pub(crate) effects: Vec<Effect>,
}

/// One derivative along the surface.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Effect {
    pub coefficient: usize,
    pub value: Value,
    /// Coefficient per deflection and unit of the derivative, sample by sample; one throughout
    /// where empty.
    pub factors: Vec<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Value {
    /// A parameter.
    Free(usize),
    Held(f64),
}

/// Surfaces of a window that have noise. `free` are the derivatives in the order of the case's
/// parameters.
#[must_use]
pub fn noisy_surfaces(
    aircraft: &Aircraft,
    window: &Window,
    free: &[&Derivative],
    held: &[(&Derivative, f64)],
) -> Vec<NoisySurface> {
    let qbar = window.signal(signal::QBAR);
    let free = free.iter().enumerate().map(|(j, d)| (*d, Value::Free(j)));
    let all: Vec<(&Derivative, Value)> = free
        .chain(held.iter().map(|(d, v)| (*d, Value::Held(*v))))
        .collect();
    let mut names: Vec<&str> = all
        .iter()
        .filter_map(|(d, _)| d.regressor.surface())
        .collect();
    names.sort_unstable();
    names.dedup();
    let surface = |name: &&str| {
        let samples: Vec<f64> = window
            .signal(name)
            .chunks(2)
            .map(|points| points[0])
            .collect();
        let variance = white_variance(&samples);
        let acting = all
            .iter()
            .filter(|(d, _)| d.regressor.surface() == Some(name));
        let effect = |(d, value): &(&Derivative, Value)| Effect {
            coefficient: d.coefficient.index(),
            value: *value,
            factors: match d.regressor {
                Regressor::Vane(_) => {
                    let times_qbar = surface_factor(aircraft, 1.0, d);
                    qbar.chunks(2).map(|qbar| times_qbar / qbar[0]).collect()
                }
                _ => vec![],
            },
        };
        (variance > 0.0).then(|| NoisySurface {
            variance,
            effects: acting.map(effect).collect(),
        })
    };
    names.iter().filter_map(surface).collect()
}

/// Variance of the white noise on a signal that is otherwise smooth but for few steps: of third
/// differences, which have 1 + 9 + 9 + 1 times that of the noise, the median size decides.
#[must_use]
pub fn white_variance(samples: &[f64]) -> f64 {
    const MEDIAN_OF_NORMAL: f64 = 0.674_49;
    // Sizes are in the order of their bits, which are compared faster; what is no number comes
    // last.
    let size = |u: &[f64]| (u[3] - 3.0 * u[2] + 3.0 * u[1] - u[0]).abs().to_bits();
    let mut sizes: Vec<u64> = Arch::new().dispatch(|| samples.windows(4).map(size).collect());
    let finite = sizes
        .iter()
        .filter(|size| **size < f64::INFINITY.to_bits())
        .count();
    let median = if finite == 0 {
        0.0
    } else {
        f64::from_bits(*sizes.select_nth_unstable(finite / 2).1)
    };
    (median / MEDIAN_OF_NORMAL).powi(2) / 20.0
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::output_error::tests::Noise;

    #[test]
    fn white_noise_is_told_from_doublets_and_feedback() {
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
