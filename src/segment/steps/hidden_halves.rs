//! Hidden halves of doublets: steps of a surface that turbulence hides.
//!
//! If feedback moves a surface in turbulence, its smallest step is raised above the noise. The
//! halves of a doublet, away from trim and back to it, may be smaller than that.
//!
//! Steps that follow each other closely begin and end with a half. The first or last step may be
//! larger than half of its neighbour. A deflection to the other side of about half its size then
//! becomes a step. If that step may be a half itself, the deflection must clearly exceed the noise.
//! A lone step near the smallest size and without halves is attributed to a gust.

use super::step::{Step, Steps, TRIM_SHARE};
use crate::segment::settings::Settings;

/// A lone step counts as commanded from this many times the smallest step: the size of a reversal.
const LONE_STEP: f64 = 2.0;

/// Ratio of two neighbouring steps above which the larger is a reversal and the smaller a half.
///
/// Equal steps have the ratio 1. A reversal is twice a half. It is detected as √2 times a half if
/// the actuator takes as long as the detector's window. The limit is the geometric mean of 1 and
/// √2, rounded.
const REVERSAL_OVER_HALF: f64 = 1.2;

/// Size of a half over that of the reversal beside it.
const HALF_OF_REVERSAL: f64 = 0.5;

/// Number of noise standard deviations that turbulence rarely exceeds: 0.3 % of normal changes are
/// larger.
const BEYOND_NOISE: f64 = 3.0;

/// Number of noise standard deviations by which a detected half may be smaller than half its
/// reversal: 2 % of normal changes subtract more.
const NOISE_ON_HALF: f64 = 2.0;

/// Adds hidden halves to the uncommanded steps of surfaces whose smallest step was raised.
pub(in crate::segment) fn add_hidden_halves_of_all(
    uncommanded: &mut Steps,
    deflections: &Steps,
    settings: &Settings,
) {
    for (signal, of_signal) in &mut uncommanded.by_signal {
        if of_signal.noise > 0.0 {
            of_signal.steps = add_hidden_halves(
                &of_signal.steps,
                deflections.of(signal),
                (of_signal.smallest, of_signal.noise),
                settings.longest_hold_s,
            );
        }
    }
}

fn add_hidden_halves(
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
        let previous = k.checked_sub(1).and_then(|k| groups[k].last());
        let next = groups.get(k + 1).and_then(|group| group.first());
        let after_s = previous.map_or(f64::NEG_INFINITY, |step| step.time_s);
        let before_s = next.map_or(f64::INFINITY, |step| step.time_s);
        let earliest_s = after_s.max(first.time_s - hold_s);
        let latest_s = before_s.min(last.time_s + hold_s);
        let earlier = between(deflections, (earliest_s, first.time_s));
        let later = between(deflections, (last.time_s, latest_s));
        let second_last = group.len().checked_sub(2).and_then(|k| group.get(k));
        let opening = hidden_half(&earlier, first, group.get(1), noise);
        let closing = hidden_half(&later, last, second_last, noise);
        let is_lone = group.len() == 1 && first.size() < LONE_STEP * smallest;
        if !is_lone || (opening.is_some() && closing.is_some()) {
            all.extend(opening);
            all.extend_from_slice(group);
            all.extend(closing);
        }
    }
    all
}

/// The deflections after one time and before another, both excluded.
fn between(deflections: &[Step], (after_s, before_s): (f64, f64)) -> Vec<Step> {
    deflections
        .iter()
        .filter(|d| d.time_s > after_s && d.time_s < before_s)
        .copied()
        .collect()
}

/// The hidden half beside the step at one end of a group.
///
/// It is the largest deflection to the other side that is about half of that step, or smaller by no
/// more than [`NOISE_ON_HALF`]. `None` if the step itself is a half, compared with its neighbour.
fn hidden_half(
    deflections: &[Step],
    end: &Step,
    neighbour: Option<&Step>,
    noise: f64,
) -> Option<Step> {
    let over_neighbour = neighbour.map_or(1.0, |n| (end.change() / n.change()).abs());
    if over_neighbour <= 1.0 / REVERSAL_OVER_HALF {
        return None;
    }
    let may_be_a_half = over_neighbour < REVERSAL_OVER_HALF;
    let beyond_noise = if may_be_a_half {
        BEYOND_NOISE * noise
    } else {
        0.0
    };
    let least = beyond_noise.max(HALF_OF_REVERSAL * end.size() - NOISE_ON_HALF * noise);
    let halves = TRIM_SHARE..=1.0 - TRIM_SHARE;
    deflections
        .iter()
        .filter(|d| halves.contains(&(-d.change() / end.change())) && d.size() >= least)
        .max_by(|a, b| a.size().total_cmp(&b.size()))
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
        add_hidden_halves(steps, deflections, (4.0, 1.0), 4.0)
            .iter()
            .map(|s| s.time_s)
            .collect()
    }

    #[test]
    fn hidden_halves_of_a_doublet_become_steps_and_gusts_do_not() {
        let all = levels(&[
            (8.5, 2.0),
            (10.0, 3.2),
            (11.0, -6.4),
            (12.0, 3.3),
            (13.5, 2.0),
        ]);
        for detected in [&all[1..4], &all[2..4], &all[1..3], &all[2..3]] {
            assert_eq!(times(detected, &all), [10.0, 11.0, 12.0]);
        }
        // Of two equal steps one may be a half: they take only deflections beyond a gust's.
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
    fn a_lone_step_without_halves_is_dropped_unless_it_is_as_large_as_a_reversal() {
        assert!(times(&levels(&[(10.0, 5.0)]), &[]).is_empty());
        assert_eq!(times(&levels(&[(10.0, 9.0)]), &[]), [10.0]);
        assert_eq!(
            times(&levels(&[(10.0, 5.0), (11.0, -9.0)]), &[]),
            [10.0, 11.0]
        );
    }
}
