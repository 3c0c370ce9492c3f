//! Table of maneuver classes by outcome of the fit.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::class_markers::ClassMarkers;
use crate::aero::Axis;
use crate::maneuver::Maneuver;
use crate::report::contents::Contents;
use crate::report::figure::scale::extent;
use crate::report::notation::{DASH, fixed, outcome_in_words};
use crate::tables::{FitRow, Outcome};

/// One row of the table.
#[derive(Clone, Debug, Serialize)]
pub struct ClassOutcomes {
    pub name: String,
    pub title: String,
    pub axis: String,
    /// Number of maneuvers of the class.
    pub found: usize,
    /// Maneuvers by outcome, in the order of [`heads`]; the last number is without a fit.
    pub outcomes: Vec<usize>,
    /// Range of angle of attack.
    pub alpha: String,
    /// Marker of the class in figures.
    pub marker: String,
    /// Word by which the page hides the class.
    pub token: String,
}

/// Heads of the outcome columns.
#[must_use]
pub fn heads() -> Vec<&'static str> {
    let outcomes = Outcome::ALL.into_iter().map(outcome_in_words);
    outcomes.chain(["no fit"]).collect()
}

/// A row per configured class, then one per class that occurs in maneuvers only.
#[must_use]
pub fn by_class(contents: &Contents, markers: &ClassMarkers) -> Vec<ClassOutcomes> {
    let fits = contents.fits_by_maneuver();
    let configured = contents
        .classes
        .iter()
        .map(|c| (c.name.as_str(), c.title.as_str(), c.axis));
    let names: BTreeSet<&str> = contents.classes.iter().map(|c| c.name.as_str()).collect();
    let unconfigured: BTreeMap<&str, Axis> = contents
        .maneuvers
        .iter()
        .map(|m| (m.class.as_str(), m.axis))
        .filter(|(class, _)| !names.contains(class))
        .collect();
    configured
        .chain(
            unconfigured
                .into_iter()
                .map(|(name, axis)| (name, "", axis)),
        )
        .map(|(name, title, axis)| {
            let flown: Vec<&Maneuver> = contents
                .maneuvers
                .iter()
                .filter(|m| m.class == name)
                .collect();
            ClassOutcomes {
                name: name.to_owned(),
                title: title.to_owned(),
                axis: axis.name().to_owned(),
                found: flown.len(),
                outcomes: count_outcomes(&flown, &fits),
                alpha: alpha_range(&flown),
                marker: markers.key(name),
                token: markers.token(name),
            }
        })
        .collect()
}

fn count_outcomes(maneuvers: &[&Maneuver], fits: &BTreeMap<&str, &FitRow>) -> Vec<usize> {
    let mut counts = vec![0; Outcome::ALL.len() + 1];
    for maneuver in maneuvers {
        let column = fits
            .get(maneuver.maneuver_id.as_str())
            .and_then(|fit| Outcome::ALL.iter().position(|o| *o == fit.outcome))
            .unwrap_or(Outcome::ALL.len());
        counts[column] += 1;
    }
    counts
}

fn alpha_range(maneuvers: &[&Maneuver]) -> String {
    extent(maneuvers.iter().map(|m| m.alpha_deg)).map_or_else(
        || DASH.to_owned(),
        |(low, high)| format!("{}\u{2013}{}°", fixed(low, 0), fixed(high, 0)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture::campaign;

    fn rows(contents: &Contents) -> Vec<ClassOutcomes> {
        by_class(contents, &ClassMarkers::new(contents))
    }

    #[test]
    fn a_maneuver_without_a_fit_is_counted_as_such() {
        let mut campaign = campaign();
        campaign.fits.pop();
        let rows = rows(&campaign.contents());
        let without_fit: usize = rows.iter().map(|c| c.outcomes[Outcome::ALL.len()]).sum();
        assert_eq!(without_fit, 1);
        let all: usize = rows.iter().flat_map(|c| &c.outcomes).sum();
        assert_eq!(all, campaign.maneuvers.len());
    }

    #[test]
    fn a_class_that_is_not_configured_is_listed_too() {
        let mut campaign = campaign();
        campaign.classes.clear();
        assert!(!rows(&campaign.contents()).is_empty());
    }
}
