//! Figures that compare classes: their inputs (the paper's Figures 2 and 9), their correlated
//! signals (3, 10, 11), and their excitation of the rates (8).

use std::collections::BTreeMap;

use serde::Serialize;

use super::class_markers::ClassMarkers;
use crate::aero::Axis;
use crate::numerics::statistics::mean::{mean, root_mean_square};
use crate::report::contents::{Contents, group_by};
use crate::report::figure::legend::{LegendView, key, line};
use crate::report::figure::scale::extent;
use crate::report::figure::strip::{Strip, StripLine};
use crate::report::figure::strip_figure::{self, StripFigure};
use crate::report::figure::style::DARK_COLOURS;
use crate::report::history;
use crate::report::notation::{angle, fixed, without_unit};
use crate::report::page::maneuvers::history_strips;
use crate::tables::{CorrelationKind, CorrelationRow, History};
use crate::units::Unit;

/// A figure of one class, or of all classes of an axis.
#[derive(Clone, Debug, Serialize)]
pub struct ClassFigure {
    pub anchor: String,
    pub title: String,
    /// Marker of the class; empty for a figure of several.
    pub marker: String,
    /// Word by which the page hides the class; empty for a figure of several.
    pub token: String,
    pub svg: String,
    pub legend: Vec<LegendView>,
    pub caption: String,
}

/// Half the width of a page, where text of 11 units is over 7 pt.
const WIDTH: f64 = 400.0;
const STRIP_HEIGHT: f64 = 40.0;
const CORRELATED_HEIGHT: f64 = 150.0;
/// Number of signals that dashes can distinguish.
const MOST_CORRELATED: usize = 6;

/// Colour, dashes and width of correlated signals: dashes keep them apart in grey.
const LINE_STYLES: [(&str, &str, f64); MOST_CORRELATED] = [
    (DARK_COLOURS[0], "", 1.4),
    (DARK_COLOURS[1], "7 3", 1.4),
    (DARK_COLOURS[2], "2 2", 1.6),
    (DARK_COLOURS[3], "8 3 2 3", 1.4),
    (DARK_COLOURS[4], "12 3", 1.4),
    (DARK_COLOURS[5], "4 2", 1.4),
];

/// Inputs of the representative maneuver of each class.
#[must_use]
pub fn inputs(contents: &Contents, markers: &ClassMarkers) -> Vec<ClassFigure> {
    (1..)
        .zip(history::representatives(contents))
        .map(|(number, history)| input_figure(history, number, markers))
        .collect()
}

fn input_figure(history: &History, number: usize, markers: &ClassMarkers) -> ClassFigure {
    let strips: Vec<Strip> = history_strips::inputs(history)
        .into_iter()
        .map(|strip| Strip {
            height: STRIP_HEIGHT,
            ..strip
        })
        .collect();
    let names: Vec<&str> = strips.iter().map(|s| s.name.as_str()).collect();
    let caption = if names.is_empty() {
        "No input moved.".to_owned()
    } else {
        format!("Inputs {}.", names.join(", "))
    };
    let drawing = StripFigure {
        id: format!("inputs-{number}"),
        title: format!("Inputs of {}", history.class),
        description: format!(
            "{} at alpha {}: {caption}",
            history.class,
            angle(history.alpha_deg)
        ),
        width: WIDTH,
        time: history::time_scale(history),
        columns: vec![strips],
    };
    figure_of_class(history, drawing, vec![], &caption, markers)
}

fn figure_of_class(
    history: &History,
    drawing: StripFigure,
    legend: Vec<LegendView>,
    caption: &str,
    markers: &ClassMarkers,
) -> ClassFigure {
    ClassFigure {
        svg: strip_figure::draw(&drawing),
        anchor: drawing.id,
        title: history.class.clone(),
        marker: markers.key(&history.class),
        token: markers.token(&history.class),
        legend,
        caption: format!(
            "α {}, {}. {caption}",
            angle(history.alpha_deg),
            history.maneuver_id
        ),
    }
}

/// Samples of a signal with their times, s.
type Points = Vec<(f64, f64)>;
/// A signal with its name.
type NamedSignal<'a> = (&'a str, Points);

/// Correlated signals of the representative maneuver of each class that has a flagged pair.
#[must_use]
pub fn correlated_signals(contents: &Contents, markers: &ClassMarkers) -> Vec<ClassFigure> {
    let by_maneuver = group_by(contents.correlations, |r| &r.maneuver_id);
    let mut figures = Vec::new();
    for history in history::representatives(contents) {
        let pairs = by_maneuver
            .get(history.maneuver_id.as_str())
            .map_or(&[][..], Vec::as_slice);
        let flagged = flagged_pairs(pairs, contents.limits.correlation);
        let (names, correlations) = distinguishable_signals(&flagged);
        let signals: Vec<NamedSignal> = names
            .into_iter()
            .filter_map(|name| Some((name, normalised_change(history, name)?)))
            .collect();
        if !signals.is_empty() {
            let anchor = format!("correlated-{}", figures.len() + 1);
            let caption = format!("Correlations: {}.", correlations.join("; "));
            figures.push(correlated_figure(
                history, anchor, signals, &caption, markers,
            ));
        }
    }
    figures
}

/// Pairs of regressors beyond the limit, the most correlated first.
fn flagged_pairs<'a>(pairs: &[&'a CorrelationRow], limit: f64) -> Vec<&'a CorrelationRow> {
    let mut flagged: Vec<&CorrelationRow> = pairs
        .iter()
        .copied()
        .filter(|p| p.kind == CorrelationKind::Regressors && p.correlation.abs() > limit)
        .collect();
    flagged.sort_by(|a, b| b.correlation.abs().total_cmp(&a.correlation.abs()));
    flagged
}

/// Names of as many signals as dashes can distinguish, and their correlations in words.
fn distinguishable_signals<'a>(pairs: &[&'a CorrelationRow]) -> (Vec<&'a str>, Vec<String>) {
    let (mut names, mut correlations) = (Vec::new(), Vec::new());
    for pair in pairs {
        let both = [pair.first.as_str(), pair.second.as_str()];
        let new: Vec<&str> = both
            .into_iter()
            .filter(|name| !names.contains(name))
            .collect();
        if names.len() + new.len() <= MOST_CORRELATED {
            names.extend(new);
            let [first, second] = both.map(without_unit);
            correlations.push(format!(
                "{first} and {second} {}",
                fixed(pair.correlation, 2)
            ));
        }
    }
    (names, correlations)
}

fn correlated_figure(
    history: &History,
    anchor: String,
    signals: Vec<NamedSignal>,
    caption: &str,
    markers: &ClassMarkers,
) -> ClassFigure {
    let legend: Vec<LegendView> = signals
        .iter()
        .zip(LINE_STYLES)
        .map(|((name, _), (colour, dash, width))| {
            LegendView::new(key(24, &line(colour, dash, width)), without_unit(name))
        })
        .collect();
    let points: Vec<&[(f64, f64)]> = signals.iter().map(|s| s.1.as_slice()).collect();
    let scale = history_strips::scale_of(&points, 5.0);
    let lines: Vec<StripLine> = signals
        .into_iter()
        .zip(LINE_STYLES)
        .map(|((_, points), (colour, dash, width))| StripLine {
            dash,
            ..StripLine::solid(points, colour, width)
        })
        .collect();
    let strip = Strip::of_lines("change", "over rms", CORRELATED_HEIGHT, scale, lines);
    let drawing = StripFigure {
        id: anchor,
        title: format!("Correlated signals in {}", history.class),
        description: format!(
            "{} at alpha {}. {caption}",
            history.class,
            angle(history.alpha_deg)
        ),
        width: WIDTH,
        time: history::time_scale(history),
        columns: vec![vec![strip]],
    };
    figure_of_class(history, drawing, legend, caption, markers)
}

/// A signal's change from its mean over the root mean square of the change. `None` if the history
/// lacks the signal or the signal did not move.
fn normalised_change(history: &History, name: &str) -> Option<Points> {
    let points = history::points(history, samples(history, name)?);
    let mean = mean(points.iter().map(|p| p.1));
    let rms = root_mean_square(points.iter().map(|p| p.1 - mean));
    (rms > 0.0).then(|| {
        points
            .into_iter()
            .map(|(t, v)| (t, (v - mean) / rms))
            .collect()
    })
}

/// Samples of a control, or of the output that measures a regressor: `alpha_vane` for `alpha`.
fn samples<'a>(history: &'a History, name: &str) -> Option<&'a [f64]> {
    if let Some((_, values)) = history.controls.iter().find(|c| c.0 == name) {
        return Some(values);
    }
    let is_measure = |label: &str| {
        let output = without_unit(label);
        output == without_unit(name)
            || output
                .strip_prefix(name)
                .is_some_and(|rest| rest.starts_with('_'))
    };
    let output = history.outputs.iter().find(|o| is_measure(&o.label))?;
    Some(&output.measured)
}

/// Excitation of each rate of an axis by its classes, on one scale.
#[must_use]
pub fn rates(contents: &Contents, markers: &ClassMarkers) -> Vec<ClassFigure> {
    let representatives = history::representatives(contents);
    let mut figures = Vec::new();
    for axis in [Axis::Longitudinal, Axis::Lateral] {
        let histories: Vec<&History> = representatives
            .iter()
            .copied()
            .filter(|h| is_of_axis(contents, &h.class, axis))
            .collect();
        for label in rate_labels(&histories) {
            let anchor = format!("rates-{}", figures.len() + 1);
            figures.push(rate_figure(label, &histories, anchor, markers));
        }
    }
    figures
}

fn is_of_axis(contents: &Contents, class: &str, axis: Axis) -> bool {
    contents
        .classes
        .iter()
        .any(|c| c.name == class && c.axis == axis)
}

/// Labels of the outputs that are angular rates, in the order of the outputs.
fn rate_labels<'a>(histories: &[&'a History]) -> Vec<&'a str> {
    let mut labels: BTreeMap<usize, &str> = BTreeMap::new();
    for (i, output) in histories.iter().flat_map(|h| h.outputs.iter().enumerate()) {
        if Unit::parse(&output.unit).is_ok_and(Unit::is_angular_rate) {
            labels.insert(i, &output.label);
        }
    }
    labels.into_values().collect()
}

fn rate_figure(
    label: &str,
    histories: &[&History],
    anchor: String,
    markers: &ClassMarkers,
) -> ClassFigure {
    let name = without_unit(label);
    let measured = measured_rates(label, histories);
    let durations = measured.iter().map(|m| history::time_scale(m.0).max);
    let longest_s = extent(durations).map_or(1.0, |(_, longest)| longest);
    let strips = rate_strips(name, &measured, markers);
    let sizes: Vec<String> = measured
        .iter()
        .map(|(history, points)| {
            format!(
                "{} {}",
                history.class,
                fixed(root_mean_square(points.iter().map(|p| p.1)), 1)
            )
        })
        .collect();
    let caption = format!("Root mean square, deg/s: {}.", sizes.join(", "));
    let title = format!("Excitation of {name} by class");
    let drawing = StripFigure {
        id: anchor,
        title: title.clone(),
        description: format!(
            "Measured {name} of a representative maneuver of each class, on one scale. {caption}"
        ),
        width: WIDTH,
        time: history::scale_until(longest_s),
        columns: vec![strips],
    };
    ClassFigure {
        svg: strip_figure::draw(&drawing),
        anchor: drawing.id,
        title,
        marker: String::new(),
        token: String::new(),
        legend: vec![],
        caption,
    }
}

/// Rate as measured, from the histories that contain it.
fn measured_rates<'a>(label: &str, histories: &[&'a History]) -> Vec<(&'a History, Points)> {
    histories
        .iter()
        .filter_map(|h| {
            let output = h.outputs.iter().find(|o| o.label == label)?;
            Some((*h, history::points(h, &output.measured)))
        })
        .collect()
}

/// A strip per class, all on one scale.
fn rate_strips(name: &str, measured: &[(&History, Points)], markers: &ClassMarkers) -> Vec<Strip> {
    let points: Vec<&[(f64, f64)]> = measured.iter().map(|m| m.1.as_slice()).collect();
    let scale = history_strips::scale_of(&points, 2.4);
    measured
        .iter()
        .map(|(history, points)| {
            let mut strip = Strip::of_lines(
                &history.class,
                &format!("{name}, deg/s"),
                STRIP_HEIGHT,
                scale,
                vec![StripLine::ink(points.clone(), 1.1)],
            );
            strip.attributes = vec![("data-class", markers.token(&history.class))];
            strip
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture::{Campaign, campaign};
    use crate::tables::HistoryOutput;

    type Section = fn(&Contents, &ClassMarkers) -> Vec<ClassFigure>;

    fn drawn(section: Section, campaign: &Campaign) -> Vec<ClassFigure> {
        let contents = campaign.contents();
        section(&contents, &ClassMarkers::new(&contents))
    }

    #[test]
    fn every_class_has_a_figure_of_its_inputs() {
        let campaign = campaign();
        let figures = drawn(inputs, &campaign);
        assert_eq!(
            figures.iter().map(|f| f.title.as_str()).collect::<Vec<_>>(),
            ["OLON", "3211", "OLAT", "PYRS"]
        );
        assert!(
            figures
                .iter()
                .all(|f| f.caption.ends_with("Inputs de.") && !f.marker.is_empty())
        );
    }

    #[test]
    fn signals_are_drawn_if_their_correlation_is_flagged() {
        let mut campaign = campaign();
        assert!(drawn(correlated_signals, &campaign).is_empty());
        campaign.correlations.push(CorrelationRow {
            maneuver_id: "1-OLON-30".into(),
            class: "OLON".into(),
            kind: CorrelationKind::Regressors,
            first: "alpha".into(),
            second: "de_deg".into(),
            correlation: -0.95,
        });
        let figures = drawn(correlated_signals, &campaign);
        assert_eq!(figures.len(), 1);
        assert!(
            figures[0].caption.contains("alpha and de \u{2212}0.95"),
            "{}",
            figures[0].caption
        );
        assert_eq!(figures[0].legend.len(), 2, "alpha is the vane's");
    }

    #[test]
    fn the_rates_of_an_axis_are_compared_class_by_class() {
        let mut campaign = campaign();
        for history in &mut campaign.histories {
            let measured = vec![2.0; history.time_s.len()];
            let (computed, marked) = (measured.clone(), vec![]);
            history.outputs.push(HistoryOutput {
                label: "q_deg_s".into(),
                unit: "deg/s".into(),
                measured,
                computed,
                marked,
            });
        }
        let figures = drawn(rates, &campaign);
        assert_eq!(figures.len(), 2, "one of each axis");
        assert!(
            figures[0].caption.contains("OLON 2.0, 3211 2.0"),
            "{}",
            figures[0].caption
        );
    }
}
