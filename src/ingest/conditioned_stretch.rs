//! Conditioned channels of a stretch, sorted by use: those that are left out, stand-ins of missing
//! signals and in gaps, and reports of repaired samples.

use std::collections::{BTreeMap, BTreeSet};

use super::channel::{
    ChannelStatistics, ConditionedChannel, Signature, channel_with_gaps, empty_channel,
    fill_values, sparse_channel, stuck_channel, values_beyond,
};
use super::checks::BlockAverager;
use super::clock::{Clock, Stretch};
use super::context::Context;
use super::examination::{PART_SAMPLES, RecordReader};
use super::refusal::{Refusal, UnreadChannel};
use crate::error::{Problem, ProblemStage};
use crate::flight::stand_in::gap_stand_ins;
use crate::flight::{Channel, Completion, Mark, StandIn, signal};

/// A channel with its name and the statistics of its conditioning.
pub type ReadChannel<'a> = (&'a str, &'a Channel, ChannelStatistics);

/// Conditioned channels of a stretch, sorted by use.
pub struct ConditionedStretch<'a> {
    pub channels: Vec<ReadChannel<'a>>,
    /// Block means by signal, of channels that a relation uses.
    pub block_means: BTreeMap<String, BlockAverager>,
    /// Signals with values.
    pub recorded: Vec<String>,
    pub problems: Vec<Problem>,
    pub completion: Completion,
    pub signature: Signature,
}

impl<'a> ConditionedStretch<'a> {
    /// Sorts the conditioned channels of a stretch.
    ///
    /// # Errors
    /// A problem that refuses the stretch: a required channel without any number.
    pub fn of(
        stretch: &Stretch,
        conditioned: Vec<ConditionedChannel<'a>>,
        context: &Context,
        read: &RecordReader,
    ) -> Result<ConditionedStretch<'a>, Problem> {
        let flight_id = stretch.flight_id.as_str();
        let SortedChannels {
            channels,
            left_out,
            block_means,
            signature,
            mut problems,
        } = SortedChannels::sort(stretch, conditioned, context);
        let recorded: Vec<String> = channels
            .iter()
            .map(|(_, channel, _)| channel.signal.clone())
            .filter(|signal| !left_out.iter().any(|unread| unread.signal == signal))
            .collect();
        let is_recorded = |signal: &str| recorded.iter().any(|s| s == signal);
        let stand_ins = match context.stand_ins(is_recorded) {
            Ok(stand_ins) => stand_ins,
            Err(signals) => {
                let refusal = Refusal::of_signals(&signals, left_out);
                return Err(refusal.into_problem(flight_id));
            }
        };
        let left_out = left_out.into_iter();
        problems.extend(left_out.map(|unread| unread.into_problem(&stand_ins, flight_id)));
        let (gaps, reports) = fill_gaps(&channels, &recorded, &stretch.clock, context, read);
        let reports = reports.into_iter();
        problems.extend(reports.map(|report| report.into_problem(&gaps, flight_id)));
        Ok(ConditionedStretch {
            channels,
            block_means,
            recorded,
            problems,
            completion: Completion { stand_ins, gaps },
            signature,
        })
    }
}

/// Conditioned channels, those that are left out, and what the others give.
struct SortedChannels<'a, 'u> {
    channels: Vec<ReadChannel<'a>>,
    left_out: Vec<UnreadChannel<'u>>,
    block_means: BTreeMap<String, BlockAverager>,
    signature: Signature,
    /// Reports of repaired samples.
    problems: Vec<Problem>,
}

impl<'a> SortedChannels<'a, 'a> {
    fn sort(
        stretch: &Stretch,
        conditioned: Vec<ConditionedChannel<'a>>,
        context: &Context,
    ) -> SortedChannels<'a, 'a> {
        let (flight_id, clock) = (stretch.flight_id.as_str(), &stretch.clock);
        let (mut channels, mut problems, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
        let mut block_means = BTreeMap::new();
        let mut signature_samples = Vec::new();
        let unread = unread_channels(&conditioned, clock, context);
        for (conditioned_channel, unread) in conditioned.into_iter().zip(unread) {
            let ConditionedChannel {
                name,
                channel,
                statistics,
                ..
            } = conditioned_channel;
            if let Some(unread) = unread {
                left_out.push(unread);
            } else {
                let repairs = reported_repairs(name, channel, &statistics, clock);
                problems.extend(repairs.map(|refusal| refusal.into_problem(flight_id)));
                let fills = fill_values(name, &statistics, clock);
                problems.extend(fills.map(|r| r.of_stage(ProblemStage::Recording, flight_id)));
                let means = conditioned_channel.block_means;
                block_means.extend(means.map(|means| (channel.signal.clone(), means)));
                // The turns of an unwrapped angle depend on where the record begins.
                if statistics.wraps == 0 && channel.wraps_at.is_none() {
                    signature_samples.push(conditioned_channel.signature_samples);
                }
            }
            channels.push((name, channel, statistics));
        }
        SortedChannels {
            channels,
            left_out,
            block_means,
            signature: Signature::of(signature_samples.into_iter()),
            problems,
        }
    }
}

/// Reports of stuck values and of values beyond any measurement.
fn reported_repairs(
    name: &str,
    channel: &Channel,
    statistics: &ChannelStatistics,
    clock: &Clock,
) -> impl Iterator<Item = Refusal> + use<> {
    let stuck = stuck_channel(name, statistics, clock);
    let beyond = values_beyond(name, channel, statistics, clock);
    stuck.into_iter().chain(beyond)
}

/// Reason to leave out a channel before any check, for each channel. It has no value, or most of
/// its values are missing and a stand-in replaces it.
fn unread_channels<'a>(
    conditioned: &[ConditionedChannel<'a>],
    clock: &Clock,
    context: &Context,
) -> Vec<Option<UnreadChannel<'a>>> {
    let is_replaceable = |signal: &str| {
        let is_other = |name: &str| {
            let mut signals = conditioned.iter().map(|c| c.channel.signal.as_str());
            name != signal && signals.any(|other| other == name)
        };
        signal::REQUIRED.contains(&signal) && context.can_do_without(signal, is_other)
    };
    // The clock also runs while the recorder is off.
    let written = conditioned.iter().map(|c| with_value(&c.statistics));
    let most_written = written.max().unwrap_or(0);
    let unread = |conditioned: &ConditionedChannel<'a>| {
        let (name, channel) = (conditioned.name, conditioned.channel);
        let is_absent = conditioned.statistics.count(Mark::Missing) == clock.samples;
        let values = with_value(&conditioned.statistics);
        let refusal = if is_absent {
            empty_channel(name, channel, clock.rows)
        } else if is_replaceable(&channel.signal) && 2 * values < most_written {
            sparse_channel(name, channel, values as f64 / most_written as f64)
        } else {
            return None;
        };
        Some(UnreadChannel {
            signal: &channel.signal,
            refusal,
            is_absent,
        })
    };
    conditioned.iter().map(unread).collect()
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
    context: &Context,
    read: &RecordReader,
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
    let signals: Vec<&str> = with_gaps.iter().map(|channel| channel.signal).collect();
    let is_complete = |signal: &str| {
        is_recorded(signal) && !signals.contains(&signal) || context.constants.contains_key(signal)
    };
    let moments = |signal: &str| mean_and_deviation(signal, clock.samples, read);
    let gaps = gap_stand_ins(&signals, is_complete, moments);
    let mut reports = with_gaps;
    reports.retain(|channel| gaps.iter().any(|(signal, _)| signal == channel.signal));
    (gaps, reports)
}

/// Mean and standard deviation of the samples of a signal with a value; `None` without any.
fn mean_and_deviation(signal: &str, samples: usize, read: &RecordReader) -> Option<(f64, f64)> {
    let signals = BTreeSet::from([signal.to_owned()]);
    let sum = |term: &dyn Fn(f64) -> f64| {
        let (mut sum, mut count) = (0.0, 0_usize);
        for first in (0..samples).step_by(PART_SAMPLES) {
            let part = read(&signals, first..(first + PART_SAMPLES).min(samples))?;
            for value in part.values(signal)?.iter().filter(|v| v.is_finite()) {
                sum += term(*value);
                count += 1;
            }
        }
        (count > 0).then(|| sum / count as f64)
    };
    let mean = sum(&|value| value)?;
    let variance = sum(&|value| (value - mean).powi(2))?;
    Some((mean, variance.sqrt()))
}

/// Number of samples of a channel that have a value.
fn with_value(statistics: &ChannelStatistics) -> usize {
    let kept = [Mark::Measured, Mark::Bridged, Mark::Despiked, Mark::Between];
    kept.map(|mark| statistics.count(mark)).iter().sum()
}
