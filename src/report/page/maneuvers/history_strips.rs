//! Time history of a maneuver as strips: inputs, and outputs measured and computed with residuals,
//! as in the paper's Figures 4 and 12.

use crate::report::contents::HistoryFigure;
use crate::report::figure::scale::{Scale, extent};
use crate::report::figure::strip::{Strip, StripLine};
use crate::report::figure::strip_figure::{self, StripFigure};
use crate::report::figure::style::MEASURED_COLOUR;
use crate::report::history::{is_marked, points, time_scale};
use crate::report::notation::{angle, without_unit};
use crate::tables::{History, HistoryOutput};
use crate::units::Unit;

/// Width of the figure: two columns.
const WIDTH: f64 = 800.0;
const OUTPUT_HEIGHT: f64 = 48.0;
const RESIDUAL_HEIGHT: f64 = 18.0;
const INPUT_HEIGHT: f64 = 42.0;
/// Share of the largest movement below which an input is not drawn.
const SMALLEST_SHARE: f64 = 0.1;
/// Largest number of inputs: more would make the figure longer than a page has room for.
const MOST_INPUTS: usize = 9;

/// Draws a maneuver: outputs with residuals, then inputs, in two columns. `id` is unique in the page.
#[must_use]
pub fn draw_history(history: &History, id: String) -> HistoryFigure {
    let outputs = history.outputs.iter();
    let outputs = outputs.map(|output| output_strips(history, output).to_vec());
    let mut inputs = inputs(history);
    inputs.truncate(MOST_INPUTS);
    let description = alternative_text(history, &inputs);
    let groups = outputs.chain(inputs.into_iter().map(|input| vec![input]));
    let columns = strip_figure::in_two_columns(groups.collect());
    let svg = strip_figure::draw(&StripFigure {
        id,
        title: format!("Time history of {}", history.maneuver_id),
        description,
        width: WIDTH,
        time: time_scale(history),
        columns,
    });
    HistoryFigure {
        svg,
        has_excluded: history.outputs.iter().any(|o| o.marked.contains(&true)),
    }
}

fn alternative_text(history: &History, inputs: &[Strip]) -> String {
    let outputs: Vec<&str> = history
        .outputs
        .iter()
        .map(|o| without_unit(&o.label))
        .collect();
    let inputs: Vec<&str> = inputs.iter().map(|s| s.name.as_str()).collect();
    format!(
        "{} at alpha {}: measured and computed {}, each with its residual below it; inputs {}.",
        history.class,
        angle(history.alpha_deg),
        outputs.join(", "),
        if inputs.is_empty() {
            "none that moved".to_owned()
        } else {
            inputs.join(", ")
        },
    )
}

/// Scale for lines in a strip with about `steps` steps.
#[must_use]
pub fn scale_of(lines: &[&[(f64, f64)]], steps: f64) -> Scale {
    let values = lines.iter().flat_map(|line| line.iter().map(|p| p.1));
    let (low, high) = extent(values).unwrap_or((0.0, 1.0));
    Scale::in_steps(low, high, steps)
}

/// An output measured and computed, and its residual. Samples excluded from the cost are dots
/// without a residual.
fn output_strips(history: &History, output: &HistoryOutput) -> [Strip; 2] {
    let measured_where = |marked: bool| -> Vec<f64> {
        output
            .measured
            .iter()
            .enumerate()
            .map(|(i, v)| {
                if is_marked(output, i) == marked {
                    *v
                } else {
                    f64::NAN
                }
            })
            .collect()
    };
    let (included, excluded) = (measured_where(false), measured_where(true));
    let residual: Vec<f64> = included
        .iter()
        .zip(&output.computed)
        .map(|(z, y)| z - y)
        .collect();
    let measured = points(history, &included);
    let computed = points(history, &output.computed);
    let residual = points(history, &residual);
    let scale = scale_of(&[&measured, &computed], 3.0);
    let residual_scale = scale_of(&[&residual], 1.6);
    let lines = vec![
        StripLine::solid(measured, MEASURED_COLOUR, 2.2),
        StripLine::ink(computed, 1.0),
    ];
    let name = without_unit(&output.label);
    let mut response = Strip::of_lines(name, &output.unit, OUTPUT_HEIGHT, scale, lines);
    response.dots = points(history, &excluded);
    let difference = Strip::of_lines(
        "residual",
        &output.unit,
        RESIDUAL_HEIGHT,
        residual_scale,
        vec![StripLine::ink(residual, 0.7)],
    );
    [response, difference]
}

/// Inputs that moved, the most moved first.
#[must_use]
pub fn inputs(history: &History) -> Vec<Strip> {
    let mut inputs: Vec<(f64, Strip)> = history
        .controls
        .iter()
        .filter_map(|(name, values)| input(history, name, values))
        .collect();
    inputs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let largest = inputs.first().map_or(0.0, |input| input.0);
    inputs
        .into_iter()
        .filter(|(range, _)| *range > SMALLEST_SHARE * largest)
        .map(|(_, strip)| strip)
        .collect()
}

/// An input with the range over which it moved.
fn input(history: &History, name: &str, values: &[f64]) -> Option<(f64, Strip)> {
    let points = points(history, values);
    let (low, high) = extent(points.iter().map(|p| p.1))?;
    let unit = match Unit::of_signal(name).name {
        "-" => "",
        unit => unit,
    };
    let strip = Strip::of_lines(
        without_unit(name),
        unit,
        INPUT_HEIGHT,
        scale_of(&[&points], 2.4),
        vec![StripLine::ink(points, 1.1)],
    );
    Some((high - low, strip))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture::campaign;

    #[test]
    fn every_output_has_its_residual_below_it() {
        let history = campaign().histories.remove(0);
        let [output, residual] = output_strips(&history, &history.outputs[0]);
        assert_eq!(
            (output.name.as_str(), residual.name.as_str()),
            ("alpha_vane", "residual")
        );
        assert_eq!(output.dots.len(), 1, "the excluded sample");
        assert!(
            residual.lines[0].pieces[0]
                .iter()
                .all(|p| (p.1 - 0.01).abs() < 1e-9)
        );
    }

    #[test]
    fn inputs_that_hardly_move_are_not_drawn() {
        let mut history = campaign().histories.remove(0);
        history
            .controls
            .push(("dlef_deg".into(), vec![33.0; history.time_s.len()]));
        assert_eq!(
            inputs(&history)
                .iter()
                .map(|s| s.name.as_str())
                .collect::<Vec<_>>(),
            ["de"]
        );
    }
}
