//! Changes since the previously published night, with their causes.

use crate::lineage::{
    Changes, Contradiction, InformationGain, InstrumentChange, ManeuverDifference, Moved,
};
use crate::report::notation::{angle, number};
use crate::report::table_view::TableView;

/// Number of causes that the headline names.
const MOST_CAUSES: usize = 3;

const MOVED_NOTE: &str = "Moved: by more than the larger of the two nights' uncertainties.";

const LEARNT_NOTE: &str = "Learnt: divergence of the posterior over all angles of attack from the \
                           earlier night's. The values are at the angle where it moved most.";

/// The changes and their causes in a sentence.
pub fn headline(changes: &Changes) -> String {
    let Some(since) = &changes.since else {
        return first_night(changes);
    };
    if let Some(why) = &changes.not_compared {
        return format!("Night {since} cannot be compared with this one: {why}.");
    }
    if changes.is_empty() {
        return format!(
            "Nothing that was published in night {since} has moved by more than its uncertainty."
        );
    }
    format!(
        "Since night {since}: {}.{}",
        counts(changes).join(", "),
        causes(changes)
    )
}

/// Headline of a night without a predecessor.
fn first_night(changes: &Changes) -> String {
    let nothing_before =
        "No complete night was published here before: there is nothing to compare this one with.";
    if changes.is_empty() {
        return nothing_before.to_owned();
    }
    let over_flights = counts(changes).join(", ");
    format!("{nothing_before} Over its own flights: {over_flights}.")
}

/// Number of changes of each kind that occurs.
fn counts(changes: &Changes) -> Vec<String> {
    let maneuvers = |kind| changes.maneuvers.iter().filter(|m| m.what == kind).count();
    [
        (maneuvers(ManeuverDifference::New), "new maneuvers"),
        (maneuvers(ManeuverDifference::Gone), "maneuvers gone"),
        (maneuvers(ManeuverDifference::Changed), "maneuvers changed"),
        (changes.estimates.len(), "estimates moved"),
        (changes.trends.len(), "trend values moved"),
        (changes.new_trends.len(), "new trends"),
        (changes.gone_trends.len(), "trends gone"),
        (changes.verdicts.len(), "verdicts changed"),
        (changes.contradictions.len(), "contradictions"),
        (changes.instruments.len(), "instruments changed"),
    ]
    .iter()
    .filter(|(n, _)| *n > 0)
    .map(|(n, kind)| format!("{n} {kind}"))
    .collect()
}

/// A sentence with the first causes; empty without any.
fn causes(changes: &Changes) -> String {
    let mut causes: Vec<&str> = changes
        .causes
        .iter()
        .map(|c| c.words.as_str())
        .take(MOST_CAUSES)
        .collect();
    if changes.causes.len() > MOST_CAUSES {
        causes.push("and more");
    }
    if causes.is_empty() {
        String::new()
    } else {
        format!(" Causes: {}.", causes.join(", "))
    }
}

/// Tables of the changes, without empty ones.
pub fn tables(changes: &Changes) -> Vec<TableView> {
    let tables = [
        input_changes(changes),
        verdicts(changes),
        contradictions(changes),
        instruments(changes),
        learnt(changes),
        moved("Trends that moved", "group", &changes.trends),
        trend_names(changes),
        maneuvers(changes),
        moved("Estimates that moved", "maneuver", &changes.estimates),
    ];
    tables.into_iter().filter(|t| !t.rows.is_empty()).collect()
}

fn input_changes(changes: &Changes) -> TableView {
    let rows = changes
        .causes
        .iter()
        .map(|c| vec![c.stage.name().to_owned(), c.words.clone()])
        .collect();
    TableView::new("Changed inputs", "", &["first stage", "cause"], rows)
}

fn verdicts(changes: &Changes) -> TableView {
    let rows = changes
        .verdicts
        .iter()
        .map(|v| {
            vec![
                v.derivative.clone(),
                angle(v.alpha_deg),
                v.before.to_string(),
                v.now.to_string(),
                v.because.clone(),
            ]
        })
        .collect();
    let heads = ["derivative", "α", "before", "now", "because"];
    TableView::new("Verdicts", "", &heads, rows)
}

fn contradictions(changes: &Changes) -> TableView {
    let row = |c: &Contradiction| {
        let inside = format!("{:.0} %", c.inside_95_pct);
        vec![
            c.item.clone(),
            c.coefficient.clone(),
            c.estimates.to_string(),
            inside,
        ]
    };
    let rows = changes.contradictions.iter().map(row).collect();
    let heads = ["flight or class", "coefficient", "estimates", "inside 95 %"];
    TableView::new("Contradicted by the rest of the campaign", "", &heads, rows)
}

fn instruments(changes: &Changes) -> TableView {
    let row = |i: &InstrumentChange| {
        vec![
            i.channel.clone(),
            i.error.to_string(),
            i.what.to_string(),
            i.since.clone(),
            number(Some(i.change), 3),
            number(Some(i.bound), 2),
            i.unit.clone(),
        ]
    };
    let rows = changes.instruments.iter().map(row).collect();
    let heads = ["channel", "error", "", "since", "change", "bound", "unit"];
    TableView::new("Instruments that changed", "", &heads, rows)
}

fn learnt(changes: &Changes) -> TableView {
    let row = |l: &InformationGain| {
        let value = |v, deviation| {
            let [v, deviation] = [v, deviation].map(|x| number(Some(x), 3));
            format!("{v} ± {deviation}")
        };
        vec![
            l.derivative.clone(),
            format!("{:.1}", l.nats),
            angle(l.alpha_deg),
            value(l.before, l.before_deviation),
            value(l.now, l.now_deviation),
        ]
    };
    let rows = changes.learnt.iter().map(row).collect();
    let heads = ["derivative", "nats", "α", "before", "now"];
    TableView::new("Learnt", LEARNT_NOTE, &heads, rows)
}

fn trend_names(changes: &Changes) -> TableView {
    let new = changes.new_trends.iter().map(|name| ("new", name));
    let gone = changes.gone_trends.iter().map(|name| ("gone", name));
    let rows = new
        .chain(gone)
        .map(|(kind, name)| vec![kind.to_owned(), name.clone()])
        .collect();
    TableView::new("Trends new and gone", "", &["", "derivative, group"], rows)
}

fn maneuvers(changes: &Changes) -> TableView {
    let rows = changes
        .maneuvers
        .iter()
        .map(|m| {
            vec![
                m.what.to_string(),
                m.maneuver_id.clone(),
                m.class.clone(),
                m.words.clone(),
                m.because.clone(),
            ]
        })
        .collect();
    let heads = ["", "maneuver", "class", "", "because"];
    TableView::new("Maneuvers", "", &heads, rows)
}

fn moved(title: &str, owner: &str, rows: &[Moved]) -> TableView {
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
        owner,
        "α",
        "before",
        "now",
        "uncertainty",
        "because",
    ];
    TableView::new(title, MOVED_NOTE, &heads, rows.iter().map(row).collect())
}
