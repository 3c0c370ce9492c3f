//! Steps and swings of signals, which recognition counts.

pub(super) mod detection;
pub(super) mod hidden_halves;
pub(super) mod step;
pub(super) mod swings;
