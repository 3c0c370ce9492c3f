//! Changes from one published night to the next, with their causes: maneuvers, their derivatives,
//! trends, verdicts and instruments.
//!
//! A number has moved if it differs by more than its uncertainty. The uncertainty is the corrected
//! bound of an estimate or the standard error of a trend: the larger value of the two nights.
//! Smaller differences are noise and are not listed. The information that the posterior gained is
//! given in nats.

mod causes;
mod contradictions;
mod instruments;
mod information_gain;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use self::causes::Causes;
use self::contradictions::contradictions;
use self::information_gain::information_gains;
use self::instruments::instruments;
use super::published_night::{ManeuverWindow, NightTables, PublishedNight};
use crate::lineage::{Changes, ManeuverChange, ManeuverDifference, Moved, Stage, VerdictChange};
use crate::maneuver::Status;
use crate::store::{Night, Nights};
use crate::tables::{
    EstimateRow, FitRow, InstrumentTrendRow, Outcome, PublishedTrend, PublishedVerdict,
    TunnelVerdict,
};

/// Changes since a published night. Tables that cannot be read are an alert; an older program may
/// have written them without one of today's columns.
#[must_use]
pub fn since(nights: &Nights, before: &Night, now: &NightTables) -> Changes {
    match PublishedNight::read(nights, before) {
        Ok(tables) => between(&before.name, &tables.tables(), now),
        Err(error) => Changes {
            since: Some(before.name.clone()),
            alert: true,
            not_compared: Some(error.to_string()),
            ..Changes::default()
        },
    }
}

/// Changes from the night `since` to now.
#[must_use]
pub fn between(since: &str, before: &NightTables, now: &NightTables) -> Changes {
    let causes = Causes::new(before, now);
    let maneuvers = changed_maneuvers(before, now, &causes);
    let estimates = moved_estimates(before, now, &causes);
    let causes = causes.with_maneuvers(&maneuvers, &estimates, now);
    let (trends_before, trends_now) = (trend_names(before), trend_names(now));
    let mut changes = Changes {
        since: Some(since.to_owned()),
        alert: false,
        not_compared: None,
        new_trends: trends_now.difference(&trends_before).cloned().collect(),
        gone_trends: trends_before.difference(&trends_now).cloned().collect(),
        trends: moved_trends(before, now, &causes),
        verdicts: changed_verdicts(before, now, &causes),
        learnt: information_gains(before, now),
        contradictions: contradictions(before, now),
        instruments: instruments(before.instrument_trends, now.instrument_trends),
        causes: causes.all,
        maneuvers,
        estimates,
    };
    changes.alert = needs_attention(&changes);
    changes
}

/// Changes that a first night shows by itself: steps and drifts of instruments over its flights.
#[must_use]
pub fn of_first_night(instrument_trends: &[InstrumentTrendRow]) -> Changes {
    let instruments = instruments(&[], instrument_trends);
    Changes {
        alert: !instruments.is_empty(),
        instruments,
        ..Changes::default()
    }
}

/// `true` if anything changed besides new maneuvers, new trends and information from flight.
fn needs_attention(changes: &Changes) -> bool {
    let mut maneuvers = changes.maneuvers.iter();
    !changes.estimates.is_empty()
        || !changes.trends.is_empty()
        || !changes.gone_trends.is_empty()
        || !changes.verdicts.is_empty()
        || !changes.contradictions.is_empty()
        || !changes.instruments.is_empty()
        || maneuvers.any(|m| m.what != ManeuverDifference::New)
}

/// Names of a night's trends, `derivative, group`.
fn trend_names(tables: &NightTables) -> BTreeSet<String> {
    let trends = tables.trends.iter();
    trends
        .map(|t| format!("{}, {}", t.derivative, t.group))
        .collect()
}

/// Windows and outcomes of a night's maneuvers, by id.
struct NightManeuvers<'a> {
    windows: BTreeMap<&'a str, &'a ManeuverWindow>,
    fits: BTreeMap<&'a str, &'a FitRow>,
}

impl<'a> NightManeuvers<'a> {
    fn of(tables: &NightTables<'a>) -> NightManeuvers<'a> {
        let windows = tables.maneuvers.iter();
        let fits = tables.fits.iter();
        NightManeuvers {
            windows: windows.map(|m| (m.maneuver_id.as_str(), m)).collect(),
            fits: fits.map(|f| (f.maneuver_id.as_str(), f)).collect(),
        }
    }

    fn outcome(&self, id: &str) -> String {
        let fit = self.fits.get(id);
        fit.map_or_else(|| "no fit".to_owned(), |f| f.outcome.to_string())
    }
}

fn changed_maneuvers(
    before: &NightTables,
    now: &NightTables,
    causes: &Causes,
) -> Vec<ManeuverChange> {
    let (before, now) = (NightManeuvers::of(before), NightManeuvers::of(now));
    let ids: BTreeSet<&str> = before
        .windows
        .keys()
        .chain(now.windows.keys())
        .copied()
        .collect();
    let change = |id: &str| {
        let (what, words, window) = match (before.windows.get(id), now.windows.get(id)) {
            (None, None) => return None,
            (None, Some(window)) => (ManeuverDifference::New, now.outcome(id), *window),
            (Some(window), None) => (ManeuverDifference::Gone, String::new(), *window),
            (Some(a), Some(b)) => {
                let words = difference(a, b, &before.outcome(id), &now.outcome(id));
                (ManeuverDifference::Changed, words, *b)
            }
        };
        (what != ManeuverDifference::Changed || !words.is_empty()).then(|| ManeuverChange {
            maneuver_id: id.to_owned(),
            class: window.class.clone(),
            what,
            words,
            because: causes.of_maneuver(&window.flight_id, &window.class),
        })
    };
    ids.into_iter().filter_map(change).collect()
}

/// Differences of a maneuver between two nights, in words.
fn difference(a: &ManeuverWindow, b: &ManeuverWindow, outcome_a: &str, outcome_b: &str) -> String {
    let mut words = Vec::new();
    if a.class != b.class {
        words.push(format!("class {} became {}", a.class, b.class));
    }
    if (a.start_s, a.end_s) != (b.start_s, b.end_s) {
        let times = |w: &ManeuverWindow| format!("{:.2}-{:.2} s", w.start_s, w.end_s);
        words.push(format!("{} became {}", times(a), times(b)));
    }
    if outcome_a != outcome_b {
        words.push(format!("{outcome_a} became {outcome_b}"));
    }
    words.join(", ")
}

/// Moved estimates of the maneuvers that converged in both nights.
fn moved_estimates(before: &NightTables, now: &NightTables, causes: &Causes) -> Vec<Moved> {
    let converged = |t: &NightTables| -> BTreeSet<String> {
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
        let least = uncertainty.max(3.0 * news_of_held(was, e));
        ((now - before).abs() > least).then(|| Moved {
            derivative: e.derivative.clone(),
            of: e.maneuver_id.clone(),
            alpha_deg: e.alpha_deg,
            before,
            now,
            uncertainty,
            because: causes.of_maneuver(&e.flight_id, &e.class),
        })
    };
    now.estimates
        .iter()
        .filter(counts)
        .filter_map(moved)
        .collect()
}

/// Standard deviation of an estimate's move by new information of other flights about the values
/// that it holds.
fn news_of_held(before: &EstimateRow, now: &EstimateRow) -> f64 {
    let [before, now] = [before, now].map(|e| e.bound_held.unwrap_or(0.0));
    (before * before - now * now).max(0.0).sqrt()
}

fn larger(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.max(b)),
        (a, b) => a.or(b),
    }
}

/// Point of a trend: derivative, group and angle of attack in ten-thousandths of a degree.
type TrendPoint<'a> = (&'a str, &'a str, i64);

#[expect(clippy::cast_possible_truncation, reason = "angles of attack")]
fn trend_point<'a>(derivative: &'a str, group: &'a str, alpha_deg: f64) -> TrendPoint<'a> {
    (derivative, group, (alpha_deg * 1e4).round() as i64)
}

fn moved_trends(before: &NightTables, now: &NightTables, causes: &Causes) -> Vec<Moved> {
    let old: BTreeMap<TrendPoint, &PublishedTrend> = before
        .trends
        .iter()
        .map(|t| (trend_point(&t.derivative, &t.group, t.alpha_deg), t))
        .collect();
    let moved = |t: &PublishedTrend| {
        let was = old.get(&trend_point(&t.derivative, &t.group, t.alpha_deg))?;
        let uncertainty = was.standard_error.max(t.standard_error);
        ((t.value - was.value).abs() > uncertainty).then(|| Moved {
            derivative: t.derivative.clone(),
            of: t.group.clone(),
            alpha_deg: t.alpha_deg,
            before: was.value,
            now: t.value,
            uncertainty,
            because: causes.of_trend(&t.derivative, &t.group, Stage::Trend),
        })
    };
    now.trends.iter().filter_map(moved).collect()
}

/// Verdicts that differ from those of the earlier night. The first verdict after `nothing learnt`
/// is no change.
fn changed_verdicts(
    before: &NightTables,
    now: &NightTables,
    causes: &Causes,
) -> Vec<VerdictChange> {
    let old: BTreeMap<TrendPoint, &PublishedVerdict> = before
        .verdicts
        .iter()
        .map(|c| (trend_point(&c.derivative, "", c.alpha_deg), c))
        .collect();
    let changed = |c: &PublishedVerdict| {
        let was = old.get(&trend_point(&c.derivative, "", c.alpha_deg))?;
        let is_first = was.verdict == TunnelVerdict::NothingLearnt;
        (was.verdict != c.verdict && !is_first).then(|| VerdictChange {
            derivative: c.derivative.clone(),
            alpha_deg: c.alpha_deg,
            before: was.verdict,
            now: c.verdict,
            because: causes.of_trend(&c.derivative, "", Stage::Compare),
        })
    };
    now.verdicts.iter().filter_map(changed).collect()
}
