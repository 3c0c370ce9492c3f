//! Assessment of a stretch after all of its channels are read: counts, kinematic relations, gusts
//! and instrument errors.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::channel::{
    ChannelStatistics, ConditionedChannel, Signature, channel_with_gaps, empty_channel,
    sparse_channel, stuck_channel, values_beyond,
};
use super::checks::{BlockAverager, FaultReport, Gusts, LiftPoint, lift_curve};
use super::clock::{Clock, Stretch};
use super::compatibility::{ErrorEvidence, Findings, OnFault};
use super::context::Context;
use super::examination::{Examination, Outcome, PART_SAMPLES, RecordReader, RelationResult};
use super::refusal::{Refusal, UnreadChannel};
use super::settings::OnFailedCheck;
use super::table_ends::held_throughout;
use crate::error::Problem;
use crate::flight::stand_in::gap_stand_ins;
use crate::flight::{Channel, Completion, Correction, Mark, StandIn, signal};
use crate::tables::{ChannelRow, ChannelVerdict, CheckRow, FlightRow, InstrumentRow};

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
    /// Stand-ins of the signals that the stretch lacks, and in gaps of others.
    pub completion: Completion,
    pub problems: Vec<Problem>,
    /// Normal force over angle of attack, for the comparison with the tunnel.
    pub lift: Vec<LiftPoint>,
    /// Signature of the samples, by which repeated rows are found.
    pub signature: Signature,
}

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
    let mut recording = Recording::of(stretch, channels, context, read)?;
    let mut problems = std::mem::take(&mut recording.problems);
    let examination = Examination {
        clock: &stretch.clock,
        context,
        recorded: std::mem::take(&mut recording.recorded),
        completion: std::mem::take(&mut recording.completion),
        read,
    };
    let blocks = examination.blocks(std::mem::take(&mut recording.block_means));
    let channels = recording.channels.iter();
    let at_ends = channels.filter_map(|(name, channel, _)| held_throughout(name, channel, &blocks));
    problems.extend(at_ends.map(|refusal| refusal.into_problem(flight_id)));
    let outcome = examination.examine(blocks);
    let Outcome {
        relations,
        findings,
        left_out,
        ..
    } = &outcome;
    let left_out = left_out.iter().map(|one| one.refusal.clone());
    problems.extend(left_out.map(|refusal| refusal.into_problem(flight_id)));
    problems.extend(impossible_values(relations, context, flight_id)?);
    if let Some(report) = &relations.report {
        let problem = relation_problem(report, findings, flight_id);
        if context.settings.on_failed_check == OnFailedCheck::Refuse {
            return Err(problem);
        }
        problems.push(problem);
    }
    problems.extend(instrument_faults(findings, context, flight_id)?);
    Ok(Assessment {
        flight: Some(flight_row(stretch, &relations.gusts)),
        channels: channel_rows(stretch, context.channels, &recording.channels, &outcome),
        checks: relations.check_rows(flight_id),
        instruments: findings.rows(flight_id),
        error_evidence: findings.evidence(),
        corrections: findings.corrections(),
        problems,
        lift: lift_curve(&outcome.blocks, context.aircraft, &context.settings.checks),
        completion: outcome.completion,
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
    /// Signals with values.
    recorded: Vec<String>,
    problems: Vec<Problem>,
    completion: Completion,
    signature: Signature,
}

impl<'a> Recording<'a> {
    fn of(
        stretch: &Stretch,
        conditioned: Vec<ConditionedChannel<'a>>,
        context: &Context,
        read: &RecordReader,
    ) -> Result<Recording<'a>, Problem> {
        let (flight_id, clock) = (stretch.flight_id.as_str(), &stretch.clock);
        let (mut channels, mut problems, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
        let mut block_means = BTreeMap::new();
        let mut signature_samples = Vec::new();
        let signals: Vec<&str> = conditioned
            .iter()
            .map(|one| one.channel.signal.as_str())
            .collect();
        let is_replaceable = |signal: &str| {
            let is_other = |name: &str| name != signal && signals.contains(&name);
            signal::REQUIRED.contains(&signal) && context.can_do_without(signal, is_other)
        };
        // The clock also runs while the recorder is off.
        let written = conditioned.iter().map(|one| with_value(&one.statistics));
        let written = written.max().unwrap_or(0);
        for one in conditioned {
            let (name, channel, statistics) = (one.name, one.channel, one.statistics);
            let signal = channel.signal.as_str();
            if statistics.count(Mark::Missing) == clock.samples {
                left_out.push(UnreadChannel {
                    signal,
                    refusal: empty_channel(name, channel, clock.rows),
                    is_absent: true,
                });
            } else if is_replaceable(signal) && 2 * with_value(&statistics) < written {
                let share = with_value(&statistics) as f64 / written as f64;
                left_out.push(UnreadChannel {
                    signal,
                    refusal: sparse_channel(name, channel, share),
                    is_absent: false,
                });
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
        let recorded = channels
            .iter()
            .map(|(_, channel, _)| channel.signal.clone());
        let recorded = recorded.filter(|signal| !left_out.iter().any(|one| one.signal == signal));
        let recorded: Vec<String> = recorded.collect();
        let is_recorded = |signal: &str| recorded.iter().any(|s| s == signal);
        let stand_ins = match context.stand_ins(is_recorded) {
            Ok(stand_ins) => stand_ins,
            Err(signals) => {
                let refusal = Refusal::of_signals(&signals, left_out);
                return Err(refusal.into_problem(flight_id));
            }
        };
        let left_out = left_out.into_iter();
        problems.extend(left_out.map(|one| one.into_problem(&stand_ins, flight_id)));
        let (gaps, filled) = fill_gaps(&channels, &recorded, clock, (context, read));
        let filled = filled.into_iter();
        problems.extend(filled.map(|one| one.into_problem(&gaps, flight_id)));
        Ok(Recording {
            channels,
            block_means,
            recorded,
            problems,
            completion: Completion { stand_ins, gaps },
            signature: Signature::of(signature_samples.into_iter()),
        })
    }
}

/// Number of samples in gaps of a channel, without those of lost frames, which all channels lack.
fn gap_samples(statistics: &ChannelStatistics, clock: &Clock) -> usize {
    let lost = clock.samples.saturating_sub(clock.rows);
    statistics.absent.saturating_sub(lost)
}

/// Stand-ins in the gaps of recorded channels, and the report of each channel that has one.
fn fill_gaps<'r>(
    channels: &'r [ReadChannel],
    recorded: &[String],
    clock: &Clock,
    (context, read): (&Context, &RecordReader),
) -> (Vec<(String, StandIn)>, Vec<UnreadChannel<'r>>) {
    let is_recorded = |signal: &str| recorded.iter().any(|name| name == signal);
    let with_gaps: Vec<UnreadChannel> = channels
        .iter()
        .map(|(name, channel, statistics)| (name, channel, gap_samples(statistics, clock)))
        .filter(|(_, channel, gap)| *gap > 0 && is_recorded(&channel.signal))
        .map(|(name, channel, gap)| UnreadChannel {
            signal: &channel.signal,
            refusal: channel_with_gaps(name, channel, gap, clock),
            is_absent: true,
        })
        .collect();
    let signals: Vec<&str> = with_gaps.iter().map(|one| one.signal).collect();
    let is_complete = |signal: &str| {
        is_recorded(signal) && !signals.contains(&signal) || context.constants.contains_key(signal)
    };
    let mean = |signal: &str| mean_value(signal, clock.samples, read);
    let gaps = gap_stand_ins(&signals, is_complete, mean);
    let mut filled = with_gaps;
    filled.retain(|one| gaps.iter().any(|(signal, _)| signal == one.signal));
    (gaps, filled)
}

/// Mean of the samples of a signal with a value; `None` without any.
fn mean_value(signal: &str, samples: usize, read: &RecordReader) -> Option<f64> {
    let signals = BTreeSet::from([signal.to_owned()]);
    let (mut sum, mut count) = (0.0, 0_usize);
    for first in (0..samples).step_by(PART_SAMPLES) {
        let part = read(&signals, first..(first + PART_SAMPLES).min(samples))?;
        for value in part.values(signal)?.iter().filter(|v| v.is_finite()) {
            sum += value;
            count += 1;
        }
    }
    (count > 0).then(|| sum / count as f64)
}

/// Number of samples of a channel that have a value.
fn with_value(statistics: &ChannelStatistics) -> usize {
    let kept = [Mark::Measured, Mark::Bridged, Mark::Despiked, Mark::Between];
    kept.map(|mark| statistics.count(mark)).iter().sum()
}

/// Problem of the failed relations, with the instrument faults found besides.
fn relation_problem(report: &FaultReport, findings: &Findings, flight_id: &str) -> Problem {
    let besides = findings
        .fault_summary()
        .map(|faults| format!(". Besides, {faults}"))
        .unwrap_or_default();
    let refusal = Refusal {
        place: report.place.clone(),
        reason: format!(
            "{}. Correct the channel map, or leave the flight out{besides}",
            report.reason
        ),
    };
    refusal.into_problem(flight_id)
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
    outcome: &Outcome,
) -> Vec<ChannelRow> {
    let of_channel = |(name, channel, statistics): &ReadChannel| {
        let verdict = outcome.verdict(&channel.signal);
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
