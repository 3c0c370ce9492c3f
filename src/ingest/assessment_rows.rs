//! Rows of the tables `flights` and `channels` for one stretch.

use std::collections::BTreeMap;

use super::channel::ChannelStatistics;
use super::checks::Gusts;
use super::clock::Stretch;
use super::conditioned_stretch::ReadChannel;
use super::examination::Outcome;
use crate::flight::{Channel, Mark, signal};
use crate::tables::{ChannelRow, ChannelVerdict, FlightRow};

/// Row of the table `flights`.
pub fn flight_row(stretch: &Stretch, gusts: &Gusts) -> FlightRow {
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
pub fn channel_rows(
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

/// Row of a channel.
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
