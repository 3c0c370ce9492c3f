//! A flight as recorded (channels) and as meant (signals on one clock).

pub mod channel;
pub mod record;
pub mod signal;

pub use channel::{Channel, RawFlight};
pub use record::{Mark, Record};
