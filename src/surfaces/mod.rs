//! Delays and signs of the surfaces, which appear in no kinematic equation.
//!
//! They follow from the equations of motion. A surface that is recorded late by τ has its phase
//! turned by ω τ relative to the accelerations that it causes. A surface of reversed sign has
//! effects opposite to the wind tunnel's. Both are estimated by equation error in the frequency
//! domain, which is linear and needs no integration.
//!
//! 1. [`fourier`] transforms the tapered series of a maneuver within a band of frequencies.
//! 2. [`maneuver_data`] prepares a maneuver: implied coefficients and regressors.
//! 3. [`weighted_fit`] fits derivatives with the residuals' own spectrum as weights.
//! 4. [`evidence`] is the contribution of a maneuver: its information on the delays, and the ratio
//!    of its surfaces' effects to the tunnel's.
//! 5. [`delays`] combines maneuvers of a flight, and flights of a campaign; [`flight`] repeats it,
//!    as the phases are linearised about the delays.
//! 6. [`delay_corrections`] decides which delays are corrected, and with which remaining uncertainty.
//! 7. [`surface_findings`] makes rows of the table `instruments`, and reports reversed signs.

mod settings;
mod fourier;
mod maneuver_data;
mod weighted_fit;
mod evidence;
mod delays;
mod flight;
mod delay_corrections;
mod surface_findings;

pub use delay_corrections::{DelayCorrection, corrections};
pub use delays::of_campaign;
pub use evidence::FlightEvidence;
pub use flight::flight_evidence;
pub use maneuver_data::AircraftModel;
pub use settings::Settings;
pub use surface_findings::{delay_series, findings};
