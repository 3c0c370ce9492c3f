//! What changed from one published night to the next, and why: maneuvers, their derivatives, trends
//! and verdicts.
//!
//! A number has moved when it differs by more than its uncertainty, the larger one of the two
//! nights: the corrected bound of an estimate, the standard error of a trend. Anything else that
//! differs is noise of the method and not listed.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::flight::is_stretch;
use crate::lineage::{
    Cause, Changes, Lineage, ManeuverChange, ManeuverDifference, Moved, Origin, Stage,
    VerdictChange,
};
use crate::maneuver::Status;
use crate::tables::{EstimateRow, FitRow, Outcome, PublishedTrend, PublishedVerdict};

/// What a maneuver was taken for, of the table `maneuvers`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Window {
    pub maneuver_id: String,
    pub flight_id: String,
    pub class: String,
    pub start_s: f64,
    pub end_s: f64,
}

/// The tables of a night that are compared, with what decided them. Rows of maneuvers estimated
/// together do not count.
#[derive(Clone, Copy, Debug)]
pub struct Tables<'a> {
    pub lineage: &'a Lineage,
    pub maneuvers: &'a [Window],
    pub fits: &'a [FitRow],
    pub estimates: &'a [EstimateRow],
    pub trends: &'a [PublishedTrend],
    pub verdicts: &'a [PublishedVerdict],
}

/// What changed from the night `since` to now.
#[must_use]
pub fn between(since: &str, before: &Tables, now: &Tables) -> Changes {
    let reasons = Reasons::new(before, now);
    let maneuvers = maneuvers(before, now, &reasons);
    let estimates = estimates(before, now, &reasons);
    let reasons = reasons.with_maneuvers(&maneuvers, &estimates, now);
    let trends = trends(before, now, &reasons);
    let names = |t: &Tables| -> BTreeSet<String> {
        t.trends
            .iter()
            .map(|t| format!("{}, {}", t.derivative, t.group))
            .collect()
    };
    let (a, b) = (names(before), names(now));
    let mut changes = Changes {
        since: Some(since.to_owned()),
        alert: false,
        new_trends: b.difference(&a).cloned().collect(),
        gone_trends: a.difference(&b).cloned().collect(),
        verdicts: verdicts(before, now, &reasons),
        causes: reasons.causes,
        maneuvers,
        estimates,
        trends,
    };
    changes.alert = !changes.estimates.is_empty()
        || !changes.trends.is_empty()
        || !changes.gone_trends.is_empty()
        || !changes.verdicts.is_empty()
        || changes
            .maneuvers
            .iter()
            .any(|m| m.what != ManeuverDifference::New);
    changes
}

/// Why things differ.
struct Reasons {
    causes: Vec<Cause>,
    /// Why the maneuvers behind a derivative differ, by derivative and class.
    behind: BTreeMap<String, BTreeMap<String, BTreeSet<String>>>,
    /// The classes that were flown: a trend's group that is none of them is of several.
    classes: BTreeSet<String>,
}

impl Reasons {
    fn new(before: &Tables, now: &Tables) -> Reasons {
        let classes = before
            .maneuvers
            .iter()
            .chain(now.maneuvers)
            .map(|m| m.class.clone())
            .collect();
        Reasons {
            causes: now.lineage.differences(before.lineage),
            behind: BTreeMap::new(),
            classes,
        }
    }

    /// Why something of a maneuver differs: its flight, or what its stages read. Other classes'
    /// settings do not count.
    fn of_maneuver(&self, flight_id: &str, class: &str) -> String {
        let other_class = |c: &Cause| {
            let mut path = c.subject.split('.');
            matches!(path.next(), Some("classes" | "recognition"))
                && path.next().is_some_and(|name| name != class)
        };
        let of_flight = self
            .causes
            .iter()
            .filter(|c| c.origin == Origin::Flight && is_stretch(flight_id, &c.subject))
            .collect::<Vec<_>>();
        let of_settings = || {
            let reaches = |c: &&Cause| c.origin != Origin::Flight && c.stage <= Stage::Estimate;
            let (others, own): (Vec<&Cause>, Vec<&Cause>) = self
                .causes
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
        words(causes.iter().map(|c| c.words.as_str()))
    }

    /// Adds what the maneuvers that changed have to say about the derivatives that they estimate.
    fn with_maneuvers(
        mut self,
        changed: &[ManeuverChange],
        moved: &[Moved],
        now: &Tables,
    ) -> Reasons {
        let why: BTreeMap<&str, &str> = changed
            .iter()
            .map(|m| (m.maneuver_id.as_str(), m.because.as_str()))
            .collect();
        let mut add = |derivative: &str, class: &str, because: &str| {
            let of_derivative = self.behind.entry(derivative.to_owned()).or_default();
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

    /// Why a trend differs: the maneuvers behind it, and what only trends and comparisons read.
    /// `group` may be a class.
    fn of_trend(&self, derivative: &str, group: &str, until: Stage) -> String {
        let counts = |class: &str| class == group || !self.classes.contains(group);
        let behind = self
            .behind
            .get(derivative)
            .into_iter()
            .flatten()
            .filter(|(class, _)| counts(class));
        let own: BTreeSet<&str> = behind
            .flat_map(|(_, because)| because)
            .map(String::as_str)
            .collect();
        let later = self
            .causes
            .iter()
            .filter(|c| (Stage::Trend..=until).contains(&c.stage));
        let gone = self
            .causes
            .iter()
            .filter(|c| c.origin == Origin::Flight && c.words.contains("gone"));
        let settings = self
            .causes
            .iter()
            .filter(|c| c.origin != Origin::Flight && c.stage == Stage::Estimate);
        words(
            own.into_iter()
                .chain(gone.chain(settings).chain(later).map(|c| c.words.as_str())),
        )
    }
}

/// Causes as one phrase; a long list is cut, the whole of it is in [`Changes::causes`].
fn words<'a>(causes: impl Iterator<Item = &'a str>) -> String {
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

fn maneuvers(before: &Tables, now: &Tables, reasons: &Reasons) -> Vec<ManeuverChange> {
    fn by_id<'a>(t: &Tables<'a>) -> BTreeMap<&'a str, &'a Window> {
        t.maneuvers
            .iter()
            .map(|m| (m.maneuver_id.as_str(), m))
            .collect()
    }
    fn fits<'a>(t: &Tables<'a>) -> BTreeMap<&'a str, &'a FitRow> {
        t.fits.iter().map(|f| (f.maneuver_id.as_str(), f)).collect()
    }
    let (old, new, old_fits, new_fits) = (by_id(before), by_id(now), fits(before), fits(now));
    let outcome = |fits: &BTreeMap<&str, &FitRow>, id: &str| {
        fits.get(id)
            .map_or_else(|| "no fit".to_owned(), |f| f.outcome.to_string())
    };
    let ids: BTreeSet<&str> = old.keys().chain(new.keys()).copied().collect();
    let mut changes = Vec::new();
    for id in ids {
        let (what, words, window) = match (old.get(id), new.get(id)) {
            (None, Some(window)) => (ManeuverDifference::New, outcome(&new_fits, id), *window),
            (Some(window), None) => (ManeuverDifference::Gone, String::new(), *window),
            (Some(a), Some(b)) => {
                let words = difference(a, b, &outcome(&old_fits, id), &outcome(&new_fits, id));
                if words.is_empty() {
                    continue;
                }
                (ManeuverDifference::Changed, words, *b)
            }
            (None, None) => continue,
        };
        let because = reasons.of_maneuver(&window.flight_id, &window.class);
        let (maneuver_id, class) = (id.to_owned(), window.class.clone());
        changes.push(ManeuverChange {
            maneuver_id,
            class,
            what,
            words,
            because,
        });
    }
    changes
}

/// What is different about a maneuver that both nights have.
fn difference(a: &Window, b: &Window, outcome_a: &str, outcome_b: &str) -> String {
    let mut words = Vec::new();
    if a.class != b.class {
        words.push(format!("class {} became {}", a.class, b.class));
    }
    if (a.start_s, a.end_s) != (b.start_s, b.end_s) {
        let times = |w: &Window| format!("{:.2}-{:.2} s", w.start_s, w.end_s);
        words.push(format!("{} became {}", times(a), times(b)));
    }
    if outcome_a != outcome_b {
        words.push(format!("{outcome_a} became {outcome_b}"));
    }
    words.join(", ")
}

/// Estimates of maneuvers that converged on both nights.
fn estimates(before: &Tables, now: &Tables, reasons: &Reasons) -> Vec<Moved> {
    let converged = |t: &Tables| -> BTreeSet<String> {
        t.fits
            .iter()
            .filter(|f| f.outcome == Outcome::Converged)
            .map(|f| f.maneuver_id.clone())
            .collect()
    };
    let (a, b) = (converged(before), converged(now));
    let counts = |e: &&EstimateRow| {
        e.status == Status::Estimated && a.contains(&e.maneuver_id) && b.contains(&e.maneuver_id)
    };
    let old: BTreeMap<(&str, &str), &EstimateRow> = before
        .estimates
        .iter()
        .filter(counts)
        .map(|e| ((e.maneuver_id.as_str(), e.derivative.as_str()), e))
        .collect();
    let moved = |e: &EstimateRow| {
        let was = old.get(&(e.maneuver_id.as_str(), e.derivative.as_str()))?;
        let (before, now) = (was.value?, e.value?);
        let uncertainty = larger(was.bound_corrected, e.bound_corrected)?;
        ((now - before).abs() > uncertainty).then(|| Moved {
            derivative: e.derivative.clone(),
            of: e.maneuver_id.clone(),
            alpha_deg: e.alpha_deg,
            before,
            now,
            uncertainty,
            because: reasons.of_maneuver(&e.flight_id, &e.class),
        })
    };
    now.estimates
        .iter()
        .filter(counts)
        .filter_map(moved)
        .collect()
}

fn larger(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.max(b)),
        (a, b) => a.or(b),
    }
}

/// A derivative, its group and an angle of attack in ten-thousandths of a degree: a place in the
/// tables of trends.
type Place<'a> = (&'a str, &'a str, i64);

#[expect(clippy::cast_possible_truncation, reason = "angles of attack")]
fn place<'a>(derivative: &'a str, group: &'a str, alpha_deg: f64) -> Place<'a> {
    (derivative, group, (alpha_deg * 1e4).round() as i64)
}

fn trends(before: &Tables, now: &Tables, reasons: &Reasons) -> Vec<Moved> {
    let old: BTreeMap<Place, &PublishedTrend> = before
        .trends
        .iter()
        .map(|t| (place(&t.derivative, &t.group, t.alpha_deg), t))
        .collect();
    let moved = |t: &PublishedTrend| {
        let was = old.get(&place(&t.derivative, &t.group, t.alpha_deg))?;
        let uncertainty = was.standard_error.max(t.standard_error);
        ((t.value - was.value).abs() > uncertainty).then(|| Moved {
            derivative: t.derivative.clone(),
            of: t.group.clone(),
            alpha_deg: t.alpha_deg,
            before: was.value,
            now: t.value,
            uncertainty,
            because: reasons.of_trend(&t.derivative, &t.group, Stage::Trend),
        })
    };
    now.trends.iter().filter_map(moved).collect()
}

fn verdicts(before: &Tables, now: &Tables, reasons: &Reasons) -> Vec<VerdictChange> {
    let old: BTreeMap<Place, &PublishedVerdict> = before
        .verdicts
        .iter()
        .map(|c| (place(&c.derivative, "", c.alpha_deg), c))
        .collect();
    let changed = |c: &PublishedVerdict| {
        let was = old.get(&place(&c.derivative, "", c.alpha_deg))?;
        (was.verdict != c.verdict).then(|| VerdictChange {
            derivative: c.derivative.clone(),
            alpha_deg: c.alpha_deg,
            before: was.verdict,
            now: c.verdict,
            because: reasons.of_trend(&c.derivative, "", Stage::Compare),
        })
    };
    now.verdicts.iter().filter_map(changed).collect()
}

#[cfg(test)]
mod tests;
