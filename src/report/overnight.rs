//! The morning page's first questions, as tables: what changed since the night before and why.

use super::Contents;
use super::failures::TableView;
use super::notation::{angle, number};
use crate::lineage::Moved;

/// So many causes are named in the headline.
const CAUSES: usize = 3;

/// What changed, in a sentence, and because of what.
pub fn headline(contents: &Contents) -> String {
    let changes = contents.overnight;
    let Some(since) = &changes.since else {
        return "No complete night was published here before: there is nothing to hold this one against.".to_owned();
    };
    if changes.is_empty() {
        return format!(
            "Nothing that was published in night {since} has moved by more than its uncertainty."
        );
    }
    let of = |what: &str| changes.maneuvers.iter().filter(|m| m.what == what).count();
    let counts = [
        (of("new"), "new maneuvers"),
        (of("gone"), "maneuvers gone"),
        (of("changed"), "maneuvers changed"),
        (changes.estimates.len(), "estimates moved"),
        (changes.trends.len(), "trend values moved"),
        (changes.new_trends.len(), "new trends"),
        (changes.gone_trends.len(), "trends gone"),
        (changes.verdicts.len(), "verdicts changed"),
    ];
    let counts: Vec<String> = counts
        .iter()
        .filter(|c| c.0 > 0)
        .map(|(n, what)| format!("{n} {what}"))
        .collect();
    let mut causes: Vec<&str> = changes
        .causes
        .iter()
        .map(|c| c.words.as_str())
        .take(CAUSES)
        .collect();
    if changes.causes.len() > CAUSES {
        causes.push("and more");
    }
    let because = if causes.is_empty() {
        String::new()
    } else {
        format!(" Because: {}.", causes.join(", "))
    };
    format!("Since night {since}: {}.{because}", counts.join(", "))
}

/// What changed, in tables; those without rows are left out.
pub fn tables(contents: &Contents) -> Vec<TableView> {
    let changes = contents.overnight;
    let causes = changes
        .causes
        .iter()
        .map(|c| vec![c.stage.name().to_owned(), c.words.clone()])
        .collect();
    let maneuvers = changes.maneuvers.iter().map(|m| {
        vec![
            m.what.clone(),
            m.maneuver_id.clone(),
            m.class.clone(),
            m.words.clone(),
            m.because.clone(),
        ]
    });
    let verdicts = changes.verdicts.iter().map(|v| {
        vec![
            v.derivative.clone(),
            angle(v.alpha_deg),
            v.before.clone(),
            v.now.clone(),
            v.because.clone(),
        ]
    });
    let trends = |names: &[String], what: &str| -> Vec<Vec<String>> {
        names
            .iter()
            .map(|name| vec![what.to_owned(), name.clone()])
            .collect()
    };
    let trend_names = [
        trends(&changes.new_trends, "new"),
        trends(&changes.gone_trends, "gone"),
    ]
    .concat();
    let note = "Moved: by more than the larger of the two nights' uncertainties.";
    let tables = [
        TableView::new(
            "What went in differently",
            "",
            &["first stage", "cause"],
            causes,
        ),
        TableView::new(
            "Verdicts",
            "",
            &["derivative", "α", "before", "now", "because"],
            verdicts.collect(),
        ),
        moved("Trends that moved", note, "group", &changes.trends),
        TableView::new(
            "Trends new and gone",
            "",
            &["", "derivative, group"],
            trend_names,
        ),
        TableView::new(
            "Maneuvers",
            "",
            &["", "maneuver", "class", "", "because"],
            maneuvers.collect(),
        ),
        moved("Estimates that moved", note, "maneuver", &changes.estimates),
    ];
    tables.into_iter().filter(|t| !t.rows.is_empty()).collect()
}

fn moved(title: &str, note: &str, of: &str, rows: &[Moved]) -> TableView {
    let row = |m: &Moved| {
        let numbers = [m.before, m.now, m.uncertainty].map(|v| number(Some(v), 4));
        [
            vec![m.derivative.clone(), m.of.clone(), angle(m.alpha_deg)],
            numbers.to_vec(),
            vec![m.because.clone()],
        ]
        .concat()
    };
    let heads = [
        "derivative",
        of,
        "α",
        "before",
        "now",
        "uncertainty",
        "because",
    ];
    TableView::new(title, note, &heads, rows.iter().map(row).collect())
}
