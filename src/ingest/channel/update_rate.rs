//! Update rate of a channel: how many samples of the record lie between two recorded values.

use crate::numerics::series::finite_places::finite_places;
use crate::numerics::vectors::simd::vectorised;

/// Longest period of a slow channel, in samples of the record: a channel at 1 Hz in a record at
/// 40 Hz.
pub const LONGEST_PERIOD: usize = 40;

/// Shortest period of a slow channel, in samples of the record.
const SHORTEST_PERIOD: usize = 2;

/// Longest period of a channel with nulls between its values: 1 Hz in a record at 200 Hz.
const LONGEST_BETWEEN_NULLS: usize = 200;

/// Least number of distances from which a period is inferred where all of them agree.
const FEW_DISTANCES: usize = 4;

/// Updates in the longest distance that counts as one with lost updates.
const MOST_UPDATES: usize = 4;

/// Shortest period of which lost updates are recognised: its multiples are more than the clock's
/// two samples apart.
const SHORTEST_WITH_LOSSES: usize = 8;

/// A distance with its two neighbours: the clocks of channel and record slip by one sample.
const WITH_NEIGHBOURS: usize = 3;

/// Least number of distances without a lost update for each one with it: three of four.
const UPDATES_PER_LOSS: usize = 3;

/// Fraction of the distances between recorded samples, or of the changes of a held value, that must
/// fit a period. Frames are lost and clocks slip now and then. Of changes at random half share a
/// phase of the shortest period, two, so 19 of [`LEAST_CHANGES`] do by chance once in 25,000
/// spells.
const FITTING_SHARE: f64 = 0.95;

/// Least number of changes of value, or distances, from which a period is inferred.
pub const LEAST_CHANGES: usize = 20;

/// Largest mean number of periods per change of a held channel. A channel that changes less often
/// may as well be a coarse channel at full rate.
const CHANCES_PER_CHANGE: usize = 4;

/// Update rate of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UpdateRate {
    /// Samples of the record from one recorded value to the next.
    pub period: usize,
    /// Phase of a channel that repeats its value until the next one: the sample, modulo the period,
    /// at which the value changes.
    pub held_phase: Option<usize>,
}

impl UpdateRate {
    /// A value in every sample.
    pub const FULL: UpdateRate = UpdateRate {
        period: 1,
        held_phase: None,
    };

    /// Infers the rate of a channel from its samples, the first of which is sample `first` of the
    /// record. `None` if there are too few values or changes.
    pub fn infer(values: &[f64], first: usize) -> Option<UpdateRate> {
        let Changes {
            finite,
            pairs,
            changed,
        } = Changes::of(values);
        if finite < LEAST_CHANGES {
            return period_of_few(values).map(|period| UpdateRate {
                period,
                held_phase: None,
            });
        }
        // Most channels change so often that no period fits: these need no list of changes.
        let is_full_rate = 2 * pairs + 1 >= finite;
        if !is_full_rate && let Some(period) = period_between_nulls(&distances(values)) {
            return Some(UpdateRate {
                period,
                held_phase: None,
            });
        }
        if changed >= LEAST_CHANGES && !has_room(changed, values.len(), SHORTEST_PERIOD) {
            return Some(UpdateRate::FULL);
        }
        let changes = changes(values, first);
        if changes.len() < LEAST_CHANGES {
            return None;
        }
        let mut periods = (SHORTEST_PERIOD..=LONGEST_PERIOD).rev();
        let held = periods.find_map(|period| held_with_period(period, &changes));
        Some(held.unwrap_or(UpdateRate::FULL))
    }

    /// The recorded values with their places, without the repeated values of a held channel. The
    /// first value is sample `first` of the record.
    pub fn recorded(self, values: &[f64], first: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (ahead, period) = self.held_phase.map_or((0, 1), |phase| {
            let ahead = (self.period + phase - first % self.period) % self.period;
            (ahead, self.period)
        });
        values
            .iter()
            .enumerate()
            .skip(ahead)
            .step_by(period)
            .filter(|(_, v)| v.is_finite())
            .map(|(k, v)| (k, *v))
    }
}

/// Numbers of values of a channel by their neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// Finite values.
    pub finite: usize,
    /// Finite values after a finite one.
    pub pairs: usize,
    /// Finite values that differ from a finite one before.
    pub changed: usize,
}

impl Changes {
    /// Numbers of some values.
    pub fn of(values: &[f64]) -> Changes {
        let first = Changes {
            finite: usize::from(values.first().is_some_and(|v| v.is_finite())),
            ..Changes::default()
        };
        vectorised(
            #[inline(always)]
            || {
                let neighbours = values.iter().zip(values.get(1..).unwrap_or_default());
                // Without branches, for the vectors.
                neighbours.fold(first, |counts, (before, value)| {
                    let is_pair = before.is_finite() & value.is_finite();
                    let differs = is_pair & (before.to_bits() != value.to_bits());
                    Changes {
                        finite: counts.finite + usize::from(value.is_finite()),
                        pairs: counts.pairs + usize::from(is_pair),
                        changed: counts.changed + usize::from(differs),
                    }
                })
            },
        )
    }

    /// Runs of one value without a gap.
    pub fn runs(self) -> usize {
        self.finite - self.pairs + self.changed
    }
}

/// Histogram of the distances between finite values.
fn distances(values: &[f64]) -> [usize; LONGEST_BETWEEN_NULLS + 1] {
    let mut distances = [0_usize; LONGEST_BETWEEN_NULLS + 1];
    let mut last = None;
    for k in finite_places(values) {
        if let Some(count) = last.and_then(|last| distances.get_mut(k - last)) {
            *count += 1;
        }
        last = Some(k);
    }
    distances
}

/// Samples of the record whose value differs from the finite one before.
fn changes(values: &[f64], first: usize) -> Vec<usize> {
    let mut changes = Vec::new();
    let mut before = f64::NAN;
    for k in finite_places(values) {
        let value = values[k];
        if before.is_finite() && value.to_bits() != before.to_bits() {
            changes.push(first + k);
        }
        before = value;
    }
    changes
}

/// Distance between the finite values of a sparse channel. It is more than one sample and, except
/// for lost updates, equal for all values within one sample. Such is a slow channel in a short
/// record.
fn period_of_few(values: &[f64]) -> Option<usize> {
    let distances = distances(values);
    let total: usize = distances.iter().sum();
    let finite = values.iter().filter(|v| v.is_finite()).count();
    let count = PeriodCount::from_distances(&distances)?;
    let agree = count.all() == total && total + 1 == finite && 2 * count.exact > total;
    (count.period > 1 && total >= FEW_DISTANCES && agree && count.has_few_losses())
        .then_some(count.period)
}

/// Distance that nearly all finite values have, or a multiple of it where updates are lost, if it is
/// more than one. If the channel has its own clock, it is one more or less now and then.
fn period_between_nulls(distances: &[usize]) -> Option<usize> {
    let total: usize = distances.iter().sum();
    let count = PeriodCount::from_distances(distances)?;
    let fits = count.all() as f64 >= FITTING_SHARE * total as f64 && total >= LEAST_CHANGES;
    // Beside a full-rate channel's distance of one, two is a lost sample.
    let is_full_rate = 2 * distances.get(1).copied().unwrap_or_default() >= total;
    (count.period > 1 && fits && !is_full_rate && count.has_few_losses()).then_some(count.period)
}

/// Distances that fit the most frequent one.
struct PeriodCount {
    period: usize,
    /// Number of distances of the period.
    exact: usize,
    /// Number of distances within one sample of the period.
    near: usize,
    /// Number of longer distances within one sample of a multiple of the period.
    with_losses: usize,
}

impl PeriodCount {
    fn from_distances(distances: &[usize]) -> Option<PeriodCount> {
        let (period, exact) = distances.iter().enumerate().max_by_key(|(_, n)| **n)?;
        let near = |multiple: usize| -> usize {
            let around = distances.iter().skip(multiple.saturating_sub(1));
            around.take(WITH_NEIGHBOURS).sum()
        };
        let multiples = (2..=MOST_UPDATES).map(|n| n * period);
        // Of a period of a few samples, every distance is near a multiple.
        let is_distinct = period >= SHORTEST_WITH_LOSSES;
        Some(PeriodCount {
            period,
            exact: *exact,
            near: near(period),
            with_losses: if is_distinct {
                multiples.map(near).sum()
            } else {
                0
            },
        })
    }

    fn all(&self) -> usize {
        self.near + self.with_losses
    }

    /// `true` if few enough distances have a lost update in them.
    fn has_few_losses(&self) -> bool {
        UPDATES_PER_LOSS * self.with_losses <= self.near
    }
}

/// `true` if a span of samples has room for this number of changes in one phase of a period.
fn has_room(changes: usize, span: usize, period: usize) -> bool {
    (FITTING_SHARE * changes as f64 - 1.0) * period as f64 <= span as f64
}

/// Rate of a held channel in which nearly all changes keep one phase of a period.
fn held_with_period(period: usize, changes: &[usize]) -> Option<UpdateRate> {
    let span = changes.last()? - changes.first()?;
    let are_too_few = CHANCES_PER_CHANGE * changes.len() * period < span;
    if are_too_few || !has_room(changes.len(), span, period) {
        return None;
    }
    let mut phases = vec![0_usize; period];
    for change in changes {
        phases[change % period] += 1;
    }
    let (phase, most) = phases.iter().enumerate().max_by_key(|(_, n)| **n)?;
    (*most as f64 >= FITTING_SHARE * changes.len() as f64).then_some(UpdateRate {
        period,
        held_phase: Some(phase),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_and_runs_are_counted_between_gaps() {
        let gap = f64::NAN;
        let changes = Changes::of(&[1.0, 1.0, gap, 2.0, 2.0, 3.0, gap, gap, 3.0]);
        let expected = Changes {
            finite: 6,
            pairs: 3,
            changed: 1,
        };
        assert_eq!((changes, changes.runs()), (expected, 4));
        assert_eq!(Changes::of(&[]).runs(), 0);
    }

    #[test]
    fn a_held_channel_is_recorded_where_its_value_changes() {
        let rate = UpdateRate {
            period: 4,
            held_phase: Some(1),
        };
        let values: Vec<f64> = (0..12).map(f64::from).collect();
        for first in 0..9 {
            let found: Vec<usize> = rate.recorded(&values, first).map(|(k, _)| k).collect();
            let expected: Vec<usize> = (0..12).filter(|k| (first + k) % 4 == 1).collect();
            assert_eq!(found, expected, "{first}");
        }
    }

    /// Period of a channel with a value every `period` samples, of which some updates are lost.
    fn period(period: usize, updates: usize, is_lost: impl Fn(usize) -> bool) -> Option<usize> {
        let value = |k: usize| {
            let is_update = k.is_multiple_of(period) && !is_lost(k / period);
            if is_update {
                (k as f64).sin()
            } else {
                f64::NAN
            }
        };
        let values: Vec<f64> = (0..period * updates).map(value).collect();
        UpdateRate::infer(&values, 0).map(|rate| rate.period)
    }

    #[test]
    fn lost_updates_do_not_hide_a_slow_rate() {
        assert_eq!(period(20, 16, |_| false), Some(20));
        assert_eq!(period(20, 16, |n| n == 7), Some(20));
        assert_eq!(period(20, 16, |n| n == 7 || n == 8), Some(20));
        assert_eq!(period(20, 60, |n| n % 10 == 3), Some(20));
        assert_eq!(period(20, 60, |n| n % 2 == 1), Some(40));
        assert_ne!(period(20, 16, |n| n % 3 == 1), Some(20));
    }
}
