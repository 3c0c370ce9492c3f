//! Signature of a record: the values measured at every full ten seconds of its clock. Two records
//! with equal signatures at their common times hold the same rows, even if their files differ in
//! name and beginning.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::flight::Mark;
use crate::ingest::clock::Clock;
use crate::numerics::series::sample_count::nearest;

/// Interval between the times of a signature, s: a flight has some hundreds of them.
const INTERVAL_S: f64 = 10.0;

/// Least number of different hashes that two records of the same rows have in common. Fewer are
/// chance, or two aircraft at rest.
const LEAST_COMMON: usize = 3;

/// Odd multiplier of the hash: 2⁶⁴ divided by the golden ratio (Knuth's multiplicative hashing).
const HASH_MULTIPLIER: u64 = 0x9E37_79B9_7F4A_7C15;

/// Rotation of the hash before the next signal's bits: coprime to 64, so that the bits of two
/// signals are never aligned.
const HASH_ROTATION: u32 = 7;

/// Bits of one signal at the times of the signature.
#[derive(Clone, Debug)]
pub struct SignatureSamples {
    start_s: f64,
    step_s: f64,
    /// The sample of the next time.
    next: usize,
    /// Number of samples so far.
    seen: usize,
    /// Bits by time, in intervals.
    bits: BTreeMap<i64, u64>,
}

impl SignatureSamples {
    #[must_use]
    pub fn of(clock: &Clock) -> SignatureSamples {
        SignatureSamples {
            start_s: clock.start_s,
            step_s: clock.step_s,
            next: 0,
            seen: 0,
            bits: BTreeMap::new(),
        }
    }

    /// Time of sample `next`, in intervals.
    fn next_time(&self) -> i64 {
        let time_s = self.start_s + self.next as f64 * self.step_s;
        #[expect(
            clippy::cast_possible_truncation,
            reason = "tens of seconds of a flight"
        )]
        let time = (time_s / INTERVAL_S).round() as i64;
        time
    }

    /// Takes the next conditioned samples.
    pub fn push(&mut self, values: &[f64], marks: &[Mark]) {
        if self.seen == 0 && self.next == 0 {
            let first_s = (self.start_s / INTERVAL_S).ceil() * INTERVAL_S;
            self.next = nearest((first_s - self.start_s) / self.step_s);
        }
        let end = self.seen + values.len();
        while (self.seen..end).contains(&self.next) {
            let (k, time) = (self.next - self.seen, self.next_time());
            if marks[k] == Mark::Measured {
                self.bits.insert(time, values[k].to_bits());
            }
            let then_s = (time + 1) as f64 * INTERVAL_S;
            let then = nearest((then_s - self.start_s) / self.step_s);
            self.next = then.max(self.next + 1);
        }
        self.seen = end;
    }
}

/// Hash of all signals at each time, in intervals, by rising time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Signature(Vec<(i64, u64)>);

/// Rows that two records share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    pub from_s: f64,
    pub to_s: f64,
    /// Share of the first record's times.
    pub share: f64,
}

impl Signature {
    /// Signature of the signals whose values do not depend on where the record begins.
    pub fn of(signals: impl Iterator<Item = SignatureSamples>) -> Signature {
        let mut hashes: BTreeMap<i64, u64> = BTreeMap::new();
        for signal in signals {
            for (time, bits) in signal.bits {
                let hash = hashes.entry(time).or_default();
                *hash = (hash.rotate_left(HASH_ROTATION) ^ bits).wrapping_mul(HASH_MULTIPLIER);
            }
        }
        Signature(hashes.into_iter().collect())
    }

    /// The rows that two records share; `None` without any.
    #[must_use]
    pub fn overlap(&self, other: &Signature) -> Option<Overlap> {
        let mut others = other.0.iter().peekable();
        let is_equal = |own: &&(i64, u64)| {
            while others.next_if(|other| other.0 < own.0).is_some() {}
            others.peek() == Some(own)
        };
        let mut common: Vec<(i64, u64)> = self.0.iter().filter(is_equal).copied().collect();
        let (first, last) = (common.first()?.0, common.last()?.0);
        let share = common.len() as f64 / self.0.len() as f64;
        // Rows that never change are no evidence.
        common.sort_by_key(|(_, hash)| *hash);
        common.dedup_by_key(|(_, hash)| *hash);
        (common.len() >= LEAST_COMMON).then_some(Overlap {
            from_s: first as f64 * INTERVAL_S,
            to_s: last as f64 * INTERVAL_S,
            share,
        })
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
            signal.push(&values, &vec![Mark::Measured; values.len()]);
        }
        Signature::of(std::iter::once(signal))
    }

    #[test]
    fn records_that_overlap_share_the_overlap() {
        let (a, b) = (signature(0.0, 200, 0.0), signature(100.0, 200, 0.0));
        assert_eq!(
            a.overlap(&b).map(|o| (o.from_s, o.to_s)),
            Some((100.0, 190.0))
        );
        assert_eq!(a.overlap(&a).map(|o| o.share), Some(1.0));
    }

    #[test]
    fn records_of_other_values_share_nothing() {
        assert_eq!(
            signature(0.0, 200, 0.0).overlap(&signature(0.0, 200, 0.1)),
            None
        );
        assert_eq!(
            signature(0.0, 20, 0.0).overlap(&signature(0.0, 20, 0.0)),
            None
        );
    }
}
