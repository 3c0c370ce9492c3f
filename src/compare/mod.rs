//! Compare sets flight against the wind tunnel and against earlier campaigns, derivative by
//! derivative.
//!
//! [`tunnel`] compares the trend of each derivative's group, and each maneuver at its own α and Mach
//! number. Where the tunnel has breakpoints inside a trend it is read there alone, else at the
//! trend's α; the Mach number is the mean of the group's maneuvers there. [`earlier_campaign`]
//! compares trends with those of an earlier campaign. A difference is judged by its standard error,
//! z = (flight − tunnel) / √(standard error² + tunnel's uncertainty²), with the tunnel's uncertainty
//! where it states one. [`ranges`] puts verdicts into words; [`extrapolation`] lists where the tunnel
//! was read outside its tables.

pub mod earlier_campaign;
pub mod extrapolation;
mod judgement;
pub mod ranges;
mod settings;
mod tunnel;

pub use settings::Settings;
pub use tunnel::{compare_maneuvers, compare_trends};
