//! The figures that show classes beside each other: their inputs (the paper's Figures 2 and 9),
//! what moved together in them (3, 10, 11), and how they excite the rates (8).

use std::collections::BTreeMap;

use serde::Serialize;

use super::figure::stack::{self, Stack, Strip, StripLine};
use super::marks::{LegendView, Mark, key, line};
use super::notation::{angle, fixed, without_unit};
use super::scale::{Scale, extent};
use super::subject::by_name;
use super::{Contents, gallery, histories};
use crate::aero::Axis;
use crate::tables::History;

/// A figure of one class or of the classes of an axis.
#[derive(Clone, Debug, Serialize)]
pub struct ClassFigure {
    pub anchor: String,
    pub title: String,
    /// The class's mark; empty for a figure of several.
    pub mark: String,
    /// The class it can be hidden with; empty for a figure of several.
    pub class: String,
    pub svg: String,
    pub legend: Vec<LegendView>,
    pub caption: String,
}

/// Half of a page: text of 11 units is over 7 pt there.
const WIDTH: f64 = 400.0;
const STRIP: f64 = 40.0;
/// So many signals can be told apart by their dashes.
const MOST_TOGETHER: usize = 6;

/// Dark, with dashes of their own, so that they stay apart in grey.
const LINES: [(&str, &str, f64); MOST_TOGETHER] = [
    ("#111111", "", 1.4),
    ("#0060a8", "7 3", 1.4),
    ("#b34700", "2 2", 1.6),
    ("#6a2c91", "8 3 2 3", 1.4),
    ("#00664b", "12 3", 1.4),
    ("#7a5200", "4 2", 1.4),
];

/// The inputs of a typical maneuver of each class.
#[must_use]
pub fn inputs(contents: &Contents) -> Vec<ClassFigure> {
    let marks = gallery::marks(contents);
    histories::typical(contents)
        .into_iter()
        .enumerate()
        .map(|(i, h)| input_figure(h, i, &marks))
        .collect()
}

fn input_figure(history: &History, number: usize, marks: &[(&str, Mark)]) -> ClassFigure {
    let strips: Vec<Strip> = histories::inputs(history)
        .into_iter()
        .map(|strip| Strip {
            height: STRIP,
            ..strip
        })
        .collect();
    let names: Vec<String> = strips.iter().map(|s| s.name.clone()).collect();
    let anchor = format!("inputs-{}", number + 1);
    let caption = if names.is_empty() {
        "No input moved.".to_owned()
    } else {
        format!("Inputs {}.", names.join(", "))
    };
    let svg = stack::draw(&Stack {
        id: anchor.clone(),
        title: format!("Inputs of {}", history.class),
        description: format!(
            "{} at alpha {}: {caption}",
            history.class,
            angle(history.alpha_deg)
        ),
        width: WIDTH,
        time: histories::time_scale(history),
        columns: vec![strips],
    });
    of_one(history, anchor, svg, vec![], &caption, marks)
}

fn of_one(
    history: &History,
    anchor: String,
    svg: String,
    legend: Vec<LegendView>,
    caption: &str,
    marks: &[(&str, Mark)],
) -> ClassFigure {
    let mark = marks.iter().find(|m| m.0 == history.class);
    let class = gallery::token(marks, &history.class);
    ClassFigure {
        title: history.class.clone(),
        mark: mark.map_or_else(String::new, |m| m.1.key()),
        class,
        svg,
        legend,
        caption: format!(
            "α {}, {}. {caption}",
            angle(history.alpha_deg),
            history.maneuver_id
        ),
        anchor,
    }
}

/// What moved together in a typical maneuver of each class that has a pair beyond the flag.
#[must_use]
pub fn together(contents: &Contents) -> Vec<ClassFigure> {
    let marks = gallery::marks(contents);
    let of_maneuver = by_name(contents.correlations, |r| &r.maneuver_id);
    let mut figures = Vec::new();
    for history in histories::typical(contents) {
        let mut pairs = of_maneuver
            .get(history.maneuver_id.as_str())
            .cloned()
            .unwrap_or_default();
        pairs.retain(|p| {
            p.kind == "regressors" && p.correlation.abs() > contents.limits.correlation
        });
        pairs.sort_by(|a, b| b.correlation.abs().total_cmp(&a.correlation.abs()));
        let mut names: Vec<&str> = Vec::new();
        let mut said = Vec::new();
        for pair in pairs {
            let both = [pair.first.as_str(), pair.second.as_str()];
            let new: Vec<&str> = both.into_iter().filter(|n| !names.contains(n)).collect();
            if names.len() + new.len() <= MOST_TOGETHER {
                names.extend(new);
                let [first, second] = both.map(without_unit);
                said.push(format!(
                    "{first} and {second} {}",
                    fixed(pair.correlation, 2)
                ));
            }
        }
        let signals: Vec<(&str, Vec<(f64, f64)>)> = names
            .iter()
            .filter_map(|name| Some((*name, changes(history, name)?)))
            .collect();
        if !signals.is_empty() {
            let anchor = format!("together-{}", figures.len() + 1);
            figures.push(together_figure(history, anchor, signals, &said, &marks));
        }
    }
    figures
}

fn together_figure(
    history: &History,
    anchor: String,
    signals: Vec<(&str, Vec<(f64, f64)>)>,
    said: &[String],
    marks: &[(&str, Mark)],
) -> ClassFigure {
    let label = |name: &str| without_unit(name).to_owned();
    let legend = signals
        .iter()
        .zip(LINES)
        .map(|((name, _), (colour, dash, width))| LegendView {
            key: key(24, &line(colour, dash, width)),
            label: label(name),
        });
    let legend: Vec<LegendView> = legend.collect();
    let caption = format!("Correlations: {}.", said.join("; "));
    let lines: Vec<StripLine> = signals
        .into_iter()
        .zip(LINES)
        .map(|((_, points), (colour, dash, width))| StripLine {
            points,
            colour,
            width,
            dash,
        })
        .collect();
    let all: Vec<&[(f64, f64)]> = lines.iter().map(|l| l.points.as_slice()).collect();
    let scale = histories::scale_of(&all, 5.0);
    let (name, unit) = ("change".to_owned(), "over rms".to_owned());
    let strip = Strip {
        name,
        unit,
        height: 150.0,
        scale,
        lines,
        dots: vec![],
        class: String::new(),
    };
    let svg = stack::draw(&Stack {
        id: anchor.clone(),
        title: format!("What moved together in {}", history.class),
        description: format!(
            "{} at alpha {}. {caption}",
            history.class,
            angle(history.alpha_deg)
        ),
        width: WIDTH,
        time: histories::time_scale(history),
        columns: vec![vec![strip]],
    });
    of_one(history, anchor, svg, legend, &caption, marks)
}

/// A signal's change from its mean over the root mean square of the change; none where it is not in
/// the history or did not move.
fn changes(history: &History, name: &str) -> Option<Vec<(f64, f64)>> {
    let is_output = |label: &str| {
        let bare = without_unit(label);
        bare == without_unit(name)
            || bare
                .strip_prefix(name)
                .is_some_and(|rest| rest.starts_with('_'))
    };
    let control = history.controls.iter().find(|c| c.0 == name).map(|c| &c.1);
    let output = || {
        history
            .outputs
            .iter()
            .find(|o| is_output(&o.label))
            .map(|o| &o.measured)
    };
    let points = histories::points(history, control.or_else(output)?);
    let count = points.len() as f64;
    let mean = points.iter().map(|p| p.1).sum::<f64>() / count;
    let rms = (points.iter().map(|p| (p.1 - mean).powi(2)).sum::<f64>() / count).sqrt();
    (rms > 0.0).then(|| {
        points
            .into_iter()
            .map(|(t, v)| (t, (v - mean) / rms))
            .collect()
    })
}

/// How the classes of an axis excite each of its rates, all on one scale.
#[must_use]
pub fn rates(contents: &Contents) -> Vec<ClassFigure> {
    let typical = histories::typical(contents);
    let marks = gallery::marks(contents);
    let mut figures = Vec::new();
    for axis in [Axis::Longitudinal, Axis::Lateral] {
        let of_axis = |h: &&&History| {
            contents
                .classes
                .iter()
                .any(|c| c.0 == h.class && c.2 == axis)
        };
        let own: Vec<&History> = typical.iter().filter(of_axis).copied().collect();
        let mut rates: BTreeMap<usize, &str> = BTreeMap::new();
        for (i, output) in own.iter().flat_map(|h| h.outputs.iter().enumerate()) {
            if output.unit == "deg/s" {
                rates.insert(i, &output.label);
            }
        }
        for label in rates.into_values() {
            let anchor = format!("rates-{}", figures.len() + 1);
            figures.push(rate_figure(label, &own, anchor, &marks));
        }
    }
    figures
}

fn rate_figure(
    label: &str,
    histories: &[&History],
    anchor: String,
    marks: &[(&str, Mark)],
) -> ClassFigure {
    let name = without_unit(label);
    let rate = |h: &History| {
        let output = h.outputs.iter().find(|o| o.label == label)?;
        Some(histories::points(h, &output.measured))
    };
    let found: Vec<(&History, Vec<(f64, f64)>)> = histories
        .iter()
        .filter_map(|h| Some((*h, rate(h)?)))
        .collect();
    let all: Vec<&[(f64, f64)]> = found.iter().map(|f| f.1.as_slice()).collect();
    let scale = histories::scale_of(&all, 2.4);
    let longest = extent(found.iter().map(|f| histories::time_scale(f.0).max)).map_or(1.0, |e| e.1);
    let time = Scale {
        max: longest,
        ..Scale::covering(0.0, longest)
    };
    let mut said = Vec::new();
    let mut strips = Vec::new();
    for (history, points) in found {
        let rms =
            (points.iter().map(|p| p.1 * p.1).sum::<f64>() / points.len().max(1) as f64).sqrt();
        said.push(format!("{} {}", history.class, fixed(rms, 1)));
        strips.push(Strip {
            name: history.class.clone(),
            unit: format!("{name}, deg/s"),
            height: STRIP,
            scale,
            lines: vec![stack::ink(points, 1.1)],
            dots: vec![],
            class: gallery::token(marks, &history.class),
        });
    }
    let caption = format!("Root mean square, deg/s: {}.", said.join(", "));
    let title = format!("Excitation of {name} by class");
    let svg = stack::draw(&Stack {
        id: anchor.clone(),
        title: title.clone(),
        description: format!(
            "Measured {name} of a typical maneuver of each class, on one scale. {caption}"
        ),
        width: WIDTH,
        time,
        columns: vec![strips],
    });
    ClassFigure {
        anchor,
        title,
        mark: String::new(),
        class: String::new(),
        svg,
        legend: vec![],
        caption,
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::campaign;
    use super::*;
    use crate::tables::{CorrelationRow, HistoryOutput};

    #[test]
    fn every_class_has_a_figure_of_its_inputs() {
        let campaign = campaign();
        let figures = inputs(&campaign.contents());
        assert_eq!(
            figures.iter().map(|f| f.title.as_str()).collect::<Vec<_>>(),
            ["OLON", "3211", "OLAT", "PYRS"]
        );
        assert!(
            figures
                .iter()
                .all(|f| f.caption.ends_with("Inputs de.") && !f.mark.is_empty())
        );
    }

    #[test]
    fn what_moved_together_is_drawn_where_a_pair_is_beyond_the_flag() {
        let mut campaign = campaign();
        assert!(together(&campaign.contents()).is_empty());
        campaign.correlations.push(CorrelationRow {
            maneuver_id: "1-OLON-30".into(),
            class: "OLON".into(),
            kind: "regressors".into(),
            first: "alpha".into(),
            second: "de_deg".into(),
            correlation: -0.95,
        });
        let figures = together(&campaign.contents());
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
        let figures = rates(&campaign.contents());
        assert_eq!(figures.len(), 2, "one of each axis");
        assert!(
            figures[0].caption.contains("OLON 2.0, 3211 2.0"),
            "{}",
            figures[0].caption
        );
    }
}
