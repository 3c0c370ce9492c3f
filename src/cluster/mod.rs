//! Past one machine: a campaign's work dealt to shards, and the scripts that give them to a batch
//! scheduler.
//!
//! The contract knows no scheduler. A [`plan::Plan`] fixes what is to be computed, from which
//! input, configuration and code, and which shard computes it; a shard computes its share into the
//! store, as often as it is told to; a merge publishes when nothing is missing. Placement, retries,
//! lost nodes and queues are the scheduler's ([`scripts`]).

pub mod plan;
pub mod scripts;
pub mod shard;
