//! The figures of the derivatives with their legends and captions, by coefficient.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::Contents;
use super::failures::TableView;
use super::figure::{self, ClassEstimates, DerivativeFigure};
use super::marks::{LegendView, Mark, key, line};
use super::notation::{self, count};
use super::scale::{Scale, Shown, extent};
use super::subject::{Subject, by_name};
use super::verdict;
use crate::aero::{Axis, Coefficient};

/// A derivative's page: its figure with legend and caption, what flight says against the tunnel,
/// and the numbers of it.
#[derive(Clone, Debug, Serialize)]
pub struct FigureView {
    pub anchor: String,
    pub number: usize,
    pub name: String,
    pub symbol: String,
    pub svg: String,
    pub legend: Vec<LegendView>,
    pub caption: String,
    /// The verdicts in words; empty where nothing was compared.
    pub phrase: String,
    pub comparison: Option<TableView>,
}

/// The figures of one coefficient.
#[derive(Clone, Debug, Serialize)]
pub struct FigureGroup {
    pub anchor: String,
    pub title: String,
    pub figures: Vec<FigureView>,
}

/// Where the figure of each derivative is. Numbered, because names may differ by case alone.
#[must_use]
pub fn anchors<'a>(subjects: &[Subject<'a>]) -> BTreeMap<&'a str, String> {
    subjects
        .iter()
        .enumerate()
        .map(|(i, s)| (s.name, format!("d{}", i + 1)))
        .collect()
}

/// The classes with their marks, in the order of the configuration, axis by axis: one mark per
/// class throughout.
pub fn marks<'a>(contents: &Contents<'a>) -> Vec<(&'a str, Mark)> {
    let mut marks: Vec<(&str, Mark)> = Vec::new();
    for axis in [Axis::Longitudinal, Axis::Lateral] {
        let configured = contents
            .classes
            .iter()
            .filter(|c| c.2 == axis)
            .map(|c| c.0.as_str());
        let flown: BTreeSet<&str> = contents
            .maneuvers
            .iter()
            .filter(|m| m.axis == axis)
            .map(|m| m.class.as_str())
            .collect();
        for class in configured.chain(flown) {
            if marks.iter().all(|(known, _)| *known != class) {
                marks.push((class, Mark::nth(marks.len())));
            }
        }
    }
    marks
}

/// What a class is called in the page where it is hidden: a word that needs no escaping; nothing
/// for an unknown class.
#[must_use]
pub fn token(marks: &[(&str, Mark)], class: &str) -> String {
    marks
        .iter()
        .position(|m| m.0 == class)
        .map_or_else(String::new, |i| format!("c{}", i + 1))
}

/// The scale over angle of attack that all figures share, so that they can be laid side by side.
fn alpha_scale(subjects: &[Subject]) -> Scale {
    let points = subjects
        .iter()
        .flat_map(|s| s.points.iter().map(|p| p.alpha_deg));
    let rows = subjects
        .iter()
        .flat_map(|s| s.trend.iter().map(|t| t.alpha_deg));
    let (low, high) = extent(points.chain(rows)).unwrap_or((0.0, 60.0));
    Scale::with_step(low, high, 5.0, 10.0)
}

/// The figures by coefficient.
#[must_use]
pub fn groups(
    contents: &Contents,
    subjects: &[Subject],
    anchors: &BTreeMap<&str, String>,
) -> Vec<FigureGroup> {
    let marks = marks(contents);
    let alpha = alpha_scale(subjects);
    let mut groups: Vec<FigureGroup> = Vec::new();
    for (i, subject) in subjects.iter().enumerate() {
        let title = subject.coefficient.map_or("Instrument biases", title);
        let anchor = anchors.get(subject.name).cloned().unwrap_or_default();
        let view = figure_view(subject, anchor, i + 1, alpha, &marks);
        match groups.last_mut() {
            Some(group) if group.title == title => group.figures.push(view),
            _ => {
                let anchor = format!("figures-{}", groups.len() + 1);
                groups.push(FigureGroup {
                    anchor,
                    title: title.to_owned(),
                    figures: vec![view],
                });
            }
        }
    }
    groups
}

fn title(coefficient: Coefficient) -> &'static str {
    match coefficient {
        Coefficient::CN => "Normal force, CN",
        Coefficient::Cm => "Pitching moment, Cm",
        Coefficient::CA => "Axial force, CA",
        Coefficient::CY => "Side force, CY",
        Coefficient::Cl => "Rolling moment, Cl",
        Coefficient::Cn => "Yawing moment, Cn",
    }
}

fn figure_view(
    subject: &Subject,
    anchor: String,
    number: usize,
    alpha: Scale,
    marks: &[(&str, Mark)],
) -> FigureView {
    let drawn = drawn(subject, marks);
    let scale = shown(subject).scale();
    let svg = figure::derivative(&DerivativeFigure {
        id: &anchor,
        title: &format!("{} over angle of attack", subject.name),
        description: &description(subject),
        y_label: label(subject.name, &notation::unit(subject.unit)),
        alpha,
        scale,
        band: finite_band(subject),
        trend: finite(subject.trend.iter().map(|t| (t.alpha_deg, t.value))),
        tunnel: subject
            .tunnel
            .iter()
            .copied()
            .filter(|(a, _)| alpha.contains(*a))
            .collect(),
        classes: drawn.iter().map(|class| class.estimates.clone()).collect(),
    });
    let classes = drawn.iter().map(|c| LegendView {
        key: c.estimates.mark.key(),
        label: c.name.to_owned(),
    });
    FigureView {
        number,
        name: subject.name.to_owned(),
        symbol: notation::symbol(subject.name),
        svg,
        legend: classes.chain(lines_legend(subject)).collect(),
        caption: caption(subject, scale),
        phrase: if subject.is_compared() {
            verdict::phrase(&verdict::runs(&subject.comparison))
        } else {
            String::new()
        },
        comparison: subject.is_compared().then(|| super::comparison(subject)),
        anchor,
    }
}

/// A class whose estimates a figure shows.
struct Drawn<'a> {
    name: &'a str,
    estimates: ClassEstimates,
}

/// The classes that a figure shows, in the order of the configuration; one that is not known there
/// comes last.
fn drawn<'a>(subject: &'a Subject, marks: &[(&'a str, Mark)]) -> Vec<Drawn<'a>> {
    let by_class = by_name(&subject.points, |p| p.class);
    let unknown = by_class
        .keys()
        .copied()
        .filter(|class| marks.iter().all(|(known, _)| known != class));
    let unknown = unknown
        .enumerate()
        .map(|(i, class)| (class, Mark::nth(marks.len() + i)));
    marks
        .iter()
        .copied()
        .chain(unknown)
        .filter_map(|(name, mark)| {
            let points = by_class.get(name)?.iter();
            let estimates = points.map(|p| (p.alpha_deg, p.value, p.bound)).collect();
            Some(Drawn {
                name,
                estimates: ClassEstimates {
                    mark,
                    token: token(marks, name),
                    estimates,
                },
            })
        })
        .collect()
}

/// The figure for those who do not see it: what is in it, and where trend and tunnel begin and end.
fn description(subject: &Subject) -> String {
    let classes: BTreeSet<&str> = subject.points.iter().map(|p| p.class).collect();
    let classes: Vec<&str> = classes.into_iter().collect();
    let mut said = vec![format!(
        "{} of {}",
        count(subject.points.len(), "estimate"),
        classes.join(", ")
    )];
    let ends = |name: &str, first: Option<(f64, f64)>, last: Option<(f64, f64)>| {
        let ((a, from), (b, to)) = (first?, last?);
        let value = |v: f64| notation::number(Some(v), 3);
        Some(format!(
            "{name} from {} at {} to {} at {}",
            value(from),
            notation::angle(a),
            value(to),
            notation::angle(b)
        ))
    };
    let trend = |row: &&&crate::tables::TrendRow| (row.alpha_deg, row.value);
    said.extend(ends(
        "trend",
        subject.trend.first().as_ref().map(trend),
        subject.trend.last().as_ref().map(trend),
    ));
    said.extend(ends(
        "wind tunnel",
        subject.tunnel.first().copied(),
        subject.tunnel.last().copied(),
    ));
    said.join("; ") + "."
}

/// The label of an axis.
pub fn label(name: &str, unit: &str) -> String {
    if unit.is_empty() {
        name.to_owned()
    } else {
        format!("{name}, {unit}")
    }
}

fn shown(subject: &Subject) -> Shown {
    let trend = subject.trend.iter().map(|t| t.value);
    Shown {
        lines: trend.chain(subject.tunnel.iter().map(|t| t.1)).collect(),
        estimates: subject.points.iter().map(|p| (p.value, p.bound)).collect(),
        band: subject
            .trend
            .iter()
            .flat_map(|t| [t.lower_95, t.upper_95])
            .collect(),
    }
}

/// The points of which both coordinates are numbers.
pub fn finite(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    points
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect()
}

fn finite_band(subject: &Subject) -> Vec<(f64, f64, f64)> {
    let ends = subject
        .trend
        .iter()
        .map(|t| (t.alpha_deg, t.lower_95, t.upper_95));
    ends.filter(|(_, low, high)| low.is_finite() && high.is_finite())
        .collect()
}

fn lines_legend(subject: &Subject) -> Vec<LegendView> {
    let mut legend = Vec::new();
    if !subject.trend.is_empty() {
        let band = r##"<rect y="1" width="24" height="10" fill="#5f6670" fill-opacity=".25"/>"##;
        let key = key(24, &format!("{band}{}", line(figure::INK, "", 1.8)));
        let group = if subject.group.is_empty() {
            String::new()
        } else {
            format!(" ({})", subject.group)
        };
        legend.push(LegendView {
            key,
            label: format!("trend{group}, 95 % band"),
        });
    }
    if !subject.tunnel.is_empty() {
        let cross = format!(
            r#"<path d="M9 3l6 6m0-6l-6 6" stroke="{}" stroke-width="1.5"/>"#,
            figure::TUNNEL_COLOUR
        );
        let key = key(
            24,
            &format!("{}{cross}", line(figure::TUNNEL_COLOUR, "6 4", 1.6)),
        );
        legend.push(LegendView {
            key,
            label: "wind tunnel".to_owned(),
        });
    }
    legend
}

/// What the reader must know to read one figure: how many estimates, what the bars are, what is not
/// drawn.
fn caption(subject: &Subject, scale: Scale) -> String {
    let estimates = count(subject.points.len(), "estimate");
    let corrected = subject.points.iter().filter(|p| p.corrected).count();
    let mut parts = vec![match subject.points.len() - corrected {
        _ if subject.points.is_empty() => estimates,
        0 => format!("{estimates}, bars ± corrected bound"),
        _ if corrected == 0 => format!("{estimates}, bars ± bound, not corrected"),
        n => format!("{estimates}, bars ± corrected bound ({n} not corrected)"),
    }];
    if subject.tunnel.is_empty() && subject.coefficient.is_some() {
        parts.push("no wind-tunnel value".to_owned());
    }
    let outside = subject
        .points
        .iter()
        .filter(|p| !scale.contains(p.value))
        .count();
    let unseen = [
        (outside, "outside the axes (arrowheads)"),
        (
            subject.undetermined,
            "not drawn: not determined by the data",
        ),
        (subject.unconverged, "not drawn: fit not converged"),
    ];
    parts.extend(
        unseen
            .into_iter()
            .filter(|(n, _)| *n > 0)
            .map(|(n, what)| format!("{n} {what}")),
    );
    parts.join("; ") + "."
}

#[cfg(test)]
mod tests {
    use super::super::{samples, subject};
    use super::*;

    #[test]
    fn every_derivative_has_one_figure_and_an_id_of_its_own_whatever_the_case() {
        let campaign = samples::campaign();
        let contents = campaign.contents();
        let subjects = subject::gather(&contents);
        let anchors = anchors(&subjects);
        let groups = groups(&contents, &subjects, &anchors);
        let figures: Vec<&FigureView> = groups.iter().flat_map(|g| &g.figures).collect();
        assert_eq!(figures.len(), subjects.len());
        let ids: BTreeSet<String> = figures.iter().map(|f| f.anchor.to_lowercase()).collect();
        assert_eq!(ids.len(), figures.len());
        assert!(figures.iter().all(|f| f.svg.len() < 60_000));
    }

    #[test]
    fn a_derivative_without_tunnel_value_shows_none() {
        let mut campaign = samples::campaign();
        for row in &mut campaign.comparison {
            (row.wind_tunnel, row.verdict) = (None, "no tunnel value".into());
        }
        let contents = campaign.contents();
        let subjects = subject::gather(&contents);
        assert!(
            subjects
                .iter()
                .filter(|s| !s.comparison.is_empty())
                .all(|s| s.tunnel.is_empty())
        );
    }

    #[test]
    fn what_is_not_drawn_is_counted_in_the_caption() {
        let mut campaign = samples::campaign();
        let name = campaign.comparison[0].derivative.clone();
        // The last one: the first belongs to the fit that did not converge.
        let last = campaign
            .estimates
            .iter_mut()
            .rev()
            .find(|e| e.derivative == name)
            .expect("an estimate");
        (last.bound, last.bound_corrected) = (None, None);
        let contents = campaign.contents();
        let subjects = subject::gather(&contents);
        let subject = subjects
            .iter()
            .find(|s| s.name == name)
            .expect("the subject");
        let text = caption(subject, shown(subject).scale());
        assert!(text.contains("1 not drawn: not determined"), "{text}");
        assert!(text.contains("1 not drawn: fit not converged"), "{text}");
    }
}
