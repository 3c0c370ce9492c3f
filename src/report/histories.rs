//! The time history of a maneuver: inputs, and outputs measured and computed with their residuals,
//! as in the paper's Figures 4 and 12.

use super::figure::stack::{self, Stack, Strip, StripLine};
use super::figure::{self};
use super::marks::{LegendView, key, line};
use super::notation::{angle, without_unit};
use super::scale::{Scale, extent};
use super::subject::by_name;
use super::{Contents, pages};
use crate::tables::{History, HistoryOutput};
use crate::units::Unit;

/// Width of a maneuver's drawing: two columns.
const WIDTH: f64 = 800.0;
const OUTPUT: f64 = 48.0;
const RESIDUAL: f64 = 18.0;
const INPUT: f64 = 42.0;
/// An input that moves less than this share of the one that moves most is not drawn.
const HARDLY: f64 = 0.1;
/// More inputs than these make the column longer than that of the outputs.
const MOST_INPUTS: usize = 9;

/// The history of the maneuver that stands for its class ([`pages::typical`]), class by class.
#[must_use]
pub fn typical<'a>(contents: &Contents<'a>) -> Vec<&'a History> {
    let typical = pages::typical(
        contents.maneuvers,
        &pages::converged(contents.fits),
        contents.typical_alpha_deg,
    );
    let of_class = by_name(contents.histories, |h| &h.class);
    let configured: Vec<&str> = contents.classes.iter().map(|c| c.0.as_str()).collect();
    let others = of_class.keys().copied().filter(|c| !configured.contains(c));
    let stands = |class: &str| {
        of_class
            .get(class)?
            .iter()
            .copied()
            .find(|h| typical.contains(h.maneuver_id.as_str()))
    };
    configured
        .iter()
        .copied()
        .chain(others)
        .filter_map(stands)
        .collect()
}

/// So many samples are kept of one signal at most: more cannot be told apart in a column.
const MOST_SAMPLES: usize = 240;

/// A history as the report draws it: every so many samples, with the digits that a drawing can
/// show, and beside them each sample that was left out of the cost.
#[must_use]
pub fn thinned(history: &History) -> History {
    let step = history.time_s.len().div_ceil(MOST_SAMPLES).max(1);
    let is_marked = |i: usize| {
        history
            .outputs
            .iter()
            .any(|o| o.marked.get(i).copied().unwrap_or(false))
    };
    let kept: Vec<usize> = (0..history.time_s.len())
        .filter(|i| i % step == 0 || is_marked(*i))
        .collect();
    let of = |values: &[f64]| {
        kept.iter()
            .map(|i| values.get(*i).map_or(f64::NAN, |v| rounded(*v)))
            .collect()
    };
    let output = |o: &HistoryOutput| HistoryOutput {
        label: o.label.clone(),
        unit: o.unit.clone(),
        measured: of(&o.measured),
        computed: of(&o.computed),
        marked: kept
            .iter()
            .map(|i| o.marked.get(*i).copied().unwrap_or(false))
            .collect(),
    };
    History {
        maneuver_id: history.maneuver_id.clone(),
        class: history.class.clone(),
        alpha_deg: history.alpha_deg,
        time_s: of(&history.time_s),
        outputs: history.outputs.iter().map(output).collect(),
        controls: history
            .controls
            .iter()
            .map(|(name, values)| (name.clone(), of(values)))
            .collect(),
    }
}

/// Six significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// The drawing of a maneuver: outputs with residuals on the left, inputs on the right.
#[must_use]
pub fn drawing(history: &History, id: String) -> String {
    let outputs: Vec<Strip> = history
        .outputs
        .iter()
        .flat_map(|output| output_strips(history, output))
        .collect();
    let mut inputs = inputs(history);
    inputs.truncate(MOST_INPUTS);
    let names: Vec<&str> = history
        .outputs
        .iter()
        .map(|o| without_unit(&o.label))
        .collect();
    let moved: Vec<String> = inputs.iter().map(|s| s.name.clone()).collect();
    let columns = if inputs.is_empty() {
        vec![outputs]
    } else {
        vec![outputs, inputs]
    };
    stack::draw(&Stack {
        id,
        title: format!("Time history of {}", history.maneuver_id),
        description: format!(
            "{} at alpha {}: measured and computed {}, each with its residual below it; inputs {}.",
            history.class,
            angle(history.alpha_deg),
            names.join(", "),
            if moved.is_empty() {
                "none that moved".to_owned()
            } else {
                moved.join(", ")
            },
        ),
        width: WIDTH,
        time: time_scale(history),
        columns,
    })
}

/// Time from the first sample, s.
fn seconds(history: &History) -> impl Iterator<Item = f64> {
    let start = extent(history.time_s.iter().copied()).map_or(0.0, |(first, _)| first);
    history.time_s.iter().map(move |t| t - start)
}

/// The time axis of a history.
#[must_use]
pub fn time_scale(history: &History) -> Scale {
    let duration_s = extent(seconds(history)).map_or(1.0, |(_, last)| last);
    let scale = Scale::covering(0.0, duration_s.max(1e-3));
    Scale {
        max: duration_s.max(1e-3),
        ..scale
    }
}

/// A signal's samples with their times, those that are numbers.
#[must_use]
pub fn points(history: &History, values: &[f64]) -> Vec<(f64, f64)> {
    super::gallery::finite(seconds(history).zip(values.iter().copied()))
}

/// A scale for lines in a strip of a few ticks.
#[must_use]
pub fn scale_of(lines: &[&[(f64, f64)]], steps: f64) -> Scale {
    let (low, high) =
        extent(lines.iter().flat_map(|l| l.iter().map(|p| p.1))).unwrap_or((0.0, 1.0));
    Scale::in_steps(low, high, steps)
}

fn output_strips(history: &History, output: &HistoryOutput) -> [Strip; 2] {
    let is_marked = |i: usize| output.marked.get(i).copied().unwrap_or(false);
    let kept: Vec<f64> = output
        .measured
        .iter()
        .enumerate()
        .map(|(i, v)| if is_marked(i) { f64::NAN } else { *v })
        .collect();
    let left_out: Vec<f64> = output
        .measured
        .iter()
        .enumerate()
        .map(|(i, v)| if is_marked(i) { *v } else { f64::NAN })
        .collect();
    let residual: Vec<f64> = kept
        .iter()
        .zip(&output.computed)
        .map(|(z, y)| z - y)
        .collect();
    let (measured, computed) = (points(history, &kept), points(history, &output.computed));
    let residual = points(history, &residual);
    let scale = scale_of(&[&measured, &computed], 3.0);
    let pale = StripLine {
        points: measured,
        colour: figure::MEASURED_COLOUR,
        width: 2.2,
        dash: "",
    };
    let strip = Strip {
        name: without_unit(&output.label).to_owned(),
        unit: output.unit.clone(),
        height: OUTPUT,
        scale,
        lines: vec![pale, stack::ink(computed, 1.0)],
        dots: points(history, &left_out),
        class: String::new(),
    };
    let scale = scale_of(&[&residual], 1.6);
    let lines = vec![stack::ink(residual, 0.7)];
    let below = Strip {
        name: "residual".to_owned(),
        height: RESIDUAL,
        scale,
        lines,
        dots: vec![],
        ..strip.clone()
    };
    [strip, below]
}

/// The inputs that moved, those that moved most first.
#[must_use]
pub fn inputs(history: &History) -> Vec<Strip> {
    let mut moved: Vec<(f64, Strip)> = history
        .controls
        .iter()
        .filter_map(|(name, values)| input(history, name, values))
        .collect();
    moved.sort_by(|a, b| b.0.total_cmp(&a.0));
    let most = moved.first().map_or(0.0, |m| m.0);
    moved
        .into_iter()
        .filter(|m| m.0 > HARDLY * most)
        .map(|m| m.1)
        .collect()
}

/// An input with how far it moved.
fn input(history: &History, name: &str, values: &[f64]) -> Option<(f64, Strip)> {
    let points = points(history, values);
    let (low, high) = extent(points.iter().map(|p| p.1))?;
    let unit = Unit::of_signal(name).name;
    Some((
        high - low,
        Strip {
            name: without_unit(name).to_owned(),
            unit: if unit == "-" {
                String::new()
            } else {
                unit.to_owned()
            },
            height: INPUT,
            scale: scale_of(&[&points], 2.4),
            lines: vec![stack::ink(points, 1.1)],
            dots: vec![],
            class: String::new(),
        },
    ))
}

/// What the lines of a maneuver's drawing are.
#[must_use]
pub fn legend(history: &History) -> Vec<LegendView> {
    let mut legend = vec![
        LegendView {
            key: key(24, &line(figure::MEASURED_COLOUR, "", 4.0)),
            label: "measured".to_owned(),
        },
        LegendView {
            key: key(24, &line(figure::INK, "", 1.4)),
            label: "computed; residual, input".to_owned(),
        },
    ];
    if history.outputs.iter().any(|o| o.marked.contains(&true)) {
        let dot = format!(
            r#"<rect x="3" y="3" width="6" height="6" fill="{}"/>"#,
            figure::LEFT_OUT_COLOUR
        );
        legend.push(LegendView {
            key: key(12, &dot),
            label: "left out of the cost".to_owned(),
        });
    }
    legend
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    #[test]
    fn a_class_is_shown_by_the_converged_maneuver_nearest_to_the_configured_angle() {
        let campaign = samples::campaign();
        let contents = Contents {
            typical_alpha_deg: 12.0,
            ..campaign.contents()
        };
        let shown = typical(&contents);
        assert_eq!(shown.len(), campaign.classes.len());
        // The first class's maneuver at 10 deg did not converge.
        assert_eq!(
            shown.iter().map(|h| h.alpha_deg).collect::<Vec<_>>(),
            [20.0, 10.0, 10.0, 10.0]
        );
    }

    #[test]
    fn what_is_kept_is_enough_for_a_drawing_and_every_sample_that_was_left_out() {
        let history = samples::campaign().histories.remove(0);
        let thin = thinned(&history);
        assert_eq!(
            thin.time_s.len(),
            200,
            "every third; the one that was left out is among them"
        );
        assert_eq!(thin.outputs[0].marked.iter().filter(|m| **m).count(), 1);
        assert_eq!(thinned(&thin), thin);
        let mut longer = history;
        longer.outputs[0].marked[301] = true;
        assert_eq!(thinned(&longer).time_s.len(), 201);
    }

    #[test]
    fn every_output_has_its_residual_below_it() {
        let history = samples::campaign().histories.remove(0);
        let [output, residual] = output_strips(&history, &history.outputs[0]);
        assert_eq!(
            (output.name.as_str(), residual.name.as_str()),
            ("alpha_vane", "residual")
        );
        assert_eq!(output.dots.len(), 1, "the sample left out");
        assert!(
            residual.lines[0]
                .points
                .iter()
                .all(|p| (p.1 - 0.01).abs() < 1e-9)
        );
    }

    #[test]
    fn what_hardly_moved_is_not_drawn() {
        let mut history = samples::campaign().histories.remove(0);
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
