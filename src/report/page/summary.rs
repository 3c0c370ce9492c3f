//! Summary in sentences: maneuvers flown, failures, disagreements with the wind tunnel.

use std::collections::BTreeSet;

use serde::Serialize;

use super::classes::class_outcomes::{self, ClassOutcomes};
use super::derivatives::derivative_results::DerivativeResults;
use super::derivatives::verdict_ranges::{self, VerdictRange};
use super::derivatives::verdict_table::LARGEST_PERCENTAGE;
use crate::report::contents::Contents;
use crate::report::notation::{angle, count, fixed, outcome_in_words};
use crate::tables::{ComparisonRow, EventVerdict, FitRow, Outcome, TunnelVerdict};

/// The sentences, by subject.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    pub flown: Vec<String>,
    pub failed: Vec<String>,
    pub disagrees: Vec<String>,
}

/// Length of the lists of disagreements and of failures.
const LONGEST_LIST: usize = 5;

/// Writes the summary.
#[must_use]
pub fn summary(
    contents: &Contents,
    derivatives: &[DerivativeResults],
    classes: &[ClassOutcomes],
) -> Summary {
    let mut disagrees = vec![agreement(derivatives)];
    disagrees.extend(opposite_signs(derivatives));
    disagrees.extend(largest_disagreements(derivatives));
    Summary {
        flown: vec![flown(contents, classes)],
        failed: failed(contents),
        disagrees,
    }
}

/// Number of maneuvers and flights, with the outcomes of the fits.
fn flown(contents: &Contents, classes: &[ClassOutcomes]) -> String {
    if contents.maneuvers.is_empty() {
        return "No maneuver was found: nothing was estimated, and there is nothing to compare."
            .to_owned();
    }
    let flights: BTreeSet<&str> = contents
        .maneuvers
        .iter()
        .map(|m| m.flight_id.as_str())
        .collect();
    let mut outcomes = Vec::new();
    for (column, head) in class_outcomes::heads().into_iter().enumerate() {
        let total: usize = classes.iter().filter_map(|c| c.outcomes.get(column)).sum();
        if total > 0 {
            outcomes.push(format!("{total} {head}"));
        }
    }
    format!(
        "{} in {}: {}.",
        count(contents.maneuvers.len(), "maneuver"),
        count(flights.len(), "flight"),
        outcomes.join(", ")
    )
}

/// Share of the angles of attack with a tunnel value at which a derivative agrees; `None` if the
/// tunnel has none.
fn agreeing_share(derivative: &DerivativeResults) -> Option<f64> {
    let rows = &derivative.comparison;
    let compared = rows
        .iter()
        .filter(|c| c.tunnel.wind_tunnel.is_some())
        .count();
    let agreeing = rows
        .iter()
        .filter(|c| c.tunnel.verdict == TunnelVerdict::Agrees)
        .count();
    (compared > 0).then(|| agreeing as f64 / compared as f64)
}

/// Number of derivatives that agree with the wind tunnel everywhere, mostly or rarely.
fn agreement(derivatives: &[DerivativeResults]) -> String {
    let shares: Vec<Option<f64>> = derivatives
        .iter()
        .filter(|d| d.is_compared())
        .map(agreeing_share)
        .collect();
    if shares.is_empty() {
        return "No derivative was compared with the wind tunnel.".to_owned();
    }
    let compared = shares.iter().flatten().count();
    let everywhere = shares.iter().flatten().filter(|s| **s >= 1.0).count();
    let mostly = shares
        .iter()
        .flatten()
        .filter(|s| (0.5..1.0).contains(*s))
        .count();
    let rest = compared - everywhere - mostly;
    let without_tunnel = match shares.len() - compared {
        0 => String::new(),
        n => format!("; {n} more have no tunnel value to be compared with"),
    };
    format!(
        "{} compared with the wind tunnel: {everywhere} agree at every angle of attack, {mostly} \
         at half of them or more, {rest} at fewer{without_tunnel}.",
        count(compared, "derivative")
    )
}

/// Derivatives whose sign differs between flight and tunnel, with the angles of attack.
fn opposite_signs(derivatives: &[DerivativeResults]) -> Option<String> {
    let mut places = Vec::new();
    for derivative in derivatives {
        let angles: Vec<String> = verdict_ranges::ranges(&derivative.comparison)
            .iter()
            .filter(|range| range.verdict == TunnelVerdict::SignDiffers)
            .map(VerdictRange::angles)
            .collect();
        if !angles.is_empty() {
            places.push(format!("{} ({})", derivative.name, angles.join(", ")));
        }
    }
    (!places.is_empty())
        .then(|| format!("Opposite sign in flight and tunnel: {}.", places.join(", ")))
}

/// A comparison that disagrees, with the magnitude of its z.
type Disagreement<'a> = (f64, &'a ComparisonRow);

/// The disagreement of a derivative with the largest z.
fn worst_disagreement<'a>(derivative: &DerivativeResults<'a>) -> Option<Disagreement<'a>> {
    derivative
        .comparison
        .iter()
        .filter(|row| row.tunnel.verdict != TunnelVerdict::Agrees)
        .filter_map(|row| Some((row.tunnel.z.filter(|z| z.is_finite())?.abs(), *row)))
        .max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The derivatives that disagree most, each at its worst angle of attack.
fn largest_disagreements(derivatives: &[DerivativeResults]) -> Option<String> {
    let mut all: Vec<(&str, Disagreement)> = derivatives
        .iter()
        .filter(|d| d.is_compared())
        .filter_map(|d| Some((d.name, worst_disagreement(d)?)))
        .collect();
    all.sort_by(|a, b| b.1.0.total_cmp(&a.1.0).then_with(|| a.0.cmp(b.0)));
    let listed: Vec<String> = all
        .iter()
        .take(LONGEST_LIST)
        .map(|(name, (z, row))| disagreement_in_words(name, *z, row))
        .collect();
    (!listed.is_empty()).then(|| format!("Largest in standard errors: {}.", listed.join("; ")))
}

fn disagreement_in_words(name: &str, z: f64, row: &ComparisonRow) -> String {
    let percentage = row
        .tunnel
        .difference_pct
        .filter(|pct| pct.is_finite() && pct.abs() < LARGEST_PERCENTAGE)
        .map_or_else(String::new, |pct| format!(" by {} %", fixed(pct.abs(), 0)));
    format!(
        "{name} {}{percentage} at {} (z {})",
        row.tunnel.verdict,
        angle(row.alpha_deg),
        fixed(z, 0)
    )
}

/// Failed fits, failed checks of the records, events not confirmed, problems.
fn failed(contents: &Contents) -> Vec<String> {
    let (doubtful, failed_fits): (Vec<&FitRow>, Vec<&FitRow>) = contents
        .fits
        .iter()
        .filter(|fit| fit.outcome != Outcome::Converged)
        .partition(|fit| fit.outcome == Outcome::Doubtful);
    let mut lines = Vec::new();
    lines.extend(failed_fits_line(&failed_fits));
    lines.extend(doubtful_fits_line(&doubtful));
    lines.extend(checks_line(contents));
    lines.extend(events_line(contents));
    if !contents.problems.is_empty() {
        lines.push(format!(
            "{} in flights, channels or maneuvers: see what failed and why.",
            count(contents.problems.len(), "problem")
        ));
    } else if failed_fits.is_empty() && doubtful.is_empty() {
        lines.push("Every flight was read and every maneuver fitted.".to_owned());
    }
    lines
}

fn failed_fits_line(fits: &[&FitRow]) -> Option<String> {
    let mut listed: Vec<String> = Vec::new();
    for fit in fits.iter().take(LONGEST_LIST) {
        listed.push(format!(
            "{} ({})",
            fit.maneuver_id,
            outcome_in_words(fit.outcome)
        ));
    }
    let more = match fits.len() - listed.len() {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    (!fits.is_empty()).then(|| {
        format!(
            "{} without a usable fit: {}{more}.",
            count(fits.len(), "maneuver"),
            listed.join(", ")
        )
    })
}

/// All doubtful fits, each with its reason.
fn doubtful_fits_line(fits: &[&FitRow]) -> Option<String> {
    let named = |fit: &&FitRow| format!("{} ({})", fit.maneuver_id, fit.reason);
    let all: Vec<String> = fits.iter().map(named).collect();
    (!fits.is_empty()).then(|| {
        format!(
            "{} in no trend: {}.",
            count(fits.len(), "doubtful maneuver"),
            all.join(", ")
        )
    })
}

fn checks_line(contents: &Contents) -> Option<String> {
    let failed = contents
        .checks
        .iter()
        .filter(|c| !c.verdict.passed())
        .count();
    (!contents.checks.is_empty()).then(|| {
        format!(
            "Records: {} of units and signs between channels, {failed} failed.",
            count(contents.checks.len(), "check")
        )
    })
}

fn events_line(contents: &Contents) -> Option<String> {
    let agreeing = contents
        .events
        .iter()
        .filter(|e| e.verdict == EventVerdict::Agrees)
        .count();
    (!contents.events.is_empty()).then(|| {
        format!(
            "The analyst's list of events against the recognised maneuvers: {}, {agreeing} agree.",
            count(contents.events.len(), "event")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::super::classes::class_markers::ClassMarkers;
    use super::super::derivatives::derivative_results;
    use super::*;
    use crate::report::campaign_fixture::campaign;

    #[test]
    fn a_doubtful_maneuver_is_named_with_its_reason() {
        let mut campaign = campaign();
        let fit = campaign.fits.last_mut().unwrap();
        fit.outcome = Outcome::Doubtful;
        fit.reason = "its derivatives are far from equation error".into();
        let name = fit.maneuver_id.clone();
        let lines = failed(&campaign.contents());
        let line = lines
            .iter()
            .find(|l| l.contains("1 doubtful maneuver in no trend"));
        let line = line.unwrap_or_else(|| panic!("{lines:?}"));
        assert!(
            line.contains(&name) && line.contains("far from equation error"),
            "{line}"
        );
        assert!(
            lines.iter().all(|l| !l.contains("every maneuver fitted")),
            "{lines:?}"
        );
    }

    #[test]
    fn opposite_signs_are_in_the_summary() {
        let mut campaign = campaign();
        campaign.comparison[0].tunnel.verdict = TunnelVerdict::SignDiffers;
        let contents = campaign.contents();
        let lines = summary(
            &contents,
            &derivative_results::collect(&contents),
            &class_outcomes::by_class(&contents, &ClassMarkers::new(&contents)),
        )
        .disagrees;
        let name = &campaign.comparison[0].derivative;
        assert!(
            lines
                .iter()
                .any(|l| l.starts_with("Opposite sign") && l.contains(name.as_str())),
            "{lines:?}"
        );
    }
}
