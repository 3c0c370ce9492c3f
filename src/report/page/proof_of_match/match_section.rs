//! Section of the proof of match: how many maneuvers each simulator reproduces within the tolerances.

use std::collections::BTreeMap;

use serde::Serialize;

use super::match_charts;
use crate::numerics::statistics::order_statistics::median;
use crate::proof_of_match::Matched;
use crate::report::contents::Contents;
use crate::report::notation::{DASH, angle, count, fixed, number};
use crate::report::page::classes::class_markers::ClassMarkers;
use crate::report::page::maneuvers::maneuver_page;
use crate::report::page::quality_charts::QualityChart;
use crate::report::table_view::TableView;
use crate::tables::{MatchRow, MatchVerdict, MatchVerdictRow, ModelSource};

/// Values of the section.
#[derive(Clone, Debug, Serialize)]
pub struct MatchSection {
    pub note: String,
    /// The board's answer in a paragraph.
    pub answer: String,
    pub charts: Vec<QualityChart>,
    pub tables: Vec<TableView>,
}

/// Makes the section; `None` without tolerances or maneuvers.
#[must_use]
pub fn section(contents: &Contents, markers: &ClassMarkers) -> Option<MatchSection> {
    let specification = contents.tolerances?;
    if contents.matched.is_empty() {
        return None;
    }
    let models = &specification.models;
    Some(MatchSection {
        note: format!(
            "{}. Each maneuver is flown again by a body with six degrees of freedom: initial state and \
             trim are matched over its first second at most, then it runs free to the end with the \
             recorded surfaces and thrust. Where feedback moved the surfaces, the recorded positions \
             include it, so the control law is not tested. {} % of the samples must be inside.",
            specification.standard,
            fixed(specification.inside_pct, 0)
        ),
        answer: answer(contents, models),
        charts: models
            .iter()
            .filter_map(|m| match_charts::chart(contents, *m))
            .collect(),
        tables: vec![
            class_table(contents, models),
            maneuver_table(contents, models, markers),
        ],
    })
}

/// Verdicts of the maneuvers that one model flew again.
fn flown_by<'a>(contents: &Contents<'a>, model: ModelSource) -> Vec<&'a MatchVerdictRow> {
    let all = contents.matched.iter().flat_map(|m| &m.verdicts);
    let is_flown =
        |row: &&MatchVerdictRow| row.model == model && row.verdict != MatchVerdict::NotFlown;
    all.filter(is_flown).collect()
}

/// Name of a model in the report.
fn words(model: ModelSource) -> &'static str {
    match model {
        ModelSource::Posterior => "the posterior",
        ModelSource::Trend => "the trends",
        ModelSource::Tunnel => "the wind tunnel",
        ModelSource::Database => "the given database",
    }
}

/// Answers of all models; the maneuvers flown closed-loop are the same for all.
fn answer(contents: &Contents, models: &[ModelSource]) -> String {
    let mut sentences: Vec<String> = models
        .iter()
        .map(|model| answer_of(contents, *model))
        .collect();
    let first = models.first().map(|model| flown_by(contents, *model));
    sentences.extend(first.and_then(|flown| closed_loop(&flown)));
    sentences.join(" ")
}

/// Number of maneuvers that a model reproduces now and if flown once more, and the farthest from it.
fn answer_of(contents: &Contents, model: ModelSource) -> String {
    let flown = flown_by(contents, model);
    let inside = flown
        .iter()
        .filter(|row| row.verdict == MatchVerdict::Inside);
    format!(
        "With the derivatives of {} a simulator matches {} of {} within every tolerance{}{}.",
        words(model),
        inside.count(),
        count(flown.len(), "maneuver"),
        repeats(&flown).unwrap_or_default(),
        farthest(&flown).unwrap_or_default(),
    )
}

/// The maneuver farthest outside; `None` where all are inside.
fn farthest(flown: &[&MatchVerdictRow]) -> Option<String> {
    let outside = flown
        .iter()
        .filter(|row| row.verdict == MatchVerdict::Outside);
    let worst = outside.min_by(|a, b| size(a.margin).total_cmp(&size(b.margin)))?;
    Some(format!(
        "; the farthest outside is {} ({} at {}, {}, margin {})",
        worst.maneuver_id,
        worst.class,
        angle(worst.alpha_deg),
        worst.decided_by,
        number(worst.margin, 2)
    ))
}

/// Expected number of repeat flights that match; `None` without probabilities.
fn repeats(flown: &[&MatchVerdictRow]) -> Option<String> {
    let probabilities = flown.iter().map(|row| Some(0.01 * row.repeat_pct?));
    let expected = probabilities.sum::<Option<f64>>()?;
    Some(format!(
        ", and is expected to match {} if all are flown once more",
        fixed(expected, 1)
    ))
}

/// Number of maneuvers flown closed-loop; `None` where there is none.
fn closed_loop(flown: &[&MatchVerdictRow]) -> Option<String> {
    let closed = flown.iter().filter(|row| row.closed_loop == Some(1));
    let verb = match closed.count() {
        0 => return None,
        1 => "1 was".to_owned(),
        closed => format!("{closed} were"),
    };
    Some(format!(
        "{verb} flown closed-loop and judged with the recorded surfaces."
    ))
}

/// Margin for comparison; a departure has the smallest.
fn size(margin: Option<f64>) -> f64 {
    margin.unwrap_or(f64::NEG_INFINITY)
}

/// Number of maneuvers inside by class and model.
fn class_table(contents: &Contents, models: &[ModelSource]) -> TableView {
    let heads: Vec<String> = models
        .iter()
        .flat_map(|m| {
            [
                format!("{}: inside", m.name()),
                format!("{}: median margin", m.name()),
            ]
        })
        .collect();
    let heads: Vec<&str> = ["class", "flown again", "closed loop"]
        .into_iter()
        .chain(heads.iter().map(String::as_str))
        .collect();
    let line = |class: &str| class_row(contents, models, class);
    let classes = contents.classes.iter().map(|c| c.name.as_str());
    let is_found = |class: &&str| contents.maneuvers.iter().any(|m| m.class == *class);
    TableView::new(
        "By class",
        "Margin: one less the largest difference over its tolerance; 0 is on the limit, negative outside.",
        &heads,
        classes.filter(is_found).map(line).collect(),
    )
}

/// Cells of a class: maneuvers flown again, those in closed loop, and of each model the number inside
/// with the median margin.
fn class_row(contents: &Contents, models: &[ModelSource], class: &str) -> Vec<String> {
    let rows_of = |model: &ModelSource| {
        let mut rows = flown_by(contents, *model);
        rows.retain(|row| row.class == class);
        rows
    };
    let first = models.first().map(rows_of).unwrap_or_default();
    let is_closed = |row: &&&MatchVerdictRow| row.closed_loop == Some(1);
    let mut cells = vec![
        class.to_owned(),
        first.len().to_string(),
        first.iter().filter(is_closed).count().to_string(),
    ];
    for rows in models.iter().map(rows_of) {
        let is_inside = |row: &&&MatchVerdictRow| row.verdict == MatchVerdict::Inside;
        let median = median(rows.iter().map(|row| size(row.margin)));
        cells.push(rows.iter().filter(is_inside).count().to_string());
        cells.push(number(median.filter(|m| m.is_finite()), 2));
    }
    cells
}

/// Margin of each maneuver by model, and the deciding tolerance of the first.
fn maneuver_table(
    contents: &Contents,
    models: &[ModelSource],
    markers: &ClassMarkers,
) -> TableView {
    let anchors = maneuver_page::anchors(contents);
    let margins: Vec<String> = models
        .iter()
        .map(|m| format!("margin, {}", m.name()))
        .collect();
    let heads: Vec<&str> = ["maneuver", "class", "α, deg"]
        .into_iter()
        .chain(margins.iter().map(String::as_str))
        .chain([
            "verdict",
            "decided by",
            "repeat, %",
            "inside, %",
            "largest excess",
            "loop",
        ])
        .collect();
    let decisive = decisive_rows(contents);
    let verdict_column = 3 + models.len();
    let mut rows = Vec::new();
    let (mut links, mut classes, mut flagged) = (Vec::new(), Vec::new(), Vec::new());
    for matched in worst_first(contents) {
        let Some(first) = matched.verdicts.first() else {
            continue;
        };
        let is_outside = first.verdict == MatchVerdict::Outside;
        flagged.push(is_outside.then_some(verdict_column).into_iter().collect());
        let id = first.maneuver_id.as_str();
        rows.push(maneuver_row(
            first,
            &matched.verdicts,
            decisive.get(id).copied(),
        ));
        links.push(anchors.get(id).cloned().unwrap_or_default());
        classes.push(markers.token(&first.class));
    }
    let mut table = TableView::new(
        "By maneuver",
        "The farthest outside first. Verdict, deciding tolerance, probability that a \
         repeat flight passes, share inside and largest excess are those of the first model. The page of a \
         maneuver draws it.",
        &heads,
        rows,
    );
    table.links = links;
    table.classes = classes;
    table.flagged = flagged;
    table
}

/// Maneuvers by the margin of their first model, ascending; those that were not flown again come last.
fn worst_first<'a>(contents: &Contents<'a>) -> Vec<&'a Matched> {
    let key = |matched: &&Matched| {
        let first = matched.verdicts.first();
        let flown = first.filter(|row| row.verdict != MatchVerdict::NotFlown);
        flown.map_or(f64::INFINITY, |row| size(row.margin))
    };
    let mut all: Vec<&Matched> = contents.matched.iter().collect();
    all.sort_by(|a, b| key(a).total_cmp(&key(b)));
    all
}

fn maneuver_row(
    first: &MatchVerdictRow,
    verdicts: &[MatchVerdictRow],
    decisive: Option<&MatchRow>,
) -> Vec<String> {
    let margins = verdicts.iter().map(|row| number(row.margin, 2));
    let verdict = if first.verdict == MatchVerdict::NotFlown {
        format!("not flown: {}", first.reason)
    } else {
        first.verdict.to_string()
    };
    let nothing = || DASH.to_owned();
    let excess = decisive.and_then(|row| {
        Some(format!(
            "{} {}",
            number(Some(row.largest_excess?), 2),
            row.unit
        ))
    });
    let loop_ = match first.closed_loop {
        Some(1) => "closed",
        Some(_) => "open",
        None => DASH,
    };
    [
        first.maneuver_id.clone(),
        first.class.clone(),
        fixed(first.alpha_deg, 1),
    ]
    .into_iter()
    .chain(margins)
    .chain([
        verdict,
        first.decided_by.clone(),
        first.repeat_pct.map_or_else(nothing, |pct| fixed(pct, 0)),
        decisive.map_or_else(nothing, |row| fixed(row.inside_pct, 1)),
        excess.unwrap_or_else(nothing),
        loop_.to_owned(),
    ])
    .collect()
}

/// Row that decides each maneuver's verdict, of the first model.
fn decisive_rows<'a>(contents: &Contents<'a>) -> BTreeMap<&'a str, &'a MatchRow> {
    let decisive = |matched: &'a Matched| {
        let verdict = matched.verdicts.first()?;
        let mut rows = matched.rows.iter().filter(|row| row.model == verdict.model);
        let row =
            rows.find(|row| format!("{} {}", row.test, row.quantity.name()) == verdict.decided_by);
        Some((verdict.maneuver_id.as_str(), row?))
    };
    contents.matched.iter().filter_map(decisive).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture::campaign;

    #[test]
    fn the_answer_counts_the_maneuvers_inside_and_names_the_farthest() {
        let campaign = campaign();
        let contents = campaign.contents();
        let markers = ClassMarkers::new(&contents);
        let section = section(&contents, &markers).expect("a section");
        assert_eq!(
            section.answer,
            "With the derivatives of the posterior a simulator matches 2 of 3 maneuvers within every tolerance, \
             and is expected to match 1.6 if all are flown once more; the farthest outside is 1-OLON-30 (OLON at \
             30°, 2.c.10 an_g, margin \u{2212}0.50). With the derivatives of the wind tunnel a simulator matches 2 \
             of 3 maneuvers within every tolerance, and is expected to match 1.6 if all are flown once more; the \
             farthest outside is 1-OLON-30 (OLON at 30°, 2.c.10 an_g, margin \u{2212}0.60). 1 was flown \
             closed-loop and judged with the recorded surfaces."
        );
        assert_eq!(section.charts.len(), 2);
        assert_eq!(section.charts[0].svg.matches("inside").count(), 2);
        let table = &section.tables[1];
        let rows = &table.rows;
        assert_eq!(rows.len(), 4);
        let outside = ["1-OLON-30", "OLON", "30.0", "\u{2212}0.50", "\u{2212}0.60"];
        assert_eq!(rows[0][..5], outside, "the worst first");
        assert_eq!(table.flagged, [vec![5], vec![], vec![], vec![]]);
        assert_eq!(rows[0][5], "outside");
        assert_eq!(rows[2][..5], ["1-OLON-10", "OLON", "10.0", "0.40", "0.30"]);
        assert!(rows[3][5].starts_with("not flown: no"), "{:?}", rows[3]);
    }

    #[test]
    fn without_tolerances_there_is_no_section() {
        let mut campaign = campaign();
        campaign.tolerances = None;
        let contents = campaign.contents();
        assert!(section(&contents, &ClassMarkers::new(&contents)).is_none());
    }
}
