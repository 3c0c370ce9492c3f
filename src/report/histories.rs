//! The time histories of a few maneuvers, measured against computed, as in the paper's Figures 4 and 12.

use serde::Serialize;

use super::Contents;
use super::figure::{self, Panel, PanelLine};
use super::gallery::{finite, label};
use super::marks::{LegendView, key, line};
use super::notation::angle;
use super::scale::{Scale, extent};
use super::subject::by_name;
use crate::tables::{History, HistoryOutput};
use crate::units::Unit;

/// So many samples are drawn of one signal at most: more cannot be told apart at half a page.
const MOST_SAMPLES: usize = 300;

/// The time history of one maneuver.
#[derive(Clone, Debug, Serialize)]
pub struct HistoryView {
    pub maneuver_id: String,
    pub class: String,
    pub alpha: String,
    pub panels: Vec<String>,
    pub legend: Vec<LegendView>,
}

/// One maneuver of each class: the one whose angle of attack is in the middle of its class.
#[must_use]
pub fn views(contents: &Contents) -> Vec<HistoryView> {
    let of_class = by_name(contents.histories, |h| &h.class);
    let configured: Vec<&str> = contents.classes.iter().map(|c| c.0.as_str()).collect();
    let others = of_class.keys().copied().filter(|c| !configured.contains(c));
    configured
        .iter()
        .copied()
        .chain(others)
        .filter_map(|class| middle(of_class.get(class)?))
        .enumerate()
        .map(|(i, history)| history_view(history, i + 1))
        .collect()
}

fn middle<'a>(histories: &[&'a History]) -> Option<&'a History> {
    let mut sorted = histories.to_vec();
    sorted.sort_by(|a, b| a.alpha_deg.total_cmp(&b.alpha_deg).then_with(|| a.maneuver_id.cmp(&b.maneuver_id)));
    sorted.get(sorted.len() / 2).copied()
}

fn history_view(history: &History, number: usize) -> HistoryView {
    let (moved, controls) = controls(history);
    let outputs = history.outputs.iter().enumerate().map(|(i, output)| output_panel(history, output, number, i));
    let mut panels: Vec<String> = outputs.collect();
    let time = time_scale(history);
    if !moved.is_empty() {
        let scale = lines_scale(&moved, &[]);
        let id = format!("h{number}-controls");
        panels.push(figure::panel(&Panel {
            id: &id,
            title: &format!("controls of {}", history.maneuver_id),
            y_label: "controls, change".to_owned(),
            time,
            scale,
            lines: moved,
            dots: vec![],
            left_out: vec![],
        }));
    }
    HistoryView {
        maneuver_id: history.maneuver_id.clone(),
        class: history.class.clone(),
        alpha: angle(history.alpha_deg),
        panels,
        legend: history_legend(history).into_iter().chain(controls).collect(),
    }
}

/// Time from the first sample, s.
fn seconds(history: &History) -> impl Iterator<Item = f64> {
    let start = extent(history.time_s.iter().copied()).map_or(0.0, |(first, _)| first);
    history.time_s.iter().map(move |t| t - start)
}

fn time_scale(history: &History) -> Scale {
    let duration_s = extent(seconds(history)).map_or(1.0, |(_, last)| last);
    let scale = Scale::covering(0.0, duration_s.max(1e-3));
    Scale { max: duration_s.max(1e-3), ..scale }
}

fn output_panel(history: &History, output: &HistoryOutput, number: usize, i: usize) -> String {
    let step = thinning(history.time_s.len());
    let of = |values: &[f64]| finite(seconds(history).zip(values.iter().copied()));
    let every = |points: Vec<(f64, f64)>| points.into_iter().step_by(step).collect::<Vec<_>>();
    let is_marked = |i: usize| output.marked.get(i).copied().unwrap_or(false);
    let measured = seconds(history).zip(output.measured.iter().copied()).enumerate();
    let (left_out, kept): (Vec<_>, Vec<_>) = measured.partition(|(i, _)| is_marked(*i));
    let bare = |points: Vec<(usize, (f64, f64))>| finite(points.into_iter().map(|(_, p)| p));
    let (left_out, kept) = (bare(left_out), bare(kept));
    let lines = vec![PanelLine { points: every(of(&output.computed)), colour: figure::INK, dash: "" }];
    let scale = lines_scale(&lines, &kept);
    let id = format!("h{number}-{}", i + 1);
    figure::panel(&Panel {
        id: &id,
        title: &format!("{} of {}", output.label, history.maneuver_id),
        y_label: label(without_unit(&output.label), &output.unit),
        time: time_scale(history),
        scale,
        lines,
        dots: every(kept),
        left_out,
    })
}

/// A signal's name without the unit at its end, which the axis states anyway.
#[must_use]
pub fn without_unit(signal: &str) -> &str {
    Unit::of_signal(signal).suffix.and_then(|suffix| signal.strip_suffix(suffix)).unwrap_or(signal)
}

fn lines_scale(lines: &[PanelLine], dots: &[(f64, f64)]) -> Scale {
    let values = lines.iter().flat_map(|l| l.points.iter().map(|p| p.1)).chain(dots.iter().map(|p| p.1));
    let (low, high) = extent(values).unwrap_or((0.0, 1.0));
    Scale::covering(low, high)
}

fn thinning(samples: usize) -> usize {
    samples.div_ceil(MOST_SAMPLES).max(1)
}

const CONTROL_LINES: [(&str, &str); 6] = [
    ("#111111", ""),
    ("#0060a8", "7 3"),
    ("#b34700", "2 2"),
    ("#6a2c91", "8 3 2 3"),
    ("#00664b", "12 3"),
    ("#7a5200", "4 2"),
];

/// A control of a history: how far it moved, and its change from the first sample.
struct Moved<'a> {
    range: f64,
    name: &'a str,
    points: Vec<(f64, f64)>,
}

/// The controls as changes from their first sample, those that moved most first; what hardly moved is not drawn.
fn controls(history: &History) -> (Vec<PanelLine>, Vec<LegendView>) {
    let mut moved: Vec<Moved> =
        history.controls.iter().filter_map(|(name, values)| control(history, name, values)).collect();
    moved.sort_by(|a, b| b.range.total_cmp(&a.range));
    let most = moved.first().map_or(0.0, |m| m.range);
    moved.retain(|m| m.range > 0.1 * most);
    let styled = moved.into_iter().zip(CONTROL_LINES);
    styled
        .map(|(control, (colour, dash))| {
            let legend = LegendView { key: key(24, &line(colour, dash, 1.6)), label: control.name.to_owned() };
            (PanelLine { points: control.points, colour, dash }, legend)
        })
        .unzip()
}

fn control<'a>(history: &History, name: &'a str, values: &[f64]) -> Option<Moved<'a>> {
    let points = finite(seconds(history).zip(values.iter().copied()));
    let (low, high) = extent(points.iter().map(|p| p.1))?;
    let first = points.first()?.1;
    let step = thinning(points.len());
    let points = points.into_iter().step_by(step).map(|(t, v)| (t, v - first)).collect();
    Some(Moved { range: high - low, name, points })
}

fn history_legend(history: &History) -> Vec<LegendView> {
    let dot = |colour: &str, size: f64| {
        let place = 6.0 - 0.5 * size;
        key(12, &format!(r#"<rect x="{place}" y="{place}" width="{size}" height="{size}" fill="{colour}"/>"#))
    };
    let mut legend = vec![
        LegendView { key: dot(figure::MEASURED_COLOUR, 4.0), label: "measured".to_owned() },
        LegendView { key: key(24, &line(figure::INK, "", 1.6)), label: "computed".to_owned() },
    ];
    if history.outputs.iter().any(|o| o.marked.contains(&true)) {
        legend.push(LegendView { key: dot(figure::LEFT_OUT_COLOUR, 6.0), label: "left out of the cost".to_owned() });
    }
    legend
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    #[test]
    fn one_maneuver_of_each_class_is_shown_the_one_in_the_middle() {
        let campaign = samples::campaign();
        let views = views(&campaign.contents());
        assert_eq!(views.len(), campaign.classes.len());
        assert!(views.iter().all(|view| view.alpha == "30°" && view.panels.len() == 2));
    }

    #[test]
    fn the_unit_is_said_once() {
        assert_eq!(label(without_unit("alpha_vane_deg"), "deg"), "alpha_vane, deg");
        assert_eq!(label(without_unit("an_g"), "g"), "an, g");
    }

    #[test]
    fn what_hardly_moved_is_not_drawn() {
        let mut history = samples::campaign().histories.remove(0);
        history.controls.push(("dlef_deg".into(), vec![33.0; history.time_s.len()]));
        let (lines, legend) = controls(&history);
        assert_eq!(lines.len(), 1);
        assert!(legend.iter().all(|entry| entry.label != "dlef_deg"));
    }
}
