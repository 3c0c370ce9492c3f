//! What failed and why, as tables: problems, fits, events, checks between channels, channels that
//! were repaired.

use std::collections::BTreeMap;

use serde::Serialize;

use super::Contents;
use super::notation::{NOTHING, angle, fixed, number};
use super::summary::{fits_by_maneuver, outcome_in_words};
use crate::tables::{ChannelRow, InstrumentRow};

/// A table of the page: a title that says how much is in it, the heads, and cells of plain text.
#[derive(Clone, Debug, Serialize)]
pub struct TableView {
    pub title: String,
    pub note: String,
    pub heads: Vec<String>,
    pub rows: Vec<Vec<String>>,
    /// Whether each column is of numbers, which stand right.
    pub numeric: Vec<bool>,
    /// Where each row's first cell leads, and the class it is hidden with; empty where no row has
    /// any.
    pub links: Vec<String>,
    pub classes: Vec<String>,
}

impl TableView {
    pub fn new(title: &str, note: &str, heads: &[&str], rows: Vec<Vec<String>>) -> TableView {
        let title = format!("{title} ({})", rows.len());
        let numeric = (0..heads.len())
            .map(|i| is_numeric(rows.iter().filter_map(|row| row.get(i))))
            .collect();
        TableView {
            title,
            note: note.to_owned(),
            heads: heads.iter().map(|h| (*h).to_owned()).collect(),
            rows,
            numeric,
            links: vec![],
            classes: vec![],
        }
    }
}

/// Whether cells are numbers or nothing, and one of them a number.
fn is_numeric<'a>(cells: impl Iterator<Item = &'a String>) -> bool {
    let is_number = |c: &str| {
        let bare = c.replace('\u{2212}', "-");
        bare.trim_end_matches(['%', '°', ' '])
            .parse::<f64>()
            .is_ok()
    };
    let mut some = false;
    for cell in cells.filter(|c| !c.is_empty() && *c != NOTHING) {
        if !is_number(cell) {
            return false;
        }
        some = true;
    }
    some
}

/// Whether a check of the records passed, or could not be made for want of excitation.
#[must_use]
pub fn is_check_passed(verdict: &str) -> bool {
    matches!(
        verdict,
        "ok" | InstrumentRow::NO_DELAY | "not excited" | "not checked"
    )
}

/// The tables of what went wrong; those without rows are left out.
#[must_use]
pub fn tables(contents: &Contents) -> Vec<TableView> {
    let tables = [
        problems(contents),
        fits(contents),
        events(contents),
        checks(contents),
        instruments(contents),
        channels(contents),
    ];
    tables.into_iter().filter(|t| !t.rows.is_empty()).collect()
}

fn problems(contents: &Contents) -> TableView {
    let row = |p: &crate::error::Problem| {
        vec![
            p.stage.clone(),
            p.flight_id.clone(),
            p.place.clone(),
            p.reason.clone(),
        ]
    };
    let rows = contents.problems.iter().map(row).collect();
    TableView::new(
        "Problems",
        "",
        &["stage", "flight", "place", "reason"],
        rows,
    )
}

fn fits(contents: &Contents) -> TableView {
    let maneuvers: BTreeMap<&str, _> = contents
        .maneuvers
        .iter()
        .map(|m| (m.maneuver_id.as_str(), m))
        .collect();
    let failed = contents
        .fits
        .iter()
        .filter(|f| f.outcome != "converged")
        .map(|f| {
            let alpha = maneuvers
                .get(f.maneuver_id.as_str())
                .map_or(NOTHING.to_owned(), |m| angle(m.alpha_deg));
            let outcome = outcome_in_words(&f.outcome).to_owned();
            vec![
                f.maneuver_id.clone(),
                f.class.clone(),
                alpha,
                outcome,
                f.reason.clone(),
            ]
        });
    let fits = fits_by_maneuver(contents);
    let missing = contents
        .maneuvers
        .iter()
        .filter(|m| !fits.contains_key(m.maneuver_id.as_str()))
        .map(|m| {
            vec![
                m.maneuver_id.clone(),
                m.class.clone(),
                angle(m.alpha_deg),
                "no fit".to_owned(),
                String::new(),
            ]
        });
    let heads = ["maneuver", "class", "α", "outcome", "reason"];
    TableView::new(
        "Maneuvers without a sound fit",
        "",
        &heads,
        failed.chain(missing).collect(),
    )
}

fn events(contents: &Contents) -> TableView {
    let text = |v: &Option<String>| v.clone().unwrap_or_else(|| NOTHING.to_owned());
    let window = |start: Option<f64>, end: Option<f64>| match (start, end) {
        (Some(start), Some(end)) => format!("{}\u{2013}{} s", fixed(start, 1), fixed(end, 1)),
        _ => NOTHING.to_owned(),
    };
    let row = |e: &crate::tables::EventRow| {
        let given = [text(&e.given_class), window(e.given_start_s, e.given_end_s)];
        let found = [text(&e.found_class), window(e.found_start_s, e.found_end_s)];
        [
            vec![e.flight_id.clone()],
            given.to_vec(),
            found.to_vec(),
            vec![e.verdict.clone()],
        ]
        .concat()
    };
    let rows = contents
        .events
        .iter()
        .filter(|e| e.verdict != "agrees")
        .map(row)
        .collect();
    let heads = [
        "flight",
        "given class",
        "given times",
        "found class",
        "found times",
        "verdict",
    ];
    TableView::new("Events that the records do not confirm", "", &heads, rows)
}

fn checks(contents: &Contents) -> TableView {
    let failed = contents
        .checks
        .iter()
        .filter(|c| !is_check_passed(&c.verdict));
    let rows = failed
        .map(|c| {
            let numbers = [number(c.slope, 3), number(c.correlation, 3)];
            let [slope, correlation] = numbers;
            let words = [c.flight_id.clone(), c.relation.clone(), c.signals.clone()];
            [words.to_vec(), vec![slope, correlation, c.verdict.clone()]].concat()
        })
        .collect();
    let heads = [
        "flight",
        "relation",
        "signals",
        "slope",
        "correlation",
        "verdict",
    ];
    let note = "Slope of what is measured on what the other signals predict: 1 when units and signs are right.";
    TableView::new("Checks between channels that failed", note, &heads, rows)
}

/// What the instruments were found to be off by, over the flights.
fn instruments(contents: &Contents) -> TableView {
    let mut of: BTreeMap<(&str, &str), Vec<&InstrumentRow>> = BTreeMap::new();
    let told = |r: &&InstrumentRow| r.verdict != "not excited";
    for row in contents.instruments.iter().filter(told) {
        of.entry((&row.channel, &row.unit)).or_default().push(row);
    }
    let rows = of
        .into_iter()
        .map(|((channel, unit), rows)| {
            let range = |value: fn(&InstrumentRow) -> Option<f64>, digits: usize| {
                let values = || rows.iter().filter_map(|r| value(r));
                match (values().reduce(f64::min), values().reduce(f64::max)) {
                    (Some(least), Some(most)) => {
                        format!("{} \u{2026} {}", fixed(least, digits), fixed(most, digits))
                    }
                    _ => NOTHING.to_owned(),
                }
            };
            let corrected = rows.iter().filter(|r| !r.applied.is_empty()).count();
            let faults = rows.iter().filter(|r| !is_check_passed(&r.verdict)).count();
            vec![
                channel.to_owned(),
                unit.to_owned(),
                rows.len().to_string(),
                corrected.to_string(),
                faults.to_string(),
                range(|r| r.bias, 3),
                range(|r| r.scale, 4),
                range(|r| r.delay_s.map(|d| 1e3 * d), 0),
            ]
        })
        .collect();
    let heads = [
        "channel",
        "unit",
        "flights",
        "corrected",
        "faults",
        "bias",
        "scale",
        "delay, ms",
    ];
    let note = "From the kinematic equations alone, least and most over the flights; each with its bound is in the table \
                `instruments`.";
    TableView::new("Instruments", note, &heads, rows)
}

/// Channels that were repaired or are not as they should be, summed over the flights with the same
/// verdict.
fn channels(contents: &Contents) -> TableView {
    let mut sums: BTreeMap<(&str, &str, &str), (usize, [usize; 5])> = BTreeMap::new();
    for c in contents.channels.iter().filter(|c| is_noteworthy(c)) {
        let (flights, counts) = sums.entry((&c.channel, &c.signal, &c.verdict)).or_default();
        *flights += 1;
        for (sum, n) in counts
            .iter_mut()
            .zip([c.samples, c.bridged, c.despiked, c.missing, c.stuck])
        {
            *sum += n;
        }
    }
    let rows = sums
        .into_iter()
        .map(|((channel, signal, verdict), (flights, counts))| {
            let words = [channel.to_owned(), signal.to_owned(), flights.to_string()];
            [
                words.to_vec(),
                counts.map(|n| n.to_string()).to_vec(),
                vec![verdict.to_owned()],
            ]
            .concat()
        })
        .collect();
    let heads = [
        "channel", "signal", "flights", "samples", "bridged", "despiked", "missing", "stuck",
        "verdict",
    ];
    let note = "Short dropouts bridged, single-sample spikes replaced, samples left missing or left out as stuck: summed over the flights.";
    TableView::new("Channels repaired or in doubt", note, &heads, rows)
}

fn is_noteworthy(c: &ChannelRow) -> bool {
    c.bridged + c.despiked + c.missing + c.stuck > 0 || !is_check_passed(&c.verdict)
}
