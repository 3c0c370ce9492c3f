//! Assessment of a stretch after all of its channels are read: counts, kinematic relations, gusts
//! and instrument errors.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::channel::{
    ChannelStatistics, ConditionedChannel, Signature, empty_channel, missing_signal, stuck_channel,
    values_beyond,
};
use super::checks::{
    BlockAverager, BlockMeans, Check, FaultReport, FaultyChannel, Gusts, ImpossibleSignal,
    LiftPoint, check_relations, confirmed_signals, find_faulty_channels, impossible_centre,
    impossible_gyration, impossible_mass, impossible_signals, impossible_velocity, lift_curve,
    report, wrong_time,
};
use super::clock::{Clock, Stretch};
use super::compatibility::{self, ErrorEvidence, Findings, OnFault};
use super::context::Context;
use super::refusal::Refusal;
use super::settings::OnFailedCheck;
use super::table_ends::held_throughout;
use crate::error::Problem;
use crate::flight::{Channel, Correction, Mark, Record, StandIn, signal};
use crate::tables::{ChannelRow, ChannelVerdict, CheckRow, FlightRow, InstrumentRow};

/// Samples of a long record that are reconstructed at once: under an hour of a usual recorder, so
/// that memory does not grow with the record.
const PART_SAMPLES: usize = 1 << 17;

/// Results of ingest for one stretch, besides its record.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Assessment {
    /// Times and gusts; `None` for a rejected stretch.
    pub flight: Option<FlightRow>,
    pub channels: Vec<ChannelRow>,
    pub checks: Vec<CheckRow>,
    pub instruments: Vec<InstrumentRow>,
    /// Evidence of this stretch alone on the errors of its instruments.
    pub error_evidence: Vec<ErrorEvidence>,
    /// Corrections that are applied to signals when the record is read.
    pub corrections: Vec<Correction>,
    /// Stand-ins of the signals that the stretch lacks, in the order in which they are computed.
    pub stand_ins: Vec<(String, StandIn)>,
    pub problems: Vec<Problem>,
    /// Normal force over angle of attack, for the comparison with the tunnel.
    pub lift: Vec<LiftPoint>,
    /// Signature of the samples, by which repeated rows are found.
    pub signature: Signature,
}

/// Reads signals of a record over a range of its samples; `None` if they cannot be read.
type RecordReader<'a> = dyn Fn(&BTreeSet<String>, Range<usize>) -> Option<Record> + 'a;

/// Assesses a stretch from its conditioned channels. `read` reads signals of its record over a
/// range of samples.
///
/// # Errors
/// A problem that refuses the stretch: a required channel without any number, or a channel that the
/// relations prove wrong.
pub fn assess(
    stretch: &Stretch,
    channels: Vec<ConditionedChannel>,
    context: &Context,
    read: &RecordReader,
) -> Result<Assessment, Problem> {
    let flight_id = stretch.flight_id.as_str();
    let mut recording = Recording::of(stretch, channels, context)?;
    let mut problems = std::mem::take(&mut recording.problems);
    let examination = Examination {
        clock: &stretch.clock,
        context,
        recorded: recording.block_means.keys().cloned().collect(),
        stand_ins: &recording.stand_ins,
        read,
    };
    let blocks = examination.blocks(std::mem::take(&mut recording.block_means));
    let channels = recording.channels.iter();
    let at_ends = channels.filter_map(|(name, channel, _)| held_throughout(name, channel, &blocks));
    problems.extend(at_ends.map(|refusal| refusal.into_problem(flight_id)));
    let (mut relations, findings) = examination.reconcile(&blocks);
    if relations.impossible.is_empty() {
        relations.impossible = examination.impossible(&blocks, &relations.faulty);
    }
    problems.extend(impossible_values(&relations, context, flight_id)?);
    let mut stand_ins = recording.stand_ins;
    if let Some(report) = &relations.report {
        let left_out = left_out(report, &relations.faulty);
        let problem = relation_problem(report, &left_out, &findings, flight_id);
        if context.settings.on_failed_check == OnFailedCheck::Refuse && report.required {
            return Err(problem);
        }
        problems.push(problem);
        stand_ins.extend(left_out);
    }
    problems.extend(instrument_faults(&findings, context, flight_id)?);
    Ok(Assessment {
        flight: Some(flight_row(stretch, &relations.gusts)),
        channels: channel_rows(
            stretch,
            context.channels,
            &recording.channels,
            &relations,
            &findings,
        ),
        checks: relations.check_rows(flight_id),
        instruments: findings.rows(flight_id),
        error_evidence: findings.evidence(),
        corrections: findings.corrections(),
        stand_ins,
        problems,
        lift: lift_curve(&blocks, context.aircraft, &context.settings.checks),
        signature: recording.signature,
    })
}

/// Problems of signals with impossible values.
///
/// # Errors
/// The problem, where failed checks refuse a stretch.
fn impossible_values(
    relations: &RelationResult,
    context: &Context,
    flight_id: &str,
) -> Result<Vec<Problem>, Problem> {
    let found = relations.impossible.iter().map(|one| {
        let refusal = context.refusal(one.signal, one.reason.clone());
        refusal.into_problem(flight_id)
    });
    let found: Vec<Problem> = found.collect();
    let refuses = context.settings.on_failed_check == OnFailedCheck::Refuse;
    if refuses && !found.is_empty() {
        return Err(joined(&found, flight_id));
    }
    Ok(found)
}

/// Problems of faulty instruments.
///
/// # Errors
/// The problem, where a fault of a required instrument refuses a stretch.
fn instrument_faults(
    findings: &Findings,
    context: &Context,
    flight_id: &str,
) -> Result<Vec<Problem>, Problem> {
    let faults = findings.problems(flight_id);
    if context.settings.compatibility.fault == OnFault::Refuse && findings.has_required_fault() {
        return Err(joined(&faults, flight_id));
    }
    Ok(faults)
}

/// A channel with its name and the statistics of its conditioning.
type ReadChannel<'a> = (&'a str, &'a Channel, ChannelStatistics);

/// Conditioned channels of a stretch, sorted by use.
struct Recording<'a> {
    channels: Vec<ReadChannel<'a>>,
    /// Block means by signal, of channels that a relation uses.
    block_means: BTreeMap<String, BlockAverager>,
    problems: Vec<Problem>,
    stand_ins: Vec<(String, StandIn)>,
    signature: Signature,
}

impl<'a> Recording<'a> {
    fn of(
        stretch: &Stretch,
        conditioned: Vec<ConditionedChannel<'a>>,
        context: &Context,
    ) -> Result<Recording<'a>, Problem> {
        let (flight_id, clock) = (stretch.flight_id.as_str(), &stretch.clock);
        let (mut channels, mut problems, mut empty) = (Vec::new(), Vec::new(), Vec::new());
        let mut block_means = BTreeMap::new();
        let mut signature_samples = Vec::new();
        for one in conditioned {
            let (name, channel, statistics) = (one.name, one.channel, one.statistics);
            if statistics.count(Mark::Missing) == clock.samples {
                let refusal = empty_channel(name, channel, clock.rows);
                empty.push((channel.signal.as_str(), refusal));
            } else {
                let stuck = stuck_channel(name, &statistics, clock);
                let beyond = values_beyond(name, channel, &statistics, clock);
                let named = stuck.into_iter().chain(beyond);
                problems.extend(named.map(|refusal| refusal.into_problem(flight_id)));
                block_means.extend(one.block_means.map(|means| (channel.signal.clone(), means)));
                // The turns of an unwrapped angle depend on where the record begins.
                if statistics.wraps == 0 && channel.wraps_at.is_none() {
                    signature_samples.push(one.signature_samples);
                }
            }
            channels.push((name, channel, statistics));
        }
        let is_recorded = |signal: &str| {
            let mut recorded = channels
                .iter()
                .map(|(_, channel, _)| channel.signal.as_str());
            recorded.any(|s| s == signal) && !empty.iter().any(|(s, _)| *s == signal)
        };
        let stand_ins = match context.stand_ins(is_recorded) {
            Ok(stand_ins) => stand_ins,
            Err(signal) => return Err(refused_signal(signal, empty).into_problem(flight_id)),
        };
        problems.extend(empty.into_iter().map(|(signal, refusal)| {
            let refusal = refusal.with_stand_in(signal, &stand_ins);
            refusal.into_problem(flight_id)
        }));
        Ok(Recording {
            channels,
            block_means,
            problems,
            stand_ins,
            signature: Signature::of(signature_samples.into_iter()),
        })
    }
}

/// Refusal of a required signal that can have no stand-in, at its empty channel if it has one.
fn refused_signal(signal: &str, empty: Vec<(&str, Refusal)>) -> Refusal {
    let own = empty.into_iter().find(|(name, _)| *name == signal);
    own.map_or_else(|| missing_signal(signal), |(_, refusal)| refusal)
}

/// Inputs of the relation checks and of flight-path reconstruction.
struct Examination<'a> {
    clock: &'a Clock,
    context: &'a Context<'a>,
    /// Signals that come from channels.
    recorded: Vec<String>,
    stand_ins: &'a [(String, StandIn)],
    read: &'a RecordReader<'a>,
}

impl Examination<'_> {
    /// Block means of the recorded signals and of the constants.
    fn blocks(&self, mut means: BTreeMap<String, BlockAverager>) -> BlockMeans {
        let (clock, checks) = (self.clock, &self.context.settings.checks);
        for (signal, value) in self.context.constants {
            let constant =
                BlockAverager::constant(signal, *value, clock.samples, clock.step_s, checks);
            if let Some(constant) = constant {
                means.entry(signal.clone()).or_insert(constant);
            }
        }
        BlockMeans::of(means, clock.samples, clock.step_s, checks)
    }

    /// Reconciles the relations between channels with the errors of the instruments.
    ///
    /// If a channel has a wrong sign or unit, the errors of the other instruments are estimated
    /// with the channel corrected; the record is left as it is. If no sign and no unit explains a
    /// failed relation, a delay may: if the relation holds once the delays are removed, the delay
    /// is the fault.
    fn reconcile(&self, blocks: &BlockMeans) -> (RelationResult, Findings) {
        let relations = self.check(blocks);
        if !relations.impossible.is_empty() {
            return (relations, Findings::default());
        }
        let faulty = &relations.faulty;
        if !faulty.is_empty() && faulty.iter().all(FaultyChannel::is_correctable) {
            let findings = self.reconstruct(|record| correct_by_factors(record, faulty));
            return (relations, findings.without_corrections());
        }
        // With a dead channel or with one fault among several there is nothing to go by.
        if !faulty.is_empty() && !faulty.iter().any(|f| signal::is_indispensable(&f.signal)) {
            let findings = self.reconstruct(|record| leave_out(record, faulty));
            return (relations, findings);
        }
        if faulty.iter().any(|f| f.cause.is_some()) {
            return (relations, Findings::default());
        }
        let findings = self.reconstruct(|_| ());
        if relations.report.is_none() {
            return (relations, findings);
        }
        if findings.has_fault() {
            let corrected = blocks.corrected(&findings.with_faults_corrected().corrections());
            let again = self.check(&corrected);
            if again.report.is_none() {
                return (again, findings);
            }
        }
        (relations, Findings::default())
    }

    /// Finds signals with values that no aircraft has. The mass is checked only if no relation
    /// finds a fault in the other signals of the lift.
    fn impossible(&self, blocks: &BlockMeans, faulty: &[FaultyChannel]) -> Vec<ImpossibleSignal> {
        const LIFT: [&str; 4] = [
            signal::AN,
            signal::ALPHA_VANE,
            signal::QBAR,
            signal::VELOCITY,
        ];
        let Context {
            channels,
            aircraft,
            settings,
            ..
        } = *self.context;
        let mut found = impossible_signals(blocks);
        found.extend(impossible_centre(blocks, aircraft));
        found.extend(impossible_velocity(blocks, &settings.checks));
        if !found.is_empty() || faulty.iter().any(|f| LIFT.contains(&f.signal.as_str())) {
            return found;
        }
        let mass = channels.values().find(|c| c.signal == signal::MASS);
        let unit = mass.map(|channel| channel.unit.as_str());
        impossible_mass(blocks, aircraft, unit, &settings.checks)
            .or_else(|| impossible_gyration(blocks, aircraft))
            .into_iter()
            .collect()
    }

    /// Checks the kinematic relations and isolates the faulty channels. A wrong time fails the
    /// relations of every channel; no channel is then named.
    fn check(&self, blocks: &BlockMeans) -> RelationResult {
        let Context {
            channels,
            aircraft,
            settings,
            ..
        } = *self.context;
        let (checks, gusts) = check_relations(blocks, aircraft, &settings.checks);
        if let Some(time) = wrong_time(&checks) {
            return RelationResult {
                confirmed: Vec::new(),
                report: None,
                checks,
                gusts,
                faulty: Vec::new(),
                impossible: vec![time],
            };
        }
        let faulty = find_faulty_channels(
            blocks,
            &checks,
            channels,
            &self.recorded,
            aircraft,
            &settings.checks,
        );
        RelationResult {
            confirmed: confirmed_signals(&checks),
            report: report(&faulty, &checks),
            checks,
            gusts,
            faulty,
            impossible: Vec::new(),
        }
    }

    /// Estimates the instruments' errors by flight-path reconstruction, part by part of the
    /// record, each part after `correct`.
    fn reconstruct(&self, correct: impl Fn(&mut Record)) -> Findings {
        let samples = self.clock.samples;
        let count = samples.div_ceil(PART_SAMPLES);
        let signals = compatibility::signals();
        let parts = (0..count).filter_map(|i| {
            let range = i * PART_SAMPLES..((i + 1) * PART_SAMPLES).min(samples);
            let mut record = (self.read)(&signals, range)?;
            for (signal, stand_in) in self.stand_ins {
                stand_in.fill(signal, &mut record);
            }
            correct(&mut record);
            Some(record)
        });
        compatibility::examine(
            parts,
            count,
            self.context.channels,
            &self.recorded,
            self.context.aircraft,
            &self.context.settings.compatibility,
        )
    }
}

/// Multiplies the signals of faulty channels by the factors that correct them.
fn correct_by_factors(record: &mut Record, faulty: &[FaultyChannel]) {
    for fault in faulty {
        let series = record.signals.get_mut(&fault.signal);
        if let (Some(factor), Some(series)) = (fault.factor, series) {
            series.values.iter_mut().for_each(|v| *v *= factor);
        }
    }
}

/// Removes the signals of faulty channels.
fn leave_out(record: &mut Record, faulty: &[FaultyChannel]) {
    record
        .signals
        .retain(|name, _| !faulty.iter().any(|f| f.signal == *name));
}

/// Outcome of the kinematic relations of one stretch.
struct RelationResult {
    checks: Vec<Check>,
    gusts: Gusts,
    faulty: Vec<FaultyChannel>,
    /// Signals that a relation confirms.
    confirmed: Vec<&'static str>,
    report: Option<FaultReport>,
    /// Signals with values that no aircraft has, unless they refuse the flight.
    impossible: Vec<ImpossibleSignal>,
}

impl RelationResult {
    fn check_rows(&self, flight_id: &str) -> Vec<CheckRow> {
        self.checks.iter().map(|c| c.row(flight_id)).collect()
    }

    fn verdict(&self, signal: &str) -> ChannelVerdict {
        if let Some(one) = self.impossible.iter().find(|one| one.signal == signal) {
            return ChannelVerdict::Fault(one.reason.clone());
        }
        match self.faulty.iter().find(|f| f.signal == signal) {
            Some(fault) => ChannelVerdict::Fault(fault.verdict()),
            None if self.confirmed.contains(&signal) => ChannelVerdict::Ok,
            None => ChannelVerdict::NotChecked,
        }
    }
}

/// Problem of the failed relations, with the instrument faults found besides.
fn relation_problem(
    report: &FaultReport,
    left_out: &[(String, StandIn)],
    findings: &Findings,
    flight_id: &str,
) -> Problem {
    let left_out = left_out
        .iter()
        .fold(String::new(), |words, (signal, stand_in)| {
            let one = format!(". It is left out: `{signal}` {}", stand_in.in_words());
            words + &one
        });
    let besides = findings
        .fault_summary()
        .map(|faults| format!(". Besides, {faults}"))
        .unwrap_or_default();
    let refusal = Refusal {
        place: report.place.clone(),
        reason: format!("{}{left_out}{besides}", report.reason),
    };
    refusal.into_problem(flight_id)
}

/// Faulty channels that a flight can do without, each with its stand-in; empty if the report
/// refuses the stretch.
fn left_out(report: &FaultReport, faulty: &[FaultyChannel]) -> Vec<(String, StandIn)> {
    if report.required {
        return Vec::new();
    }
    let is_faulty = |signal: &str| faulty.iter().any(|f| f.signal == signal);
    let stand_in = |fault: &FaultyChannel| {
        let stand_in = StandIn::of(&fault.signal, |signal| !is_faulty(signal))?;
        Some((fault.signal.clone(), stand_in))
    };
    faulty.iter().filter_map(stand_in).collect()
}

/// One problem that joins the places and reasons of several.
fn joined(problems: &[Problem], flight_id: &str) -> Problem {
    let places: Vec<&str> = problems.iter().map(|p| p.place.as_str()).collect();
    let reasons: Vec<&str> = problems.iter().map(|p| p.reason.as_str()).collect();
    let refusal = Refusal {
        place: places.join(", "),
        reason: reasons.join(". "),
    };
    refusal.into_problem(flight_id)
}

/// Row of the table `flights`.
fn flight_row(stretch: &Stretch, gusts: &Gusts) -> FlightRow {
    let clock = &stretch.clock;
    let [gust_u_ft_s, gust_v_ft_s, gust_w_ft_s] =
        gusts.0.map(|axis| axis.and_then(|axis| axis.rms_ft_s));
    FlightRow {
        flight_id: stretch.flight_id.clone(),
        start_s: clock.start_s,
        duration_s: clock.samples.saturating_sub(1) as f64 * clock.step_s,
        gust_u_ft_s,
        gust_v_ft_s,
        gust_w_ft_s,
    }
}

/// Rows of the table `channels`: one for each channel read and one for the clock, in the order of
/// the channel map.
fn channel_rows(
    stretch: &Stretch,
    channel_map: &BTreeMap<String, Channel>,
    channels: &[ReadChannel],
    relations: &RelationResult,
    findings: &Findings,
) -> Vec<ChannelRow> {
    let of_channel = |(name, channel, statistics): &ReadChannel| {
        let fault = findings.verdict(&channel.signal);
        let verdict =
            fault.map_or_else(|| relations.verdict(&channel.signal), ChannelVerdict::Fault);
        channel_row(stretch, name, channel, statistics, verdict)
    };
    let time = channel_map
        .iter()
        .find(|(_, channel)| channel.signal == signal::TIME)
        .map(|(name, channel)| time_row(stretch, name, channel));
    let mut rows: Vec<ChannelRow> = channels.iter().map(of_channel).chain(time).collect();
    rows.sort_by(|a, b| a.channel.cmp(&b.channel));
    rows
}

fn channel_row(
    stretch: &Stretch,
    name: &str,
    channel: &Channel,
    statistics: &ChannelStatistics,
    verdict: ChannelVerdict,
) -> ChannelRow {
    let clock = &stretch.clock;
    ChannelRow {
        flight_id: stretch.flight_id.clone(),
        channel: name.to_owned(),
        signal: channel.signal.clone(),
        samples: clock.samples,
        rate_hz: Some(1.0 / clock.step_s / statistics.period as f64),
        between: statistics.count(Mark::Between),
        bridged: statistics.count(Mark::Bridged),
        despiked: statistics.count(Mark::Despiked),
        missing: statistics.count(Mark::Missing),
        stuck: statistics.count(Mark::Stuck),
        wraps: statistics.wraps,
        quantisation: statistics.quantisation,
        noise: statistics.noise,
        verdict,
    }
}

/// Row of the clock. A lost frame counts as bridged: its time is one step after the frame before.
fn time_row(stretch: &Stretch, name: &str, channel: &Channel) -> ChannelRow {
    let clock = &stretch.clock;
    let statistics = ChannelStatistics {
        period: 1,
        noise: Some(clock.jitter_s),
        ..ChannelStatistics::default()
    };
    ChannelRow {
        bridged: clock.samples - clock.rows,
        ..channel_row(stretch, name, channel, &statistics, ChannelVerdict::Ok)
    }
}
