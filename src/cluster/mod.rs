//! Campaigns on a cluster: work dealt to shards, and scripts for a batch scheduler.
//!
//! The work itself depends on no scheduler. A [`plan::ShardPlan`] fixes the items, their shards, and the
//! lineage of input, configuration and code. A shard computes its share into the store, any number
//! of times. A merge publishes when nothing is missing ([`shard`]). Placement, retries, lost nodes
//! and queues are left to the scheduler ([`scripts`]).

pub mod plan;
pub mod scripts;
pub mod shard;
