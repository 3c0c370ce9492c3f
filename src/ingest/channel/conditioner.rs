//! One channel on its way from the recorder's numbers to a signal. It is converted, unwrapped, and
//! cleaned of stuck values and spikes. Gaps are bridged or left missing, and every sample is
//! flagged.
//!
//! Samples come in pieces of any length and leave as soon as later samples cannot change them. What
//! is decided about a sample depends on its surroundings and on the character of its spell, never
//! on the pieces.

use std::ops::Range;

use super::channel_statistics::{ChannelStatistics, LARGEST};
use super::character::{Character, SPELL};
use super::gaps::{Bridge, BridgedGaps, bridge_gaps};
use super::repeats::long_runs;
use super::spell_characters::Characters;
use super::spikes;
use super::unwrap::Unwrapper;
use super::update_rate::{LONGEST_PERIOD, UpdateRate};
use crate::flight::fill_value::{is_fill_value, is_usual};
use crate::flight::record::Series;
use crate::flight::{Channel, Mark};
use crate::ingest::settings::Settings;
use crate::numerics::series::finite_places::finite_values;
use crate::numerics::statistics::order_statistics::{
    upper_median_in_place, upper_median_of_counts,
};
use crate::numerics::vectors::simd::vectorised;
use crate::units::Conversion;

/// Unit of a 0/1 channel, whose values are never smoothed or interpolated.
const FLAG_UNIT: &str = "0/1";

/// Samples on either side of a sample that decide about it: longer than any unchanged run that must
/// be recognised.
const MARGIN: usize = SPELL / 4;

/// Samples that are unwrapped at once: they stay in the processor's cache.
const UNWRAPPED_AT_ONCE: usize = 1 << 10;

/// Conditioning state of one channel between its pieces.
#[derive(Clone, Debug)]
pub struct Conditioner {
    settings: Settings,
    step_s: f64,
    /// Samples of the stretch.
    samples: usize,
    /// Conversion of the recorder's numbers to the signal's unit.
    conversion: Conversion,
    signal: String,
    is_flag: bool,
    reach: BridgedGaps,
    unwrapper: Option<Unwrapper>,
    /// Converted values from sample `first` on.
    values: Vec<f64>,
    first: usize,
    /// The samples that left last, with those on which they depend. Its memory is used again.
    latest: Series,
    /// Number of samples that have left, from the first.
    settled: usize,
    characters: Characters,
    statistics: ChannelStatistics,
}

impl Conditioner {
    /// Conditioner of a channel over `samples` samples; `conversion` is that of its unit to the
    /// signal's.
    #[must_use]
    pub fn new(
        channel: &Channel,
        conversion: Conversion,
        step_s: f64,
        samples: usize,
        settings: &Settings,
    ) -> Conditioner {
        Conditioner {
            settings: settings.clone(),
            step_s,
            samples,
            conversion: Conversion {
                factor: conversion.factor * channel.sign * channel.scale,
                ..conversion
            },
            signal: channel.signal.clone(),
            is_flag: channel.unit == FLAG_UNIT,
            reach: BridgedGaps::of(&channel.signal, settings.longest_bridge_s, step_s),
            unwrapper: Unwrapper::of(channel, step_s, LONGEST_PERIOD, settings),
            values: Vec::new(),
            first: 0,
            latest: Series::default(),
            settled: 0,
            characters: Characters::none(),
            statistics: ChannelStatistics::default(),
        }
    }

    /// Number of samples that have been pushed.
    #[must_use]
    pub fn pushed(&self) -> usize {
        self.first + self.values.len()
    }

    /// Number of samples that must be pushed before the samples up to `until` can leave.
    #[must_use]
    pub fn wanted(&self, until: usize) -> usize {
        ((until + MARGIN).div_ceil(SPELL) * SPELL).min(self.samples)
    }

    /// Number of samples that could leave now.
    #[must_use]
    pub fn ready(&self) -> usize {
        if self.pushed() == self.samples {
            return self.samples;
        }
        let complete = self.pushed() / SPELL * SPELL;
        complete.saturating_sub(MARGIN)
    }

    /// Number of samples that have left.
    #[must_use]
    pub fn settled(&self) -> usize {
        self.settled
    }

    /// Takes the next samples as recorded; a missing sample is NaN.
    pub fn push(&mut self, recorded: &[f64]) {
        match self.without_impossible(recorded) {
            Some(recorded) => self.convert(&recorded),
            None => self.convert(recorded),
        }
        loop {
            let spell = self.characters.next_spell();
            let (from, to) = (spell * SPELL, ((spell + 1) * SPELL).min(self.samples));
            if from >= to || to > self.pushed() {
                return;
            }
            self.characterise(from, to);
        }
    }

    /// Recorded values with fill values and those beyond any measurement set to NaN; `None` if no value is.
    fn without_impossible(&mut self, recorded: &[f64]) -> Option<Vec<f64>> {
        let (conversion, signal) = (self.conversion, &self.signal);
        let is_beyond = |value: f64| value.is_finite() & (conversion.of(value).abs() > LARGEST);
        let is_fill = |value: f64| is_fill_value(value, signal, |value| conversion.of(value));
        // Without an early exit, for the vectors.
        let is_any_suspect = vectorised(
            #[inline(always)]
            || {
                let suspect = |v: &f64| is_usual(*v) | is_beyond(*v);
                recorded.iter().fold(false, |any, v| any | suspect(v))
            },
        );
        if !is_any_suspect {
            return None;
        }
        let pushed = self.first + self.values.len();
        let statistics = &mut self.statistics;
        let cleaned = recorded.iter().enumerate().map(|(k, value)| {
            if is_beyond(*value) {
                statistics.beyond += 1;
                statistics.first_beyond.get_or_insert(pushed + k);
                f64::NAN
            } else if is_fill(*value) {
                statistics.fills += 1;
                statistics.first_fill.get_or_insert((pushed + k, *value));
                f64::NAN
            } else {
                *value
            }
        });
        Some(cleaned.collect())
    }

    /// Appends recorded values, unwrapped and in the signal's unit.
    fn convert(&mut self, recorded: &[f64]) {
        let conversion = self.conversion;
        let converted = move |value: f64| {
            if value.is_finite() {
                conversion.of(value)
            } else {
                f64::NAN
            }
        };
        let Some(unwrapper) = &mut self.unwrapper else {
            let values = &mut self.values;
            vectorised(
                // `move` for a copy of the conversion, which no written value can change.
                #[inline(always)]
                move || values.extend(recorded.iter().map(|v| converted(*v))),
            );
            return;
        };
        for part in recorded.chunks(UNWRAPPED_AT_ONCE) {
            if let Some(offset) = unwrapper.common_offset(part) {
                let moved = part.iter().map(|v| conversion.of(v + offset));
                self.values.extend(moved);
            } else {
                let unwrapped = part.iter().map(|v| unwrapper.unwrap_value(*v));
                self.values.extend(unwrapped.map(converted));
            }
        }
    }

    fn characterise(&mut self, from: usize, to: usize) {
        let spell = &self.values[from - self.first..to - self.first];
        let before = &self.characters.latest;
        let mut character = Character::of(spell, from, self.step_s, before, &self.settings.stuck);
        if self.is_flag {
            character.stuck_run = None;
            character.rate.held_phase = None;
        }
        if let Some(step) = character.quantisation {
            let finest = self.statistics.quantisation.map_or(step, |q| q.min(step));
            self.statistics.quantisation = Some(finest);
        }
        self.characters.push(character);
    }

    /// Returns the samples up to `until`, which must have been `wanted` and pushed.
    pub fn settle(&mut self, until: usize) -> (&[f64], &[Mark]) {
        let until = until.min(self.samples);
        let from = self.settled.saturating_sub(MARGIN).max(self.first);
        let to = (until + MARGIN).min(self.pushed());
        let Series {
            mut values,
            mut marks,
        } = std::mem::take(&mut self.latest);
        values.clear();
        values.extend_from_slice(&self.values[from - self.first..to - self.first]);
        self.repair(&mut values, &mut marks, from);
        let leaving = self.settled - from..until - from;
        let recorded = &self.values[self.settled - self.first..until - self.first];
        self.statistics
            .add(self.settled, &marks[leaving.clone()], recorded);
        self.settled = until;
        self.forget();
        self.latest = Series { values, marks };
        (
            &self.latest.values[leaving.clone()],
            &self.latest.marks[leaving],
        )
    }

    /// Repairs converted values from sample `from` on and marks them.
    fn repair(&self, values: &mut [f64], marks: &mut Vec<Mark>, from: usize) {
        self.blank_repeats(values, from);
        let stuck = self.blank_stuck(values, from);
        let despiked = if self.is_flag {
            Vec::new()
        } else {
            self.despike(values, from)
        };
        self.bridge(values, marks, from);
        for range in stuck {
            values[range.clone()].fill(f64::NAN);
            marks[range].fill(Mark::Stuck);
        }
        for k in despiked {
            marks[k] = Mark::Despiked;
        }
    }

    /// Frees the memory that is not needed until the next samples come.
    pub fn free(&mut self) {
        self.latest = Series::default();
        self.values.shrink_to_fit();
    }

    /// Drops values and characters on which no later sample depends.
    fn forget(&mut self) {
        let keep = self.settled.saturating_sub(MARGIN);
        let dropped = keep.saturating_sub(self.first).min(self.values.len());
        self.values.drain(..dropped);
        self.first = self.first.max(keep);
        self.characters.drop_before(self.first);
    }

    /// Sets the repeated values of a slow channel to NaN.
    fn blank_repeats(&self, values: &mut [f64], from: usize) {
        for (range, character) in self.characters.parts(from, values.len()) {
            let UpdateRate {
                period,
                held_phase: Some(phase),
            } = character.rate
            else {
                continue;
            };
            let mut repeats = range.start;
            while repeats < range.end {
                let ahead = (period + phase - (from + repeats) % period) % period;
                let new = (repeats + ahead).min(range.end);
                values[repeats..new].fill(f64::NAN);
                repeats = new + 1;
            }
        }
    }

    /// Sets stuck values to NaN and returns their ranges.
    fn blank_stuck(&self, values: &mut [f64], from: usize) -> Vec<Range<usize>> {
        let parts = self.characters.parts(from, values.len());
        let Some(least) = parts.iter().filter_map(|(_, c)| c.stuck_run).min() else {
            return Vec::new();
        };
        let stuck: Vec<Range<usize>> = equal_runs(values, least)
            .into_iter()
            .filter(|(range, count)| self.is_stuck(range, *count, from))
            .map(|(range, _)| range)
            .collect();
        for range in &stuck {
            values[range.clone()].fill(f64::NAN);
        }
        stuck
    }

    /// `true` if `count` equal values in a range mean a stuck channel, by the character at either
    /// end.
    fn is_stuck(&self, range: &Range<usize>, count: usize, from: usize) -> bool {
        let at_start = self.characters.at(from + range.start).stuck_run;
        let at_end = self.characters.at(from + range.end - 1).stuck_run;
        at_start.or(at_end).is_some_and(|least| count >= least)
    }

    /// Replaces spikes and returns their places. Spikes of a slow channel are found among its
    /// recorded samples only.
    fn despike(&self, values: &mut [f64], from: usize) -> Vec<usize> {
        let parts = self.characters.parts(from, values.len());
        let period = parts.iter().map(|(_, c)| c.rate.period).max().unwrap_or(1);
        let settings = &self.settings.spikes;
        if period == 1 {
            let floors: Vec<_> = parts
                .into_iter()
                .map(|(range, c)| (range, c.noise_floor))
                .collect();
            return spikes::remove(values, self.step_s, &floors, settings);
        }
        let (places, mut own) = finite_values(values);
        let own_index = |sample: usize| places.partition_point(|k| *k < sample);
        let floors: Vec<_> = parts
            .iter()
            .map(|(r, c)| (own_index(r.start)..own_index(r.end), c.noise_floor))
            .collect();
        let step_s = self.step_s * period as f64;
        let despiked = spikes::remove(&mut own, step_s, &floors, settings);
        for i in &despiked {
            values[places[*i]] = own[*i];
        }
        despiked.into_iter().map(|i| places[i]).collect()
    }

    fn bridge(&self, values: &mut [f64], marks: &mut Vec<Mark>, from: usize) {
        let bridge = if self.is_flag {
            Bridge::Held
        } else {
            Bridge::Line
        };
        let period = |k: usize| self.characters.at(from + k).rate.period;
        bridge_gaps(values, marks, self.reach, bridge, period);
    }

    /// Ends the channel and returns its statistics.
    #[must_use]
    pub fn finish(mut self) -> ChannelStatistics {
        let Characters {
            noises, periods, ..
        } = &mut self.characters;
        let mut statistics = self.statistics;
        if self.is_flag {
            statistics.quantisation = None;
        } else {
            statistics.noise = upper_median_in_place(noises);
        }
        statistics.period = upper_median_of_counts(periods).unwrap_or(1);
        statistics.wraps = self.unwrapper.map_or(0, |u| u.wraps());
        statistics
    }
}

/// Ranges in which at least `least` values are equal, with the number of these values. Missing
/// samples between equal values are skipped.
fn equal_runs(values: &[f64], least: usize) -> Vec<(Range<usize>, usize)> {
    if values.iter().all(|v| v.is_finite()) {
        let runs = long_runs(values, least).into_iter();
        return runs.map(|run| (run.clone(), run.len())).collect();
    }
    let (places, finite) = finite_values(values);
    let runs = long_runs(&finite, least);
    let place = |run: &Range<usize>| places[run.start]..places[run.end - 1] + 1;
    runs.iter().map(|run| (place(run), run.len())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Conversion of a unit to itself.
    const SAME: Conversion = Conversion {
        factor: 1.0,
        offset: 0.0,
    };

    /// Values unwrapped in pieces of a given length.
    fn unwrapped_in(piece: usize, wraps_at: Option<f64>, values: &[f64]) -> Vec<f64> {
        let channel = Channel {
            wraps_at,
            ..Channel::plain("x_deg", "deg")
        };
        let mut conditioner =
            Conditioner::new(&channel, SAME, 0.025, values.len(), &Settings::default());
        values
            .chunks(piece)
            .for_each(|piece| conditioner.push(piece));
        conditioner
            .values
            .into_iter()
            .filter(|v| v.is_finite())
            .collect()
    }

    fn unwrapped(wraps_at: Option<f64>, values: &[f64]) -> Vec<f64> {
        let whole = unwrapped_in(values.len(), wraps_at, values);
        assert_eq!(unwrapped_in(1, wraps_at, values), whole);
        whole
    }

    #[test]
    fn an_angle_recorded_from_0_to_360_deg_begins_about_zero_and_again_after_a_long_gap() {
        assert_eq!(
            unwrapped(None, &[359.0, 1.0, 350.0, 2.0]),
            [-1.0, 1.0, -10.0, 2.0]
        );
        let gap =
            |samples: usize| [&[30.0][..], &vec![f64::NAN; samples], &[330.0, 359.0, 1.0]].concat();
        assert_eq!(unwrapped(None, &gap(41)), [30.0, -30.0, -1.0, 1.0]);
        // A roll that goes on through a dropout stays as many turns on.
        assert_eq!(
            unwrapped(None, &[170.0, 179.0, f64::NAN, -175.0, -170.0]),
            [170.0, 179.0, 185.0, 190.0]
        );
        assert_eq!(unwrapped(None, &[400.0, 410.0]), [400.0, 410.0]);
    }

    #[test]
    fn a_heading_stays_as_recorded_where_it_begins() {
        assert_eq!(
            unwrapped(Some(360.0), &[310.0, 359.0, 1.0]),
            [310.0, 359.0, 361.0]
        );
    }
}
