//! The standard case: one longitudinal maneuver by which estimators are timed against each other.

mod case_file;
mod case;
mod timing;

pub use case::{StandardCase, load};
pub use timing::{TimedBatch, TimedCase, batch, timed};
