//! Delays and signs of the surfaces, which no kinematic equation has.
//!
//! The equations of motion have them: a surface that is recorded late by τ turns its phase by ω τ
//! against the accelerations that it causes, and one of reversed sign acts against the wind tunnel.
//! Both follow from equation error in the frequency domain, which is linear and integrates nothing.
//!
//! 1. [`fourier`] transforms the tapered series of a maneuver within a band of frequencies.
//! 2. [`maneuver_data`] lays out a maneuver: implied coefficients and regressors.
//! 3. [`weighted_fit`] fits derivatives with the residuals' own spectrum as weights.
//! 4. [`evidence`] is what a maneuver contributes: its information on the delays, and its surfaces'
//!    effects against the tunnel's.
//! 5. [`delays`] combines maneuvers of a flight, and flights of a campaign; [`flight`] repeats it, as
//!    the phases are linearised about the delays.
//! 6. [`correction`] decides which delays are corrected, and what stays unknown.
//! 7. [`findings`] makes rows of the table `instruments`, and names reversed signs.

mod settings;
mod fourier;
mod maneuver_data;
mod weighted_fit;
mod evidence;
mod delays;
mod flight;
mod correction;
mod findings;

pub use correction::{DelayCorrection, corrections};
pub use delays::of_campaign;
pub use evidence::FlightEvidence;
pub use findings::{delay_series, findings};
pub use flight::flight_evidence;
pub use maneuver_data::AircraftModel;
pub use settings::Settings;
