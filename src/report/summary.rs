//! The summary: what was flown and fitted, class by class, and derivative by derivative where
//! flight and tunnel agree.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::Contents;
use super::gallery;
use super::notation::{self, NOTHING, angle, count, number};
use super::scale::{extent, quantile};
use super::subject::Subject;
use super::verdict::{self, Run};
use crate::aero::Axis;
use crate::maneuver::Maneuver;
use crate::tables::{ComparisonRow, FitRow};

/// The outcomes of a fit with their column heads, in the order of the summary's columns.
const OUTCOMES: [(&str, &str); 4] = [
    ("converged", "converged"),
    ("not_converged", "did not converge"),
    ("unidentifiable", "unidentifiable"),
    ("rejected", "rejected"),
];

/// Width of a verdict strip, px.
const STRIP_WIDTH: u32 = 130;

/// One line of class × outcome.
#[derive(Clone, Debug, Serialize)]
pub struct ClassView {
    pub name: String,
    pub title: String,
    pub axis: String,
    pub found: usize,
    /// By the order of the outcomes; the last one counts maneuvers without a fit.
    pub outcomes: Vec<usize>,
    pub alpha: String,
    /// Its mark in the figures, and the word it is hidden with.
    pub mark: String,
    pub token: String,
}

/// One line of the verdict table.
#[derive(Clone, Debug, Serialize)]
pub struct VerdictView {
    pub name: String,
    pub symbol: String,
    pub unit: String,
    /// Where its figure is; empty when there is none.
    pub anchor: String,
    pub phrase: String,
    pub strip: String,
    pub difference: String,
    pub maneuvers: usize,
    pub bound: String,
}

/// The verdicts of one axis.
#[derive(Clone, Debug, Serialize)]
pub struct VerdictGroup {
    pub title: String,
    pub alpha_from: String,
    pub alpha_to: String,
    pub rows: Vec<VerdictView>,
}

/// The fit of each maneuver, by its id.
#[must_use]
pub fn fits_by_maneuver<'a>(contents: &Contents<'a>) -> BTreeMap<&'a str, &'a FitRow> {
    contents
        .fits
        .iter()
        .map(|fit| (fit.maneuver_id.as_str(), fit))
        .collect()
}

/// The heads of the outcome columns.
#[must_use]
pub fn outcome_heads() -> Vec<&'static str> {
    OUTCOMES
        .iter()
        .map(|(_, head)| *head)
        .chain(["no fit"])
        .collect()
}

/// The outcome of a fit in words.
#[must_use]
pub fn outcome_in_words(outcome: &str) -> &str {
    OUTCOMES
        .iter()
        .find(|(name, _)| *name == outcome)
        .map_or(outcome, |(_, head)| head)
}

/// Class × outcome: the classes as configured, then whatever else was flown.
#[must_use]
pub fn classes(contents: &Contents) -> Vec<ClassView> {
    let fits = fits_by_maneuver(contents);
    let marks = gallery::marks(contents);
    let configured = contents
        .classes
        .iter()
        .map(|(name, title, axis)| (name.as_str(), title.as_str(), *axis));
    let known: BTreeSet<&str> = contents.classes.iter().map(|c| c.0.as_str()).collect();
    let others: BTreeMap<&str, Axis> = contents
        .maneuvers
        .iter()
        .map(|m| (m.class.as_str(), m.axis))
        .filter(|(c, _)| !known.contains(c))
        .collect();
    configured
        .chain(others.into_iter().map(|(name, axis)| (name, "", axis)))
        .map(|(name, title, axis)| ClassView {
            mark: marks
                .iter()
                .find(|m| m.0 == name)
                .map_or_else(String::new, |m| m.1.key()),
            token: gallery::token(&marks, name),
            ..class(name, title, axis, contents.maneuvers, &fits)
        })
        .collect()
}

fn class(
    name: &str,
    title: &str,
    axis: Axis,
    flown: &[Maneuver],
    fits: &BTreeMap<&str, &FitRow>,
) -> ClassView {
    let mut outcomes = vec![0; OUTCOMES.len() + 1];
    let of_class: Vec<&Maneuver> = flown.iter().filter(|m| m.class == name).collect();
    for maneuver in &of_class {
        let outcome = fits
            .get(maneuver.maneuver_id.as_str())
            .map(|f| f.outcome.as_str());
        let place = OUTCOMES
            .iter()
            .position(|(o, _)| Some(*o) == outcome)
            .unwrap_or(OUTCOMES.len());
        outcomes[place] += 1;
    }
    let alpha = match extent(of_class.iter().map(|m| m.alpha_deg)) {
        Some((low, high)) => format!(
            "{}\u{2013}{}°",
            notation::fixed(low, 0),
            notation::fixed(high, 0)
        ),
        None => NOTHING.to_owned(),
    };
    let (name, title) = (name.to_owned(), title.to_owned());
    let (mark, token) = (String::new(), String::new());
    ClassView {
        name,
        title,
        axis: axis.name().to_owned(),
        found: of_class.len(),
        outcomes,
        alpha,
        mark,
        token,
    }
}

/// The verdict tables, one per axis. `anchors` says where each derivative's figure is.
#[must_use]
pub fn verdicts(subjects: &[Subject], anchors: &BTreeMap<&str, String>) -> Vec<VerdictGroup> {
    let of_axis = |axis: Axis| -> Vec<&Subject> {
        subjects
            .iter()
            .filter(|s| s.axis == Some(axis) && s.is_compared())
            .collect()
    };
    [
        (Axis::Longitudinal, "Longitudinal"),
        (Axis::Lateral, "Lateral-directional"),
    ]
    .into_iter()
    .map(|(axis, title)| (title, of_axis(axis)))
    .filter(|(_, subjects)| !subjects.is_empty())
    .map(|(title, subjects)| verdict_group(title, &subjects, anchors))
    .collect()
}

fn verdict_group(
    title: &str,
    subjects: &[&Subject],
    anchors: &BTreeMap<&str, String>,
) -> VerdictGroup {
    let alphas = subjects
        .iter()
        .flat_map(|s| s.comparison.iter().map(|c| c.alpha_deg));
    let (from, to) = extent(alphas).unwrap_or((0.0, 1.0));
    VerdictGroup {
        title: title.to_owned(),
        alpha_from: angle(from),
        alpha_to: angle(to),
        rows: subjects
            .iter()
            .map(|s| verdict_view(s, anchors, from, to))
            .collect(),
    }
}

fn verdict_view(
    subject: &Subject,
    anchors: &BTreeMap<&str, String>,
    from: f64,
    to: f64,
) -> VerdictView {
    let runs = verdict::runs(&subject.comparison);
    VerdictView {
        name: subject.name.to_owned(),
        symbol: notation::symbol(subject.name),
        unit: notation::unit(subject.unit),
        anchor: anchors.get(subject.name).cloned().unwrap_or_default(),
        phrase: verdict::phrase(&runs),
        strip: verdict::strip(&runs, from, to, STRIP_WIDTH),
        difference: largest_difference(subject),
        maneuvers: subject.maneuvers(),
        bound: typical_bound(subject),
    }
}

/// The largest difference between flight and tunnel, as a share of the tunnel's value there.
fn largest_difference(subject: &Subject) -> String {
    let rows = subject
        .comparison
        .iter()
        .filter_map(|c| Some((c, c.difference.filter(|d| d.is_finite())?)));
    let Some((row, difference)) = rows.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) else {
        return NOTHING.to_owned();
    };
    let sign = if difference > 0.0 { "+" } else { "" };
    let share = match row.difference_pct.filter(|p| p.is_finite()) {
        Some(pct) if pct.abs() < 999.5 => {
            format!(
                " ({}{} %)",
                if pct > 0.0 { "+" } else { "" },
                notation::fixed(pct, 0)
            )
        }
        // Where the tunnel's value is next to zero its share says nothing.
        _ => String::new(),
    };
    format!(
        "{sign}{}{share} at {}",
        number(Some(difference), 2),
        angle(row.alpha_deg)
    )
}

/// The median bound, and what share it is of the median estimate.
fn typical_bound(subject: &Subject) -> String {
    let bounds: Vec<f64> = subject.points.iter().map(|p| p.bound).collect();
    let sizes: Vec<f64> = subject.points.iter().map(|p| p.value.abs()).collect();
    let (Some(bound), Some(size)) = (quantile(&bounds, 0.5), quantile(&sizes, 0.5)) else {
        return NOTHING.to_owned();
    };
    let share = 100.0 * bound / size;
    let share = if share < 999.5 {
        format!(" ({} %)", number(Some(share), 2))
    } else {
        String::new()
    };
    format!("±{}{share}", number(Some(bound), 2))
}

/// The summary in a few sentences: what there is, what failed, what disagrees.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    pub flown: Vec<String>,
    pub failed: Vec<String>,
    pub disagrees: Vec<String>,
}

/// The summary.
#[must_use]
pub fn summary(contents: &Contents, subjects: &[Subject], classes: &[ClassView]) -> Summary {
    let mut disagrees = compared(subjects);
    disagrees.extend(opposite_signs(subjects));
    disagrees.extend(largest(subjects));
    Summary {
        flown: vec![flown(contents, classes)],
        failed: failed(contents),
        disagrees,
    }
}

/// So many disagreements, and so many failures, are told in the summary.
const MOST_TOLD: usize = 5;

/// The row that disagrees most beside its uncertainty, with how much.
fn worst<'a>(subject: &Subject<'a>) -> Option<(f64, &'a ComparisonRow)> {
    let rows = subject.comparison.iter().filter(|c| c.verdict != "agrees");
    let sized = rows.filter_map(|c| Some((c.z.filter(|z| z.is_finite())?.abs(), *c)));
    sized.max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The disagreements that are largest beside their uncertainty, each at its worst angle of attack.
fn largest(subjects: &[Subject]) -> Option<String> {
    let compared = subjects.iter().filter(|s| s.is_compared());
    let mut all: Vec<_> = compared.filter_map(|s| Some((s, worst(s)?))).collect();
    all.sort_by(|a, b| b.1.0.total_cmp(&a.1.0).then_with(|| a.0.name.cmp(b.0.name)));
    let told: Vec<String> = all
        .iter()
        .take(MOST_TOLD)
        .map(|(s, (z, row))| {
            let share = row
                .difference_pct
                .filter(|p| p.is_finite() && p.abs() < 999.5);
            let share = share.map_or_else(String::new, |p| {
                format!(" by {} %", notation::fixed(p.abs(), 0))
            });
            format!(
                "{} {}{share} at {} (z {})",
                s.name,
                row.verdict,
                angle(row.alpha_deg),
                notation::fixed(*z, 0)
            )
        })
        .collect();
    (!told.is_empty()).then(|| format!("Largest beside their uncertainty: {}.", told.join("; ")))
}

fn flown(contents: &Contents, classes: &[ClassView]) -> String {
    if contents.maneuvers.is_empty() {
        return "No maneuver was found: nothing was estimated, and there is nothing to compare."
            .to_owned();
    }
    let flights: BTreeSet<&str> = contents
        .maneuvers
        .iter()
        .map(|m| m.flight_id.as_str())
        .collect();
    let total = |i: usize| {
        classes
            .iter()
            .filter_map(|c| c.outcomes.get(i))
            .sum::<usize>()
    };
    let of = |(i, head): (usize, &str)| (total(i) > 0).then(|| format!("{} {head}", total(i)));
    let outcomes: Vec<String> = outcome_heads()
        .into_iter()
        .enumerate()
        .filter_map(of)
        .collect();
    let maneuvers = count(contents.maneuvers.len(), "maneuver");
    format!(
        "{maneuvers} in {}: {}.",
        count(flights.len(), "flight"),
        outcomes.join(", ")
    )
}

fn compared(subjects: &[Subject]) -> Vec<String> {
    let mut agreement: Vec<f64> = Vec::new();
    let mut without = 0;
    for subject in subjects.iter().filter(|s| s.is_compared()) {
        let with_tunnel = subject
            .comparison
            .iter()
            .filter(|c| c.wind_tunnel.is_some())
            .count();
        let agreeing = subject
            .comparison
            .iter()
            .filter(|c| c.verdict == "agrees")
            .count();
        match with_tunnel {
            0 => without += 1,
            n => agreement.push(agreeing as f64 / n as f64),
        }
    }
    if agreement.is_empty() && without == 0 {
        return vec!["No derivative was compared with the wind tunnel.".to_owned()];
    }
    let everywhere = agreement.iter().filter(|share| **share >= 1.0).count();
    let mostly = agreement
        .iter()
        .filter(|share| (0.5..1.0).contains(*share))
        .count();
    let rest = agreement.len() - everywhere - mostly;
    let others = match without {
        0 => String::new(),
        n => format!("; {n} more have no tunnel value to be compared with"),
    };
    let compared = count(agreement.len(), "derivative");
    vec![format!(
        "{compared} compared with the wind tunnel: {everywhere} agree at every angle of attack, {mostly} at half of them \
         or more, {rest} at fewer{others}."
    )]
}

/// Where flight and tunnel differ in sign: what a reviewer must not miss.
fn opposite_signs(subjects: &[Subject]) -> Option<String> {
    let places: Vec<String> = subjects
        .iter()
        .filter_map(|subject| {
            let runs = verdict::runs(&subject.comparison);
            let ranges: Vec<String> = runs
                .iter()
                .filter(|r| r.verdict == "sign differs")
                .map(Run::range)
                .collect();
            (!ranges.is_empty()).then(|| format!("{} ({})", subject.name, ranges.join(", ")))
        })
        .collect();
    (!places.is_empty())
        .then(|| format!("Opposite sign in flight and tunnel: {}.", places.join(", ")))
}

/// What the fits, the checks of the records, the list of events and the problems say.
fn failed(contents: &Contents) -> Vec<String> {
    let mut lines = Vec::new();
    let of = |f: &&FitRow| format!("{} ({})", f.maneuver_id, outcome_in_words(&f.outcome));
    let unsound: Vec<String> = contents
        .fits
        .iter()
        .filter(|f| f.outcome != "converged")
        .map(|f| of(&f))
        .collect();
    if !unsound.is_empty() {
        let more = unsound.len().saturating_sub(MOST_TOLD);
        let more = if more > 0 {
            format!(" and {more} more")
        } else {
            String::new()
        };
        let told = unsound
            .get(..MOST_TOLD.min(unsound.len()))
            .unwrap_or_default()
            .join(", ");
        lines.push(format!(
            "{} without a sound fit: {told}{more}.",
            count(unsound.len(), "maneuver")
        ));
    }
    let failed = contents
        .checks
        .iter()
        .filter(|c| !super::failures::is_check_passed(&c.verdict))
        .count();
    if !contents.checks.is_empty() {
        let checks = count(contents.checks.len(), "check");
        lines.push(format!(
            "Records: {checks} of units and signs between channels, {failed} failed."
        ));
    }
    if !contents.events.is_empty() {
        let agreeing = contents
            .events
            .iter()
            .filter(|e| e.verdict == "agrees")
            .count();
        let events = count(contents.events.len(), "event");
        lines.push(format!(
            "The analyst's list against what was found: {events}, {agreeing} agree."
        ));
    }
    if !contents.problems.is_empty() {
        lines.push(format!(
            "{} in flights, channels or maneuvers: see what failed and why.",
            count(contents.problems.len(), "problem")
        ));
    } else if unsound.is_empty() {
        lines.push("Every flight was read and every maneuver fitted.".to_owned());
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    #[test]
    fn a_maneuver_without_a_fit_is_counted_as_such() {
        let mut campaign = samples::campaign();
        campaign.fits.pop();
        let views = classes(&campaign.contents());
        let total: usize = views.iter().map(|c| c.outcomes[OUTCOMES.len()]).sum();
        assert_eq!(total, 1);
        let all: usize = views.iter().flat_map(|c| &c.outcomes).sum();
        assert_eq!(all, campaign.maneuvers.len());
    }

    #[test]
    fn a_class_that_is_not_configured_is_listed_too() {
        let mut campaign = samples::campaign();
        campaign.classes.clear();
        assert!(!classes(&campaign.contents()).is_empty());
    }

    #[test]
    fn opposite_signs_are_said_first_hand() {
        let mut campaign = samples::campaign();
        campaign.comparison[0].verdict = "sign differs".into();
        let contents = campaign.contents();
        let lines = summary(
            &contents,
            &super::super::subject::gather(&contents),
            &classes(&contents),
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
