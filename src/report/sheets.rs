//! A page per maneuver: its flight condition, how its fit ended, its time history, and its
//! derivatives.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::failures::TableView;
use super::marks::{LegendView, Mark};
use super::notation::{self, Digits, NOTHING, angle, fixed, number};
use super::subject::by_name;
use super::{Contents, gallery, histories, summary};
use crate::maneuver::Maneuver;
use crate::tables::{EstimateRow, FitRow, History, PredictionRow};

/// The page of one maneuver.
#[derive(Clone, Debug, Serialize)]
pub struct Sheet {
    pub anchor: String,
    pub maneuver_id: String,
    pub class: String,
    pub mark: String,
    /// What it is hidden with.
    pub token: String,
    pub facts: Vec<(String, String)>,
    /// Empty where no response was computed.
    pub svg: String,
    pub legend: Vec<LegendView>,
    pub estimates: TableView,
    pub problems: Vec<String>,
}

/// Where the page of each maneuver that has one is.
#[must_use]
pub fn anchors<'a>(contents: &Contents<'a>) -> BTreeMap<&'a str, String> {
    with_page(contents)
        .map(|(i, m)| (m.maneuver_id.as_str(), format!("m{}", i + 1)))
        .collect()
}

fn with_page<'a>(contents: &Contents<'a>) -> impl Iterator<Item = (usize, &'a Maneuver)> {
    let pages = contents.pages;
    contents
        .maneuvers
        .iter()
        .enumerate()
        .filter(|(_, m)| pages.contains(&m.maneuver_id))
}

/// A page per maneuver that has one, in their order.
#[must_use]
pub fn sheets(contents: &Contents) -> Vec<Sheet> {
    let of = Rows {
        marks: gallery::marks(contents),
        fits: summary::fits_by_maneuver(contents),
        histories: by_name(contents.histories, |h| &h.maneuver_id),
        estimates: by_name(contents.estimates, |e| &e.maneuver_id),
        predictions: by_name(contents.predictions, |p| &p.maneuver_id),
        problems: by_name(contents.problems, |p| &p.place),
    };
    let maneuvers: Vec<(usize, &Maneuver)> = with_page(contents).collect();
    maneuvers
        .into_par_iter()
        .map(|(i, maneuver)| of.sheet(maneuver, i + 1))
        .collect()
}

/// What is known, by maneuver.
struct Rows<'a> {
    marks: Vec<(&'a str, Mark)>,
    fits: BTreeMap<&'a str, &'a FitRow>,
    histories: BTreeMap<&'a str, Vec<&'a History>>,
    estimates: BTreeMap<&'a str, Vec<&'a EstimateRow>>,
    predictions: BTreeMap<&'a str, Vec<&'a PredictionRow>>,
    problems: BTreeMap<&'a str, Vec<&'a crate::error::Problem>>,
}

impl Rows<'_> {
    fn sheet(&self, maneuver: &Maneuver, place: usize) -> Sheet {
        let id = maneuver.maneuver_id.as_str();
        let history = self.histories.get(id).and_then(|h| h.first());
        let mut facts = condition(maneuver);
        facts.extend(fit(self.fits.get(id).copied()));
        facts.extend(self.predictions.get(id).map(|rows| predicted(rows)));
        let rows = self.estimates.get(id).map_or(&[][..], Vec::as_slice);
        Sheet {
            anchor: format!("m{place}"),
            maneuver_id: id.to_owned(),
            class: maneuver.class.clone(),
            mark: self
                .marks
                .iter()
                .find(|m| m.0 == maneuver.class)
                .map_or_else(String::new, |m| m.1.key()),
            token: gallery::token(&self.marks, &maneuver.class),
            facts,
            svg: history.map_or_else(String::new, |h| histories::drawing(h, format!("h{place}"))),
            legend: history.map_or_else(Vec::new, |h| histories::legend(h)),
            estimates: estimates(rows),
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

fn fact(name: &str, value: String) -> (String, String) {
    (name.to_owned(), value)
}

fn condition(m: &Maneuver) -> Vec<(String, String)> {
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
        "{} slug, center of gravity at {} ft",
        fixed(m.mass_slug, 0),
        fixed(m.x_cg_ft, 2)
    );
    vec![
        fact("When", window),
        fact("Flight condition", condition),
        fact("Mass", mass),
    ]
}

fn fit(fit: Option<&FitRow>) -> Vec<(String, String)> {
    let Some(fit) = fit else {
        return vec![fact("Fit", "none".to_owned())];
    };
    let outcome = format!(
        "{}: {}",
        summary::outcome_in_words(&fit.outcome),
        fit.reason
    );
    let mut facts = vec![fact("Fit", outcome)];
    if fit.final_cost.is_some() {
        let (first, last) = (number(fit.initial_cost, 3), number(fit.final_cost, 3));
        let iterations = notation::count(fit.iterations, "iteration");
        let condition = number(fit.condition_number, 3);
        facts.push(fact(
            "Cost J",
            format!("{first} to {last} in {iterations}; condition number {condition}"),
        ));
    }
    facts.extend(
        fit.confounded
            .as_ref()
            .map(|groups| fact("Hardly told apart", groups.clone())),
    );
    facts
}

fn predicted(rows: &[&PredictionRow]) -> (String, String) {
    let of = |p: &&PredictionRow| format!("{} {}", p.output, number(p.theil, 2));
    fact(
        "Predicted by others",
        format!(
            "Theil's U: {}",
            rows.iter().map(of).collect::<Vec<_>>().join(", ")
        ),
    )
}

fn estimates(rows: &[&EstimateRow]) -> TableView {
    let shown = rows.iter().filter(|r| r.status != "inactive");
    let row = |r: &&EstimateRow| {
        let digits = Digits::of([r.value, r.wind_tunnel].into_iter().flatten(), 4);
        vec![
            r.derivative.clone(),
            notation::unit(&r.unit),
            r.status.clone(),
            digits.write(r.value),
            number(r.bound, 2),
            number(r.bound_corrected, 2),
            digits.write(r.wind_tunnel),
            digits.write(r.equation_error),
            r.variance_inflation
                .map_or_else(|| NOTHING.to_owned(), |v| number(Some(v), 2)),
            r.contribution_pct
                .map_or_else(|| NOTHING.to_owned(), |v| fixed(v, 0)),
        ]
    };
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
    TableView::new("Derivatives", "", &heads, shown.map(row).collect())
}

#[cfg(test)]
mod tests {
    use super::super::samples::{campaign, problem};
    use super::*;

    #[test]
    fn every_maneuver_has_its_page_with_what_is_known_of_it() {
        let mut campaign = campaign();
        campaign.problems.push(crate::error::Problem {
            place: "1-OLON-10".into(),
            ..problem("it did not settle")
        });
        campaign.histories.remove(1);
        let contents = campaign.contents();
        let sheets = sheets(&contents);
        assert_eq!(sheets.len(), campaign.maneuvers.len());
        assert_eq!(sheets[0].problems, ["ingest: it did not settle"]);
        assert!(sheets[0].svg.starts_with("<svg") && sheets[1].svg.is_empty());
        let fit = &sheets[0]
            .facts
            .iter()
            .find(|f| f.0 == "Fit")
            .expect("how the fit ended")
            .1;
        assert!(fit.starts_with("did not converge"), "{fit}");
        assert_eq!(sheets[0].estimates.rows.len(), 4);
        assert_eq!(anchors(&contents)["1-OLON-20"], sheets[1].anchor);
    }

    #[test]
    fn what_is_inactive_is_not_listed() {
        let mut campaign = campaign();
        campaign.estimates[0].status = "inactive".into();
        assert_eq!(sheets(&campaign.contents())[0].estimates.rows.len(), 3);
    }
}
