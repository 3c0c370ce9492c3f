//! One channel on its way from the recorder's numbers to a signal: converted, made continuous where
//! it wraps around, cleaned of stuck values and spikes, its gaps bridged or left missing, every
//! sample marked.
//!
//! Samples come in pieces of any length and leave as soon as those after them cannot change them
//! any more. What is decided about a sample depends on its surroundings and on the character of its
//! spell, never on the pieces.

use std::collections::VecDeque;
use std::ops::Range;

use super::character::{Character, LONGEST_PERIOD, Rate, SPELL, long_runs, recorded};
use super::{gaps, spikes};
use crate::flight::record::Series;
use crate::flight::{Channel, Mark};
use crate::ingest::sample_count::whole_steps;
use crate::ingest::settings::Settings;
use crate::units::{Quantity, Unit};

/// The unit of a flag: engaged or not, nothing between.
const FLAG: &str = "0/1";

/// The surroundings that decide about a sample, on either side: longer than any stand-still that
/// must be recognised.
const MARGIN: usize = SPELL / 4;

/// Without a `wraps_at`, only a jump of nearly the whole circle from one sample to the next is a
/// wrap.
const WHOLE_TURN: f64 = 0.9;

/// Samples that are looked at for a wrap at once.
const SOME: usize = 1 << 10;

/// Makes a value that wraps around continuous.
#[derive(Clone, Debug)]
struct Unwrap {
    period: f64,
    /// A jump by more than this share of the period is a wrap.
    share: f64,
    /// Whether it is an attitude or a flow angle, which begins within half a turn of zero, and not
    /// a heading.
    about_zero: bool,
    /// After more missing samples than this it begins anew: how far it has turned meanwhile nobody
    /// knows.
    longest: usize,
    missing: usize,
    turns: f64,
    before: f64,
    wraps: usize,
}

impl Unwrap {
    fn of(channel: &Channel, step_s: f64, settings: &Settings) -> Option<Unwrap> {
        let unit = Unit::parse(&channel.unit)
            .ok()
            .filter(|u| u.quantity == Quantity::Angle);
        let circle = unit
            .and_then(|u| Unit::of_signal("_deg").factor_to(u))
            .map(|f| 360.0 * f);
        let stated = channel.wraps_at.map(|period| (period, 0.5));
        let (period, share) = stated.or_else(|| circle.map(|c| (c, WHOLE_TURN)))?;
        let longest = whole_steps(settings.longest_bridge_s, step_s).max(LONGEST_PERIOD);
        let about_zero = channel.wraps_at.is_none();
        Some(Unwrap {
            period,
            share,
            about_zero,
            longest,
            missing: 0,
            turns: 0.0,
            before: f64::NAN,
            wraps: 0,
        })
    }

    /// Whether nothing before the next value says how many turns it is on.
    fn begins(&self) -> bool {
        self.about_zero && (self.before.is_nan() || self.missing > self.longest)
    }

    fn next(&mut self, value: f64) -> f64 {
        if !value.is_finite() {
            self.missing += 1;
            return value;
        }
        if self.begins() {
            // What is beyond a whole turn is no angle that wraps around.
            self.turns = if value.abs() <= self.period {
                0.0 - (value / self.period).round()
            } else {
                0.0
            };
            self.before = value + self.turns * self.period;
            self.wraps += usize::from(self.turns != 0.0);
        }
        self.missing = 0;
        let jump = value + self.turns * self.period - self.before;
        if jump.abs() > self.share * self.period {
            self.turns -= (jump / self.period).round();
            self.wraps += 1;
        }
        self.before = value + self.turns * self.period;
        self.before
    }

    /// What all of these samples are moved by, where none of them is missing or wraps: nearly
    /// always.
    fn common(&mut self, recorded: &[f64]) -> Option<f64> {
        if self.begins() {
            return None;
        }
        let moved = self.turns * self.period;
        let jumps = |before: f64, value: f64| (value - before).abs() > self.share * self.period;
        let (first, last) = (recorded.first()?, recorded.last()?);
        let known = recorded.iter().fold(true, |all, v| all & v.is_finite());
        let goes_on = recorded
            .windows(2)
            .fold(true, |all, pair| all & !jumps(pair[0], pair[1]));
        if !known || !goes_on || jumps(self.before - moved, *first) {
            return None;
        }
        self.before = last + moved;
        self.missing = 0;
        Some(moved)
    }
}

/// What was done to a channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChannelStatistics {
    /// How many samples have each mark, by its number.
    pub marks: [usize; 6],
    pub wraps: usize,
    pub quantisation: Option<f64>,
    pub noise: Option<f64>,
    /// Samples of the record from one recorded value to the next.
    pub period: usize,
    /// From sample to sample where the channel was stuck.
    pub stuck: Vec<(usize, usize)>,
}

impl ChannelStatistics {
    #[must_use]
    pub fn count(&self, mark: Mark) -> usize {
        self.marks[mark as usize]
    }
}

/// The state of one channel between its pieces.
#[derive(Clone, Debug)]
pub struct Conditioner {
    settings: Settings,
    step_s: f64,
    samples: usize,
    factor: f64,
    flag: bool,
    unwrap: Option<Unwrap>,
    /// Converted values from sample `first` on.
    values: Vec<f64>,
    first: usize,
    settled: usize,
    /// The characters of the spells from `first`'s on.
    characters: VecDeque<Character>,
    first_spell: usize,
    latest: Character,
    noises: Vec<f64>,
    periods: Vec<usize>,
    statistics: ChannelStatistics,
}

impl Conditioner {
    /// For a channel whose values times `factor` are in the signal's unit, over so many samples.
    #[must_use]
    pub fn new(
        channel: &Channel,
        factor: f64,
        step_s: f64,
        samples: usize,
        settings: &Settings,
    ) -> Conditioner {
        Conditioner {
            settings: settings.clone(),
            step_s,
            samples,
            factor: factor * channel.sign * channel.scale,
            flag: channel.unit == FLAG,
            unwrap: Unwrap::of(channel, step_s, settings),
            values: Vec::new(),
            first: 0,
            settled: 0,
            characters: VecDeque::new(),
            first_spell: 0,
            latest: Character::UNKNOWN,
            noises: Vec::new(),
            periods: Vec::new(),
            statistics: ChannelStatistics::default(),
        }
    }

    /// How many samples have been pushed.
    #[must_use]
    pub fn pushed(&self) -> usize {
        self.first + self.values.len()
    }

    /// How many samples must be pushed before those up to `until` can leave.
    #[must_use]
    pub fn wanted(&self, until: usize) -> usize {
        ((until + MARGIN).div_ceil(SPELL) * SPELL).min(self.samples)
    }

    /// The samples up to here could leave.
    #[must_use]
    pub fn ready(&self) -> usize {
        let complete = if self.pushed() == self.samples {
            return self.samples;
        } else {
            self.pushed() / SPELL * SPELL
        };
        complete.saturating_sub(MARGIN)
    }

    /// The samples up to here have left.
    #[must_use]
    pub fn settled(&self) -> usize {
        self.settled
    }

    /// The next samples as recorded, NaN where there is none.
    pub fn push(&mut self, recorded: &[f64]) {
        let factor = self.factor;
        let converted = |value: f64| {
            if value.is_finite() {
                value * factor
            } else {
                f64::NAN
            }
        };
        match &mut self.unwrap {
            Some(unwrap) => {
                for some in recorded.chunks(SOME) {
                    match unwrap.common(some) {
                        Some(moved) => self
                            .values
                            .extend(some.iter().map(|v| (v + moved) * factor)),
                        None => self
                            .values
                            .extend(some.iter().map(|v| converted(unwrap.next(*v)))),
                    }
                }
            }
            None => self.values.extend(recorded.iter().map(|v| converted(*v))),
        }
        loop {
            let spell = self.first_spell + self.characters.len();
            let (from, to) = (spell * SPELL, ((spell + 1) * SPELL).min(self.samples));
            if from >= to || to > self.pushed() {
                return;
            }
            self.characterise(from, to);
        }
    }

    fn characterise(&mut self, from: usize, to: usize) {
        let spell = &self.values[from - self.first..to - self.first];
        let mut character =
            Character::of(spell, from, self.step_s, &self.latest, &self.settings.stuck);
        if self.flag {
            (character.stuck, character.rate.held) = (None, None);
        }
        self.noises
            .extend(character.noise.is_finite().then_some(character.noise));
        self.periods.push(character.rate.period);
        let finer = |a: f64| self.statistics.quantisation.map_or(a, |b: f64| b.min(a));
        self.statistics.quantisation = character
            .quantisation
            .map(finer)
            .or(self.statistics.quantisation);
        self.latest = character;
        self.characters.push_back(character);
    }

    fn character(&self, sample: usize) -> &Character {
        let spell = (sample / SPELL).saturating_sub(self.first_spell);
        self.characters.get(spell).unwrap_or(&Character::UNKNOWN)
    }

    /// The samples up to `until`, which must have been `wanted` and pushed.
    pub fn settle(&mut self, until: usize) -> Series {
        let until = until.min(self.samples);
        let from = self.settled.saturating_sub(MARGIN).max(self.first);
        let to = (until + MARGIN).min(self.pushed());
        let mut values = self.values[from - self.first..to - self.first].to_vec();
        let stuck = self.leave_out(&mut values, from);
        let despiked = if self.flag {
            Vec::new()
        } else {
            self.despike(&mut values, from)
        };
        let mut marks = self.bridge(&mut values, from);
        for range in stuck {
            marks[range].fill(Mark::Stuck);
        }
        for k in despiked {
            marks[k] = Mark::Despiked;
        }
        let core = self.settled - from..until - from;
        self.count(&marks[core.clone()]);
        self.settled = until;
        self.forget();
        Series {
            values: only(values, &core),
            marks: only(marks, &core),
        }
    }

    fn count(&mut self, marks: &[Mark]) {
        let measured = marks.iter().filter(|mark| **mark == Mark::Measured).count();
        if measured == marks.len() {
            self.statistics.marks[Mark::Measured as usize] += measured;
            return;
        }
        for (k, mark) in marks.iter().enumerate() {
            self.statistics.marks[*mark as usize] += 1;
            if *mark == Mark::Stuck {
                let sample = self.settled + k;
                match self.statistics.stuck.last_mut().filter(|s| s.1 == sample) {
                    Some(run) => run.1 = sample + 1,
                    None => self.statistics.stuck.push((sample, sample + 1)),
                }
            }
        }
    }

    /// Drops what no later sample depends on.
    fn forget(&mut self) {
        let keep = self.settled.saturating_sub(MARGIN);
        self.values
            .drain(..keep.saturating_sub(self.first).min(self.values.len()));
        self.first = self.first.max(keep);
        while self.first_spell < self.first / SPELL && !self.characters.is_empty() {
            self.characters.pop_front();
            self.first_spell += 1;
        }
    }

    /// The parts of a range of samples that have one character, as offsets.
    fn parts(&self, from: usize, length: usize) -> Vec<(Range<usize>, Character)> {
        let to = from + length;
        let spells = from / SPELL..to.div_ceil(SPELL);
        let cut = |spell: usize| (spell * SPELL).clamp(from, to) - from;
        spells
            .map(|s| (cut(s)..cut(s + 1), *self.character(s * SPELL)))
            .collect()
    }

    /// Repeated values of a slow channel and stuck values become NaN; returns where it is stuck.
    fn leave_out(&self, values: &mut [f64], from: usize) -> Vec<Range<usize>> {
        let parts = self.parts(from, values.len());
        for (range, character) in &parts {
            let Rate {
                period,
                held: Some(phase),
            } = character.rate
            else {
                continue;
            };
            for k in range.clone() {
                if (from + k) % period != phase {
                    values[k] = f64::NAN;
                }
            }
        }
        let Some(fewest) = parts.iter().filter_map(|(_, c)| c.stuck).min() else {
            return Vec::new();
        };
        let is_stuck = |run: &Range<usize>, count: usize| {
            let least = self
                .character(from + run.start)
                .stuck
                .or(self.character(from + run.end - 1).stuck);
            least.is_some_and(|least| count >= least)
        };
        let stuck: Vec<Range<usize>> = if values.iter().all(|v| v.is_finite()) {
            long_runs(values, fewest)
                .into_iter()
                .filter(|run| is_stuck(run, run.len()))
                .collect()
        } else {
            // What is missing between two values that are the same counts for nothing.
            let (places, own) = known(values);
            let runs = long_runs(&own, fewest)
                .into_iter()
                .map(|run| (places[run.start]..places[run.end - 1] + 1, run.len()));
            runs.filter(|(run, count)| is_stuck(run, *count))
                .map(|(run, _)| run)
                .collect()
        };
        for range in &stuck {
            values[range.clone()].fill(f64::NAN);
        }
        stuck
    }

    /// Replaces spikes; of a slow channel among its own samples.
    fn despike(&self, values: &mut [f64], from: usize) -> Vec<usize> {
        let parts = self.parts(from, values.len());
        if parts.iter().all(|(_, c)| c.rate.period == 1) {
            let floors: Vec<_> = parts
                .into_iter()
                .map(|(range, c)| (range, c.floor))
                .collect();
            return spikes::remove(values, self.step_s, &floors, &self.settings.spikes);
        }
        let period = parts.iter().map(|(_, c)| c.rate.period).max().unwrap_or(1);
        let (places, mut own) = known(values);
        let place = |sample: usize| places.partition_point(|k| *k < sample);
        let floors: Vec<_> = parts
            .iter()
            .map(|(r, c)| (place(r.start)..place(r.end), c.floor))
            .collect();
        let step_s = self.step_s * period as f64;
        let spikes = spikes::remove(&mut own, step_s, &floors, &self.settings.spikes);
        let spikes: Vec<(usize, f64)> = spikes
            .into_iter()
            .filter_map(|i| Some((*places.get(i)?, *own.get(i)?)))
            .collect();
        for (k, value) in &spikes {
            values[*k] = *value;
        }
        spikes.into_iter().map(|(k, _)| k).collect()
    }

    fn bridge(&self, values: &mut [f64], from: usize) -> Vec<Mark> {
        let longest = whole_steps(self.settings.longest_bridge_s, self.step_s);
        let bridge = if self.flag {
            gaps::Bridge::Held
        } else {
            gaps::Bridge::Line
        };
        let period = |k: usize| self.character(from + k).rate.period;
        gaps::fill(values, longest, bridge, period)
    }

    /// What was done; the channel is over.
    #[must_use]
    pub fn finish(mut self) -> ChannelStatistics {
        let middle = |n: usize| n / 2;
        self.noises.sort_by(f64::total_cmp);
        self.periods.sort_unstable();
        self.statistics.noise = self
            .noises
            .get(middle(self.noises.len()))
            .copied()
            .filter(|_| !self.flag);
        self.statistics.quantisation = self.statistics.quantisation.filter(|_| !self.flag);
        self.statistics.period = self
            .periods
            .get(middle(self.periods.len()))
            .copied()
            .unwrap_or(1);
        self.statistics.wraps = self.unwrap.map_or(0, |u| u.wraps);
        self.statistics
    }
}

/// The recorded values and their places.
fn known(values: &[f64]) -> (Vec<usize>, Vec<f64>) {
    recorded(values, 0, Rate::FULL).unzip()
}

/// A range of the values alone.
fn only<T>(mut values: Vec<T>, range: &Range<usize>) -> Vec<T> {
    values.truncate(range.end);
    values.drain(..range.start);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As they are put together from pieces of some length.
    fn unwrapped_in(piece: usize, wraps_at: Option<f64>, values: &[f64]) -> Vec<f64> {
        let channel = Channel {
            signal: "x_deg".into(),
            unit: "deg".into(),
            sign: 1.0,
            scale: 1.0,
            wraps_at,
        };
        let mut conditioner =
            Conditioner::new(&channel, 1.0, 0.025, values.len(), &Settings::default());
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
