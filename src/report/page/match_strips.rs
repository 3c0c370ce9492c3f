//! A maneuver flown again as strips: each judged quantity measured, simulated, and its tolerance.

use super::history_strips::scale_of;
use crate::proof_of_match::Tolerance;
use crate::report::figure::strip_figure::{self, StripFigure};
use crate::report::figure::strips::{Strip, StripLine};
use crate::report::figure::style::MEASURED_COLOUR;
use crate::report::history::{points, time_scale};
use crate::report::notation::{angle, without_unit};
use crate::tables::{History, HistoryOutput, MatchRow};

/// Width of the figure: two columns.
const WIDTH: f64 = 800.0;
const HEIGHT: f64 = 84.0;

/// Draws the quantities of a maneuver that was flown again, in two columns.
#[must_use]
pub fn draw(history: &History, rows: &[&MatchRow], id: String) -> String {
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
    let first_column = strips.len().div_ceil(2);
    let mut columns = vec![strips];
    if first_column < columns[0].len() {
        let second = columns[0].split_off(first_column);
        columns.push(second);
    }
    strip_figure::draw(&StripFigure {
        id,
        title: format!("{} flown again", history.maneuver_id),
        description,
        width: WIDTH,
        time: time_scale(history),
        columns,
    })
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
        ..Strip::of_lines(name, &output.unit, HEIGHT, scale, lines)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture::campaign;

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
        let svg = draw(history, &rows, "x".to_owned());
        assert!(roxmltree::Document::parse(&svg).is_ok(), "well-formed");
        assert!(svg.contains("tolerance"));
    }
}
