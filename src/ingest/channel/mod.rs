//! Second pass over a flight: each channel by itself becomes a conditioned signal.

mod character;
mod column_samples;
mod conditioner;
mod gaps;
mod plan;
mod reader;
mod signature;
mod spikes;

pub(in crate::ingest) use conditioner::ChannelStatistics;
pub use plan::{ChannelPlan, plan_channels};
pub(in crate::ingest) use plan::{empty_channel, stuck_channel};
pub use reader::{ChannelReader, ConditionedChannel};
pub use signature::Signature;
