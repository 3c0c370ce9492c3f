//! A flight as recorded (channels) and as conditioned (signals on one clock).

pub mod absence;
pub mod channel;
pub mod correction;
pub mod fill_value;
pub mod formula;
pub mod interpolation_kernel;
pub mod linear_table;
pub mod record;
mod remaining_errors;
pub mod signal;
pub mod stand_in;

pub use channel::{Channel, RawFlight};
pub use correction::Correction;
pub use formula::Formula;
pub use linear_table::LinearTable;
pub use record::{Mark, Record};
pub use remaining_errors::{RemainingError, RemainingErrors};
pub use stand_in::{Completion, StandIn};

/// `true` if an id is a flight's own or that of one of its stretches.
#[must_use]
pub fn is_stretch(id: &str, flight_id: &str) -> bool {
    let rest = id.strip_prefix(flight_id);
    rest.is_some_and(|r| {
        r.is_empty()
            || r.strip_prefix('.')
                .is_some_and(|n| n.parse::<usize>().is_ok())
    })
}
