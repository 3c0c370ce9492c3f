//! Page of a derivative: figure with legend and caption, and flight against wind tunnel in numbers.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use serde::Serialize;

use super::derivative_results::DerivativeResults;
use super::verdict_ranges;
use crate::aero::Coefficient;
use crate::numerics::statistics::normal::NORMAL_95;
use crate::report::contents::group_by;
use crate::report::figure::derivative_figure::{self, ClassEstimates, DerivativeFigure};
use crate::report::figure::legend::{LegendView, key, line};
use crate::report::figure::scale::{Scale, ValueRange, extent};
use crate::report::figure::style::{INK, TUNNEL_COLOUR};
use crate::report::notation::{self, DASH, Digits, angle, count, fixed, number};
use crate::report::page::classes::class_markers::ClassMarkers;
use crate::report::table_view::TableView;
use crate::tables::{ComparisonRow, PosteriorRow, TrendRow};

/// Page of one derivative.
#[derive(Clone, Debug, Serialize)]
pub struct DerivativePage {
    pub anchor: String,
    /// Number of the figure.
    pub number: usize,
    pub name: String,
    pub symbol: String,
    pub svg: String,
    pub legend: Vec<LegendView>,
    pub caption: String,
    /// Verdicts in words; empty if the derivative is not compared.
    pub phrase: String,
    pub comparison: Option<TableView>,
}

/// Pages of one coefficient's derivatives.
#[derive(Clone, Debug, Serialize)]
pub struct DerivativeGroup {
    pub anchor: String,
    pub title: String,
    pub pages: Vec<DerivativePage>,
}

/// Maps each derivative to the anchor of its page. Anchors are numbered, because names may differ
/// in case alone.
#[must_use]
pub fn anchors<'a>(derivatives: &[DerivativeResults<'a>]) -> BTreeMap<&'a str, String> {
    derivatives
        .iter()
        .enumerate()
        .map(|(i, d)| (d.name, format!("d{}", i + 1)))
        .collect()
}

/// Makes the pages, grouped by coefficient.
#[must_use]
pub fn groups(
    derivatives: &[DerivativeResults],
    anchors: &BTreeMap<&str, String>,
    markers: &ClassMarkers,
) -> Vec<DerivativeGroup> {
    let alpha = alpha_scale(derivatives);
    let numbered = derivatives.par_iter().enumerate();
    let pages: Vec<DerivativePage> = numbered
        .map(|(i, derivative)| {
            let anchor = anchors.get(derivative.name).cloned().unwrap_or_default();
            page(derivative, anchor, i + 1, alpha, markers)
        })
        .collect();
    let mut groups: Vec<DerivativeGroup> = Vec::new();
    for (derivative, page) in derivatives.iter().zip(pages) {
        let title = derivative.coefficient.map_or("Instrument biases", title);
        match groups.last_mut() {
            Some(group) if group.title == title => group.pages.push(page),
            _ => groups.push(DerivativeGroup {
                anchor: format!("figures-{}", groups.len() + 1),
                title: title.to_owned(),
                pages: vec![page],
            }),
        }
    }
    groups
}

/// Scale of angle of attack for all figures, so that they can be laid side by side.
fn alpha_scale(derivatives: &[DerivativeResults]) -> Scale {
    let points = derivatives
        .iter()
        .flat_map(|d| d.points.iter().map(|p| p.alpha_deg));
    let trends = derivatives
        .iter()
        .flat_map(|d| d.trend.iter().map(|t| t.alpha_deg));
    let posterior = derivatives
        .iter()
        .flat_map(|d| d.posterior.iter().map(|p| p.alpha_deg));
    let (low, high) = extent(points.chain(trends).chain(posterior)).unwrap_or((0.0, 60.0));
    Scale::with_step(low, high, 5.0, 10.0)
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

fn page(
    derivative: &DerivativeResults,
    anchor: String,
    number: usize,
    alpha: Scale,
    markers: &ClassMarkers,
) -> DerivativePage {
    let classes = estimates_by_class(derivative, markers);
    let scale = value_range(derivative).scale();
    let mut legend: Vec<LegendView> = classes
        .iter()
        .map(|(name, class)| LegendView::new(class.marker.key(), name))
        .collect();
    legend.extend(posterior_key(derivative));
    legend.extend(trend_key(derivative));
    legend.extend(tunnel_key(derivative));
    let classes = classes.into_iter().map(|(_, class)| class).collect();
    let svg = draw_figure(derivative, &anchor, (alpha, scale), classes);
    let is_compared = derivative.is_compared();
    DerivativePage {
        number,
        name: derivative.name.to_owned(),
        symbol: notation::symbol(derivative.name),
        svg,
        legend,
        caption: caption(derivative, scale),
        phrase: if is_compared {
            verdict_ranges::phrase(&verdict_ranges::ranges(&derivative.comparison))
        } else {
            String::new()
        },
        comparison: is_compared.then(|| comparison_table(derivative)),
        anchor,
    }
}

fn draw_figure(
    derivative: &DerivativeResults,
    anchor: &str,
    (alpha, scale): (Scale, Scale),
    classes: Vec<ClassEstimates>,
) -> String {
    let trend = derivative.trend.iter().map(|t| (t.alpha_deg, t.value));
    let tunnel = derivative.tunnel.iter().copied();
    derivative_figure::draw(&DerivativeFigure {
        id: anchor,
        title: &format!("{} over angle of attack", derivative.name),
        description: &alternative_text(derivative),
        y_label: axis_label(derivative.name, &notation::unit(derivative.unit)),
        alpha,
        scale,
        prior: prior_band(derivative),
        band: posterior_band(derivative),
        posterior: derivative
            .posterior
            .iter()
            .map(|p| (p.alpha_deg, p.value))
            .collect(),
        trend: trend
            .filter(|(x, y)| x.is_finite() && y.is_finite())
            .collect(),
        tunnel: tunnel
            .filter(|(alpha_deg, _)| alpha.contains(*alpha_deg))
            .collect(),
        classes,
    })
}

/// Estimates by class, in the order of the configuration; other classes come last.
fn estimates_by_class<'a>(
    derivative: &'a DerivativeResults,
    markers: &'a ClassMarkers,
) -> Vec<(&'a str, ClassEstimates)> {
    let by_class = group_by(&derivative.points, |point| point.class);
    let all = markers.with(by_class.keys().copied());
    all.iter()
        .filter_map(|(name, marker)| {
            let points = by_class.get(name)?.iter();
            let class = ClassEstimates {
                marker,
                token: markers.token(name),
                estimates: points.map(|p| (p.alpha_deg, p.value, p.bound)).collect(),
            };
            Some((name, class))
        })
        .collect()
}

/// Alternative text of the figure: its estimates, and the ends of trend and tunnel.
fn alternative_text(derivative: &DerivativeResults) -> String {
    let classes: BTreeSet<&str> = derivative.points.iter().map(|p| p.class).collect();
    let classes: Vec<&str> = classes.into_iter().collect();
    let mut parts = vec![format!(
        "{} of {}",
        count(derivative.points.len(), "estimate"),
        classes.join(", ")
    )];
    let trend: Vec<(f64, f64)> = derivative
        .trend
        .iter()
        .map(|row| (row.alpha_deg, row.value))
        .collect();
    let posterior: Vec<(f64, f64)> = derivative
        .posterior
        .iter()
        .map(|row| (row.alpha_deg, row.value))
        .collect();
    parts.extend(ends_in_words("posterior", &posterior));
    parts.extend(ends_in_words("trend", &trend));
    parts.extend(ends_in_words("wind tunnel", &derivative.tunnel));
    parts.join("; ") + "."
}

/// First and last point of a curve in words.
fn ends_in_words(name: &str, curve: &[(f64, f64)]) -> Option<String> {
    let ((from_deg, first), (to_deg, last)) = (curve.first()?, curve.last()?);
    Some(format!(
        "{name} from {} at {} to {} at {}",
        number(Some(*first), 3),
        angle(*from_deg),
        number(Some(*last), 3),
        angle(*to_deg)
    ))
}

fn axis_label(name: &str, unit: &str) -> String {
    if unit.is_empty() {
        name.to_owned()
    } else {
        format!("{name}, {unit}")
    }
}

fn value_range(derivative: &DerivativeResults) -> ValueRange {
    let trend = derivative.trend.iter().map(|t| t.value);
    ValueRange {
        lines: trend
            .chain(derivative.tunnel.iter().map(|t| t.1))
            .chain(derivative.posterior.iter().map(|p| p.value))
            .collect(),
        estimates: derivative
            .points
            .iter()
            .map(|p| (p.value, p.bound))
            .collect(),
        band: derivative
            .posterior
            .iter()
            .flat_map(|p| [p.lower_95, p.upper_95])
            .collect(),
    }
}

fn posterior_band(derivative: &DerivativeResults) -> Vec<(f64, f64, f64)> {
    let rows = derivative.posterior.iter();
    rows.map(|p| (p.alpha_deg, p.lower_95, p.upper_95))
        .filter(|(_, low, high)| low.is_finite() && high.is_finite())
        .collect()
}

/// 95 % band of the prior about the tunnel.
fn prior_band(derivative: &DerivativeResults) -> Vec<(f64, f64, f64)> {
    let end = |p: &&PosteriorRow| {
        let (tunnel, reach) = (p.wind_tunnel?, NORMAL_95 * p.prior_deviation);
        Some((p.alpha_deg, tunnel - reach, tunnel + reach))
    };
    derivative.posterior.iter().filter_map(end).collect()
}

fn posterior_key(derivative: &DerivativeResults) -> Option<LegendView> {
    let band = r##"<rect y="1" width="24" height="10" fill="#5f6670" fill-opacity=".35"/>"##;
    let drawing = key(24, &format!("{band}{}", line(INK, "", 1.8)));
    (!derivative.posterior.is_empty()).then(|| LegendView::new(drawing, "posterior, 95 % band"))
}

fn trend_key(derivative: &DerivativeResults) -> Option<LegendView> {
    let drawing = key(24, &line(INK, "2 3", 1.0));
    let group = if derivative.group.is_empty() {
        String::new()
    } else {
        format!(" ({})", derivative.group)
    };
    (!derivative.trend.is_empty()).then(|| LegendView::new(drawing, &format!("trend{group}")))
}

fn tunnel_key(derivative: &DerivativeResults) -> Option<LegendView> {
    let cross =
        format!(r#"<path d="M9 3l6 6m0-6l-6 6" stroke="{TUNNEL_COLOUR}" stroke-width="1.5"/>"#);
    let drawing = key(24, &format!("{}{cross}", line(TUNNEL_COLOUR, "6 4", 1.6)));
    (!derivative.tunnel.is_empty())
        .then(|| LegendView::new(drawing, "wind tunnel; prior's 95 % band tinted"))
}

/// Caption: number of estimates, meaning of the bars, estimates that are not drawn.
fn caption(derivative: &DerivativeResults, scale: Scale) -> String {
    let mut parts = vec![estimates_in_words(derivative)];
    if derivative.tunnel.is_empty() && derivative.coefficient.is_some() {
        parts.push("no wind-tunnel value".to_owned());
    }
    let outside = derivative
        .points
        .iter()
        .filter(|p| !scale.contains(p.value))
        .count();
    let not_drawn = [
        (outside, "outside the axes (arrowheads)"),
        (
            derivative.undetermined,
            "not drawn: not determined by the data",
        ),
        (
            derivative.unconverged,
            "not drawn: fit not converged or doubtful",
        ),
    ];
    for (n, reason) in not_drawn {
        if n > 0 {
            parts.push(format!("{n} {reason}"));
        }
    }
    parts.join("; ") + "."
}

fn estimates_in_words(derivative: &DerivativeResults) -> String {
    let all = derivative.points.len();
    let estimates = count(all, "estimate");
    let corrected = derivative.points.iter().filter(|p| p.is_corrected).count();
    match all - corrected {
        _ if all == 0 => estimates,
        0 => format!("{estimates}, bars ± corrected bound"),
        _ if corrected == 0 => format!("{estimates}, bars ± bound, not corrected"),
        n => format!("{estimates}, bars ± corrected bound ({n} not corrected)"),
    }
}

/// Flight against tunnel, a row per angle of attack.
fn comparison_table(derivative: &DerivativeResults) -> TableView {
    let rows = &derivative.comparison;
    let values = rows
        .iter()
        .flat_map(|c| [Some(c.flight), c.tunnel.wind_tunnel])
        .flatten();
    let digits = Digits::for_values(values, 4);
    let row = |c: &&ComparisonRow| {
        vec![
            angle(c.alpha_deg),
            digits.write(Some(c.flight)),
            digits.write(Some(c.standard_error)),
            digits.write(c.tunnel.wind_tunnel),
            digits.write(c.tunnel.difference),
            c.tunnel
                .difference_pct
                .map_or_else(|| DASH.to_owned(), |p| fixed(p, 1)),
            c.tunnel.z.map_or_else(|| DASH.to_owned(), |z| fixed(z, 1)),
            c.tunnel.verdict.to_string(),
        ]
    };
    let heads = [
        "α",
        "flight",
        "standard error",
        "wind tunnel",
        "difference",
        "%",
        "z",
        "verdict",
    ];
    let note = derivative
        .trend
        .first()
        .map_or_else(String::new, |t| trend_in_words(t));
    let rows = rows.iter().map(row).collect();
    TableView::new("Flight against wind tunnel", &note, &heads, rows)
}

/// Group, number of maneuvers, order and scatter of a trend.
fn trend_in_words(trend: &TrendRow) -> String {
    format!(
        "trend of {}: {}, order {}, scatter {}",
        trend.group,
        count(trend.maneuvers, "maneuver"),
        trend.order,
        number(Some(trend.scatter), 2)
    )
}

#[cfg(test)]
mod tests {
    use super::super::derivative_results;
    use super::*;
    use crate::report::campaign_fixture;
    use crate::tables::TunnelVerdict;

    #[test]
    fn every_derivative_has_one_page_and_anchors_differ_without_case() {
        let campaign = campaign_fixture::campaign();
        let contents = campaign.contents();
        let derivatives = derivative_results::collect(&contents);
        let anchors = anchors(&derivatives);
        let groups = groups(&derivatives, &anchors, &ClassMarkers::new(&contents));
        let pages: Vec<&DerivativePage> = groups.iter().flat_map(|g| &g.pages).collect();
        assert_eq!(pages.len(), derivatives.len());
        let ids: BTreeSet<String> = pages.iter().map(|f| f.anchor.to_lowercase()).collect();
        assert_eq!(ids.len(), pages.len());
        assert!(pages.iter().all(|f| f.svg.len() < 60_000));
    }

    #[test]
    fn a_derivative_without_tunnel_value_shows_none() {
        /// Derivatives with a comparison: how many there are, and how many of them show a tunnel value.
        fn compared_and_with_tunnel(campaign: &campaign_fixture::Campaign) -> (usize, usize) {
            let contents = campaign.contents();
            let derivatives = derivative_results::collect(&contents);
            let compared = derivatives.iter().filter(|s| !s.comparison.is_empty());
            let with_tunnel = compared.clone().filter(|s| !s.tunnel.is_empty());
            (compared.count(), with_tunnel.count())
        }
        let mut campaign = campaign_fixture::campaign();
        let (compared, with_tunnel) = compared_and_with_tunnel(&campaign);
        assert!(compared > 0 && with_tunnel > 0, "{compared} {with_tunnel}");
        for row in &mut campaign.comparison {
            row.tunnel.wind_tunnel = None;
            row.tunnel.verdict = TunnelVerdict::NoTunnelValue;
        }
        assert_eq!(compared_and_with_tunnel(&campaign), (compared, 0));
    }

    #[test]
    fn the_caption_counts_estimates_that_are_not_drawn() {
        let mut campaign = campaign_fixture::campaign();
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
        let derivatives = derivative_results::collect(&contents);
        let derivative = derivatives
            .iter()
            .find(|s| s.name == name)
            .expect("the derivative");
        let text = caption(derivative, value_range(derivative).scale());
        assert!(text.contains("1 not drawn: not determined"), "{text}");
        assert!(text.contains("1 not drawn: fit not converged"), "{text}");
    }
}
