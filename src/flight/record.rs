//! A record: the signals of one flight on one uniform clock, each sample marked where it is not
//! what the recorder wrote.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use serde::{Deserialize, Serialize};

/// What happened to one sample of one signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Mark {
    /// As recorded.
    Measured = 0,
    /// A short dropout or a lost frame, bridged by a straight line.
    Bridged = 1,
    /// A single-sample spike, replaced by the line between its neighbours.
    Despiked = 2,
    /// Nothing to bridge it with: the value is NaN.
    Missing = 3,
    /// The channel stood still where it should have moved: the value is NaN.
    Stuck = 4,
    /// Between two samples of a channel that is recorded more slowly than the record: on the line
    /// through them.
    Between = 5,
}

impl Mark {
    /// The mark stored as this number; anything unknown counts as missing.
    #[must_use]
    pub fn from_u8(code: u8) -> Mark {
        match code {
            0 => Mark::Measured,
            1 => Mark::Bridged,
            2 => Mark::Despiked,
            4 => Mark::Stuck,
            5 => Mark::Between,
            _ => Mark::Missing,
        }
    }

    /// Whether something went wrong with the sample. A slow channel's in-between samples are no
    /// measurements, but nothing is wrong with them.
    #[must_use]
    pub fn is_fault(self) -> bool {
        !matches!(self, Mark::Measured | Mark::Between)
    }
}

/// One signal: its values in the unit of its name, and the marks of its samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    pub values: Vec<f64>,
    pub marks: Vec<Mark>,
}

/// The signals of one flight on one clock: sample `k` is at `start_s + k * step_s` of the record's
/// own time.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    pub flight_id: String,
    pub start_s: f64,
    pub step_s: f64,
    pub samples: usize,
    pub signals: BTreeMap<String, Series>,
}

impl Record {
    /// The time of a sample, s.
    #[must_use]
    pub fn time_s(&self, sample: usize) -> f64 {
        let k = sample as f64;
        self.start_s + k * self.step_s
    }

    /// The sample nearest to a time, kept inside the record.
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

    /// The values of a signal, where the record has it.
    #[must_use]
    pub fn values(&self, signal: &str) -> Option<&[f64]> {
        self.signals.get(signal).map(|s| s.values.as_slice())
    }

    /// The share of samples, among all of these signals from one time to another, with which
    /// something went wrong; a signal that the record does not have counts as missing throughout.
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

    /// A range of samples of some signals, or of all; signals that the record does not have are
    /// left out.
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
        }
    }

    /// The part of the record from one time to another, with a few samples more on each side:
    /// slopes of signals at the ends of the part are those of the whole. Sample times are
    /// unchanged.
    #[must_use]
    pub fn part(&self, start_s: f64, end_s: f64) -> Record {
        const MARGIN: usize = 10;
        let from = self.sample_at(start_s).saturating_sub(MARGIN);
        let to = (self.sample_at(end_s) + MARGIN + 1).min(self.samples);
        self.cut(None, from..to)
    }
}
