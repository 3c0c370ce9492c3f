//! Ingest: a flight as recorded becomes a record of signals on one clock, every repaired sample marked, and the units
//! and signs of its channels checked against the kinematic equations instead of believed.

mod channels;
mod checks;
mod clock;
pub mod compatibility;
mod gaps;
mod guilt;
mod motion;
mod relations;
mod settings;
mod spikes;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

pub use settings::{Checks, Excitation, OnFailedCheck, Settings, Spikes};

use crate::aircraft::Aircraft;
use crate::error::Problem;
use crate::flight::record::Series;
use crate::flight::{Channel, Mark, RawFlight, Record, signal};
use crate::tables::{ChannelRow, CheckRow, InstrumentRow};
use compatibility::{Findings, OnFault};
use guilt::Guilty;

/// The signal of the channel that is the recorder's clock.
pub const TIME: &str = "time_s";

/// What ingest makes of one flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Ingested {
    pub record: Record,
    /// What was done to each channel.
    pub channels: Vec<ChannelRow>,
    /// How each kinematic relation came out.
    pub checks: Vec<CheckRow>,
    /// What the kinematic equations say of each instrument.
    pub instruments: Vec<InstrumentRow>,
    /// What is wrong with the flight without spoiling it.
    pub problems: Vec<Problem>,
}

/// The record of one flight: its channels converted into signals, put on one uniform clock, repaired and checked.
/// `channels` maps columns to signals; `constants` gives signals that the aircraft does not record.
///
/// # Errors
/// A problem that refuses this flight and no other: a clock that cannot be followed, a unit in the file that is not the
/// channel map's, a required channel that is missing, or one that the kinematic relations prove wrong.
pub fn record(
    raw: &RawFlight,
    channels: &BTreeMap<String, Channel>,
    constants: &BTreeMap<String, f64>,
    aircraft: &Aircraft,
    settings: &Settings,
) -> Result<Ingested, Problem> {
    let refused = |(place, reason): Spoilt| problem(&raw.flight_id, place, reason);
    channels::check_units(raw, channels).map_err(refused)?;
    let clock = clock::of(raw, channels, settings).map_err(refused)?;
    let mut signals = BTreeMap::new();
    let mut problems = Vec::new();
    for (name, channel) in channels.iter().filter(|(_, c)| c.signal != TIME) {
        match channels::series(raw, name, channel, &clock, settings) {
            Ok(series) => {
                if signals.insert(channel.signal.clone(), series).is_some() {
                    return Err(refused(channels::twice(name, channel)));
                }
            }
            Err(spoilt) if constants.contains_key(&channel.signal) || !required(&channel.signal) => {
                problems.push(refused(spoilt));
            }
            Err(spoilt) => return Err(refused(spoilt)),
        }
    }
    let recorded: Vec<String> = signals.keys().cloned().collect();
    add_constants(&mut signals, constants, clock.samples);
    if let Some(absent) = signal::REQUIRED.iter().find(|s| !signals.contains_key(**s)) {
        return Err(refused(channels::nobody_gives(absent)));
    }
    let mut record = Record {
        flight_id: raw.flight_id.clone(),
        start_s: clock.start_s,
        step_s: clock.step_s,
        samples: clock.samples,
        signals,
    };
    let judge = |record: &Record| Judged::of(record, channels, &recorded, aircraft, &settings.checks);
    let examine =
        |record: &Record| compatibility::examine(record, channels, &recorded, aircraft, &settings.compatibility);
    let (judged, findings) = reconciled(&mut record, judge, examine);
    if let Some(accusation) = &judged.accusation {
        let besides = findings.accusations().map(|a| format!(". Besides, {a}")).unwrap_or_default();
        let reason = format!("{}{besides}", accusation.reason);
        let spoilt = problem(&raw.flight_id, accusation.place.clone(), reason);
        if settings.on_failed_check == OnFailedCheck::Refuse && accusation.required {
            return Err(spoilt);
        }
        problems.push(spoilt);
    }
    let faults = findings.problems(&raw.flight_id);
    if settings.compatibility.fault == OnFault::Refuse && findings.required_faulty() {
        return Err(together(faults));
    }
    problems.extend(faults);
    let rows = channel_rows(&record, channels, &judged, &findings);
    let instruments = findings.rows(&record.flight_id);
    Ok(Ingested { record, channels: rows, checks: judged.checks, instruments, problems })
}

/// Gross faults and instrument errors brought together; the record is corrected by what is to be applied.
///
/// Where a sign or a unit is wrong the errors of the others are looked for with that set right, and the record is left as
/// it is. A check that no sign and no unit explains may fail for a delay: where it does not fail any more without it, the
/// delay is the fault.
fn reconciled(
    record: &mut Record,
    judge: impl Fn(&Record) -> Judged,
    examine: impl Fn(&Record) -> Findings,
) -> (Judged, Findings) {
    let judged = judge(record);
    if !judged.guilty.is_empty() && judged.guilty.iter().all(|g| g.alone && g.factor.is_some()) {
        let mut right = record.clone();
        judged.set_right(&mut right);
        return (judged, examine(&right).reported());
    }
    // A dead channel, or one of several: there is nothing to go by.
    if judged.guilty.iter().any(|g| g.cause.is_some()) {
        return (judged, Findings::default());
    }
    let findings = examine(record);
    if judged.accusation.is_none() {
        findings.correct(record);
        return (judged, findings);
    }
    if findings.faulty() {
        let mut right = record.clone();
        findings.freed().correct(&mut right);
        let again = judge(&right);
        if again.accusation.is_none() {
            findings.correct(record);
            return (again, findings);
        }
    }
    (judged, Findings::default())
}

/// Several problems of one flight as the one that refuses it.
fn together(problems: Vec<Problem>) -> Problem {
    let places: Vec<String> = problems.iter().map(|p| p.place.clone()).collect();
    let reasons: Vec<String> = problems.iter().map(|p| p.reason.clone()).collect();
    let first = problems.into_iter().next();
    let flight_id = first.map(|p| p.flight_id).unwrap_or_default();
    problem(&flight_id, places.join(", "), reasons.join(". "))
}

/// Where something is wrong and what: the place and the reason of a [`Problem`].
type Spoilt = (String, String);

fn problem(flight_id: &str, place: String, reason: String) -> Problem {
    Problem { stage: "ingest".to_owned(), flight_id: flight_id.to_owned(), place, reason }
}

fn required(signal: &str) -> bool {
    signal::REQUIRED.contains(&signal)
}

fn add_constants(signals: &mut BTreeMap<String, Series>, constants: &BTreeMap<String, f64>, samples: usize) {
    for (name, &value) in constants {
        let constant = || Series { values: vec![value; samples], marks: vec![Mark::Measured; samples] };
        signals.entry(name.clone()).or_insert_with(constant);
    }
}

/// What the relations say about the channels of a record.
struct Judged {
    checks: Vec<CheckRow>,
    guilty: Vec<Guilty>,
    /// Signals that a relation has confirmed.
    cleared: Vec<&'static str>,
    accusation: Option<guilt::Accusation>,
}

impl Judged {
    fn of(
        record: &Record,
        channels: &BTreeMap<String, Channel>,
        recorded: &[String],
        aircraft: &Aircraft,
        settings: &Checks,
    ) -> Judged {
        let blocks = motion::Blocks::of(record, settings);
        let found = checks::all(&blocks, aircraft, settings);
        let guilty = guilt::find(&blocks, &found, channels, recorded, aircraft, settings);
        Judged {
            checks: found.iter().map(|c| c.row(&record.flight_id)).collect(),
            cleared: checks::cleared(&found),
            accusation: guilt::accusation(&guilty, &found),
            guilty,
        }
    }

    /// Multiplies the guilty signals by what sets them right.
    fn set_right(&self, record: &mut Record) {
        for guilty in &self.guilty {
            if let (Some(factor), Some(series)) = (guilty.factor, record.signals.get_mut(&guilty.signal)) {
                series.values.iter_mut().for_each(|v| *v *= factor);
            }
        }
    }

    fn verdict(&self, signal: &str) -> String {
        match self.guilty.iter().find(|g| g.signal == signal) {
            Some(guilty) => guilty.verdict(),
            None if self.cleared.contains(&signal) => "ok".to_owned(),
            None => "not checked".to_owned(),
        }
    }
}

fn channel_rows(
    record: &Record,
    channels: &BTreeMap<String, Channel>,
    judged: &Judged,
    findings: &Findings,
) -> Vec<ChannelRow> {
    let row = |(name, channel): (&String, &Channel)| {
        let series = record.signals.get(&channel.signal)?;
        let count = |mark: Mark| series.marks.iter().filter(|m| **m == mark).count();
        Some(ChannelRow {
            flight_id: record.flight_id.clone(),
            channel: name.clone(),
            signal: channel.signal.clone(),
            samples: record.samples,
            bridged: count(Mark::Bridged),
            despiked: count(Mark::Despiked),
            missing: count(Mark::Missing),
            verdict: findings.verdict(&channel.signal).unwrap_or_else(|| judged.verdict(&channel.signal)),
        })
    };
    channels.iter().filter_map(row).collect()
}
