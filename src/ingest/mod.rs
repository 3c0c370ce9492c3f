//! Ingest: a flight as recorded becomes records of signals, each on one uniform clock, with every
//! repaired sample flagged. The units and signs of its channels are checked against the kinematic
//! equations, and its instruments' errors are estimated from them.
//!
//! A flight is read twice. The first pass reads the time channels alone ([`survey`]) and returns
//! the flight's stretches with their clocks. The second pass reads each channel by itself, piece by
//! piece ([`ChannelReader`]). Memory does not grow with the length of a flight. Exceptions are the
//! clock's list of runs and the block means that the kinematic relations compare ([`assess`]).

// Inputs: configuration, columns of the files, reasons for a refusal.
mod settings;
mod refusal;
mod context;
mod column_source;
mod computed_columns;

// The two passes: the clock, then each channel.
mod clock;
mod channel;

// A stretch whose channels are read: checks, instruments' errors, results.
mod checks;
pub mod compatibility;
mod table_ends;
mod examination;
mod conditioned_stretch;
mod assessment_rows;
mod assessment;

// All of it for a flight in memory.
mod in_memory;

#[cfg(test)]
mod tests;

pub use assessment::{Assessment, assess};
pub use channel::{
    ChannelPlan, ChannelReader, ConditionedChannel, Overlap, Signature, plan_channels,
};
pub use checks::LiftPoint;
pub use clock::{Clock, Stretch, Survey, check_clocks, survey};
pub use column_source::ColumnSource;
pub use compatibility::{Compatibility, ErrorEvidence, correction};
pub use computed_columns::ComputedColumns;
pub use context::Context;
pub use in_memory::{Ingested, record, records};
pub use refusal::Refusal;
pub use settings::{Checks, Excitation, OnFailedCheck, Settings, Spikes, Stuck};
