//! Tables of failures and their reasons: problems, fits, events, checks between channels, turbulence,
//! instruments, repaired channels.

use std::collections::BTreeMap;

use crate::error::Problem;
use crate::maneuver::Maneuver;
use crate::report::contents::Contents;
use crate::report::notation::{DASH, angle, fixed, number, outcome_in_words};
use crate::report::table_view::TableView;
use crate::schema::Words;
use crate::tables::{
    ALL_FLIGHTS, ChannelRow, CheckRow, CommonErrorVerdict, EventRow, EventVerdict, FitRow,
    FlightRow, InstrumentRow, InstrumentTrendRow, Outcome,
};

/// The tables of failures, without empty ones.
#[must_use]
pub fn tables(contents: &Contents) -> Vec<TableView> {
    let tables = [
        problems(contents),
        fits(contents),
        events(contents),
        checks(contents),
        flights(contents),
        instruments(contents),
        instrument_trends(contents),
        channels(contents),
    ];
    tables.into_iter().filter(|t| !t.rows.is_empty()).collect()
}

fn problems(contents: &Contents) -> TableView {
    let row = |p: &Problem| {
        vec![
            p.stage.to_string(),
            p.flight_id.clone(),
            p.place.clone(),
            p.reason.clone(),
        ]
    };
    let rows = contents.problems.iter().map(row).collect();
    let heads = ["stage", "flight", "place", "reason"];
    TableView::new("Problems", "", &heads, rows)
}

/// Fits that did not converge, then maneuvers without a fit.
fn fits(contents: &Contents) -> TableView {
    let maneuvers: BTreeMap<&str, &Maneuver> = contents
        .maneuvers
        .iter()
        .map(|m| (m.maneuver_id.as_str(), m))
        .collect();
    let fits = contents.fits_by_maneuver();
    let failed = contents
        .fits
        .iter()
        .filter(|f| f.outcome != Outcome::Converged)
        .map(|f| failed_fit(f, maneuvers.get(f.maneuver_id.as_str()).copied()));
    let missing = contents
        .maneuvers
        .iter()
        .filter(|m| !fits.contains_key(m.maneuver_id.as_str()))
        .map(missing_fit);
    let heads = ["maneuver", "class", "α", "outcome", "reason"];
    TableView::new(
        "Maneuvers without a usable fit",
        "",
        &heads,
        failed.chain(missing).collect(),
    )
}

fn failed_fit(fit: &FitRow, maneuver: Option<&Maneuver>) -> Vec<String> {
    vec![
        fit.maneuver_id.clone(),
        fit.class.clone(),
        maneuver.map_or_else(|| DASH.to_owned(), |m| angle(m.alpha_deg)),
        outcome_in_words(fit.outcome).to_owned(),
        fit.reason.clone(),
    ]
}

fn missing_fit(maneuver: &Maneuver) -> Vec<String> {
    vec![
        maneuver.maneuver_id.clone(),
        maneuver.class.clone(),
        angle(maneuver.alpha_deg),
        "no fit".to_owned(),
        String::new(),
    ]
}

/// The analyst's events that the recognised maneuvers do not confirm.
fn events(contents: &Contents) -> TableView {
    let rows = contents
        .events
        .iter()
        .filter(|e| e.verdict != EventVerdict::Agrees)
        .map(event)
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

fn event(event: &EventRow) -> Vec<String> {
    let class = |class: &Option<String>| class.clone().unwrap_or_else(|| DASH.to_owned());
    let times = |start: Option<f64>, end: Option<f64>| match (start, end) {
        (Some(start), Some(end)) => format!("{}\u{2013}{} s", fixed(start, 1), fixed(end, 1)),
        _ => DASH.to_owned(),
    };
    vec![
        event.flight_id.clone(),
        class(&event.given_class),
        times(event.given_start_s, event.given_end_s),
        class(&event.found_class),
        times(event.found_start_s, event.found_end_s),
        event.verdict.to_string(),
    ]
}

fn checks(contents: &Contents) -> TableView {
    let row = |c: &CheckRow| {
        vec![
            c.flight_id.clone(),
            c.relation.clone(),
            c.signals.clone(),
            number(c.slope, 3),
            number(c.correlation, 3),
            c.verdict.to_string(),
        ]
    };
    let rows = contents
        .checks
        .iter()
        .filter(|c| !c.verdict.passed())
        .map(row)
        .collect();
    let heads = [
        "flight",
        "relation",
        "signals",
        "slope",
        "correlation",
        "verdict",
    ];
    let note = "Slope of the measured signal on its prediction from the other signals: 1 when \
                units and signs are right.";
    TableView::new("Checks between channels that failed", note, &heads, rows)
}

/// Gusts of each flight.
fn flights(contents: &Contents) -> TableView {
    let row = |f: &FlightRow| {
        let maneuvers = contents.maneuvers.iter();
        let count = maneuvers.filter(|m| m.flight_id == f.flight_id).count();
        vec![
            f.flight_id.clone(),
            fixed(f.duration_s / 60.0, 1),
            count.to_string(),
            gust(f.gust_u_ft_s),
            gust(f.gust_v_ft_s),
            gust(f.gust_w_ft_s),
        ]
    };
    let rows = contents.flights.iter().map(row).collect();
    let heads = [
        "flight",
        "minutes",
        "maneuvers",
        "gusts forward, ft/s",
        "sideways, ft/s",
        "downward, ft/s",
    ];
    let note = "Root mean square of the gusts along the body axes; up to half a foot per second is the \
                instruments' own.";
    TableView::new("Flights and their turbulence", note, &heads, rows)
}

fn gust(rms_ft_s: Option<f64>) -> String {
    rms_ft_s.map_or_else(|| DASH.to_owned(), |rms| fixed(rms, 1))
}

/// Calibration errors of the instruments, summarised over the flights.
fn instruments(contents: &Contents) -> TableView {
    let mut by_channel: BTreeMap<(&str, &str), Vec<&InstrumentRow>> = BTreeMap::new();
    for row in contents
        .instruments
        .iter()
        .filter(|row| !row.verdict.is_unknown())
        .filter(|row| row.flight_id != ALL_FLIGHTS)
    {
        by_channel
            .entry((&row.channel, &row.unit))
            .or_default()
            .push(row);
    }
    let rows = by_channel
        .into_iter()
        .map(|((channel, unit), rows)| instrument(channel, unit, &rows))
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
    let note = "Surfaces from the equations of motion, the others from the kinematic equations \
                alone; smallest and largest over the flights. The table `instruments` has each \
                with its bound, and the delays of the surfaces over all flights.";
    TableView::new("Instruments", note, &heads, rows)
}

fn instrument(channel: &str, unit: &str, rows: &[&InstrumentRow]) -> Vec<String> {
    let corrected = rows.iter().filter(|r| !r.applied.is_empty()).count();
    let faults = rows.iter().filter(|r| !r.verdict.passed()).count();
    vec![
        channel.to_owned(),
        unit.to_owned(),
        rows.len().to_string(),
        corrected.to_string(),
        faults.to_string(),
        range(rows.iter().filter_map(|r| r.bias), 3),
        range(rows.iter().filter_map(|r| r.scale), 4),
        range(rows.iter().filter_map(|r| r.delay_s.map(|d| 1e3 * d)), 1),
    ]
}

/// Errors of the instruments over the flights.
fn instrument_trends(contents: &Contents) -> TableView {
    let row = |t: &InstrumentTrendRow| {
        vec![
            t.channel.clone(),
            t.error.to_string(),
            t.unit.clone(),
            t.flights.to_string(),
            t.completed_flights.to_string(),
            number(t.mean, 4),
            number(t.mean_bound, 2),
            number(t.scatter, 2),
            t.common.to_string(),
            t.far_flights.clone(),
            t.verdict.to_string(),
            t.since.clone().unwrap_or_else(|| DASH.to_owned()),
        ]
    };
    let judged = contents.instrument_trends.iter();
    let judged = judged.filter(|t| t.common != CommonErrorVerdict::TooFewFlights);
    let heads = [
        "channel",
        "error",
        "unit",
        "flights",
        "completed",
        "mean",
        "bound",
        "scatter",
        "mean is",
        "far from the others",
        "over the flights",
        "since",
    ];
    let note = "Mean of each error over the flights, and its scatter between them. Completed: flights that do \
                not determine the error by themselves and take it from the others.";
    TableView::new(
        "Instruments over the flights",
        note,
        &heads,
        judged.map(row).collect(),
    )
}

/// Smallest and largest value; a dash without any.
fn range(values: impl Iterator<Item = f64> + Clone, decimals: usize) -> String {
    let (least, most) = (values.clone().reduce(f64::min), values.reduce(f64::max));
    match (least, most) {
        (Some(least), Some(most)) => format!(
            "{} \u{2026} {}",
            fixed(least, decimals),
            fixed(most, decimals)
        ),
        _ => DASH.to_owned(),
    }
}

/// Repaired or faulty channels, summed over the flights with the same verdict.
fn channels(contents: &Contents) -> TableView {
    let mut sums: BTreeMap<(&str, &str, &str), (usize, [usize; 5])> = BTreeMap::new();
    for c in contents.channels.iter().filter(|c| is_noteworthy(c)) {
        let (flights, counts) = sums
            .entry((&c.channel, &c.signal, c.verdict.word()))
            .or_default();
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
            let mut cells = vec![channel.to_owned(), signal.to_owned(), flights.to_string()];
            cells.extend(counts.map(|n| n.to_string()));
            cells.push(verdict.to_owned());
            cells
        })
        .collect();
    let heads = [
        "channel", "signal", "flights", "samples", "bridged", "despiked", "missing", "stuck",
        "verdict",
    ];
    let note = "Samples bridged over short dropouts, spikes of a single sample replaced, samples \
                left missing, samples excluded as stuck: summed over the flights.";
    TableView::new("Channels repaired or faulty", note, &heads, rows)
}

fn is_noteworthy(channel: &ChannelRow) -> bool {
    channel.bridged + channel.despiked + channel.missing + channel.stuck > 0
        || !channel.verdict.passed()
}
