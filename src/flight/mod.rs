//! A flight as recorded (channels) and as meant (signals on one clock).

pub mod channel;
pub mod correction;
pub mod record;
pub mod signal;
pub mod taps;

pub use channel::{Channel, RawFlight};
pub use correction::Correction;
pub use record::{Mark, Record};
