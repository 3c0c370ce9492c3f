//! The signature of a record: what was measured at every full ten seconds of its clock. Two records
//! that have some of it in common hold the same rows, whatever their files are called and wherever
//! they begin.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::flight::Mark;
use crate::flight::record::Series;
use crate::ingest::clock::Clock;
use crate::ingest::sample_count::nearest;

/// From one time to the next, s.
const EVERY_S: f64 = 10.0;

/// Fewer times in common than this are chance, or two aircraft that stand still.
const FEWEST: usize = 3;

/// The bits of one signal at the times of the signature.
#[derive(Clone, Debug)]
pub struct SignatureSamples {
    start_s: f64,
    step_s: f64,
    next: usize,
    at: usize,
    found: BTreeMap<i64, u64>,
}

impl SignatureSamples {
    #[must_use]
    pub fn of(clock: &Clock) -> SignatureSamples {
        SignatureSamples {
            start_s: clock.start_s,
            step_s: clock.step_s,
            next: 0,
            at: 0,
            found: BTreeMap::new(),
        }
    }

    /// The time that sample `next` is the first of.
    fn time(&self) -> i64 {
        let time_s = self.start_s + self.next as f64 * self.step_s;
        #[expect(
            clippy::cast_possible_truncation,
            reason = "tens of seconds of a flight"
        )]
        let time = (time_s / EVERY_S).round() as i64;
        time
    }

    /// The next settled samples.
    pub fn push(&mut self, series: &Series) {
        if self.at == 0 && self.next == 0 {
            let first_s = (self.start_s / EVERY_S).ceil() * EVERY_S;
            self.next = nearest((first_s - self.start_s) / self.step_s);
        }
        while let Some(k) = self
            .next
            .checked_sub(self.at)
            .filter(|k| *k < series.values.len())
        {
            let time = self.time();
            if series.marks[k] == Mark::Measured {
                self.found.insert(time, series.values[k].to_bits());
            }
            let then_s = (time + 1) as f64 * EVERY_S;
            self.next = nearest((then_s - self.start_s) / self.step_s).max(self.next + 1);
        }
        self.at += series.values.len();
    }
}

/// For each time, in tens of seconds, what all signals were.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Signature(Vec<(i64, u64)>);

impl Signature {
    /// Of all signals but those whose value depends on where the record begins.
    pub fn of(signals: impl Iterator<Item = SignatureSamples>) -> Signature {
        let mut all: BTreeMap<i64, u64> = BTreeMap::new();
        for signal in signals {
            for (time, bits) in signal.found {
                let sum = all.entry(time).or_default();
                *sum = (sum.rotate_left(7) ^ bits).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            }
        }
        Signature(all.into_iter().collect())
    }

    /// From when to when (s) two records hold the same rows, and the share of this one's times that
    /// is; none where they do not.
    #[must_use]
    pub fn common(&self, other: &Signature) -> Option<(f64, f64, f64)> {
        let others: BTreeMap<i64, u64> = other.0.iter().copied().collect();
        let mut same: Vec<(i64, u64)> = self
            .0
            .iter()
            .filter(|(t, v)| others.get(t) == Some(v))
            .copied()
            .collect();
        let (first, last) = (same.first()?.0, same.last()?.0);
        let share = same.len() as f64 / self.0.len() as f64;
        same.sort_by_key(|(_, v)| *v);
        same.dedup_by_key(|(_, v)| *v);
        // Rows that are the same all the time tell nothing.
        (same.len() >= FEWEST).then_some((first as f64 * EVERY_S, last as f64 * EVERY_S, share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A signal whose value depends on time alone, recorded from some second on.
    fn signature(from_s: f64, seconds: usize, offset: f64) -> Signature {
        let (samples, step_s) = (40 * seconds, 0.025);
        let clock = Clock {
            start_s: from_s,
            step_s,
            samples,
            ..Clock::default()
        };
        let value = |k: usize| (clock.time_s(k) * 40.0).round().sin() + offset;
        let mut signal = SignatureSamples::of(&clock);
        for from in (0..samples).step_by(777) {
            let values: Vec<f64> = (from..(from + 777).min(samples)).map(value).collect();
            signal.push(&Series {
                marks: vec![Mark::Measured; values.len()],
                values,
            });
        }
        Signature::of(std::iter::once(signal))
    }

    #[test]
    fn records_that_overlap_have_the_overlap_in_common() {
        let (a, b) = (signature(0.0, 200, 0.0), signature(100.0, 200, 0.0));
        assert_eq!(a.common(&b).map(|c| (c.0, c.1)), Some((100.0, 190.0)));
        assert_eq!(a.common(&a).map(|c| c.2), Some(1.0));
    }

    #[test]
    fn records_of_other_values_have_nothing_in_common() {
        assert_eq!(
            signature(0.0, 200, 0.0).common(&signature(0.0, 200, 0.1)),
            None
        );
        assert_eq!(
            signature(0.0, 20, 0.0).common(&signature(0.0, 20, 0.0)),
            None
        );
    }
}
