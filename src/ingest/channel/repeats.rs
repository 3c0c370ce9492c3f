//! Repeated values of a channel: the criteria by which an unchanged value means that it is stuck.

use std::ops::Range;

use super::update_rate::Changes;
use crate::ingest::settings::Stuck;
use crate::numerics::series::sample_count::nearest;

/// Least number of samples from which the probability of a repeat by noise is estimated.
const LEAST_SAMPLES: usize = 200;

/// Least share of changes that reverse their direction on a noisy channel: half of white noise's
/// two thirds. Motion that is recorded without noise hardly ever reverses.
const LEAST_TURNS: f64 = 1.0 / 3.0;

/// Samples from which the share of reversals is estimated: its standard error then is under 1 %.
const TURN_SAMPLES: usize = 4096;

/// Largest ratio of the repeats of noise centred on a quantisation step to the average repeats. White normal
/// noise has 1.27 at most, with a standard deviation of 0.24 steps; the rest is margin for other noise.
const CENTRED_REPEATS: f64 = 1.5;

/// Probability of a run of equal values below which it is not chance: once in 10¹² samples, far
/// more than a campaign has.
const LEAST_PROBABILITY: f64 = 1e-12;

/// Largest number of stuck runs in one spell; with more, unchanged values are normal for the
/// channel. Trade-off: a channel that sticks more often in one spell is kept as recorded. With a
/// larger number, a channel that rests from time to time would lose its rests.
const MOST_RUNS: usize = 3;

/// Ratio of the shortest stuck run to the shortest run that is examined. Runs between the two
/// lengths mean that the channel is not stuck.
const SHORTER_RUNS: usize = 3;

/// Lower limit of the length of a stuck run, for sampling rates at which the configured time is
/// shorter. Coarse noise often gives three equal samples.
const LEAST_RUN: usize = 4;

/// Length of the runs of equal values that a spell shows to be stuck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StuckRun {
    /// Runs of at least this number of samples are stuck.
    AtLeast(usize),
    /// Unchanged values are normal for the channel.
    Never,
    /// Too few samples to decide.
    Undecided,
}

/// Runs of one value in at least `least` samples, in order. Only every `least`-th sample is
/// examined: each long run contains one.
pub fn long_runs(values: &[f64], least: usize) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut from = 0;
    while let Some(value) = values.get(from + least.max(1) - 1).copied() {
        let at = from + least.max(1) - 1;
        let is_same = |v: &&f64| value.is_finite() && v.to_bits() == value.to_bits();
        let start = at - values[from..at].iter().rev().take_while(is_same).count();
        let end = at + 1 + values[at + 1..].iter().take_while(is_same).count();
        if value.is_finite() && end - start >= least {
            runs.push(start..end);
        }
        from = end;
    }
    runs
}

/// Finds the length from which a run of equal values is stuck. Only a channel whose noise changes
/// most of its values can be stuck.
pub fn stuck_run(values: &[f64], step_s: f64, settings: &Stuck) -> StuckRun {
    let least = nearest(settings.least_s / step_s).max(LEAST_RUN);
    let runs = long_runs(values, least / SHORTER_RUNS);
    let Some(repeats) = repeat_share(values, &runs, least) else {
        return StuckRun::Undecided;
    };
    if repeats > settings.most_repeats || turn_share(values) < LEAST_TURNS {
        return StuckRun::Never;
    }
    let by_chance = LEAST_PROBABILITY.ln() / (CENTRED_REPEATS * repeats).max(f64::EPSILON).ln();
    let longest = least.max(nearest(by_chance));
    let finite = |v: &f64| v.is_finite();
    let (first, last) = (
        values.iter().position(finite).unwrap_or_default(),
        values.iter().rposition(finite).unwrap_or_default(),
    );
    // The runs at the ends may be parts of longer ones. A stuck channel has no runs of lengths
    // between chance and stuck.
    let is_inner = |run: &&Range<usize>| !run.contains(&first) && !run.contains(&last);
    let doubtful = longest / SHORTER_RUNS..longest;
    let is_doubtful = runs
        .iter()
        .filter(is_inner)
        .any(|run| doubtful.contains(&run.len()));
    let stuck = runs.iter().filter(|run| run.len() >= longest).count();
    if is_doubtful || stuck > MOST_RUNS {
        StuckRun::Never
    } else {
        StuckRun::AtLeast(longest)
    }
}

/// Share of values that repeat the one before, outside runs of `least` samples and more; `None` if
/// there are too few.
fn repeat_share(values: &[f64], runs: &[Range<usize>], least: usize) -> Option<f64> {
    let changes = Changes::of(values);
    let lasting = runs.iter().map(Range::len).filter(|n| *n >= least);
    let (lasting, in_lasting) = lasting.fold((0, 0), |(runs, samples), n| (runs + 1, samples + n));
    let samples = changes.finite - in_lasting;
    (samples >= LEAST_SAMPLES).then(|| 1.0 - (changes.runs() - lasting) as f64 / samples as f64)
}

/// Share of changes of value whose direction is opposite to that of the change before.
fn turn_share(values: &[f64]) -> f64 {
    let (mut turns, mut all, mut last, mut before) = (0_usize, 0_usize, 0.0_f64, f64::NAN);
    for value in values.iter().take(TURN_SAMPLES).filter(|v| v.is_finite()) {
        // Without branches: on noise half of their predictions would be wrong.
        let change = value - before;
        let moves = change.abs() > 0.0;
        all += usize::from(moves) * usize::from(last != 0.0);
        turns += usize::from(moves) * usize::from(change * last < 0.0);
        last = if moves { change } else { last };
        before = *value;
    }
    turns as f64 / all.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
