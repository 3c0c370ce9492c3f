//! Instruments: delay, lag, scale factor, bias, white and coloured noise, quantisation, spikes and dropouts
//! of a recorded signal.
//!
//! y = (1 + s) x(delayed and lagged) + b + w + c, rounded to the quantum; c is a first-order Gauss-Markov
//! process, `c_{k+1}` = e^(−Δt/τ) `c_k` + σ√(1 − e^(−2Δt/τ)) `n_k`.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::flight::record::Series;
use crate::flight::{Correction, Mark, Record};
use crate::numerics::statistics::random::RandomStream;

/// Errors of one signal's instrument, in the signal's unit. All zero: a perfect instrument.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Instrument {
    /// Standard deviation of white noise.
    pub noise: f64,
    /// Standard deviation of coloured noise.
    pub coloured: f64,
    /// Time constant of coloured noise.
    pub coloured_time_s: f64,
    pub bias: f64,
    /// Standard deviation of the further bias drawn for each flight.
    pub bias_spread: f64,
    /// Scale factor error: the reading is 1 + `scale` times the signal.
    pub scale: f64,
    /// Standard deviation of the further scale factor error drawn for each flight.
    pub scale_spread: f64,
    /// Delay of the recorder; negative: ahead of the other signals.
    pub delay_s: f64,
    /// Time constant of a first-order lag.
    pub lag_s: f64,
    /// Quantisation step.
    pub quantum: f64,
    /// Mean number of dropouts per second.
    pub dropouts_per_s: f64,
    pub dropout_s: f64,
    /// Mean number of spikes per second.
    pub spikes_per_s: f64,
    /// Size of a spike.
    pub spike: f64,
}

/// Instruments by signal; a signal without an instrument is recorded exactly.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Instruments(pub BTreeMap<String, Instrument>);

impl Instruments {
    /// Draws the biases and scale factors of one flight; the spreads of the result are zero.
    #[must_use]
    pub fn drawn(&self, seed: u64) -> Instruments {
        let draw = |(signal, i): (&String, &Instrument)| {
            let mut random = RandomStream::new(seed, &format!("instrument of {signal}"));
            let bias = i.bias + i.bias_spread * random.normal();
            let scale = i.scale + i.scale_spread * random.normal();
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

    /// Instruments of a recorder that records these signals late by a further delay.
    #[must_use]
    pub fn late<'a>(
        mut self,
        signals: impl IntoIterator<Item = &'a String>,
        delay_s: f64,
    ) -> Instruments {
        if delay_s != 0.0 {
            for signal in signals {
                self.0.entry(signal.clone()).or_default().delay_s += delay_s;
            }
        }
        self
    }

    /// Record as these instruments read it, from the record of perfect ones.
    #[must_use]
    pub fn record(&self, exact: &Record, seed: u64) -> Record {
        let drawn = self.drawn(seed);
        let recorded = |(name, series): (&String, &Series)| {
            let series = match drawn.0.get(name) {
                Some(instrument) => {
                    let mut random = RandomStream::new(seed, name);
                    instrument.record(&series.values, exact.step_s, &mut random)
                }
                None => series.clone(),
            };
            (name.clone(), series)
        };
        Record {
            signals: exact.signals.iter().map(recorded).collect(),
            ..exact.clone()
        }
    }
}

impl Instrument {
    fn record(&self, exact: &[f64], step_s: f64, random: &mut RandomStream) -> Series {
        let exact = &*self.delayed(exact, step_s);
        let lag = if self.lag_s > 0.0 {
            (-step_s / self.lag_s).exp()
        } else {
            0.0
        };
        let decay = if self.coloured_time_s > 0.0 {
            (-step_s / self.coloured_time_s).exp()
        } else {
            0.0
        };
        let innovation = (1.0 - decay * decay).sqrt();
        let mut lagged = exact.first().copied().unwrap_or(0.0);
        let mut colour = random.normal();
        let mut before = lagged;
        let mut values = Vec::with_capacity(exact.len());
        for &x in exact {
            // Exact response of a lag to a signal that is linear between samples.
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
                + self.noise * random.normal()
                + self.coloured * colour;
            colour = decay * colour + innovation * random.normal();
            values.push(if self.quantum > 0.0 {
                (value / self.quantum).round() * self.quantum
            } else {
                value
            });
        }
        self.with_spikes_and_dropouts(values, step_s, random)
    }

    /// Signal delayed by the instrument.
    fn delayed<'a>(&self, exact: &'a [f64], step_s: f64) -> Cow<'a, [f64]> {
        if self.delay_s == 0.0 {
            return exact.into();
        }
        let ahead = Correction::of_delay("", -self.delay_s);
        ahead.of_values(exact, step_s).into()
    }

    /// Adds spikes and dropouts; samples in a dropout are missing.
    fn with_spikes_and_dropouts(
        &self,
        mut values: Vec<f64>,
        step_s: f64,
        random: &mut RandomStream,
    ) -> Series {
        let mut marks = vec![Mark::Measured; values.len()];
        let mut dropout_left_s = 0.0;
        for (value, mark) in values.iter_mut().zip(&mut marks) {
            if self.spikes_per_s > 0.0 && random.uniform() < self.spikes_per_s * step_s {
                *value += if random.uniform() < 0.5 {
                    self.spike
                } else {
                    -self.spike
                };
            }
            if self.dropouts_per_s > 0.0 && random.uniform() < self.dropouts_per_s * step_s {
                dropout_left_s = self.dropout_s.max(step_s);
            }
            if dropout_left_s > 0.5 * step_s {
                *value = f64::NAN;
                *mark = Mark::Missing;
                dropout_left_s -= step_s;
            }
        }
        Series { values, marks }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    fn record(instrument: Instrument, exact: &[f64]) -> Series {
        instrument.record(exact, 0.025, &mut RandomStream::new(11, "q_deg_s"))
    }

    fn mean(values: &[f64]) -> f64 {
        values.iter().sum::<f64>() / values.len() as f64
    }

    /// Autocovariance of a series at a lag.
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
        let values = record(
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
        let values = record(instrument, &vec![0.0; 200_000]).values;
        assert_relative_eq!(covariance(&values, 0), 0.09, max_relative = 0.04);
        assert_relative_eq!(
            covariance(&values, 10) / covariance(&values, 0),
            (-1.0_f64).exp(),
            max_relative = 0.05
        );
    }

    #[test]
    fn quantised_values_are_multiples_within_half_a_step() {
        let exact: Vec<f64> = (0..1000).map(|k| 0.0137 * f64::from(k)).collect();
        let values = record(
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
        let values = record(
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
    fn a_delayed_sine_is_the_sine_of_an_earlier_time() {
        let sine = |t: f64| (2.0 * t).sin();
        let time_s = |k: u32| 0.025 * f64::from(k);
        let exact: Vec<f64> = (0..400).map(|k| sine(time_s(k))).collect();
        let instrument = Instrument {
            delay_s: 0.01,
            ..Instrument::default()
        };
        let values = record(instrument, &exact).values;
        for k in 2..398 {
            let found = values[usize::try_from(k).unwrap()];
            assert_abs_diff_eq!(found, sine(time_s(k) - 0.01), epsilon = 1e-5);
        }
    }

    #[test]
    fn dropouts_have_their_rate_and_are_missing_samples() {
        let instrument = Instrument {
            dropouts_per_s: 0.2,
            dropout_s: 0.1,
            ..Instrument::default()
        };
        let series = record(instrument, &vec![1.0; 40_000]);
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
        assert_eq!(record(Instrument::default(), &exact).values, exact);
    }
}
