//! Ingest: a flight as recorded becomes records of signals, each on one clock, every repaired
//! sample marked, and the units and signs of its channels checked against the kinematic equations
//! instead of believed.
//!
//! A flight is read twice: once its time channels alone ([`survey`]), which give the stretches and
//! their clocks, then every channel by itself, piece by piece ([`Flow`]). So memory does not grow
//! with the length of a flight, but for the clock's list of runs and the means over short blocks
//! that the kinematic relations compare ([`judge`]).

mod channels;
mod character;
mod checks;
mod clock;
pub mod compatibility;
mod conditioner;
mod flow;
mod gaps;
mod guilt;
mod motion;
mod pieces;
mod relations;
mod settings;
mod signature;
mod source;
mod spikes;
mod stretches;
mod survey;

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

pub use clock::Clock;
pub use flow::{Flow, Flowed};
pub use settings::{Checks, Excitation, OnFailedCheck, Settings, Spikes, Stuck};
pub use signature::Signature;
pub use source::Source;
pub use survey::{Survey, Surveyed, survey};

use crate::aircraft::Aircraft;
use crate::error::Problem;
use crate::flight::record::Series;
use crate::flight::{Channel, Correction, Mark, RawFlight, Record, signal};
use crate::tables::{ChannelRow, CheckRow, InstrumentRow};
use compatibility::{Findings, OnFault};
use conditioner::Done;
use guilt::Guilty;

/// The signal of the channel that is the recorder's clock.
pub const TIME: &str = "time_s";

/// What ingest makes of one stretch of a flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Ingested {
    pub record: Record,
    /// What was done to each channel.
    pub channels: Vec<ChannelRow>,
    /// How each kinematic relation came out.
    pub checks: Vec<CheckRow>,
    /// What its instruments are off by.
    pub instruments: Vec<InstrumentRow>,
    /// What is wrong with the flight without spoiling it.
    pub problems: Vec<Problem>,
}

/// What ingest reads a flight with: the map of columns to signals, signals that the aircraft does
/// not record, and the rest.
#[derive(Clone, Copy, Debug)]
pub struct Basis<'a> {
    pub channels: &'a BTreeMap<String, Channel>,
    pub constants: &'a BTreeMap<String, f64>,
    pub aircraft: &'a Aircraft,
    pub settings: &'a Settings,
}

/// The record of the first stretch of a flight that is in memory; a flight of any length is read as
/// [`survey`], [`flows`] and [`judge`] do it.
///
/// # Errors
/// A problem that refuses this flight and no other: a clock that cannot be followed, a unit in the
/// file that is not the channel map's, a required channel that is missing, or one that the
/// kinematic relations prove wrong.
pub fn record(
    raw: &RawFlight,
    channels: &BTreeMap<String, Channel>,
    constants: &BTreeMap<String, f64>,
    aircraft: &Aircraft,
    settings: &Settings,
) -> Result<Ingested, Problem> {
    let basis = Basis {
        channels,
        constants,
        aircraft,
        settings,
    };
    let first = records(std::slice::from_ref(raw), &basis, usize::MAX)?
        .into_iter()
        .next();
    first.unwrap_or_else(|| {
        Err(problem(
            &raw.flight_id,
            String::new(),
            "no stretch".to_owned(),
        ))
    })
}

/// The records of all stretches of a flight that is in memory, read in pieces of so many samples.
/// The problems of the whole flight are the first stretch's.
///
/// # Errors
/// A problem that refuses the whole flight; inside, one that refuses a stretch.
pub fn records(
    files: &[RawFlight],
    basis: &Basis,
    piece: usize,
) -> Result<Vec<Result<Ingested, Problem>>, Problem> {
    let (plans, mut problems) = flows(files, basis)?;
    let survey = survey(files, basis.channels, basis.settings)?;
    problems.extend(survey.problems);
    let one = |stretch: &Surveyed| {
        let mut signals = BTreeMap::new();
        let mut finished = Vec::new();
        for plan in &plans {
            let mut flow = Flow::new(plan, stretch, basis.settings);
            let mut whole = Series {
                values: Vec::new(),
                marks: Vec::new(),
            };
            let mut keep = |series: &Series| {
                whole.values.extend_from_slice(&series.values);
                whole.marks.extend_from_slice(&series.marks);
                Ok(())
            };
            let read = flow.run(
                files,
                stretch.clock.samples,
                piece.min(stretch.clock.samples).max(1),
                &mut keep,
            );
            read.map_err(|(place, reason)| problem(&stretch.flight_id, place, reason))?;
            signals.insert(plan.channel.signal.clone(), whole);
            finished.push(flow.finish());
        }
        let samples = stretch.clock.samples;
        for (name, &value) in basis.constants {
            let constant = || Series {
                values: vec![value; samples],
                marks: vec![Mark::Measured; samples],
            };
            signals.entry(name.clone()).or_insert_with(constant);
        }
        let mut record = Record {
            flight_id: stretch.flight_id.clone(),
            start_s: stretch.clock.start_s,
            step_s: stretch.clock.step_s,
            samples,
            signals,
        };
        let judged = judge(stretch, finished, basis, &|signals, range| {
            Some(record.cut(Some(signals), range))
        })?;
        judged
            .corrections
            .iter()
            .for_each(|correction| correction.apply(&mut record));
        let Judgement {
            channels,
            checks,
            instruments,
            problems,
            ..
        } = judged;
        Ok(Ingested {
            record,
            channels,
            checks,
            instruments,
            problems,
        })
    };
    let mut records: Vec<Result<Ingested, Problem>> = survey.stretches.iter().map(one).collect();
    if let Some(Ok(first)) = records.first_mut() {
        first.problems.splice(0..0, problems);
    }
    Ok(records)
}

/// A channel that the files have, with the factor that brings its numbers into the signal's unit.
#[derive(Clone, Copy, Debug)]
pub struct Plan<'a> {
    pub name: &'a str,
    pub channel: &'a Channel,
    pub factor: f64,
}

/// The channels that are to flow, in the order of their signals, and what is wrong with those that
/// are not.
///
/// # Errors
/// A problem that refuses the flight: a unit in a file that is not the channel map's, a required
/// channel that is in no file, a signal with two channels, or a required signal that nobody gives.
pub fn flows<'a>(
    source: &(impl Source + ?Sized),
    basis: &Basis<'a>,
) -> Result<(Vec<Plan<'a>>, Vec<Problem>), Problem> {
    let refused = |(place, reason): Spoilt| problem(source.flight_id(), place, reason);
    channels::check_units(source, basis.channels).map_err(refused)?;
    let mut plans: BTreeMap<&str, Plan> = BTreeMap::new();
    let mut problems = Vec::new();
    for (name, channel) in basis.channels.iter().filter(|(_, c)| c.signal != TIME) {
        match channels::factor(source, name, channel) {
            Ok(factor) => {
                if plans
                    .insert(
                        &channel.signal,
                        Plan {
                            name,
                            channel,
                            factor,
                        },
                    )
                    .is_some()
                {
                    return Err(refused(channels::twice(name, channel)));
                }
            }
            Err(spoilt) if basis.spares(&channel.signal) => problems.push(refused(spoilt)),
            Err(spoilt) => return Err(refused(spoilt)),
        }
    }
    let given = |s: &str| plans.contains_key(s) || basis.constants.contains_key(s);
    if let Some(absent) = signal::REQUIRED.iter().find(|s| !given(s)) {
        return Err(refused(channels::nobody_gives(absent)));
    }
    Ok((plans.into_values().collect(), problems))
}

impl Basis<'_> {
    /// Whether a flight can do without the channel of a signal.
    fn spares(&self, signal: &str) -> bool {
        self.constants.contains_key(signal) || !signal::REQUIRED.contains(&signal)
    }
}

/// What is known of a stretch when all of its channels have flowed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Judgement {
    pub channels: Vec<ChannelRow>,
    pub checks: Vec<CheckRow>,
    pub instruments: Vec<InstrumentRow>,
    /// What signals are corrected by when the record is read.
    pub corrections: Vec<Correction>,
    pub problems: Vec<Problem>,
    pub signature: Signature,
}

/// Gives signals of a record over a range of its samples; none where they cannot be read.
type Read<'a> = dyn Fn(&BTreeSet<String>, Range<usize>) -> Option<Record> + 'a;

/// The samples of a long record that are examined at once: under an hour of a usual recorder.
const PART: usize = 1 << 17;

/// Judges a stretch by what its channels left: counts, the kinematic relations between their means,
/// and what the equations of motion say of its instruments. `read` gives signals of its record over
/// a range of samples.
///
/// # Errors
/// A problem that refuses the stretch: a required channel without any number, or one that the
/// relations prove wrong.
pub fn judge(
    stretch: &Surveyed,
    flowed: Vec<Flowed>,
    basis: &Basis,
    read: &Read,
) -> Result<Judgement, Problem> {
    let id = stretch.flight_id.as_str();
    let clock = &stretch.clock;
    let refused = |(place, reason): Spoilt| problem(id, place, reason);
    let checks = &basis.settings.checks;
    let (mut means, mut done, mut problems) = (BTreeMap::new(), Vec::new(), Vec::new());
    let mut signature = Vec::new();
    for Flowed {
        name,
        channel,
        done: own,
        averaging,
        samples,
    } in flowed
    {
        if own.count(Mark::Missing) == clock.samples {
            let spoilt = refused(channels::holds_nothing(name, channel, clock.rows));
            if !basis.spares(&channel.signal) {
                return Err(spoilt);
            }
            problems.push(spoilt);
        } else {
            problems.extend(channels::stuck(name, &own, clock).map(refused));
            means.extend(averaging.map(|a| (channel.signal.clone(), a)));
            // An angle that wrapped around is as many turns off as it has made since the record
            // began.
            signature.extend((own.wraps == 0 && channel.wraps_at.is_none()).then_some(samples));
        }
        done.push((name, channel, own));
    }
    let recorded: Vec<String> = means.keys().cloned().collect();
    for (signal, value) in basis.constants {
        let constant =
            motion::Averaging::constant(signal, *value, clock.samples, clock.step_s, checks);
        if let Some(constant) = constant {
            means.entry(signal.clone()).or_insert(constant);
        }
    }
    let blocks = motion::Blocks::of(means, clock.samples, clock.step_s, checks);
    let judge = |blocks: &motion::Blocks| Judged::of(id, blocks, basis, &recorded);
    let examine = |set_right: &dyn Fn(&mut Record)| {
        let count = clock.samples.div_ceil(PART);
        let part = |i: usize| {
            let mut record = read(
                &compatibility::signals(),
                i * PART..((i + 1) * PART).min(clock.samples),
            )?;
            set_right(&mut record);
            Some(record)
        };
        let settings = &basis.settings.compatibility;
        let parts = (0..count).filter_map(part);
        compatibility::examine(
            parts,
            count,
            basis.channels,
            &recorded,
            basis.aircraft,
            settings,
        )
    };
    let (judged, findings) = reconciled(&blocks, judge, examine);
    if let Some(accusation) = &judged.accusation {
        let besides = findings
            .accusations()
            .map(|a| format!(". Besides, {a}"))
            .unwrap_or_default();
        let spoilt = refused((
            accusation.place.clone(),
            format!("{}{besides}", accusation.reason),
        ));
        if basis.settings.on_failed_check == OnFailedCheck::Refuse && accusation.required {
            return Err(spoilt);
        }
        problems.push(spoilt);
    }
    let faults = findings.problems(id);
    if basis.settings.compatibility.fault == OnFault::Refuse && findings.required_faulty() {
        return Err(together(id, &faults));
    }
    problems.extend(faults);
    Ok(Judgement {
        channels: channel_rows(stretch, basis.channels, &done, &judged, &findings),
        checks: judged.checks,
        instruments: findings.rows(id),
        corrections: findings.corrections(),
        problems,
        signature: Signature::of(signature.into_iter()),
    })
}

/// Gross faults and instrument errors brought together.
///
/// Where a sign or a unit is wrong the errors of the others are looked for with that set right, and
/// the record is left as it is. A check that no sign and no unit explains may fail for a delay:
/// where it does not fail any more without it, the delay is the fault.
fn reconciled(
    blocks: &motion::Blocks,
    judge: impl Fn(&motion::Blocks) -> Judged,
    examine: impl Fn(&dyn Fn(&mut Record)) -> Findings,
) -> (Judged, Findings) {
    let judged = judge(blocks);
    if !judged.guilty.is_empty() && judged.guilty.iter().all(|g| g.alone && g.factor.is_some()) {
        let findings = examine(&|record| judged.set_right(record)).reported();
        return (judged, findings);
    }
    // A dead channel, or one of several: there is nothing to go by.
    if judged.guilty.iter().any(|g| g.cause.is_some()) {
        return (judged, Findings::default());
    }
    let findings = examine(&|_| ());
    if judged.accusation.is_none() {
        return (judged, findings);
    }
    if findings.faulty() {
        let again = judge(&blocks.corrected(&findings.freed().corrections()));
        if again.accusation.is_none() {
            return (again, findings);
        }
    }
    (judged, Findings::default())
}

/// Several problems of one stretch as the one that refuses it.
fn together(id: &str, problems: &[Problem]) -> Problem {
    let places: Vec<&str> = problems.iter().map(|p| p.place.as_str()).collect();
    let reasons: Vec<&str> = problems.iter().map(|p| p.reason.as_str()).collect();
    problem(id, places.join(", "), reasons.join(". "))
}

/// Where something is wrong and what: the place and the reason of a [`Problem`].
type Spoilt = (String, String);

fn problem(flight_id: &str, place: String, reason: String) -> Problem {
    Problem {
        stage: "ingest".to_owned(),
        flight_id: flight_id.to_owned(),
        place,
        reason,
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
    fn of(flight_id: &str, blocks: &motion::Blocks, basis: &Basis, recorded: &[String]) -> Judged {
        let settings = &basis.settings.checks;
        let found = checks::all(blocks, basis.aircraft, settings);
        let guilty = guilt::find(
            blocks,
            &found,
            basis.channels,
            recorded,
            basis.aircraft,
            settings,
        );
        Judged {
            checks: found.iter().map(|c| c.row(flight_id)).collect(),
            cleared: checks::cleared(&found),
            accusation: guilt::accusation(&guilty, &found),
            guilty,
        }
    }

    /// Multiplies the guilty signals by what sets them right.
    fn set_right(&self, record: &mut Record) {
        for guilty in &self.guilty {
            if let (Some(factor), Some(series)) =
                (guilty.factor, record.signals.get_mut(&guilty.signal))
            {
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

/// A row for every channel that flowed and one for the clock, in the order of the channel map.
fn channel_rows(
    stretch: &Surveyed,
    channels: &BTreeMap<String, Channel>,
    done: &[(&str, &Channel, Done)],
    judged: &Judged,
    findings: &Findings,
) -> Vec<ChannelRow> {
    let clock = &stretch.clock;
    let rate_hz = 1.0 / clock.step_s;
    let row = |name: &str, channel: &Channel| ChannelRow {
        flight_id: stretch.flight_id.clone(),
        channel: name.to_owned(),
        signal: channel.signal.clone(),
        samples: clock.samples,
        rate_hz: Some(rate_hz),
        between: 0,
        bridged: 0,
        despiked: 0,
        missing: 0,
        stuck: 0,
        wraps: 0,
        quantisation: None,
        noise: None,
        verdict: "ok".to_owned(),
    };
    let of_channel = |(name, channel, done): &(&str, &Channel, Done)| ChannelRow {
        rate_hz: Some(rate_hz / done.period as f64),
        between: done.count(Mark::Between),
        bridged: done.count(Mark::Bridged),
        despiked: done.count(Mark::Despiked),
        missing: done.count(Mark::Missing),
        stuck: done.count(Mark::Stuck),
        wraps: done.wraps,
        quantisation: done.quantisation,
        noise: done.noise,
        verdict: findings
            .verdict(&channel.signal)
            .unwrap_or_else(|| judged.verdict(&channel.signal)),
        ..row(name, channel)
    };
    // A lost frame's time is known all the same: it is a step after the one before.
    let time = channels
        .iter()
        .find(|(_, c)| c.signal == TIME)
        .map(|(name, channel)| ChannelRow {
            bridged: clock.samples - clock.rows,
            noise: Some(clock.jitter_s),
            ..row(name, channel)
        });
    let mut rows: Vec<ChannelRow> = done.iter().map(of_channel).chain(time).collect();
    rows.sort_by(|a, b| a.channel.cmp(&b.channel));
    rows
}
