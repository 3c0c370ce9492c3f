//! First pass over a flight: its time channels become stretches, each on a uniform clock.

mod duplicates;
mod merge;
mod pieces;
mod sample_clock;
mod stream;
mod survey;
mod time_channels;

#[cfg(test)]
mod tests;

pub use sample_clock::Clock;
pub(in crate::ingest) use sample_clock::Run;
pub use survey::{Stretch, Survey, check_clocks, survey};
