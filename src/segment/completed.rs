//! Steps of a surface that turbulence hides. Where feedback makes a surface work its smallest step is raised above what it
//! does by itself, and the halves of a doublet, away from trim and back to it, may be smaller than that.
//!
//! Steps that follow each other closely begin and end with a half, and lead from a level back to it. Where the first or the
//! last is as large as a reversal beside its neighbour, or where the levels do not meet, a deflection before or after them
//! that is half as large is a step too. A single step that nothing completes and that is hardly larger than the smallest is
//! a gust's.

use super::candidates::TRIM_SHARE;
use super::steps::Steps;
use super::{Settings, Step};

/// A step that nothing completes is somebody's when it is so many times the smallest: as large as a reversal.
const REVERSAL: f64 = 2.0;

/// Beside a half a reversal is twice as large, beside another reversal as large: between the two in the sense of ratios.
const REVERSES: f64 = std::f64::consts::SQRT_2;

/// Completes the steps of the surfaces whose smallest step turbulence has raised.
pub(super) fn complete(steps: &mut Steps, deflections: &Steps, settings: &Settings) {
    for (signal, found) in &mut steps.of {
        let noise = steps.noise.get(signal).copied().unwrap_or_default();
        if noise > 0.0 && !settings.pilot_controls.contains(signal) {
            let hidden = deflections.of.get(signal).map_or(&[][..], Vec::as_slice);
            let smallest = steps.smallest.get(signal).copied().unwrap_or(f64::INFINITY);
            *found = completed(found, hidden, (smallest, noise), settings.longest_hold_s);
        }
    }
}

fn completed(steps: &[Step], deflections: &[Step], (smallest, noise): (f64, f64), hold_s: f64) -> Vec<Step> {
    let groups: Vec<&[Step]> = steps.chunk_by(|a, b| b.time_s - a.time_s <= hold_s).collect();
    let mut all = Vec::new();
    for (k, group) in groups.iter().enumerate() {
        let ([first, ..], [.., last]) = (group, group) else { continue };
        let before_s = k.checked_sub(1).and_then(|k| groups[k].last()).map_or(f64::NEG_INFINITY, |s| s.time_s);
        let after_s = groups.get(k + 1).and_then(|g| g.first()).map_or(f64::INFINITY, |s| s.time_s);
        let earlier = within(deflections, (before_s.max(first.time_s - hold_s), first.time_s));
        let later = within(deflections, (last.time_s, after_s.min(last.time_s + hold_s)));
        let opens = halves(&earlier, first, group.get(1));
        let closes = halves(&later, last, group.len().checked_sub(2).and_then(|k| group.get(k)));
        let largest = group.iter().map(|s| s.change().abs()).fold(0.0, f64::max);
        let ends = ends(group, &opens, &closes, TRIM_SHARE * largest + noise);
        if ends.is_some() || group.len() > 1 || largest >= REVERSAL * smallest {
            let (opening, closing) = ends.unwrap_or((opens.sure, closes.sure));
            all.extend(opening.into_iter().chain(group.iter().copied()).chain(closing));
        }
    }
    all
}

/// The deflections after the one time and before the other.
fn within(deflections: &[Step], (after_s, before_s): (f64, f64)) -> Vec<Step> {
    deflections.iter().filter(|d| d.time_s > after_s && d.time_s < before_s).copied().collect()
}

/// Deflections that may be the hidden half at one end of steps.
struct Halves {
    possible: Vec<Step>,
    /// The one that must be, for the step at the end is a reversal.
    sure: Option<Step>,
}

/// The deflections that lead about half as far as the step at the end, to the other side; none where that is a half itself
/// beside its neighbour.
fn halves(deflections: &[Step], end: &Step, neighbour: Option<&Step>) -> Halves {
    let share = |d: &Step| -d.change() / end.change();
    let is_half = |d: &&Step| (TRIM_SHARE..=1.0 - TRIM_SHARE).contains(&share(d));
    let mut possible: Vec<Step> = deflections.iter().filter(is_half).copied().collect();
    let beside = neighbour.map_or(1.0, |n| (end.change() / n.change()).abs());
    if beside < 1.0 / REVERSES {
        possible.clear();
    }
    let largest = possible.iter().max_by(|a, b| a.change().abs().total_cmp(&b.change().abs())).copied();
    let sure = largest.filter(|_| beside >= REVERSES);
    if let Some(sure) = sure {
        possible = vec![sure];
    }
    Halves { possible, sure }
}

/// The deflections, as few as possible but those that must be, with which steps end near where they begin; none where there
/// are no such.
fn ends(group: &[Step], opens: &Halves, closes: &Halves, near: f64) -> Option<(Option<Step>, Option<Step>)> {
    let (first, last) = (group.first()?, group.last()?);
    let choices = |halves: &Halves| -> Vec<Option<Step>> {
        let without = std::iter::once(None).filter(|_: &Option<Step>| halves.sure.is_none());
        without.chain(halves.possible.iter().copied().map(Some)).collect()
    };
    let mut best: Option<(usize, f64, (Option<Step>, Option<Step>))> = None;
    for opening in choices(opens) {
        for closing in choices(closes) {
            let count = usize::from(opening.is_some()) + usize::from(closing.is_some());
            let off = (closing.as_ref().unwrap_or(last).after - opening.as_ref().unwrap_or(first).before).abs();
            let better = best.as_ref().is_none_or(|b| (count, off) < (b.0, b.1));
            if off <= near && better {
                best = Some((count, off, (opening, closing)));
            }
        }
    }
    best.map(|(_, _, ends)| ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps from one level to the next.
    fn levels(trim: f64, all: &[(f64, f64)]) -> Vec<Step> {
        let mut level = trim;
        let step = |(time_s, change): &(f64, f64)| {
            let before = level;
            level += change;
            Step { time_s: *time_s, before, after: level }
        };
        all.iter().map(step).collect()
    }

    fn times(steps: &[Step]) -> Vec<f64> {
        steps.iter().map(|s| s.time_s).collect()
    }

    #[test]
    fn halves_of_a_doublet_that_turbulence_hides_are_steps_and_gusts_are_none() {
        let all = levels(-3.0, &[(10.0, 3.0), (11.0, -6.0), (12.0, 3.1)]);
        let gusts = [Step { time_s: 8.5, before: -3.9, after: -1.9 }, Step { time_s: 13.5, before: -3.0, after: -1.0 }];
        let deflections: Vec<Step> = [&gusts[..1], &all, &gusts[1..]].concat();
        for seen in [&all[..], &all[1..], &all[..2], &all[1..2]] {
            let completed = completed(seen, &deflections, (3.5, 0.5), 4.0);
            assert!(times(&completed) == [10.0, 11.0, 12.0], "{:?} from {:?}", times(&completed), times(seen));
        }
    }

    #[test]
    fn where_the_level_wanders_by_as_much_as_a_half_the_sizes_tell() {
        let half = Step { time_s: 10.0, before: -5.5, after: -2.4 };
        let seen =
            [Step { time_s: 11.0, before: -5.8, after: -14.6 }, Step { time_s: 12.0, before: -10.3, after: -5.1 }];
        assert_eq!(times(&completed(&seen, &[&[half][..], &seen].concat(), (3.8, 0.9), 4.0)), [10.0, 11.0, 12.0]);
    }

    #[test]
    fn steps_that_begin_and_end_with_halves_need_none_wherever_they_end() {
        let all = levels(0.0, &[(10.0, 4.0), (11.0, -8.0), (12.0, 8.0), (13.0, -4.0), (15.0, 5.0)]);
        let gust = Step { time_s: 8.5, before: 5.0, after: 3.0 };
        assert_eq!(completed(&all[..4], &[&[gust][..], &all].concat(), (3.5, 0.5), 1.9).len(), 4);
    }

    #[test]
    fn a_single_step_that_nothing_completes_is_a_gust_s_unless_it_is_as_large_as_a_reversal() {
        assert!(completed(&levels(0.0, &[(10.0, 4.0)]), &[], (3.5, 0.5), 4.0).is_empty());
        assert_eq!(completed(&levels(0.0, &[(10.0, 8.0)]), &[], (3.5, 0.5), 4.0).len(), 1);
        // Others stay as they are seen.
        assert_eq!(completed(&levels(0.0, &[(10.0, 4.0), (11.0, -9.0)]), &[], (3.5, 0.5), 4.0).len(), 2);
    }
}
