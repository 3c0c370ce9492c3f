//! Steps of a surface that turbulence hides. Where feedback makes a surface work its smallest step
//! is raised above what it does by itself, and the halves of a doublet, away from trim and back to
//! it, may be smaller than that.
//!
//! Steps that follow each other closely begin and end with a half. Where the first or the last of
//! them is more than a half beside its neighbour, a deflection to the other side that is half as
//! large is a step too, if turbulence hardly makes one or if there must be one. A single step that
//! is not much larger than the smallest and has no halves is a gust's.

use super::candidates::TRIM_SHARE;
use super::steps::Steps;
use super::{Settings, Step};

/// A single step is somebody's when it is so many times the smallest: as large as a reversal.
const REVERSAL: f64 = 2.0;

/// A reversal is twice a half; where the actuator takes as long as the detector looks it is seen as
/// √2 of it, and beside another reversal as large as that. Between the two in the sense of ratios.
const REVERSES: f64 = 1.2;

/// A deflection of so many standard deviations of what turbulence does is hardly its own.
const HARDLY: f64 = 3.0;

/// Completes the own steps of the surfaces whose smallest step turbulence has raised.
pub(super) fn complete(steps: &mut Steps, deflections: &Steps, settings: &Settings) {
    for (signal, found) in &mut steps.of {
        let noise = steps.noise.get(signal).copied().unwrap_or_default();
        if noise > 0.0 {
            let hidden = deflections.of.get(signal).map_or(&[][..], Vec::as_slice);
            let smallest = steps.smallest.get(signal).copied().unwrap_or(f64::INFINITY);
            *found = completed(found, hidden, (smallest, noise), settings.longest_hold_s);
        }
    }
}

fn completed(
    steps: &[Step],
    deflections: &[Step],
    (smallest, noise): (f64, f64),
    hold_s: f64,
) -> Vec<Step> {
    let groups: Vec<&[Step]> = steps
        .chunk_by(|a, b| b.time_s - a.time_s <= hold_s)
        .collect();
    let mut all = Vec::new();
    for (k, group) in groups.iter().enumerate() {
        let ([first, ..], [.., last]) = (group, group) else {
            continue;
        };
        let before_s = k
            .checked_sub(1)
            .and_then(|k| groups[k].last())
            .map_or(f64::NEG_INFINITY, |s| s.time_s);
        let after_s = groups
            .get(k + 1)
            .and_then(|g| g.first())
            .map_or(f64::INFINITY, |s| s.time_s);
        let earlier = within(
            deflections,
            (before_s.max(first.time_s - hold_s), first.time_s),
        );
        let later = within(
            deflections,
            (last.time_s, after_s.min(last.time_s + hold_s)),
        );
        let opening = half(&earlier, first, group.get(1), noise);
        let closing = half(
            &later,
            last,
            group.len().checked_sub(2).and_then(|k| group.get(k)),
            noise,
        );
        let alone = group.len() == 1 && first.change().abs() < REVERSAL * smallest;
        if !alone || (opening.is_some() && closing.is_some()) {
            all.extend(
                opening
                    .into_iter()
                    .chain(group.iter().copied())
                    .chain(closing),
            );
        }
    }
    all
}

/// The deflections after the one time and before the other.
fn within(deflections: &[Step], (after_s, before_s): (f64, f64)) -> Vec<Step> {
    deflections
        .iter()
        .filter(|d| d.time_s > after_s && d.time_s < before_s)
        .copied()
        .collect()
}

/// The hidden half beside the step at one end: the largest deflection to the other side that is
/// about half of it, or less by no more than two standard deviations of what turbulence does. None
/// where that step is a half itself beside its neighbour.
fn half(deflections: &[Step], end: &Step, neighbour: Option<&Step>, noise: f64) -> Option<Step> {
    let beside = neighbour.map_or(1.0, |n| (end.change() / n.change()).abs());
    let hardly = if beside < REVERSES {
        HARDLY * noise
    } else {
        0.0
    };
    let least = hardly.max(0.5 * end.change().abs() - 2.0 * noise);
    let share = |d: &Step| -d.change() / end.change();
    let is_half = |d: &&Step| {
        (TRIM_SHARE..=1.0 - TRIM_SHARE).contains(&share(d)) && d.change().abs() >= least
    };
    let halves = deflections
        .iter()
        .filter(is_half)
        .filter(|_| beside > 1.0 / REVERSES);
    halves
        .max_by(|a, b| a.change().abs().total_cmp(&b.change().abs()))
        .copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps from one level to the next.
    fn levels(all: &[(f64, f64)]) -> Vec<Step> {
        let mut level = 0.0;
        let step = |(time_s, change): &(f64, f64)| {
            let before = level;
            level += change;
            Step {
                time_s: *time_s,
                before,
                after: level,
            }
        };
        all.iter().map(step).collect()
    }

    fn times(steps: &[Step], deflections: &[Step]) -> Vec<f64> {
        completed(steps, deflections, (4.0, 1.0), 4.0)
            .iter()
            .map(|s| s.time_s)
            .collect()
    }

    #[test]
    fn halves_of_a_doublet_that_turbulence_hides_are_steps_and_gusts_are_none() {
        let all = levels(&[
            (8.5, 2.0),
            (10.0, 3.2),
            (11.0, -6.4),
            (12.0, 3.3),
            (13.5, 2.0),
        ]);
        for seen in [&all[1..4], &all[2..4], &all[1..3], &all[2..3]] {
            assert_eq!(times(seen, &all), [10.0, 11.0, 12.0]);
        }
        // Of two steps alike the one may be a half: only what is hardly a gust's goes with them.
        let pair = levels(&[(8.5, 2.0), (10.0, -5.0), (11.0, 5.0), (12.5, -2.0)]);
        assert_eq!(times(&pair[1..3], &pair), [10.0, 11.0]);
    }

    #[test]
    fn steps_that_begin_and_end_with_halves_need_no_others() {
        let all = levels(&[
            (8.5, -3.5),
            (10.0, 5.0),
            (11.0, -8.0),
            (12.0, 5.0),
            (13.5, -3.5),
        ]);
        assert_eq!(times(&all[1..4], &all), [10.0, 11.0, 12.0]);
        // Steps so large that a half could not be hidden.
        let wide = levels(&[(8.5, 3.2), (10.0, -11.0), (11.0, 12.0), (12.0, -10.0)]);
        assert_eq!(times(&wide[1..], &wide), [10.0, 11.0, 12.0]);
    }

    #[test]
    fn a_single_step_without_halves_is_a_gust_s_unless_it_is_as_large_as_a_reversal() {
        assert!(times(&levels(&[(10.0, 5.0)]), &[]).is_empty());
        assert_eq!(times(&levels(&[(10.0, 9.0)]), &[]), [10.0]);
        assert_eq!(
            times(&levels(&[(10.0, 5.0), (11.0, -9.0)]), &[]),
            [10.0, 11.0]
        );
    }
}
