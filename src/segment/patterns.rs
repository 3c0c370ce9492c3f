//! Patterns of one signal in time: pulses whose lengths stand in a proportion (3-2-1-1), and swings
//! that become faster (a sweep).

use crate::maneuver::{Pulses, Sweep};

use super::Step;
use super::swings::Swing;

/// Pulses that fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PulseFit {
    /// The time unit, s.
    pub unit_s: f64,
    /// The largest difference of a pulse from its length, in units.
    pub deviation: f64,
}

/// Whether the steps of a signal are the edges of these pulses, each to the other side than the one
/// before.
///
/// # Errors
/// Whether pulses are missing, and what is wrong in words.
pub(super) fn pulses(steps: &[&Step], wanted: &Pulses) -> Result<PulseFit, (bool, String)> {
    let edges = reversals(steps);
    let widths: Vec<f64> = edges.windows(2).map(|e| e[1] - e[0]).collect();
    let (n, most) = (widths.len(), wanted.widths.len());
    if n != most {
        return Err((n < most, format!("makes {n} pulses, {most} wanted")));
    }
    // The unit that brings the lengths nearest to the proportion, in the sense of least squares.
    let squares: f64 = wanted.widths.iter().map(|w| w * w).sum();
    let unit_s = wanted
        .widths
        .iter()
        .zip(&widths)
        .map(|(w, s)| w * s)
        .sum::<f64>()
        / squares.max(f64::MIN_POSITIVE);
    let off = |(w, s): (&f64, &f64)| (s / unit_s - w).abs();
    let deviation = wanted
        .widths
        .iter()
        .zip(&widths)
        .map(off)
        .fold(0.0, f64::max);
    let seen: Vec<String> = widths
        .iter()
        .map(|s| format!("{:.1}", s / unit_s))
        .collect();
    if deviation > wanted.tolerance {
        return Err((
            false,
            format!("makes pulses of {} units of {unit_s:.2} s", seen.join(", ")),
        ));
    }
    let (shortest, longest) = wanted.unit_s;
    if !(shortest..=longest).contains(&unit_s) {
        return Err((
            false,
            format!("makes pulses of unit {unit_s:.2} s, {shortest} to {longest} s wanted"),
        ));
    }
    Ok(PulseFit { unit_s, deviation })
}

/// When a signal changes sides: of steps to one side that follow each other the largest.
fn reversals(steps: &[&Step]) -> Vec<f64> {
    let runs = steps.chunk_by(|a, b| a.change() * b.change() > 0.0);
    let largest = |run: &[&Step]| {
        run.iter()
            .max_by(|a, b| a.change().abs().total_cmp(&b.change().abs()))
            .map_or(f64::NAN, |s| s.time_s)
    };
    runs.map(largest).collect()
}

/// Whether swings become faster as a sweep's do: from the first third to the last by the ratio, and
/// each with few exceptions faster than the one before.
///
/// # Errors
/// Whether swings are missing, and what is wrong in words.
pub(super) fn sweep(swings: &[Swing], wanted: &Sweep) -> Result<f64, (bool, String)> {
    let n = swings.len();
    if n < wanted.at_least.max(4) {
        return Err((
            true,
            format!("makes {n} swings, at least {} wanted", wanted.at_least),
        ));
    }
    let mut times: Vec<f64> = swings
        .windows(2)
        .map(|s| s[1].middle_s() - s[0].middle_s())
        .collect();
    let third = (times.len() / 3).max(1);
    let faster = times.windows(2).filter(|t| t[1] < 1.1 * t[0]).count();
    let steady = faster as f64 / (times.len() - 1) as f64;
    let last = mean(&times.split_off(times.len() - third));
    times.truncate(third);
    let ratio = mean(&times) / last;
    if ratio < wanted.ratio {
        return Err((
            false,
            format!("becomes {ratio:.1} times as fast, {} wanted", wanted.ratio),
        ));
    }
    if steady < 0.8 {
        return Err((false, "does not become steadily faster".into()));
    }
    Ok(ratio)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
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

    fn fit(all: &[(f64, f64)]) -> Result<PulseFit, (bool, String)> {
        let wanted = Pulses {
            widths: vec![3.0, 2.0, 1.0, 1.0],
            unit_s: (0.2, 2.0),
            tolerance: 0.5,
        };
        let steps = edges(all);
        pulses(&steps.iter().collect::<Vec<_>>(), &wanted)
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
    fn other_lengths_a_broken_off_series_and_another_unit_are_told() {
        let equal = fit(&[
            (0.0, 6.0),
            (1.0, -12.0),
            (2.0, 12.0),
            (3.0, -12.0),
            (4.0, 6.0),
        ])
        .unwrap_err();
        assert!(!equal.0 && equal.1.contains("units"), "{equal:?}");
        let short = fit(&[(0.0, 6.0), (2.1, -12.0), (3.5, 6.0)]).unwrap_err();
        assert!(
            short.0 && short.1.contains("2 pulses, 4 wanted"),
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
        assert!(slow.1.contains("unit 3.00 s"), "{slow:?}");
    }
}
