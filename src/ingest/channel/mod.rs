//! Second pass over a flight: each channel by itself becomes a conditioned signal.

mod channel_plan;
mod channel_reader;
mod channel_refusals;
mod channel_statistics;
mod character;
mod column_samples;
mod conditioner;
mod gaps;
mod quantisation;
mod repeats;
mod signature;
mod spell_characters;
mod spikes;
mod unwrap;
mod update_rate;

pub use channel_plan::{ChannelPlan, plan_channels};
pub use channel_reader::{ChannelReader, ConditionedChannel};
pub(in crate::ingest) use channel_refusals::{
    channel_with_gaps, empty_channel, fill_values, sparse_channel, stuck_channel, values_beyond,
};
pub(in crate::ingest) use channel_statistics::ChannelStatistics;
pub use signature::{Overlap, Signature};
