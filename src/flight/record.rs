//! A record: the signals of one flight on one uniform clock, with a mark on each sample that is not
//! as the recorder wrote it.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::remaining_errors::RemainingErrors;
use crate::numerics::series::sample_count::nearest;

/// Repair or fault of one sample of one signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Mark {
    /// As recorded.
    Measured = 0,
    /// A short dropout or a lost frame, bridged by a straight line.
    Bridged = 1,
    /// A single-sample spike, replaced by the line between its neighbours.
    Despiked = 2,
    /// In a gap too long to bridge, or at an end: the value is NaN.
    Missing = 3,
    /// In an interval in which the channel is stuck: the value is NaN.
    Stuck = 4,
    /// Between two values of a channel that is recorded more slowly than the record: on the line
    /// through them.
    Between = 5,
    /// Constant or stand-in of a signal that is not recorded.
    Assumed = 6,
}

impl Mark {
    /// Repair or fault with this code; an unknown code counts as missing.
    #[must_use]
    pub fn from_u8(code: u8) -> Mark {
        match code {
            0 => Mark::Measured,
            1 => Mark::Bridged,
            2 => Mark::Despiked,
            4 => Mark::Stuck,
            5 => Mark::Between,
            6 => Mark::Assumed,
            _ => Mark::Missing,
        }
    }

    /// `true` if the sample was repaired or is missing. A sample between two values of a slow
    /// channel, or an assumed one, is no measurement and no fault.
    #[must_use]
    pub fn is_fault(self) -> bool {
        !matches!(self, Mark::Measured | Mark::Between | Mark::Assumed)
    }
}

/// One signal: values in the unit of its name, and the marks of its samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    pub values: Vec<f64>,
    pub marks: Vec<Mark>,
}

impl Series {
    /// Values of a signal that is not recorded.
    #[must_use]
    pub fn assumed(values: Vec<f64>) -> Series {
        let marks = vec![Mark::Assumed; values.len()];
        Series { values, marks }
    }

    /// `true` if no sample comes from the recorder.
    #[must_use]
    pub fn is_assumed(&self) -> bool {
        self.marks.first() == Some(&Mark::Assumed)
    }
}

/// Signals of one flight on one clock: sample `k` is at `start_s + k * step_s` of the record's
/// own time.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    pub flight_id: String,
    pub start_s: f64,
    pub step_s: f64,
    pub samples: usize,
    pub signals: BTreeMap<String, Series>,
    /// Errors of the signals that the flight itself determines, after their corrections.
    pub remaining_errors: BTreeMap<String, RemainingErrors>,
}

/// Least number of samples beyond either end of a part: as far as an interpolation reaches.
const MARGIN: usize = 10;

/// Shortest time beyond either end of a part: as far as a numerical slope reaches.
const MARGIN_S: f64 = 0.1;

/// Samples of a part from the first to the last, and those beyond its ends that its slopes and
/// interpolations need.
#[must_use]
pub fn with_margin(first: usize, last: usize, samples: usize, step_s: f64) -> Range<usize> {
    let margin = MARGIN.max(nearest(MARGIN_S / step_s));
    first.saturating_sub(margin)..(last + margin + 1).min(samples)
}

impl Record {
    /// Time of a sample, s.
    #[must_use]
    pub fn time_s(&self, sample: usize) -> f64 {
        let k = sample as f64;
        self.start_s + k * self.step_s
    }

    /// Sample nearest to a time, inside the record.
    #[must_use]
    pub fn sample_at(&self, time_s: f64) -> usize {
        let k = ((time_s - self.start_s) / self.step_s).round().max(0.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "rounded and not negative"
        )]
        let k = k as usize;
        k.min(self.samples.saturating_sub(1))
    }

    /// Values of a signal, where the record has it.
    #[must_use]
    pub fn values(&self, signal: &str) -> Option<&[f64]> {
        self.signals.get(signal).map(|s| s.values.as_slice())
    }

    /// `true` for a signal with samples from the recorder.
    #[must_use]
    pub fn is_recorded(&self, signal: &str) -> bool {
        self.signals.get(signal).is_some_and(|s| !s.is_assumed())
    }

    /// `true` for a constant, or for the stand-in of a signal that is not recorded.
    #[must_use]
    pub fn is_assumed(&self, signal: &str) -> bool {
        self.signals.get(signal).is_some_and(Series::is_assumed)
    }

    /// Share of samples with a fault among some signals from one time to another. A signal that the
    /// record does not have counts as missing throughout.
    #[must_use]
    pub fn marked_share<'a>(
        &self,
        signals: impl IntoIterator<Item = &'a str>,
        start_s: f64,
        end_s: f64,
    ) -> f64 {
        let (from, to) = (
            self.sample_at(start_s),
            (self.sample_at(end_s) + 1).min(self.samples),
        );
        let (mut faults, mut all) = (0_usize, 0_usize);
        for signal in signals {
            let length = to.saturating_sub(from);
            all += length;
            let marks = self.signals.get(signal).and_then(|s| s.marks.get(from..to));
            faults += marks.map_or(length, |marks| {
                marks.iter().filter(|m| m.is_fault()).count()
            });
        }
        faults as f64 / all.max(1) as f64
    }

    /// Copies a range of samples of some signals, or of all. Signals that the record does not have
    /// are left out.
    #[must_use]
    pub fn cut(&self, signals: Option<&BTreeSet<String>>, samples: Range<usize>) -> Record {
        let cut = |s: &Series| Series {
            values: s.values.get(samples.clone()).unwrap_or_default().to_vec(),
            marks: s.marks.get(samples.clone()).unwrap_or_default().to_vec(),
        };
        let wanted = self
            .signals
            .iter()
            .filter(|(name, _)| signals.is_none_or(|s| s.contains(*name)));
        Record {
            flight_id: self.flight_id.clone(),
            start_s: self.time_s(samples.start),
            step_s: self.step_s,
            samples: samples.len(),
            signals: wanted
                .map(|(name, series)| (name.clone(), cut(series)))
                .collect(),
            remaining_errors: self.remaining_errors.clone(),
        }
    }

    /// Copies the part of the record from one time to another, with a margin on each side. The
    /// signals thus have the slopes of the whole record at the ends of the part. Sample times are
    /// unchanged.
    #[must_use]
    pub fn part(&self, start_s: f64, end_s: f64) -> Record {
        let (first, last) = (self.sample_at(start_s), self.sample_at(end_s));
        self.cut(None, with_margin(first, last, self.samples, self.step_s))
    }
}
