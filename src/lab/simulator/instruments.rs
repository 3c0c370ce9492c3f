//! Instruments: what a recorder makes of an exact signal: lag, scale, bias, noise white and
//! coloured, steps of the converter, spikes, dropouts.
//!
//! y = (1 + s) x(lagged) + b + w + c, rounded to the quantum; c is a first-order Gauss-Markov
//! process, `c_{k+1}` = e^(−Δt/τ) `c_k` + σ√(1 − e^(−2Δt/τ)) `n_k`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::noise::Noise;
use crate::flight::record::Series;
use crate::flight::{Mark, Record};

/// What one signal's instrument does, in the signal's unit. All zero is a perfect instrument.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Instrument {
    /// Standard deviation of white noise.
    pub noise: f64,
    /// Standard deviation and time constant of coloured noise.
    pub coloured: f64,
    pub coloured_time_s: f64,
    pub bias: f64,
    /// Standard deviation from which each flight's further bias is drawn.
    pub bias_spread: f64,
    /// Relative error of scale: the signal is read 1 + this times.
    pub scale: f64,
    pub scale_spread: f64,
    /// Time constant of a first-order lag.
    pub lag_s: f64,
    /// Step of the converter.
    pub quantum: f64,
    /// Dropouts and spikes per second.
    pub dropouts_per_s: f64,
    pub dropout_s: f64,
    pub spikes_per_s: f64,
    pub spike: f64,
}

/// Signal → its instrument; a signal without one is recorded as it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Instruments(pub BTreeMap<String, Instrument>);

impl Instruments {
    /// The instruments of one flight: biases and scales drawn from their spreads, which are zero
    /// then.
    #[must_use]
    pub fn drawn(&self, seed: u64) -> Instruments {
        let draw = |(signal, i): (&String, &Instrument)| {
            let mut noise = Noise::new(seed, &format!("instrument of {signal}"));
            let bias = i.bias + i.bias_spread * noise.normal();
            let scale = i.scale + i.scale_spread * noise.normal();
            (
                signal.clone(),
                Instrument {
                    bias,
                    bias_spread: 0.0,
                    scale,
                    scale_spread: 0.0,
                    ..*i
                },
            )
        };
        Instruments(self.0.iter().map(draw).collect())
    }

    /// The record that these instruments make of an exact one.
    #[must_use]
    pub fn read(&self, exact: &Record, seed: u64) -> Record {
        let drawn = self.drawn(seed);
        let read = |(name, series): (&String, &Series)| {
            let series = match drawn.0.get(name) {
                Some(instrument) => {
                    instrument.read(&series.values, exact.step_s, &mut Noise::new(seed, name))
                }
                None => series.clone(),
            };
            (name.clone(), series)
        };
        Record {
            signals: exact.signals.iter().map(read).collect(),
            ..exact.clone()
        }
    }
}

impl Instrument {
    fn read(&self, exact: &[f64], step_s: f64, noise: &mut Noise) -> Series {
        let lag = if self.lag_s > 0.0 {
            (-step_s / self.lag_s).exp()
        } else {
            0.0
        };
        let keep = if self.coloured_time_s > 0.0 {
            (-step_s / self.coloured_time_s).exp()
        } else {
            0.0
        };
        let fresh = (1.0 - keep * keep).sqrt();
        let mut lagged = exact.first().copied().unwrap_or(0.0);
        let mut colour = noise.normal();
        let mut before = lagged;
        let mut values = Vec::with_capacity(exact.len());
        for &x in exact {
            // The exact answer of a lag to a signal that is linear between samples.
            let ramp = if lag > 0.0 {
                self.lag_s / step_s * (1.0 - lag)
            } else {
                1.0
            };
            lagged = lag * lagged + (ramp - lag) * before + (1.0 - ramp) * x;
            if lag == 0.0 {
                lagged = x;
            }
            before = x;
            let value = (1.0 + self.scale) * lagged
                + self.bias
                + self.noise * noise.normal()
                + self.coloured * colour;
            colour = keep * colour + fresh * noise.normal();
            values.push(if self.quantum > 0.0 {
                (value / self.quantum).round() * self.quantum
            } else {
                value
            });
        }
        self.spoil(values, step_s, noise)
    }

    /// Adds spikes and dropouts; a sample in a dropout is missing.
    fn spoil(&self, mut values: Vec<f64>, step_s: f64, noise: &mut Noise) -> Series {
        let mut marks = vec![Mark::Measured; values.len()];
        let mut lost = 0.0;
        for (value, mark) in values.iter_mut().zip(&mut marks) {
            if self.spikes_per_s > 0.0 && noise.uniform() < self.spikes_per_s * step_s {
                *value += if noise.uniform() < 0.5 {
                    self.spike
                } else {
                    -self.spike
                };
            }
            if self.dropouts_per_s > 0.0 && noise.uniform() < self.dropouts_per_s * step_s {
                lost = self.dropout_s.max(step_s);
            }
            if lost > 0.5 * step_s {
                *value = f64::NAN;
                *mark = Mark::Missing;
                lost -= step_s;
            }
        }
        Series { values, marks }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    fn read(instrument: Instrument, exact: &[f64]) -> Series {
        instrument.read(exact, 0.025, &mut Noise::new(11, "q_deg_s"))
    }

    fn mean(values: &[f64]) -> f64 {
        values.iter().sum::<f64>() / values.len() as f64
    }

    /// Covariance of a series with itself at a lag, about its mean.
    fn covariance(values: &[f64], lag: usize) -> f64 {
        let m = mean(values);
        mean(
            &values
                .iter()
                .zip(&values[lag..])
                .map(|(a, b)| (a - m) * (b - m))
                .collect::<Vec<_>>(),
        )
    }

    #[test]
    fn white_noise_bias_and_scale_have_their_sizes() {
        let values = read(
            Instrument {
                noise: 0.2,
                bias: 0.5,
                scale: 0.1,
                ..Instrument::default()
            },
            &vec![3.0; 40_000],
        )
        .values;
        assert_abs_diff_eq!(mean(&values), 3.8, epsilon = 0.005);
        assert_relative_eq!(covariance(&values, 0), 0.04, max_relative = 0.03);
        assert_abs_diff_eq!(covariance(&values, 1), 0.0, epsilon = 0.001);
    }

    #[test]
    fn coloured_noise_decays_with_its_time_constant() {
        let instrument = Instrument {
            coloured: 0.3,
            coloured_time_s: 0.25,
            ..Instrument::default()
        };
        let values = read(instrument, &vec![0.0; 200_000]).values;
        assert_relative_eq!(covariance(&values, 0), 0.09, max_relative = 0.04);
        assert_relative_eq!(
            covariance(&values, 10) / covariance(&values, 0),
            (-1.0_f64).exp(),
            max_relative = 0.05
        );
    }

    #[test]
    fn a_quantum_leaves_its_multiples_and_an_error_under_half_of_it() {
        let exact: Vec<f64> = (0..1000).map(|k| 0.0137 * f64::from(k)).collect();
        let values = read(
            Instrument {
                quantum: 0.1,
                ..Instrument::default()
            },
            &exact,
        )
        .values;
        for (value, x) in values.iter().zip(&exact) {
            assert!((value - x).abs() <= 0.05 + 1e-12);
            assert_abs_diff_eq!((value / 0.1).round() * 0.1, *value, epsilon = 1e-12);
        }
    }

    #[test]
    fn a_lag_follows_a_ramp_by_its_time_constant() {
        let exact: Vec<f64> = (0..400).map(|k| 0.025 * f64::from(k)).collect();
        let values = read(
            Instrument {
                lag_s: 0.1,
                ..Instrument::default()
            },
            &exact,
        )
        .values;
        assert_abs_diff_eq!(exact[399] - values[399], 0.1, epsilon = 1e-9);
    }

    #[test]
    fn dropouts_are_missing_and_as_many_as_said() {
        let instrument = Instrument {
            dropouts_per_s: 0.2,
            dropout_s: 0.1,
            ..Instrument::default()
        };
        let series = read(instrument, &vec![1.0; 40_000]);
        let lost = series.values.iter().filter(|v| v.is_nan()).count();
        // 200 dropouts of 4 samples in 1000 s, a few of them overlapping.
        assert!((650..950).contains(&lost), "{lost}");
        assert_eq!(
            lost,
            series.marks.iter().filter(|m| **m == Mark::Missing).count()
        );
    }

    #[test]
    fn perfect_instruments_change_nothing() {
        let exact: Vec<f64> = (0..50).map(|k| f64::from(k).sin()).collect();
        assert_eq!(read(Instrument::default(), &exact).values, exact);
    }
}
