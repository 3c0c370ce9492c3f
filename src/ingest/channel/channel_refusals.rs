//! Refusals and reports of channels whose values cannot be used, in words.

use super::channel_statistics::{ChannelStatistics, LARGEST};
use crate::flight::Channel;
use crate::ingest::clock::Clock;
use crate::ingest::refusal::Refusal;
use crate::units::Unit;

/// Largest number of stuck intervals of a channel that a message names by their times.
const NAMED_INTERVALS: usize = 3;

/// Refusal of a channel that is in the files and never has a value.
pub fn empty_channel(name: &str, channel: &Channel, rows: usize) -> Refusal {
    let reason = format!(
        "channel `{name}` (signal `{}`) holds no number in {rows} rows",
        channel.signal
    );
    Refusal::of_channel(name, reason)
}

/// Refusal of a channel that has no value in most of the samples in which the recorder was on; `share` of
/// them have one.
pub fn sparse_channel(name: &str, channel: &Channel, share: f64) -> Refusal {
    let reason = format!(
        "channel `{name}` (signal `{}`) has a value in {:.1} % of the recorded samples only, and is left out",
        channel.signal,
        100.0 * share
    );
    Refusal::of_channel(name, reason)
}

/// Report of a channel whose gaps a stand-in fills.
pub fn channel_with_gaps(
    name: &str,
    channel: &Channel,
    gap_samples: usize,
    clock: &Clock,
) -> Refusal {
    let seconds = |samples: usize| samples as f64 * clock.step_s;
    let reason = format!(
        "channel `{name}` (signal `{}`) has no value in {:.1} of {:.1} s. A stand-in takes its place in every maneuver \
         that such a gap touches",
        channel.signal,
        seconds(gap_samples),
        seconds(clock.samples),
    );
    Refusal::of_channel(name, reason)
}

/// Report of the intervals in which a channel is stuck; `None` if it never is.
pub fn stuck_channel(name: &str, statistics: &ChannelStatistics, clock: &Clock) -> Option<Refusal> {
    if statistics.stuck.is_empty() {
        return None;
    }
    let from_to = |&(from, to): &(usize, usize)| {
        format!(
            "from {:.1} s to {:.1} s",
            clock.time_s(from),
            clock.time_s(to.saturating_sub(1))
        )
    };
    let stuck = &statistics.stuck;
    let named: Vec<String> = stuck.iter().take(NAMED_INTERVALS).map(from_to).collect();
    let more = match stuck.len().saturating_sub(NAMED_INTERVALS) {
        0 => String::new(),
        more => format!(" and {more} times more"),
    };
    let reason = format!(
        "its value is stuck {}{more}: noise changed it before, and then nothing; it is left out \
         there",
        named.join(", ")
    );
    Some(Refusal::of_channel(name, reason))
}

/// Refusal of the samples of a channel whose size exceeds any measurement; `None` without any.
#[must_use]
pub fn values_beyond(
    name: &str,
    channel: &Channel,
    statistics: &ChannelStatistics,
    clock: &Clock,
) -> Option<Refusal> {
    let first_s = clock.time_s(statistics.first_beyond?);
    let unit = Unit::of_signal(&channel.signal).name;
    let reason = format!(
        "{} samples are beyond {LARGEST:e} {unit}, which no aircraft has, the first at {first_s:.3} s; \
         they count as missing",
        statistics.beyond
    );
    Some(Refusal::of_channel(name, reason))
}

/// Fill values of a channel, which count as missing; `None` without any.
#[must_use]
pub fn fill_values(name: &str, statistics: &ChannelStatistics, clock: &Clock) -> Option<Refusal> {
    let (sample, value) = statistics.first_fill?;
    let reason = format!(
        "{} samples are fill values such as {value}, the first at {:.3} s; they count as missing",
        statistics.fills,
        clock.time_s(sample)
    );
    Some(Refusal::of_channel(name, reason))
}

/// Refusal of a second channel of a signal.
pub fn duplicate_signal(name: &str, channel: &Channel) -> Refusal {
    let reason = format!(
        "channel `{name}` and another one are both mapped to signal `{}`",
        channel.signal
    );
    Refusal::of_channel(name, reason)
}
