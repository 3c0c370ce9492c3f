//! Choice of windows: the parts of a flight in which its instruments move most.

use std::collections::BTreeSet;
use std::ops::Range;

use super::decimation::decimation;
use super::parameters::{INPUTS, SIGNALS};
use super::settings::Compatibility;
use super::window::margin;
use crate::flight::{Record, signal as s};
use crate::numerics::series::sample_count::nearest;

/// Largest pitch attitude, deg: beyond it the Euler angles are close to their singularity.
const STEEPEST_DEG: f64 = 75.0;

/// Largest reading of the vane of α, deg: beyond it the flow turns away from the vane's axis.
const LARGEST_ALPHA_DEG: f64 = 85.0;

/// Largest reading of the vane of β, deg: as for α.
const LARGEST_BETA_DEG: f64 = 60.0;

/// Least airspeed, ft/s: below it the vanes and the airspeed sensor do not respond.
const SLOWEST_FT_S: f64 = 50.0;

/// States, with the change in one sample beyond which a state has jumped, if it hardly moves before and after: parts of
/// a flight are joined there, frames are lost, or an instrument is set. Angles in deg, airspeed in ft/s, altitude in ft.
const JUMPS: [(&str, f64); 5] = [
    (s::PHI, 5.0),
    (s::THETA, 5.0),
    (s::PSI, 5.0),
    (s::VELOCITY, 20.0),
    (s::ALTITUDE, 200.0),
];

/// Ratio of a jump to the changes two samples before and after it. Between samples that are interpolated to the record's
/// clock a jump takes two.
const JUMP_RATIO: f64 = 5.0;

/// Multiple of the sizes in [`JUMPS`] that is a jump whatever is around it: a quarter turn of an angle that wraps to and
/// fro.
const SURE_JUMP: f64 = 18.0;

/// Chooses at most `most` windows of a record, in order of time. Each signal in turn proposes the
/// remaining window in which it moves most.
pub fn choose_windows(record: &Record, most: usize, settings: &Compatibility) -> Vec<Range<usize>> {
    let usable = usable_windows(record, settings);
    let activity: Vec<Vec<f64>> = SIGNALS
        .iter()
        .map(|name| activity(record, name, &usable))
        .collect();
    let mut chosen = vec![false; usable.len()];
    let mut count = 0;
    'rounds: loop {
        let before = count;
        for ranks in &activity {
            if count >= most {
                break 'rounds;
            }
            let left = (0..usable.len()).filter(|&i| !chosen[i] && ranks[i] > 0.0);
            if let Some(best) = left.max_by(|&a, &b| ranks[a].total_cmp(&ranks[b]).then(b.cmp(&a)))
            {
                chosen[best] = true;
                count += 1;
            }
        }
        if count == before {
            break;
        }
    }
    let with_choice = usable.into_iter().zip(chosen);
    with_choice
        .filter(|(_, chosen)| *chosen)
        .map(|(range, _)| range)
        .collect()
}

/// Factor by which the only window of a record may be shorter than the configured length.
const ONLY_WINDOW_SHORTER: usize = 4;

/// Windows of the configured length, or at least half of it, over which the equations can be
/// integrated. A record that is too short has one window, its longest usable part.
fn usable_windows(record: &Record, settings: &Compatibility) -> Vec<Range<usize>> {
    let decimation = decimation(record.step_s);
    let length = nearest(settings.window_s / record.step_s).max(2 * decimation);
    let margin = decimation * margin(settings, decimation as f64 * record.step_s);
    let mut found = Vec::new();
    for run in usable_runs(record) {
        let mut first = run.start + margin;
        while first + length / 2 + margin <= run.end {
            let end = (first + length).min(run.end - margin);
            found.push(first..end);
            first = end;
        }
    }
    if found.is_empty() {
        let runs = usable_runs(record).into_iter();
        let inner = runs.map(|run| run.start + margin..run.end.saturating_sub(margin));
        let longest = inner.max_by_key(ExactSizeIterator::len);
        found.extend(longest.filter(|run| run.len() >= length / ONLY_WINDOW_SHORTER));
    }
    found
}

/// Runs of samples in which every input is finite and the attitude is away from the singularity.
fn usable_runs(record: &Record) -> Vec<Range<usize>> {
    let values = |name: &str| record.values(name).unwrap_or_default();
    let needed = SIGNALS[..INPUTS]
        .iter()
        .chain(&[s::PHI, s::X_CG, s::Y_CG, s::Z_CG, s::ALTITUDE]);
    let finite: Vec<&[f64]> = needed.map(|name| values(name)).collect();
    let (theta, alpha, beta) = (
        values(s::THETA),
        values(s::ALPHA_VANE),
        values(s::BETA_VANE),
    );
    let (velocity, psi) = (values(s::VELOCITY), record.values(s::PSI));
    let at = |values: &[f64], k: usize| values.get(k).copied().unwrap_or(f64::NAN);
    let is_usable = |k: usize| {
        finite.iter().all(|values| at(values, k).is_finite())
            && at(theta, k).abs() < STEEPEST_DEG
            && at(alpha, k).abs() < LARGEST_ALPHA_DEG
            && at(beta, k).abs() < LARGEST_BETA_DEG
            && at(velocity, k) > SLOWEST_FT_S
            && psi.is_none_or(|psi| at(psi, k).is_finite())
    };
    let jumped = JUMPS
        .iter()
        .flat_map(|(name, size)| jumps(values(name), *size));
    let jumped: BTreeSet<usize> = jumped.collect();
    let mut runs: Vec<Range<usize>> = Vec::new();
    for k in (0..record.samples).filter(|k| is_usable(*k)) {
        match runs.last_mut() {
            Some(run) if run.end == k && !jumped.contains(&k) => run.end = k + 1,
            _ => runs.push(k..k + 1),
        }
    }
    runs
}

/// Samples to which a state jumps; `size` is that of its jumps.
fn jumps(values: &[f64], size: f64) -> impl Iterator<Item = usize> {
    let change = |k: usize| match (values.get(k.wrapping_sub(1)), values.get(k)) {
        (Some(before), Some(after)) => (after - before).abs(),
        _ => 0.0,
    };
    let is_jump = move |k: &usize| {
        let own = change(*k);
        own > size && {
            let around = change(k.saturating_sub(2)).max(change(k + 2));
            own > JUMP_RATIO * around || own > SURE_JUMP * size
        }
    };
    (1..values.len()).filter(is_jump)
}

/// Activity of a signal in each window: the mean square of its change over a second.
fn activity(record: &Record, name: &str, windows: &[Range<usize>]) -> Vec<f64> {
    let reach = nearest(1.0 / record.step_s).max(1);
    let values = record.values(name).unwrap_or_default();
    let moved = |range: &Range<usize>| {
        let values = values.get(range.clone()).unwrap_or_default();
        let changes = values
            .iter()
            .zip(values.get(reach..).unwrap_or_default())
            .map(|(a, b)| (b - a).powi(2));
        let (sum, count) = changes
            .filter(|c| c.is_finite())
            .fold((0.0, 0_usize), |(s, n), c| (s + c, n + 1));
        sum / count.max(1) as f64
    };
    windows.iter().map(moved).collect()
}
