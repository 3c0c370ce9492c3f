//! What a signal is corrected by when its record is read.

use serde::{Deserialize, Serialize};

use super::record::{Mark, Record, Series};
use super::taps::Taps;

/// The error of an instrument: it reads `(1 + scale) truth(t − delay) + bias`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Correction {
    pub signal: String,
    /// In the signal's unit.
    pub bias: f64,
    pub scale: f64,
    pub delay_s: f64,
}

impl Correction {
    /// Samples on either side of a sample that its corrected value depends on.
    #[must_use]
    pub fn reach(&self, step_s: f64) -> usize {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a length of time, not negative"
        )]
        let delay = (self.delay_s.abs() / step_s).ceil() as usize;
        if self.delay_s == 0.0 { 0 } else { delay + 2 }
    }

    /// Corrects the signal, where the record has it.
    pub fn apply(&self, record: &mut Record) {
        let delay = self.delay_s / record.step_s;
        if let Some(series) = record.signals.get_mut(&self.signal) {
            if delay == 0.0 {
                self.correct_in_place(series);
            } else {
                *series = self.corrected(series, delay);
            }
        }
    }

    /// Without a delay every sample is its own.
    fn correct_in_place(&self, series: &mut Series) {
        for (value, mark) in series.values.iter_mut().zip(&mut series.marks) {
            *value = self.truth(*value);
            *mark = if value.is_finite() {
                *mark
            } else {
                Mark::Missing
            };
        }
    }

    /// Evenly spaced values corrected; they lie `step_s` apart.
    #[must_use]
    pub fn of_values(&self, values: &[f64], step_s: f64) -> Vec<f64> {
        let taps = Taps::at(self.delay_s / step_s);
        (0..values.len())
            .map(|k| self.value(&taps, values, k))
            .collect()
    }

    /// `(y(t + delay) − bias) / (1 + scale)`, the delay in samples; a mark travels with its sample,
    /// and a fault outweighs none.
    fn corrected(&self, old: &Series, delay: f64) -> Series {
        let (taps, count) = (Taps::at(delay), old.values.len());
        let mark = |k: usize, value: f64| {
            let weighty = taps.each(k, count).filter(|(_, weight, _)| *weight != 0.0);
            let worst = weighty
                .map(|(sample, ..)| old.marks[sample])
                .max_by_key(|m| (m.is_fault(), *m as u8));
            if value.is_finite() {
                worst.unwrap_or(Mark::Measured)
            } else {
                Mark::Missing
            }
        };
        let values: Vec<f64> = (0..count)
            .map(|k| self.value(&taps, &old.values, k))
            .collect();
        let marks = values
            .iter()
            .enumerate()
            .map(|(k, v)| mark(k, *v))
            .collect();
        Series { values, marks }
    }

    fn value(&self, taps: &Taps, values: &[f64], k: usize) -> f64 {
        let weighty = taps
            .each(k, values.len())
            .filter(|(_, weight, _)| *weight != 0.0);
        self.truth(
            weighty
                .map(|(sample, weight, _)| weight * values[sample])
                .sum(),
        )
    }

    /// What is true when the instrument reads this.
    fn truth(&self, reading: f64) -> f64 {
        (reading - self.bias) / (1.0 + self.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_travels_with_its_sample_and_a_fault_outweighs_none() {
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
            signal: String::new(),
            bias: 1.0,
            scale: 1.0,
            delay_s,
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
