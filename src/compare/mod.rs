//! Compare sets flight against the wind tunnel and against earlier campaigns, derivative by
//! derivative.
//!
//! [`tunnel`] compares the posterior of each derivative at the tunnel's breakpoints, and each
//! maneuver at its own α and Mach number. [`earlier_campaign`] compares trends with those of an
//! earlier campaign. A difference is judged by its standard error. That of the posterior is its
//! standard deviation. That of a maneuver is √(bound² + tunnel's uncertainty²), or its bound if the
//! tunnel states no uncertainty. [`ranges`] puts verdicts into words; [`extrapolation`] lists where
//! the tunnel was read outside its tables.

pub mod earlier_campaign;
pub mod extrapolation;
mod judgement;
pub mod ranges;
mod settings;
mod tunnel;

pub use settings::Settings;
pub use tunnel::{compare_maneuvers, compare_posterior};
