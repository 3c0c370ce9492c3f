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
    /// Causes of changed maneuvers, by the derivatives that they estimate and by class.
    of_derivatives: BTreeMap<String, BTreeMap<String, BTreeSet<String>>>,
    /// Classes that were flown. A trend's group that is no class has maneuvers of several.
    classes: BTreeSet<String>,
}

impl Causes {
    pub fn new(before: &NightTables, now: &NightTables) -> Causes {
        let classes = before
            .maneuvers
            .iter()
            .chain(now.maneuvers)
            .map(|m| m.class.clone())
            .collect();
        Causes {
            all: now.lineage.differences(before.lineage),
            of_derivatives: BTreeMap::new(),
            classes,
        }
    }

    /// Causes of a maneuver's change: its flight, or else the settings and methods of its stages.
    /// Settings of other classes do not count.
    pub fn of_maneuver(&self, flight_id: &str, class: &str) -> String {
        let other_class = |c: &Cause| {
            let mut path = c.subject.split('.');
            matches!(path.next(), Some("classes" | "recognition"))
                && path.next().is_some_and(|name| name != class)
        };
        let of_flight = self
            .all
            .iter()
            .filter(|c| c.origin == Origin::Flight && is_stretch(flight_id, &c.subject))
            .collect::<Vec<_>>();
        let of_settings = || {
            let reaches = |c: &&Cause| c.origin != Origin::Flight && c.stage <= Stage::Estimate;
            let (others, own): (Vec<&Cause>, Vec<&Cause>) = self
                .all
                .iter()
                .filter(reaches)
                .partition(|c| other_class(c) && c.stage > Stage::Segment);
            if own.is_empty() { others } else { own }
        };
        let causes = if of_flight.is_empty() {
            of_settings()
        } else {
            of_flight
        };
        phrase(causes.iter().map(|c| c.words.as_str()))
    }

    /// Adds the causes of changed maneuvers to the derivatives that they estimate.
    pub fn with_maneuvers(
        mut self,
        changed: &[ManeuverChange],
        moved: &[Moved],
        now: &NightTables,
    ) -> Causes {
        let why: BTreeMap<&str, &str> = changed
            .iter()
            .map(|m| (m.maneuver_id.as_str(), m.because.as_str()))
            .collect();
        let mut add = |derivative: &str, class: &str, because: &str| {
            let of_derivative = self
                .of_derivatives
                .entry(derivative.to_owned())
                .or_default();
            of_derivative
                .entry(class.to_owned())
                .or_default()
                .insert(because.to_owned());
        };
        for row in now
            .estimates
            .iter()
            .filter(|e| e.status == Status::Estimated)
        {
            if let Some(because) = why.get(row.maneuver_id.as_str()) {
                add(&row.derivative, &row.class, because);
            }
        }
        let class: BTreeMap<&str, &str> = now
            .maneuvers
            .iter()
            .map(|m| (m.maneuver_id.as_str(), m.class.as_str()))
            .collect();
        for row in moved {
            add(
                &row.derivative,
                class.get(row.of.as_str()).copied().unwrap_or_default(),
                &row.because,
            );
        }
        self
    }

    /// Causes of a trend's change: its maneuvers, and the settings and methods as far as `until`.
    /// The group may be a class.
    pub fn of_trend(&self, derivative: &str, group: &str, until: Stage) -> String {
        let counts = |class: &str| class == group || !self.classes.contains(group);
        let behind = self
            .of_derivatives
            .get(derivative)
            .into_iter()
            .flatten()
            .filter(|(class, _)| counts(class));
        let own: BTreeSet<&str> = behind
            .flat_map(|(_, because)| because)
            .map(String::as_str)
            .collect();
        let later = self
            .all
            .iter()
            .filter(|c| (Stage::Trend..=until).contains(&c.stage));
        let gone = self
            .all
            .iter()
            .filter(|c| c.origin == Origin::Flight && c.words.contains("gone"));
        let settings = self
            .all
            .iter()
            .filter(|c| c.origin != Origin::Flight && c.stage == Stage::Estimate);
        phrase(
            own.into_iter()
                .chain(gone.chain(settings).chain(later).map(|c| c.words.as_str())),
        )
    }
}

/// Joins causes to one phrase; a long list is cut, [`crate::lineage::Changes::causes`] has all.
fn phrase<'a>(causes: impl Iterator<Item = &'a str>) -> String {
    /// Causes in a phrase, so that it fits a line of the report.
    const MOST: usize = 4;
    let mut unique: Vec<&str> = Vec::new();
    for cause in causes.flat_map(|c| c.split("; ")) {
        if !unique.contains(&cause) {
            unique.push(cause);
        }
    }
    let more = unique.len().saturating_sub(MOST);
    let mut text = unique.into_iter().take(MOST).collect::<Vec<_>>().join("; ");
    if more > 0 {
        text = format!("{text}; and {more} more");
    }
    if text.is_empty() {
        "the other maneuvers and flights".to_owned()
    } else {
        text
    }
}
