//! Causes of changes, as phrases.

use std::collections::{BTreeMap, BTreeSet};

use crate::flight::is_stretch;
use crate::lineage::{Cause, ManeuverChange, Moved, Origin, Stage};
use crate::maneuver::Status;
use crate::night::published_night::NightTables;

/// Causes of a night's changes.
pub(super) struct Causes {
    /// All differences between the lineages of the two nights.
    pub all: Vec<Cause>,
    /// Flights that only the earlier night has.
    gone_flights: BTreeSet<String>,
    /// Causes of changed maneuvers, by the derivatives that they estimate and by class.
    of_derivatives: BTreeMap<String, BTreeMap<String, BTreeSet<String>>>,
    /// Classes that were flown. A trend's group that is not a class has maneuvers of several
    /// classes.
    classes: BTreeSet<String>,
}

impl Causes {
    pub fn new(before: &NightTables, now: &NightTables) -> Causes {
        let maneuvers = before.maneuvers.iter().chain(now.maneuvers);
        let (flights_before, flights_now) = (&before.lineage.flights, &now.lineage.flights);
        let gone = flights_before
            .keys()
            .filter(|flight| !flights_now.contains_key(*flight));
        Causes {
            all: now.lineage.differences(before.lineage),
            gone_flights: gone.cloned().collect(),
            of_derivatives: BTreeMap::new(),
            classes: maneuvers.map(|m| m.class.clone()).collect(),
        }
    }

    fn of_origin(&self, is_flight: bool) -> impl Iterator<Item = &Cause> {
        let causes = self.all.iter();
        causes.filter(move |c| (c.origin == Origin::Flight) == is_flight)
    }

    /// Causes of a maneuver's change: its flight, or otherwise the settings and methods of its
    /// stages.
    pub fn of_maneuver(&self, flight_id: &str, class: &str) -> String {
        let of_flight: Vec<&Cause> = self
            .of_origin(true)
            .filter(|c| is_stretch(flight_id, &c.subject))
            .collect();
        let causes = if of_flight.is_empty() {
            self.of_settings(class)
        } else {
            of_flight
        };
        phrase(causes.iter().map(|c| c.words.as_str()))
    }

    /// Causes by settings and methods up to the estimate. Settings of other classes are listed only
    /// if there are no other causes.
    fn of_settings(&self, class: &str) -> Vec<&Cause> {
        let (of_others, own): (Vec<&Cause>, Vec<&Cause>) = self
            .of_origin(false)
            .filter(|c| c.stage <= Stage::Estimate)
            .partition(|c| is_of_other_class(c, class) && c.stage > Stage::Segment);
        if own.is_empty() { of_others } else { own }
    }

    /// Adds the causes of changed maneuvers to the derivatives that they estimate.
    pub fn with_maneuvers(
        mut self,
        changed: &[ManeuverChange],
        moved: &[Moved],
        now: &NightTables,
    ) -> Causes {
        let causes: BTreeMap<&str, &str> = changed
            .iter()
            .map(|m| (m.maneuver_id.as_str(), m.because.as_str()))
            .collect();
        let estimated = now.estimates.iter();
        for row in estimated.filter(|e| e.status == Status::Estimated) {
            if let Some(because) = causes.get(row.maneuver_id.as_str()) {
                self.add(&row.derivative, &row.class, because);
            }
        }
        let maneuvers = now.maneuvers.iter();
        let classes: BTreeMap<&str, &str> = maneuvers
            .map(|m| (m.maneuver_id.as_str(), m.class.as_str()))
            .collect();
        for row in moved {
            let class = classes.get(row.of.as_str()).copied().unwrap_or_default();
            self.add(&row.derivative, class, &row.because);
        }
        self
    }

    fn add(&mut self, derivative: &str, class: &str, because: &str) {
        let by_class = self.of_derivatives.entry(derivative.to_owned());
        let causes = by_class.or_default().entry(class.to_owned()).or_default();
        causes.insert(because.to_owned());
    }

    /// Causes of a trend's change: its maneuvers, and the settings and methods from the posterior to `until`.
    /// The group may be a class.
    pub fn of_trend(&self, derivative: &str, group: &str, until: Stage) -> String {
        let is_in_group = |class: &str| class == group || !self.classes.contains(group);
        let by_class = self.of_derivatives.get(derivative).into_iter().flatten();
        let of_maneuvers: BTreeSet<&str> = by_class
            .filter(|(class, _)| is_in_group(class))
            .flat_map(|(_, causes)| causes)
            .map(String::as_str)
            .collect();
        let gone = self
            .of_origin(true)
            .filter(|c| self.gone_flights.contains(&c.subject));
        let settings = self.of_origin(false).filter(|c| c.stage == Stage::Estimate);
        let later = self
            .all
            .iter()
            .filter(|c| (Stage::Model..=until).contains(&c.stage));
        let others = gone.chain(settings).chain(later);
        phrase(
            of_maneuvers
                .into_iter()
                .chain(others.map(|c| c.words.as_str())),
        )
    }
}

/// `true` for a setting of a class other than this one.
fn is_of_other_class(cause: &Cause, class: &str) -> bool {
    let mut path = cause.subject.split('.');
    matches!(path.next(), Some("classes" | "recognition"))
        && path.next().is_some_and(|name| name != class)
}

/// Joins causes to one phrase; a long list is cut, [`crate::lineage::Changes::causes`] has all.
fn phrase<'a>(causes: impl Iterator<Item = &'a str>) -> String {
    /// Largest number of causes in a phrase, so that it fits a line of the report.
    const MOST_CAUSES: usize = 4;
    let mut unique: Vec<&str> = Vec::new();
    for cause in causes.flat_map(|c| c.split("; ")) {
        if !unique.contains(&cause) {
            unique.push(cause);
        }
    }
    let more = unique.len().saturating_sub(MOST_CAUSES);
    let mut text = unique
        .into_iter()
        .take(MOST_CAUSES)
        .collect::<Vec<_>>()
        .join("; ");
    if more > 0 {
        text = format!("{text}; and {more} more");
    }
    if text.is_empty() {
        "the other maneuvers and flights".to_owned()
    } else {
        text
    }
}
