//! What the data tell apart and what they do not, class by class: regressors that move together
//! (the paper's Figures 3, 10 and 11), estimates that correlate, groups of near dependencies, and
//! what the maneuvers' own evidence holds.

use std::collections::{BTreeMap, BTreeSet};

use super::Contents;
use super::failures::TableView;
use super::notation::{NOTHING, fixed};
use super::scale::{extent, quantile};

/// So many lines of a kind are printed for a class; the tables have all.
const MOST_LINES: usize = 8;

/// Lines of one class, by what they are about: a number of each maneuver that has one.
type Lines<'a> = BTreeMap<(usize, String), Vec<f64>>;

/// The tables of what was not told apart; those without rows are left out.
#[must_use]
pub fn tables(contents: &Contents) -> Vec<TableView> {
    let tables = [
        pairs(contents, "regressors", "Regressors that move together"),
        pairs(contents, "estimates", "Estimates that correlate"),
        inflated(contents),
        groups(contents),
        held(contents),
    ];
    tables.into_iter().filter(|t| !t.rows.is_empty()).collect()
}

/// Pairs beyond the flag in some maneuver of a class, those of most maneuvers first.
fn pairs(contents: &Contents, kind: &str, title: &str) -> TableView {
    let limit = contents.limits.correlation;
    let moved = moved(contents);
    let is_shown = |name: &String| kind == "regressors" || moved.contains(name.as_str());
    let mut lines = Lines::new();
    let flagged = contents
        .correlations
        .iter()
        .filter(|r| r.kind == kind && r.correlation.abs() > limit);
    for row in flagged.filter(|r| is_shown(&r.first) && is_shown(&r.second)) {
        let about = format!("{}, {}", row.first, row.second);
        lines
            .entry((class_at(contents, &row.class), about))
            .or_default()
            .push(row.correlation);
    }
    let heads = ["class", "pair", "maneuvers", "correlation"];
    let note = match kind {
        "regressors" => "Histories over the maneuver, |ρ| above",
        _ => {
            "From the inverse of the information matrix; constants, biases and initial states, which belong together by \
             nature, are in the table of correlations only; |ρ| above"
        }
    };
    let note = format!(
        "{note} {}; at most {MOST_LINES} pairs of a class.",
        fixed(limit, 2)
    );
    TableView::new(title, &note, &heads, rows(contents, lines, range))
}

fn inflated(contents: &Contents) -> TableView {
    let limit = contents.limits.variance_inflation;
    let moved = moved(contents);
    let mut lines = Lines::new();
    let estimated = contents
        .estimates
        .iter()
        .filter(|r| r.status == "estimated");
    for row in estimated.filter(|r| moved.contains(r.derivative.as_str())) {
        if let Some(inflation) = row.variance_inflation.filter(|v| *v > limit) {
            lines
                .entry((class_at(contents, &row.class), row.derivative.clone()))
                .or_default()
                .push(inflation);
        }
    }
    let heads = ["class", "estimate", "maneuvers", "median inflation"];
    let note = format!(
        "Factor by which the other parameters raise the variance, above {}; without constants and biases; at most \
         {MOST_LINES} of a class.",
        fixed(limit, 0)
    );
    TableView::new(
        "Estimates whose variance is inflated",
        &note,
        &heads,
        rows(contents, lines, median),
    )
}

fn groups(contents: &Contents) -> TableView {
    let mut lines = Lines::new();
    for fit in contents.fits {
        for group in fit.confounded.iter().flat_map(|c| c.split("; ")) {
            let index = fit.largest_condition_index.unwrap_or(f64::INFINITY);
            lines
                .entry((class_at(contents, &fit.class), group.to_owned()))
                .or_default()
                .push(index);
        }
    }
    let heads = [
        "class",
        "group",
        "maneuvers",
        "median of the fits' largest index",
    ];
    let note = format!(
        "Condition index of {} or more with shares of {} or more in the variance of two or more parameters (Belsley); at \
         most {MOST_LINES} of a class. Constants, biases and initial states belong together by nature; a group of control \
         derivatives wants other inputs.",
        fixed(contents.limits.condition_index, 0),
        fixed(contents.limits.variance_proportion, 1),
    );
    TableView::new(
        "Groups that the data hardly tell apart",
        &note,
        &heads,
        rows(contents, lines, median),
    )
}

fn held(contents: &Contents) -> TableView {
    let mut reasons: BTreeMap<(usize, &str), (usize, &str)> = BTreeMap::new();
    for row in contents.estimates {
        if let Some(because) = &row.held_because {
            reasons
                .entry((class_at(contents, &row.class), &row.derivative))
                .or_insert((0, because))
                .0 += 1;
        }
    }
    let row = |((class, derivative), (count, because)): ((usize, &str), (usize, &str))| {
        vec![
            class_name(contents, class),
            derivative.to_owned(),
            count.to_string(),
            because.to_owned(),
        ]
    };
    let heads = [
        "class",
        "derivative",
        "maneuvers",
        "why, in the first of them",
    ];
    let note = "By the evidence of each maneuver, not by a table. Bounds and uncertainties in the derivative's unit.";
    TableView::new(
        "Held at the wind tunnel's value",
        note,
        &heads,
        reasons.into_iter().map(row).collect(),
    )
}

/// The derivatives with a regressor that moves: constants and biases have none.
fn moved<'a>(contents: &Contents<'a>) -> BTreeSet<&'a str> {
    contents
        .estimates
        .iter()
        .filter(|r| r.excitation.is_some())
        .map(|r| r.derivative.as_str())
        .collect()
}

/// The lines of each class in the configured order, those of most maneuvers first.
fn rows(contents: &Contents, lines: Lines, number: fn(&[f64]) -> String) -> Vec<Vec<String>> {
    let mut of_class: BTreeMap<usize, Vec<(String, Vec<f64>)>> = BTreeMap::new();
    for ((class, about), values) in lines {
        of_class.entry(class).or_default().push((about, values));
    }
    let mut rows = Vec::new();
    for (class, mut lines) in of_class {
        lines.sort_by(|a, b| b.1.len().cmp(&a.1.len()).then_with(|| a.0.cmp(&b.0)));
        for (about, values) in lines.into_iter().take(MOST_LINES) {
            rows.push(vec![
                class_name(contents, class),
                about,
                values.len().to_string(),
                number(&values),
            ]);
        }
    }
    rows
}

fn median(values: &[f64]) -> String {
    quantile(values, 0.5).map_or_else(|| NOTHING.to_owned(), |v| fixed(v, 0))
}

/// From the lowest to the highest: a pair may move together in one maneuver and against each other
/// in the next.
fn range(values: &[f64]) -> String {
    match extent(values.iter().copied()).map(|(low, high)| (fixed(low, 2), fixed(high, 2))) {
        None => NOTHING.to_owned(),
        Some((low, high)) if low == high => low,
        Some((low, high)) => format!("{low} to {high}"),
    }
}

/// A class's place in the configured order; one that is not configured comes last.
fn class_at(contents: &Contents, class: &str) -> usize {
    contents
        .classes
        .iter()
        .position(|(name, ..)| name == class)
        .unwrap_or(contents.classes.len())
}

fn class_name(contents: &Contents, at: usize) -> String {
    contents
        .classes
        .get(at)
        .map_or_else(|| NOTHING.to_owned(), |(name, ..)| name.clone())
}

#[cfg(test)]
mod tests {
    use super::super::samples::{Campaign, campaign};
    use super::*;
    use crate::tables::CorrelationRow;

    fn correlated(campaign: &mut Campaign, class: &str, kind: &str, correlation: f64) {
        let text = str::to_owned;
        let (first, second) = (text("de_deg"), text("dpv_deg"));
        let (maneuver_id, class, kind) = (text("1"), text(class), text(kind));
        campaign.correlations.push(CorrelationRow {
            maneuver_id,
            class,
            kind,
            first,
            second,
            correlation,
        });
    }

    #[test]
    fn pairs_beyond_the_flag_are_counted_by_class() {
        let mut campaign = campaign();
        for correlation in [-0.97, -0.93, -0.5] {
            correlated(&mut campaign, "3211", "regressors", correlation);
        }
        correlated(&mut campaign, "OLON", "estimates", 0.5);
        let tables = tables(&campaign.contents());
        let table = tables
            .iter()
            .find(|t| t.title.starts_with("Regressors"))
            .expect("a table");
        assert_eq!(
            table.rows,
            [[
                "3211",
                "de_deg, dpv_deg",
                "2",
                "\u{2212}0.97 to \u{2212}0.93"
            ]
            .map(str::to_owned)]
        );
        assert!(
            !tables.iter().any(|t| t.title.starts_with("Estimates that")),
            "0.5 is no flag"
        );
    }

    #[test]
    fn groups_and_what_evidence_holds_are_listed_with_the_reason() {
        let mut campaign = campaign();
        campaign.fits[0].confounded = Some("CN_0, CN_alpha; Cm_de, Cm_dpv".into());
        campaign.estimates[2].status = "held".into();
        campaign.estimates[2].held_because = Some("de_deg did not move".into());
        let tables = tables(&campaign.contents());
        let rows = |start: &str| {
            &tables
                .iter()
                .find(|t| t.title.starts_with(start))
                .expect("a table")
                .rows
        };
        assert_eq!(rows("Groups").len(), 2);
        assert_eq!(
            rows("Groups")[1][..3],
            ["OLON", "Cm_de, Cm_dpv", "1"].map(str::to_owned)
        );
        assert_eq!(
            rows("Held"),
            &[["OLON", "Cm_de", "1", "de_deg did not move"].map(str::to_owned)]
        );
    }
}
