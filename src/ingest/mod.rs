//! Ingest: a flight as recorded becomes a record of signals on one clock, every repaired sample marked, and the units
//! and signs of its channels checked against the kinematic equations instead of believed.

mod channels;
mod checks;
mod clock;
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
use crate::tables::{ChannelRow, CheckRow};
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
    let record = Record {
        flight_id: raw.flight_id.clone(),
        start_s: clock.start_s,
        step_s: clock.step_s,
        samples: clock.samples,
        signals,
    };
    let judged = Judged::of(&record, channels, &recorded, aircraft, &settings.checks);
    if let Some(accusation) = &judged.accusation {
        let spoilt = problem(&raw.flight_id, accusation.place.clone(), accusation.reason.clone());
        if settings.on_failed_check == OnFailedCheck::Refuse && accusation.required {
            return Err(spoilt);
        }
        problems.push(spoilt);
    }
    let rows = channel_rows(&record, channels, &judged);
    Ok(Ingested { record, channels: rows, checks: judged.checks, problems })
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

    fn verdict(&self, signal: &str) -> String {
        match self.guilty.iter().find(|g| g.signal == signal) {
            Some(guilty) => guilty.verdict(),
            None if self.cleared.contains(&signal) => "ok".to_owned(),
            None => "not checked".to_owned(),
        }
    }
}

fn channel_rows(record: &Record, channels: &BTreeMap<String, Channel>, judged: &Judged) -> Vec<ChannelRow> {
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
            verdict: judged.verdict(&channel.signal),
        })
    };
    channels.iter().filter_map(row).collect()
}
