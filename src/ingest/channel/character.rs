//! What a channel is like over a spell of samples: how often it is recorded, its noise, its
//! quantisation, and how long it may stand still by chance.
//!
//! A spell is a fixed number of samples, so the character of a channel does not depend on the
//! pieces in which a flight is read. Where a spell says nothing, the channel is as it was in the
//! spell before.

use std::ops::Range;

use super::spikes;
use crate::ingest::sample_count::nearest;
use crate::ingest::settings::Stuck;

/// The samples of a spell: some minutes of a usual recorder, long enough for statistics, short
/// against a flight.
pub const SPELL: usize = 1 << 14;

/// The longest period of a slow channel in samples of the record.
pub const LONGEST_PERIOD: usize = 40;

/// Of the distances between recorded samples, or of the changes of a held one, this share must fit
/// a period.
const FITS: f64 = 0.95;

/// Fewer changes of value than this do not tell how often a channel is recorded.
const FEW_CHANGES: usize = 20;

/// Fewer samples than this do not tell how a channel's noise repeats values.
const FEW_SAMPLES: usize = 200;

/// White noise turns around at two of three samples; motion that is recorded without noise hardly
/// ever does. Half of that is noise enough on a channel that moves.
const LEAST_TURNS: f64 = 1.0 / 3.0;

/// What noise centred on a step of the recorder repeats, in shares of what it repeats on the
/// average.
const CENTRED: f64 = 1.5;

/// Standing still is chance unless it is less likely than this in one place.
const CHANCE: f64 = 1e-12;

/// More long stand-stills than this in one spell are the channel's nature.
const MOST_RUNS: usize = 3;

/// How often a channel is recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate {
    /// Samples of the record from one recorded value to the next.
    pub period: usize,
    /// Where the value is repeated until the next one: the sample, modulo the period, in which it
    /// is new.
    pub held: Option<usize>,
}

impl Rate {
    /// A value in every sample.
    pub const FULL: Rate = Rate {
        period: 1,
        held: None,
    };
}

/// What a channel is like over one spell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Character {
    pub rate: Rate,
    /// What a spike is measured against: the noise's standard deviation, or what rounding makes of
    /// it.
    pub floor: f64,
    /// Standard deviation of the noise, in the signal's unit.
    pub noise: f64,
    /// The step of the recorder's numbers, where they have one.
    pub quantisation: Option<f64>,
    /// Recorded values that are the same as often as this, one after the other, are a channel that
    /// is stuck.
    pub stuck: Option<usize>,
}

impl Character {
    /// Nothing known yet.
    pub const UNKNOWN: Character = Character {
        rate: Rate::FULL,
        floor: 0.0,
        noise: f64::NAN,
        quantisation: None,
        stuck: None,
    };

    /// The character of a spell that begins at sample `first`, after one that was like `before`.
    pub fn of(
        values: &[f64],
        first: usize,
        step_s: f64,
        before: &Character,
        settings: &Stuck,
    ) -> Character {
        let rate = rate(values, first).unwrap_or(before.rate);
        let own: Vec<f64>;
        let recorded = if rate == Rate::FULL {
            values
        } else {
            own = recorded(values, first, rate).map(|(_, v)| v).collect();
            &own
        };
        let (floor, noise) = spikes::floors(recorded);
        let stuck = if settings.find {
            stuck(recorded, step_s * rate.period as f64, before, settings)
        } else {
            None
        };
        Character {
            rate,
            floor,
            noise,
            quantisation: quantisation(recorded),
            stuck,
        }
    }
}

/// The recorded values of a slow channel with their places.
pub fn recorded(
    values: &[f64],
    first: usize,
    rate: Rate,
) -> impl Iterator<Item = (usize, f64)> + '_ {
    let own = move |k: usize| {
        rate.held
            .is_none_or(|phase| (first + k) % rate.period == phase)
    };
    values
        .iter()
        .enumerate()
        .filter(move |(k, v)| v.is_finite() && own(*k))
        .map(|(k, v)| (k, *v))
}

/// How often the channel is recorded; none where the spell does not say.
fn rate(values: &[f64], first: usize) -> Option<Rate> {
    let known = values.iter().filter(|v| v.is_finite()).count();
    if known < FEW_CHANGES {
        return None;
    }
    if known == values.len() {
        // Most channels change so often that no period fits: these need no list of changes.
        let changed = pairs(values)
            .filter(|(before, value)| before.to_bits() != value.to_bits())
            .count();
        if changed < FEW_CHANGES {
            return None;
        }
        if !has_room(changed, values.len(), SHORTEST_PERIOD) {
            return Some(Rate::FULL);
        }
    } else if let Some(period) = between_nulls(&distances(values)) {
        return Some(Rate { period, held: None });
    }
    let changes = changes(values, first);
    if changes.len() < FEW_CHANGES {
        return None;
    }
    Some(held(&changes).unwrap_or(Rate::FULL))
}

/// How many recorded samples are how far from the one before.
fn distances(values: &[f64]) -> [usize; LONGEST_PERIOD + 1] {
    let mut distances = [0_usize; LONGEST_PERIOD + 1];
    let mut last = None;
    for (k, _) in values.iter().enumerate().filter(|(_, v)| v.is_finite()) {
        if let Some(count) = last.and_then(|last| distances.get_mut(k - last)) {
            *count += 1;
        }
        last = Some(k);
    }
    distances
}

/// The samples whose value is another than the one before.
fn changes(values: &[f64], first: usize) -> Vec<usize> {
    let mut changes = Vec::new();
    let mut before = f64::NAN;
    for (k, value) in values.iter().enumerate().filter(|(_, v)| v.is_finite()) {
        if before.is_finite() && value.to_bits() != before.to_bits() {
            changes.push(first + k);
        }
        before = *value;
    }
    changes
}

/// The distance that nearly all recorded samples have, where it is more than one; a clock of its
/// own makes it one more now and then.
fn between_nulls(distances: &[usize]) -> Option<usize> {
    let total: usize = distances.iter().sum();
    let (period, _) = distances.iter().enumerate().max_by_key(|(_, n)| **n)?;
    let near: usize = distances
        .iter()
        .skip(period.saturating_sub(1))
        .take(3)
        .sum();
    let fits = near as f64 >= FITS * total as f64 && total >= FEW_CHANGES;
    // Next to a full-rate channel's distance of one, two is a lost sample.
    (period > 1 && fits && 2 * distances.get(1).copied().unwrap_or_default() < total)
        .then_some(period)
}

/// A held channel that hardly ever changes is as well a coarse one at full rate: it changes at one
/// of so many chances.
const CHANCES: usize = 4;

/// The shortest period of a slow channel in samples of the record.
const SHORTEST_PERIOD: usize = 2;

/// Whether a span of samples has room for so many changes in one phase of a period.
fn has_room(changes: usize, span: usize, period: usize) -> bool {
    (FITS * changes as f64 - 1.0) * period as f64 <= span as f64
}

/// The longest period of which nearly all changes keep one phase.
fn held(changes: &[usize]) -> Option<Rate> {
    let span = changes.last()? - changes.first()?;
    let of_period = |period: usize| {
        // Too few to tell, or more than there is room for in one phase: most channels are recorded
        // in every sample.
        if CHANCES * changes.len() * period < span || !has_room(changes.len(), span, period) {
            return None;
        }
        let mut phases = vec![0_usize; period];
        for change in changes {
            phases[change % period] += 1;
        }
        let (phase, most) = phases.iter().enumerate().max_by_key(|(_, n)| **n)?;
        (*most as f64 >= FITS * changes.len() as f64).then_some(Rate {
            period,
            held: Some(phase),
        })
    };
    (SHORTEST_PERIOD..=LONGEST_PERIOD).rev().find_map(of_period)
}

/// The runs of one value in at least so many samples, one after the other. Not every sample is
/// looked at: a run that is long enough holds one of every `least`.
pub fn long_runs(values: &[f64], least: usize) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut from = 0;
    while let Some(value) = values.get(from + least.max(1) - 1).copied() {
        let at = from + least.max(1) - 1;
        let same = |v: &&f64| value.is_finite() && v.to_bits() == value.to_bits();
        let start = at - values[from..at].iter().rev().take_while(same).count();
        let end = at + 1 + values[at + 1..].iter().take_while(same).count();
        if value.is_finite() && end - start >= least {
            runs.push(start..end);
        }
        from = end;
    }
    runs
}

/// How many recorded values may be the same one after the other: only a channel whose noise changes
/// most of them can be stuck.
fn stuck(values: &[f64], step_s: f64, before: &Character, settings: &Stuck) -> Option<usize> {
    let least = nearest(settings.least_s / step_s).max(4);
    let known = values.iter().filter(|v| v.is_finite()).count();
    let first = values.first().is_some_and(|v| v.is_finite());
    let anew =
        |(before, value): &(&f64, &f64)| value.is_finite() && value.to_bits() != before.to_bits();
    let runs = usize::from(first) + pairs(values).filter(anew).count();
    let long = long_runs(values, least / 3);
    let (lasting, samples) = long
        .iter()
        .map(Range::len)
        .filter(|n| *n >= least)
        .fold((0, 0), |(r, s), n| (r + 1, s + n));
    if known - samples < FEW_SAMPLES {
        return before.stuck;
    }
    let repeats = 1.0 - (runs - lasting) as f64 / (known - samples) as f64;
    if repeats > settings.most_repeats || turns(values) < LEAST_TURNS {
        return None;
    }
    let chance = CHANCE.ln() / (CENTRED * repeats).max(f64::EPSILON).ln();
    let longest = least.max(nearest(chance));
    // The runs at the ends may be parts of longer ones. Between chance and stuck there is nothing.
    let finite = |v: &f64| v.is_finite();
    let (first, last) = (
        values.iter().position(finite)?,
        values.iter().rposition(finite)?,
    );
    let inner = long
        .iter()
        .filter(|run| !run.contains(&first) && !run.contains(&last));
    let doubtful = inner
        .map(Range::len)
        .any(|n| (longest / 3..longest).contains(&n));
    let many = long.iter().filter(|run| run.len() >= longest).count() > MOST_RUNS;
    (!doubtful && !many).then_some(longest)
}

/// Each sample with the one after it.
fn pairs(values: &[f64]) -> impl Iterator<Item = (&f64, &f64)> {
    values.iter().zip(values.get(1..).unwrap_or_default())
}

/// The share of changes that turn around.
fn turns(values: &[f64]) -> f64 {
    let (mut turns, mut all, mut last, mut before) = (0_usize, 0_usize, 0.0_f64, f64::NAN);
    for value in values.iter().take(4096).filter(|v| v.is_finite()) {
        // Noise has no pattern: whatever a branch would guess is wrong half of the time.
        let change = value - before;
        let moves = change.abs() > 0.0;
        all += usize::from(moves) * usize::from(last != 0.0);
        turns += usize::from(moves) * usize::from(change * last < 0.0);
        last = if moves { change } else { last };
        before = *value;
    }
    turns as f64 / all.max(1) as f64
}

/// Changes of value that are looked at for the recorder's step.
const CHANGES: usize = 512;

/// How far a change may be off a whole number of steps, in steps.
const OFF_GRID: f64 = 0.05;

/// The step of the recorder's numbers: the smallest change between neighbours, where all changes
/// are multiples of it.
fn quantisation(values: &[f64]) -> Option<f64> {
    let every = (values.len() / (4 * CHANGES)).max(1);
    let change = |pair: &[f64]| (pair[1] - pair[0]).abs();
    let finest = 1e-9
        * values
            .iter()
            .take(CHANGES)
            .filter(|v| v.is_finite())
            .fold(0.0_f64, |m, v| m.max(v.abs()));
    let changes: Vec<f64> = values
        .windows(2)
        .step_by(every)
        .map(change)
        .filter(|c| *c > finest)
        .take(CHANGES)
        .collect();
    if changes.len() < FEW_CHANGES {
        return None;
    }
    let smallest = changes.iter().copied().fold(f64::INFINITY, f64::min);
    let small: Vec<f64> = changes
        .iter()
        .map(|c| c / smallest)
        .filter(|n| *n < 0.25 / OFF_GRID * 8.0)
        .collect();
    let on_grid = small
        .iter()
        .filter(|n| (*n - n.round()).abs() < OFF_GRID)
        .count();
    let share = on_grid as f64 / small.len().max(1) as f64;
    (small.len() >= FEW_CHANGES && share >= FITS).then_some(smallest)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: usize = SPELL / 2;

    /// Uniform noise between −1 and 1, the same on every run.
    fn noise(k: usize) -> f64 {
        let mut state = (k as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        state = (state ^ (state >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn spell(value: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..SPELL).map(value).collect()
    }

    fn character(values: &[f64]) -> Character {
        Character::of(values, 0, 0.025, &Character::UNKNOWN, &Stuck::default())
    }

    #[test]
    fn runs_are_found_wherever_they_lie_and_no_shorter_ones() {
        let values = [
            1.0,
            1.0,
            1.0,
            2.0,
            3.0,
            3.0,
            f64::NAN,
            f64::NAN,
            f64::NAN,
            4.0,
            4.0,
            4.0,
            4.0,
            0.0,
            -0.0,
            0.0,
        ];
        assert_eq!(long_runs(&values, 3), [0..3, 9..13]);
        assert_eq!(long_runs(&values, 2), [0..3, 4..6, 9..13]);
        assert_eq!(long_runs(&values, 1).len(), 7);
        assert!(long_runs(&values, 5).is_empty());
        assert!(long_runs(&[], 3).is_empty());
        for start in 0..20 {
            let mut values: Vec<f64> = (0..40).map(f64::from).collect();
            values[start..start + 7].fill(-1.0);
            let found = long_runs(&values, 7);
            assert_eq!((found.len(), found.first()), (1, Some(&(start..start + 7))));
        }
    }

    #[test]
    fn a_rate_is_known_by_nulls_or_by_repeated_values() {
        let nulls = spell(|k| if k % 4 == 3 { noise(k) } else { f64::NAN });
        assert_eq!(
            character(&nulls).rate,
            Rate {
                period: 4,
                held: None
            }
        );
        let held = spell(|k| noise((k + 5) / 8));
        assert_eq!(
            character(&held).rate,
            Rate {
                period: 8,
                held: Some(3)
            }
        );
        let lost = spell(|k| if k % 97 == 5 { f64::NAN } else { noise(k) });
        assert_eq!(character(&lost).rate, Rate::FULL);
    }

    #[test]
    fn a_coarse_channel_that_changes_at_equal_distances_is_at_full_rate() {
        assert_eq!(character(&spell(|k| (k / 400) as f64)).rate, Rate::FULL);
    }

    #[test]
    fn quantisation_is_the_step_of_the_numbers() {
        let coarse = character(&spell(|k| (20.0 * noise(k)).round() * 0.02 + 7.0));
        assert!((coarse.quantisation.unwrap() - 0.02).abs() < 1e-9);
        assert_eq!(character(&spell(noise)).quantisation, None);
    }

    #[test]
    fn only_noise_makes_a_stand_still_suspicious() {
        let rounded = |k: usize, by: f64| (noise(k) / by).round() * by;
        let noisy = character(&spell(|k| rounded(k, 0.2)));
        assert!(
            noisy.stuck.is_some_and(|n| (40..80).contains(&n)),
            "{noisy:?}"
        );
        assert_eq!(character(&spell(|k| rounded(k, 2.5))).stuck, None);
        assert_eq!(character(&spell(|k| (k as f64 * 0.01).sin())).stuck, None);
        // A spell that is stuck throughout is like the one before.
        let after = Character::of(&spell(|_| 3.0), SPELL, 0.025, &noisy, &Stuck::default());
        assert_eq!(after.stuck, noisy.stuck);
        let often = spell(|k| if k % 1000 < 100 { 0.4 } else { rounded(k, 0.2) });
        assert_eq!(character(&often).stuck, None);
        let once = spell(|k| {
            if (HALF..HALF + 100).contains(&k) {
                0.4
            } else {
                rounded(k, 0.2)
            }
        });
        assert!(character(&once).stuck.is_some());
        // Where nothing was recorded between the test points, nothing stands still.
        let points = spell(|k| {
            if k % 2000 < 1200 {
                f64::NAN
            } else {
                rounded(k, 0.2)
            }
        });
        assert_eq!(character(&points).stuck, noisy.stuck);
    }
}
