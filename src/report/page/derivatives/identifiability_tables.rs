//! Tables of near dependencies, class by class: correlated regressors (the paper's Figures 3, 10
//! and 11), correlated estimates, inflated variances, Belsley's groups, derivatives held by
//! evidence.

use std::collections::{BTreeMap, BTreeSet};

use crate::maneuver::Status;
use crate::numerics::statistics::order_statistics::median;
use crate::report::contents::Contents;
use crate::report::figure::scale::extent;
use crate::report::notation::{DASH, fixed};
use crate::report::table_view::TableView;
use crate::tables::CorrelationKind;

/// Number of rows of a class in a table; the published tables have all.
const MOST_ROWS: usize = 8;

/// Values of one class's maneuvers, by position of the class and item of the row.
type ClassRows = BTreeMap<(usize, String), Vec<f64>>;

/// The tables, without empty ones.
#[must_use]
pub fn tables(contents: &Contents) -> Vec<TableView> {
    let tables = [
        correlated_regressors(contents),
        correlated_estimates(contents),
        inflated_variances(contents),
        near_dependencies(contents),
        held_by_evidence(contents),
    ];
    tables.into_iter().filter(|t| !t.rows.is_empty()).collect()
}

const PAIR_HEADS: [&str; 4] = ["class", "pair", "maneuvers", "correlation"];

fn correlated_regressors(contents: &Contents) -> TableView {
    let rows = correlated_pairs(contents, CorrelationKind::Regressors, |_| true);
    let note = format!(
        "Histories over the maneuver, |ρ| above {}; at most {MOST_ROWS} pairs of a class.",
        fixed(contents.limits.correlation, 2)
    );
    TableView::new(
        "Correlated regressors",
        &note,
        &PAIR_HEADS,
        rows_by_class(contents, rows, range),
    )
}

fn correlated_estimates(contents: &Contents) -> TableView {
    let with_regressor = derivatives_with_regressor(contents);
    let rows = correlated_pairs(contents, CorrelationKind::Estimates, |name| {
        with_regressor.contains(name)
    });
    let note = format!(
        "From the inverse of the information matrix, |ρ| above {}; at most {MOST_ROWS} pairs of a \
         class. Constants, biases and initial states are correlated by nature: only the table of \
         correlations has them.",
        fixed(contents.limits.correlation, 2)
    );
    TableView::new(
        "Correlated estimates",
        &note,
        &PAIR_HEADS,
        rows_by_class(contents, rows, range),
    )
}

/// Correlations beyond the limit of one kind, between names that are shown.
fn correlated_pairs(
    contents: &Contents,
    kind: CorrelationKind,
    is_shown: impl Fn(&str) -> bool,
) -> ClassRows {
    let limit = contents.limits.correlation;
    let mut rows = ClassRows::new();
    for row in contents.correlations {
        let is_flagged = row.kind == kind && row.correlation.abs() > limit;
        if is_flagged && is_shown(&row.first) && is_shown(&row.second) {
            let pair = format!("{}, {}", row.first, row.second);
            rows.entry((class_position(contents, &row.class), pair))
                .or_default()
                .push(row.correlation);
        }
    }
    rows
}

fn inflated_variances(contents: &Contents) -> TableView {
    let limit = contents.limits.variance_inflation;
    let with_regressor = derivatives_with_regressor(contents);
    let mut rows = ClassRows::new();
    let estimated = contents
        .estimates
        .iter()
        .filter(|r| r.status == Status::Estimated);
    for row in estimated.filter(|r| with_regressor.contains(r.derivative.as_str())) {
        if let Some(inflation) = row.variance_inflation.filter(|v| *v > limit) {
            rows.entry((class_position(contents, &row.class), row.derivative.clone()))
                .or_default()
                .push(inflation);
        }
    }
    let heads = ["class", "estimate", "maneuvers", "median inflation"];
    let note = format!(
        "Factor by which the other parameters raise the variance, above {}; at most {MOST_ROWS} of \
         a class, without constants and biases.",
        fixed(limit, 0)
    );
    TableView::new(
        "Inflated variances",
        &note,
        &heads,
        rows_by_class(contents, rows, median_in_words),
    )
}

fn near_dependencies(contents: &Contents) -> TableView {
    let mut rows = ClassRows::new();
    for fit in contents.fits {
        for group in fit.confounded.iter().flat_map(|c| c.split("; ")) {
            let index = fit.largest_condition_index.unwrap_or(f64::INFINITY);
            rows.entry((class_position(contents, &fit.class), group.to_owned()))
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
        "Condition index of {} or more with shares of {} or more in the variance of two or more \
         parameters (Belsley); at most {MOST_ROWS} of a class. Constants, biases and initial \
         states are dependent by nature; a group of control derivatives calls for other inputs.",
        fixed(contents.limits.condition_index, 0),
        fixed(contents.limits.variance_proportion, 1),
    );
    TableView::new(
        "Near dependencies",
        &note,
        &heads,
        rows_by_class(contents, rows, median_in_words),
    )
}

/// Derivatives held at the tunnel's value because the maneuver does not determine them.
fn held_by_evidence(contents: &Contents) -> TableView {
    let mut held: BTreeMap<(usize, &str), (usize, &str)> = BTreeMap::new();
    for row in contents.estimates {
        if let Some(reason) = row.evidence_to_hold() {
            held.entry((class_position(contents, &row.class), &row.derivative))
                .or_insert((0, reason))
                .0 += 1;
        }
    }
    let rows = held
        .into_iter()
        .map(|((class, derivative), (maneuvers, reason))| {
            vec![
                class_name(contents, class),
                derivative.to_owned(),
                maneuvers.to_string(),
                reason.to_owned(),
            ]
        })
        .collect();
    let heads = [
        "class",
        "derivative",
        "maneuvers",
        "reason, in the first of them",
    ];
    TableView::new(
        "Held at the wind tunnel's value by evidence",
        HELD_NOTE,
        &heads,
        rows,
    )
}

const HELD_NOTE: &str = "By the evidence of each maneuver, not by the class's table. Bounds and \
    uncertainties in the derivative's unit. The bounds of the remaining estimates ignore that the \
    same data selected what is held: their intervals cover the truth less often than with \
    derivatives held by the table.";

/// Derivatives whose regressor moves; constants and biases have none.
fn derivatives_with_regressor<'a>(contents: &Contents<'a>) -> BTreeSet<&'a str> {
    contents
        .estimates
        .iter()
        .filter(|r| r.excitation.is_some())
        .map(|r| r.derivative.as_str())
        .collect()
}

/// Cells of each class's rows in the configured order, items of most maneuvers first.
fn rows_by_class(
    contents: &Contents,
    rows: ClassRows,
    summary: fn(&[f64]) -> String,
) -> Vec<Vec<String>> {
    let mut by_class: BTreeMap<usize, Vec<(String, Vec<f64>)>> = BTreeMap::new();
    for ((class, item), values) in rows {
        by_class.entry(class).or_default().push((item, values));
    }
    let mut cells = Vec::new();
    for (class, mut items) in by_class {
        items.sort_by(|a, b| b.1.len().cmp(&a.1.len()).then_with(|| a.0.cmp(&b.0)));
        for (item, values) in items.into_iter().take(MOST_ROWS) {
            cells.push(vec![
                class_name(contents, class),
                item,
                values.len().to_string(),
                summary(&values),
            ]);
        }
    }
    cells
}

fn median_in_words(values: &[f64]) -> String {
    median(values.iter().copied()).map_or_else(|| DASH.to_owned(), |v| fixed(v, 0))
}

/// Smallest to largest value: the sign of a correlation may differ between maneuvers.
fn range(values: &[f64]) -> String {
    match extent(values.iter().copied()).map(|(low, high)| (fixed(low, 2), fixed(high, 2))) {
        None => DASH.to_owned(),
        Some((low, high)) if low == high => low,
        Some((low, high)) => format!("{low} to {high}"),
    }
}

/// Position of a class in the configured order; a class that is not configured comes last.
fn class_position(contents: &Contents, class: &str) -> usize {
    contents
        .classes
        .iter()
        .position(|c| c.name == class)
        .unwrap_or(contents.classes.len())
}

fn class_name(contents: &Contents, position: usize) -> String {
    contents
        .classes
        .get(position)
        .map_or_else(|| DASH.to_owned(), |c| c.name.clone())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture::{Campaign, campaign};
    use crate::tables::CorrelationRow;

    fn correlated(campaign: &mut Campaign, class: &str, kind: CorrelationKind, correlation: f64) {
        let text = str::to_owned;
        let (first, second) = (text("de_deg"), text("dpv_deg"));
        let (maneuver_id, class) = (text("1"), text(class));
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
    fn pairs_beyond_the_limit_are_counted_by_class() {
        let mut campaign = campaign();
        for correlation in [-0.97, -0.93, -0.5] {
            correlated(
                &mut campaign,
                "3211",
                CorrelationKind::Regressors,
                correlation,
            );
        }
        correlated(&mut campaign, "OLON", CorrelationKind::Estimates, 0.5);
        let tables = tables(&campaign.contents());
        let table = tables
            .iter()
            .find(|t| t.title.starts_with("Correlated regressors"))
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
            !tables
                .iter()
                .any(|t| t.title.starts_with("Correlated estimates")),
            "0.5 is below the limit"
        );
    }

    #[test]
    fn near_dependencies_and_derivatives_held_by_evidence_are_listed() {
        let mut campaign = campaign();
        campaign.fits[0].confounded = Some("CN_0, CN_alpha; Cm_de, Cm_dpv".into());
        campaign.estimates[2].status = Status::Held;
        campaign.estimates[2].held_because = Some("de_deg did not move".into());
        campaign.estimates[3].status = Status::Inactive;
        campaign.estimates[3].held_because = Some("its surface rests".into());
        let tables = tables(&campaign.contents());
        let rows = |start: &str| {
            &tables
                .iter()
                .find(|t| t.title.starts_with(start))
                .expect("a table")
                .rows
        };
        assert_eq!(rows("Near").len(), 2);
        assert_eq!(
            rows("Near")[1][..3],
            ["OLON", "Cm_de, Cm_dpv", "1"].map(str::to_owned)
        );
        assert_eq!(
            rows("Held"),
            &[["OLON", "Cm_de", "1", "de_deg did not move"].map(str::to_owned)]
        );
    }
}
