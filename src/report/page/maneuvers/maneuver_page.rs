//! Page of a maneuver: flight condition, outcome of the fit, time history, derivatives.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use crate::error::Problem;
use crate::maneuver::{Maneuver, Status};
use crate::proof_of_match::Matched;
use crate::report::contents::{Contents, HistoryFigure, group_by};
use crate::report::figure::legend::{self, LegendView};
use crate::report::notation::{self, DASH, Digits, angle, count, fixed, number, outcome_in_words};
use crate::report::page::classes::class_markers::ClassMarkers;
use crate::report::page::proof_of_match::match_strips;
use crate::report::table_view::TableView;
use crate::tables::{AgreementRow, EstimateRow, FitRow, MatchVerdict};

/// Page of one maneuver.
#[derive(Clone, Debug, Serialize)]
pub struct ManeuverPage {
    pub anchor: String,
    pub maneuver_id: String,
    pub class: String,
    /// Marker of the class in figures.
    pub marker: String,
    /// Word by which the page hides the class.
    pub token: String,
    /// Names and values under the heading; `true` for a value that is a warning.
    pub facts: Vec<(String, String, bool)>,
    /// Time history; empty if no response was computed.
    pub svg: String,
    pub legend: Vec<LegendView>,
    /// The maneuver flown again; empty where it was not.
    pub match_svg: String,
    pub match_legend: Vec<LegendView>,
    pub match_caption: String,
    pub estimates: TableView,
    pub problems: Vec<String>,
}

/// Maps each maneuver that has a page to the anchor of the page.
#[must_use]
pub fn anchors<'a>(contents: &Contents<'a>) -> BTreeMap<&'a str, String> {
    with_page(contents)
        .map(|(number, m)| (m.maneuver_id.as_str(), format!("m{number}")))
        .collect()
}

/// Maneuvers that have a page, with their numbers in the campaign from one.
fn with_page<'a>(contents: &Contents<'a>) -> impl Iterator<Item = (usize, &'a Maneuver)> {
    let pages = contents.pages;
    (1..)
        .zip(contents.maneuvers)
        .filter(|(_, m)| pages.contains(&m.maneuver_id))
}

/// Makes the pages, in the order of the maneuvers.
#[must_use]
pub fn pages(contents: &Contents, markers: &ClassMarkers) -> Vec<ManeuverPage> {
    let rows = RowsByManeuver {
        markers,
        fits: contents.fits_by_maneuver(),
        history_figures: contents.history_figures,
        estimates: group_by(contents.estimates, |e| &e.maneuver_id),
        predictions: group_by(contents.predictions, |p| &p.maneuver_id),
        problems: group_by(contents.problems, |p| &p.place),
        matched: group_by(contents.matched, Matched::maneuver_id),
    };
    let maneuvers: Vec<(usize, &Maneuver)> = with_page(contents).collect();
    maneuvers
        .into_par_iter()
        .map(|(number, maneuver)| rows.page(maneuver, number))
        .collect()
}

/// Rows of the tables by maneuver.
struct RowsByManeuver<'a> {
    markers: &'a ClassMarkers<'a>,
    fits: BTreeMap<&'a str, &'a FitRow>,
    history_figures: &'a BTreeMap<String, HistoryFigure>,
    estimates: BTreeMap<&'a str, Vec<&'a EstimateRow>>,
    predictions: BTreeMap<&'a str, Vec<&'a AgreementRow>>,
    problems: BTreeMap<&'a str, Vec<&'a Problem>>,
    matched: BTreeMap<&'a str, Vec<&'a Matched>>,
}

impl RowsByManeuver<'_> {
    fn page(&self, maneuver: &Maneuver, number: usize) -> ManeuverPage {
        let id = maneuver.maneuver_id.as_str();
        let figure = self.history_figures.get(id);
        let matched = self.matched.get(id).and_then(|m| m.first()).copied();
        let flown_again = matched.and_then(|m| Some((m, m.history.as_ref()?)));
        let drawn = flown_again.map(|(matched, history)| {
            let rows = matched.first_rows().collect::<Vec<_>>();
            match_strips::draw(history, &rows, format!("p{number}"))
        });
        let mut facts = flight_condition(maneuver);
        facts.extend(fit_facts(self.fits.get(id).copied()));
        facts.extend(self.predictions.get(id).map(|rows| prediction_fact(rows)));
        facts.extend(matched.into_iter().flat_map(match_facts));
        ManeuverPage {
            anchor: format!("m{number}"),
            maneuver_id: id.to_owned(),
            class: maneuver.class.clone(),
            marker: self.markers.key(&maneuver.class),
            token: self.markers.token(&maneuver.class),
            facts,
            svg: figure.map_or_else(String::new, |figure| figure.svg.clone()),
            legend: figure
                .map_or_else(Vec::new, |figure| legend::time_history(figure.has_excluded)),
            match_legend: drawn.as_ref().map_or_else(Vec::new, |drawn| {
                legend::flown_again(drawn.has_outside, drawn.has_excused)
            }),
            match_svg: drawn.map_or_else(String::new, |drawn| drawn.svg),
            match_caption: flown_again.map_or_else(String::new, |(m, _)| match_caption(m)),
            estimates: estimates(self.estimates.get(id).map_or(&[], Vec::as_slice)),
            problems: self
                .problems
                .get(id)
                .into_iter()
                .flatten()
                .map(|p| format!("{}: {}", p.stage, p.reason))
                .collect(),
        }
    }
}

/// Verdict of each model; one outside the tolerances is a warning.
fn match_facts(matched: &Matched) -> impl Iterator<Item = (String, String, bool)> {
    matched.verdicts.iter().map(|row| {
        let name = format!("Match, {}", row.model);
        let value = match row.verdict {
            MatchVerdict::NotFlown => format!("not flown again: {}", row.reason),
            verdict => format!(
                "{verdict} the tolerances, margin {}, decided by {}; probability for a repeat: {} %",
                number(row.margin, 2),
                row.decided_by,
                row.repeat_pct
                    .map_or_else(|| DASH.to_owned(), |pct| fixed(pct, 1))
            ),
        };
        (name, value, row.verdict == MatchVerdict::Outside)
    })
}

/// Model and loop of the drawn simulation.
fn match_caption(matched: &Matched) -> String {
    let first = matched.verdicts.first();
    let model = first.map_or("", |row| row.model.name());
    let closed = first.is_some_and(|row| row.closed_loop == Some(1));
    let note = if closed {
        " Surfaces as recorded: feedback moved them."
    } else {
        ""
    };
    format!(
        "Flown again with the derivatives of the {model}, free-running from the matched start with the \
         recorded surfaces.{note}"
    )
}

fn fact(name: &str, value: String) -> (String, String, bool) {
    (name.to_owned(), value, false)
}

fn flight_condition(m: &Maneuver) -> Vec<(String, String, bool)> {
    let window = format!(
        "{}\u{2013}{} s of {}, {}",
        fixed(m.start_s, 1),
        fixed(m.end_s, 1),
        m.flight_id,
        m.origin
    );
    let condition = format!(
        "α {}, Mach {}, q̄ {} psf, V {} ft/s, altitude {} ft",
        angle(m.alpha_deg),
        fixed(m.mach, 3),
        fixed(m.qbar_psf, 1),
        fixed(m.velocity_ft_s, 0),
        fixed(m.altitude_ft, 0)
    );
    let mass = format!(
        "{} slug, centre of gravity at {} ft",
        fixed(m.mass_slug, 0),
        fixed(m.x_cg_ft, 2)
    );
    vec![
        fact("Time", window),
        fact("Flight condition", condition),
        fact("Mass", mass),
    ]
}

fn fit_facts(fit: Option<&FitRow>) -> Vec<(String, String, bool)> {
    let Some(fit) = fit else {
        return vec![fact("Fit", "none".to_owned())];
    };
    let outcome = format!("{}: {}", outcome_in_words(fit.outcome), fit.reason);
    let mut facts = vec![fact("Fit", outcome)];
    if fit.final_cost.is_some() {
        let cost = format!(
            "{} to {} in {}; condition number {}",
            number(fit.initial_cost, 3),
            number(fit.final_cost, 3),
            count(fit.iterations, "iteration"),
            number(fit.condition_number, 3)
        );
        facts.push(fact("Cost J", cost));
    }
    facts.extend(
        fit.confounded
            .as_ref()
            .map(|groups| fact("Near dependencies", groups.clone())),
    );
    facts
}

fn prediction_fact(rows: &[&AgreementRow]) -> (String, String, bool) {
    let outputs: Vec<String> = rows
        .iter()
        .map(|p| format!("{} {}", p.output, number(p.theil, 2)))
        .collect();
    fact(
        "Cross-validation",
        format!(
            "Theil's U with derivatives of other maneuvers: {}",
            outputs.join(", ")
        ),
    )
}

/// Table of the derivatives, without inactive ones.
fn estimates(rows: &[&EstimateRow]) -> TableView {
    let rows = rows
        .iter()
        .filter(|row| row.status != Status::Inactive)
        .map(|row| estimate(row))
        .collect();
    let heads = [
        "derivative",
        "unit",
        "status",
        "value",
        "bound",
        "corrected",
        "wind tunnel",
        "equation error",
        "inflation",
        "part, %",
    ];
    TableView::new("Derivatives", "", &heads, rows)
}

fn estimate(row: &EstimateRow) -> Vec<String> {
    let digits = Digits::for_values([row.value, row.wind_tunnel].into_iter().flatten(), 4);
    vec![
        row.derivative.clone(),
        notation::unit(&row.unit),
        row.status.to_string(),
        digits.write(row.value),
        number(row.bound, 2),
        number(row.bound_corrected, 2),
        digits.write(row.wind_tunnel),
        second_opinion(row, &digits),
        number(row.variance_inflation, 2),
        row.contribution_pct
            .map_or_else(|| DASH.to_owned(), |v| fixed(v, 0)),
    ]
}

/// Estimate by equation error with its standard error.
fn second_opinion(row: &EstimateRow, digits: &Digits) -> String {
    let value = digits.write(row.equation_error);
    match row.equation_error_bound {
        Some(bound) => format!("{value} ± {}", number(Some(bound), 2)),
        None => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture::{campaign, problem};

    fn made(contents: &Contents) -> Vec<ManeuverPage> {
        pages(contents, &ClassMarkers::new(contents))
    }

    #[test]
    fn every_maneuver_has_its_page_with_fit_history_and_problems() {
        let mut campaign = campaign();
        campaign.problems.push(crate::error::Problem {
            place: "1-OLON-10".into(),
            ..problem("it did not settle")
        });
        campaign.histories.remove(1);
        let contents = campaign.contents();
        let pages = made(&contents);
        assert_eq!(pages.len(), campaign.maneuvers.len());
        assert_eq!(pages[0].problems, ["ingest: it did not settle"]);
        assert!(pages[0].svg.starts_with("<svg") && pages[1].svg.is_empty());
        let fit = &pages[0]
            .facts
            .iter()
            .find(|f| f.0 == "Fit")
            .expect("the outcome of the fit")
            .1;
        assert!(fit.starts_with("did not converge"), "{fit}");
        assert_eq!(pages[0].estimates.rows.len(), 4);
        assert_eq!(anchors(&contents)["1-OLON-20"], pages[1].anchor);
    }

    #[test]
    fn a_match_outside_the_tolerances_is_a_warning() {
        let campaign = campaign();
        let pages = made(&campaign.contents());
        let warnings = |page: &ManeuverPage| {
            let warned = page.facts.iter().filter(|fact| fact.2);
            warned.map(|fact| fact.0.clone()).collect::<Vec<_>>()
        };
        assert!(warnings(&pages[0]).is_empty());
        assert_eq!(warnings(&pages[2]), ["Match, posterior", "Match, tunnel"]);
    }

    #[test]
    fn inactive_derivatives_are_not_listed() {
        let mut campaign = campaign();
        campaign.estimates[0].status = Status::Inactive;
        assert_eq!(made(&campaign.contents())[0].estimates.rows.len(), 3);
    }
}
