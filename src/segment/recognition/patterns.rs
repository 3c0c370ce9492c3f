//! Patterns of one signal in time: pulses whose lengths stand in a proportion (3-2-1-1), and swings
//! that become faster (a sweep).

use super::mismatch::Mismatch;
use crate::maneuver::{Pulses, Sweep};
use crate::numerics::statistics::mean::mean;
use crate::segment::steps::step::Step;
use crate::segment::steps::swings::Swing;

/// Parts of a sweep, the first and last of which give its ratio of frequencies.
const PARTS: usize = 3;

/// Least number of swings of a sweep: an interval for each part of it.
const FEWEST_SWINGS: usize = PARTS + 1;

/// Factor by which an interval between swings may exceed the one before and still count as not
/// slower. The times of swings have errors of some samples.
const INTERVAL_TOLERANCE: f64 = 1.1;

/// Smallest share of intervals that are not slower than the one before: a step of feedback may
/// spoil one in five.
const STEADY_SHARE: f64 = 0.8;

/// Pulses that fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PulseFit {
    /// The time unit, s.
    pub unit_s: f64,
    /// The largest difference of a pulse from its length, in units.
    pub deviation: f64,
}

/// Fits the steps of a signal to the edges of pulses, each to the other side than the one before.
///
/// The unit minimises the squared differences of the pulses from their lengths.
///
/// # Errors
/// The mismatch.
pub(super) fn fit_pulses(steps: &[&Step], wanted: &Pulses) -> Result<PulseFit, Mismatch> {
    let edges = reversal_times(steps);
    let widths: Vec<f64> = edges.windows(2).map(|e| e[1] - e[0]).collect();
    let (n, most) = (widths.len(), wanted.widths.len());
    if n != most {
        let reason = format!("makes {n} pulses, {most} wanted");
        return Err(if n < most {
            Mismatch::shortfall(reason)
        } else {
            Mismatch::contradiction(reason)
        });
    }
    let pairs = || wanted.widths.iter().zip(&widths);
    let squares: f64 = wanted.widths.iter().map(|w| w * w).sum();
    let products: f64 = pairs().map(|(w, s)| w * s).sum();
    let unit_s = products / squares.max(f64::MIN_POSITIVE);
    let deviation = pairs()
        .map(|(w, s)| (s / unit_s - w).abs())
        .fold(0.0, f64::max);
    if deviation > wanted.tolerance {
        let units: Vec<String> = widths
            .iter()
            .map(|s| format!("{:.1}", s / unit_s))
            .collect();
        return Err(Mismatch::contradiction(format!(
            "makes pulses of {} units of {unit_s:.2} s",
            units.join(", ")
        )));
    }
    let (shortest, longest) = wanted.unit_s;
    if !(shortest..=longest).contains(&unit_s) {
        return Err(Mismatch::contradiction(format!(
            "makes pulses of unit {unit_s:.2} s, {shortest} to {longest} s wanted"
        )));
    }
    Ok(PulseFit { unit_s, deviation })
}

/// Times at which a signal changes sides; of steps to one side in a row, the time of the largest.
fn reversal_times(steps: &[&Step]) -> Vec<f64> {
    steps
        .chunk_by(|a, b| a.change() * b.change() > 0.0)
        .map(|run| {
            run.iter()
                .max_by(|a, b| a.size().total_cmp(&b.size()))
                .map_or(f64::NAN, |s| s.time_s)
        })
        .collect()
}

/// Checks that swings become faster as those of a sweep; returns the ratio of the last third's
/// frequency to the first third's.
///
/// # Errors
/// The mismatch.
pub(super) fn fit_sweep(swings: &[Swing], wanted: &Sweep) -> Result<f64, Mismatch> {
    let n = swings.len();
    if n < wanted.at_least.max(FEWEST_SWINGS) {
        let reason = format!("makes {n} swings, at least {} wanted", wanted.at_least);
        return Err(Mismatch::shortfall(reason));
    }
    let intervals: Vec<f64> = swings
        .windows(2)
        .map(|s| s[1].middle_s() - s[0].middle_s())
        .collect();
    let third = (intervals.len() / PARTS).max(1);
    let first_third = mean(intervals[..third].iter().copied());
    let last_third = mean(intervals[intervals.len() - third..].iter().copied());
    let ratio = first_third / last_third;
    if ratio < wanted.ratio {
        return Err(Mismatch::contradiction(format!(
            "becomes {ratio:.1} times as fast, {} wanted",
            wanted.ratio
        )));
    }
    let not_slower = intervals
        .windows(2)
        .filter(|t| t[1] < INTERVAL_TOLERANCE * t[0])
        .count();
    let steady = not_slower as f64 / (intervals.len() - 1) as f64;
    if steady < STEADY_SHARE {
        let reason = "does not become steadily faster".to_owned();
        return Err(Mismatch::contradiction(reason));
    }
    Ok(ratio)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    fn edges(all: &[(f64, f64)]) -> Vec<Step> {
        all.iter()
            .map(|(time_s, change)| Step {
                time_s: *time_s,
                before: 0.0,
                after: *change,
            })
            .collect()
    }

    fn fit(all: &[(f64, f64)]) -> Result<PulseFit, Mismatch> {
        let wanted = Pulses {
            widths: vec![3.0, 2.0, 1.0, 1.0],
            unit_s: (0.2, 2.0),
            tolerance: 0.5,
        };
        let steps = edges(all);
        fit_pulses(&steps.iter().collect::<Vec<_>>(), &wanted)
    }

    #[test]
    fn pulses_of_three_two_one_one_have_their_unit_whatever_their_sign() {
        for sign in [1.0, -1.0] {
            let all = [
                (0.0, 6.0),
                (2.1, -12.0),
                (3.5, 12.0),
                (4.2, -12.0),
                (4.9, 6.0),
            ]
            .map(|(t, c)| (t, sign * c));
            let fit = fit(&all).unwrap();
            assert_abs_diff_eq!(fit.unit_s, 0.7, epsilon = 1e-9);
            assert_abs_diff_eq!(fit.deviation, 0.0, epsilon = 1e-9);
        }
    }

    #[test]
    fn a_second_step_to_the_same_side_is_part_of_the_edge() {
        let all = [
            (0.0, 6.0),
            (2.1, -12.0),
            (2.4, -4.0),
            (3.5, 12.0),
            (4.2, -12.0),
            (4.9, 6.0),
        ];
        assert!(fit(&all).is_ok());
    }

    #[test]
    fn other_lengths_missing_pulses_and_another_unit_are_mismatches() {
        let equal = fit(&[
            (0.0, 6.0),
            (1.0, -12.0),
            (2.0, 12.0),
            (3.0, -12.0),
            (4.0, 6.0),
        ])
        .unwrap_err();
        assert!(
            !equal.is_shortfall() && equal.reason.contains("units"),
            "{equal:?}"
        );
        let short = fit(&[(0.0, 6.0), (2.1, -12.0), (3.5, 6.0)]).unwrap_err();
        assert!(
            short.is_shortfall() && short.reason.contains("2 pulses, 4 wanted"),
            "{short:?}"
        );
        let slow = fit(&[
            (0.0, 6.0),
            (9.0, -12.0),
            (15.0, 12.0),
            (18.0, -12.0),
            (21.0, 6.0),
        ])
        .unwrap_err();
        assert!(slow.reason.contains("unit 3.00 s"), "{slow:?}");
    }
}
