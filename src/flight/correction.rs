//! Correction of a signal for the error of its instrument, applied when the record is read.

use serde::{Deserialize, Serialize};

use super::interpolation_kernel::InterpolationKernel;
use super::record::{Mark, Record, Series};
use super::remaining_errors::RemainingErrors;

/// Error of an instrument: it reads `(1 + scale) truth(t − delay) + bias`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Correction {
    pub signal: String,
    /// In the signal's unit.
    pub bias: f64,
    pub scale: f64,
    pub delay_s: f64,
    /// Errors of the signal after the correction.
    pub remaining: RemainingErrors,
}

/// Samples beyond a delay that the interpolation kernel reaches.
const KERNEL_REACH: usize = 2;

impl Correction {
    /// Samples on either side of a sample that its corrected value depends on.
    #[must_use]
    pub fn reach(&self, step_s: f64) -> usize {
        if self.delay_s == 0.0 {
            return 0;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a length of time, not negative"
        )]
        let delay = (self.delay_s.abs() / step_s).ceil() as usize;
        delay + KERNEL_REACH
    }

    /// A delay alone.
    #[must_use]
    pub fn of_delay(signal: &str, delay_s: f64) -> Correction {
        Correction {
            signal: signal.to_owned(),
            bias: 0.0,
            scale: 0.0,
            delay_s,
            remaining: RemainingErrors::default(),
        }
    }

    /// `false` if only the remaining errors are known.
    #[must_use]
    pub fn changes_values(&self) -> bool {
        (self.bias, self.scale, self.delay_s) != (0.0, 0.0, 0.0)
    }

    /// Corrects the signal, where the record has it, and notes its remaining errors.
    pub fn apply(&self, record: &mut Record) {
        if self.remaining != RemainingErrors::default() {
            let own = (self.signal.clone(), self.remaining);
            record.remaining_errors.extend([own]);
        }
        if !self.changes_values() {
            return;
        }
        let delay = self.delay_s / record.step_s;
        if let Some(series) = record.signals.get_mut(&self.signal) {
            if delay == 0.0 {
                self.correct_in_place(series);
            } else {
                *series = self.corrected(series, delay);
            }
        }
    }

    /// Corrects bias and scale, sample by sample.
    fn correct_in_place(&self, series: &mut Series) {
        for (value, mark) in series.values.iter_mut().zip(&mut series.marks) {
            *value = self.truth(*value);
            if !value.is_finite() {
                *mark = Mark::Missing;
            }
        }
    }

    /// Corrects values that lie `step_s` apart.
    #[must_use]
    pub fn of_values(&self, values: &[f64], step_s: f64) -> Vec<f64> {
        let kernel = InterpolationKernel::at(self.delay_s / step_s);
        (0..values.len())
            .map(|k| self.value(&kernel, values, k))
            .collect()
    }

    /// `(y(t + delay) − bias) / (1 + scale)`, the delay in samples. A corrected sample gets the
    /// worst flag of the samples that it depends on.
    fn corrected(&self, old: &Series, delay: f64) -> Series {
        let kernel = InterpolationKernel::at(delay);
        let values: Vec<f64> = (0..old.values.len())
            .map(|k| self.value(&kernel, &old.values, k))
            .collect();
        let mark = |(k, value): (usize, &f64)| {
            if value.is_finite() {
                worst_mark(&kernel, &old.marks, k)
            } else {
                Mark::Missing
            }
        };
        let marks = values.iter().enumerate().map(mark).collect();
        Series { values, marks }
    }

    fn value(&self, kernel: &InterpolationKernel, values: &[f64], k: usize) -> f64 {
        let reading = weighted_samples(kernel, k, values.len())
            .map(|(sample, weight)| weight * values[sample])
            .sum();
        self.truth(reading)
    }

    /// Corrects a reading for bias and scale error.
    fn truth(&self, reading: f64) -> f64 {
        (reading - self.bias) / (1.0 + self.scale)
    }
}

/// Samples with a weight other than zero: a missing sample without weight must not spoil a value.
fn weighted_samples(
    kernel: &InterpolationKernel,
    k: usize,
    samples: usize,
) -> impl Iterator<Item = (usize, f64)> {
    kernel
        .weights_at(k, samples)
        .filter(|(_, weight, _)| *weight != 0.0)
        .map(|(sample, weight, _)| (sample, weight))
}

/// The worst flag of the samples that a value depends on; any fault is worse than no fault.
fn worst_mark(kernel: &InterpolationKernel, marks: &[Mark], k: usize) -> Mark {
    weighted_samples(kernel, k, marks.len())
        .map(|(sample, _)| marks[sample])
        .max_by_key(|mark| (mark.is_fault(), *mark as u8))
        .unwrap_or(Mark::Measured)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_moves_with_its_sample_and_a_fault_outweighs_none() {
        let marks = [
            Mark::Measured,
            Mark::Between,
            Mark::Bridged,
            Mark::Measured,
            Mark::Measured,
            Mark::Measured,
        ];
        let old = Series {
            values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
            marks: marks.to_vec(),
        };
        let late = |delay_s| Correction {
            bias: 1.0,
            scale: 1.0,
            ..Correction::of_delay("", delay_s)
        };
        let whole = late(1.0).corrected(&old, 1.0);
        assert_eq!(whole.values[..5], [0.5, 1.0, 1.5, 2.0, 2.5]);
        assert_eq!(
            whole.marks[..3],
            [Mark::Between, Mark::Bridged, Mark::Measured]
        );
        assert_eq!(late(0.5).corrected(&old, 0.5).marks[0], Mark::Bridged);
        assert_eq!(
            late(0.0).of_values(&old.values, 1.0),
            [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]
        );
        assert_eq!((late(0.0).reach(0.025), late(-0.1).reach(0.025)), (0, 6));
    }
}
