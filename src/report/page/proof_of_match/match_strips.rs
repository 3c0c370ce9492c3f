//! A maneuver flown again as strips: each judged quantity measured, simulated, its tolerance, and the times outside it.

use crate::proof_of_match::Tolerance;
use crate::report::figure::strip::{OutsideSpans, Strip, StripLine};
use crate::report::figure::strip_figure::{self, StripFigure};
use crate::report::figure::style::MEASURED_COLOUR;
use crate::report::history::{points, time_scale};
use crate::report::notation::{angle, without_unit};
use crate::report::page::maneuvers::history_strips::scale_of;
use crate::tables::{History, HistoryOutput, MatchRow, MatchVerdict};

/// Width of the figure: two or three columns.
const WIDTH: f64 = 800.0;
const HEIGHT: f64 = 72.0;

/// Drawing of a maneuver that was flown again.
#[derive(Clone, Debug)]
pub struct FlownAgain {
    pub svg: String,
    /// `true` if a quantity leaves its tolerance where it must not.
    pub has_outside: bool,
    /// `true` if a quantity leaves its tolerance where another meets the requirement.
    pub has_excused: bool,
}

/// Draws the quantities of a maneuver that was flown again, side by side.
#[must_use]
pub fn draw(history: &History, rows: &[&MatchRow], id: String) -> FlownAgain {
    let strips: Vec<Strip> = history
        .outputs
        .iter()
        .filter_map(|output| strip(history, output, rows))
        .collect();
    let names: Vec<&str> = strips.iter().map(|s| s.name.as_str()).collect();
    let description = format!(
        "{} at alpha {}, flown again: {} measured, simulated, and within which tolerance they must \
         agree.",
        history.class,
        angle(history.alpha_deg),
        names.join(", ")
    );
    let leaves = |is_excused: bool| {
        strips
            .iter()
            .any(|s| s.outside.is_excused == is_excused && !s.outside.spans.is_empty())
    };
    let (has_outside, has_excused) = (leaves(false), leaves(true));
    let svg = strip_figure::draw(&StripFigure {
        id,
        title: format!("{} flown again", history.maneuver_id),
        description,
        width: WIDTH,
        time: time_scale(history),
        columns: strip_figure::side_by_side(strips),
    });
    FlownAgain {
        svg,
        has_outside,
        has_excused,
    }
}

/// One quantity; `None` without a tolerance.
fn strip(history: &History, output: &HistoryOutput, rows: &[&MatchRow]) -> Option<Strip> {
    let row = rows
        .iter()
        .find(|row| row.quantity.name() == output.label)?;
    let tolerance = Tolerance {
        quantity: row.quantity,
        within: row.tolerance,
        within_pct: row.tolerance_pct,
    };
    let measured = points(history, &output.measured);
    let computed = points(history, &output.computed);
    let tube: Vec<(f64, f64, f64)> = measured
        .iter()
        .map(|(time_s, value)| {
            let width = tolerance.width(*value);
            (*time_s, value - width, value + width)
        })
        .collect();
    let outside = OutsideSpans {
        spans: spans_outside(&points(history, &excess(output, &tolerance))),
        is_excused: is_excused(row, rows),
    };
    let limits: Vec<(f64, f64)> = tube
        .iter()
        .flat_map(|(time_s, lower, upper)| [(*time_s, *lower), (*time_s, *upper)])
        .collect();
    // The scale is that of the tube: a simulation that departs leaves the strip.
    let scale = scale_of(&[&limits], 4.0);
    let lines = vec![
        StripLine::solid(measured, MEASURED_COLOUR, 2.2),
        StripLine::ink(computed, 1.0),
    ];
    let name = without_unit(&output.label);
    Some(Strip {
        tube,
        outside,
        ..Strip::of_lines(name, &output.unit, HEIGHT, scale, lines)
    })
}

/// Distance of each sample from its tolerance, positive outside. A simulation that departed has no value:
/// it is outside.
fn excess(output: &HistoryOutput, tolerance: &Tolerance) -> Vec<f64> {
    let pairs = output.measured.iter().zip(&output.computed);
    let excess = pairs.map(|(measured, computed)| match (computed - measured).abs() {
        distance if distance.is_finite() => distance - tolerance.width(*measured),
        _ if measured.is_finite() => f64::MAX,
        _ => f64::NAN,
    });
    excess.collect()
}

/// `true` if the requirement of a tolerance is met: by this quantity, or by an alternative of the same requirement.
fn is_excused(row: &MatchRow, rows: &[&MatchRow]) -> bool {
    rows.iter().any(|other| {
        other.test == row.test
            && other.requirement == row.requirement
            && other.verdict == MatchVerdict::Inside
    })
}

/// Intervals (s) of positive excess, each sample with half the way to its neighbours.
fn spans_outside(excess: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let is_outside = |sample: &(f64, f64)| sample.1 > 0.0;
    let mut spans = Vec::new();
    let mut first = 0;
    for run in excess.chunk_by(|a, b| is_outside(a) == is_outside(b)) {
        let end = first + run.len();
        if run.first().is_some_and(is_outside) {
            let between = |before: usize, after: usize| 0.5 * (excess[before].0 + excess[after].0);
            spans.push((
                between(first.saturating_sub(1), first),
                between(end - 1, end.min(excess.len() - 1)),
            ));
        }
        first = end;
    }
    spans
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture::campaign;
    use crate::report::figure::style::OUTSIDE_COLOUR;

    #[test]
    fn the_tube_has_the_width_of_the_tolerance_and_follows_the_measured_values() {
        let campaign = campaign();
        let matched = &campaign.matched[0];
        let history = matched.history.as_ref().unwrap();
        let rows: Vec<&MatchRow> = matched.rows.iter().collect();
        let strip = strip(history, &history.outputs[0], &rows).unwrap();
        assert_eq!(strip.tube.len(), history.time_s.len());
        for ((_, lower, upper), measured) in strip.tube.iter().zip(&history.outputs[0].measured) {
            assert!((upper - lower - 3.0).abs() < 1e-9);
            assert!((0.5 * (upper + lower) - measured).abs() < 1e-9);
        }
        let drawn = draw(history, &rows, "x".to_owned());
        assert!(
            roxmltree::Document::parse(&drawn.svg).is_ok(),
            "well-formed"
        );
        assert!(drawn.svg.contains("tolerance"));
        assert!(!drawn.has_outside && !drawn.has_excused);
    }

    #[test]
    fn times_outside_the_tolerance_are_spans_between_the_samples() {
        let excess = [0.5, -1.0, -0.2, 0.1, 2.0, -0.1];
        let excess: Vec<(f64, f64)> = (0..6).map(f64::from).zip(excess).collect();
        assert_eq!(spans_outside(&excess), [(0.0, 0.5), (2.5, 4.5)]);
        assert!(spans_outside(&excess[1..3]).is_empty() && spans_outside(&[]).is_empty());
        assert_eq!(spans_outside(&excess[3..5]), [(3.0, 4.0)]);
    }

    #[test]
    fn a_simulation_that_departs_is_marked_as_outside() {
        let mut campaign = campaign();
        let matched = &mut campaign.matched[2];
        let history = matched.history.as_mut().unwrap();
        for value in &mut history.outputs[0].computed[30..] {
            *value += 4.0;
        }
        let history = history.clone();
        let drawn = |rows: &[MatchRow]| {
            let rows: Vec<&MatchRow> = rows.iter().collect();
            let strip = strip(&history, &history.outputs[0], &rows).unwrap();
            (strip.outside.clone(), draw(&history, &rows, "x".to_owned()))
        };
        let (outside, figure) = drawn(&matched.rows);
        assert_eq!(outside.spans.len(), 1);
        assert!((outside.spans[0].0 - 5.9).abs() < 1e-9, "{outside:?}");
        assert!(figure.has_outside && !figure.has_excused);
        assert!(figure.svg.contains(OUTSIDE_COLOUR));
        // The other quantity of the requirement meets it: the bar is hollow, and nothing is shaded.
        matched.rows[1].verdict = MatchVerdict::Inside;
        let (outside, figure) = drawn(&matched.rows);
        assert!(outside.is_excused && outside.spans.len() == 1);
        assert!(!figure.has_outside && figure.has_excused);
    }
}
