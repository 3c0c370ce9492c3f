//! Errors that the flights of one recorder have in common.
//!
//! The flights draw the error of an instrument from one distribution: a mean that belongs to the
//! recorder, and a scatter between flights. A flight that hardly determines an error takes it from
//! the other flights. A flight far from the others is reported, and never corrected by the others'
//! error.
//!
//! 1. [`error_series`]: one error of one instrument over the flights.
//! 2. [`common_error`]: mean, scatter, and flights far from the others.
//! 3. [`history`]: steps and drifts in the order of the flights.
//! 4. [`instrument_trends`]: rows of the table `instrument_trends`, and problems.
//! 5. [`flight_corrections`]: corrections of flights by the errors of the others.

mod error_series;
mod common_error;
mod history;
mod instrument_trends;
mod flight_corrections;
#[cfg(test)]
mod fixture;

pub use error_series::{ErrorSample, ErrorSeries, instrument_series};
pub use flight_corrections::{FlightCorrections, apply_common_verdicts, correct_flights};
pub use instrument_trends::{ExaminedSeries, examine};
